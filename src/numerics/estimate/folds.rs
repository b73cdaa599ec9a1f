//! Cross-validation: every fitted row predicted by a fit that has not seen its pose, in folds drawn at random and in contiguous
//! blocks. Rows of one pose stay together: a pose that was seen is no test; of a moving arm stretches of rows do. Where rows are
//! contacts, a block is a place: sockets of one plate, which names with one beginning (`front/0`, `front/1`) are.
//!
//! A fold's fit is the whole one less the fold's rows, one step away ([`NearbyFits`]). Where that step is not small, the fit is repeated
//! instead.

use super::contacts::without_places;
use super::error_scale::ErrorScale;
use super::fit::{FitOptions, ParameterStatus, Session, fit};
use super::fold_factors::NearbyFits;
use super::repeats::Poses;
use crate::observation::contacts;
use crate::robot::Measurements;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Stretches into which the recording of a moving arm is cut.
const STRETCHES: usize = 40;

/// Errors (m) of rows under fits without them, in the order of the fitted rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Folds {
    /// Folds of either kind.
    pub count: usize,
    /// Folds drawn at random: new poses among those that were measured.
    pub random: Vec<f64>,
    /// Contiguous stretches of the recording: poses of another time and, often, another region. Of contacts each
    /// place in turn.
    pub blocks: Vec<f64>,
}

/// Takes `2 * count` parts of its rows off a fit, each in turn. `None` where the poses are too few for it.
///
/// What the whole fit saw is estimated; which rows were set aside is taken over.
pub fn cross_validate(whole: &Session, count: usize, seed: u64) -> Option<Folds> {
    let Session { data, rows, .. } = *whole;
    let parts = parts(data, rows);
    let order = whole.divisible(&parts, count)?;
    let blocks = blocks(data, rows, &order, count);
    let random = at_random(order, rows.len(), count, seed);
    let [one, other] =
        [&random, &blocks].map(|folds| whole.without_each(folds, ErrorScale::Lengths));
    Some(Folds {
        count,
        random: gather(data, rows, &random, &one),
        blocks: gather(data, rows, &blocks, &other),
    })
}

/// Takes every pose off a fit in turn; both kinds of folds are the same then. `None` where one pose less leaves too few rows.
pub fn leave_one_out(whole: &Session) -> Option<Folds> {
    let Session { data, rows, .. } = *whole;
    let folds = parts(data, rows);
    let longest = folds.iter().map(Vec::len).max().unwrap_or_default();
    if folds.len() < 2 || 3 * (rows.len() - longest) <= whole.candidates().len() {
        return None;
    }
    let errors = gather(
        data,
        rows,
        &folds,
        &whole.without_each(&folds, ErrorScale::Lengths),
    );
    Some(Folds {
        count: folds.len(),
        random: errors.clone(),
        blocks: errors,
    })
}

/// Poses of the rows, of which folds are made; of a moving arm stretches of rows.
pub fn fold_poses(data: &Measurements, rows: &[usize]) -> usize {
    parts(data, rows).len()
}

/// How rows are dealt into folds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoldKind {
    /// As [`Folds::random`], drawn with a seed.
    Random(u64),
    /// As [`Folds::blocks`].
    Blocks,
}

/// Rows of one kind of [`Folds`], each sorted. `None` where the poses are too few.
pub fn dealt(kind: FoldKind, whole: &Session, count: usize) -> Option<Vec<Vec<usize>>> {
    let Session { data, rows, .. } = *whole;
    let parts = parts(data, rows);
    let order = whole.divisible(&parts, count)?;
    Some(match kind {
        FoldKind::Random(seed) => at_random(order, rows.len(), count, seed),
        FoldKind::Blocks => deal(&order, rows.len(), count),
    })
}

/// Poses dealt in an order that `seed` draws.
fn at_random(mut order: Vec<&Vec<usize>>, rows: usize, count: usize, seed: u64) -> Vec<Vec<usize>> {
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    deal(&order, rows, count)
}

impl Session<'_> {
    fn candidates(&self) -> Vec<usize> {
        let estimated = |k: &usize| {
            matches!(
                self.fitted.statuses[*k],
                ParameterStatus::Free(_) | ParameterStatus::Bound(_)
            )
        };
        (0..self.fitted.statuses.len()).filter(estimated).collect()
    }

    /// The parts in their order, where they are enough for so many folds.
    fn divisible<'p>(&self, parts: &'p [Vec<usize>], count: usize) -> Option<Vec<&'p Vec<usize>>> {
        let left = (self.rows.len() * (count.max(1) - 1)) / count.max(1);
        let enough = count >= 2 && parts.len() >= 2 * count && 3 * left > self.candidates().len();
        enough.then(|| parts.iter().collect())
    }

    /// Errors of the rows of each fold under a fit to the others.
    pub fn without_each(&self, folds: &[Vec<usize>], scale: ErrorScale) -> Vec<Vec<f64>> {
        let fitted = self.fitted;
        let candidates = self.candidates();
        let nearby = NearbyFits::of(self, folds, &fitted.free(), scale);
        let close = nearby
            .as_ref()
            .and_then(NearbyFits::alone)
            .unwrap_or_else(|| vec![None; folds.len()]);
        let repeated = |(fold, close): (&Vec<usize>, Option<Vec<f64>>)| {
            close.unwrap_or_else(|| without(self, &candidates, fold, scale))
        };
        folds.par_iter().zip(close).map(repeated).collect()
    }
}

/// Rows that belong together, in the order of recording: those of one pose; of a moving arm, whose neighbouring rows know each other,
/// stretches of rows.
fn parts(data: &Measurements, rows: &[usize]) -> Vec<Vec<usize>> {
    if !data.in_motion(rows) {
        return Poses::of(data, rows).all().to_vec();
    }
    rows.chunks(rows.len().div_ceil(STRETCHES).max(1))
        .map(<[usize]>::to_vec)
        .collect()
}

/// Every place with contacts with its rows and, of the other poses, contiguous stretches; where there is but one place,
/// stretches of all.
fn blocks(
    data: &Measurements,
    rows: &[usize],
    order: &[&Vec<usize>],
    count: usize,
) -> Vec<Vec<usize>> {
    let place = |row: usize| {
        let name = contacts(data, row).next()?.1.anchor;
        Some(name.rsplit_once('/').map_or(name, |(place, _)| place))
    };
    let mut places: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    let mut others: Vec<&Vec<usize>> = Vec::new();
    for pose in order {
        match pose.first().and_then(|row| place(*row)) {
            Some(name) => places.entry(name).or_default().extend_from_slice(pose),
            None => others.push(*pose),
        }
    }
    if places.len() + usize::from(!others.is_empty()) < 2 {
        return deal(order, rows.len(), count);
    }
    let left = others.iter().map(|pose| pose.len()).sum();
    let stretches = deal(&others, left, count)
        .into_iter()
        .filter(|stretch| !stretch.is_empty());
    let mut blocks: Vec<Vec<usize>> = places.into_values().chain(stretches).collect();
    blocks.iter_mut().for_each(|block| block.sort_unstable());
    blocks
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
fn without(whole: &Session, candidates: &[usize], part: &[usize], scale: ErrorScale) -> Vec<f64> {
    if let Some(errors) = without_places(whole, candidates, part, scale) {
        return errors;
    }
    let Session {
        model, data, rows, ..
    } = *whole;
    let kept: Vec<usize> = rows
        .iter()
        .copied()
        .filter(|row| part.binary_search(row).is_err())
        .collect();
    let (other, _) = fit(
        model,
        data,
        &FitOptions {
            rows: &kept,
            candidates,
        },
    );
    let mut scratch = other.stack.scratch(&other.robot);
    part.iter()
        .map(|row| scale.error(&other, data, *row, &mut scratch))
        .collect()
}

/// Errors of `rows`, in their order, by the errors of the `parts` they were dealt into.
pub fn gather(
    data: &Measurements,
    rows: &[usize],
    parts: &[Vec<usize>],
    errors: &[Vec<f64>],
) -> Vec<f64> {
    let mut all = vec![f64::NAN; data.rows()];
    for (row, error) in parts.iter().flatten().zip(errors.iter().flatten()) {
        all[*row] = *error;
    }
    rows.iter().map(|row| all[*row]).collect()
}
