//! What a declared law may ask of a row, by name: `q`, `load3`, `q_next`, `temperature`, `slip(travel)`.
//!
//! Without a number a name is of the joint at which the effect acts, `_next` and `_before` of its neighbours.

use crate::effect::Variable;
use crate::robot::{CircumstanceName, law_columns};

/// A number of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RowQuantity {
    pub(crate) asked: Asked,
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

/// What is asked: its name, and the variable that it is, of the first joint and with no constant.
pub(crate) type Asked = (&'static str, Variable);

use Variable as V;

/// All that is asked of rows, but for circumstances.
const NAMED: [Asked; 19] = [
    ("q", V::Angle { joint: 0 }),
    ("motor", V::Motor { joint: 0 }),
    ("load", V::Load { joint: 0 }),
    ("current", V::Current { joint: 0 }),
    ("approach", V::Approach { joint: 0 }),
    ("move", V::Move { joint: 0 }),
    ("velocity", V::Velocity { joint: 0 }),
    (
        "slip",
        V::Slip {
            joint: 0,
            travel: 0.0,
        },
    ),
    (
        "work",
        V::Work {
            joint: 0,
            cooling: 0.0,
        },
    ),
    ("payload", V::Payload),
    ("temperature", V::Temperature),
    ("lagging", V::Lagging { lag: 0.0 }),
    ("time", V::Time),
    ("gravity_x", V::Gravity { axis: Some(0) }),
    ("gravity_y", V::Gravity { axis: Some(1) }),
    ("gravity_z", V::Gravity { axis: Some(2) }),
    ("azimuth", V::Azimuth),
    ("elevation", V::Elevation),
    ("range", V::Range),
];

/// The same with every circumstance that the recording declares for laws.
fn all() -> impl Iterator<Item = Asked> {
    let declared = law_columns().filter_map(|column| {
        let joint = column.is_of_joints().then_some(0);
        let column = CircumstanceName::of(column.setting)?;
        Some((column.text(), V::Circumstance { column, joint }))
    });
    NAMED.into_iter().chain(declared)
}

/// All names, for "allowed: ...".
pub(crate) fn known() -> String {
    let words = |of_joints: bool| {
        let asked = all().filter(|(_, variable)| variable.joint().is_some() == of_joints);
        let word = |(name, variable): Asked| match variable.constant() {
            Some(_) => format!("{name}(constant)"),
            None => name.into(),
        };
        asked.map(word).collect::<Vec<String>>().join(", ")
    };
    format!(
        "{} of this joint, of joint 3 as q3, of a neighbour as q_next or q_before; {}",
        words(true),
        words(false)
    )
}

/// All names without what may follow them.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    all().map(|(name, _)| name)
}

impl RowQuantity {
    /// What a name asks for, and whose.
    pub(crate) fn named(text: &str) -> Option<(Asked, Whose)> {
        if let Some(asked) = all().find(|(name, _)| *name == text) {
            let of_joint = asked.1.joint().is_some();
            return Some((asked, if of_joint { Whose::Own } else { Whose::Row }));
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
        let mut of_joints = all().filter(|(_, variable)| variable.joint().is_some());
        Some((of_joints.find(|asked| asked.0 == name)?, whose))
    }

    /// As it is written, with these names of the shape numbers.
    pub fn text(&self, shape: &[String]) -> String {
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
        format!("{}{subject}{constant}", self.asked.0)
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
        let mut variable = self.asked.1;
        if let Some(its) = variable.joint_mut() {
            *its = joint;
        }
        if let Some(its) = variable.constant_mut() {
            *its = match self.constant? {
                Constant::Number(number) => number,
                Constant::Shape(k) => *shape.get(k)?,
            };
        }
        Some(variable)
    }

    /// The column that a recording must have for it, where it must have one.
    pub(crate) fn needs(&self) -> Option<&'static str> {
        match self.asked.1 {
            V::Current { .. } => Some("motor currents"),
            V::Velocity { .. } => Some("joint velocities"),
            V::Temperature | V::Lagging { .. } => Some("temperature"),
            V::Circumstance { column, .. } => Some(column.text()),
            _ => None,
        }
    }
}

impl Variable {
    /// Whether formulas are proposed in it.
    fn is_plain(self) -> bool {
        let of_joint = matches!(
            self,
            V::Angle { .. }
                | V::Load { .. }
                | V::Approach { .. }
                | V::Move { .. }
                | V::Velocity { .. }
        );
        of_joint
            || matches!(
                self,
                V::Payload | V::Temperature | V::Time | V::Circumstance { .. }
            )
    }

    /// Its name in formulas of an effect at `joint`; `None` where none are proposed in it.
    pub fn in_formulas(mut self, joint: usize) -> Option<String> {
        let whose = match self.joint_mut() {
            None => Whose::Row,
            Some(its) => match std::mem::take(its) {
                its if its == joint => Whose::Own,
                its => Whose::Joint(its),
            },
        };
        let asked = all().find(|(_, variable)| self.is_plain() && *variable == self)?;
        let constant = None;
        Some(
            RowQuantity {
                asked,
                whose,
                constant,
            }
            .text(&[]),
        )
    }

    /// Whether it is a joint's own, or the whole row's, and formulas are proposed in it.
    pub fn is_of(self, joint: usize) -> bool {
        self.is_plain() && self.joint().is_none_or(|its| its == joint)
    }
}
