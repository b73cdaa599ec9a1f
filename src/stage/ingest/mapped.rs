//! Where a quantity stands in a file: a column or several of them, or one value for every row.
//!
//! What a person says about a raw file: how it is written, and which column holds which quantity in which unit.
//!
//! Nothing is guessed: an unmapped column is ignored, a mapped one that is not there is an error unless it is `optional`.

use crate::raw::DecimalMark;
use crate::stage::RawFile;
use crate::stage::ingest::columns::Columns;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// A column by its name in the header, or by its number from 1.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected the name of a column, or its number from 1"
)]
pub enum ColumnRef {
    /// Number from 1.
    Number(u32),
    /// Name in the header, as it stands there (blanks around it do not count).
    Name(String),
}

impl fmt::Display for ColumnRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "column {number}"),
            Self::Name(name) => write!(f, "column `{name}`"),
        }
    }
}

/// A column of text, or the same text for every row of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TextColumn {
    /// Name or number of the column.
    #[serde(default)]
    pub(crate) column: Option<ColumnRef>,
    /// The text of every row, instead of a column.
    #[serde(default)]
    pub(crate) value: Option<String>,
    /// The text of every row by the path of the file: what stands for the braces at its end, e.g. `"{position}/hole_{n}.csv"` names the
    /// rows of `data/front/hole_0.csv` `front/0`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) path: Option<String>,
    /// The column may be missing from the file, and its cells may be blank.
    #[serde(default)]
    pub(crate) optional: bool,
    /// What of a name counts, for `point_id`: `number` for its last whole number, so that `Pose 17` and `pt_017` are one point; without
    /// it, the whole name.
    #[serde(default, rename = "match", skip_serializing_if = "Option::is_none")]
    pub(crate) matching: Option<NameMatch>,
    /// What is taken off the beginning of every name, for `point_id`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) strip: Option<String>,
}

/// What of a point's name counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NameMatch {
    /// Its last whole number, without zeros in front.
    Number,
}

impl TextColumn {
    /// What of a name counts; none where it has no number, and one is asked for.
    pub(super) fn counts<'a>(&self, name: &'a str) -> Option<&'a str> {
        let prefix = self.strip.as_deref();
        let stripped = prefix.and_then(|prefix| name.strip_prefix(prefix));
        let stripped = stripped.unwrap_or(name);
        match self.matching {
            None => Some(stripped),
            Some(NameMatch::Number) => last_number(stripped),
        }
    }
}

/// The last whole number in a name, without zeros in front.
pub fn last_number(name: &str) -> Option<&str> {
    let end = name.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = name[..end]
        .trim_end_matches(|c: char| c.is_ascii_digit())
        .len();
    let digits = name[start..end].trim_start_matches('0');
    Some(if digits.is_empty() { "0" } else { digits })
}

/// A column of whole numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CountColumn {
    /// Name or number of the column.
    pub(crate) column: ColumnRef,
}

/// A column of numbers, or the same number for every row of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScalarColumn {
    /// Name or number of the column.
    #[serde(default)]
    pub(crate) column: Option<ColumnRef>,
    /// A column whose number is taken off, for lengths: where the file holds the target in `column` and, instead of the measured
    /// point, target less measured point here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) minus: Option<ColumnRef>,
    /// A column whose number is added, for lengths: measured point less target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) plus: Option<ColumnRef>,
    /// Unit of the column `minus` or `plus`; without it `unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) difference_unit: Option<String>,
    /// The number of every row, instead of a column.
    #[serde(default)]
    pub(crate) value: Option<f64>,
    /// Unit of the file's numbers, e.g. `mm`; `clock` where a time is a time of day (08:15:03) or a date with a time (ISO 8601).
    #[serde(default)]
    pub(crate) unit: Option<String>,
    /// The column may be missing from the file, and its cells may be blank.
    #[serde(default)]
    pub(crate) optional: bool,
}

/// A column of uncertainties, or the same uncertainty for every row of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UncertaintyColumn {
    /// Name or number of the column.
    #[serde(default)]
    pub(crate) column: Option<ColumnRef>,
    /// The uncertainty of every row, instead of a column.
    #[serde(default)]
    pub(crate) value: Option<f64>,
    /// Unit of the file's numbers, e.g. `mm`.
    #[serde(default)]
    pub(crate) unit: Option<String>,
    /// How many standard deviations the numbers are; without it 2 for `u95`, 1 for `u`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) coverage_factor: Option<f64>,
    /// The column may be missing from the file, and its cells may be blank.
    #[serde(default)]
    pub(crate) optional: bool,
}

/// Columns of numbers, one for each joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointColumns {
    /// A pattern for the names, `{j}` being the joint's number from 1: `q{j}_deg`; `{name}` is its name in the robot file:
    /// `{name}.position`.
    #[serde(default)]
    pub(crate) column: Option<String>,
    /// Names or numbers of the columns from the first joint to the last, instead of a pattern.
    #[serde(default)]
    pub(crate) columns: Option<Vec<ColumnRef>>,
    /// Unit of the file's numbers; for positions and velocities that of the revolute joints, e.g. `deg`.
    #[serde(default)]
    pub(crate) unit: Option<String>,
    /// Unit of the positions or velocities of prismatic joints, e.g. `mm`.
    #[serde(default)]
    pub(crate) linear_unit: Option<String>,
    /// 1 or -1 for each joint: -1 where the file counts the other way than the robot file, e.g. `[1, 1, -1, 1, 1, 1]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) sign: Vec<f64>,
    /// What the file shows where the robot file has its zero; for positions alone, for each joint in the unit of the column, e.g.
    /// `[0, -90, 0, 0, 0, 0]`. A position is `sign * (file - zero)`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) zero: Vec<f64>,
    /// Positions that hold a part of another joint's, as where a controller reports joint 3 against the horizon; the part is taken off.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) coupled: Vec<CoupledColumn>,
    /// The columns may be missing from the file, and their cells may be blank.
    #[serde(default)]
    pub(crate) optional: bool,
}

/// The column of joint `joint` holds `ratio` times the position of joint `by` beside its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoupledColumn {
    /// Number of the joint, from 1.
    pub(crate) joint: usize,
    /// Number of the joint whose position is in its column, from 1.
    pub(crate) by: usize,
    /// How often it is, e.g. 1 or -1.
    pub(crate) ratio: f64,
}

/// Columns of a quantity of several numbers, by convention.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ConventionColumns {
    /// Setting -> columns of the file.
    #[serde(flatten)]
    pub(crate) columns: BTreeMap<&'static str, Vec<ColumnRef>>,
    /// Unit of the numbers, e.g. `deg`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unit: Option<String>,
    /// The cells may be blank: the row has none.
    pub(crate) optional: bool,
}

impl ScalarColumn {
    /// The column that is added to `column`, or taken off (-1).
    pub(super) fn difference(&self) -> Option<(&ColumnRef, f64)> {
        self.minus
            .as_ref()
            .map(|column| (column, -1.0))
            .or_else(|| self.plus.as_ref().map(|column| (column, 1.0)))
    }
}

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

#[cfg(test)]
mod tests {
    use super::{TextColumn, last_number};

    #[test]
    fn names_count_by_their_last_number_or_without_a_prefix() {
        for (name, counts) in [
            ("Pose 17", Some("17")),
            ("pt_017", Some("17")),
            ("A1-008b", Some("8")),
            ("P\u{e4}000", Some("0")),
            ("home", None),
        ] {
            assert_eq!(last_number(name), counts, "{name}");
        }
        let strip: TextColumn = serde_json::from_str(r#"{"column": 1, "strip": "pt_"}"#).unwrap();
        assert_eq!(
            [strip.counts("pt_17"), strip.counts("17")],
            [Some("17"), Some("17")]
        );
    }
}
