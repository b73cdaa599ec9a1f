//! Circumstances of a measurement, declared once each: what `ingest` calls them, how the recording stores them, whether laws may read them.
//!
//! A line with `.in_laws()` is all that a new circumstance takes: it is read, stored, carried to the numerics, and known to declared effects.

use super::column::{ColumnShape, DeclaredColumn};
use crate::units::Quantity::{
    Angle, AngularRate, Current, Length, LinearRate, Mass, Number, Temperature, Time, Torque,
};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

const SIMULATED: &[&str] = &["sim_x", "sim_y", "sim_z"];

const fn simulated(
    setting: &'static str,
    stored: &'static [&'static str],
    about: &'static str,
) -> DeclaredColumn {
    DeclaredColumn::number(setting, stored, Length, [-200.0, 200.0], about).together(SIMULATED)
}

/// Every circumstance, in the order in which people see them.
pub static CIRCUMSTANCES: &[DeclaredColumn] = &[
    DeclaredColumn::text(
        "point_id",
        "Name of the point; without it rows are called `row 17`.",
    ),
    DeclaredColumn {
        shape: ColumnShape::Count,
        ..DeclaredColumn::text(
            "sequence",
            "Order of the recording, strictly increasing; without it the number of the data row, from 1.",
        )
    },
    DeclaredColumn::text(
        "usage",
        "What the recording itself says a row is for, e.g. `fit` or `validate`.",
    ),
    DeclaredColumn::text(
        "trajectory",
        "Which trajectory of several a row belongs to, of an arm that moves: nothing is filtered from one into the next.",
    ),
    DeclaredColumn::text(
        "target",
        "Which of several targets on the tool was measured; blank for the robot's tool point.",
    ),
    DeclaredColumn::number(
        "time",
        &["time"],
        Time,
        [-1e15, 1e15],
        "When the row was recorded.",
    ),
    DeclaredColumn::number(
        "payload",
        &["payload"],
        Mass,
        [0.0, 1e4],
        "Mass at the tool.",
    ),
    DeclaredColumn::number(
        "temperature",
        &["temp"],
        Temperature,
        [-60.0, 200.0],
        "Temperature of the arm or of the room.",
    ),
    DeclaredColumn::number(
        "humidity",
        &["humidity"],
        Number,
        [0.0, 100.0],
        "Relative humidity of the air, percent; no unit.",
    )
    .in_laws(),
    simulated(
        "sim_x",
        &["sim_x"],
        "The same point by another simulation, x in any frame fixed to the robot's base: `diagnose` then looks at measured minus simulated.",
    ),
    simulated(
        "sim_y",
        &["sim_y"],
        "The same point by another simulation, y.",
    ),
    simulated(
        "sim_z",
        &["sim_z"],
        "The same point by another simulation, z.",
    ),
    DeclaredColumn {
        shape: ColumnShape::Joints {
            prismatic: Some((Length, [-200.0, 200.0])),
        },
        ..DeclaredColumn::number("q", &["q{j}"], Angle, [-20.0, 20.0], "Joint positions.")
    },
    DeclaredColumn {
        shape: ColumnShape::Joints { prismatic: None },
        ..DeclaredColumn::number(
            "current",
            &["i{j}"],
            Current,
            [-1e4, 1e4],
            "Motor currents.",
        )
    },
    DeclaredColumn {
        shape: ColumnShape::Joints { prismatic: None },
        ..DeclaredColumn::number(
            "torque",
            &["tau{j}"],
            Torque,
            [-1e7, 1e7],
            "Joint torques, by a sensor or as the drive states them.",
        )
    },
    DeclaredColumn {
        shape: ColumnShape::Joints { prismatic: None },
        ..DeclaredColumn::number(
            "direction",
            &["dir{j}"],
            Number,
            [-1.0, 1.0],
            "Direction of the last move of each joint: 1, -1 or 0; no unit.",
        )
    },
    DeclaredColumn {
        shape: ColumnShape::Joints {
            prismatic: Some((LinearRate, [-100.0, 100.0])),
        },
        ..DeclaredColumn::number(
            "velocity",
            &["dq{j}"],
            AngularRate,
            [-100.0, 100.0],
            "Joint velocities while the point was measured, where the arm moved: `{column: \"dq{j}\", unit: deg/s}`.",
        )
    },
];

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
