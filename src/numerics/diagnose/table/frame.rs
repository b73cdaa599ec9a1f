//! The rows as they stand around the present model: what is left without any cell, and the columns of whatever moves it; both weighed, with
//! geometry projected off.

use super::cell::alternates;
use super::evidence::EvidenceRows;
use crate::criteria::cells::{EVEN, FAR, UNEVEN};
use crate::diagnose::round::{FitState, Fitter, RoundView};
use crate::effect::{Form, Law, Motion, Variable};
use crate::regression::{dot, orthonormal, project};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

/// How the noise of the rows differs from what they state: weights of rows that are far off, and the shape of the others'.
#[derive(Clone, Default)]
pub(super) struct NoiseShape {
    /// Square root of the weight of each row of the recording; empty where all count fully.
    weights: Vec<f64>,
    /// What makes the three numbers of a point white, in the axes of the recording.
    whitening: Option<Matrix3<f64>>,
    /// By what motor currents are multiplied, so that they leave as much as points do.
    currents: Option<f64>,
}

/// Columns of unit rms motion at the tool.
pub(super) struct UnitColumns {
    /// Residual rows x columns.
    pub(crate) values: Arc<DMatrix<f64>>,
    /// Mean squared motion (m2 or rad2) by a unit of each coefficient.
    pub(crate) square: Vec<f64>,
}

/// A direction in which a motion moves the rows.
struct WeighedDirection {
    /// By a unit, weighed, residual rows of readings.
    weighed: Vec<f64>,
    /// Squared motion of each row by a unit, its share in the mean over the rows.
    square: Vec<f64>,
}

/// Columns one after another, of so many rows, weighed and of unit rms motion, with the mean squared motion by a unit of each.
struct Weighed {
    columns: Vec<f64>,
    rows: usize,
    square: Vec<f64>,
}

/// The rows of the recording around a model.
pub(super) struct SearchRows<'a> {
    pub(crate) view: &'a RoundView<'a>,
    base: Mat<f64>,
    residual: Vec<f64>,
    /// Variance of one number of a row, m2 or rad2, by which columns become sizes.
    variance: Vec<f64>,
    noise: NoiseShape,
    directions: Vec<(Motion, Vec<WeighedDirection>)>,
    values: Vec<(Variable, Option<Vec<f64>>)>,
}

impl<'a> SearchRows<'a> {
    /// Around a fitted model; the residual is that without its causes.
    pub(crate) fn of(
        view: &'a RoundView<'a>,
        now: &FitState,
        fitter: &Fitter,
        noise: NoiseShape,
    ) -> Self {
        let problem = &view.problem;
        let variance = |(i, row): (usize, &usize)| {
            fitter.scale.noise(problem.data, *row).powi(2)
                / problem.readings_of(i).len().max(1) as f64
        };
        let variance = problem.rows.iter().enumerate().map(variance).collect();
        let mut residual = problem.residual.clone();
        for (cause, range) in now.causes.iter().zip(&now.ranges) {
            let columns = problem.columns(&cause.form);
            for (column, k) in columns.chunks(problem.residual_rows()).zip(range.clone()) {
                residual
                    .iter_mut()
                    .zip(column)
                    .for_each(|(value, c)| *value += c * now.model.x[k]);
            }
        }
        let mut out = Self {
            view,
            base: Mat::new(),
            residual: Vec::new(),
            variance,
            noise,
            directions: Vec::new(),
            values: Vec::new(),
        };
        let mut jacobian = problem.jacobian(&fitter.seen());
        (0..jacobian.ncols()).for_each(|j| out.weigh(jacobian.col_as_slice_mut(j)));
        out.weigh(&mut residual);
        out.base = orthonormal(&jacobian);
        project(out.base.as_ref(), &mut residual);
        out.residual = residual;
        out
    }

    /// What is left, and how many rows say something of their own.
    pub(crate) fn rows(&self) -> EvidenceRows {
        let square = self.residual.iter().map(|value| value * value).sum();
        let counted = self.residual.len() as f64 / self.view.autocorrelation_time();
        EvidenceRows {
            freedom: (counted - self.base.ncols() as f64).max(1.0),
            square,
        }
    }

    /// The least variance of the noise over what is stated: what motor currents leave says nothing of the points'.
    pub(crate) fn least_noise(&self) -> f64 {
        if self.view.problem.of_readings().len() < self.residual.len() {
            1.0
        } else {
            0.09
        }
    }

    pub(crate) fn residual(&self) -> &[f64] {
        &self.residual
    }

    /// Products of some columns with the residual.
    pub(crate) fn along(&self, columns: &DMatrix<f64>) -> DVector<f64> {
        let residual = MatRef::from_column_major_slice(&self.residual, self.residual.len(), 1);
        product(view(columns), residual).column(0).into_owned()
    }

    /// A variable at every row; none where some row does not tell it.
    pub(crate) fn values(&self, of: Variable) -> Option<Vec<f64>> {
        match self.values.iter().find(|(other, _)| *other == of) {
            Some((_, values)) => values.clone(),
            None => self.view.problem.values(of),
        }
    }

    /// Computes once what the columns of many forms are made of.
    pub(crate) fn prepare(&mut self, motions: &[Motion], variables: &[Variable]) {
        let problem = &self.view.problem;
        let fresh: Vec<Motion> = motions
            .iter()
            .filter(|motion| !self.directions.iter().any(|(other, _)| other == *motion))
            .copied()
            .collect();
        let directions = |motion| {
            problem
                .directions(motion)
                .into_iter()
                .map(|raw| self.direction(raw))
                .collect()
        };
        let fresh: Vec<(Motion, Vec<WeighedDirection>)> = fresh
            .into_par_iter()
            .map(|motion| (motion, directions(motion)))
            .collect();
        self.directions.extend(fresh);
        let fresh: Vec<Variable> = variables
            .iter()
            .filter(|of| !self.values.iter().any(|(other, _)| other == *of))
            .copied()
            .collect();
        self.values
            .par_extend(fresh.into_par_iter().map(|of| (of, problem.values(of))));
    }

    /// Columns of some forms, one form after another, and how many each has. They end before the rows of motor currents where no form says
    /// anything of these.
    pub(crate) fn columns(&self, forms: &[Form]) -> (UnitColumns, Vec<usize>) {
        let each: Vec<Weighed> = forms
            .iter()
            .map(|form| self.of_term(form).unwrap_or_else(|| self.of_form(form)))
            .collect();
        let rows = each
            .iter()
            .map(|block| block.rows)
            .max()
            .unwrap_or(self.residual.len());
        let mut values =
            Vec::with_capacity(rows * each.iter().map(|block| block.square.len()).sum::<usize>());
        for block in &each {
            for column in block.columns.chunks(block.rows.max(1)) {
                values.extend_from_slice(column);
                values.resize(values.len() + rows - block.rows, 0.0);
            }
        }
        project(self.base.as_ref().subrows(0, rows), &mut values);
        let counts = each.iter().map(|block| block.square.len()).collect();
        let square: Vec<f64> = each.into_iter().flat_map(|block| block.square).collect();
        (
            UnitColumns {
                values: Arc::new(DMatrix::from_vec(rows, square.len(), values)),
                square,
            },
            counts,
        )
    }

    /// The columns of any form; without the rows of currents where it says nothing of these.
    fn of_form(&self, form: &Form) -> Weighed {
        let (all, points, problem) = (
            self.residual.len(),
            self.view.problem.of_readings().len(),
            &self.view.problem,
        );
        let mut columns = problem.motions_by(form);
        let silent = columns
            .chunks(all.max(1))
            .all(|column| column[points..].iter().all(|value| *value == 0.0));
        let rows = if silent { points } else { all };
        if silent && points < all {
            columns = columns
                .chunks(all)
                .flat_map(|column| column[..points].iter().copied())
                .collect();
        }
        let square: Vec<f64> = columns
            .chunks(rows.max(1))
            .map(|column| self.mean_square(column))
            .collect();
        for (column, square) in columns.chunks_mut(rows.max(1)).zip(&square) {
            problem.innovate(column);
            self.weigh(column);
            let scale = unit(*square);
            column.iter_mut().for_each(|value| *value *= scale);
        }
        Weighed {
            columns,
            rows,
            square,
        }
    }

    /// How much of the squared length of `left` the columns of a law at a place explain if they are orthogonal; nothing of what needs more.
    pub(crate) fn roughly(&self, form: &Form, left: &[f64]) -> Option<f64> {
        let term = form.term().filter(|_| !self.view.problem.is_correlated())?;
        let (_, directions) = self
            .directions
            .iter()
            .find(|(motion, _)| *motion == term.motion())?;
        let functions = self.functions(term.law())?;
        let mut fit = 0.0;
        for WeighedDirection { weighed, .. } in directions {
            let of_row = |i: usize| {
                let lines = self.view.problem.readings_of(i);
                let sums =
                    lines.map(|line| [weighed[line] * left[line], weighed[line] * weighed[line]]);
                sums.fold([0.0, 0.0], |sum, square| {
                    [sum[0] + square[0], sum[1] + square[1]]
                })
            };
            let rows: Vec<[f64; 2]> = (0..self.variance.len()).map(of_row).collect();
            for function in &functions {
                let sums = function
                    .iter()
                    .zip(&rows)
                    .map(|(value, [along, square])| [value * along, value * value * square]);
                let [along, square] = sums.fold([0.0, 0.0], |sum, square| {
                    [sum[0] + square[0], sum[1] + square[1]]
                });
                fit += along * along / square.max(f64::MIN_POSITIVE);
            }
        }
        Some(fit)
    }

    /// What is needed of a direction of a motion by a unit.
    fn direction(&self, mut raw: Vec<f64>) -> WeighedDirection {
        raw.truncate(self.view.problem.of_readings().len());
        let count = self.variance.len().max(1) as f64;
        let of_row = |(i, variance): (usize, &f64)| {
            raw[self.view.problem.readings_of(i)]
                .iter()
                .map(|value| value * value)
                .sum::<f64>()
                * variance
                / count
        };
        let square = self.variance.iter().enumerate().map(of_row).collect();
        if !self.view.problem.is_correlated() {
            self.weigh(&mut raw);
        }
        WeighedDirection {
            weighed: raw,
            square,
        }
    }

    /// The columns of a law at a place from the motion's directions and the law's functions.
    fn of_term(&self, form: &Form) -> Option<Weighed> {
        let term = form.term()?;
        let (_, directions) = self
            .directions
            .iter()
            .find(|(motion, _)| *motion == term.motion())?;
        let functions = self.functions(term.law())?;
        let (problem, rows) = (&self.view.problem, self.view.problem.of_readings().len());
        let squared: Vec<Vec<f64>> = functions
            .iter()
            .map(|function| function.iter().map(|value| value * value).collect())
            .collect();
        let count = directions.len() * functions.len();
        // In the order of the term's coefficients.
        let alternate = alternates(term.motion());
        let pair = |k: usize| {
            if alternate {
                (k % directions.len(), k / directions.len())
            } else {
                (k / functions.len(), k % functions.len())
            }
        };
        let (mut columns, mut square) = (vec![0.0; rows * count], Vec::with_capacity(count));
        for (k, column) in columns.chunks_mut(rows.max(1)).enumerate().take(count) {
            let (direction, function) = pair(k);
            let length = dot(&squared[function], &directions[direction].square);
            let scale = unit(length);
            square.push(length);
            for (i, value) in functions[function].iter().enumerate() {
                let by = value * scale;
                for line in problem.readings_of(i) {
                    column[line] = directions[direction].weighed[line] * by;
                }
            }
            if problem.is_correlated() {
                problem.innovate(column);
                self.weigh(column);
            }
        }
        Some(Weighed {
            columns,
            rows,
            square,
        })
    }

    /// The functions of a law at every row; none of a variable of several numbers, or that some row does not tell.
    fn functions(&self, law: &Law) -> Option<Vec<Vec<f64>>> {
        let mut out: Vec<Vec<f64>> = vec![vec![1.0; self.view.problem.rows.len()]];
        for factor in law.factors() {
            if !factor.of.is_single() {
                return None;
            }
            let values = match self.values.iter().find(|(other, _)| *other == factor.of) {
                Some((_, values)) => Cow::Borrowed(values.as_deref()?),
                None => Cow::Owned(self.view.problem.values(factor.of)?),
            };
            let mut functions = vec![vec![0.0; values.len()]; factor.basis.count()];
            for (row, u) in values.iter().enumerate() {
                factor
                    .basis
                    .at(*u, &mut |k, value| functions[k][row] = value);
            }
            let times = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(x, y)| x * y).collect();
            out = out
                .iter()
                .flat_map(|a| functions.iter().map(move |b| times(a, b)))
                .collect();
        }
        Some(out)
    }

    /// Rms motion at the tool of what makes the squared residual smaller by so much.
    pub(crate) fn size(&self, fit: f64) -> f64 {
        let count = self.variance.len().max(1) as f64;
        (fit.max(0.0) * self.variance.iter().sum::<f64>() / (count * count)).sqrt()
    }

    fn mean_square(&self, column: &[f64]) -> f64 {
        let of_row = |(i, variance): (usize, &f64)| {
            let lines = self.view.problem.readings_of(i);
            column[lines].iter().map(|value| value * value).sum::<f64>() * variance
        };
        self.variance.iter().enumerate().map(of_row).sum::<f64>()
            / self.variance.len().max(1) as f64
    }

    fn weigh(&self, column: &mut [f64]) {
        let problem = &self.view.problem;
        for (i, row) in problem.rows.iter().enumerate() {
            let lines = problem.readings_of(i);
            if let (Some(whitening), 3) = (&self.noise.whitening, lines.len()) {
                let white = whitening * Vector3::from_column_slice(&column[lines.clone()]);
                column[lines.clone()].copy_from_slice(white.as_slice());
            }
            if let Some(weight) = self.noise.weights.get(*row) {
                column[lines].iter_mut().for_each(|value| *value *= weight);
            }
        }
        if let Some(factor) = self.noise.currents {
            let points = problem.of_readings().len();
            column[points..]
                .iter_mut()
                .for_each(|value| *value *= factor);
        }
    }
}

impl NoiseShape {
    /// Before anything was found: rows that measured one pose count as far as they say something of their own.
    pub(crate) fn at_first(view: &RoundView, rows: usize) -> Self {
        let mut weights = vec![1.0; rows];
        share_among_repeats(view, &mut weights);
        Self {
            weights,
            ..Self::default()
        }
    }

    /// By what a fitted model leaves of the rows: those that are far off count less, and a noise that is stronger in some direction is made
    /// even.
    pub(crate) fn of(view: &RoundView, rows: usize) -> Self {
        let problem = &view.problem;
        let residual = problem.of_readings();
        let square = |lines: std::ops::Range<usize>| {
            let count = lines.len().max(1) as f64;
            residual[lines]
                .iter()
                .map(|value| value * value)
                .sum::<f64>()
                / count
        };
        let mut sizes: Vec<f64> = (0..problem.rows.len())
            .map(|i| square(problem.readings_of(i)).sqrt())
            .collect();
        let by_row = sizes.clone();
        if sizes.is_empty() {
            return Self::default();
        }
        let middle = sizes.len() / 2;
        // The median of a mean of three squares is 0.79 of their expectation.
        let scale = (*sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.89).max(0.3);
        let mut weights = vec![1.0; rows];
        for (size, row) in by_row.iter().zip(&problem.rows) {
            weights[*row] = (*FAR * scale / size.max(f64::MIN_POSITIVE)).min(1.0);
        }
        let points = (0..problem.rows.len())
            .filter(|i| weights[problem.rows[*i]] == 1.0 && problem.readings_of(*i).len() == 3);
        let (mut sum, mut count) = (Matrix3::zeros(), 0.0);
        for i in points {
            let left = Vector3::from_column_slice(&residual[problem.readings_of(i)]);
            sum += left * left.transpose();
            count += 1.0;
        }
        share_among_repeats(view, &mut weights);
        let mean = |values: &[f64]| {
            values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64
        };
        let currents = &problem.residual[residual.len()..];
        let currents = (!currents.is_empty()).then(|| {
            (mean(residual) / mean(currents).max(1e-12))
                .sqrt()
                .clamp(0.2, 5.0)
        });
        Self {
            weights,
            whitening: evened(sum, count),
            currents,
        }
    }
}

/// Rows that measured one pose one after another count as one where they differ less among each other than from the model: what they leave is
/// then the pose's, not the instrument's.
fn share_among_repeats(view: &RoundView, weights: &mut [f64]) {
    let (problem, residual) = (&view.problem, view.problem.of_readings());
    let width = problem.width().unwrap_or(0);
    let mut poses: Vec<Vec<usize>> = Vec::new();
    for (i, row) in problem.rows.iter().enumerate() {
        match poses
            .last_mut()
            .filter(|pose| problem.data.same_pose(problem.rows[pose[0]], *row))
        {
            Some(pose) => pose.push(i),
            None => poses.push(vec![i]),
        }
    }
    let (mut within, mut freedom) = (0.0, 0.0);
    for pose in poses.iter().filter(|pose| pose.len() > 1) {
        for k in 0..width {
            let values: Vec<f64> = pose
                .iter()
                .map(|i| residual[problem.readings_of(*i).start + k])
                .collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            within += values
                .iter()
                .map(|value| (value - mean).powi(2))
                .sum::<f64>();
            freedom += values.len() as f64 - 1.0;
        }
    }
    if freedom < *EVEN {
        return;
    }
    let within = within / freedom;
    let whole =
        residual.iter().map(|value| value * value).sum::<f64>() / residual.len().max(1) as f64;
    let between = (whole - within).max(0.0);
    for pose in poses.iter().filter(|pose| pose.len() > 1) {
        let count = pose.len() as f64;
        let share = ((between + within) / (count * between + within).max(f64::MIN_POSITIVE))
            .sqrt()
            .min(1.0);
        pose.iter().for_each(|i| weights[problem.rows[*i]] *= share);
    }
}

/// What makes a noise of this summed covariance even and leaves its strength; none where it is nearly even.
fn evened(sum: Matrix3<f64>, count: f64) -> Option<Matrix3<f64>> {
    if count < *EVEN {
        return None;
    }
    let even = sum.trace() / (3.0 * count);
    let covariance = (sum + Matrix3::identity() * (*EVEN * even)) / (count + *EVEN);
    let parts = covariance.symmetric_eigen();
    let (least, most) = (parts.eigenvalues.min(), parts.eigenvalues.max());
    if least <= 0.0 || most / least < *UNEVEN {
        return None;
    }
    let roots = Matrix3::from_diagonal(&parts.eigenvalues.map(|variance| (even / variance).sqrt()));
    Some(parts.eigenvectors * roots * parts.eigenvectors.transpose())
}

/// What makes a motion of this mean square one of unit size; 0 of none.
fn unit(square: f64) -> f64 {
    if square > 0.0 {
        square.sqrt().recip()
    } else {
        0.0
    }
}

/// Transpose of `a` times `b`; where one has fewer rows the others count as zero.
pub(super) fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> DMatrix<f64> {
    let rows = a.nrows().min(b.nrows());
    let (a, b) = (a.subrows(0, rows), b.subrows(0, rows));
    let mut products = DMatrix::zeros(a.ncols(), b.ncols());
    let out = MatMut::from_column_major_slice_mut(products.as_mut_slice(), a.ncols(), b.ncols());
    matmul(out, Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    products
}

pub(super) fn view(of: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(of.as_slice(), of.nrows(), of.ncols())
}
