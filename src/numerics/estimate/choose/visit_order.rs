//! How to drive the poses: payload by payload along a short path, and from which side each joint comes to rest.

use super::point_jacobian::PointJacobian;
use crate::effect::{EffectContext, EffectStack, Load, arm_effect};
use crate::estimate::factor::{axpy, norm as length};
use crate::estimate::model::Model;
use crate::robot::Measurements;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Rows in the order of driving: by payload, each next the nearest in joint space from the zero pose on, then untangled.
pub(super) fn order(poses: &Measurements, ranges: &[[f64; 2]]) -> Vec<usize> {
    let place = |row: usize| -> Vec<f64> {
        poses
            .q(row)
            .iter()
            .zip(ranges)
            .map(|(q, [a, b])| q / (b - a))
            .collect()
    };
    let places: Vec<Vec<f64>> = (0..poses.rows()).map(place).collect();
    let far = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let mut payloads = poses.payload.clone();
    payloads.sort_by(f64::total_cmp);
    payloads.dedup();
    let mut here: Vec<f64> = ranges
        .iter()
        .map(|[a, b]| 0f64.clamp(*a, *b) / (b - a))
        .collect();
    let mut out = Vec::with_capacity(poses.rows());
    for payload in payloads {
        let mut left: Vec<usize> = (0..poses.rows())
            .filter(|row| poses.payload[*row] == payload)
            .collect();
        let mut path: Vec<usize> = Vec::with_capacity(left.len());
        let begin = here.clone();
        while let Some(at) = (0..left.len())
            .min_by(|a, b| far(&here, &places[left[*a]]).total_cmp(&far(&here, &places[left[*b]])))
        {
            let next = left.swap_remove(at);
            here.clone_from(&places[next]);
            path.push(next);
        }
        // Turning a stretch round shortens the path wherever two of its moves cross (2-opt).
        let place = |path: &[usize], i: usize| {
            if i == 0 {
                begin.clone()
            } else {
                places[path[i - 1]].clone()
            }
        };
        let mut shorter = true;
        while shorter {
            shorter = false;
            for i in 0..path.len() {
                for j in i + 1..path.len() {
                    let (before, first, last) =
                        (place(&path, i), &places[path[i]], &places[path[j]]);
                    let after = path.get(j + 1).map(|row| &places[*row]);
                    let length = |a: &[f64], b: &[f64]| {
                        far(&before, a) + after.map_or(0.0, |after| far(b, after))
                    };
                    if length(last, first) < length(first, last) - 1e-9 {
                        path[i..=j].reverse();
                        shorter = true;
                    }
                }
            }
        }
        if let Some(last) = path.last() {
            here.clone_from(&places[*last]);
        }
        out.extend(path);
    }
    out
}

/// Sides of approach (+1, -1; row-major) under which an error by direction is least imitated by seen parameters and by the same
/// error of earlier joints; and the least share of it, over the joints, that stays visible.
pub(super) fn approach(
    model: &Model,
    jacobian: &PointJacobian,
    poses: &Measurements,
    seed: u64,
) -> (Vec<f64>, f64) {
    let (rows, joints) = (poses.rows(), poses.joints);
    let q = jacobian.rows(model, poses).qr().compute_thin_Q();
    let mut basis: Vec<Vec<f64>> = (0..q.ncols()).map(|j| q.col_as_slice(j).to_vec()).collect();
    let turns = turns(model, poses);
    let mut draw = ChaCha8Rng::seed_from_u64(seed.wrapping_add(3));
    let mut out = vec![1.0; rows * joints];
    let mut least: f64 = 1.0;
    for joint in 0..joints {
        let turn = |i: usize| turns[i * joints + joint];
        let mut side: Vec<f64> = (0..rows)
            .map(|_| if draw.random::<bool>() { 1.0 } else { -1.0 })
            .collect();
        // Each row's part along every direction of the basis: a flip changes their sums.
        let parts: Vec<Vec<f64>> = (0..rows)
            .map(|row| {
                basis
                    .iter()
                    .map(|along| (3 * row..3 * row + 3).map(|i| along[i] * turn(i)).sum())
                    .collect()
            })
            .collect();
        let mut sums: Vec<f64> = (0..basis.len())
            .map(|k| (0..rows).map(|row| side[row] * parts[row][k]).sum())
            .collect();
        let mut flipped = true;
        while flipped {
            flipped = false;
            for row in 0..rows {
                let cross: f64 = sums
                    .iter()
                    .zip(&parts[row])
                    .map(|(sum, part)| sum * part)
                    .sum();
                let square: f64 = parts[row].iter().map(|part| part * part).sum();
                if side[row] * cross > square + 1e-12 * square.abs() {
                    sums.iter_mut()
                        .zip(&parts[row])
                        .for_each(|(sum, part)| *sum -= 2.0 * side[row] * part);
                    side[row] = -side[row];
                    flipped = true;
                }
            }
        }
        let mut residual: Vec<f64> = (0..3 * rows).map(|i| side[i / 3] * turn(i)).collect();
        let whole = length(&residual);
        for (along, sum) in basis.iter().zip(&sums) {
            axpy(-sum, along, &mut residual);
        }
        let visible = length(&residual);
        // A joint that does not move the measured point has nothing to show.
        if whole > 0.0 {
            least = least.min(visible / whole);
            if visible > 1e-9 * whole {
                residual.iter_mut().for_each(|value| *value /= visible);
                basis.push(residual);
            }
        }
        for (row, side) in side.into_iter().enumerate() {
            out[row * joints + joint] = side;
        }
    }
    (out, least)
}

/// Derivatives of the points by the joint positions over sigma; row-major, 3 rows a pose.
fn turns(model: &Model, poses: &Measurements) -> Vec<f64> {
    let setting = EffectContext {
        base: *model.stack.base(),
        load: Load::GravityTorque,
    };
    let effects = arm_effect("joint_offset", &setting).into_iter().collect();
    let stack = EffectStack::new(&model.robot, setting.base, effects);
    let (mut scratch, x) = (stack.scratch(&model.robot), vec![0.0; stack.specs().len()]);
    let mut out = vec![0.0; 3 * poses.rows() * poses.joints];
    for row in 0..poses.rows() {
        stack.derivatives(
            &model.robot,
            poses,
            row,
            &x,
            &mut scratch,
            |joint, derivative| {
                for axis in 0..3 {
                    out[(3 * row + axis) * poses.joints + joint] +=
                        derivative[axis] / poses.points.sigma[row][axis];
                }
            },
        );
    }
    out
}
