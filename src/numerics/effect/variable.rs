//! What a row of a recording offers that an error may depend on.

use super::{ArmState, Place};
use crate::robot::{CircumstanceName, Memory, RobotModel};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Declares the variables, a row each: what it is of, the column of the table of causes to which it belongs, its words, and its value in a row
/// (component `k` of several); `None` where the row does not tell.
macro_rules! variables {
    (|$k:ident, $robot:ident, $state:ident|
     $( $(#[$meta:meta])* $name:ident $({ $($field:ident: $type:ty),+ })? $kind:literal ($($words:tt)+) => $value:expr; )+) => {
        /// A scalar of a row; joints count from 0 here and from 1 in words.
        #[expect(missing_docs, reason = "a field is documented with its variable")]
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Variable { $( $(#[$meta])* $name $({ $($field: $type),+ })?, )+ }

        #[allow(unused_variables, reason = "a row uses some of its numbers here, some there")]
        impl Variable {
            fn column(self) -> &'static str {
                match self { $( Self::$name $({ $($field),+ })? => $kind, )+ }
            }

            /// One of its numbers in a row; `None` where the row does not tell.
            pub(super) fn value(self, $k: usize, $robot: &RobotModel, $state: &ArmState) -> Option<f64> {
                match self { $( Self::$name $({ $($field),+ })? => $value, )+ }
            }
        }

        #[allow(unused_variables, reason = "a row uses some of its numbers here, some there")]
        impl fmt::Display for Variable {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match *self { $( Self::$name $({ $($field),+ })? => write!(f, $($words)+), )+ }
            }
        }
    };
}

variables! { |k, robot, state|
    /// Commanded position of a joint, rad or m.
    Angle { joint: usize } "angle" ("q{}", joint + 1) => Some(state.q[joint]);
    /// Angle of a joint's motor, rad: the joint's angle times its reduction ratio.
    Motor { joint: usize } "angle" ("motor {}", joint + 1)
        => Some(robot.description().joints[joint].reduction_ratio.unwrap_or(0.0) * state.q[joint]);
    /// Load torque about a joint, Nm.
    Load { joint: usize } "load" ("load of joint {}", joint + 1) => Some(state.posture.torque[joint]);
    /// Load torque plus so much friction (Nm) to the side from which the joint came, Nm.
    Push { joint: usize, friction_nm: f64 } "load" ("approach of joint {}", joint + 1)
        => Some(state.posture.torque[joint] + friction_nm * state.direction(joint));
    /// Motor current of a joint, A, where recorded.
    Current { joint: usize } "load" ("current of joint {}", joint + 1)
        => state.current().map(|all| all[joint]).filter(|current| current.is_finite());
    /// Side from which a joint came to rest, +1 or -1; 0 if it never moved.
    Approach { joint: usize } "approach" ("approach of joint {}", joint + 1) => Some(state.direction(joint));
    /// What a joint moved from the stop before, rad or m.
    Move { joint: usize } "travel" ("last move of joint {}", joint + 1) => Some(state.last_move(joint));
    /// Velocity of a joint, rad/s or m/s; 0 where the arm stood.
    Velocity { joint: usize } "speed" ("speed of joint {}", joint + 1) => Some(state.data.velocity(state.row, joint));
    /// Declared payload, kg.
    Payload "payload" ("payload") => Some(state.data.payload[state.row]);
    /// Direction of gravity as the tool sees it: one component (0 to 2, axes of the tool at the zero pose), or all three.
    Gravity { axis: Option<usize> } "load" ("direction of gravity")
        => state.posture.down(state.q.len()).map(|down| down[axis.unwrap_or(k)]);
    /// C, where recorded.
    Temperature "temperature" ("temperature") => state.data.temperature(state.row);
    /// s, or the number of the row where the recording has no clock: see `ArmState::time`.
    Time "time" ("time") => Some(state.time());
    /// A circumstance that the recording declares and laws read by name, SI.
    Circumstance { column: CircumstanceName, joint: Option<usize> } "circumstance" ("{}{}", column.text(), of_joint(joint))
        => state.data.circumstance(column.text(), state.row, joint);
    /// Moments of all that the arm carries: of effects that are no law of one scalar.
    ArmLoad "load" ("load of the arm") => None;
    /// What each joint moved from the row before.
    LastMove "travel" ("last move") => None;
    /// Velocities of all joints together.
    Speed "speed" ("speed") => None;
    /// Azimuth about the instrument's standing axis, rad.
    Azimuth "position" ("azimuth") => Some(state.sight().azimuth);
    /// Elevation above the instrument's horizon, rad.
    Elevation "position" ("elevation") => Some(state.sight().elevation);
    /// Distance from the instrument, m.
    Range "position" ("range") => Some(state.sight().range);
    /// Side to which pre-sliding friction has brought a joint that fades in over a travel (rad or m) after each reversal, -1 to 1.
    Slip { joint: usize, travel: f64 } "travel" ("travel of joint {} since it reversed", joint + 1)
        => Some(state.data.memory(Memory::Slip { joint, travel }, state.row));
    /// How far what sticks beside a joint is stretched by its travel until it slips at a limit (rad or m), rad or m.
    Stretch { joint: usize, limit: f64 } "travel"
        ("travel of joint {} that sticks up to {:.1} deg", joint + 1, limit.to_degrees())
        => Some(state.data.memory(Memory::Stretch { joint, limit }, state.row));
    /// Travel of a joint of late (rad or m), which fades with a time (s).
    Recent { joint: usize, time: f64 } "travel" ("travel of joint {} in the last {time:.0} s", joint + 1)
        => Some(state.data.memory(Memory::Recent { joint, time }, state.row));
    /// Where the tool is along a direction of the base frame, m.
    Position { along: [f64; 3] } "position" ("position of the tool along {}", arrow(&along))
        => Some(Vector3::from(along).dot(&state.posture.tool(robot)));
    /// Where the target is along a direction of the instrument's frame, m.
    Sighted { along: [f64; 3] } "position" ("position of the target along {} of the instrument", arrow(&along))
        => Some(Vector3::from(along).dot(&state.point));
    /// How fast a joint has moved of late (rad/s or m/s), forgotten with a cooling time (s).
    Work { joint: usize, cooling: f64 } "speed" ("work of joint {}", joint + 1)
        => Some(state.data.memory(Memory::Work { joint, cooling }, state.row));
    /// The recorded temperature as something feels it that follows it with a time constant (s), C.
    Lagging { lag: f64 } "temperature" ("lagging temperature")
        => state.data.temperature(state.row).map(|_| state.data.memory(Memory::Temperature { lag }, state.row));
}

fn of_joint(joint: Option<usize>) -> String {
    joint.map_or_else(String::new, |joint| format!(" of joint {}", joint + 1))
}

impl Variable {
    /// Whether it is the side from which a joint came, or how far it came from there.
    pub(super) fn is_side_of(self, joint: usize) -> bool {
        match self {
            Self::Approach { joint: of }
            | Self::Move { joint: of }
            | Self::Slip { joint: of, .. }
            | Self::Stretch { joint: of, .. } => of == joint,
            _ => false,
        }
    }

    /// The column of the table of causes to which it belongs, of something at a place.
    pub(crate) fn kind(self, place: Place) -> &'static str {
        match (self.column(), place) {
            ("angle", Place::Joint(at) | Place::Links(at, _)) if self.joint() == Some(at) => {
                "own angle"
            }
            ("angle", _) => "other angle",
            (column, _) => column,
        }
    }

    /// The joint that it is of; none of what the whole row has.
    pub(super) fn joint_mut(&mut self) -> Option<&mut usize> {
        match self {
            Self::Angle { joint }
            | Self::Motor { joint }
            | Self::Load { joint }
            | Self::Push { joint, .. }
            | Self::Current { joint }
            | Self::Approach { joint }
            | Self::Move { joint }
            | Self::Velocity { joint }
            | Self::Slip { joint, .. }
            | Self::Stretch { joint, .. }
            | Self::Recent { joint, .. }
            | Self::Work { joint, .. } => Some(joint),
            Self::Circumstance { joint, .. } => joint.as_mut(),
            _ => None,
        }
    }

    /// What its memory of the rows before is measured by: a travel, a limit, a time.
    pub(super) fn constant_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Slip { travel: it, .. }
            | Self::Stretch { limit: it, .. }
            | Self::Recent { time: it, .. }
            | Self::Work { cooling: it, .. }
            | Self::Lagging { lag: it } => Some(it),
            _ => None,
        }
    }

    pub(super) fn joint(mut self) -> Option<usize> {
        self.joint_mut().copied()
    }

    /// The joint without whose motion it says nothing.
    pub fn by_motion_of(self) -> Option<usize> {
        match self {
            Self::Load { .. }
            | Self::Push { .. }
            | Self::Current { .. }
            | Self::Circumstance { .. } => None,
            _ => self.joint(),
        }
    }

    pub(super) fn constant(mut self) -> Option<f64> {
        self.constant_mut().copied()
    }

    /// How many numbers it is.
    pub(super) fn components(self) -> usize {
        if self == (Self::Gravity { axis: None }) {
            3
        } else {
            1
        }
    }

    /// Whether it is one number of a row.
    pub fn is_single(self) -> bool {
        self.components() == 1 && !matches!(self, Self::ArmLoad | Self::LastMove | Self::Speed)
    }

    /// By how much a value is beyond a range, at most 1: as a share of the range, of a load of its distance from no load.
    pub(super) fn share_beyond(self, value: f64, [low, high]: [f64; 2]) -> f64 {
        let loads = matches!(
            self,
            Self::Load { .. } | Self::Push { .. } | Self::Current { .. } | Self::ArmLoad
        );
        let [low, high] = if loads {
            [low.min(0.0), high.max(0.0)]
        } else {
            [low, high]
        };
        let span = if loads { high.max(-low) } else { high - low };
        let off = (low - value).max(value - high).max(0.0);
        if off == 0.0 {
            0.0
        } else {
            (off / span).min(1.0)
        }
    }

    /// Whether both are one quantity, with other numbers (a limit, a time, a direction) or the same.
    pub fn is_alike(self, other: Self) -> bool {
        match (self, other) {
            (Self::Stretch { .. }, Self::Stretch { .. })
            | (Self::Recent { .. }, Self::Recent { .. }) => self.joint() == other.joint(),
            (Self::Position { .. }, Self::Position { .. })
            | (Self::Sighted { .. }, Self::Sighted { .. }) => true,
            _ => self == other,
        }
    }

    /// Whether its value needs to know how the arm hangs.
    pub(super) fn needs_torque(self) -> bool {
        matches!(
            self,
            Self::Load { .. }
                | Self::Push { .. }
                | Self::Gravity { .. }
                | Self::ArmLoad
                | Self::Position { .. }
        )
    }

    /// Whether no target states it: it follows from the moves before, or is a circumstance that targets have no column for.
    pub(crate) fn is_no_targets(self) -> bool {
        let by_moves = matches!(
            self,
            Self::Move { .. } | Self::Stretch { .. } | Self::Recent { .. } | Self::Work { .. }
        );
        by_moves || matches!(self, Self::Circumstance { .. })
    }

    /// Whether it follows from the way to the row, which nobody knows for the first one.
    pub fn follows_the_way(self) -> bool {
        let last = matches!(
            self,
            Self::Push { .. } | Self::Approach { .. } | Self::Move { .. } | Self::LastMove
        );
        last || matches!(
            self,
            Self::Slip { .. } | Self::Stretch { .. } | Self::Recent { .. }
        )
    }
}

fn arrow([x, y, z]: &[f64; 3]) -> String {
    format!("({x:.2}, {y:.2}, {z:.2})")
}
