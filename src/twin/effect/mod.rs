//! Physical effects of the twin, each by its definition in mechanics. One file each, one line each in [`Physical`].
//!
//! Joints and links count from 1 here, because people write these settings.

mod axis_wobble;
mod backlash;
mod backlash_growth;
mod base_compliance;
mod base_shift;
mod base_sway;
mod cable_drag;
mod counterbalance;
mod foreign;
mod gear_cyclic;
mod gear_eccentricity;
mod gear_flank;
mod gear_load;
mod holding_friction;
mod joint_bump;
mod joint_compliance;
mod joint_hardening;
mod joint_hinge;
mod joint_hysteresis;
mod joint_log_lag;
mod joint_product;
mod joint_warming;
mod link_compliance;
mod link_hinge;
mod link_mass;
mod payload_error;
mod presliding;
mod thermal_bow;
mod thermal_growth;
mod thermal_lag;
mod thermal_warm_up;
mod tool_shift;
mod tracker_circle;
mod tracker_drift;
mod tracker_elevation;
mod tracker_knock;
mod tracker_offset;
mod tracker_refraction;
mod tracker_scale;
mod tracker_sway;
mod viscous_windup;
mod zero_shift;

pub use cable_drag::Pull;
pub use counterbalance::Balancer;
pub use foreign::{ForeignCourse, ForeignMotion, ForeignShape, ForeignVariable};
pub use joint_hardening::Curve;
pub use joint_warming::Heat;
pub use tracker_circle::Circle;
pub use tracker_drift::Course;

use super::arm::{Arm, Posture};
use super::matrix::Vector;
use super::memory::Moment;
use super::motion::Motion;
use super::statics::{Loads, Row};
use super::true_value::{TrueValue, true_value};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What an effect may look at: the row, and the arm as it hangs at present.
pub struct State<'a> {
    /// As it really is.
    pub arm: &'a Arm,
    /// What is recorded at this point.
    pub row: &'a Row,
    /// Where everything is.
    pub posture: &'a Posture,
    /// What it carries.
    pub loads: &'a Loads,
    /// Torque of gravity and of other loads on each joint, Nm.
    pub torque: &'a [f64],
    /// What this effect makes of the rows before.
    pub memory: f64,
}

/// An effect of the twin.
trait Act: Stated {
    /// Adds what the effect does in `state` to `motion`.
    fn act(&self, state: &State, motion: &mut Motion);
    /// Changes what the arm is for the whole recording: masses and centres.
    fn shape(&self, _arm: &mut Arm) {}
    /// What it makes of the rows before at each of them, the row itself included; empty: it has no memory.
    fn remember(&self, _past: &[Moment]) -> Vec<f64> {
        Vec::new()
    }
    /// What the tracker reads of a point, m in its frame.
    fn sight(&self, _row: &Row, _memory: f64, point: Vector) -> Vector {
        point
    }
    /// Changes what the controller logs of the joint positions `q` after a move from `before`, rad or m.
    fn log(&self, _q: &mut [f64], _before: &[f64]) {}
    /// How much later than the joints beside it a point is measured, s.
    fn later(&self) -> f64 {
        0.0
    }
    /// Whether a standing arm knows nothing of it.
    fn moves_only(&self) -> bool {
        self.later() != 0.0
    }
}

/// The numbers of an effect.
trait Stated {
    /// The joint or link that it sits on, from 1, where it has one.
    fn seat(&self) -> Option<usize> {
        None
    }
    /// Multiplies the size of what it does.
    fn scale(&mut self, by: f64);
    /// Its true numbers in canonical names.
    fn truth(&self) -> Vec<TrueValue>;
}

/// A number, or a vector, that the size of an effect is in proportion to.
trait Size {
    fn scale(&mut self, by: f64);
}

impl Size for f64 {
    fn scale(&mut self, by: f64) {
        *self *= by;
    }
}

impl<const N: usize> Size for [f64; N] {
    fn scale(&mut self, by: f64) {
        self.iter_mut().for_each(|number| *number *= by);
    }
}

/// Declares an effect as it is written in YAML: its numbers; its canonical name; its place, which is the joint or link that a number of
/// it names (with the end of its tag), or a tag and a place; the numbers that its size is in proportion to; its true numbers as name,
/// unit and value.
macro_rules! effect {
    (@type $(#[$meta:meta])* pub struct $name:ident { $($fields:tt)* } $by:ident $($size:ident)+) => {
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        $(#[$meta])*
        #[serde(deny_unknown_fields)]
        pub struct $name { $($fields)* }
        impl $name {
            fn scale_by(&mut self, $by: f64) {
                $( $crate::effect::Size::scale(&mut self.$size, $by); )+
            }
        }
    };
    ($(#[$meta:meta])* pub struct $name:ident { $($fields:tt)* }
     $effect:literal at $seat:ident $($end:literal)?, scaled by $($size:ident)+, |$me:ident| $numbers:expr) => {
        $crate::effect::effect! { @type $(#[$meta])* pub struct $name { $($fields)* } by $($size)+ }
        impl $crate::effect::Stated for $name {
            fn seat(&self) -> Option<usize> {
                Some(self.$seat)
            }
            fn scale(&mut self, by: f64) {
                self.scale_by(by);
            }
            fn truth(&$me) -> Vec<$crate::true_value::TrueValue> {
                let tag = format!(concat!("{}{}", $($end)?), &stringify!($seat)[..1], $me.$seat);
                $crate::true_value::true_values($effect, &tag, &format!("{} {}", stringify!($seat), $me.$seat), $numbers)
            }
        }
    };
    ($(#[$meta:meta])* pub struct $name:ident { $($fields:tt)* }
     $effect:literal of $tag:literal $place:literal, scaled by $($size:ident)+, |$me:ident| $numbers:expr) => {
        $crate::effect::effect! { @type $(#[$meta])* pub struct $name { $($fields)* } by $($size)+ }
        impl $crate::effect::Stated for $name {
            fn scale(&mut self, by: f64) {
                self.scale_by(by);
            }
            fn truth(&$me) -> Vec<$crate::true_value::TrueValue> {
                $crate::true_value::true_values($effect, $tag, $place, $numbers)
            }
        }
    };
}
use effect;

/// A ripple as two amplitudes, as estimators write it.
fn sine_and_cosine(
    order: f64,
    unit: &'static str,
    amplitude: f64,
    phase_deg: f64,
) -> [(String, &'static str, f64); 2] {
    let (sine, cosine) = phase_deg.to_radians().sin_cos();
    [
        (format!("sin{order}"), unit, amplitude * cosine),
        (format!("cos{order}"), unit, amplitude * sine),
    ]
}

/// A rigid step, axis by axis.
fn by_axis(
    shift_um: Vector,
    turn_arcsec: Vector,
) -> impl Iterator<Item = (&'static str, &'static str, f64)> {
    let names = [
        ("shift_x", "turn_x"),
        ("shift_y", "turn_y"),
        ("shift_z", "turn_z"),
    ];
    let axes = names.into_iter().zip(shift_um.into_iter().zip(turn_arcsec));
    axes.flat_map(|((shift, turn), (moved, turned))| {
        [(shift, "um", moved), (turn, "arcsec", turned)]
    })
}

/// Declares the list of effects: the name in the YAML is the type's name in snake case.
macro_rules! physical {
    ($( $(#[$doc:meta])* $file:ident::$name:ident, )+) => {
        $( pub use $file::$name; )+
        /// One effect with its numbers, written `- gear_cyclic: {joint: 2, ...}`.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum Physical { $( $(#[$doc])* $name($name), )+ }
        impl Physical {
            fn inner(&self) -> &dyn Act {
                match self { $( Physical::$name(effect) => effect, )+ }
            }
            fn inner_mut(&mut self) -> &mut dyn Act {
                match self { $( Physical::$name(effect) => effect, )+ }
            }
        }
    };
}

physical! {
    /// Wind-up proportional to torque.
    joint_compliance::JointCompliance,
    /// Wind-up not proportional to torque.
    joint_hardening::JointHardening,
    /// Elastic beam between two joints.
    link_compliance::LinkCompliance,
    /// The foundation tilts.
    base_compliance::BaseCompliance,
    /// Error periodic in the joint angle.
    gear_cyclic::GearCyclic,
    /// Error periodic in the motor angle.
    gear_cyclic::GearMotorCyclic,
    /// Lost motion by direction of approach.
    backlash::Backlash,
    /// Friction that the current shows at rest.
    holding_friction::HoldingFriction,
    /// A link grows with temperature.
    thermal_growth::ThermalGrowth,
    /// The tracker's frame creeps.
    tracker_drift::TrackerDrift,
    /// The tracker's metre is wrong.
    tracker_scale::TrackerScale,
    /// A joint's zero steps at some time.
    zero_shift::ZeroShift,
    /// The axis tilts as the joint turns.
    axis_wobble::AxisWobble,
    /// The base steps at some time.
    base_shift::BaseShift,
    /// The base swings slowly.
    base_sway::BaseSway,
    /// A hose package pulls on a joint.
    cable_drag::CableDrag,
    /// A balancer carries part of a joint's load.
    counterbalance::Counterbalance,
    /// Run-out of an eccentric wheel, not a pure sine.
    gear_eccentricity::GearEccentricity,
    /// The two flanks of the teeth err differently.
    gear_flank::GearFlank,
    /// A joint is wrong near one angle.
    joint_bump::JointBump,
    /// A joint's error starts at some angle.
    joint_hinge::JointHinge,
    /// The log of the joints is behind.
    joint_log_lag::JointLogLag,
    /// A joint's error is a product of two angles.
    joint_product::JointProduct,
    /// A link gives way at its middle.
    link_hinge::LinkHinge,
    /// A link weighs otherwise than described.
    link_mass::LinkMass,
    /// The payload is otherwise than declared.
    payload_error::PayloadError,
    /// A link grows with its own warm-up.
    thermal_warm_up::ThermalWarmUp,
    /// The reflector steps at some time.
    tool_shift::ToolShift,
    /// A joint trails behind while it turns.
    viscous_windup::ViscousWindup,
    /// Lost motion that grows with time.
    backlash_growth::BacklashGrowth,
    /// Run-out that grows with the load.
    gear_load::GearLoad,
    /// Wind-up that depends on the direction of approach.
    joint_hysteresis::JointHysteresis,
    /// A joint that is warm by its own work or with the arm.
    joint_warming::JointWarming,
    /// Lost motion that builds up over a travel.
    presliding::Presliding,
    /// A bent link grows with temperature.
    thermal_bow::ThermalBow,
    /// A link grows with a temperature that lags.
    thermal_lag::ThermalLag,
    /// The tracker's horizontal circle is off.
    tracker_circle::TrackerCircle,
    /// The tracker's head is off in elevation.
    tracker_elevation::TrackerElevation,
    /// The tracker's stand is knocked.
    tracker_knock::TrackerKnock,
    /// The tracker's ranges are off.
    tracker_offset::TrackerOffset,
    /// The tracker's ranges grow with the air's temperature.
    tracker_refraction::TrackerRefraction,
    /// The tracker's stand swings slowly.
    tracker_sway::TrackerSway,
    /// A drawn shape in one direction of motion.
    foreign::Foreign,
}

impl Physical {
    /// Adds what the effect does in `state` to `motion`.
    pub fn act(&self, state: &State, motion: &mut Motion) {
        self.inner().act(state, motion);
    }
    /// Changes what the arm is for the whole recording.
    pub fn shape(&self, arm: &mut Arm) {
        self.inner().shape(arm);
    }
    /// What the tracker reads of a point, m in its frame.
    pub fn sight(&self, row: &Row, memory: f64, point: Vector) -> Vector {
        self.inner().sight(row, memory, point)
    }
    /// Changes what the controller logs of the joint positions `q` after a move from `before`, rad or m.
    pub fn log(&self, q: &mut [f64], before: &[f64]) {
        self.inner().log(q, before);
    }
    /// How much later than the joints beside it a point is measured, s.
    pub fn later(&self) -> f64 {
        self.inner().later()
    }
    /// Whether a standing arm knows nothing of it.
    pub fn moves_only(&self) -> bool {
        self.inner().moves_only()
    }
    /// The same effect, `by` times as large.
    pub fn scaled(&self, by: f64) -> Physical {
        let mut out = self.clone();
        out.inner_mut().scale(by);
        out
    }
    /// Its true numbers in canonical names.
    pub fn truth(&self) -> Vec<TrueValue> {
        self.inner().truth()
    }
    /// What is wrong with its seat on a robot of so many joints.
    pub fn fault(&self, joints: usize) -> Option<String> {
        let seat = self.inner().seat()?;
        (!(1..=joints).contains(&seat))
            .then(|| format!("sits on joint or link {seat}; allowed: 1 to {joints}"))
    }
}

/// What every effect makes of the rows before, row by row: [`Row::memory`] of each.
pub fn recall(effects: &[Physical], past: &[Moment]) -> Vec<Vec<f64>> {
    let own: Vec<Vec<f64>> = effects
        .iter()
        .map(|effect| effect.inner().remember(past))
        .collect();
    if own.iter().all(Vec::is_empty) {
        return vec![Vec::new(); past.len()];
    }
    (0..past.len())
        .map(|row| {
            own.iter()
                .map(|all| all.get(row).copied().unwrap_or(0.0))
                .collect()
        })
        .collect()
}
