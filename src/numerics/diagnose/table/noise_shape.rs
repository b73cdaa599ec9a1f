//! How the noise of the rows differs from what they state, by the residual of a model.

use crate::criteria::cells::{EVEN, FAR, UNEVEN, UNRECORDED};
use crate::diagnose::round::RoundView;
use crate::effect::{Form, Survey, Variable};
use crate::linear::mean_square;
use crate::robot::Measurements;
use nalgebra::{Matrix3, Vector3};

/// How the noise of the rows differs from what they state: weights of rows that are far off, and the shape of the others'.
#[derive(Clone, Default)]
pub(super) struct NoiseShape {
    /// Square root of the weight of each row of the recording; empty where all count fully.
    pub(super) weights: Vec<f64>,
    /// Rows that are far off.
    pub(super) far: usize,
    /// What makes the three numbers of a point white, in the axes of the recording.
    pub(super) whitening: Option<Matrix3<f64>>,
    /// Factor of motor currents, so that their residual is as large as that of points.
    pub(super) currents: Option<f64>,
}

impl NoiseShape {
    /// Before anything was found: rows that measured one pose count as far as they say something of their own.
    pub(crate) fn at_first(view: &RoundView) -> Self {
        let mut weights = vec![1.0; view.problem.data.rows()];
        share_among_repeats(view, &mut weights);
        Self {
            weights,
            ..Self::default()
        }
    }

    /// With the first rows uncertain by what some forms, each of such a size (m), may remember of moves before them.
    pub(crate) fn with_unknown_memory<'a>(
        mut self,
        survey: &Survey,
        forms: impl Iterator<Item = (&'a Form, f64)>,
    ) -> Self {
        let data = survey.data;
        let mut square = vec![0.0; data.rows()];
        for (form, size) in forms {
            for variable in form.variables() {
                let shares = unrecorded(variable, data);
                let rows: f64 = shares.iter().sum();
                let is_brief = rows <= *UNRECORDED * data.rows() as f64;
                for (row, share) in shares.into_iter().enumerate().filter(|_| is_brief) {
                    square[row] += (size * share / data.points.sigma[row].mean()).powi(2);
                }
            }
        }
        for (weight, square) in self.weights.iter_mut().zip(square) {
            if square.is_finite() {
                *weight /= (1.0 + square).sqrt();
            }
        }
        self
    }

    /// By the residual of a fitted model: rows that are far off count less, and a noise that is stronger in some direction is made
    /// even.
    pub(crate) fn of(view: &RoundView) -> Self {
        let problem = &view.problem;
        let residual = problem.measured_residual();
        let rows = 0..problem.rows.len();
        let size = |i: usize| mean_square(&residual[problem.readings_of(i)]).sqrt();
        let mut sizes: Vec<f64> = rows.clone().map(size).collect();
        let by_row = sizes.clone();
        if sizes.is_empty() {
            return Self::default();
        }
        let middle = sizes.len() / 2;
        // The median of a mean of three squares is 0.79 of their expectation.
        let scale = (*sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.89).max(0.3);
        let mut weights = vec![1.0; problem.data.rows()];
        for (size, row) in by_row.iter().zip(&problem.rows) {
            weights[*row] = (*FAR * scale / size.max(f64::MIN_POSITIVE)).min(1.0);
        }
        let far = weights.iter().filter(|weight| **weight < 0.5).count();
        let points =
            rows.filter(|i| weights[problem.rows[*i]] == 1.0 && problem.readings_of(*i).len() == 3);
        let (mut sum, mut count) = (Matrix3::zeros(), 0.0);
        for i in points {
            let left = Vector3::from_column_slice(&residual[problem.readings_of(i)]);
            sum += left * left.transpose();
            count += 1.0;
        }
        share_among_repeats(view, &mut weights);
        let currents = &problem.residual[residual.len()..];
        let ratio = (mean_square(residual) / mean_square(currents).max(1e-12)).sqrt();
        let currents = (!currents.is_empty()).then(|| ratio.clamp(0.2, 5.0));
        Self {
            weights,
            far,
            whitening: evened(sum, count),
            currents,
        }
    }
}

/// How much of what a variable remembers is of moves before the first row, which nobody recorded: a share by row; none of a variable that
/// remembers no moves.
fn unrecorded(variable: Variable, data: &Measurements) -> Vec<f64> {
    let mut shares = vec![0.0; data.rows()];
    // The least and the most that it may be.
    let [mut least, mut most] = [-1.0, 1.0];
    for place in 1..data.rows() {
        let [before, row] = [place - 1, place].map(|place| data.at_place(place));
        let (moved, passed) = match variable {
            Variable::Recent { time, .. } => {
                let kept = libm::exp((data.time(before) - data.time(row)) / time);
                (0.0, kept)
            }
            Variable::Stretch { joint, limit } => {
                ((data.q(row)[joint] - data.q(before)[joint]) / limit, 1.0)
            }
            _ => return Vec::new(),
        };
        [least, most] = [least, most].map(|state: f64| (state * passed + moved).clamp(-1.0, 1.0));
        shares[row] = 0.5 * (most - least);
    }
    if data.rows() > 0 {
        shares[data.at_place(0)] = 1.0;
    }
    shares
}

/// Rows that measured one pose one after another count as one where they differ less among each other than from the model: what they leave is
/// then the pose's, not the instrument's.
fn share_among_repeats(view: &RoundView, weights: &mut [f64]) {
    let (problem, residual) = (&view.problem, view.problem.measured_residual());
    let width = problem.width().unwrap_or(0);
    let mut poses: Vec<Vec<usize>> = Vec::new();
    for (i, row) in problem.rows.iter().enumerate() {
        let same = |pose: &&mut Vec<usize>| problem.data.same_pose(problem.rows[pose[0]], *row);
        match poses.last_mut().filter(same) {
            Some(pose) => pose.push(i),
            None => poses.push(vec![i]),
        }
    }
    poses.retain(|pose| pose.len() > 1);
    let (mut within, mut freedom) = (0.0, 0.0);
    for pose in &poses {
        for k in 0..width {
            let value = |i: &usize| residual[problem.readings_of(*i).start + k];
            let values: Vec<f64> = pose.iter().map(value).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let squares = values.iter().map(|value| (value - mean).powi(2));
            within += squares.sum::<f64>();
            freedom += values.len() as f64 - 1.0;
        }
    }
    if freedom < *EVEN {
        return;
    }
    let within = within / freedom;
    let whole = mean_square(residual);
    let between = (whole - within).max(0.0);
    for pose in &poses {
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
