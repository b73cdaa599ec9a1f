//! Which column of a file holds which quantity: the block `columns`, by the columns that a recording declares.
//!
//! Nothing is guessed: an unmapped column is ignored, a mapped one that is not there is an error unless it is `optional`.

use crate::RawFile;
use crate::ingest::mapped::{
    ColumnRef, ConventionColumns, CountColumn, JointColumns, ScalarColumn, TextColumn,
    UncertaintyColumn,
};
use crate::observation::{ColumnShape, Convention, Conventions, DeclaredColumn};
use crate::raw::DecimalMark;
use crate::table::recording_columns;
use calib_foundation::named;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::LazyLock;

/// Which column holds which quantity; what is not named here is not read. In the order of the declared columns.
#[derive(Debug, Clone, Default)]
pub struct Columns(Vec<(&'static DeclaredColumn, Mapped)>);

/// Where a quantity stands in a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
enum Mapped {
    Text(TextColumn),
    Count(CountColumn),
    Number(ScalarColumn),
    Joints(JointColumns),
    Conventions(ConventionColumns),
    Uncertainty(UncertaintyColumn),
}

/// All mapped columns of a kind, and the one of a setting.
macro_rules! mapped {
    ($($all:ident, $one:ident: $variant:ident($type:ty);)*) => {$(
        pub(super) fn $all(&self) -> impl Iterator<Item = (&'static DeclaredColumn, &$type)> {
            self.0.iter().filter_map(|(column, mapped)| match mapped {
                Mapped::$variant(mapped) => Some((*column, mapped)),
                _ => None,
            })
        }
        pub(super) fn $one(&self, setting: &str) -> Option<&$type> {
            self.$all().find(|(column, _)| column.setting == setting).map(|(_, mapped)| mapped)
        }
    )*};
}

type MappedConventions<'c> = (
    &'static DeclaredColumn,
    &'static Conventions,
    &'c ConventionColumns,
);
type MappedUncertainty<'c> = (
    &'static DeclaredColumn,
    &'c UncertaintyColumn,
    &'static [&'static str],
    f64,
);

impl Columns {
    /// All mapped quantities by their settings.
    fn by_setting(&self) -> impl Iterator<Item = (&'static str, &Mapped)> {
        let all = self.0.iter();
        all.map(|(column, mapped)| (column.setting, mapped))
    }

    mapped! {
        texts, text: Text(TextColumn);
        counts, count: Count(CountColumn);
        numbers, number: Number(ScalarColumn);
        joints, joint: Joints(JointColumns);
    }

    /// The mapped quantities of several numbers.
    pub(super) fn conventions(&self) -> impl Iterator<Item = MappedConventions<'_>> {
        let all = self.0.iter();
        all.filter_map(|(column, mapped)| match (column.shape, mapped) {
            (ColumnShape::Conventions(conventions), Mapped::Conventions(mapped)) => {
                Some((*column, conventions, mapped))
            }
            _ => None,
        })
    }

    /// The mapped uncertainties, with the settings that each stands for and how many standard deviations it is.
    pub(super) fn uncertainties(&self) -> impl Iterator<Item = MappedUncertainty<'_>> {
        let all = self.0.iter();
        all.filter_map(|(column, mapped)| match (column.shape, mapped) {
            (ColumnShape::Uncertainty { columns, coverage }, Mapped::Uncertainty(mapped)) => {
                let factor = mapped.coverage_factor.unwrap_or(coverage);
                Some((*column, mapped, columns, factor))
            }
            _ => None,
        })
    }

    pub(super) fn has(&self, setting: &str) -> bool {
        self.by_setting().any(|(other, _)| other == setting)
    }

    /// Names of all mapped quantities.
    pub(super) fn names(&self) -> Vec<&'static str> {
        self.by_setting().map(|(setting, _)| setting).collect()
    }

    /// The same with another target in every row, where one is mapped.
    pub(super) fn of_target(&self, name: &str) -> Self {
        let mut all = self.clone();
        for (column, mapped) in &mut all.0 {
            if let ("target", Mapped::Text(text)) = (column.setting, mapped) {
                (text.column, text.path, text.value) = (None, None, Some(name.into()));
            }
        }
        all
    }

    /// What does not depend on the robot's joints.
    pub(super) fn without_joints(&self) -> Self {
        let mut all = self.clone();
        all.0
            .retain(|(_, mapped)| !matches!(mapped, Mapped::Joints(_)));
        all
    }
}

impl PartialEq for Columns {
    fn eq(&self, other: &Self) -> bool {
        self.by_setting().eq(other.by_setting())
    }
}

impl ConventionColumns {
    /// The convention with its columns; none unless exactly one is given.
    pub(super) fn chosen(
        &self,
        conventions: &'static Conventions,
    ) -> Option<(&'static Convention, &[ColumnRef])> {
        let mut given = self.columns.iter();
        let (name, columns) = given.next().filter(|_| given.next().is_none())?;
        let mut all = conventions.all.iter();
        let convention = all.find(|convention| convention.name == *name)?;
        Some((convention, columns.as_slice()))
    }
}

impl Serialize for Columns {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.by_setting())
    }
}

/// Settings of the block, and of the conventions of each.
static SETTINGS: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| recording_columns().map(|column| column.setting).collect());
static CONVENTIONS: LazyLock<BTreeMap<&'static str, Vec<&'static str>>> = LazyLock::new(|| {
    let named = |column: &'static DeclaredColumn| match column.shape {
        ColumnShape::Conventions(conventions) => {
            let names = conventions.all.iter().map(|one| one.name);
            Some((column.setting, names.chain(["unit", "optional"]).collect()))
        }
        _ => None,
    };
    recording_columns().filter_map(named).collect()
});

impl<'de> Deserialize<'de> for Columns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("Columns", &SETTINGS, Block)
    }
}

struct Block;

impl<'de> Visitor<'de> for Block {
    type Value = Columns;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("struct Columns")
    }
    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Columns, A::Error> {
        let mut found: BTreeMap<&'static str, Mapped> = BTreeMap::new();
        while let Some(setting) = access.next_key_seed(KnownKey(&SETTINGS))? {
            let Some(column) = recording_columns().find(|column| column.setting == setting) else {
                continue;
            };
            let mapped = match column.shape {
                ColumnShape::Text => access.next_value::<Option<_>>()?.map(Mapped::Text),
                ColumnShape::Count => access.next_value::<Option<_>>()?.map(Mapped::Count),
                ColumnShape::Number => access.next_value::<Option<_>>()?.map(Mapped::Number),
                ColumnShape::Joints { .. } => access.next_value::<Option<_>>()?.map(Mapped::Joints),
                ColumnShape::Uncertainty { .. } => {
                    access.next_value::<Option<_>>()?.map(Mapped::Uncertainty)
                }
                ColumnShape::Conventions(_) => access
                    .next_value_seed(OneConvention(column))?
                    .map(Mapped::Conventions),
            };
            if mapped.is_some_and(|mapped| found.insert(column.setting, mapped).is_some()) {
                return Err(A::Error::duplicate_field(column.setting));
            }
        }
        let all = recording_columns();
        let all = all.filter_map(|column| Some((column, found.remove(column.setting)?)));
        Ok(Columns(all.collect()))
    }
}

/// A key that is one of these.
struct KnownKey(&'static [&'static str]);

impl<'de> DeserializeSeed<'de> for KnownKey {
    type Value = &'static str;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<&'static str, D::Error> {
        let name = Cow::<str>::deserialize(deserializer)?;
        let known = self.0.iter().copied().find(|known| *known == name);
        known.ok_or_else(|| D::Error::unknown_field(&name, self.0))
    }
}

/// Columns of a quantity of several numbers.
struct OneConvention(&'static DeclaredColumn);

impl<'de> DeserializeSeed<'de> for OneConvention {
    type Value = Option<ConventionColumns>;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_option(self)
    }
}

impl<'de> Visitor<'de> for OneConvention {
    type Value = Option<ConventionColumns>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a block of keys")
    }
    fn visit_none<E>(self) -> Result<Self::Value, E> {
        Ok(None)
    }
    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_map(self)
    }
    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Self::Value, A::Error> {
        let mut out = ConventionColumns::default();
        let known = CONVENTIONS.get(self.0.setting);
        let known = known.map(Vec::as_slice).unwrap_or_default();
        while let Some(key) = access.next_key_seed(KnownKey(known))? {
            match key {
                "unit" => out.unit = access.next_value()?,
                "optional" => out.optional = access.next_value()?,
                convention => {
                    if let Some(columns) = access.next_value::<Option<Vec<ColumnRef>>>()? {
                        out.columns.insert(convention, columns);
                    }
                }
            }
        }
        Ok(Some(out))
    }
}

impl JsonSchema for Columns {
    fn schema_name() -> Cow<'static, str> {
        "Columns".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut properties = serde_json::Map::new();
        for column in recording_columns() {
            let mut schema = match column.shape {
                ColumnShape::Text => generator.subschema_for::<Option<TextColumn>>(),
                ColumnShape::Count => generator.subschema_for::<Option<CountColumn>>(),
                ColumnShape::Number => generator.subschema_for::<Option<ScalarColumn>>(),
                ColumnShape::Joints { .. } => generator.subschema_for::<Option<JointColumns>>(),
                ColumnShape::Uncertainty { .. } => {
                    generator.subschema_for::<Option<UncertaintyColumn>>()
                }
                ColumnShape::Conventions(conventions) => {
                    let block = convention_schema(column.setting, conventions, generator);
                    generator
                        .definitions_mut()
                        .insert(conventions.name.into(), block.to_value());
                    let reference = format!("#/definitions/{}", conventions.name);
                    json_schema!({ "anyOf": [{ "$ref": reference }, { "type": "null" }] })
                }
            };
            schema.insert("description".into(), column.about.into());
            schema.insert("default".into(), serde_json::Value::Null);
            properties.insert(column.setting.into(), schema.to_value());
        }
        json_schema!({
            "description": "Which column holds which quantity; what is not named here is not read.",
            "type": "object",
            "properties": properties,
            "additionalProperties": false,
        })
    }
}

fn convention_schema(
    setting: &str,
    conventions: &Conventions,
    generator: &mut SchemaGenerator,
) -> Schema {
    let mut properties = serde_json::Map::new();
    let mut describe = |name: &str, mut schema: Schema, about: &str, default| {
        schema.insert("description".into(), about.into());
        schema.insert("default".into(), default);
        properties.insert(name.into(), schema.to_value());
    };
    for convention in conventions.all {
        let columns = generator.subschema_for::<Option<Vec<ColumnRef>>>();
        describe(
            convention.name,
            columns,
            convention.about,
            serde_json::Value::Null,
        );
    }
    let unit = generator.subschema_for::<Option<String>>();
    describe("unit", unit, conventions.unit, serde_json::Value::Null);
    let optional = generator.subschema_for::<bool>();
    let about = format!("The cells may be blank: the row has no {setting}.");
    describe("optional", optional, &about, false.into());
    json_schema!({
        "description": conventions.about,
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    })
}

/// One raw file: delimited text, a workbook, a file of columns, or a topic of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileLayout {
    /// Path of the file: text in UTF-8 (with or without a byte-order mark) or Windows-1252, rows ending in LF or CRLF; a workbook
    /// (.xlsx, .xlsm), a sheet of which is read as text is; a file of columns (Parquet; Feather and streams of Arrow, uncompressed or by zstd; arrays of NumPy, .npz), for which only
    /// `columns` matters: a list of numbers in it is a column for each, `state[1]`, `state[2]` and so on; JSON (a list of objects, or an object a line); or a recording of ROS 2 (.mcap, .db3,
    /// or the folder of its parts).
    pub file: RawFile,
    /// The sheet of a workbook; without it the only visible one with rows of numbers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheet: Option<String>,
    /// The topic of a recording of ROS 2 (.mcap, .db3), e.g. `/joint_states`; without it the only one whose type is read. Its fields are the
    /// columns: `received` and `stamp` (s), and by type `shoulder_pan_joint.position`, `point.x`, `data[1]` and so on. Transforms are named
    /// with their frames: `/tf base->tool0`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
    /// What stands between fields: one ASCII character, `tab`, or `whitespace` (any run of blanks and tabs).
    #[serde(default = "comma")]
    pub delimiter: String,
    /// The decimal mark of the numbers.
    #[serde(default)]
    pub decimal: DecimalMark,
    /// Whether a row of column names stands above the data.
    #[serde(default = "crate::yes")]
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
    /// Where several targets stand side by side in a row, the columns of each, instead of x, y, z and target under `columns`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub targets: Option<WideTargets>,
    /// Which column holds which quantity.
    pub columns: Columns,
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
    pub unit: String,
    /// The columns of x, y and z by the target's name, e.g. `{smr1: [X1, Y1, Z1], smr2: [X2, Y2, Z2]}`; blank cells, or a point at 0, 0, 0,
    /// are a target that was not seen.
    pub columns: BTreeMap<String, [ColumnRef; 3]>,
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

fn is_false(value: &bool) -> bool {
    !value
}

named! {
    /// An axis of the tracker's frame.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    pub enum Axis {
        /// Along x.
        X "x",
        /// Along y.
        Y "y",
        /// Along z.
        Z "z",
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
