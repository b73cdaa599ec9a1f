//! What a person says about a raw file: how it is written, and which column holds which quantity in which unit.
//!
//! Nothing is guessed: an unmapped column is ignored, a mapped one that is not there is an error unless it is `optional`.

use super::columns::Columns;
use super::mapped::ColumnRef;
use crate::raw::DecimalMark;
use crate::stage::RawFile;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One raw file: delimited text, a workbook, a file of columns, or a topic of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileLayout {
    /// Path of the file: text in UTF-8 (with or without a byte-order mark) or Windows-1252, rows ending in LF or CRLF; a workbook
    /// (.xlsx, .xlsm), a sheet of which is read as text is; a file of columns (Parquet; Feather and streams of Arrow, uncompressed or by zstd; arrays of NumPy, .npz), for which only
    /// `columns` matters: a list of numbers in it is a column for each, `state[1]`, `state[2]` and so on; or a recording of ROS 2 (.mcap, .db3,
    /// or the folder of its parts).
    pub(crate) file: RawFile,
    /// The sheet of a workbook; without it the only visible one with rows of numbers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) sheet: Option<String>,
    /// The topic of a recording of ROS 2 (.mcap, .db3), e.g. `/joint_states`; without it the only one whose type is read. Its fields are the
    /// columns: `received` and `stamp` (s), and by type `shoulder_pan_joint.position`, `point.x`, `data[1]` and so on. Transforms are named
    /// with their frames: `/tf base->tool0`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) topic: Option<String>,
    /// What stands between fields: one ASCII character, `tab`, or `whitespace` (any run of blanks and tabs).
    #[serde(default = "comma")]
    pub(crate) delimiter: String,
    /// The decimal mark of the numbers.
    #[serde(default)]
    pub(crate) decimal: DecimalMark,
    /// Whether a row of column names stands above the data.
    #[serde(default = "yes")]
    pub(crate) header: bool,
    /// Lines to skip above the header (above the data where there is no header).
    #[serde(default)]
    pub(crate) skip: u64,
    /// Lines to skip between header and data, e.g. a row of units.
    #[serde(default)]
    pub(crate) skip_below_header: u64,
    /// Lines that begin with this text are skipped, e.g. `#`.
    #[serde(default)]
    pub(crate) comment: Option<String>,
    /// The header is written as a comment: it begins with the text of `comment`, which is no part of the first name.
    #[serde(default, skip_serializing_if = "is_false")]
    pub(crate) header_in_comment: bool,
    /// Where several targets stand side by side in a row, the columns of each, instead of x, y, z and target under `columns`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) targets: Option<WideTargets>,
    /// Which column holds which quantity.
    pub(crate) columns: Columns,
}

/// What a wide row holds of a recording.
pub(super) const HELD: [&str; 4] = ["x", "y", "z", "target"];

/// What is of one point alone.
pub(super) const SIMULATED: [&str; 3] = ["sim_x", "sim_y", "sim_z"];

/// Columns of the points of several targets; a row of the file becomes one of the recording for each target that was seen in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WideTargets {
    /// Unit of the file's numbers, e.g. `mm`.
    pub(crate) unit: String,
    /// The columns of x, y and z by the target's name, e.g. `{smr1: [X1, Y1, Z1], smr2: [X2, Y2, Z2]}`; blank cells, or a point at 0, 0, 0,
    /// are a target that was not seen.
    pub(crate) columns: BTreeMap<String, [ColumnRef; 3]>,
}

impl FileLayout {
    /// Names of all quantities that the file holds.
    pub(super) fn names(&self) -> Vec<&'static str> {
        let wide = HELD.into_iter().filter(|_| self.targets.is_some());
        self.columns.names().into_iter().chain(wide).collect()
    }
    pub(super) fn has(&self, setting: &str) -> bool {
        self.names().contains(&setting)
    }
}

fn comma() -> String {
    ",".into()
}

fn yes() -> bool {
    true
}

fn is_false(value: &bool) -> bool {
    !value
}

/// An axis of the tracker's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

impl Axis {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

/// How several files become one recording: every other one is joined to the first, whose order the rows keep. A row without its partner
/// in any of them is rejected.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "by", rename_all = "snake_case", deny_unknown_fields)]
pub enum Join {
    /// Rows of equal `point_id`.
    Id {},
    /// Rows nearest in `time`, each being the nearest of the other. Where joint velocities are known (mapped, or by `motion`), the
    /// joints are carried to the moment of the point.
    Time {
        /// Largest difference, s.
        tolerance_s: f64,
        /// Clock of the second file minus clock of the first, s; further files, e.g. a simulation's, have the clock of the first.
        #[serde(default)]
        offset_s: f64,
    },
    /// The n-th data row of one file belongs to the n-th of the others.
    Order {},
    /// No join: one file continues the other, each with all quantities. Any number of files.
    Append {},
}

/// What becomes of rows whose `point_id` occurs more than once in a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Duplicates {
    /// None is used, since nobody can say which is right; of rows that are copies of each other the first.
    #[default]
    Reject,
    /// The first usable one is used.
    First,
    /// The last usable one is used.
    Last,
    /// All are used, e.g. where a point is measured repeatedly (not with a join by id).
    Keep,
}

/// What becomes of rows with a joint beyond the robot's limits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LimitPolicy {
    /// Used, with a warning that counts them; an error where most rows are beyond and the joints may be in another unit.
    #[default]
    Warn,
    /// Rejected.
    Reject,
    /// Used without a word.
    Ignore,
}
