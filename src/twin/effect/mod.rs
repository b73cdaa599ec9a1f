//! Physical effects of the twin, each by its definition in mechanics. One file each, one line each in [`Physical`].
//!
//! Joints and links count from 1 here, because people write these settings.

mod backlash;
mod base_compliance;
mod gear_cyclic;
mod holding_friction;
mod joint_compliance;
mod joint_hardening;
mod link_compliance;
mod thermal_growth;
mod tracker_drift;
mod zero_shift;

pub use backlash::Backlash;
pub use base_compliance::BaseCompliance;
pub use gear_cyclic::{GearCyclic, GearMotorCyclic};
pub use holding_friction::HoldingFriction;
pub use joint_compliance::JointCompliance;
pub use joint_hardening::{Curve, JointHardening};
pub use link_compliance::LinkCompliance;
pub use thermal_growth::ThermalGrowth;
pub use tracker_drift::TrackerDrift;
pub use zero_shift::ZeroShift;

use super::arm::{Arm, Posture};
use super::matrix::{self, IDENTITY, Matrix, Vector};
use super::statics::{Loads, Row};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What an effect may look at: the row, and the arm as it hangs at present.
pub struct State<'a> {
    pub arm: &'a Arm,
    pub row: &'a Row,
    pub posture: &'a Posture,
    pub loads: &'a Loads,
    /// Gravity's torque on each joint, Nm.
    pub torque: &'a [f64],
}

/// What effects do to the arm.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Of the tracker's frame.
    pub tracker: Matrix,
    /// Of the base, base frame.
    pub base: Matrix,
    /// Added to each joint, rad or m.
    pub joint: Vec<f64>,
    /// Of each link's far end, in the frame of the link, about that end.
    pub link_end: Vec<Matrix>,
    /// Of the measured point, last link's frame, m.
    pub tool: Vector,
    /// What each motor carries besides gravity, Nm at the joint.
    pub motor_torque: Vec<f64>,
}

impl Motion {
    pub fn none(joints: usize) -> Motion {
        Motion {
            tracker: IDENTITY,
            base: IDENTITY,
            joint: vec![0.0; joints],
            link_end: vec![IDENTITY; joints],
            tool: [0.0; 3],
            motor_torque: vec![0.0; joints],
        }
    }

    /// The largest difference of any number, rad or m; the motors' torque does not move the arm.
    pub fn distance(&self, other: &Motion) -> f64 {
        let apart = |a: &Matrix, b: &Matrix| {
            a.as_flattened().iter().zip(b.as_flattened()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
        };
        let joints = self.joint.iter().zip(&other.joint).map(|(a, b)| (a - b).abs());
        let links = self.link_end.iter().zip(&other.link_end).map(|(a, b)| apart(a, b));
        let frames = [apart(&self.base, &other.base), apart(&self.tracker, &other.tracker)];
        joints.chain(links).chain(frames).fold(matrix::norm(matrix::minus(self.tool, other.tool)), f64::max)
    }
}

/// A true number under its canonical name.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueValue {
    pub name: String,
    pub effect: &'static str,
    pub place: String,
    pub unit: &'static str,
    pub value: f64,
}

/// A number of the effect `effect` at `place`, named `effect.tag.number`.
pub(crate) fn true_value(
    effect: &'static str,
    tag: &str,
    place: String,
    number: &str,
    unit: &'static str,
    value: f64,
) -> TrueValue {
    let dot = if number.is_empty() { "" } else { "." };
    TrueValue { name: format!("{effect}.{tag}{dot}{number}"), effect, place, unit, value }
}

/// An effect of the twin.
trait Act {
    /// Adds what the effect does in `state` to `motion`.
    fn act(&self, state: &State, motion: &mut Motion);
    /// The joint or link that it sits on, from 1, where it has one.
    fn seat(&self) -> Option<usize>;
    /// Its true numbers in canonical names.
    fn truth(&self) -> Vec<TrueValue>;
}

/// Declares the list of effects: the name in the YAML is the type's name in snake case.
macro_rules! physical {
    ($( $(#[$doc:meta])* $name:ident, )+) => {
        /// One effect with its numbers, written `- gear_cyclic: {joint: 2, ...}`.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum Physical { $( $(#[$doc])* $name($name), )+ }
        impl Physical {
            fn inner(&self) -> &dyn Act {
                match self { $( Physical::$name(effect) => effect, )+ }
            }
        }
    };
}

physical! {
    /// Wind-up proportional to torque.
    JointCompliance,
    /// Wind-up not proportional to torque.
    JointHardening,
    /// Elastic beam between two joints.
    LinkCompliance,
    /// The foundation tilts.
    BaseCompliance,
    /// Error periodic in the joint angle.
    GearCyclic,
    /// Error periodic in the motor angle.
    GearMotorCyclic,
    /// Lost motion by direction of approach.
    Backlash,
    /// Friction that the current shows at rest.
    HoldingFriction,
    /// A link grows with temperature.
    ThermalGrowth,
    /// The tracker's frame creeps.
    TrackerDrift,
    /// A joint's zero steps at some time.
    ZeroShift,
}

impl Physical {
    /// Adds what the effect does in `state` to `motion`.
    pub fn act(&self, state: &State, motion: &mut Motion) {
        self.inner().act(state, motion);
    }
    /// Its true numbers in canonical names.
    pub fn truth(&self) -> Vec<TrueValue> {
        self.inner().truth()
    }
    /// What is wrong with its seat on a robot of so many joints.
    pub fn fault(&self, joints: usize) -> Option<String> {
        let seat = self.inner().seat()?;
        (!(1..=joints).contains(&seat)).then(|| format!("sits on joint or link {seat}; allowed: 1 to {joints}"))
    }
}
