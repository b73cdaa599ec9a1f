//! The table-schema dialect of `schemas/*.json`: columns with type, unit, meaning, key, range and diff tolerance.
//!
//! A `per_joint` field stands for `{j}` = 1..n, n being counted in the frame; of `per_joint` fields with the same `either`
//! every joint has exactly one; an `optional` field, or all of one `either`, may be absent (for all joints or for none).

use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::LazyLock;

use arrow::datatypes::{DataType, Field};

use crate::error::{Error, Result};
use crate::units::Unit;
use calib_schemas::SCHEMAS;

static PARSED: LazyLock<BTreeMap<String, TableSchema>> = LazyLock::new(|| {
    let parse = |text: &&str| TableSchema::parse(text).expect("embedded schemas are valid");
    SCHEMAS
        .iter()
        .map(parse)
        .map(|schema| (schema.name.clone(), schema))
        .collect()
});

/// All schemas, by kind.
pub fn all() -> impl Iterator<Item = &'static TableSchema> {
    PARSED.values()
}

/// The schema of a table kind.
pub fn of(kind: &str) -> Result<&'static TableSchema> {
    PARSED
        .get(kind)
        .ok_or_else(|| Error::Bug(format!("no schema for table kind {kind}")))
}

/// What a table of one kind holds.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableSchema {
    /// Name of the kind of table.
    pub name: String,
    /// Version of the schema.
    pub version: Version,
    /// What a row is.
    pub description: String,
    /// Whether people gave its values, so that one out of range is theirs to mend; else it is a bug of the stage that made it.
    #[serde(default)]
    pub given: bool,
    /// Columns that tell every row from every other.
    pub primary_key: Vec<String>,
    /// Columns that rows are in ascending order of: the primary key in some order.
    pub sort: Vec<String>,
    /// In the order of the file.
    pub fields: Vec<FieldSchema>,
}

/// What a column, or a family of per-joint columns, holds.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldSchema {
    /// Name of the column; `{j}` stands for a joint.
    pub name: String,
    /// As it is stored.
    #[serde(rename = "type")]
    pub column_type: ColumnType,
    /// Whether null is allowed: nothing is known.
    #[serde(default)]
    pub nullable: bool,
    /// Symbol of a stored unit; `row` where the row says it in its own `unit` column.
    #[serde(default)]
    pub unit: Option<String>,
    /// What the column means.
    pub description: String,
    /// `angle`, `quaternion`, `json`, `unit`: how values compare.
    #[serde(default)]
    pub semantic: Option<String>,
    /// What values are allowed.
    #[serde(default)]
    pub constraints: Constraints,
    /// Which differences do not count.
    #[serde(default)]
    pub diff: Tolerance,
    /// Whether files without the column are read too.
    #[serde(default)]
    pub optional: bool,
    /// Whether it is a column for each joint.
    #[serde(default)]
    pub per_joint: bool,
    /// Group of columns of which each joint has one, by the kind of the joint.
    #[serde(default)]
    pub either: Option<String>,
}

/// Types of stored columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ColumnType {
    /// Text.
    Utf8,
    /// Whole numbers.
    Int64,
    /// Numbers; no NaN, no infinity.
    Float64,
    /// True or false.
    Boolean,
}

/// Allowed values; bounds are inclusive.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constraints {
    /// Least value.
    #[serde(default)]
    pub min: Option<f64>,
    /// Largest value.
    #[serde(default)]
    pub max: Option<f64>,
    /// Words that are allowed; any where there are none.
    #[serde(default, rename = "enum")]
    pub values: Vec<String>,
}

/// Differences that a comparison of two tables overlooks, in the unit of the column, and what it measures them by.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    /// In the unit of the column.
    #[serde(default)]
    pub atol: f64,
    /// As a share of the larger value.
    #[serde(default)]
    pub rtol: f64,
    /// The column that holds one standard deviation of this one.
    #[serde(default)]
    pub sigma: Option<String>,
}

/// `major.minor.patch`: a new nullable column is a minor step, any other change of columns a major one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// Readers of another one refuse the table.
    pub major: u32,
    /// Columns were added.
    pub minor: u32,
    /// Descriptions changed.
    pub patch: u32,
}

impl Version {
    /// The version of a text like `1.0.0`.
    pub fn parse(text: &str) -> Option<Self> {
        let mut parts = text.split('.').map(|part| part.parse::<u32>().ok());
        let version = Self {
            major: parts.next()??,
            minor: parts.next()??,
            patch: parts.next()??,
        };
        parts.next().is_none().then_some(version)
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

impl<'de> Deserialize<'de> for Version {
    fn deserialize<D: serde::Deserializer<'de>>(
        deserializer: D,
    ) -> std::result::Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).ok_or_else(|| {
            serde::de::Error::custom(format!("`{text}` is not a version like 1.0.0"))
        })
    }
}

impl ColumnType {
    /// The type as Arrow has it.
    pub fn arrow(self) -> DataType {
        match self {
            Self::Utf8 => DataType::Utf8,
            Self::Int64 => DataType::Int64,
            Self::Float64 => DataType::Float64,
            Self::Boolean => DataType::Boolean,
        }
    }
}

impl TableSchema {
    /// Reads a schema file; the error names the fault of the file.
    pub fn parse(text: &str) -> Result<Self> {
        let schema: Self =
            serde_json::from_str(text).map_err(|e| Error::Bug(format!("table schema: {e}")))?;
        match schema.fault() {
            Some(fault) => Err(Error::Bug(format!("table schema {}: {fault}", schema.name))),
            None => Ok(schema),
        }
    }

    /// `recording/1.0.0`.
    pub fn id(&self) -> String {
        format!("{}/{}", self.name, self.version)
    }

    /// The field that a column belongs to, with the joint (from 1) of a per-joint column.
    pub fn field_of(&self, column: &str) -> Option<(&FieldSchema, Option<usize>)> {
        self.fields
            .iter()
            .find_map(|field| match field.joint_of(column) {
                Some(joint) => Some((field, Some(joint))),
                None => (!field.per_joint && field.name == column).then_some((field, None)),
            })
    }

    fn fault(&self) -> Option<String> {
        let mut sorted = (self.primary_key.clone(), self.sort.clone());
        sorted.0.sort();
        sorted.1.sort();
        if self.primary_key.is_empty() || sorted.0 != sorted.1 {
            return Some("`sort` must name the columns of `primary_key`".into());
        }
        for key in &self.primary_key {
            match self.fields.iter().find(|field| &field.name == key) {
                Some(field) if !field.nullable && !field.optional && !field.per_joint => (),
                _ => {
                    return Some(format!(
                        "key column `{key}` must be there and neither nullable, optional nor per_joint"
                    ));
                }
            }
        }
        let fault_of = |field: &FieldSchema| {
            field
                .fault()
                .map(|fault| format!("field {}: {fault}", field.name))
        };
        self.fields.iter().find_map(fault_of)
    }
}

impl FieldSchema {
    /// The joint (from 1) that `column` is for, if it is a column of this per-joint field.
    pub fn joint_of(&self, column: &str) -> Option<usize> {
        let (prefix, suffix) = self.name.split_once("{j}")?;
        let digits = column.strip_prefix(prefix)?.strip_suffix(suffix)?;
        let joint = digits.parse::<usize>().ok()?;
        (joint >= 1 && joint.to_string() == digits).then_some(joint)
    }

    /// The column of this field for a joint (from 1).
    pub fn column(&self, joint: Option<usize>) -> String {
        match joint {
            Some(joint) => self.name.replace("{j}", &joint.to_string()),
            None => self.name.clone(),
        }
    }

    /// The Arrow field of a column, with unit, description and semantic as metadata.
    pub fn arrow(&self, joint: Option<usize>) -> Field {
        let number = joint.map_or(String::new(), |joint| joint.to_string());
        let mut metadata = vec![(
            "description".to_string(),
            self.description.replace("{j}", &number),
        )];
        metadata.extend(
            self.unit
                .iter()
                .map(|unit| ("unit".to_string(), unit.clone())),
        );
        metadata.extend(
            self.semantic
                .iter()
                .map(|semantic| ("semantic".to_string(), semantic.clone())),
        );
        Field::new(self.column(joint), self.column_type.arrow(), self.nullable)
            .with_metadata(metadata.into_iter().collect())
    }

    fn fault(&self) -> Option<String> {
        let Constraints { min, max, values } = &self.constraints;
        let unit_known = self
            .unit
            .as_deref()
            .is_none_or(|unit| unit == "row" || Unit::parse(unit).is_some());
        let numeric = matches!(self.column_type, ColumnType::Int64 | ColumnType::Float64);
        if self.per_joint != self.name.contains("{j}") {
            return Some("`per_joint` needs `{j}` in the name".into());
        }
        if self.either.is_some() && !self.per_joint {
            return Some("`either` needs `per_joint`".into());
        }
        if !unit_known {
            return Some(format!(
                "unit `{}` is unknown",
                self.unit.as_deref().unwrap_or_default()
            ));
        }
        if (self.column_type == ColumnType::Float64) != self.unit.is_some() {
            return Some("float64 columns, and only they, have a `unit`".into());
        }
        if (min.is_some() || max.is_some()) && !numeric
            || !values.is_empty() && self.column_type != ColumnType::Utf8
        {
            return Some("`min` and `max` are for numbers, `enum` for text".into());
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_schema_is_valid_and_its_name_is_unique() {
        for text in SCHEMAS {
            TableSchema::parse(text).unwrap();
        }
        assert_eq!(all().count(), SCHEMAS.len());
    }

    #[test]
    fn a_stored_unit_is_the_end_of_the_column_name() {
        let endings = [
            ("mm", "_mm"),
            ("rad", "_rad"),
            ("kg", "_kg"),
            ("s", "_s"),
            ("C", "_c"),
            ("A", "_a"),
            ("Nm/A", "_nm_a"),
            ("m/s2", "_m_s2"),
            ("rad/s", "_rad_s"),
            ("mm/s", "_mm_s"),
            ("Nm", "_nm"),
            ("N", "_n"),
            ("Hz", "_hz"),
            ("kg m2", "_kg_m2"),
        ];
        for schema in all() {
            for field in &schema.fields {
                match field.unit.as_deref() {
                    None | Some("1" | "row") => {
                        assert!(
                            !endings.iter().any(|(_, end)| field.name.ends_with(end)),
                            "{}",
                            field.name
                        )
                    }
                    Some(unit) => {
                        let (_, end) = endings
                            .iter()
                            .find(|(symbol, _)| *symbol == unit)
                            .expect(unit);
                        assert!(
                            field.name.ends_with(end),
                            "{}.{} in {unit}",
                            schema.name,
                            field.name
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_column_of_a_joint_is_told_from_its_neighbours() {
        let recording = of("recording").unwrap();
        let joint = |column| {
            recording
                .field_of(column)
                .map(|(field, joint)| (field.name.as_str(), joint))
        };
        assert_eq!(joint("q12_rad"), Some(("q{j}_rad", Some(12))));
        assert_eq!(joint("dir3"), Some(("dir{j}", Some(3))));
        assert_eq!(joint("x_mm"), Some(("x_mm", None)));
        assert_eq!(
            (
                joint("q0_rad"),
                joint("q01_rad"),
                joint("q{j}_rad"),
                joint("q_rad")
            ),
            (None, None, None, None)
        );
    }

    #[test]
    fn a_faulty_schema_is_refused() {
        let with = |field: &str| {
            format!(
                r#"{{"name":"t","version":"1.0.0","description":"","primary_key":["a"],"sort":["a"],"fields":[{{"name":"a","type":"int64","description":""}},{field}]}}"#
            )
        };
        for (field, says) in [
            (r#"{"name":"x","type":"float64","description":""}"#, "unit"),
            (
                r#"{"name":"x","type":"float64","unit":"furlong","description":""}"#,
                "furlong",
            ),
            (
                r#"{"name":"x","type":"float64","unit":"mm","per_joint":true,"description":""}"#,
                "{j}",
            ),
            (
                r#"{"name":"x","type":"utf8","constraints":{"min":1},"description":""}"#,
                "min",
            ),
            (
                r#"{"name":"x","type":"utf8","descripton":""}"#,
                "descripton",
            ),
        ] {
            assert!(
                TableSchema::parse(&with(field))
                    .unwrap_err()
                    .to_string()
                    .contains(says),
                "{field}"
            );
        }
    }
}
