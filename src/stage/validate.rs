//! `validate`: statistics of the position error after every step, held-out and training rows apart.

use crate::doubtful::{named, suspicion};
use crate::error::{Error, Result, counted, first_of};
use crate::statistics::quantile;
use crate::table::{Observability, Prediction, PredictionRow, Statistics, StatisticsRow};
use crate::{Context, Labelled, Stage};
use calib_numerics::robot::NoiseBasis;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// What is held out follows from the split and the steps.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Validate {
    /// Figures from elsewhere (a paper, a data sheet, last year's report) to stand beside ours.
    #[serde(default)]
    pub reference: Vec<PublishedErrors>,
}

/// Published or agreed statistics of one step on one set.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PublishedErrors {
    /// Where the figures stand, e.g. `Table 9`.
    pub label: String,
    /// The step of ours that they belong beside.
    pub step: String,
    /// The set of ours that they belong beside.
    pub set: String,
    /// Mean of the position error, mm.
    pub mean_mm: f64,
    /// Its standard deviation, mm.
    #[serde(default)]
    pub std_mm: Option<f64>,
    /// The largest error, mm.
    #[serde(default)]
    pub max_mm: Option<f64>,
}

crate::stage! {
    Validate, "validate", 6, "states the position error after every step, held-out and training rows apart",
        ValidateReads {
            prediction: Vec<Labelled<Prediction>>,
            observability: Vec<Labelled<Observability>>,
        } -> ValidateWrites {
            statistics: Statistics,
        }
}

impl Stage for Validate {
    fn sets_named(&self) -> Vec<(String, String)> {
        let sets = self.reference.iter().enumerate();
        sets.map(|(k, reference)| (format!("reference[{k}].set"), reference.set.clone()))
            .collect()
    }

    fn run(&self, reads: ValidateReads, context: &Context) -> Result<ValidateWrites> {
        if reads.prediction.is_empty() {
            return Err(Error::spec(
                context.id,
                "nothing to validate: no earlier stage writes `prediction` (identify, stiffness and learn do)",
            ));
        }
        let mut statistics = Statistics::default();
        let mut suspected = None;
        let proven = proven(&reads.prediction);
        for (order, step) in (0..).zip(&reads.prediction) {
            let mut fits = reads.observability.iter();
            let fit = fits.find(|fit| fit.stage == step.stage);
            let value = |quantity: &str| {
                let mut rows = fit?.table.0.iter();
                Some(rows.find(|row| row.quantity == quantity)?.value)
            };
            // A step on top of another carries that one's covariance, which scales with that one's residuals.
            let unmodelled = value("unmodelled_mm").filter(|_| value("earlier").is_none());
            let folded = |row: &&PredictionRow| row.fold_error_mm.is_some();
            let fitted = step.table.0.iter().filter(folded).count();
            // Without a k-th part of the rows, three values each.
            let inflation = value("folds").zip(value("free")).map(|(folds, free)| {
                let values = 3.0 * fitted as f64 * (1.0 - 1.0 / folds);
                (1.0 + free / (values - free - 1.0).max(1.0)).sqrt()
            });
            for ((name, set, held_out), rows) in groups(step)? {
                let whole = rows
                    .iter()
                    .filter(|row| held_out && row.measured.is_none() && !row.suspect);
                let line = suspicion(whole.map(|row| [row.error_mm, row.noise_mm]), 0);
                suspected =
                    suspected.or(line.map(|line| format!("{name} on {set}, held out: {line}")));
                let (left, rows) = left_out(rows, held_out, &proven);
                let mut row = describe(order, name, &set, held_out, &rows);
                without(&mut row, &rows, &left, &proven);
                row.expected_rms_mm = expected(held_out, &rows, unmodelled);
                cross_validate(&mut row, &rows, inflation);
                statistics.0.push(row);
            }
        }
        for row in statistics.0.iter().filter(|row| row.held_out) {
            if let Some(line) = row.without_points() {
                context.note(format!("{} on {}: {line}", row.step, row.set));
            }
            if let Some(without) = row.mean_without_mm {
                let suspects = counted(row.suspects, "suspect");
                let them = if row.suspects == 1 { "it" } else { "them" };
                context.note(format!(
                    "{} on {}: the held-out mean of {:.3} mm includes {suspects}; without {them} {without:.3} mm",
                    row.step, row.set, row.mean_mm
                ));
            }
            if let Some(line) = row.doubts() {
                context.note(format!("{} on {}: {line}", row.step, row.set));
            }
        }
        for reference in &self.reference {
            let PublishedErrors { step, set, .. } = reference;
            let rows = statistics.0.iter_mut();
            let mut matching = rows
                .filter(|row| row.step == *step && row.set == *set)
                .peekable();
            if matching.peek().is_none() {
                let message = format!("reference: no statistics of step `{step}` on set `{set}`");
                return Err(Error::spec(context.id, message));
            }
            for row in matching {
                row.reference = Some(reference.label.clone());
                row.reference_mean_mm = Some(reference.mean_mm);
                row.reference_std_mm = reference.std_mm;
                row.reference_max_mm = reference.max_mm;
            }
        }
        context.warn_each(suspected);
        if !statistics.0.iter().any(|row| row.held_out) {
            context
                .warn("no held-out rows: only the training error can be stated, and it flatters");
        }
        Ok(ValidateWrites { statistics })
    }
}

/// A text for each row, by its sequence and point id.
type Named<'a> = BTreeMap<(i64, &'a str), &'a str>;

/// Rows that are proven to be others', with the reasons: by the last step that screened its rows, whose model is the best.
fn proven(steps: &[Labelled<Prediction>]) -> Named<'_> {
    let screened = |step: &&Labelled<Prediction>| step.table.0.iter().any(|row| row.suspect);
    let last = steps.iter().rev().find(screened);
    let rows = last.into_iter().flat_map(|step| &step.table.0);
    rows.filter_map(|row| {
        Some((
            (row.sequence, row.point_id.as_str()),
            row.left_out.as_deref()?,
        ))
    })
    .collect()
}

/// The rows of a group that are in no figure, and those that are: of held-out ones.
fn left_out<'a>(
    rows: Vec<&'a PredictionRow>,
    held_out: bool,
    proven: &Named,
) -> (Vec<&'a PredictionRow>, Vec<&'a PredictionRow>) {
    let is_proven =
        |row: &PredictionRow| proven.contains_key(&(row.sequence, row.point_id.as_str()));
    match held_out && rows.iter().any(|row| !is_proven(row)) {
        true => rows.into_iter().partition(|row| is_proven(row)),
        false => (Vec::new(), rows),
    }
}

/// Points that are named of many.
const NAMED: usize = 3;

/// States which points are in no figure of a row, and what the figures were with them.
fn without(
    row: &mut StatisticsRow,
    rows: &[&PredictionRow],
    left: &[&PredictionRow],
    proven: &Named,
) {
    if !row.held_out {
        return;
    }
    row.left_out = Some(left.len() as i64);
    if left.is_empty() {
        return;
    }
    let reasons: Vec<&str> = left
        .iter()
        .filter_map(|row| proven.get(&(row.sequence, row.point_id.as_str())).copied())
        .collect();
    row.left_out_points = Some(first_of(&reasons, NAMED));
    let all = || rows.iter().chain(left).map(|row| row.error_mm);
    row.mean_all_mm = Some(all().sum::<f64>() / all().count() as f64);
    row.max_all_mm = all().max_by(f64::total_cmp);
}

type RowsByStepAndSet<'a> = BTreeMap<(&'a str, Cow<'a, str>, bool), Vec<&'a PredictionRow>>;

/// Rows by (step, set, held out), in that order; fails where a table tells of several steps.
///
/// Rows that did not measure a whole point are a set of their own, e.g. `fit (distance)`: their errors are of another kind.
fn groups(step: &Labelled<Prediction>) -> Result<RowsByStepAndSet<'_>> {
    let mut groups = RowsByStepAndSet::new();
    for row in &step.table.0 {
        let set = match &row.measured {
            Some(measured) => Cow::Owned(format!("{} ({measured})", row.set)),
            None => Cow::Borrowed(row.set.as_str()),
        };
        groups
            .entry((&row.step, set, row.held_out))
            .or_default()
            .push(row);
    }
    let mut names = groups.keys().map(|key| key.0);
    if let Some(first) = names.next()
        && let Some(other) = names.find(|name| *name != first)
    {
        return Err(Error::Bug(format!(
            "stage {}: one prediction table with two steps, {first} and {other}",
            step.stage
        )));
    }
    Ok(groups)
}

/// The statistics of a group of at least one row.
fn describe(
    order: i64,
    step: &str,
    set: &str,
    held_out: bool,
    rows: &[&PredictionRow],
) -> StatisticsRow {
    let sorted = |keep: fn(&PredictionRow) -> bool| {
        let rows = rows.iter().filter(|row| keep(row));
        let mut errors: Vec<f64> = rows.map(|row| row.error_mm).collect();
        errors.sort_by(f64::total_cmp);
        errors
    };
    let (error, without) = (sorted(|_| true), sorted(|row| !row.suspect));
    let count = error.len() as f64;
    let mean = error.iter().sum::<f64>() / count;
    let spread: f64 = error.iter().map(|e| (e - mean).powi(2)).sum();
    let rms = |value: fn(&PredictionRow) -> f64| {
        (rows.iter().map(|row| value(row).powi(2)).sum::<f64>() / count).sqrt()
    };
    let suspects = rows.len() - without.len();
    let remarked = rows.iter().copied().filter(|row| row.remark.is_some());
    let remarked: Vec<&PredictionRow> = remarked.collect();
    let errors_of_remarked = || remarked.iter().map(|row| row.error_mm);
    let at = |share: f64| quantile(&error, share).unwrap_or(f64::NAN);
    let some = suspects > 0 && !without.is_empty();
    let basis = |row: &&PredictionRow| NoiseBasis::parse(row.noise_basis.as_deref()?);
    let basis = rows.iter().filter_map(basis).max();
    let average =
        |power: i32| without.iter().map(|e| e.powi(power)).sum::<f64>() / without.len() as f64;
    StatisticsRow {
        order,
        step: step.into(),
        set: set.into(),
        held_out,
        points: rows.len() as i64,
        mean_mm: mean,
        std_mm: if rows.len() > 1 {
            (spread / (count - 1.0)).sqrt()
        } else {
            0.0
        },
        rms_mm: rms(|row| row.error_mm),
        median_mm: at(0.5),
        p95_mm: at(0.95),
        max_mm: at(1.0),
        rms_x_mm: rms(|row| row.dx_mm),
        rms_y_mm: rms(|row| row.dy_mm),
        rms_z_mm: rms(|row| row.dz_mm),
        noise_rms_mm: rms(|row| row.noise_mm),
        noise_basis: basis.map(|basis| basis.name().into()),
        suspects: suspects as i64,
        mean_without_mm: some.then(|| average(1)),
        rms_without_mm: some.then(|| average(2).sqrt()),
        max_without_mm: without.last().copied().filter(|_| some),
        remarked: Some(remarked.len() as i64),
        mean_remarked_mm: (!remarked.is_empty())
            .then(|| errors_of_remarked().sum::<f64>() / remarked.len() as f64),
        max_remarked_mm: errors_of_remarked().max_by(f64::total_cmp),
        remarked_points: (!remarked.is_empty()).then(|| named(&remarked)),
        ..StatisticsRow::default()
    }
}

/// What cross-validation says of the points of a row; `inflation` of the noise is to be expected.
fn cross_validate(row: &mut StatisticsRow, points: &[&PredictionRow], inflation: Option<f64>) {
    let figures = |error: fn(&PredictionRow) -> Option<f64>| {
        let errors: Vec<f64> = points.iter().filter_map(|point| error(point)).collect();
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let rms = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
        (!errors.is_empty()).then(|| (mean, rms, errors.iter().copied().fold(0.0, f64::max)))
    };
    if let Some((mean, rms, max)) = figures(|point| point.fold_error_mm) {
        (row.fold_mean_mm, row.fold_rms_mm, row.fold_max_mm) = (Some(mean), Some(rms), Some(max));
        row.fold_expected_mm = inflation.map(|inflation| row.noise_rms_mm * inflation);
    }
    if let Some((mean, rms, max)) = figures(|point| point.block_error_mm) {
        (row.block_mean_mm, row.block_rms_mm, row.block_max_mm) =
            (Some(mean), Some(rms), Some(max));
    }
}

/// The rms of a complete model: prediction adds its variance to new points and has taken it from those that it was fitted to.
///
/// On average over rows this is noise x sqrt(1 +- p / n), here with the leverage of the very rows. `unmodelled` is what the fit
/// found beyond the noise (mm per axis), by which the stated uncertainty is larger than a complete model's.
fn expected(held_out: bool, rows: &[&PredictionRow], unmodelled: Option<f64>) -> Option<f64> {
    let beyond = 3.0 * unmodelled?.powi(2);
    let mut sum = 0.0;
    for row in rows {
        if row.measured.is_some() {
            return None;
        }
        let noise = row.noise_mm.powi(2);
        let leverage = row.sigma_mm?.powi(2) / (noise + beyond);
        sum += noise
            * match held_out {
                true => 1.0 + leverage,
                false => (1.0 - leverage).max(0.0),
            };
    }
    Some((sum / rows.len() as f64).sqrt())
}
