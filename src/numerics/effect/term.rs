//! Terms: effect = sum_k c_k * direction(place, row) * law_k(variables of the row; shape numbers).

use super::form::Placed;
use super::{
    ArmState, Basis, BeyondRange, Cause, Deflection, Form, Law, Motion, NumberSpec, Place, Survey,
    Variable,
};
use crate::robot::{Measurements, RobotModel};
use serde::{Deserialize, Serialize};

/// A law at a place, under the name of a cause.
#[derive(Clone)]
pub struct Term {
    cause: &'static Cause,
    motion: Motion,
    law: Law,
}

/// What a table of parameters keeps of a term beside its cause's name.
#[derive(Serialize, Deserialize)]
struct Stored {
    motion: Motion,
    law: Law,
}

impl Term {
    /// A law of a motion, under the name of a cause.
    pub fn new(cause: impl Into<&'static Cause>, motion: Motion, law: Law) -> Self {
        Self {
            cause: cause.into(),
            motion,
            law,
        }
    }

    /// Reads what [`Form::body`] made of a term.
    pub(super) fn read(cause: &'static Cause, body: serde_json::Value) -> serde_json::Result<Form> {
        let Stored { motion, law } = serde_json::from_value(body)?;
        Ok(Self { cause, motion, law }.into())
    }

    /// Where it enters the chain.
    #[inline]
    pub fn motion(&self) -> Motion {
        self.motion
    }

    /// What it depends on, and how.
    #[inline]
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// The same with another law.
    pub fn with(&self, law: Law) -> Self {
        Self { law, ..*self }
    }

    /// The same with other bases of its first variable.
    pub(crate) fn with_bases(&self, bases: impl IntoIterator<Item = Basis>) -> Vec<Self> {
        bases
            .into_iter()
            .map(|basis| self.with(self.law.with(basis)))
            .collect()
    }

    /// The basis of its first variable.
    #[inline]
    pub fn basis(&self) -> Basis {
        self.law.first.basis
    }

    /// The variable of a joint that moves by a law of one variable.
    pub fn of_one(&self) -> Option<(usize, Variable)> {
        match (self.motion, self.law.times) {
            (Motion::Joint { joint }, None) => Some((joint, self.law.first.variable)),
            _ => None,
        }
    }

    /// Whether a joint follows a free curve of its own angle: nearly geometry, or another law of that angle, in its slow part.
    pub(crate) fn is_own_curve(&self) -> bool {
        let is_own_angle = |(joint, variable)| variable == Variable::Angle { joint };
        self.basis().is_curve() && self.of_one().is_some_and(is_own_angle)
    }

    /// The angles of which it is a function, where they are two.
    pub(crate) fn two_angles(&self) -> Option<[usize; 2]> {
        match (self.law.first.variable, self.law.times?.variable) {
            (Variable::Angle { joint: a }, Variable::Angle { joint: b }) => Some([a, b]),
            _ => None,
        }
    }
}

impl PartialEq for Term {
    fn eq(&self, other: &Self) -> bool {
        self.cause.name() == other.cause.name()
            && self.motion == other.motion
            && self.law == other.law
    }
}

impl Placed for Term {
    fn cause(&self) -> &'static Cause {
        self.cause
    }

    fn place(&self) -> Place {
        self.motion.place()
    }

    fn variables(&self) -> Vec<Variable> {
        self.law.variables()
    }

    fn numbers(&self, robot: &RobotModel) -> Vec<NumberSpec> {
        self.cause.numbers(self, robot)
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let count = self.law.count();
        self.law.values(robot, state, &mut |k, value| {
            self.motion.add(robot, state, (k, count), value, p, out)
        });
    }

    fn needs_sight(&self) -> bool {
        matches!(self.motion, Motion::Instrument { .. })
    }

    fn missing(&self, _robot: &RobotModel, data: &Measurements) -> Option<String> {
        let velocity = |variable| matches!(variable, Variable::Velocity { .. });
        let needed = self.law.factors().any(|factor| velocity(factor.variable));
        (needed && data.velocity.is_none()).then(|| "the recording has no joint velocities".into())
    }

    fn near(&self, survey: &Survey, level: i32) -> Vec<Form> {
        self.cause
            .near(self, survey, level)
            .into_iter()
            .map(Form::from)
            .collect()
    }

    fn variant(&self) -> String {
        self.cause.variant(self)
    }

    fn impossible(
        &self,
        p: &[f64],
        error: &dyn Fn(usize) -> f64,
        survey: &Survey,
    ) -> Option<String> {
        self.cause.law(self)?.impossible(self, p, error, survey)
    }

    fn identities(&self, called: &str) -> Vec<(&'static str, Place)> {
        self.cause.identities(self, called)
    }

    fn term(&self) -> Option<&Term> {
        Some(self)
    }

    fn held_within(&self, ranges: &[Option<[f64; 2]>], pairs: &[[f64; 2]]) -> Option<Form> {
        Some(self.with(self.law.held_within(ranges, pairs)).into())
    }

    fn beyond(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        p: &[f64],
        _within: &[Option<[f64; 2]>],
        out: &mut BeyondRange,
    ) -> Option<Variable> {
        let (variable, groups) = self.law.beyond(robot, state)?;
        let count = self.law.count();
        for group in groups {
            group.into_iter().for_each(|(k, off)| {
                self.motion
                    .add(robot, state, (k, count), off, p, &mut out.motions)
            });
            out.close(1.0);
        }
        Some(variable)
    }

    fn body(&self) -> serde_json::Value {
        serde_json::json!(Stored {
            motion: self.motion,
            law: self.law
        })
    }
}
