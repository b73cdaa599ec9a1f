//! Whether what changes slowly is a cause that follows time, or noise that lasts from point to point.
//!
//! Two explanations of the same points are compared: all causes with noise as it is believed, and the causes that do not follow time with noise
//! that lasts. Searched causes take a part of what wanders with them, so that what they leave alone would show too little of it; likelihoods
//! are restricted ones (Patterson and Thompson, 1971), as the base model takes its part, too.

use super::fit_state::{FitState, Fitter};
use super::stretches::thinned;
use crate::diagnose::pool::{orthonormal, project};
use crate::diagnose::whitened::{Memory, WhitenedProblem};
use crate::effect::{Form, Variable};
use faer::Mat;
use rayon::prelude::*;

/// The criterion must be better by this much for another belief: strong evidence (Kass and Raftery, 1995), doubled.
const PLAIN: f64 = 20.0;
/// Causes that follow time must be better than noise that lasts by strong evidence: such noise is everywhere.
const CLEARER: f64 = 8.0;
/// Of memories whose criterion is within this of the best the one that lasts longest is believed (95 % of chi-square with one degree of
/// freedom): too short a memory makes causes of noise.
const AS_GOOD: f64 = 3.84;

/// What noise does from row to row (nothing: `Some(None)`), if the settled model shows it to be otherwise than believed.
pub(crate) fn memory_left_by(settled: &FitState, fitter: &Fitter) -> Option<Option<Memory>> {
    if !fitter.may_recall(settled) {
        return None;
    }
    let rows = thinned(&fitter.data, &settled.screening.kept);
    let problem = WhitenedProblem::new(&settled.model, &fitter.data, rows);
    let slow: Vec<bool> = settled.causes.iter().map(|cause| follows_time(&cause.form)).collect();
    let numbers = |(cause, slow): (&_, &bool)| if *slow { numbers(cause) } else { 0 };
    let price = (problem.residual_rows() as f64).ln() * settled.causes.iter().zip(&slow).map(numbers).sum::<usize>() as f64;
    let with_all = Regression::of(&problem, settled, fitter, &vec![true; slow.len()]);
    let believed = with_all.cost(fitter.memory) + price;
    let (mut best, mut memory) = with_all.likeliest();
    best += price;
    if slow.contains(&true) {
        let kept: Vec<bool> = slow.iter().map(|slow| !slow).collect();
        let (cost, other) = Regression::of(&problem, settled, fitter, &kept).likeliest();
        if cost < best + CLEARER && other.is_some() {
            (best, memory) = (cost, other);
        }
    }
    (best < believed - PLAIN && memory != fitter.memory).then_some(memory)
}

fn follows_time(form: &Form) -> bool {
    form.variables().contains(&Variable::Time)
}

/// Coefficients, and one shape.
fn numbers(cause: &super::fit_state::EstimatedCause) -> usize {
    cause.coefficients.len() + 1
}

/// Points by the base model and some causes, in a linear picture.
struct Regression<'a> {
    rows: &'a [usize],
    /// Columns one after another, and how many.
    columns: Vec<f64>,
    count: usize,
    points: Vec<f64>,
    /// Sum of the logarithms of the design's pivots under white noise.
    white: f64,
}

impl<'a> Regression<'a> {
    /// On the base model and the `kept` causes.
    fn of(problem: &'a WhitenedProblem, settled: &FitState, fitter: &Fitter, kept: &[bool]) -> Self {
        let rows = problem.residual_rows();
        let mut points = problem.of_points().to_vec();
        let base = problem.jacobian(fitter.free());
        let mut columns: Vec<f64> = (0..base.ncols()).flat_map(|j| base.col_as_slice(j).to_vec()).collect();
        for (cause, kept) in settled.causes.iter().zip(kept) {
            let own = problem.columns(&cause.form);
            if *kept {
                columns.extend(own);
                continue;
            }
            for (column, coefficient) in own.chunks(rows).zip(&cause.coefficients) {
                points.iter_mut().zip(column).for_each(|(value, c)| *value += c * coefficient);
            }
        }
        let count = columns.len() / rows;
        let mut left = points.clone();
        project(orthonormal(&matrix(&columns, rows)).as_ref(), &mut left);
        let gross = left.clone();
        Memory::without_gross(&mut left);
        points.iter_mut().zip(gross.iter().zip(&left)).for_each(|(value, (gross, left))| *value += left - gross);
        let mut own = Self { rows: &problem.rows, columns, count, points, white: 0.0 };
        own.white = pivots(&matrix(&own.columns, rows));
        own
    }

    /// -2 ln of the restricted likelihood, its scale estimated, up to a constant of the points.
    fn cost(&self, memory: Option<Memory>) -> f64 {
        let believed = memory.unwrap_or(Memory::NONE);
        let rows = self.points.len();
        let innovations = believed.filter(self.rows);
        let (mut columns, mut left) = (self.columns.clone(), self.points.clone());
        columns.chunks_mut(rows).for_each(|column| innovations.apply(column));
        innovations.apply(&mut left);
        let design = matrix(&columns, rows);
        project(orthonormal(&design).as_ref(), &mut left);
        let freedom = (rows.saturating_sub(self.count)).max(1) as f64;
        let square: f64 = left.iter().map(|value| value * value).sum();
        let shapes = if memory.is_some() { 2.0 * freedom.ln() } else { 0.0 };
        freedom * (square / freedom).ln() + innovations.determinant() + 2.0 * (pivots(&design) - self.white) + shapes
    }

    /// The least cost, and of the memories that are as good the one that lasts longest.
    fn likeliest(&self) -> (f64, Option<Memory>) {
        let all: Vec<Option<Memory>> = Memory::all().collect();
        let costs: Vec<f64> = all.par_iter().map(|memory| self.cost(*memory)).collect();
        let best = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let as_good = all.into_iter().zip(costs).filter(|(_, cost)| *cost < best + AS_GOOD).map(|(memory, _)| memory);
        let wander = |memory: &Option<Memory>| memory.map_or(0.0, Memory::wander);
        (best, as_good.max_by(|a, b| wander(a).total_cmp(&wander(b))).flatten())
    }
}

fn matrix(columns: &[f64], rows: usize) -> Mat<f64> {
    Mat::from_fn(rows, columns.len() / rows, |i, j| columns[j * rows + i])
}

/// Sum of the logarithms of the pivots of a design's QR decomposition.
fn pivots(design: &Mat<f64>) -> f64 {
    let factor = design.qr();
    let triangle = factor.thin_R();
    (0..triangle.ncols()).map(|k| triangle[(k, k)].abs().max(f64::MIN_POSITIVE).ln()).sum()
}
