//! Cross-validation: every fitted row predicted by a fit that has not seen its pose, in folds drawn at random and in contiguous
//! blocks. Rows of one pose stay together: a pose that was seen is no test.

use super::fit::{Fate, FitOptions, Fitted, fit};
use super::model::Model;
use super::piece::miss;
use super::repeats::Poses;
use crate::robot::Measurements;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use rayon::prelude::*;

/// Errors (m) of rows under fits without them, in the order of the fitted rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Folds {
    pub count: usize,
    /// Folds drawn at random: new poses among those that were measured.
    pub random: Vec<f64>,
    /// Contiguous stretches of the recording: poses of another time and, often, another region.
    pub blocks: Vec<f64>,
}

/// Repeats a fit `2 * count` times, each without a part of its rows. `None` where the poses are too few for it.
///
/// Each starts at the whole fit's solution and estimates what that one saw; which rows were set aside is taken over.
pub fn cross_validate(
    model: &Model,
    data: &Measurements,
    rows: &[usize],
    fitted: &Fitted,
    count: usize,
    seed: u64,
) -> Option<Folds> {
    let candidates: Vec<usize> =
        (0..fitted.fates.len()).filter(|k| matches!(fitted.fates[*k], Fate::Free(_) | Fate::Bound(_))).collect();
    let poses = Poses::of(data, rows);
    let mut order: Vec<&Vec<usize>> = poses.all().iter().collect();
    let left = (rows.len() * (count.max(1) - 1)) / count.max(1);
    if count < 2 || order.len() < 2 * count || 3 * left <= candidates.len() {
        return None;
    }
    let blocks = deal(&order, rows.len(), count);
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let random = deal(&order, rows.len(), count);
    let parts: Vec<&Vec<usize>> = random.iter().chain(&blocks).collect();
    let errors: Vec<Vec<f64>> = parts.par_iter().map(|part| without(model, data, rows, &candidates, part)).collect();
    let (one, other) = errors.split_at(count);
    Some(Folds { count, random: gather(data, rows, &random, one), blocks: gather(data, rows, &blocks, other) })
}

/// Rows of each fold, sorted: poses in the given order, about as many rows in each.
fn deal(poses: &[&Vec<usize>], rows: usize, count: usize) -> Vec<Vec<usize>> {
    let mut folds = vec![Vec::new(); count];
    let mut dealt = 0;
    for pose in poses {
        // A pose belongs to the fold in which its middle lies.
        let middle = 2 * dealt + pose.len();
        let fold = (middle * count / (2 * rows.max(1))).min(count - 1);
        folds[fold].extend_from_slice(pose);
        dealt += pose.len();
    }
    for fold in &mut folds {
        fold.sort_unstable();
    }
    folds
}

/// Errors of the rows `part` under a fit to the others.
fn without(model: &Model, data: &Measurements, rows: &[usize], candidates: &[usize], part: &[usize]) -> Vec<f64> {
    let kept: Vec<usize> = rows.iter().copied().filter(|row| part.binary_search(row).is_err()).collect();
    let mut other = model.clone();
    fit(&mut other, data, &FitOptions { rows: &kept, candidates });
    let mut scratch = other.stack.scratch(&other.robot);
    part.iter().map(|row| miss(&other, data, *row, &mut scratch).length).collect()
}

fn gather(data: &Measurements, rows: &[usize], parts: &[Vec<usize>], errors: &[Vec<f64>]) -> Vec<f64> {
    let mut all = vec![f64::NAN; data.rows()];
    for (row, error) in parts.iter().flatten().zip(errors.iter().flatten()) {
        all[*row] = *error;
    }
    rows.iter().map(|row| all[*row]).collect()
}
