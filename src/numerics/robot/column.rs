//! A column of the recording: what `ingest` calls it and expects of it, and how the table stores it.
//!
//! Circumstances of a measurement, declared once each: what `ingest` calls them, how the recording stores them, whether laws may read them.
//!
//! A line `in_laws` is all that a new circumstance takes: it is read, stored, carried to the numerics, and known to declared effects.

use crate::units::Quantity::{
    Angle, AngularRate, Current, Force, Length, LinearRate, Mass, Number, Temperature, Time, Torque,
};
use crate::units::{Quantity, Unit};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// A setting below `columns` of `ingest`, with what a recording keeps of it.
#[derive(Debug, Clone, Copy)]
pub struct DeclaredColumn {
    /// Its key in the YAML of `ingest`.
    pub setting: &'static str,
    /// For the documentation of the setting.
    pub about: &'static str,
    /// What stands in its cells.
    pub shape: ColumnShape,
    /// What its numbers are; [`Quantity::Number`] for texts, and for directions: 1, -1 or 0.
    pub quantity: Quantity,
    /// What a number may be, SI: one row beyond it would spoil the table.
    pub(crate) range: [f64; 2],
    /// Names in the table, without the ending that says the unit; `{j}` is the joint's number from 1.
    pub stored: &'static [&'static str],
    /// Settings, itself among them, of which all are mapped or none.
    pub together: &'static [&'static str],
    /// Whether it is the measured value, its uncertainty, or a name.
    pub part: Part,
    /// Whether declared laws may read it by its name.
    pub(crate) in_laws: bool,
}

/// How a file writes a quantity.
#[derive(Debug, Clone, Copy)]
pub enum ColumnShape {
    /// Names.
    Text,
    /// Whole numbers.
    Count,
    /// One number a row.
    Number,
    /// A number for each joint; of prismatic ones it may be another quantity with a range of its own.
    Joints {
        /// That quantity and its range, SI.
        prismatic: Option<(Quantity, [f64; 2])>,
    },
    /// Several numbers in one of several conventions.
    Conventions(&'static Conventions),
    /// One number a row: so many standard deviations, unless the file says another number, of each of these settings.
    Uncertainty {
        /// Settings that it is the standard deviation of.
        columns: &'static [&'static str],
        /// Standard deviations that the number stands for.
        coverage: f64,
    },
}

/// Ways to write a quantity of several numbers.
#[derive(Debug)]
pub struct Conventions {
    /// The settings' type in the pipeline's schema, and its documentation.
    pub name: &'static str,
    /// What it holds, for the schema of the YAML.
    pub about: &'static str,
    /// Documentation of the setting `unit`.
    pub unit: &'static str,
    /// Conventions that may be declared.
    pub all: &'static [Convention],
    /// What to say where none or several are given.
    pub allowed: &'static str,
}

/// One way to write a quantity of several numbers.
#[derive(Debug)]
pub struct Convention {
    /// The setting, e.g. `quaternion`.
    pub name: &'static str,
    /// What its numbers are, for the schema of the YAML.
    pub about: &'static str,
    /// How many columns it takes.
    pub numbers: usize,
    /// Without a unit; the column's quantity otherwise.
    pub unitless: bool,
    /// The stored numbers from those of a row (SI); fails with what is wrong.
    pub read: fn(&[f64]) -> Result<[f64; 3], String>,
}

/// What a column is to its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// A circumstance of the measurement.
    Circumstance,
    /// What was measured.
    Value,
    /// The standard deviation of that.
    Sigma,
    /// The name of what it was measured from.
    Anchor,
}

impl DeclaredColumn {
    /// A column with one number a row, stored by one name.
    pub(crate) const fn number(
        setting: &'static str,
        stored: &'static [&'static str],
        quantity: Quantity,
        range: [f64; 2],
        about: &'static str,
    ) -> Self {
        Self {
            setting,
            about,
            shape: ColumnShape::Number,
            quantity,
            range,
            stored,
            together: &[],
            part: Part::Circumstance,
            in_laws: false,
        }
    }

    /// A measured number, stored by the name of its setting.
    pub(crate) const fn value(
        name: &'static [&'static str; 1],
        quantity: Quantity,
        range: [f64; 2],
        about: &'static str,
    ) -> Self {
        Self::number(name[0], name, quantity, range, about).as_part(Part::Value)
    }

    /// The standard deviation of what was measured, stored by the name of its setting.
    pub(crate) const fn sigma(
        name: &'static [&'static str; 1],
        quantity: Quantity,
        about: &'static str,
    ) -> Self {
        Self::number(name[0], name, quantity, [0.0, 1.0], about).as_part(Part::Sigma)
    }

    /// A text, stored by the name of its setting.
    pub(crate) const fn text(setting: &'static str, about: &'static str) -> Self {
        Self {
            shape: ColumnShape::Text,
            ..Self::number(setting, &[], Quantity::Number, [0.0, 0.0], about)
        }
    }

    /// So many standard deviations of the settings `of`, which it stands for.
    pub(crate) const fn uncertainty(
        setting: &'static str,
        columns: &'static [&'static str],
        coverage: f64,
        about: &'static str,
    ) -> Self {
        Self {
            shape: ColumnShape::Uncertainty { columns, coverage },
            ..Self::number(setting, &[], Quantity::Length, [0.0, 1.0], about)
        }
    }

    /// The name of what the target is measured from.
    pub(crate) const fn anchor(setting: &'static str, about: &'static str) -> Self {
        Self::text(setting, about).as_part(Part::Anchor)
    }

    /// Whole numbers.
    const fn count(setting: &'static str, about: &'static str) -> Self {
        Self {
            shape: ColumnShape::Count,
            ..Self::text(setting, about)
        }
    }

    /// A number for each joint; of prismatic ones perhaps another quantity with a range of its own.
    const fn of_joints(
        setting: &'static str,
        stored: &'static [&'static str],
        quantity: Quantity,
        range: [f64; 2],
        prismatic: Option<(Quantity, [f64; 2])>,
        about: &'static str,
    ) -> Self {
        Self {
            shape: ColumnShape::Joints { prismatic },
            ..Self::number(setting, stored, quantity, range, about)
        }
    }

    /// A number that declared laws may read by its name.
    const fn in_laws(
        setting: &'static str,
        stored: &'static [&'static str],
        quantity: Quantity,
        range: [f64; 2],
        about: &'static str,
    ) -> Self {
        Self {
            in_laws: true,
            ..Self::number(setting, stored, quantity, range, about)
        }
    }

    /// The same as another part of the measurement.
    pub(crate) const fn as_part(self, part: Part) -> Self {
        Self { part, ..self }
    }

    /// The same, which must be mapped together with these settings.
    pub(crate) const fn together(self, together: &'static [&'static str]) -> Self {
        Self { together, ..self }
    }

    /// Whether it has a number for each joint.
    pub fn is_of_joints(&self) -> bool {
        matches!(self.shape, ColumnShape::Joints { .. })
    }

    /// Whether its cells are names.
    pub fn is_text(&self) -> bool {
        matches!(self.shape, ColumnShape::Text)
    }

    /// Numbers that reading a row of a robot with so many joints takes at most.
    pub fn numbers(&self, joints: usize) -> usize {
        match self.shape {
            ColumnShape::Text | ColumnShape::Count | ColumnShape::Uncertainty { .. } => 0,
            ColumnShape::Number => 1,
            ColumnShape::Joints { .. } => joints,
            ColumnShape::Conventions(conventions) => conventions
                .all
                .iter()
                .map(|convention| convention.numbers)
                .max()
                .unwrap_or_default(),
        }
    }

    /// Quantity and range of a joint's number; of the only one where it is not by joint.
    pub fn of_joint(&self, is_prismatic: bool) -> (Quantity, [f64; 2]) {
        match self.shape {
            ColumnShape::Joints {
                prismatic: Some(other),
            } if is_prismatic => other,
            _ => (self.quantity, self.range),
        }
    }

    /// Names and units of the table's columns that hold its numbers.
    pub fn columns(&self, prismatic: &[bool]) -> Vec<(String, Unit)> {
        let named = |name: &str, quantity: Quantity| {
            let unit = Unit::stored(quantity);
            let ending = unit.symbol().replace('/', "_").to_lowercase();
            (
                if quantity == Quantity::Number {
                    name.into()
                } else {
                    format!("{name}_{ending}")
                },
                unit,
            )
        };
        match self.shape {
            ColumnShape::Joints { .. } => (1..)
                .zip(prismatic)
                .map(|(joint, slides)| {
                    named(
                        &self.stored[0].replace("{j}", &format!("{joint}")),
                        self.of_joint(*slides).0,
                    )
                })
                .collect(),
            _ => self
                .stored
                .iter()
                .map(|name| named(name, self.quantity))
                .collect(),
        }
    }
}

/// Columns, a row each: a constructor of [`DeclaredColumn`] with what it takes, what people read of it, and the settings of which all are
/// mapped or none.
macro_rules! columns {
    ($($shape:ident($($taken:expr),*) $about:literal $(with $together:expr)?;)*) => {
        &[$($crate::robot::DeclaredColumn::$shape($($taken,)* $about)$(.together($together))?),*]
    };
}
pub(crate) use columns;

const SIMULATED: &[&str] = &["sim_x", "sim_y", "sim_z"];
const FAR: [f64; 2] = [-200.0, 200.0];
const FORCE: Option<(Quantity, [f64; 2])> = Some((Force, [-1e7, 1e7]));

/// Every circumstance, in the order in which people see them.
pub static CIRCUMSTANCES: &[DeclaredColumn] = columns! {
    text("point_id") "Name of the point; without it rows are called `row 17`.";
    count("sequence") "Order of the recording, strictly increasing; without it the number of the data row, from 1.";
    text("usage") "What the recording itself says a row is for, e.g. `fit` or `validate`.";
    text("trajectory") "Which trajectory of several a row belongs to, of an arm that moves: nothing is filtered from one into the next.";
    text("target") "Which of several targets on the tool was measured; blank for the robot's tool point.";
    number("time", &["time"], Time, [-1e15, 1e15]) "When the row was recorded.";
    number("payload", &["payload"], Mass, [0.0, 1e4]) "Mass at the tool.";
    number("temperature", &["temp"], Temperature, [-60.0, 200.0]) "Temperature of the arm or of the room.";
    in_laws("humidity", &["humidity"], Number, [0.0, 100.0]) "Relative humidity of the air, percent; no unit.";
    number("sim_x", &["sim_x"], Length, FAR)
        "The same point by another simulation, x in any frame fixed to the robot's base: `diagnose` then looks at measured minus simulated."
        with SIMULATED;
    number("sim_y", &["sim_y"], Length, FAR) "The same point by another simulation, y." with SIMULATED;
    number("sim_z", &["sim_z"], Length, FAR) "The same point by another simulation, z." with SIMULATED;
    of_joints("q", &["q{j}"], Angle, [-20.0, 20.0], Some((Length, FAR))) "Joint positions.";
    of_joints("current", &["i{j}"], Current, [-1e4, 1e4], None) "Motor currents.";
    of_joints("torque", &["tau{j}"], Torque, [-1e7, 1e7], FORCE)
        "Joint torques, forces of prismatic joints, by a sensor or as the drive states them.";
    of_joints("simulated", &["sim_tau{j}"], Torque, [-1e7, 1e7], FORCE)
        "The same by another simulation or by the controller's model, at the joints: `diagnose_torques` then looks at measured minus simulated.";
    of_joints("direction", &["dir{j}"], Number, [-1.0, 1.0], None) "Direction of the last move of each joint: 1, -1 or 0; no unit.";
    of_joints("velocity", &["dq{j}"], AngularRate, [-100.0, 100.0], Some((LinearRate, [-100.0, 100.0])))
        "Joint velocities while the point was measured, where the arm moved: `{column: \"dq{j}\", unit: deg/s}`.";
};

/// The setting of a circumstance that laws may read; read from text, it is one that is declared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct CircumstanceName(&'static str);

impl CircumstanceName {
    /// The name of a declared circumstance; `None` where laws know no such one.
    pub fn of(setting: &str) -> Option<Self> {
        law_columns()
            .find(|column| column.setting == setting)
            .map(|column| Self(column.setting))
    }
    /// As the setting is written.
    pub fn text(self) -> &'static str {
        self.0
    }
}

impl<'de> Deserialize<'de> for CircumstanceName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::of(&name)
            .ok_or_else(|| D::Error::custom(format!("no circumstance `{name}` that laws may read")))
    }
}

/// Circumstances that declared laws may read by name.
pub fn law_columns() -> impl Iterator<Item = &'static DeclaredColumn> {
    CIRCUMSTANCES.iter().filter(|column| column.in_laws)
}
