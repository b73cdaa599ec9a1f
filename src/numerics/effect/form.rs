//! Forms: effects at a place and in a shape, linear in their coefficients.
//!
//! A form is what diagnosis tries, what a model is refitted with, and what a table of parameters keeps as JSON: `{"<cause>": <body>}`.

use super::{
    ArmState, Cause, DeclaredForm, Deflection, Effect, ParameterEstimate, ParameterSpec, Place, Survey, Term, Variable, cause,
};
use crate::robot::{LoadCorrection, Measurements, RobotModel};
use crate::units::Unit;
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Name, unit and one sigma of what is known before any measurement (SI), of a coefficient.
pub type NumberSpec = (String, Unit, f64);

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
    /// Its place and shape as JSON, as [`OwnMotion::read`](super::OwnMotion::read) reads it: what tells it from others of its cause.
    fn body(&self) -> serde_json::Value;
    /// See [`Effect::needs_torque`].
    fn needs_torque(&self) -> bool {
        false
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
    fn impossible(&self, _p: &[f64], _error: &dyn Fn(usize) -> f64, _survey: &Survey) -> Option<String> {
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
    /// The same with its laws held at the ends of what the fitted rows have of their variables; itself where it has none.
    fn held_within(&self, _range: &dyn Fn(Variable) -> Option<[f64; 2]>) -> Option<Form> {
        None
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
    fn is_against_load(&self, _p: &[f64], _error: &dyn Fn(usize) -> f64) -> bool {
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
pub struct Form(Arc<dyn Placed>);

impl<T: Placed + 'static> From<T> for Form {
    fn from(form: T) -> Self {
        Self(Arc::new(form))
    }
}

impl PartialEq for Form {
    fn eq(&self, other: &Self) -> bool {
        if Arc::ptr_eq(&self.0, &other.0) {
            return true;
        }
        match ((self.term(), other.term()), (self.declared(), other.declared())) {
            ((None, None), (None, None)) => {
                self.name() == other.name() && self.place() == other.place() && self.body() == other.body()
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
        &*self.0
    }
}

impl Form {
    /// The name of its cause.
    pub fn name(&self) -> &'static str {
        self.cause().name()
    }

    /// Its coefficients as parameters: `cause.place.number`.
    pub fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let (name, place, variant) = (self.name(), self.place(), self.variant());
        let middle = if variant.is_empty() { place.tag() } else { format!("{}.{variant}", place.tag()) };
        let spec = |(number, unit, prior_sigma): NumberSpec| ParameterSpec {
            name: if number.is_empty() { format!("{name}.{middle}") } else { format!("{name}.{middle}.{number}") },
            place,
            unit,
            prior_sigma,
        };
        self.numbers(robot).into_iter().map(spec).collect()
    }

    /// Reads a form that keeps all that it is in its body.
    pub(super) fn kept<T: Placed + DeserializeOwned + 'static>(body: &serde_json::Value) -> serde_json::Result<Self> {
        T::deserialize(body).map(Self::from)
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
        self.cause().of_the_measurement || (self.cause().is_nameless() && (passing() || instrument()))
    }
}

impl Serialize for Form {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        BTreeMap::from([(self.cause().name(), self.body())]).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Form {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let stored = BTreeMap::<String, serde_json::Value>::deserialize(deserializer)?;
        let [(name, body)] = <[_; 1]>::try_from(Vec::from_iter(stored)).map_err(|_| D::Error::custom("expected one cause"))?;
        let form = match cause(&name) {
            Some(cause) => match &cause.motion {
                Some(motion) => (motion.read)(&body),
                None => Term::read(cause, body),
            },
            None => DeclaredForm::read(&name, body),
        };
        form.map_err(D::Error::custom)
    }
}

impl Effect for Form {
    fn name(&self) -> &'static str {
        Self::name(self)
    }
    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        Self::parameters(self, robot)
    }
    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        self.0.deflect(robot, state, p, out);
    }
    fn needs_torque(&self) -> bool {
        self.0.needs_torque()
    }
    fn needs_current(&self) -> bool {
        self.0.needs_current() || self.variables().iter().any(|variable| matches!(variable, Variable::Current { .. }))
    }
    fn needs_sight(&self) -> bool {
        self.0.needs_sight()
    }
    fn load_correction(&self, q: &[f64], payload: f64, p: &[f64], out: &mut LoadCorrection) {
        self.0.load_correction(q, payload, p, out);
    }
    fn form(&self) -> Option<&Form> {
        Some(self)
    }
    fn missing(&self, robot: &RobotModel, data: &Measurements) -> Option<String> {
        self.0.missing(robot, data)
    }
}
