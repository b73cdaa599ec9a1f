//! Where a quantity stands in a file: a column or several of them, or one value for every row.

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
    pub column: Option<ColumnRef>,
    /// The text of every row, instead of a column.
    #[serde(default)]
    pub value: Option<String>,
    /// The text of every row by the path of the file: what stands for the braces at its end, e.g. `"{position}/hole_{n}.csv"` names the
    /// rows of `data/front/hole_0.csv` `front/0`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
    /// The column may be missing from the file, and its cells may be blank.
    #[serde(default)]
    pub optional: bool,
    /// What of a name counts, for `point_id`: `number` for its last whole number, so that `Pose 17` and `pt_017` are one point; without
    /// it, the whole name.
    #[serde(default, rename = "match", skip_serializing_if = "Option::is_none")]
    pub matching: Option<NameMatch>,
    /// What is taken off the beginning of every name, for `point_id`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strip: Option<String>,
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
    /// For `time`, instead of a column: rows a second, Hz, of a file whose rows come evenly; the first is at 0 s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
    /// Unit of the file's numbers, e.g. `mm`; `clock` where a time is a time of day (08:15:03) or a date with a time (ISO 8601).
    #[serde(default)]
    pub unit: Option<String>,
    /// The column may be missing from the file, and its cells may be blank.
    #[serde(default)]
    pub optional: bool,
}

/// A column of uncertainties, or the same uncertainty for every row of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UncertaintyColumn {
    /// Name or number of the column.
    #[serde(default)]
    pub column: Option<ColumnRef>,
    /// The uncertainty of every row, instead of a column.
    #[serde(default)]
    pub value: Option<f64>,
    /// Unit of the file's numbers, e.g. `mm`.
    #[serde(default)]
    pub unit: Option<String>,
    /// How many standard deviations the numbers are; without it 2 for `u95`, 1 for `u`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage_factor: Option<f64>,
    /// The column may be missing from the file, and its cells may be blank.
    #[serde(default)]
    pub optional: bool,
}

/// Columns of numbers, one for each joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointColumns {
    /// A pattern for the names, `{j}` being the joint's number from 1: `q{j}_deg`; `{name}` is its name in the robot file:
    /// `{name}.position`.
    #[serde(default)]
    pub column: Option<String>,
    /// Names or numbers of the columns from the first joint to the last, instead of a pattern.
    #[serde(default)]
    pub columns: Option<Vec<ColumnRef>>,
    /// Unit of the file's numbers; for positions and velocities that of the revolute joints, e.g. `deg`.
    #[serde(default)]
    pub unit: Option<String>,
    /// What an encoder counts in a turn of the joint, instead of `unit` for positions and velocities of revolute joints, e.g. 4096.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts_per_turn: Option<f64>,
    /// Unit of the positions, velocities or forces of prismatic joints, e.g. `mm`, `mm/s`, `N`.
    #[serde(default)]
    pub linear_unit: Option<String>,
    /// 1 or -1 for each joint: -1 where the file counts the other way than the robot file, e.g. `[1, 1, -1, 1, 1, 1]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sign: Vec<f64>,
    /// What the file shows where the robot file has its zero; for positions alone, for each joint in the unit of the column, e.g.
    /// `[0, -90, 0, 0, 0, 0]`. A position is `sign * (file - zero)`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zero: Vec<f64>,
    /// Positions that hold a part of another joint's, as where a controller reports joint 3 against the horizon; the part is taken off.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coupled: Vec<CoupledColumn>,
    /// For `torque`, instead of its columns: the duty (share of the supply) that a dc motor is driven with, a pattern or a list of columns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duty: Option<JointNames>,
    /// What the file shows at full duty, e.g. 100 for percent; without it 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_duty: Option<f64>,
    /// For `torque`, instead of its columns: the voltage of a dc motor, V, a pattern or a list of columns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voltage: Option<JointNames>,
    /// The supply of the motors, V: a number, or a column.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supply: Option<Supply>,
    /// Nm at the joint per volt (torque constant over resistance, times the ratio of the gear), for all joints or for each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kt_over_r: Option<PerJoint>,
    /// Nm s/rad at the joint that the voltage of the turning motor takes (torque constant squared over resistance, times the ratio squared);
    /// without it, it is found as viscous friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kt2_over_r: Option<PerJoint>,
    /// The columns may be missing from the file, and their cells may be blank.
    #[serde(default)]
    pub optional: bool,
}

/// Columns, one for each joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a pattern such as `duty{j}`, or a list of columns"
)]
pub enum JointNames {
    /// A pattern as of `column`.
    Pattern(String),
    /// Names or numbers from the first joint to the last.
    List(Vec<ColumnRef>),
}

/// The supply of motors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected volts, or `{column: ...}`")]
pub enum Supply {
    /// V, the same in every row.
    Volts(f64),
    /// A column of volts.
    Column(SupplyColumn),
}

/// A column of the supply, V.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SupplyColumn {
    /// Name or number of the column.
    pub column: ColumnRef,
    /// V per unit of the file, e.g. 0.1 where it counts tenths; without it 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
}

/// A number for all joints, or one for each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a number, or a list of one for each joint"
)]
pub enum PerJoint {
    /// For all.
    All(f64),
    /// From the first joint to the last.
    Each(Vec<f64>),
}

impl PerJoint {
    /// Of a joint, from 0; none beyond the list.
    pub(super) fn of(&self, joint: usize) -> Option<f64> {
        match self {
            Self::All(number) => Some(*number),
            Self::Each(all) => all.get(joint).copied(),
        }
    }
    /// All that are stated.
    pub(super) fn stated(&self) -> &[f64] {
        match self {
            Self::All(number) => std::slice::from_ref(number),
            Self::Each(all) => all,
        }
    }
}

impl JointColumns {
    /// What drives a motor instead of a torque, and its setting.
    pub(super) fn drive(&self) -> Option<(&JointNames, &'static str)> {
        let duty = self.duty.as_ref().map(|names| (names, "duty"));
        duty.or_else(|| Some((self.voltage.as_ref()?, "voltage")))
    }
}

/// The column of joint `joint` holds `ratio` times the position of joint `by` beside its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoupledColumn {
    /// Number of the joint, from 1.
    pub joint: usize,
    /// Number of the joint whose position is in its column, from 1.
    pub by: usize,
    /// How often it is, e.g. 1 or -1.
    pub ratio: f64,
}

/// Columns of a quantity of several numbers, by convention.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ConventionColumns {
    /// Setting -> columns of the file.
    #[serde(flatten)]
    pub columns: BTreeMap<&'static str, Vec<ColumnRef>>,
    /// Unit of the numbers, e.g. `deg`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// The cells may be blank: the row has none.
    pub optional: bool,
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
