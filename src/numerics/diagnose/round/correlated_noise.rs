//! Whether what changes slowly is a cause that follows time, or noise that is correlated from point to point.
//!
//! Two explanations of the same points are compared: all causes with noise as it is believed, and the causes that do not follow time with noise
//! that is correlated. Searched causes take a part of such noise with them, so that what they leave alone would show too little of it; likelihoods
//! are restricted ones (Patterson and Thompson, 1971), as the base model takes its part, too.

use super::along_path::CorrelationChange;
use super::fit_state::{FitState, Fitter};
use super::stretches::thinned;
use crate::criteria::cells::SETTLED;
use crate::criteria::noise::{AS_GOOD, CLEARER, PLAIN};
use crate::diagnose::linear::{orthonormal, project};
use crate::diagnose::table::{Answer, FoundCell};
use crate::diagnose::whitened::{AutocorrelatedNoise, WhitenedProblem};
use crate::effect::{Form, Variable};
use crate::robot::Measurements;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par, Side};
use rayon::prelude::*;

/// What noise does from row to row, if the settled model shows it to be otherwise than believed.
pub(crate) fn correlation_left_by(
    settled: &FitState,
    answer: &Answer,
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
    let slow: Vec<bool> = settled
        .causes
        .iter()
        .map(|cause| follows_time(&cause.form))
        .collect();
    let price = price_of(&answer.found, &|i| slow[i]);
    let with_all = Regression::of((&problem, width), settled, fitter, &vec![true; slow.len()]);
    let believed = with_all.cost(fitter.correlated) + price;
    let (best, noise) = with_all.likeliest();
    if fitter.causes_of_the_arm_first() {
        // What noise alone explains as well has no other name.
        let price = price_of(&answer.found, &|_| true);
        let (alone, of_noise) =
            Regression::of((&problem, width), settled, fitter, &vec![false; slow.len()])
                .likeliest();
        let keeps_causes = best + price < alone - *PLAIN;
        return Some(CorrelationChange {
            noise: if keeps_causes { noise } else { of_noise },
            keeps_causes,
        });
    }
    let best = best + price;
    if slow.contains(&true) {
        let kept: Vec<bool> = slow.iter().map(|slow| !slow).collect();
        let (cost, other) = Regression::of((&problem, width), settled, fitter, &kept).likeliest();
        // Causes that were not found yet look like such noise, too.
        let clearer = if answer.nothing_last > *SETTLED {
            *CLEARER
        } else {
            10.0 * *CLEARER
        };
        if cost + clearer < best.min(believed) && other.is_some() {
            return (other != fitter.correlated).then(|| change(other));
        }
    }
    (best < believed - *PLAIN && noise != fitter.correlated).then(|| change(noise))
}

/// Rows without those that measured a target again before the arm left the pose: what the model leaves there they share, whatever the noise does.
fn first_of_pose(data: &Measurements, rows: &[usize]) -> Vec<usize> {
    let again = |row: usize| {
        let before = (0..data.rank_in_time(row))
            .rev()
            .map(|place| data.at_place(place));
        before
            .take_while(|other| data.near_pose(*other, row))
            .any(|other| data.target(other) == data.target(row))
    };
    rows.iter().copied().filter(|row| !again(*row)).collect()
}

fn follows_time(form: &Form) -> bool {
    form.variables().contains(&Variable::Time)
}

/// What the freedom of some findings costs them, -2 ln of evidence.
fn price_of(found: &[FoundCell], of: &dyn Fn(usize) -> bool) -> f64 {
    let of = found
        .iter()
        .filter(|found| found.members.iter().any(|i| of(*i)));
    of.map(|found| found.price).sum()
}

/// Points by the base model and some causes, in a linear picture.
struct Regression<'a> {
    rows: &'a [usize],
    /// Numbers of a row.
    width: usize,
    /// An orthonormal basis of what they can do, columns one after another, and then what they leave of the points. Of any other basis the
    /// determinants would differ by the same factor under all noises.
    columns: Vec<f64>,
    /// Columns of the basis.
    count: usize,
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
        let mut left = problem.of_readings().to_vec();
        let base = problem.jacobian(fitter.free());
        let mut columns: Vec<f64> = (0..base.ncols())
            .flat_map(|j| base.col_as_slice(j).to_vec())
            .collect();
        for (cause, kept) in settled.causes.iter().zip(kept) {
            let own = problem.columns(&cause.form);
            if *kept {
                columns.extend(own);
                continue;
            }
            for (column, coefficient) in own.chunks(rows).zip(&cause.coefficients) {
                left.iter_mut()
                    .zip(column)
                    .for_each(|(value, c)| *value += c * coefficient);
            }
        }
        let design = orthonormal(&Mat::from_fn(rows, columns.len() / rows, |i, j| {
            columns[j * rows + i]
        }));
        project(design.as_ref(), &mut left);
        AutocorrelatedNoise::without_gross(&mut left);
        let mut columns: Vec<f64> = (0..design.ncols())
            .flat_map(|j| design.col_as_slice(j).to_vec())
            .collect();
        columns.extend(left);
        Self {
            rows: &problem.rows,
            width,
            columns,
            count: design.ncols(),
        }
    }

    /// -2 ln of the restricted likelihood, its scale estimated, up to a constant of the points; infinite where they leave nothing.
    fn cost(&self, noise: Option<AutocorrelatedNoise>) -> f64 {
        let believed = noise.unwrap_or(AutocorrelatedNoise::NONE);
        let rows = self.columns.len() / (self.count + 1);
        let innovations = believed.filter(self.rows, self.width);
        let mut columns = self.columns.clone();
        columns
            .chunks_mut(rows)
            .for_each(|column| innovations.apply(column));
        let columns = MatRef::from_column_major_slice(&columns, rows, self.count + 1);
        let mut gram = Mat::zeros(self.count + 1, self.count + 1);
        let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
        matmul(
            gram.as_mut(),
            lower,
            Accum::Replace,
            columns.transpose(),
            whole,
            columns,
            whole,
            1.0,
            Par::Seq,
        );
        let Ok(factor) = gram.llt(Side::Lower) else {
            return f64::INFINITY;
        };
        let pivot = |k: usize| factor.L()[(k, k)];
        let freedom = (rows.saturating_sub(self.count)).max(1) as f64;
        // The last pivot is the length of what the design leaves of the points.
        let square = pivot(self.count).powi(2);
        let shapes = if noise.is_some() {
            2.0 * freedom.ln()
        } else {
            0.0
        };
        let design: f64 = (0..self.count).map(|k| pivot(k).ln()).sum();
        freedom * (square / freedom).ln() + innovations.determinant() + 2.0 * design + shapes
    }

    /// The least cost, and of the autocorrelations that are as good the longest.
    fn likeliest(&self) -> (f64, Option<AutocorrelatedNoise>) {
        let all: Vec<Option<AutocorrelatedNoise>> = AutocorrelatedNoise::all().collect();
        let costs: Vec<f64> = all.par_iter().map(|noise| self.cost(*noise)).collect();
        let best = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let as_good = all
            .into_iter()
            .zip(costs)
            .filter(|(_, cost)| *cost < best + *AS_GOOD)
            .map(|(noise, _)| noise);
        let length =
            |noise: &Option<AutocorrelatedNoise>| noise.map_or(0.0, AutocorrelatedNoise::length);
        (
            best,
            as_good
                .max_by(|a, b| length(a).total_cmp(&length(b)))
                .flatten(),
        )
    }
}
