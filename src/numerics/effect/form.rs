//! Forms: effects at a place and in a shape, linear in their coefficients.
//!
//! A form is what diagnosis tries, what a model is refitted with, and what a table of parameters keeps as JSON: `{"<cause>": <body>}`.

use super::{
    ArmState, Basis, BeyondRange, Cause, DeclaredForm, Deflection, Effect, Law, Motion,
    ParameterEstimate, ParameterSpec, Place, Survey, Variable, cause,
};
use crate::robot::{LoadCorrection, Measurements, RobotModel};
use crate::units::Unit;
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Name, unit and one sigma of what is known before any measurement (SI), of a coefficient.
pub type NumberSpec = (String, Unit, f64);

/// The standard error of a coefficient by its number, SI.
pub type Errors<'e> = dyn Fn(usize) -> f64 + 'e;

/// What a [`Form`] holds: a law at a place ([`Term`]), one that a user declared ([`DeclaredForm`]), or a motion with physics of its own and
/// what it changes about the load. It is all that has to be written of such a motion.
pub trait Placed: Send + Sync {
    /// The cause that proposed it.
    fn cause(&self) -> &'static Cause;
    /// Where it acts.
    fn place(&self) -> Place;
    /// What it depends on.
    fn variables(&self) -> Vec<Variable>;
    /// Its coefficients, in the order of `p`.
    fn numbers(&self, robot: &RobotModel) -> Vec<NumberSpec>;
    /// See [`Effect::deflect`].
    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection);
    /// Its place and shape as JSON, as `OwnMotion::read` reads it: what tells it from others of its cause.
    fn body(&self) -> serde_json::Value;
    /// See [`Effect::needs_torque`].
    fn needs_torque(&self) -> bool {
        self.is_of_torque_model() || self.variables().into_iter().any(Variable::needs_torque)
    }
    /// See [`Effect::needs_current`]; a law of a motor current needs it in any case.
    fn needs_current(&self) -> bool {
        false
    }
    /// See [`Effect::needs_sight`].
    fn needs_sight(&self) -> bool {
        false
    }
    /// See [`Effect::load_correction`].
    fn load_correction(&self, _q: &[f64], _payload: f64, _p: &[f64], _out: &mut LoadCorrection) {}
    /// See [`Effect::missing`].
    fn missing(&self, _robot: &RobotModel, _data: &Measurements) -> Option<String> {
        None
    }
    /// Forms like this one with other shapes around its own, closer with every level and within bounds; empty where there is nothing
    /// to refine.
    fn near(&self, _survey: &Survey, _level: i32) -> Vec<Form> {
        Vec::new()
    }
    /// What tells forms of one effect and place apart that may stand together in a set, e.g. two orders of a gear; of one variant only one does.
    fn variant(&self) -> String {
        String::new()
    }
    /// Why coefficients `p` (SI) cannot be its cause's, as a clause: a number beyond what physics allows, or beyond what the recording holds.
    /// Beyond `error` (SI, by coefficient) a coefficient is firmly on its side of zero.
    fn impossible(&self, _p: &[f64], _error: &Errors, _survey: &Survey) -> Option<String> {
        None
    }
    /// Other causes that do the same in a finding of the name `called`, in whatever data: identities of kinematics and statics.
    fn identities(&self, _called: &str) -> Vec<(&'static str, Place)> {
        Vec::new()
    }
    /// Its shape or size in words, where its cause tells it to people.
    fn words(&self, _numbers: &[&ParameterEstimate]) -> Option<String> {
        None
    }
    /// Which of its parameters are of one size: what the rows say of some of them bounds the others.
    fn of_one_size(&self) -> Vec<usize> {
        Vec::new()
    }
    /// The numbers of a row that its variables are, in their order; none of what is no single number, or is not known.
    fn sizes(&self, robot: &RobotModel, state: &ArmState) -> Vec<Option<f64>> {
        self.variables()
            .into_iter()
            .map(|variable| {
                variable
                    .value(0, robot, state)
                    .filter(|_| variable.is_single())
            })
            .collect()
    }
    /// The same with its laws held at the ends of what the fitted rows have of its variables, in their order, and of two of them together; none
    /// where they go on.
    fn held_within(&self, _ranges: &[Option<[f64; 2]>], _pairs: &[[f64; 2]]) -> Option<Form> {
        None
    }
    /// What it may be off (one standard deviation) in a row beyond what the fitted rows have of its variables, `within`, and the variable
    /// that is most so; none inside.
    fn beyond(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        p: &[f64],
        within: &[Option<[f64; 2]>],
        out: &mut BeyondRange,
    ) -> Option<Variable> {
        let (variable, share) = self.most_beyond(robot, state, within)?;
        self.deflect(robot, state, p, &mut out.motions);
        out.close(share * self.doubt());
        Some(variable)
    }
    /// The variable that a row takes furthest beyond its fitted range, and the share of that, at most 1; none inside.
    fn most_beyond(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        within: &[Option<[f64; 2]>],
    ) -> Option<(Variable, f64)> {
        let sizes = self
            .variables()
            .into_iter()
            .zip(self.sizes(robot, state))
            .zip(within);
        let shares = sizes.filter_map(|((variable, size), range)| {
            Some((variable, variable.share_beyond(size?, (*range)?)))
        });
        shares
            .filter(|(_, share)| *share > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }
    /// Standard deviation of what it does where its variables are one range beyond the fitted one, as a share of that.
    fn doubt(&self) -> f64 {
        1.0
    }
    /// The law, where it is one at a place.
    fn term(&self) -> Option<&Term> {
        None
    }
    /// The declared law, where it is one.
    fn declared(&self) -> Option<&DeclaredForm> {
        None
    }
    /// Its shape numbers by their names, where they have names.
    fn shape_numbers(&self) -> Vec<(String, f64)> {
        Vec::new()
    }
    /// Whether it is a number of the torque model, seen only through what yields.
    fn is_of_torque_model(&self) -> bool {
        false
    }
    /// Whether coefficients `p` say, by more than their standard errors, that something moves against its load: no spring does.
    fn is_against_load(&self, _p: &[f64], _error: &Errors) -> bool {
        false
    }
    /// The joint that winds up under its load, and by how much (rad/Nm) with coefficients `p`.
    fn compliance(&self, _p: &[f64]) -> Option<(usize, f64)> {
        None
    }
}

/// Writes what every [`Placed`] has to say: `placed! { self: place, cause, [variables], what its body is made of }`.
macro_rules! placed {
    ($me:ident: $place:expr, $cause:expr, [$($variable:expr),+], $body:expr) => {
        fn place(&$me) -> $crate::effect::Place {
            $place
        }
        fn cause(&$me) -> &'static $crate::effect::Cause {
            $cause
        }
        fn variables(&$me) -> Vec<$crate::effect::Variable> {
            vec![$($variable),+]
        }
        fn body(&$me) -> serde_json::Value {
            serde_json::json!($body)
        }
    };
}
pub(super) use placed;

/// A form of any cause.
#[derive(Clone)]
pub struct Form {
    placed: Arc<dyn Placed>,
    /// What the fitted rows have of each of its variables (SI), where its laws go on beyond; empty while it is sought.
    within: Vec<Option<[f64; 2]>>,
}

impl<T: Placed + 'static> From<T> for Form {
    fn from(form: T) -> Self {
        Self {
            placed: Arc::new(form),
            within: Vec::new(),
        }
    }
}

impl PartialEq for Form {
    fn eq(&self, other: &Self) -> bool {
        if Arc::ptr_eq(&self.placed, &other.placed) {
            return true;
        }
        match (
            (self.term(), other.term()),
            (self.declared(), other.declared()),
        ) {
            ((None, None), (None, None)) => {
                self.name() == other.name()
                    && self.place() == other.place()
                    && self.body() == other.body()
            }
            (terms, declared) => terms.0 == terms.1 && declared.0 == declared.1,
        }
    }
}

impl std::fmt::Debug for Form {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.key(), self.body())
    }
}

impl std::ops::Deref for Form {
    type Target = dyn Placed;

    fn deref(&self) -> &Self::Target {
        &*self.placed
    }
}

impl Form {
    /// The column of the table of causes that it is in, of something at a place: that of its first variable, `constant` without one.
    pub fn follows(&self, place: Place) -> &'static str {
        self.variables()
            .first()
            .map_or("constant", |variable| variable.kind(place))
    }

    /// Whether it changes slowly from row to row, whatever the arm does.
    pub fn follows_time(&self) -> bool {
        self.variables().into_iter().any(|variable| {
            matches!(
                variable,
                Variable::Time | Variable::Temperature | Variable::Lagging { .. }
            )
        })
    }

    /// The name of its cause.
    pub fn name(&self) -> &str {
        let declared = self.declared();
        declared.map_or_else(|| self.cause().name(), |form| form.declaration().name())
    }

    /// Its coefficients as parameters: `cause.place.number`.
    pub fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let (name, place, variant) = (self.name(), self.place(), self.variant());
        let middle = if variant.is_empty() {
            place.tag()
        } else {
            format!("{}.{variant}", place.tag())
        };
        let spec = |(number, unit, tolerance): NumberSpec| ParameterSpec {
            name: if number.is_empty() {
                format!("{name}.{middle}")
            } else {
                format!("{name}.{middle}.{number}")
            },
            place,
            unit,
            tolerance,
        };
        self.numbers(robot).into_iter().map(spec).collect()
    }

    /// Reads a form that keeps all that it is in its body.
    pub(super) fn kept<T: Placed + DeserializeOwned + 'static>(
        body: &serde_json::Value,
    ) -> serde_json::Result<Self> {
        T::deserialize(body).map(Self::from)
    }

    /// The same, fitted to rows that have these ranges of its variables and, of two, these pairs.
    pub(super) fn fitted_within(&self, ranges: Vec<Option<[f64; 2]>>, pairs: &[[f64; 2]]) -> Self {
        let held = self.held_within(&ranges, pairs);
        held.unwrap_or_else(|| Self {
            placed: self.placed.clone(),
            within: ranges,
        })
    }

    /// See [`Placed::beyond`].
    pub(super) fn beyond(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        p: &[f64],
        out: &mut BeyondRange,
    ) -> Option<Variable> {
        self.placed.beyond(robot, state, p, &self.within, out)
    }

    /// Effect, place and variant: see [`Placed::variant`].
    pub fn key(&self) -> String {
        format!("{}@{}#{}", self.name(), self.place(), self.variant())
    }

    /// Whether it belongs to one measurement and not to the arm: it says nothing of another recording, and a command need not
    /// make up for it.
    pub fn is_of_the_measurement(&self) -> bool {
        let passing = || self.place() == Place::Base && self.variables() == [Variable::Time];
        let instrument = || self.place() == Place::Tracker;
        self.cause().of_the_measurement
            || (self.cause().is_nameless() && (passing() || instrument()))
            || (self.declared().is_some() && instrument())
    }
}

/// Key of a form's ranges, next to its place and shape.
const WITHIN: &str = "within";

impl Serialize for Form {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut body = self.body();
        if let Some(body) = body
            .as_object_mut()
            .filter(|_| self.within.iter().any(Option::is_some))
        {
            body.insert(WITHIN.into(), serde_json::json!(self.within));
        }
        BTreeMap::from([(self.name(), body)]).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Form {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let stored = BTreeMap::<String, serde_json::Value>::deserialize(deserializer)?;
        let [(name, mut body)] = <[_; 1]>::try_from(Vec::from_iter(stored))
            .map_err(|_| D::Error::custom("expected one cause"))?;
        let within = body.as_object_mut().and_then(|body| body.remove(WITHIN));
        let within = within
            .map_or(Ok(Vec::new()), serde_json::from_value)
            .map_err(D::Error::custom)?;
        let form = match cause(&name) {
            Some(cause) => match &cause.motion {
                Some(motion) => (motion.read)(&body),
                None => Term::read(cause, body),
            },
            None => DeclaredForm::read(&name, body),
        };
        Ok(Self {
            within,
            ..form.map_err(D::Error::custom)?
        })
    }
}

impl Effect for Form {
    fn name(&self) -> &str {
        Self::name(self)
    }
    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        Self::parameters(self, robot)
    }
    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        self.placed.deflect(robot, state, p, out);
    }
    fn needs_torque(&self) -> bool {
        self.placed.needs_torque()
    }
    fn needs_current(&self) -> bool {
        self.placed.needs_current()
            || self
                .variables()
                .iter()
                .any(|variable| matches!(variable, Variable::Current { .. }))
    }
    fn needs_sight(&self) -> bool {
        self.placed.needs_sight()
    }
    fn load_correction(&self, q: &[f64], payload: f64, p: &[f64], out: &mut LoadCorrection) {
        self.placed.load_correction(q, payload, p, out);
    }
    fn form(&self) -> Option<&Form> {
        Some(self)
    }
    fn missing(&self, robot: &RobotModel, data: &Measurements) -> Option<String> {
        self.placed.missing(robot, data)
    }
}

/// A law at a place, under the name of a cause: effect = sum_k c_k * direction(place, row) * law_k(variables of the row; shape numbers).
#[derive(Clone)]
pub struct Term {
    cause: &'static Cause,
    motion: Motion,
    law: Law,
}

/// What a table of parameters keeps of a term in addition to its cause's name.
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
    pub fn is_own_curve(&self) -> bool {
        let is_own_angle = |(joint, variable)| variable == Variable::Angle { joint };
        self.basis().is_curve() && self.of_one().is_some_and(is_own_angle)
    }

    /// Whether a joint follows nothing but its own angle and the side from which it came there: a gear's flanks differ.
    pub fn is_own_table(&self) -> bool {
        let is_table = || is_own_table(self.motion, &self.law.variables());
        self.is_own_curve() || self.law.times.is_some() && is_table()
    }

    /// The angles of which it is a function, where they are two.
    pub(crate) fn two_angles(&self) -> Option<[usize; 2]> {
        match (self.law.first.variable, self.law.times?.variable) {
            (Variable::Angle { joint: a }, Variable::Angle { joint: b }) => Some([a, b]),
            _ => None,
        }
    }
}

/// Whether a motion is that of a joint over its own angle and, if at all, the side from which it came there.
pub fn is_own_table(motion: Motion, variables: &[Variable]) -> bool {
    let Motion::Joint { joint } = motion else {
        return false;
    };
    let angle = Variable::Angle { joint };
    let is_own = |variable: &Variable| *variable == angle || variable.is_side_of(joint);
    variables.contains(&angle) && variables.iter().all(is_own)
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

    fn impossible(&self, p: &[f64], error: &Errors, survey: &Survey) -> Option<String> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Unknown;

    #[test]
    fn a_table_of_a_joint_is_over_its_own_angle_alone_or_with_the_side_of_its_approach() {
        let curve = Basis::Cosines {
            low: -1.0,
            high: 1.0,
            count: 6,
        };
        let turn = Motion::Joint { joint: 1 };
        let alone = |variable| Term::new(&Unknown, turn, Law::new(variable, curve));
        let product =
            |motion, a, b| Term::new(&Unknown, motion, Law::new(a, curve).times(b, curve));
        let [angle, other] = [1, 2].map(|joint| Variable::Angle { joint });
        let [side, moved] = [Variable::Approach { joint: 1 }, Variable::Move { joint: 1 }];
        for table in [
            alone(angle),
            product(turn, angle, side),
            product(turn, moved, angle),
        ] {
            assert!(table.is_own_table(), "{:?}", table.law().variables());
        }
        for none in [
            alone(other),
            alone(side),
            product(turn, side, moved),
            product(turn, angle, Variable::Time),
            product(turn, angle, Variable::Approach { joint: 2 }),
            product(Motion::Joint { joint: 2 }, angle, side),
        ] {
            assert!(!none.is_own_table(), "{:?}", none.law().variables());
        }
    }
}
