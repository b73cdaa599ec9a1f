//! The numbers of a program as targets of the arm, and commands as numbers of a program.
//!
//! Cartesian targets are poses of the tool in force in the frame that the program states, else of the robot file's tool, in the robot's base. They stay Cartesian: the pose at which the
//! controller, which believes in the nominal robot, drives the corrected joints.
//!
//! The posture that a Cartesian target states, as a posture of the arm and back.

use super::{JOINTS, Literal, SolvedLiteral, TargetKind};
use crate::compensate::{
    ArmSides, Chain, CommandTarget, CorrectedCommand, Corrector, Nominal, Remark, StatedPosture,
    StatedSides, turns,
};
use crate::robot::{JointConvention, RobotModel};
use crate::spatial::Pose;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt;

/// Every literal corrected, in their order; an error says why there is no command.
pub fn solve(
    literals: &[Literal],
    robot: &RobotModel,
    corrector: &mut Corrector,
) -> Vec<Result<SolvedLiteral, String>> {
    let targets = {
        let reader = PostureReader {
            robot,
            convention: corrector.convention(),
            sides: corrector.sides(),
        };
        literals
            .iter()
            .map(|literal| target(literal, &reader))
            .collect()
    };
    let answers = corrector.batch(targets);
    let reader = PostureReader {
        robot,
        convention: corrector.convention(),
        sides: corrector.sides(),
    };
    let first = literals.iter().position(is_unstated);
    let unchecked = |literal: &Literal| reader.unchecked(literal.posture);
    let first_unchecked = literals
        .iter()
        .position(|literal| unchecked(literal).is_some());
    let solved = |(k, (literal, answer)): (usize, (&Literal, &CorrectedCommand))| match &answer.q {
        Some(q) => {
            let posture = reader.restated(literal.posture, q);
            let changed = (posture != literal.posture).then(|| {
                format!(
                    "posture {} of the corrected joints, was {}",
                    posture, literal.posture
                )
            });
            let nearest = (Some(k) == first).then(|| NEAREST.to_string());
            let unchecked = unchecked(literal).filter(|_| Some(k) == first_unchecked);
            let known = Some(answer.remark()).filter(|remark| !remark.is_empty());
            let remark = known
                .into_iter()
                .chain(changed)
                .chain(nearest)
                .chain(unchecked)
                .collect::<Vec<_>>()
                .join("; ");
            Ok(SolvedLiteral {
                values: values(literal, robot, corrector.convention(), q),
                posture,
                remark,
            })
        }
        None if answer.remarks.contains(&Remark::OtherPosture) => {
            Err(format!("{} ({})", answer.remark(), literal.posture))
        }
        None => Err(answer.remark()),
    };
    literals
        .iter()
        .zip(&answers)
        .enumerate()
        .map(solved)
        .collect()
}

/// Once a program, at its first such target.
const NEAREST: &str = "posture not stated: taken nearest to the target before";

fn is_unstated(literal: &Literal) -> bool {
    !literal.kind.is_of_joints() && literal.posture == PostureStatement::Unstated
}

fn target(literal: &Literal, reader: &PostureReader) -> CommandTarget {
    let v = &literal.values;
    let stated = CommandTarget {
        payload: literal.payload,
        ..CommandTarget::default()
    };
    let posed = |rotation: Matrix3<f64>, unit: f64| {
        let pose = literal.frame.unwrap_or_else(Pose::identity)
            * Pose::new(rotation, Vector3::new(v[0], v[1], v[2]) * unit);
        let pose = pose * literal.tool.unwrap_or_else(Pose::identity).inverse();
        let (point, rotation) = (Some(pose.translation), Some(pose.rotation));
        CommandTarget {
            point,
            rotation,
            posture: reader.posture(literal.posture),
            ..stated.clone()
        }
    };
    match literal.kind {
        TargetKind::Joints => CommandTarget {
            q: Some(v.iter().map(|deg| deg.to_radians()).collect()),
            ..stated
        },
        TargetKind::Radians => CommandTarget {
            q: Some(v.clone()),
            ..stated
        },
        TargetKind::Frame => posed(
            turns(v[3].to_radians(), v[4].to_radians(), v[5].to_radians()),
            1e-3,
        ),
        TargetKind::RotationVector => posed(
            Rotation3::new(Vector3::new(v[3], v[4], v[5])).into_inner(),
            1.0,
        ),
        TargetKind::Quaternion => {
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(v[3], v[4], v[5], v[6]));
            posed(turn.to_rotation_matrix().into_inner(), 1e-3)
        }
    }
}

fn values(
    literal: &Literal,
    robot: &RobotModel,
    convention: &JointConvention,
    q: &[f64],
) -> Vec<f64> {
    match literal.kind {
        TargetKind::Joints => return q.iter().map(|q| q.to_degrees()).collect(),
        TargetKind::Radians => return q.to_vec(),
        _ => {}
    }
    let mut own = q.to_vec();
    convention.to_robot(&mut own);
    let pose =
        literal.frame.unwrap_or_else(Pose::identity).inverse() * Nominal::new(robot).place(&own);
    let pose = pose * literal.tool.unwrap_or_else(Pose::identity);
    let unit = if literal.kind == TargetKind::RotationVector {
        1.0
    } else {
        1e3
    };
    let mut out: Vec<f64> = pose
        .translation
        .iter()
        .map(|metres| metres * unit)
        .collect();
    let rotation = Rotation3::from_matrix_unchecked(pose.rotation);
    let given = &literal.values[3..];
    if literal.kind == TargetKind::RotationVector {
        let (vector, given) = (pose.rotation_vector(), Vector3::from_column_slice(given));
        let angle = vector.norm();
        // A turn is the same with whole ones added: the nearest to the given is taken, whose axis is that of a turn by nothing.
        let axis = if angle > 1e-9 {
            vector / angle
        } else {
            given.try_normalize(1e-9).unwrap_or_else(Vector3::x)
        };
        let alike = (-1..=1).map(|turn| axis * (angle + std::f64::consts::TAU * f64::from(turn)));
        let nearest = alike.min_by(|a, b| (a - given).norm().total_cmp(&(b - given).norm()));
        out.extend(nearest.unwrap_or(vector).iter());
    } else if literal.kind == TargetKind::Frame {
        let (c, b, a) = rotation.euler_angles();
        // One rotation has several sets of angles: those nearest to the given are taken, so that 180 does not become -180.
        let near = |angle: f64, given: f64| angle + 360.0 * ((given - angle) / 360.0).round();
        let alike = [[a, b, c], [a + PI, PI - b, c + PI]].map(|angles| {
            let angles: Vec<f64> = angles
                .iter()
                .zip(given)
                .map(|(angle, given)| near(angle.to_degrees(), *given))
                .collect();
            let apart: f64 = angles.iter().zip(given).map(|(a, b)| (a - b).abs()).sum();
            (apart, angles)
        });
        let [first, second] = alike;
        out.extend(if second.0 < first.0 {
            second.1
        } else {
            first.1
        });
    } else {
        let turn = UnitQuaternion::from_rotation_matrix(&rotation);
        let new = [turn.w, turn.i, turn.j, turn.k];
        let sign = if new.iter().zip(given).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
            -1.0
        } else {
            1.0
        };
        out.extend(new.iter().map(|part| sign * part));
    }
    out
}

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
            Self::StatusTurn { status, turn } => [status, turn]
                .into_iter()
                .flatten()
                .map(|bits| *bits as i32)
                .collect(),
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
            PostureStatement::Unstated
            | PostureStatement::Near(_)
            | PostureStatement::StatusTurn { status: None, .. } => {
                return None;
            }
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
        let parallelogram = self
            .convention
            .coupled()
            .iter()
            .any(|coupling| (coupling.joint, coupling.by) == (2, 1));
        self.sides.is_some()
            && !(parallelogram && matches!(stated, PostureStatement::Configuration(_)))
    }

    /// What a target states as a posture; none where it states nothing.
    pub fn posture(&self, stated: PostureStatement) -> Option<StatedPosture> {
        let sides = if self.uses_sides(stated) {
            stated.sides()
        } else {
            [None; 3]
        };
        match stated {
            PostureStatement::Unstated
            | PostureStatement::StatusTurn {
                status: None,
                turn: None,
            } => None,
            PostureStatement::Near(q) => {
                Some(StatedPosture::near(&q.map(|micro| f64::from(micro) * 1e-6)))
            }
            PostureStatement::Config {
                turns: [one, four, six],
                ..
            } => Some(StatedPosture::of_turns(JOINTS, &[(0, one), (3, four), (5, six)]).on(sides)),
            PostureStatement::Configuration([one, four, six, _]) => Some(
                StatedPosture::of_quadrants(JOINTS, &[(0, one), (3, four), (5, six)]).on(sides),
            ),
            PostureStatement::StatusTurn {
                turn: Some(turn), ..
            } => {
                let below: Vec<bool> = (0..JOINTS).map(|joint| turn >> joint & 1 == 1).collect();
                Some(StatedPosture::of_signs(&below).on(sides))
            }
            PostureStatement::StatusTurn { turn: None, .. } => {
                Some(StatedPosture::of_sides(JOINTS, sides))
            }
        }
    }

    /// What a target states once its joints are `q` (rad, as the controller counts); what it does not state stays unstated.
    pub fn restated(&self, stated: PostureStatement, q: &[f64]) -> PostureStatement {
        let mut own = q.to_vec();
        self.convention.to_robot(&mut own);
        let shares = self
            .sides
            .filter(|_| self.uses_sides(stated))
            .map(|sides| sides.at(self.robot, &own));
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
                let status = status.map(|status| {
                    if shares.is_some() {
                        status & !7 | bits
                    } else {
                        status
                    }
                });
                let turn = turn.map(|turn| {
                    (0..JOINTS)
                        .filter(|joint| q[*joint].abs() > AT_BORDER)
                        .fold(turn, |turn, joint| {
                            if q[joint] < 0.0 {
                                turn | 1 << joint
                            } else {
                                turn & !(1 << joint)
                            }
                        })
                });
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
                write!(
                    f,
                    "{} {} T, {one}, {four}, {six}",
                    if *flip { 'F' } else { 'N' },
                    if *up { 'U' } else { 'D' }
                )
            }
            Self::Configuration([one, four, six, x]) => write!(f, "[{one},{four},{six},{x}]"),
            Self::StatusTurn { status, turn } => {
                let named = [("S", status), ("T", turn)].into_iter();
                let given: Vec<String> = named
                    .filter_map(|(name, bits)| bits.map(|bits| format!("{name} {bits}")))
                    .collect();
                f.write_str(&given.join(", "))
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
