//! Covariance that does not believe rows of one pose to be independent: the sandwich, clustered by pose.
//!
//! A' A with one row R^-1 R^-T J' (1 - H)^-1/2 e per pose (Bell and McCaffrey, 2002: unbiased where the stated noise is right).

use super::factor::{RowSums, StackedRows};
use super::model::Model;
use super::problem::{ObservationTerm, Problem, columns};
use crate::estimate::factor::Triangle;
use crate::observation::KINDS;
use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};
use rayon::prelude::*;

/// A direction in which a pose alone decides has nothing left to show its error by: its share is capped here.
const SOLE: f64 = 0.98;
/// Poses whose rows are factored at once.
const CHUNK: usize = 256;

/// A root of the covariance of the `free` parameters (upper triangular, p x p) whose factor's inverse is `inverse`, priors included.
pub(crate) fn clustered(
    problem: &Problem,
    model: &Model,
    free: &[usize],
    inverse: &Triangle,
    poses: &[Vec<usize>],
) -> Triangle {
    let p = free.len();
    let column = columns(model, free);
    let lines: Vec<Vec<f64>> = poses
        .par_iter()
        .map_init(
            || (model.stack.scratch(&model.robot), Vec::new()),
            |(scratch, jacobian), pose| {
                let (mut errors, mut visible) = (Vec::new(), Vec::new());
                for &row in pose {
                    let mut placed = model.place(problem.data, row, scratch);
                    for kind in KINDS {
                        let Some((term, _)) =
                            ObservationTerm::of(*kind, problem.data, row, &placed, problem.excess)
                        else {
                            continue;
                        };
                        let share = term.share();
                        jacobian.clear();
                        jacobian.resize(p, Vector3::zeros());
                        let sensitivity = &term.sensitivity;
                        sensitivity.derivatives(&mut placed, |parameter, derivative| {
                            if let Some(j) = column[parameter] {
                                jacobian[j] += derivative;
                            }
                        });
                        let error = term.error * share;
                        for line in 0..3 {
                            errors.push(error[line]);
                            visible.extend((0..p).map(|k| {
                                (0..=k)
                                    .map(|j| jacobian[j][line] * inverse.at(j, k))
                                    .sum::<f64>()
                                    * share
                            }));
                        }
                    }
                }
                let visible = DMatrix::from_row_slice(errors.len(), p, &visible);
                influence(&visible, &DVector::from_vec(errors), inverse)
            },
        )
        .collect();
    let priors = free
        .iter()
        .enumerate()
        .filter_map(|(j, k)| model.known(*k).prior.map(|prior| (j, 1.0 / prior.sigma)));
    let prior_lines = priors.map(|(j, weight)| {
        upwards(inverse, |k| {
            if k < j {
                0.0
            } else {
                inverse.at(j, k) * weight
            }
        })
    });
    triangle(p, lines.into_iter().chain(prior_lines))
}

/// What one pose does to the parameters: R^-1 G' (1 - G G')^-1/2 e.
fn influence(visible: &DMatrix<f64>, errors: &DVector<f64>, inverse: &Triangle) -> Vec<f64> {
    let eigen = SymmetricEigen::new(visible * visible.transpose());
    let mut along = eigen.eigenvectors.tr_mul(errors);
    for (value, share) in along.iter_mut().zip(eigen.eigenvalues.iter()) {
        *value /= (1.0 - share.clamp(0.0, SOLE)).sqrt();
    }
    let score = visible.tr_mul(&(&eigen.eigenvectors * along));
    upwards(inverse, |k| score[k])
}

/// R^-1 times a vector.
fn upwards(inverse: &Triangle, vector: impl Fn(usize) -> f64) -> Vec<f64> {
    let p = inverse.size();
    (0..p)
        .map(|j| (j..p).map(|k| inverse.at(j, k) * vector(k)).sum())
        .collect()
}

/// The upper triangular root of A' A: columns are factored last first, and the factor turned over.
fn triangle(p: usize, lines: impl Iterator<Item = Vec<f64>>) -> Triangle {
    let mut tall = StackedRows::new(p + 1, CHUNK);
    let lines: Vec<Vec<f64>> = lines.collect();
    for some in lines.chunks(CHUNK) {
        let mut chunk = tall.chunk(some.len());
        for (i, line) in some.iter().enumerate() {
            for (column, value) in chunk.iter_mut().zip(line.iter().rev()) {
                column[i] = *value;
            }
        }
        tall.absorb(some.len());
    }
    let factor = tall.sum();
    Triangle::from_fn(p, |a, b| factor.entry(p - 1 - b, p - 1 - a))
}
