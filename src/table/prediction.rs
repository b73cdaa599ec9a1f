//! Where a model puts every measured point, and what is left.

use super::{Prediction, PredictionRow};
use crate::estimate::{Covariance, Fitted, Model};
use crate::observation::{KINDS, noise};
use crate::robot::Measurements;
use crate::table::{Recording, Split};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// A measured point that is added up again from prediction and residual is off by less than this.
const ROUNDING_MM: f64 = 1e-6;

impl Prediction {
    /// The residuals of every row under a model; no row is a suspect yet. `held_out[row]` as in the column; `covariance` where the
    /// step estimated the whole model.
    pub fn of(
        step: &str,
        model: &Model,
        data: &Measurements,
        recording: &Recording,
        split: &Split,
        held_out: &[bool],
        covariance: Option<&Covariance>,
    ) -> Self {
        let sigma = covariance.map(|covariance| covariance.of_predictions(model, data));
        let predicted = model.predict(data);
        let mut errors = model.row_errors(data).into_iter();
        let rows = predicted.iter().enumerate().map(|(row, point)| {
            let point = point * 1e3;
            let error = errors.next();
            let measured_point = data.point(row);
            let whole = measured_point.is_some();
            let residual = match measured_point {
                Some(measured) => measured * 1e3 - point,
                None => error
                    .as_ref()
                    .map_or_else(Vector3::zeros, |error| error.point * 1e3),
            };
            PredictionRow {
                sequence: recording.sequence[row],
                point_id: recording.point_id[row].clone(),
                set: split.0[row].set.clone(),
                step: step.into(),
                held_out: held_out[row],
                suspect: false,
                x_mm: point.x,
                y_mm: point.y,
                z_mm: point.z,
                dx_mm: residual.x,
                dy_mm: residual.y,
                dz_mm: residual.z,
                error_mm: match &error {
                    Some(error) if !whole => error.length * 1e3,
                    _ => residual.norm(),
                },
                noise_mm: noise(data, row) * 1e3,
                noise_basis: Some(data.noise_basis.name().into()),
                sigma_mm: sigma.as_ref().map(|all| all[row] * 1e3),
                fold_error_mm: None,
                block_error_mm: None,
                weight: None,
                measured: (!whole).then(|| measured(data, row)),
                turn_rad: error.and_then(|error| error.angle),
                remark: None,
            }
        });
        Self(rows.collect())
    }

    /// Whether these are the points of a recording: its rows, names and measured points.
    pub fn is_of(&self, recording: &Recording) -> bool {
        let measured = |row: &PredictionRow| {
            [
                row.x_mm + row.dx_mm,
                row.y_mm + row.dy_mm,
                row.z_mm + row.dz_mm,
            ]
        };
        let is = |at: usize, row: &PredictionRow| {
            let near = |point: [f64; 3]| {
                measured(row)
                    .into_iter()
                    .zip(point)
                    .all(|(own, m)| (own - m * 1e3).abs() < ROUNDING_MM)
            };
            row.sequence == recording.sequence[at]
                && row.point_id == recording.point_id[at]
                && (row.measured.is_some() || recording.point(at).is_some_and(near))
        };
        self.0.len() == recording.rows() && self.0.iter().enumerate().all(|(at, row)| is(at, row))
    }

    /// Whole points that the step was fitted to.
    fn fitted_points(&self) -> impl Iterator<Item = &PredictionRow> {
        self.0
            .iter()
            .filter(|row| !row.held_out && !row.suspect && row.measured.is_none())
    }

    /// Standard deviation per axis (mm) of what the model leaves beyond the noise, by the residuals of the points that its step was
    /// fitted to, with what the fit took up put back. Zero where it is within two standard errors of none.
    pub fn unexplained_mm(&self) -> f64 {
        let (mut excess, mut noise, mut count) = (0.0, 0.0, 0usize);
        for row in self.fitted_points() {
            excess +=
                row.error_mm.powi(2) + row.sigma_mm.unwrap_or(0.0).powi(2) - row.noise_mm.powi(2);
            noise += row.noise_mm.powi(2);
            count += 1;
        }
        // The standard error of a sum of squares of three axes a row.
        let chance = 2.0 * noise * (2.0 / (3 * count.max(1)) as f64).sqrt();
        if excess > chance {
            (excess / (3 * count) as f64).sqrt()
        } else {
            0.0
        }
    }

    /// Mean squared one-sigma length of the noise of the points that the step was fitted to, mm2; zero of none.
    pub fn mean_square_noise_mm2(&self) -> f64 {
        let (sum, count) = self
            .fitted_points()
            .fold((0.0, 0usize), |(sum, count), row| {
                (sum + row.noise_mm.powi(2), count + 1)
            });
        sum / count.max(1) as f64
    }

    /// The same with errors larger by a factor, by row: of rows that had a part in what they were brought to.
    pub fn with_places(mut self, inflation: &BTreeMap<usize, f64>) -> Self {
        inflation
            .iter()
            .filter(|(_, by)| by.is_finite())
            .for_each(|(row, by)| self.0[*row].error_mm *= by);
        self
    }

    /// The same with the errors of `rows` under fits without them.
    pub fn with_folds<'a>(
        mut self,
        rows: impl Iterator<Item = (&'a usize, (&'a f64, &'a f64))>,
    ) -> Self {
        for (row, (fold, block)) in rows {
            self.0[*row].fold_error_mm = Some(fold * 1e3);
            self.0[*row].block_error_mm = Some(block * 1e3);
        }
        self
    }

    /// The same with the weights of `rows` in a fit to them; 0 of those that were set aside.
    pub fn with_weights(mut self, rows: &[usize], fitted: &Fitted) -> Self {
        rows.iter().for_each(|row| {
            self.0[*row].weight = Some(fitted.downweighted.get(row).copied().unwrap_or(1.0))
        });
        self.0
            .iter_mut()
            .filter(|row| row.suspect)
            .for_each(|row| row.weight = Some(0.0));
        self
    }

    /// The same with a remark for each row behind what is said already; nothing where there is none.
    pub fn with_remarks(mut self, remarks: impl IntoIterator<Item = Option<String>>) -> Self {
        for (row, remark) in self.0.iter_mut().zip(remarks) {
            row.remark = match (row.remark.take(), remark) {
                (Some(said), Some(more)) => Some(format!("{said}; {more}")),
                (said, more) => said.or(more),
            };
        }
        self
    }

    /// The same with the rows marked that a screen set aside.
    pub fn with_suspects(mut self, suspects: impl Iterator<Item = usize>) -> Self {
        for row in suspects {
            self.0[row].suspect = true;
        }
        self
    }
}

/// What a row measured, in words.
fn measured(data: &Measurements, row: usize) -> String {
    KINDS
        .iter()
        .flat_map(|kind| kind.words(data, row))
        .collect::<Vec<_>>()
        .join(" ")
}
