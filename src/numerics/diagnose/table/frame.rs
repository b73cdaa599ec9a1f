//! The rows as they stand around the present model: what is left without any cell, and the columns of whatever moves it; both weighed, with
//! geometry projected off.

use super::evidence::EvidenceRows;
use crate::criteria::cells::{EVEN, FAR, UNEVEN};
use crate::diagnose::linear::{orthonormal, project};
use crate::diagnose::round::{FitState, Fitter, RoundView};
use crate::effect::{Form, Law, Motion, Variable};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;
use std::borrow::Cow;

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

/// UnitColumns of unit rms motion at the tool.
pub(super) struct UnitColumns {
    /// Residual rows x columns.
    pub values: DMatrix<f64>,
    /// Mean squared motion (m2 or rad2) by a unit of each coefficient.
    pub square: Vec<f64>,
}

/// The rows of the recording around a model.
pub(super) struct SearchRows<'a> {
    pub view: &'a RoundView<'a>,
    base: Mat<f64>,
    residual: Vec<f64>,
    /// Variance of one number of a row, m2 or rad2, by which columns become sizes.
    variance: Vec<f64>,
    noise: NoiseShape,
    directions: Vec<(Motion, Vec<Vec<f64>>)>,
    values: Vec<(Variable, Option<Vec<f64>>)>,
}

impl<'a> SearchRows<'a> {
    /// Around a fitted model; the residual is that without its causes.
    pub fn of(view: &'a RoundView<'a>, now: &FitState, fitter: &Fitter, noise: NoiseShape) -> Self {
        let problem = &view.problem;
        let variance = |(i, row): (usize, &usize)| {
            fitter.scale.noise(problem.data, *row).powi(2) / problem.readings_of(i).len().max(1) as f64
        };
        let variance = problem.rows.iter().enumerate().map(variance).collect();
        let mut residual = problem.residual.clone();
        for (cause, range) in now.causes.iter().zip(&now.ranges) {
            let columns = problem.columns(&cause.form);
            for (column, k) in columns.chunks(problem.residual_rows()).zip(range.clone()) {
                residual.iter_mut().zip(column).for_each(|(value, c)| *value += c * now.model.x[k]);
            }
        }
        let mut out =
            Self { view, base: Mat::new(), residual: Vec::new(), variance, noise, directions: Vec::new(), values: Vec::new() };
        let mut jacobian = problem.jacobian(fitter.free());
        (0..jacobian.ncols()).for_each(|j| out.weigh(jacobian.col_as_slice_mut(j)));
        out.weigh(&mut residual);
        out.base = orthonormal(&jacobian);
        project(out.base.as_ref(), &mut residual);
        out.residual = residual;
        out
    }

    pub fn parts(&self) -> String {
        let points = self.view.problem.of_readings().len();
        let sum = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
        format!("points {} of {} currents {} of {} raw {} factor {:?} model {}", sum(&self.residual[..points]), points, sum(&self.residual[points..]), self.residual.len() - points, sum(&self.view.problem.residual[points..]), self.noise.currents, sum(&self.view.problem.residual[..points]))
    }

    pub fn residual_rows(&self) -> usize {
        self.residual.len()
    }

    /// What is left, and how many rows say something of their own.
    pub fn rows(&self) -> EvidenceRows {
        let square = self.residual.iter().map(|value| value * value).sum();
        let counted = self.residual.len() as f64 / self.view.autocorrelation_time();
        EvidenceRows { freedom: (counted - self.base.ncols() as f64).max(1.0), square }
    }

    /// The least variance of the noise over what is stated: what motor currents leave says nothing of the points'.
    pub fn least_noise(&self) -> f64 {
        if self.view.problem.of_readings().len() < self.residual.len() { 1.0 } else { 0.09 }
    }

    pub fn residual(&self) -> &[f64] {
        &self.residual
    }

    /// Products of some columns with the residual.
    pub fn along(&self, columns: &DMatrix<f64>) -> DVector<f64> {
        let residual = MatRef::from_column_major_slice(&self.residual, self.residual.len(), 1);
        product(view(columns), residual).column(0).into_owned()
    }

    /// A variable at every row; none where some row does not tell it.
    pub fn values(&self, of: Variable) -> Option<Vec<f64>> {
        match self.values.iter().find(|(other, _)| *other == of) {
            Some((_, values)) => values.clone(),
            None => self.view.problem.values(of),
        }
    }

    /// Computes once what the columns of many forms are made of.
    pub fn prepare(&mut self, motions: &[Motion], variables: &[Variable]) {
        let problem = &self.view.problem;
        let fresh: Vec<Motion> =
            motions.iter().filter(|motion| !self.directions.iter().any(|(other, _)| other == *motion)).copied().collect();
        self.directions.par_extend(fresh.into_par_iter().map(|motion| (motion, problem.directions(motion))));
        let fresh: Vec<Variable> =
            variables.iter().filter(|of| !self.values.iter().any(|(other, _)| other == *of)).copied().collect();
        self.values.par_extend(fresh.into_par_iter().map(|of| (of, problem.values(of))));
    }

    /// UnitColumns of some forms, one form after another, and how many each has. They end before the rows of motor currents where no form says
    /// anything of these.
    pub fn columns(&self, forms: &[Form]) -> (UnitColumns, Vec<usize>) {
        let (all, points, problem) = (self.residual.len(), self.view.problem.of_readings().len(), &self.view.problem);
        let of = |form: &Form| match self.of_term(form) {
            Some(columns) => (columns, points),
            None => (problem.motions_by(form), all),
        };
        let each: Vec<(Vec<f64>, usize)> = forms.iter().map(of).collect();
        let moves_currents =
            |(columns, rows): &(Vec<f64>, usize)| columns.chunks(*rows).any(|column| column[points..].iter().any(|v| *v != 0.0));
        let rows = if each.iter().any(moves_currents) { all } else { points };
        let mut raw = Vec::new();
        let mut counts = Vec::with_capacity(forms.len());
        for (columns, own) in each {
            counts.push(columns.len() / own.max(1));
            for column in columns.chunks(own) {
                raw.extend_from_slice(&column[..own.min(rows)]);
                raw.resize(raw.len() + rows.saturating_sub(own), 0.0);
            }
        }
        let square: Vec<f64> = raw.chunks(rows).map(|column| self.mean_square(column)).collect();
        for (column, square) in raw.chunks_mut(rows).zip(&square) {
            problem.innovate(column);
            self.weigh(column);
            let scale = if *square > 0.0 { square.sqrt().recip() } else { 0.0 };
            column.iter_mut().for_each(|value| *value *= scale);
        }
        project(self.base.as_ref().subrows(0, rows), &mut raw);
        (UnitColumns { values: DMatrix::from_vec(rows, raw.len() / rows.max(1), raw), square }, counts)
    }

    /// UnitColumns of a law at a place from the motion's directions and the law's functions.
    fn of_term(&self, form: &Form) -> Option<Vec<f64>> {
        let term = form.term()?;
        let (_, directions) = self.directions.iter().find(|(motion, _)| *motion == term.motion())?;
        let functions = self.functions(term.law())?;
        let rows = self.view.problem.of_readings().len();
        let mut out = vec![0.0; rows * directions.len() * functions.len()];
        let put = |direction: &[f64], function: &[f64], column: &mut [f64]| {
            for (i, value) in function.iter().enumerate() {
                self.view.problem.readings_of(i).for_each(|line| column[line] = direction[line] * value);
            }
        };
        let mut columns = out.chunks_mut(rows);
        // In the order of the term's coefficients: a frame's axes alternate.
        if matches!(term.motion(), Motion::Base { .. } | Motion::Tool { .. } | Motion::Tracker { .. }) {
            for function in &functions {
                directions.iter().zip(&mut columns).for_each(|(direction, column)| put(direction, function, column));
            }
        } else {
            for direction in directions {
                functions.iter().zip(&mut columns).for_each(|(function, column)| put(direction, function, column));
            }
        }
        Some(out)
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
                factor.basis.at(*u, &mut |k, value| functions[k][row] = value);
            }
            let times = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(x, y)| x * y).collect();
            out = out.iter().flat_map(|a| functions.iter().map(move |b| times(a, b))).collect();
        }
        Some(out)
    }

    fn mean_square(&self, column: &[f64]) -> f64 {
        let of_row = |(i, variance): (usize, &f64)| {
            let lines = self.view.problem.readings_of(i);
            column[lines].iter().map(|value| value * value).sum::<f64>() * variance
        };
        self.variance.iter().enumerate().map(of_row).sum::<f64>() / self.variance.len().max(1) as f64
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
            column[points..].iter_mut().for_each(|value| *value *= factor);
        }
    }
}

impl NoiseShape {
    /// Before anything was found: rows that measured one pose count as far as they say something of their own.
    pub fn at_first(view: &RoundView, rows: usize) -> Self {
        let mut weights = vec![1.0; rows];
        share_among_repeats(view, &mut weights);
        Self { weights, ..Self::default() }
    }

    /// By what a fitted model leaves of the rows: those that are far off count less, and a noise that is stronger in some direction is made
    /// even.
    pub fn of(view: &RoundView, rows: usize) -> Self {
        let problem = &view.problem;
        let residual = problem.of_readings();
        let square = |lines: std::ops::Range<usize>| {
            let count = lines.len().max(1) as f64;
            residual[lines].iter().map(|value| value * value).sum::<f64>() / count
        };
        let mut sizes: Vec<f64> = (0..problem.rows.len()).map(|i| square(problem.readings_of(i)).sqrt()).collect();
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
        let points = (0..problem.rows.len()).filter(|i| weights[problem.rows[*i]] == 1.0 && problem.readings_of(*i).len() == 3);
        let (mut sum, mut count) = (Matrix3::zeros(), 0.0);
        for i in points {
            let left = Vector3::from_column_slice(&residual[problem.readings_of(i)]);
            sum += left * left.transpose();
            count += 1.0;
        }
        share_among_repeats(view, &mut weights);
        let mean = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64;
        let currents = &problem.residual[residual.len()..];
        let currents = (!currents.is_empty()).then(|| (mean(residual) / mean(currents).max(1e-12)).sqrt().clamp(0.2, 5.0));
        Self { weights, whitening: evened(sum, count), currents }
    }
}

/// Rows that measured one pose one after another count as one where they differ less among each other than from the model: what they leave is
/// then the pose's, not the instrument's.
fn share_among_repeats(view: &RoundView, weights: &mut [f64]) {
    let (problem, residual) = (&view.problem, view.problem.of_readings());
    let width = problem.width().unwrap_or(0);
    let mut poses: Vec<Vec<usize>> = Vec::new();
    for (i, row) in problem.rows.iter().enumerate() {
        match poses.last_mut().filter(|pose| problem.data.same_pose(problem.rows[pose[0]], *row)) {
            Some(pose) => pose.push(i),
            None => poses.push(vec![i]),
        }
    }
    let (mut within, mut freedom) = (0.0, 0.0);
    for pose in poses.iter().filter(|pose| pose.len() > 1) {
        for k in 0..width {
            let values: Vec<f64> = pose.iter().map(|i| residual[problem.readings_of(*i).start + k]).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            within += values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
            freedom += values.len() as f64 - 1.0;
        }
    }
    if freedom < *EVEN {
        return;
    }
    let within = within / freedom;
    let whole = residual.iter().map(|value| value * value).sum::<f64>() / residual.len().max(1) as f64;
    let between = (whole - within).max(0.0);
    for pose in poses.iter().filter(|pose| pose.len() > 1) {
        let count = pose.len() as f64;
        let share = ((between + within) / (count * between + within).max(f64::MIN_POSITIVE)).sqrt().min(1.0);
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
