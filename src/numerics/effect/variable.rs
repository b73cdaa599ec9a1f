//! What a row of a recording offers that an error may depend on.

use super::{ArmState, Place};
use crate::robot::{CircumstanceName, Memory, RobotModel};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A scalar of a row; joints count from 0 here and from 1 in words.
#[expect(missing_docs, reason = "a field is documented with its variable")]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variable {
    /// Commanded position of a joint, rad or m.
    Angle { joint: usize },
    /// Angle of a joint's motor, rad: the joint's angle times its reduction ratio.
    Motor { joint: usize },
    /// Load torque about a joint, Nm.
    Load { joint: usize },
    /// Load torque plus so much friction (Nm) to the side from which the joint came, Nm.
    Push { joint: usize, friction_nm: f64 },
    /// Motor current of a joint, A, where recorded.
    Current { joint: usize },
    /// Side from which a joint came to rest, +1 or -1; 0 if it never moved.
    Approach { joint: usize },
    /// What a joint moved from the stop before, rad or m.
    Move { joint: usize },
    /// Velocity of a joint, rad/s or m/s; 0 where the arm stood.
    Velocity { joint: usize },
    /// Declared payload, kg.
    Payload,
    /// Direction of gravity as the tool sees it: one component (0 to 2, axes of the tool at the zero pose), or all three.
    Gravity { axis: Option<usize> },
    /// C, where recorded.
    Temperature,
    /// s, or the number of the row where the recording has no clock: see `ArmState::time`.
    Time,
    /// A circumstance that the recording declares and laws read by name, SI.
    Circumstance {
        column: CircumstanceName,
        joint: Option<usize>,
    },
    /// Moments of all that the arm carries: of effects that are no law of one scalar.
    ArmLoad,
    /// What each joint moved from the row before.
    LastMove,
    /// Velocities of all joints together.
    Speed,
    /// Azimuth about the instrument's standing axis, rad.
    Azimuth,
    /// Elevation above the instrument's horizon, rad.
    Elevation,
    /// Distance from the instrument, m.
    Range,
    /// Side to which pre-sliding friction has brought a joint that fades in over a travel (rad or m) after each reversal, -1 to 1.
    Slip { joint: usize, travel: f64 },
    /// How far what sticks beside a joint is stretched by its travel until it slips at a limit (rad or m), rad or m.
    Stretch { joint: usize, limit: f64 },
    /// Travel of a joint of late (rad or m), which fades with a time (s).
    Recent { joint: usize, time: f64 },
    /// Where the tool is along a direction of the base frame, m.
    Position { along: [f64; 3] },
    /// Where the target is along a direction of the instrument's frame, m.
    Sighted { along: [f64; 3] },
    /// How fast a joint has moved of late (rad/s or m/s), forgotten with a cooling time (s).
    Work { joint: usize, cooling: f64 },
    /// The recorded temperature as something feels it that follows it with a time constant (s), C.
    Lagging { lag: f64 },
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
        match self {
            Self::Angle { joint } | Self::Motor { joint } => match place {
                Place::Joint(at) | Place::Links(at, _) if at == joint => "own angle",
                _ => "other angle",
            },
            Self::Load { .. }
            | Self::Push { .. }
            | Self::Current { .. }
            | Self::Gravity { .. }
            | Self::ArmLoad => "load",
            Self::Payload => "payload",
            Self::Approach { .. } => "approach",
            Self::Move { .. }
            | Self::Slip { .. }
            | Self::Stretch { .. }
            | Self::Recent { .. }
            | Self::LastMove => "travel",
            Self::Velocity { .. } | Self::Speed | Self::Work { .. } => "speed",
            Self::Temperature | Self::Lagging { .. } => "temperature",
            Self::Time => "time",
            Self::Azimuth
            | Self::Elevation
            | Self::Range
            | Self::Position { .. }
            | Self::Sighted { .. } => "position",
            Self::Circumstance { .. } => "circumstance",
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

    /// One of its numbers in a row; `None` where the row does not tell.
    pub(super) fn value(
        self,
        component: usize,
        robot: &RobotModel,
        state: &ArmState,
    ) -> Option<f64> {
        let remembered = |memory| state.data.memory(memory, state.row);
        match self {
            Self::Angle { joint } => Some(state.q[joint]),
            Self::Motor { joint } => Some(
                robot.description().joints[joint]
                    .reduction_ratio
                    .unwrap_or(0.0)
                    * state.q[joint],
            ),
            Self::Load { joint } => Some(state.posture.torque[joint]),
            Self::Push { joint, friction_nm } => {
                Some(state.posture.torque[joint] + friction_nm * state.direction(joint))
            }
            Self::Current { joint } => state
                .current()
                .map(|all| all[joint])
                .filter(|current| current.is_finite()),
            Self::Approach { joint } => Some(state.direction(joint)),
            Self::Move { joint } => Some(state.last_move(joint)),
            Self::Velocity { joint } => Some(state.data.velocity(state.row, joint)),
            Self::Payload => Some(state.data.payload[state.row]),
            Self::Gravity { axis } => state
                .posture
                .down(state.q.len())
                .map(|down| down[axis.unwrap_or(component)]),
            Self::Temperature => state.data.temperature(state.row),
            Self::Time => Some(state.time()),
            Self::Circumstance { column, joint } => {
                state.data.circumstance(column.text(), state.row, joint)
            }
            Self::Azimuth => Some(state.sight().azimuth),
            Self::Elevation => Some(state.sight().elevation),
            Self::Range => Some(state.sight().range),
            Self::Slip { joint, travel } => Some(remembered(Memory::Slip { joint, travel })),
            Self::Stretch { joint, limit } => Some(remembered(Memory::Stretch { joint, limit })),
            Self::Recent { joint, time } => Some(remembered(Memory::Recent { joint, time })),
            Self::Position { along } => Some(Vector3::from(along).dot(&state.posture.tool(robot))),
            Self::Sighted { along } => Some(Vector3::from(along).dot(&state.point)),
            Self::Work { joint, cooling } => Some(remembered(Memory::Work { joint, cooling })),
            Self::Lagging { lag } => {
                (state.data.temperature(state.row)).map(|_| remembered(Memory::Temperature { lag }))
            }
            Self::ArmLoad | Self::LastMove | Self::Speed => None,
        }
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

impl fmt::Display for Variable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Angle { joint } => write!(f, "q{}", joint + 1),
            Self::Motor { joint } => write!(f, "motor {}", joint + 1),
            Self::Load { joint } => write!(f, "load of joint {}", joint + 1),
            Self::Push { joint, .. } | Self::Approach { joint } => {
                write!(f, "approach of joint {}", joint + 1)
            }
            Self::Current { joint } => write!(f, "current of joint {}", joint + 1),
            Self::Move { joint } => write!(f, "last move of joint {}", joint + 1),
            Self::Velocity { joint } => write!(f, "speed of joint {}", joint + 1),
            Self::Payload => f.write_str("payload"),
            Self::Gravity { .. } => f.write_str("direction of gravity"),
            Self::Temperature => f.write_str("temperature"),
            Self::Time => f.write_str("time"),
            Self::Circumstance {
                column,
                joint: None,
            } => f.write_str(column.text()),
            Self::Circumstance {
                column,
                joint: Some(joint),
            } => write!(f, "{} of joint {}", column.text(), joint + 1),
            Self::ArmLoad => f.write_str("load of the arm"),
            Self::LastMove => f.write_str("last move"),
            Self::Speed => f.write_str("speed"),
            Self::Azimuth => f.write_str("azimuth"),
            Self::Elevation => f.write_str("elevation"),
            Self::Range => f.write_str("range"),
            Self::Slip { joint, .. } => {
                write!(f, "travel of joint {} since it reversed", joint + 1)
            }
            Self::Stretch { joint, limit } => {
                write!(
                    f,
                    "travel of joint {} that sticks up to {:.1} deg",
                    joint + 1,
                    limit.to_degrees()
                )
            }
            Self::Recent { joint, time } => {
                write!(f, "travel of joint {} in the last {time:.0} s", joint + 1)
            }
            Self::Position { along } => write!(f, "position of the tool along {}", arrow(along)),
            Self::Sighted { along } => write!(
                f,
                "position of the target along {} of the instrument",
                arrow(along)
            ),
            Self::Work { joint, .. } => write!(f, "work of joint {}", joint + 1),
            Self::Lagging { .. } => f.write_str("lagging temperature"),
        }
    }
}

fn arrow([x, y, z]: &[f64; 3]) -> String {
    format!("({x:.2}, {y:.2}, {z:.2})")
}
