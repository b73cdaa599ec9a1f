//! Laws: a basis of a variable, or the product of two.

use super::{ArmState, Basis, Variable};
use crate::robot::RobotModel;
use serde::{Deserialize, Serialize};

/// Functions of one variable.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Factor {
    /// Of what.
    pub of: Variable,
    /// Which functions of it.
    pub basis: Basis,
}

impl Factor {
    /// How many functions it has.
    pub fn count(&self) -> usize {
        self.of.components() * self.basis.count()
    }

    fn values(&self, robot: &RobotModel, state: &ArmState, each: &mut dyn FnMut(usize, f64)) {
        for component in 0..self.of.components() {
            if let Some(u) = self.of.value(component, robot, state) {
                self.basis.values(u, &mut |k, value| each(component * self.basis.count() + k, value));
            }
        }
    }
}

/// Functions of one or two variables: all products of a function of the first and one of the second.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Law {
    /// The variable that the cause is about.
    #[serde(flatten)]
    pub first: Factor,
    /// What multiplies it, if anything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<Factor>,
}

impl Law {
    /// Functions of one variable.
    pub const fn new(of: Variable, basis: Basis) -> Self {
        Self { first: Factor { of, basis }, times: None }
    }

    /// In proportion to a variable.
    pub const fn of(of: Variable) -> Self {
        Self::new(of, Basis::PROPORTIONAL)
    }

    /// Multiplied by functions of another variable.
    pub const fn times(self, of: Variable, basis: Basis) -> Self {
        Self { times: Some(Factor { of, basis }), ..self }
    }

    /// With another basis of the first variable.
    pub fn with(self, basis: Basis) -> Self {
        Self { first: Factor { basis, ..self.first }, ..self }
    }

    /// With another first variable.
    pub fn by(self, of: Variable) -> Self {
        Self { first: Factor { of, ..self.first }, ..self }
    }

    /// How many functions it has.
    pub fn count(&self) -> usize {
        self.factors().map(Factor::count).product()
    }

    /// One or two.
    pub fn factors(&self) -> impl Iterator<Item = &Factor> {
        std::iter::once(&self.first).chain(&self.times)
    }

    /// What it depends on.
    pub fn variables(&self) -> Vec<Variable> {
        self.factors().map(|factor| factor.of).collect()
    }

    /// The values of its functions in a row, numbered; zeros where the row does not tell.
    pub(super) fn values(&self, robot: &RobotModel, state: &ArmState, each: &mut dyn FnMut(usize, f64)) {
        match &self.times {
            None => self.first.values(robot, state, each),
            Some(times) => {
                let inner = times.count();
                self.first.values(robot, state, &mut |i, x| times.values(robot, state, &mut |k, y| each(inner * i + k, x * y)));
            }
        }
    }
}

impl From<Factor> for Law {
    fn from(first: Factor) -> Self {
        Self { first, times: None }
    }
}
