//! Fits next to a fit, one Gauss-Newton step away: without some rows, and with parameters put to other values or left out.
//!
//! Without the rows of a part it is, of G = J R^-1 of these rows (R'R = J'J of all) and their errors e, the step R^-1 (1 - G'G)^-1
//! (Q'r - G'e). Of a part only its own triangular factor is kept, which has the same G'G and G'e.

use super::error_scale::ErrorScale;
use super::factor::TriangularFactor;
use super::fit::Session;
use super::model::Model;
use super::problem::{ObservationTerm, Problem, share};
use crate::observation::{ExcessSigma, KINDS};
use crate::robot::Measurements;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, Par, Side};
use rayon::prelude::*;

/// Least share of what is known in any direction that must be left without a part: with less, other parameters may be seen.
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
            let problem = Problem { data, rows, excess };
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
        let whole = model.with_priors(columns, all).0.pulled(&pull);
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
        let p = whole.parameters();
        let inverse = Mat::from_fn(p, p, |i, j| inverse.at(i, j));
        let mut model = self.model.clone();
        for (parameter, step) in self.columns.iter().zip(steps) {
            model.x[*parameter] += step.unwrap_or_default();
        }
        let open: Vec<usize> = self
            .columns
            .iter()
            .zip(steps)
            .filter(|(_, step)| step.is_none())
            .map(|(parameter, _)| *parameter)
            .collect();
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

    /// Values of some of the columns under a fit to all rows, the columns that have a step moved by it and kept, with their standard
    /// deviations by the stated noise. `None` where the others are not separable.
    pub fn estimated(&self, steps: &[Option<f64>], of: &[usize]) -> Option<Vec<(f64, f64)>> {
        let whole = self.whole.given(steps);
        let (inverse, found) = (whole.inverse()?, whole.solve(0.0)?);
        let open: Vec<usize> = (0..steps.len())
            .filter(|j| steps[*j].is_none())
            .map(|j| self.columns[j])
            .collect();
        let one = |parameter: &usize| {
            let i = open.iter().position(|other| other == parameter)?;
            let square: f64 = (i..open.len()).map(|j| inverse.at(i, j).powi(2)).sum();
            Some((self.model.x[*parameter] + found[i], square.sqrt()))
        };
        of.iter().map(one).collect()
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
        let upper_factor = Mat::from_fn(p, p, |i, j| if i <= j { factor.entry(i, j) } else { 0.0 });
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
        if left
            .L()
            .diagonal()
            .column_vector()
            .iter()
            .any(|pivot| pivot * pivot < LEFT)
        {
            return None;
        }
        let errors: Vec<f64> = (0..=p).map(|i| factor.entry(i, p)).collect();
        let gradient = |j: usize| {
            errors
                .iter()
                .zip(seen.col_as_slice(j))
                .map(|(error, seen)| error * seen)
                .sum::<f64>()
        };
        let along = left.solve(&Mat::from_fn(p, 1, |j, _| whole.entry(j, p) - gradient(j)));
        let along = along.col_as_slice(0);
        let mut other = model.clone();
        for (i, parameter) in open.iter().enumerate() {
            other.x[*parameter] += (i..p).map(|j| inverse[(i, j)] * along[j]).sum::<f64>();
        }
        let ahead =
            (0..p).map(|i| errors[i] - (0..p).map(|j| seen[(i, j)] * along[j]).sum::<f64>());
        let straight =
            (ahead.map(|error| error * error).sum::<f64>() + errors[p] * errors[p]).sqrt();
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
