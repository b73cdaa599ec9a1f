//! Physical effects of the twin, each by its definition in mechanics: a row of a table with its numbers, its truth and its law, and a line
//! in [`Physical`].
//!
//! Joints and links count from 1 here, because people write these settings.

mod bodies;
mod foreign;
mod joints;
mod tracker;

pub use bodies::*;
pub use foreign::*;
pub use joints::*;
pub use tracker::*;

use super::arm::{Arm, Posture};
use super::matrix::Vector;
use super::memory::Moment;
use super::truth::{TrueValue, true_values};
use crate::arm::{Loads, Motion, Row};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut};

/// What an effect may look at: the row, and the arm as it hangs at present.
pub struct State<'a> {
    /// As it really is.
    pub(crate) arm: &'a Arm,
    /// What is recorded at this point.
    pub(crate) row: &'a Row,
    /// Where everything is.
    pub(crate) posture: &'a Posture,
    /// What it carries.
    pub(crate) loads: &'a Loads,
    /// Torque of gravity and of other loads on each joint, Nm.
    pub(crate) torque: &'a [f64],
    /// What this effect makes of the rows before.
    pub(crate) memory: f64,
}

/// A joint as it is at present.
struct AtJoint<'a> {
    /// From 0.
    joint: usize,
    state: &'a State<'a>,
}

impl AtJoint<'_> {
    /// rad.
    fn angle(&self) -> f64 {
        self.state.row.command[self.joint]
    }
    /// Nm.
    fn torque(&self) -> f64 {
        self.state.torque[self.joint]
    }
    /// +1, -1 or 0: its last move.
    fn side(&self) -> f64 {
        self.state.row.direction[self.joint]
    }
    /// A wave of so many periods per turn of the joint.
    fn wave(&self, order: f64, phase_deg: f64) -> f64 {
        (order * self.angle() + phase_deg.to_radians()).sin()
    }
}

/// The angle of a joint (from 1), rad; 0 of one that there is not.
fn angle_of(state: &State, joint: usize) -> f64 {
    let angle = state.row.command.get(joint.saturating_sub(1));
    angle.copied().unwrap_or(0.0)
}

/// An effect of the twin.
pub trait Act: Stated {
    /// Adds what the effect does in `state` to `motion`.
    fn act(&self, _state: &State, _motion: &mut Motion) {}
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
pub trait Stated {
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

/// Declares effects as they are written in YAML, a row each: its canonical name; its place, which is the joint or link that a number of it
/// names (with the end of its tag), or a tag and a place; its numbers; those that its size is in proportion to; its true numbers as name,
/// unit and value; and its law: what it adds to the turn of its joint, or the functions of [`Act`].
macro_rules! effect {
    ($(#[$meta:meta])* $name:ident $effect:literal at joint $($end:literal)? { $($fields:tt)* } $($more:tt)+) => {
        $crate::effect::effect! { @seat $(#[$meta])* $name $effect joint $($end)? { joint: usize = "From 1.", $($fields)* } $($more)+ }
    };
    ($(#[$meta:meta])* $name:ident $effect:literal at link $($end:literal)? { $($fields:tt)* } $($more:tt)+) => {
        $crate::effect::effect! {
            @seat $(#[$meta])* $name $effect link $($end)? { link: usize = "From 1: the body moved by joint N.", $($fields)* } $($more)+
        }
    };
    (@seat $(#[$meta:meta])* $name:ident $effect:literal $seat:ident $($end:literal)? { $($fields:tt)* }
     scaled by $($size:ident)+; truth |$me:ident| $($more:tt)+) => {
        $crate::effect::effect! { @type $(#[$meta])* $name { $($fields)* } }
        $crate::effect::effect! {
            @stated $name $effect |$me| Some($me.$seat); &format!(concat!("{}{}", $($end)?), &stringify!($seat)[..1], $me.$seat);
            &format!("{} {}", stringify!($seat), $me.$seat); scaled by $($size)+; $($more)+
        }
    };
    ($(#[$meta:meta])* $name:ident $effect:literal of $tag:literal $place:literal { $($fields:tt)* }
     scaled by $($size:ident)+; truth |$me:ident| $($more:tt)+) => {
        $crate::effect::effect! { @type $(#[$meta])* $name { $($fields)* } }
        $crate::effect::effect! { @stated $name $effect |$me| None; $tag; $place; scaled by $($size)+; $($more)+ }
    };
    (@stated $name:ident $effect:literal |$me:ident| $seat:expr; $tag:expr; $place:expr;
     scaled by $($size:ident)+; $numbers:expr; $($law:tt)*) => {
        impl $crate::effect::Stated for $name {
            fn seat(&$me) -> Option<usize> {
                $seat
            }
            fn scale(&mut self, by: f64) {
                $( $crate::effect::Size::scale(&mut self.$size, by); )+
            }
            fn truth(&$me) -> Vec<$crate::truth::TrueValue> {
                $crate::truth::true_values($effect, $tag, $place, $numbers)
            }
        }
        $crate::effect::effect! { @act $name $($law)* }
    };
    (@type $(#[$meta:meta])* $name:ident { $($(#[$attribute:meta])* $field:ident: $type:ty = $doc:literal,)* }) => {
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        $(#[$meta])*
        #[serde(deny_unknown_fields)]
        pub struct $name { $( #[doc = $doc] $(#[$attribute])* pub $field: $type, )* }
        impl $name {
            /// The effect of these numbers, in the order of its fields.
            #[allow(clippy::too_many_arguments, reason = "as many as it has numbers")]
            pub fn effect($($field: $type),*) -> $crate::effect::Physical {
                $crate::effect::Physical::$name(Self { $($field),* })
            }
        }
    };
    (@act $name:ident turns |$me:ident, $at:ident| $turn:expr; $($more:tt)*) => {
        impl $crate::effect::Act for $name {
            fn act(&$me, state: &$crate::effect::State, motion: &mut $crate::arm::Motion) {
                let $at = $crate::effect::AtJoint { joint: $me.joint - 1, state };
                motion.joint[$at.joint] += $turn;
            }
            $($more)*
        }
    };
    (@act $name:ident $($functions:tt)*) => {
        impl $crate::effect::Act for $name { $($functions)* }
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
    ($( $name:ident: $doc:literal, )+) => {
        /// One effect with its numbers, written `- gear_cyclic: {joint: 2, ...}`.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum Physical { $( #[doc = $doc] $name($name), )+ }
        impl Deref for Physical {
            type Target = dyn Act;
            fn deref(&self) -> &Self::Target {
                match self { $( Physical::$name(effect) => effect, )+ }
            }
        }
        impl DerefMut for Physical {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match self { $( Physical::$name(effect) => effect, )+ }
            }
        }
    };
}

physical! {
    JointCompliance: "Wind-up proportional to torque.",
    JointHardening: "Wind-up not proportional to torque.",
    LinkCompliance: "Elastic beam between two joints.",
    BaseCompliance: "The foundation tilts.",
    GearCyclic: "Error periodic in the joint angle.",
    GearMotorCyclic: "Error periodic in the motor angle.",
    Backlash: "Lost motion by direction of approach.",
    HoldingFriction: "Friction that the current shows at rest.",
    ThermalGrowth: "A link grows with temperature.",
    TrackerDrift: "The tracker's frame creeps.",
    TrackerScale: "The tracker's metre is wrong.",
    ZeroShift: "A joint's zero steps at some time.",
    AxisWobble: "The axis tilts as the joint turns.",
    BaseShift: "The base steps at some time.",
    BaseSway: "The base swings slowly.",
    CableDrag: "A hose package pulls on a joint.",
    Counterbalance: "A balancer carries part of a joint's load.",
    GearEccentricity: "Run-out of an eccentric wheel, not a pure sine.",
    GearFlank: "The two flanks of the teeth err differently.",
    JointBump: "A joint is wrong near one angle.",
    JointHinge: "A joint's error starts at some angle.",
    JointLogLag: "The log of the joints is behind.",
    JointProduct: "A joint's error is a product of two angles.",
    LinkHinge: "A link gives way at its middle.",
    LinkMass: "A link weighs otherwise than described.",
    PayloadError: "The payload is otherwise than declared.",
    ThermalWarmUp: "A link grows with its own warm-up.",
    ToolShift: "The reflector steps at some time.",
    ViscousWindup: "A joint trails behind while it turns.",
    BacklashGrowth: "Lost motion that grows with time.",
    GearLoad: "Run-out that grows with the load.",
    JointHysteresis: "Wind-up that depends on the direction of approach.",
    JointWarming: "A joint that is warm by its own work or with the arm.",
    Presliding: "Lost motion that builds up over a travel.",
    ThermalBow: "A bent link grows with temperature.",
    ThermalLag: "A link grows with a temperature that lags.",
    TrackerCircle: "The tracker's horizontal circle is off.",
    TrackerElevation: "The tracker's head is off in elevation.",
    TrackerKnock: "The tracker's stand is knocked.",
    TrackerOffset: "The tracker's ranges are off.",
    TrackerRefraction: "The tracker's ranges grow with the air's temperature.",
    TrackerSway: "The tracker's stand swings slowly.",
    Foreign: "A drawn shape in one direction of motion.",
}

impl Physical {
    /// What is wrong with its seat on a robot of so many joints.
    pub fn fault(&self, joints: usize) -> Option<String> {
        let seat = self.seat()?;
        (!(1..=joints).contains(&seat))
            .then(|| format!("sits on joint or link {seat}; allowed: 1 to {joints}"))
    }
}

/// What every effect makes of the rows before, row by row: [`Row::memory`] of each.
pub fn recall(effects: &[Physical], past: &[Moment]) -> Vec<Vec<f64>> {
    let memories: Vec<Vec<f64>> = effects.iter().map(|effect| effect.remember(past)).collect();
    if memories.iter().all(Vec::is_empty) {
        return vec![Vec::new(); past.len()];
    }
    let of_row = |row: usize| {
        let values = memories.iter().map(|all| all.get(row).copied());
        values.map(Option::unwrap_or_default).collect()
    };
    (0..past.len()).map(of_row).collect()
}
