//! Where a model puts every measured point, and what is left.

use crate::error::counted;
use crate::estimate::{Covariance, Fitted, Model, Screening, Suspect, SuspectKind};
use crate::observation::{KINDS, noise};
use crate::{
    Corrections, Prediction, PredictionRow, Recording, Split, StatisticsRow, Suspects, SuspectsRow,
};
use calib_numerics::robot::{Measurements, NoiseBasis};
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
                measured: (!whole).then(|| measured(data, row)),
                turn_rad: error.and_then(|error| error.angle),
                ..PredictionRow::default()
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
                    .all(|(value, m)| (value - m * 1e3).abs() < ROUNDING_MM)
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
            row.remark = joined([row.remark.take(), remark]);
        }
        self
    }

    /// The same with the rows marked that a screen set aside, and why those are in no headline that bear another row's name.
    pub fn with_suspects(mut self, screening: &Screening) -> Self {
        for row in screening.set_aside() {
            self.0[row].suspect = true;
        }
        for suspect in screening
            .suspects
            .iter()
            .filter(|one| one.bears_another_name())
        {
            let partner = suspect.partner.map(|row| self.0[row].point_id.clone());
            let (id, partner) = (
                &self.0[suspect.row].point_id,
                partner.unwrap_or_else(|| "another row".into()),
            );
            self.0[suspect.row].left_out =
                Some(format!("{id} lies where the joints of {partner} put it"));
        }
        self
    }
}

/// Remarks as one; none where there are none.
pub(super) fn joined(remarks: impl IntoIterator<Item = Option<String>>) -> Option<String> {
    let more = |first: String, more: String| format!("{first}; {more}");
    remarks.into_iter().flatten().reduce(more)
}

/// What a row measured, in words.
fn measured(data: &Measurements, row: usize) -> String {
    KINDS
        .iter()
        .flat_map(|kind| kind.words(data, row))
        .collect::<Vec<_>>()
        .join(" ")
}

impl Suspects {
    /// What a screen found in this recording.
    pub fn of(step: &str, screening: &Screening, recording: &Recording, split: &Split) -> Self {
        let id = |row: usize| recording.point_id[row].as_str();
        let row = |suspect: &Suspect| SuspectsRow {
            sequence: recording.sequence[suspect.row],
            point_id: id(suspect.row).into(),
            set: split.0[suspect.row].set.clone(),
            step: step.into(),
            kind: name(suspect.kind).into(),
            partner_sequence: suspect.partner.map(|row| recording.sequence[row]),
            size_mm: suspect.size * 1e3,
            statistic: suspect.statistic,
            used: suspect.used(),
            remark: remark(suspect, suspect.partner.map(id)),
        };
        Self(screening.suspects.iter().map(row).collect())
    }
}

fn name(kind: SuspectKind) -> &'static str {
    match kind {
        SuspectKind::Exchanged => "exchanged",
        SuspectKind::Mislabelled => "mislabelled",
        SuspectKind::ShiftedBlock(_) => "shifted_block",
        SuspectKind::UnitSlip(_) => "unit_slip",
        SuspectKind::Zero => "zero",
        SuspectKind::Outlier => "outlier",
        SuspectKind::Event => "event",
    }
}

fn remark(suspect: &Suspect, partner: Option<&str>) -> String {
    let partner = partner.unwrap_or("another row");
    let far = format!("{:.3} mm from where its joints put it", suspect.size * 1e3);
    match suspect.kind {
        SuspectKind::Exchanged => {
            format!("{far}; with the points of {partner} and this row swapped, both fit")
        }
        SuspectKind::Mislabelled => format!("{far}, and where the joints of {partner} put it"),
        SuspectKind::ShiftedBlock(offset) => {
            format!(
                "{far}, and where the joints of {partner} put it, like its neighbours: points and joints are {offset:+} rows apart"
            )
        }
        SuspectKind::UnitSlip(factor) => format!("the point is {}: another unit?", slip(factor)),
        SuspectKind::Zero => "the point is the tracker's origin: a lost beam?".into(),
        SuspectKind::Outlier => {
            format!("{far}, and no mistake of the recording explains where it is")
        }
        SuspectKind::Event => {
            format!(
                "{far}, like its neighbours: something happened that the model does not know, so the row is kept"
            )
        }
    }
}

/// E.g. `25.4 times too far`.
pub fn slip(factor: f64) -> String {
    let digits = |factor: f64| format!("{factor:.1}").trim_end_matches(".0").to_string();
    if factor > 1.0 {
        format!("{} times too far", digits(factor))
    } else {
        format!("{} times too near", digits(1.0 / factor))
    }
}

impl StatisticsRow {
    /// Which of its points have a doubtful correction, with their errors; none where none has.
    pub fn doubts(&self) -> Option<String> {
        let (mean, max) = self.mean_remarked_mm.zip(self.max_remarked_mm)?;
        let points = self.remarked_points.as_deref().unwrap_or_default();
        let remarked = self.remarked.unwrap_or_default();
        Some(format!(
            "{remarked} of {}: the correction is uncertain by more than half of itself; mean {mean:.4} mm, max {max:.4} mm there; {points}",
            counted(self.points as usize, "point")
        ))
    }

    /// Which held-out points are in none of its figures, and what these were with them; none where there are none.
    pub fn without_points(&self) -> Option<String> {
        let (mean, max) = self.mean_all_mm.zip(self.max_all_mm)?;
        let left = self.left_out?;
        Some(format!(
            "{left} of {} left out: {}; with {} mean {mean:.3} mm, largest {max:.3} mm",
            counted((self.points + left) as usize, "held-out point"),
            self.left_out_points.as_deref().unwrap_or_default(),
            if left == 1 { "it" } else { "them" },
        ))
    }

    /// Whether it is of rows of contact constraints: folds are places then.
    pub fn is_contact(&self) -> bool {
        let is_named = |word: &str| self.set.ends_with(&format!("({word})"));
        KINDS
            .iter()
            .any(|kind| kind.is_contact() && is_named(kind.about().word))
    }

    /// Whether its figures of noise rest on nothing that was stated or measured again.
    pub fn is_inferred(&self) -> bool {
        self.noise_basis.as_deref() == Some(NoiseBasis::Inferred.name())
    }
}

impl Corrections {
    /// Root mean square error (mm) of the training rows under the rival that was kept, each row unseen; none where it could not be tried.
    pub fn rms_mm(&self) -> Option<f64> {
        self.0.iter().find(|row| row.chosen)?.rms_mm
    }
}
