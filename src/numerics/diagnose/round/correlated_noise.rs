//! Whether what changes slowly is a cause that follows time, or noise that is correlated from point to point.
//!
//! Two explanations of the same points are compared: all causes with noise as it is believed, and the causes that do not follow time with noise
//! that is correlated. Searched causes take a part of such noise with them, so that what they leave alone would show too little of it: in both
//! the coefficients of causes are random with the variances at which they were found, and the likelihood is the marginal one of the rows,
//! restricted to what the base model cannot do (Patterson and Thompson, 1971).

use super::fit_state::{FitState, Fitter};
use super::stretches::{CorrelationChange, first_of_pose, thinned};
use crate::criteria::cells::COMMON;
use crate::criteria::noise::{AS_GOOD, PLAIN};
use crate::diagnose::judge::unconfirmed;
use crate::diagnose::table::{Answer, FoundCell};
use crate::diagnose::whitened::{AutocorrelatedNoise, WhitenedProblem};
use crate::linear::project;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par, Side};
use rayon::prelude::*;

/// What noise does from row to row, if the settled model shows it to be otherwise than believed. Findings that follow time are as probable as
/// such noise leaves them.
pub(crate) fn correlation_left_by(
    settled: &FitState,
    answer: &mut Answer,
    fitter: &Fitter,
) -> Option<CorrelationChange> {
    let change = |noise| CorrelationChange {
        noise,
        keeps_causes: false,
    };
    if !fitter.may_estimate_correlation(settled) {
        return None;
    }
    let rows = thinned(
        &fitter.data,
        &first_of_pose(&fitter.data, &settled.screening.kept),
    );
    let problem = WhitenedProblem::new(&settled.model, &fitter.data, rows);
    // Rows that measured different numbers have no one correlation from each to the next.
    let width = problem.width()?;
    let slow = settled.causes.iter().map(|cause| cause.form.follows_time());
    let slow: Vec<bool> = slow.collect();
    let regression = |kept: &[bool]| Regression::of((&problem, width), settled, fitter, kept);
    let with_all = regression(&vec![true; slow.len()]);
    let price = price_of(&answer.found, &|i| slow[i]);
    let believed = with_all.cost(fitter.correlated) + price;
    let (best, noise) = with_all.likeliest();
    if fitter.causes_of_the_arm_first() {
        // What noise alone explains as well has no other name.
        let best = best + price_of(&answer.found, &|_| true);
        let (alone, of_noise) = regression(&vec![false; slow.len()]).likeliest();
        let found: Vec<Vec<usize>> = answer.found.iter().map(|one| one.members.clone()).collect();
        let keeps_causes = best < alone - *PLAIN && unconfirmed(settled, &found, fitter).is_empty();
        return Some(CorrelationChange {
            noise: if keeps_causes { noise } else { of_noise },
            keeps_causes,
        });
    }
    let best = best + price;
    if slow.contains(&true) {
        let kept: Vec<bool> = slow.iter().map(|slow| !slow).collect();
        let (cost, other) = regression(&kept).likeliest();
        // What such noise explains as well is noise. Causes that were not found yet look like it, too: it has to be as much likelier as it is
        // likely that there are some.
        let some_left = -2.0 * answer.nothing_last.max(f64::MIN_POSITIVE).ln();
        let unlikelier = cost - best.min(believed) + some_left;
        if unlikelier < *AS_GOOD && other.is_some() {
            return (other != fitter.correlated).then(|| change(other));
        }
        let noise_instead = 1.0 / (1.0 + (unlikelier / 2.0).exp());
        let follows_time = |found: &&mut FoundCell| found.members.iter().any(|i| slow[*i]);
        for found in answer.found.iter_mut().filter(follows_time) {
            found.or_nothing(noise_instead);
        }
    }
    (best < believed - *PLAIN && noise != fitter.correlated).then(|| change(noise))
}

/// -2 ln of the prior odds of some findings.
fn price_of(found: &[FoundCell], has: &dyn Fn(usize) -> bool) -> f64 {
    let is_priced = |found: &&FoundCell| found.members.iter().any(|i| has(*i));
    let priced = found.iter().filter(is_priced);
    -2.0 * priced.map(|found| found.log_prior).sum::<f64>()
}

/// Points by the base model and some causes, in a linear picture.
struct Regression<'a> {
    rows: &'a [usize],
    /// Numbers of a row.
    width: usize,
    /// An orthonormal basis of what the base model can do, columns one after another (of any other basis the determinants would differ by the
    /// same factor under all noises); columns of causes, of unit prior variance; and the points.
    columns: Vec<f64>,
    /// Columns of the base model, and of causes.
    counts: [usize; 2],
    /// Causes that are in the model.
    causes: usize,
}

impl<'a> Regression<'a> {
    /// On the base model and the `kept` causes.
    fn of(
        (problem, width): (&'a WhitenedProblem, usize),
        settled: &FitState,
        fitter: &Fitter,
        kept: &[bool],
    ) -> Self {
        let rows = problem.residual_rows();
        let mut points = problem.measured_residual().to_vec();
        let mut random = Vec::new();
        for (cause, kept) in settled.causes.iter().zip(kept) {
            let columns = problem.columns(&cause.form);
            let numbers = cause.coefficients.iter().zip(&cause.priors);
            for (column, (coefficient, prior)) in columns.chunks(rows).zip(numbers) {
                let known = if *kept { prior.mean } else { 0.0 };
                let each = points.iter_mut().zip(column);
                each.for_each(|(value, c)| *value += c * (coefficient - known));
                if *kept {
                    random.extend(column.iter().map(|c| c * prior.sigma));
                }
            }
        }
        let base = problem.basis(&fitter.base());
        project(base.as_ref(), &mut points);
        AutocorrelatedNoise::without_gross(&mut points);
        let mut columns: Vec<f64> = (0..base.ncols())
            .flat_map(|j| base.col_as_slice(j).to_vec())
            .collect();
        let counts = [base.ncols(), random.len() / rows];
        columns.extend(random);
        columns.extend(points);
        Self {
            rows: &problem.rows,
            width,
            columns,
            counts,
            causes: kept.iter().filter(|kept| **kept).count(),
        }
    }

    /// -2 ln of the restricted marginal likelihood, its scale estimated, up to a constant of the points; infinite where nothing is left.
    fn cost(&self, noise: Option<AutocorrelatedNoise>) -> f64 {
        let believed = noise.unwrap_or(AutocorrelatedNoise::NONE);
        let [base, random] = self.counts;
        let count = base + random + 1;
        let rows = self.columns.len() / count;
        let innovations = believed.filter(self.rows, self.width);
        let mut columns = self.columns.clone();
        columns
            .chunks_mut(rows)
            .for_each(|column| innovations.apply(column));
        let columns = MatRef::from_column_major_slice(&columns, rows, count);
        let mut gram = Mat::zeros(count, count);
        let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
        let (out, transposed) = (gram.as_mut(), columns.transpose());
        let by = Accum::Replace;
        matmul(
            out,
            lower,
            by,
            transposed,
            whole,
            columns,
            whole,
            1.0,
            Par::Seq,
        );
        (base..base + random).for_each(|k| gram[(k, k)] += 1.0);
        let Ok(factor) = gram.llt(Side::Lower) else {
            return f64::INFINITY;
        };
        let pivot = |k: usize| factor.L()[(k, k)];
        let freedom = rows.saturating_sub(base).max(1) as f64;
        // The last pivot is the length of the points in standard deviations of all that is random.
        let square = pivot(count - 1).powi(2);
        // Share and length of the noise, size and shape of each cause; such noise is as usual as a common cause.
        let lasts = usize::from(noise.is_some());
        let shapes =
            2.0 * (lasts + self.causes) as f64 * freedom.ln() - 2.0 * lasts as f64 * COMMON.ln();
        let design: f64 = (0..count - 1).map(|k| pivot(k).ln()).sum();
        freedom * (square / freedom).ln() + innovations.determinant() + 2.0 * design + shapes
    }

    /// The least cost, and of the autocorrelations that are as good the longest.
    fn likeliest(&self) -> (f64, Option<AutocorrelatedNoise>) {
        let all: Vec<Option<AutocorrelatedNoise>> = AutocorrelatedNoise::all().collect();
        let costs: Vec<f64> = all.par_iter().map(|noise| self.cost(*noise)).collect();
        let best = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let as_good = all.into_iter().zip(costs);
        let length =
            |noise: &Option<AutocorrelatedNoise>| noise.map_or(0.0, AutocorrelatedNoise::length);
        let as_good = as_good.filter(|(_, cost)| *cost < best + *AS_GOOD);
        let longest = as_good
            .map(|(noise, _)| noise)
            .max_by(|a, b| length(a).total_cmp(&length(b)));
        (best, longest.flatten())
    }
}
