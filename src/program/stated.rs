//! The posture that a Cartesian target states, as a posture of the arm and back.
//!
//! KRL: status S, of which bit 0 is set where the wrist centre is behind axis 1 (its x in the system that turns with axis 1 is below 0), bit 1
//! where joint 3 is beyond the stretched arm (A3 of 0 deg where axes 3 and 4 meet), bit 2 where joint 5 is below 0; bit 4 where the point was
//! taught at an absolutely accurate robot. Turn T: bit i where joint i + 1 is below 0 (KUKA System Software, Operating and Programming
//! Instructions for System Integrators, "Status and Turn"). RAPID: cf1, cf4, cf6 are the quadrants of joints 1, 4, 6; cfx counts by 4 where
//! the wrist centre is behind axis 1, by 2 where it is behind the lower arm, by 1 where joint 5 is below 0 (ABB, Technical reference manual
//! RAPID, "confdata"). An arm with a parallelogram, whose joint 3 is counted with joint 2, does not use cfx. KUKA's controllers read S and T of
//! PTP motions and go on in the posture of before along lines and circles; what was taught there states it all the same. FANUC: CONFIG's F where
//! joint 5 is above 0 and N where it is below (the wrist points down), U where the elbow is up, and the turns of joints 1, 4 and 6, of
//! which 0 is from -180 to 180 deg (FANUC, Operator's manual, "Configuration"). URScript names joints near which a pose is reached (`qnear`).

use super::JOINTS;
use crate::compensate::{ArmSides, StatedPosture, StatedSides};
use crate::robot::{JointConvention, RobotModel};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt;

/// rad, or a share of a side: nearer to a border than this a number stays as it was written.
const AT_BORDER: f64 = 1e-6;

/// What a Cartesian target says of the posture in which it is to be reached.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PostureStatement {
    /// Nothing.
    #[default]
    Unstated,
    /// RAPID: the quadrants of joints 1, 4 and 6, and cfx.
    Configuration([i32; 4]),
    /// KRL, each where it stands: status and turn.
    StatusTurn {
        /// S.
        status: Option<u32>,
        /// T.
        turn: Option<u32>,
    },
    /// FANUC: CONFIG of an arm before its base.
    Config {
        /// F: joint 5 is above 0; N: below.
        flip: bool,
        /// U: the elbow is up.
        up: bool,
        /// Whole turns of joints 1, 4 and 6.
        turns: [i32; 3],
    },
    /// URScript: near these joints, 1e-6 rad.
    Near([i32; 6]),
}

/// Joints of [`PostureStatement::Configuration`], from 0.
const QUADRANTS: [usize; 3] = [0, 3, 5];

/// An arm in the controller's counting.
pub(super) struct PostureReader<'a> {
    pub robot: &'a RobotModel,
    pub convention: &'a JointConvention,
    pub sides: Option<&'a ArmSides>,
}

impl PostureStatement {
    /// In the order in which they stand in a literal's spans: cf1, cf4, cf6, cfx, or S, T.
    pub(super) fn numbers(&self) -> Vec<i32> {
        match self {
            Self::Unstated | Self::Near(_) => Vec::new(),
            Self::Config { turns, .. } => turns.to_vec(),
            Self::Configuration(numbers) => numbers.to_vec(),
            Self::StatusTurn { status, turn } => {
                let stated = [status, turn].into_iter().flatten();
                stated.map(|bits| *bits as i32).collect()
            }
        }
    }

    /// Sides of shoulder, elbow and wrist.
    fn sides(self) -> StatedSides {
        match self {
            Self::Configuration([.., cfx]) => [4, 2, 1].map(|bit| Some(cfx & bit == 0)),
            Self::StatusTurn {
                status: Some(status),
                ..
            } => [
                Some(status & 1 == 0),
                Some(status & 2 != 0),
                Some(status & 4 == 0),
            ],
            Self::Config { flip, up, .. } => [Some(true), Some(up), Some(flip)],
            Self::Unstated | Self::Near(_) | Self::StatusTurn { status: None, .. } => [None; 3],
        }
    }
}

impl PostureReader<'_> {
    /// Why sides that a target states are not checked, where they are not.
    pub fn unchecked(&self, stated: PostureStatement) -> Option<String> {
        let name = match stated {
            PostureStatement::Configuration(_) => "cfx",
            PostureStatement::StatusTurn {
                status: Some(_), ..
            } => "S",
            PostureStatement::Config { .. } => "CONFIG",
            _ => return None,
        };
        if self.sides.is_none() {
            return Some(format!(
                "{name} is not checked: it is told of arms with parallel axes 2 and 3 and a wrist whose axes meet"
            ));
        }
        (!self.uses_sides(stated))
            .then(|| format!("{name} is not checked: an arm with a parallelogram does not use it"))
    }

    fn uses_sides(&self, stated: PostureStatement) -> bool {
        let mut coupled = self.convention.coupled().iter();
        let parallelogram = coupled.any(|coupling| (coupling.joint, coupling.by) == (2, 1));
        let is_configuration = matches!(stated, PostureStatement::Configuration(_));
        self.sides.is_some() && !(parallelogram && is_configuration)
    }

    /// What a target states as a posture; none where it states nothing.
    pub fn posture(&self, stated: PostureStatement) -> Option<StatedPosture> {
        let sides = match self.uses_sides(stated) {
            true => stated.sides(),
            false => [None; 3],
        };
        let wrist = |[one, four, six]: [i32; 3]| [(0, one), (3, four), (5, six)];
        Some(match stated {
            PostureStatement::Near(q) => {
                StatedPosture::near(&q.map(|micro| f64::from(micro) * 1e-6))
            }
            PostureStatement::Config { turns, .. } => {
                StatedPosture::of_turns(JOINTS, &wrist(turns)).on(sides)
            }
            PostureStatement::Configuration([one, four, six, _]) => {
                StatedPosture::of_quadrants(JOINTS, &wrist([one, four, six])).on(sides)
            }
            PostureStatement::StatusTurn {
                turn: Some(turn), ..
            } => {
                let below: Vec<bool> = (0..JOINTS).map(|joint| turn >> joint & 1 == 1).collect();
                StatedPosture::of_signs(&below).on(sides)
            }
            PostureStatement::StatusTurn {
                status: Some(_), ..
            } => StatedPosture::of_sides(JOINTS, sides),
            PostureStatement::Unstated | PostureStatement::StatusTurn { .. } => return None,
        })
    }

    /// What a target states once its joints are `q` (rad, as the controller counts); what it does not state stays unstated.
    pub fn restated(&self, stated: PostureStatement, q: &[f64]) -> PostureStatement {
        let mut joints = q.to_vec();
        self.convention.to_robot(&mut joints);
        let sides = self.sides.filter(|_| self.uses_sides(stated));
        let shares = sides.map(|sides| sides.at(self.robot, &joints));
        // Whether side `side` is above zero, as it was stated at a border.
        let above = |side: usize, was: bool| match shares {
            Some(shares) if shares[side].abs() > AT_BORDER => shares[side] > 0.0,
            _ => was,
        };
        let [shoulder, elbow, wrist] =
            [0, 1, 2].map(|side| above(side, stated.sides()[side].unwrap_or(true)));
        match stated {
            PostureStatement::Unstated | PostureStatement::Near(_) => stated,
            PostureStatement::Config {
                flip,
                up,
                mut turns,
            } => {
                for (number, joint) in turns.iter_mut().zip(QUADRANTS) {
                    let beyond = q[joint] / TAU - 0.5;
                    if (beyond - beyond.round()).abs() > AT_BORDER {
                        *number = (q[joint] / TAU).round() as i32;
                    }
                }
                PostureStatement::Config { flip, up, turns }
            }
            PostureStatement::Configuration([.., cfx]) => {
                let mut numbers = stated.numbers();
                for (number, joint) in numbers.iter_mut().zip(QUADRANTS) {
                    let quarters = q[joint] / FRAC_PI_2;
                    if (quarters - quarters.round()).abs() > AT_BORDER {
                        *number = quarters.floor() as i32;
                    }
                }
                let sides = 4 * i32::from(!shoulder) + 2 * i32::from(!elbow) + i32::from(!wrist);
                let cfx = if shares.is_some() { sides } else { cfx };
                PostureStatement::Configuration([numbers[0], numbers[1], numbers[2], cfx])
            }
            PostureStatement::StatusTurn { status, turn } => {
                let bits = u32::from(!shoulder) + 2 * u32::from(elbow) + 4 * u32::from(!wrist);
                let known = |status: u32| match shares {
                    Some(_) => status & !7 | bits,
                    None => status,
                };
                let sign = |turn: u32, joint: usize| match q[joint] < 0.0 {
                    true => turn | 1 << joint,
                    false => turn & !(1 << joint),
                };
                let far = || (0..JOINTS).filter(|joint| q[*joint].abs() > AT_BORDER);
                let (status, turn) = (status.map(known), turn.map(|turn| far().fold(turn, sign)));
                PostureStatement::StatusTurn { status, turn }
            }
        }
    }
}

impl fmt::Display for PostureStatement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unstated => f.write_str("no posture"),
            Self::Near(_) => f.write_str("near the joints that are named"),
            Self::Config {
                flip,
                up,
                turns: [one, four, six],
            } => {
                let (wrist, elbow) = (if *flip { 'F' } else { 'N' }, if *up { 'U' } else { 'D' });
                write!(f, "{wrist} {elbow} T, {one}, {four}, {six}")
            }
            Self::Configuration([one, four, six, x]) => write!(f, "[{one},{four},{six},{x}]"),
            Self::StatusTurn { status, turn } => {
                let given =
                    |(name, bits): (&str, &Option<u32>)| Some(format!("{name} {}", (*bits)?));
                let named = [("S", status), ("T", turn)].into_iter();
                f.write_str(&named.filter_map(given).collect::<Vec<_>>().join(", "))
            }
        }
    }
}

/// A number of a posture in the manner of `before`: a number, or a bit pattern with as many digits.
pub(super) fn written(before: &[u8], number: i32) -> String {
    let digits = before.len().saturating_sub(3);
    match before {
        [b'\'', base @ (b'B' | b'b'), ..] => format!("'{}{number:0digits$b}'", char::from(*base)),
        [b'\'', base @ (b'H' | b'h'), ..] => format!("'{}{number:0digits$X}'", char::from(*base)),
        _ => number.to_string(),
    }
}
