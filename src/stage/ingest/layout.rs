//! What a person says about a raw file: how it is written, and which column holds which quantity in which unit.
//!
//! Nothing is guessed: an unmapped column is ignored, a mapped one that is not there is an error unless it is `optional`.

use super::orientation::OrientationColumns;
use super::slot::{PerJoint, Slot};
use crate::stage::RawFile;
use crate::units::Quantity;
use schemars::JsonSchema;
use serde::de::{self, Deserializer, Unexpected, Visitor};
use serde::{Deserialize, Serialize};
use std::fmt;

/// One raw file: delimited text, or Parquet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileLayout {
    /// Path of the file: text in UTF-8 (with or without a byte-order mark) or Windows-1252, rows ending in LF or CRLF; or a flat
    /// Parquet file, for which only `columns` matters.
    pub file: RawFile,
    /// What stands between fields: one ASCII character, `tab`, or `whitespace` (any run of blanks and tabs).
    #[serde(default = "comma")]
    pub delimiter: String,
    /// The decimal mark of the numbers.
    #[serde(default)]
    pub decimal: Decimal,
    /// Whether a row of column names stands above the data.
    #[serde(default = "yes")]
    pub header: bool,
    /// Lines to skip above the header (above the data where there is no header).
    #[serde(default)]
    pub skip: u64,
    /// Lines to skip between header and data, e.g. a row of units.
    #[serde(default)]
    pub skip_below_header: u64,
    /// Lines that begin with this text are skipped, e.g. `#`.
    #[serde(default)]
    pub comment: Option<String>,
    /// The header is written as a comment: it begins with the text of `comment`, which is no part of the first name.
    #[serde(default, skip_serializing_if = "is_false")]
    pub header_in_comment: bool,
    /// Which column holds which quantity.
    pub columns: Columns,
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

/// The decimal mark.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Decimal {
    /// `0.365`
    #[default]
    Point,
    /// `0,365`
    Comma,
}

/// A column by its name in the header, or by its number from 1.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ColumnRef {
    /// Number from 1.
    Number(u32),
    /// Name in the header, as it stands there (blanks around it do not count).
    Name(String),
}

impl<'de> Deserialize<'de> for ColumnRef {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // By hand, so that the message says what is allowed.
        deserializer.deserialize_any(NameOrNumber)
    }
}

struct NameOrNumber;

impl Visitor<'_> for NameOrNumber {
    type Value = ColumnRef;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a column, or its number from 1")
    }
    fn visit_str<E: de::Error>(self, name: &str) -> Result<ColumnRef, E> {
        Ok(ColumnRef::Name(name.into()))
    }
    fn visit_u64<E: de::Error>(self, number: u64) -> Result<ColumnRef, E> {
        u32::try_from(number).map(ColumnRef::Number).map_err(|_| E::invalid_value(Unexpected::Unsigned(number), &self))
    }
    fn visit_i64<E: de::Error>(self, number: i64) -> Result<ColumnRef, E> {
        u32::try_from(number).map(ColumnRef::Number).map_err(|_| E::invalid_value(Unexpected::Signed(number), &self))
    }
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
    pub column: Option<ColumnRef>,
    /// The text of every row, instead of a column.
    #[serde(default)]
    pub value: Option<String>,
    /// The column may be missing from the file, and its cells may be blank.
    #[serde(default)]
    pub optional: bool,
}

/// A column of whole numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CountColumn {
    /// Name or number of the column.
    pub column: ColumnRef,
}

/// A column of numbers, or the same number for every row of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScalarColumn {
    /// Name or number of the column.
    #[serde(default)]
    pub column: Option<ColumnRef>,
    /// A column whose number is taken off, for lengths: where the file holds the target in `column` and, instead of the measured
    /// point, target less measured point here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minus: Option<ColumnRef>,
    /// A column whose number is added, for lengths: measured point less target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plus: Option<ColumnRef>,
    /// Unit of the column `minus` or `plus`; without it `unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference_unit: Option<String>,
    /// The number of every row, instead of a column.
    #[serde(default)]
    pub value: Option<f64>,
    /// Unit of the file's numbers, e.g. `mm`.
    #[serde(default)]
    pub unit: Option<String>,
    /// The column may be missing from the file, and its cells may be blank.
    #[serde(default)]
    pub optional: bool,
}

/// Columns of numbers, one for each joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointColumns {
    /// A pattern for the names, `{j}` being the joint's number from 1: `q{j}_deg`.
    #[serde(default)]
    pub column: Option<String>,
    /// Names or numbers of the columns from the first joint to the last, instead of a pattern.
    #[serde(default)]
    pub columns: Option<Vec<ColumnRef>>,
    /// Unit of the file's numbers; for positions and velocities that of the revolute joints, e.g. `deg`.
    #[serde(default)]
    pub unit: Option<String>,
    /// Unit of the positions or velocities of prismatic joints, e.g. `mm`.
    #[serde(default)]
    pub linear_unit: Option<String>,
    /// The columns may be missing from the file, and their cells may be blank.
    #[serde(default)]
    pub optional: bool,
}

/// Which column holds which quantity; what is not named here is not read.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Columns {
    /// Name of the point; without it rows are called `row 17`.
    pub point_id: Option<TextColumn>,
    /// Order of the recording, strictly increasing; without it the number of the data row, from 1.
    pub sequence: Option<CountColumn>,
    /// What the recording itself says a row is for, e.g. `fit` or `validate`.
    pub usage: Option<TextColumn>,
    /// When the row was recorded.
    pub time: Option<ScalarColumn>,
    /// Mass at the tool.
    pub payload: Option<ScalarColumn>,
    /// Temperature of the arm or of the room.
    pub temperature: Option<ScalarColumn>,
    /// Measured point, x in the tracker's frame.
    pub x: Option<ScalarColumn>,
    /// Measured point, y in the tracker's frame.
    pub y: Option<ScalarColumn>,
    /// Measured point, z in the tracker's frame.
    pub z: Option<ScalarColumn>,
    /// The same point by another simulation, x in any frame fixed to the robot's base: `diagnose` then looks at measured minus simulated.
    pub sim_x: Option<ScalarColumn>,
    /// The same point by another simulation, y.
    pub sim_y: Option<ScalarColumn>,
    /// The same point by another simulation, z.
    pub sim_z: Option<ScalarColumn>,
    /// Standard deviation of x.
    pub sigma_x: Option<ScalarColumn>,
    /// Standard deviation of y.
    pub sigma_y: Option<ScalarColumn>,
    /// Standard deviation of z.
    pub sigma_z: Option<ScalarColumn>,
    /// Which of several targets on the tool was measured; blank for the robot's tool point.
    pub target: Option<TextColumn>,
    /// Orientation of the target in the tracker's frame.
    pub orientation: Option<OrientationColumns>,
    /// Standard deviation of the orientation about each axis.
    pub sigma_orientation: Option<ScalarColumn>,
    /// Distance of the target from an anchor: a draw-wire or ballbar.
    pub distance: Option<ScalarColumn>,
    /// Standard deviation of the distance.
    pub sigma_distance: Option<ScalarColumn>,
    /// Which of several anchors the distance goes to; their places are estimated.
    pub anchor: Option<TextColumn>,
    /// Joint positions.
    pub q: Option<JointColumns>,
    /// Motor currents.
    pub current: Option<JointColumns>,
    /// Direction of the last move of each joint: 1, -1 or 0; no unit.
    pub direction: Option<JointColumns>,
    /// Joint velocities while the point was measured, where the arm moved: `{column: "dq{j}", unit: deg/s}`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<JointColumns>,
}

/// An axis of the tracker's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    X,
    Y,
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
pub enum Limits {
    /// Used, with a warning that counts them; most rows beyond the limits is an error.
    #[default]
    Warn,
    /// Rejected.
    Reject,
    /// Used without a word.
    Ignore,
}

impl ScalarColumn {
    /// The column that is added to `column`, or taken off (-1).
    pub(super) fn difference(&self) -> Option<(&ColumnRef, f64)> {
        self.minus.as_ref().map(|column| (column, -1.0)).or_else(|| self.plus.as_ref().map(|column| (column, 1.0)))
    }
}

impl Columns {
    /// The mapped texts.
    pub(super) fn texts(&self) -> Vec<(&'static str, &TextColumn)> {
        let all = [("point_id", &self.point_id), ("usage", &self.usage), ("target", &self.target), ("anchor", &self.anchor)];
        all.into_iter().filter_map(|(name, column)| Some((name, column.as_ref()?))).collect()
    }
    /// The mapped single numbers: setting, column, quantity, slot.
    pub(super) fn scalars(&self) -> Vec<(&'static str, &ScalarColumn, Quantity, Slot)> {
        [
            ("time", &self.time, Quantity::Time, Slot::Time),
            ("payload", &self.payload, Quantity::Mass, Slot::Payload),
            ("temperature", &self.temperature, Quantity::Temperature, Slot::Temperature),
            ("x", &self.x, Quantity::Length, Slot::Position(0)),
            ("y", &self.y, Quantity::Length, Slot::Position(1)),
            ("z", &self.z, Quantity::Length, Slot::Position(2)),
            ("sim_x", &self.sim_x, Quantity::Length, Slot::Simulated(0)),
            ("sim_y", &self.sim_y, Quantity::Length, Slot::Simulated(1)),
            ("sim_z", &self.sim_z, Quantity::Length, Slot::Simulated(2)),
            ("sigma_x", &self.sigma_x, Quantity::Length, Slot::Sigma(0)),
            ("sigma_y", &self.sigma_y, Quantity::Length, Slot::Sigma(1)),
            ("sigma_z", &self.sigma_z, Quantity::Length, Slot::Sigma(2)),
            ("sigma_orientation", &self.sigma_orientation, Quantity::Angle, Slot::SigmaTurn),
            ("distance", &self.distance, Quantity::Length, Slot::Distance),
            ("sigma_distance", &self.sigma_distance, Quantity::Length, Slot::SigmaDistance),
        ]
        .into_iter()
        .filter_map(|(name, column, quantity, slot)| column.as_ref().map(|column| (name, column, quantity, slot)))
        .collect()
    }
    /// The mapped numbers per joint.
    pub(super) fn per_joint(&self) -> Vec<PerJoint<'_>> {
        let listed = [
            ("q", &self.q, Quantity::Angle, Slot::Q as fn(usize) -> Slot),
            ("current", &self.current, Quantity::Current, Slot::Current),
            ("direction", &self.direction, Quantity::Number, Slot::Direction),
            ("velocity", &self.velocity, Quantity::AngularRate, Slot::Velocity),
        ];
        let mapped = listed.into_iter().filter_map(|(name, columns, quantity, slot)| {
            columns.as_ref().map(|columns| PerJoint { name, columns, quantity, slot })
        });
        mapped.collect()
    }
    /// Names of all mapped quantities.
    pub(super) fn names(&self) -> Vec<&'static str> {
        let mut names: Vec<&'static str> = Vec::new();
        names.extend(self.texts().into_iter().map(|(name, _)| name));
        names.extend(self.sequence.as_ref().map(|_| "sequence"));
        names.extend(self.orientation.as_ref().map(|_| "orientation"));
        names.extend(self.scalars().iter().map(|mapped| mapped.0));
        names.extend(self.per_joint().iter().map(|mapped| mapped.name));
        names
    }
}
