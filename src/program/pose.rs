//! The numbers of a program as targets of the arm, and commands as numbers of a program.
//!
//! Cartesian targets are poses of the tool in force in the frame that the program states, else of the robot file's tool, in the robot's base. They stay Cartesian: the pose at which the
//! controller, which believes in the nominal robot, drives the corrected joints.

use super::stated::{PostureReader, PostureStatement};
use super::{Literal, SolvedLiteral, TargetKind};
use crate::compensate::{
    Chain, CommandTarget, CorrectedCommand, Corrector, Nominal, Remark, turns,
};
use crate::robot::{JointConvention, RobotModel};
use crate::spatial::Pose;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// Every literal corrected, in their order; an error says why there is no command.
pub fn solve(
    literals: &[Literal],
    robot: &RobotModel,
    corrector: &mut Corrector,
) -> Vec<Result<SolvedLiteral, String>> {
    let convention = corrector.convention().clone();
    let sides = corrector.sides().cloned();
    let reader = PostureReader {
        robot,
        convention: &convention,
        sides: sides.as_ref(),
    };
    let targets = literals.iter().map(|literal| target(literal, &reader));
    let answers = corrector.batch(targets.collect());
    let mut reached = |literal: &Literal| {
        let free = Literal {
            posture: PostureStatement::Unstated,
            ..literal.clone()
        };
        let answer = corrector.batch(vec![target(&free, &reader)]).pop();
        let q = answer.and_then(|answer| answer.q);
        q.map(|q| reader.restated(literal.posture, &q))
    };
    // In which posture a target is reached that is not in the stated one.
    let reached: Vec<Option<PostureStatement>> = (literals.iter().zip(&answers))
        .map(|(literal, answer)| match is_elsewhere(answer) {
            true => reached(literal).filter(|posture| *posture != literal.posture),
            false => None,
        })
        .collect();
    let unchecked = |literal: &Literal| reader.unchecked(literal.posture);
    let first = literals.iter().position(is_unstated);
    let first_unchecked = literals
        .iter()
        .position(|literal| unchecked(literal).is_some());
    let solved = |(k, (literal, answer)): (usize, (&Literal, &CorrectedCommand))| {
        let Some(q) = &answer.q else {
            let reached = reached[k].map(|posture| format!("; it is reached in {posture}"));
            let reached = reached.unwrap_or_default();
            return Err(match is_elsewhere(answer) {
                true => format!("{} ({}){reached}", answer.remark(), literal.posture),
                false => answer.remark(),
            });
        };
        let posture = reader.restated(literal.posture, q);
        let was = literal.posture;
        let changed = (posture != was)
            .then(|| format!("posture {posture} of the corrected joints, was {was}"));
        let remarks = [
            Some(answer.remark()).filter(|remark| !remark.is_empty()),
            changed,
            (Some(k) == first).then(|| NEAREST.to_string()),
            unchecked(literal).filter(|_| Some(k) == first_unchecked),
        ];
        Ok(SolvedLiteral {
            values: values(literal, robot, &convention, q),
            posture,
            remark: remarks.into_iter().flatten().collect::<Vec<_>>().join("; "),
        })
    };
    let answered = literals.iter().zip(&answers).enumerate();
    answered.map(solved).collect()
}

/// Whether a target has no command in the posture that is stated.
fn is_elsewhere(answer: &CorrectedCommand) -> bool {
    answer.q.is_none() && answer.remarks.contains(&Remark::OtherPosture)
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
        CommandTarget {
            point: Some(pose.translation),
            rotation: Some(pose.rotation),
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
        TargetKind::Frame => {
            let [a, b, c] = [v[3], v[4], v[5]].map(f64::to_radians);
            posed(turns(a, b, c), 1e-3)
        }
        TargetKind::RotationVector => {
            let turn = Rotation3::new(Vector3::new(v[3], v[4], v[5]));
            posed(turn.into_inner(), 1.0)
        }
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
    let mut joints = q.to_vec();
    convention.to_robot(&mut joints);
    let pose =
        literal.frame.unwrap_or_else(Pose::identity).inverse() * Nominal::new(robot).place(&joints);
    let pose = pose * literal.tool.unwrap_or_else(Pose::identity);
    let unit = match literal.kind {
        TargetKind::RotationVector => 1.0,
        _ => 1e3,
    };
    let place = pose.translation.iter();
    let mut out: Vec<f64> = place.map(|metres| metres * unit).collect();
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
            let pairs = angles.iter().zip(given);
            let near = pairs.map(|(angle, given)| near(angle.to_degrees(), *given));
            let angles: Vec<f64> = near.collect();
            let apart: f64 = angles.iter().zip(given).map(|(a, b)| (a - b).abs()).sum();
            (apart, angles)
        });
        let [first, second] = alike;
        let is_nearer = second.0 < first.0;
        out.extend(if is_nearer { second.1 } else { first.1 });
    } else {
        let turn = UnitQuaternion::from_rotation_matrix(&rotation);
        let new = [turn.w, turn.i, turn.j, turn.k];
        let along: f64 = new.iter().zip(given).map(|(a, b)| a * b).sum();
        let sign = if along < 0.0 { -1.0 } else { 1.0 };
        out.extend(new.iter().map(|part| sign * part));
    }
    out
}
