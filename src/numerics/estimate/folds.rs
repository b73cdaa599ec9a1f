//! Cross-validation: every fitted row predicted by a fit that has not seen its pose, in folds drawn at random and in contiguous
//! blocks. Rows of one pose stay together: a pose that was seen is no test; of a moving arm and on a path stretches of rows do. Where rows are
//! contacts, a block is a place: sockets of one plate, which names with one beginning (`front/0`, `front/1`) are.
//!
//! A fold's fit is the whole one less the fold's rows, one step away ([`NearbyFits`]). Where that step is not small, the fit is repeated
//! instead.
//!
//! Without the rows of a part it is, of G = J R^-1 of these rows (R'R = J'J of all) and their errors e, the step R^-1 (1 - G'G)^-1
//! (Q'r - G'e). Of a part only its own triangular factor is kept, which has the same G'G and G'e.

use crate::estimate::contacts::{less, without_places};
use crate::estimate::factor::{TriangularFactor, axpy, dot, norm};
use crate::estimate::fit::{Session, fit};
use crate::estimate::model::Model;
use crate::estimate::problem::{ObservationTerm, Problem, share};
use crate::estimate::scale::ErrorScale;
use crate::estimate::units::Units;
use crate::observation::{ExcessSigma, KINDS, contacts};
use crate::robot::Measurements;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, Par, Side};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Stretches into which the recording of a moving arm is cut.
const STRETCHES: usize = 40;
/// Stretches of a path for each fold: few, so that what lasts along it lies within one.
const ALONG: usize = 3;

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
    let parts = parts(data, rows, ALONG * count);
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
    let folds = parts(data, rows, STRETCHES);
    let longest = folds.iter().map(Vec::len).max().unwrap_or_default();
    if folds.len() < 2 || 3 * (rows.len() - longest) <= whole.fitted.estimated().len() {
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
    parts(data, rows, STRETCHES).len()
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
    let parts = parts(data, rows, ALONG * count);
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
    /// The parts in their order, where they are enough for so many folds.
    fn divisible<'p>(&self, parts: &'p [Vec<usize>], count: usize) -> Option<Vec<&'p Vec<usize>>> {
        let left = (self.rows.len() * (count.max(1) - 1)) / count.max(1);
        let estimated = self.fitted.estimated().len();
        let enough = count >= 2 && parts.len() >= 2 * count && 3 * left > estimated;
        enough.then(|| parts.iter().collect())
    }

    /// Errors of the rows of each fold under a fit to the others.
    pub fn without_each(&self, folds: &[Vec<usize>], scale: ErrorScale) -> Vec<Vec<f64>> {
        let candidates = self.fitted.estimated();
        let nearby = NearbyFits::of(self, folds, &self.fitted.free(), scale);
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

/// Rows that belong together, in the order of recording: those of one pose; of a moving arm and on a path, where neighbouring rows know each
/// other, stretches of rows.
fn parts(data: &Measurements, rows: &[usize], stretches: usize) -> Vec<Vec<usize>> {
    if !data.in_motion(rows) {
        let loaded_alike = |a: usize, b: usize| data.payload[a] == data.payload[b];
        return Units::of(data, rows, stretches, loaded_alike).all;
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
    let kept = less(rows, part);
    let (other, _) = fit(model, data, &kept, candidates);
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

/// Least share of the information in any direction that remains without a fold: with less, other parameters may be seen.
const LEFT: f64 = 0.02;
/// Departure from a straight line (of the part's errors) up to which a step is small.
const STRAIGHT: f64 = 0.01;

/// A model around which others are fitted, and its rows in parts that are left out in turn.
pub struct NearbyFits<'a> {
    data: &'a Measurements,
    model: &'a Model,
    excess: ExcessSigma,
    /// Scale of the errors.
    scale: ErrorScale,
    /// Parameters that are estimated or moved.
    columns: Vec<usize>,
    /// The factor of all parts and the priors.
    whole: TriangularFactor,
    parts: Vec<LeftOutRows<'a>>,
}

struct LeftOutRows<'a> {
    rows: &'a [usize],
    factor: TriangularFactor,
    pull: Vec<f64>,
    /// Root of the Huber weight of each term.
    shares: Vec<f64>,
}

impl<'a> NearbyFits<'a> {
    /// Around the model of a session. `None` where bounds are in the way.
    pub fn of(
        session: &Session<'a>,
        parts: &'a [Vec<usize>],
        columns: &[usize],
        scale: ErrorScale,
    ) -> Option<Self> {
        let Session {
            data,
            model,
            fitted,
            ..
        } = *session;
        if model.known.values().any(|known| known.bounds.is_some()) {
            return None;
        }
        let excess = fitted.excess();
        let part = |rows: &'a Vec<usize>| {
            let problem = Problem::new(data, rows, excess);
            let seen = problem.observe(model, columns);
            let shares = problem
                .errors(&seen.residuals)
                .into_iter()
                .map(|(error, axes)| share(error, axes))
                .collect();
            LeftOutRows {
                rows,
                factor: seen.factor,
                pull: seen.pull,
                shares,
            }
        };
        let parts: Vec<LeftOutRows> = parts.par_iter().map(part).collect();
        let all = parts
            .iter()
            .map(|part| part.factor.clone())
            .reduce(|sum, part| sum.stack(&part))?;
        let pull: Vec<f64> = (0..columns.len())
            .map(|j| parts.iter().map(|part| part.pull[j]).sum())
            .collect();
        let whole = model.with_priors(columns, all).pulled(&pull);
        Some(Self {
            data,
            model,
            excess,
            scale,
            columns: columns.to_vec(),
            whole,
            parts,
        })
    }

    /// Errors of the rows of each part under a fit to the others; none where that is farther than a small step.
    pub(crate) fn alone(&self) -> Option<Vec<Option<Vec<f64>>>> {
        self.with(&vec![None; self.columns.len()])
    }

    /// The same with the columns that have a step moved by it and kept. `None` where the others are not separable.
    pub fn with(&self, steps: &[Option<f64>]) -> Option<Vec<Option<Vec<f64>>>> {
        let whole = self.whole.given(steps);
        let inverse = whole.inverse()?;
        let inverse = inverse.matrix(1.0);
        let mut model = self.model.clone();
        for (parameter, step) in self.columns.iter().zip(steps) {
            model.x[*parameter] += step.unwrap_or_default();
        }
        let open = self.open(steps);
        let whole_fit = FitOfAll {
            whole,
            inverse,
            model,
            open,
        };
        Some(
            self.parts
                .par_iter()
                .map(|part| self.without(part, &whole_fit, &part.factor.given(steps)))
                .collect(),
        )
    }

    /// Parameters of the columns without a step.
    fn open(&self, steps: &[Option<f64>]) -> Vec<usize> {
        let columns = self.columns.iter().zip(steps);
        let open = columns.filter(|(_, step)| step.is_none());
        open.map(|(parameter, _)| *parameter).collect()
    }

    /// Values of some of the columns under a fit to all rows, the columns that have a step moved by it and kept, with their standard
    /// deviations by the stated noise. `None` where the others are not separable.
    pub fn estimated(&self, steps: &[Option<f64>], groups: &[usize]) -> Option<Vec<(f64, f64)>> {
        let whole = self.whole.given(steps);
        let (inverse, found) = (whole.inverse()?, whole.solve(0.0)?);
        let open = self.open(steps);
        let one = |parameter: &usize| {
            let i = open.iter().position(|other| other == parameter)?;
            Some((self.model.x[*parameter] + found[i], inverse.row_norm(i)))
        };
        groups.iter().map(one).collect()
    }

    fn without(
        &self,
        part: &LeftOutRows,
        whole_fit: &FitOfAll,
        factor: &TriangularFactor,
    ) -> Option<Vec<f64>> {
        let FitOfAll {
            whole,
            inverse,
            model,
            open,
        } = whole_fit;
        let p = open.len();
        let mut upper_factor = Mat::zeros(p, p);
        for j in 0..p {
            upper_factor.col_as_slice_mut(j)[..=j].copy_from_slice(factor.column(j));
        }
        let (mut seen, mut left) = (Mat::zeros(p, p), Mat::identity(p, p));
        let (upper, lower) = (
            BlockStructure::TriangularUpper,
            BlockStructure::TriangularLower,
        );
        matmul(
            seen.as_mut(),
            upper,
            Accum::Replace,
            upper_factor.as_ref(),
            upper,
            inverse.as_ref(),
            upper,
            1.0,
            Par::Seq,
        );
        matmul(
            left.as_mut(),
            lower,
            Accum::Add,
            seen.transpose(),
            lower,
            seen.as_ref(),
            upper,
            -1.0,
            Par::Seq,
        );
        let left = left.llt(Side::Lower).ok()?;
        let mut pivots = left.L().diagonal().column_vector().iter();
        if pivots.any(|pivot| pivot * pivot < LEFT) {
            return None;
        }
        let errors = factor.column(p);
        let gradient = |j: usize| dot(&errors[..=j], &seen.col_as_slice(j)[..=j]);
        let along = left.solve(&Mat::from_fn(p, 1, |j, _| whole.entry(j, p) - gradient(j)));
        let along = along.col_as_slice(0);
        // Column by column, as they are stored.
        let (mut step, mut ahead) = (vec![0.0; p], errors.to_vec());
        for (j, by) in along.iter().enumerate() {
            axpy(*by, &inverse.col_as_slice(j)[..=j], &mut step[..=j]);
            axpy(-by, &seen.col_as_slice(j)[..=j], &mut ahead[..=j]);
        }
        let mut other = model.clone();
        for (parameter, step) in open.iter().zip(&step) {
            other.x[*parameter] += step;
        }
        let straight = norm(&ahead);
        let (lengths, arrived) = self.arrive(part, &other);
        ((arrived - straight).abs() <= STRAIGHT * straight).then_some(lengths)
    }

    /// Errors of a part's rows under a model, and the root of their whitened square.
    fn arrive(&self, part: &LeftOutRows, model: &Model) -> (Vec<f64>, f64) {
        let mut scratch = model.stack.scratch(&model.robot);
        let (mut lengths, mut square) = (Vec::with_capacity(part.rows.len()), 0.0);
        let mut shares = part.shares.iter();
        for row in part.rows {
            let placed = model.place(self.data, *row, &mut scratch);
            let terms = KINDS.iter().filter_map(|kind| {
                ObservationTerm::of(*kind, self.data, *row, &placed, self.excess)
            });
            for ((term, _), share) in terms.zip(&mut shares) {
                square += (term.error * *share).norm_squared();
            }
            lengths.push(self.scale.of_placed(self.data, *row, &placed));
        }
        (lengths, square.sqrt())
    }
}

/// A fit to all parts.
struct FitOfAll {
    whole: TriangularFactor,
    inverse: Mat<f64>,
    model: Model,
    /// Parameters that are estimated.
    open: Vec<usize>,
}
