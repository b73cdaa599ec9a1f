//! A column of the recording: what `ingest` calls it and expects of it, and how the table stores it.

use crate::units::{Quantity, Unit};

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
        of: &'static [&'static str],
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
        of: &'static [&'static str],
        coverage: f64,
        about: &'static str,
    ) -> Self {
        Self {
            shape: ColumnShape::Uncertainty { of, coverage },
            ..Self::number(setting, &[], Quantity::Length, [0.0, 1.0], about)
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

    /// The same, which declared laws may read by its name.
    pub(crate) const fn in_laws(self) -> Self {
        Self {
            in_laws: true,
            ..self
        }
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
