//! What a declared law may ask of a row, by name: `q`, `load3`, `q_next`, `temperature`, `slip(travel)`.
//!
//! Without a number a name is of the joint at which the effect acts, `_next` and `_before` of its neighbours.

use crate::effect::Variable;
use crate::robot::{CircumstanceName, law_columns};

/// A number of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RowQuantity {
    pub(crate) kind: QuantityKind,
    pub(crate) whose: Whose,
    /// The constant of a memory: a travel, a cooling time, a lag.
    pub(crate) constant: Option<Constant>,
}

/// A number that is the same in every row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Constant {
    Number(f64),
    /// A shape number, by its position.
    Shape(usize),
}

/// To which joint (from 0) a quantity belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Whose {
    Own,
    Next,
    Before,
    Joint(usize),
    /// To none: it is one of the whole row.
    Row,
}

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum QuantityKind {
    Angle,
    Motor,
    Load,
    Current,
    Approach,
    Move,
    Velocity,
    Slip,
    Work,
    Payload,
    Temperature,
    Lagging,
    Time,
    GravityX,
    GravityY,
    GravityZ,
    Azimuth,
    Elevation,
    Range,
    /// A circumstance that the recording declares.
    Circumstance(CircumstanceName),
}

use QuantityKind as K;

/// Name, kind, whether it is of a joint, whether it takes a constant in brackets.
const NAMES: [(&str, QuantityKind, bool, bool); 19] = [
    ("q", K::Angle, true, false),
    ("motor", K::Motor, true, false),
    ("load", K::Load, true, false),
    ("current", K::Current, true, false),
    ("approach", K::Approach, true, false),
    ("move", K::Move, true, false),
    ("velocity", K::Velocity, true, false),
    ("slip", K::Slip, true, true),
    ("work", K::Work, true, true),
    ("payload", K::Payload, false, false),
    ("temperature", K::Temperature, false, false),
    ("lagging", K::Lagging, false, true),
    ("time", K::Time, false, false),
    ("gravity_x", K::GravityX, false, false),
    ("gravity_y", K::GravityY, false, false),
    ("gravity_z", K::GravityZ, false, false),
    ("azimuth", K::Azimuth, false, false),
    ("elevation", K::Elevation, false, false),
    ("range", K::Range, false, false),
];

/// The same with every circumstance that the recording declares for laws.
fn all() -> impl Iterator<Item = (&'static str, QuantityKind, bool, bool)> {
    let declared = law_columns().filter_map(|column| {
        let name = CircumstanceName::of(column.setting)?;
        Some((
            column.setting,
            K::Circumstance(name),
            column.is_of_joints(),
            false,
        ))
    });
    NAMES.into_iter().chain(declared)
}

/// All names, for "allowed: ...".
pub(crate) fn known() -> String {
    let word = |(name, _, _, constant): (&str, K, bool, bool)| {
        if constant {
            format!("{name}(constant)")
        } else {
            name.into()
        }
    };
    let of_joints = all()
        .filter(|row| row.2)
        .map(word)
        .collect::<Vec<_>>()
        .join(", ");
    let of_rows = all()
        .filter(|row| !row.2)
        .map(word)
        .collect::<Vec<_>>()
        .join(", ");
    format!(
        "{of_joints} of this joint, of joint 3 as q3, of a neighbour as q_next or q_before; {of_rows}"
    )
}

/// All names without what may follow them.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    all().map(|row| row.0)
}

impl RowQuantity {
    /// The quantity of a name, and whether it takes a constant.
    pub(crate) fn named(text: &str) -> Option<(QuantityKind, Whose, bool)> {
        if let Some((_, kind, jointed, constant)) = all().find(|row| row.0 == text) {
            return Some((
                kind,
                if jointed { Whose::Own } else { Whose::Row },
                constant,
            ));
        }
        let split = text.find(|c: char| c.is_ascii_digit());
        let (name, whose) = match (
            text.strip_suffix("_next"),
            text.strip_suffix("_before"),
            split,
        ) {
            (Some(name), ..) => (name, Whose::Next),
            (_, Some(name), _) => (name, Whose::Before),
            (_, _, Some(at)) => (
                &text[..at],
                Whose::Joint(text[at..].parse::<usize>().ok()?.checked_sub(1)?),
            ),
            _ => return None,
        };
        let (_, kind, _, constant) = all().find(|row| row.0 == name && row.2)?;
        Some((kind, whose, constant))
    }

    /// As it is written, with these names of the shape numbers.
    pub fn text(&self, shape: &[String]) -> String {
        let name = all().find(|row| row.1 == self.kind).map_or("", |row| row.0);
        let subject = match self.whose {
            Whose::Own | Whose::Row => String::new(),
            Whose::Next => "_next".into(),
            Whose::Before => "_before".into(),
            Whose::Joint(joint) => (joint + 1).to_string(),
        };
        let constant = match self.constant {
            None => String::new(),
            Some(Constant::Number(number)) => format!("({number})"),
            Some(Constant::Shape(k)) => format!("({})", shape.get(k).map_or("?", String::as_str)),
        };
        format!("{name}{subject}{constant}")
    }

    /// Whether it is of the joint at which the effect acts, or of a neighbour of that.
    pub(crate) fn is_relative(&self) -> bool {
        matches!(self.whose, Whose::Own | Whose::Next | Whose::Before)
    }

    /// The variable of an arm of so many joints, where the effect acts at `joint`; `None` where there is no such joint.
    pub(crate) fn variable(
        &self,
        joint: Option<usize>,
        joints: usize,
        shape: &[f64],
    ) -> Option<Variable> {
        let its_joint = match self.whose {
            Whose::Row => 0,
            Whose::Own => joint?,
            Whose::Next => joint? + 1,
            Whose::Before => joint?.checked_sub(1)?,
            Whose::Joint(joint) => joint,
        };
        let joint = (its_joint < joints).then_some(its_joint)?;
        let constant = || match self.constant? {
            Constant::Number(number) => Some(number),
            Constant::Shape(k) => shape.get(k).copied(),
        };
        Some(match self.kind {
            K::Angle => Variable::Angle { joint },
            K::Motor => Variable::Motor { joint },
            K::Load => Variable::Load { joint },
            K::Current => Variable::Current { joint },
            K::Approach => Variable::Approach { joint },
            K::Move => Variable::Move { joint },
            K::Velocity => Variable::Velocity { joint },
            K::Slip => Variable::Slip {
                joint,
                travel: constant()?,
            },
            K::Work => Variable::Work {
                joint,
                cooling: constant()?,
            },
            K::Payload => Variable::Payload,
            K::Temperature => Variable::Temperature,
            K::Lagging => Variable::Lagging { lag: constant()? },
            K::Time => Variable::Time,
            K::GravityX => Variable::Gravity { axis: Some(0) },
            K::GravityY => Variable::Gravity { axis: Some(1) },
            K::GravityZ => Variable::Gravity { axis: Some(2) },
            K::Azimuth => Variable::Azimuth,
            K::Elevation => Variable::Elevation,
            K::Range => Variable::Range,
            K::Circumstance(column) => Variable::Circumstance {
                column,
                joint: (self.whose != Whose::Row).then_some(joint),
            },
        })
    }

    /// The column that a recording must have for it, where it must have one.
    pub(crate) fn needs(&self) -> Option<&'static str> {
        match self.kind {
            K::Current => Some("motor currents"),
            K::Velocity => Some("joint velocities"),
            K::Temperature | K::Lagging => Some("temperature"),
            K::Circumstance(column) => Some(column.text()),
            _ => None,
        }
    }
}

impl Variable {
    /// Its name in formulas of an effect at `joint`; `None` where formulas have none for it.
    pub fn in_formulas(self, joint: usize) -> Option<String> {
        let (kind, its_joint) = match self {
            Self::Angle { joint } => (K::Angle, Some(joint)),
            Self::Load { joint } => (K::Load, Some(joint)),
            Self::Approach { joint } => (K::Approach, Some(joint)),
            Self::Move { joint } => (K::Move, Some(joint)),
            Self::Velocity { joint } => (K::Velocity, Some(joint)),
            Self::Payload => (K::Payload, None),
            Self::Temperature => (K::Temperature, None),
            Self::Time => (K::Time, None),
            Self::Circumstance { column, joint } => (K::Circumstance(column), joint),
            _ => return None,
        };
        let whose = |its_joint| {
            if its_joint == joint {
                Whose::Own
            } else {
                Whose::Joint(its_joint)
            }
        };
        Some(
            RowQuantity {
                kind,
                whose: its_joint.map_or(Whose::Row, whose),
                constant: None,
            }
            .text(&[]),
        )
    }

    /// Whether it is a joint's own, or the whole row's.
    pub fn is_of(self, joint: usize) -> bool {
        match self {
            Self::Angle { joint: other }
            | Self::Load { joint: other }
            | Self::Approach { joint: other }
            | Self::Move { joint: other } => other == joint,
            Self::Velocity { joint: other } => other == joint,
            Self::Circumstance {
                joint: Some(other), ..
            } => other == joint,
            Self::Payload
            | Self::Temperature
            | Self::Time
            | Self::Circumstance { joint: None, .. } => true,
            _ => false,
        }
    }
}
