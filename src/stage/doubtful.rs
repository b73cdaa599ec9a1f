//! Where a model is not to be believed without a word: uncertain corrections, residuals below the noise; and what to measure so that data show
//! more.

use crate::compensate::{IdentifiedArm, Scatter, Uncertainty, doubts};
use crate::error::{counted, first_of};
use crate::estimate::{Covariance, Model, ParameterStatus, Remedy, Session, remedies};
use crate::robot::Measurements;
use crate::stage::Context;
use crate::table::{Prediction, PredictionRow};
use std::collections::BTreeMap;

/// A model, and where it was measured.
pub(crate) struct KnownModel<'a> {
    pub(crate) model: &'a Model,
    /// Covariance of all of its parameters; none where that is not known.
    pub(crate) covariance: Option<&'a Covariance>,
    /// The recording that it was identified by.
    pub(crate) measured: &'a Measurements,
}

impl KnownModel<'_> {
    /// A remark for each row of `data` among `rows` of which the correction is doubtful, none for all others.
    pub(crate) fn remarks(&self, data: &Measurements, rows: &[usize]) -> Vec<Option<String>> {
        let mut out = vec![None; data.rows()];
        let Some(covariance) = self.covariance else {
            return out;
        };
        let arm = IdentifiedArm::new(self.model.clone(), None);
        let uncertainty = Uncertainty::new(&arm, covariance.clone(), Scatter::default())
            .with_recording(&arm, self.measured);
        for (row, doubt) in rows.iter().zip(doubts(&arm, &uncertainty, data, rows)) {
            out[*row] = doubt.map(|doubt| doubt.to_string());
        }
        out
    }
}

/// How many held-out points have a remark, of how many, in a sentence; none where none has.
pub(crate) fn sentence(prediction: &Prediction) -> Option<String> {
    let held_out = || prediction.0.iter().filter(|row| row.held_out);
    let remarked: Vec<&PredictionRow> = held_out().filter(|row| row.remark.is_some()).collect();
    (!remarked.is_empty()).then(|| {
        format!(
            "{} of {}: the correction is uncertain by more than half of itself: {}",
            remarked.len(),
            counted(held_out().count(), "held-out point"),
            named(&remarked)
        )
    })
}

/// Points that are named of many.
const NAMED: usize = 3;

/// The first of some points, each once, with the remark of the first one.
pub(crate) fn named(rows: &[&PredictionRow]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.point_id.as_str()) {
            names.push(&row.point_id);
        }
    }
    let first = rows
        .first()
        .and_then(|row| row.remark.as_deref())
        .unwrap_or_default();
    let point = match names.as_slice() {
        [point, _, ..] => format!("{point}: "),
        _ => String::new(),
    };
    format!("{} ({point}{first})", first_of(&names, NAMED))
}

/// A residual that is this much smaller than the noise is no luck: chi-square of ten values is below 0.4 once in a million times.
const FAR_BELOW: f64 = 5.0;
/// Fewer values beyond the parameters may be small by luck.
const FEWEST_VALUES: f64 = 10.0;

/// What to tell the person where whole points miss the model by far less than their noise, both mm; `parameters` were fitted to them.
pub(crate) fn suspicion(
    points: impl Iterator<Item = [f64; 2]>,
    parameters: usize,
) -> Option<String> {
    let (mut count, mut error, mut noise) = (0usize, 0.0, 0.0);
    for [missed, expected] in points {
        count += 1;
        error += missed.powi(2);
        noise += expected.powi(2);
    }
    let free = 3.0 * count as f64 - parameters as f64;
    if free < FEWEST_VALUES {
        return None;
    }
    // A fit of p parameters to n values leaves (n - p) / n of the noise's squares.
    let expected = noise * free / (3.0 * count as f64);
    let [rms, stated] = [error, noise].map(|sum| (sum / count as f64).sqrt());
    (FAR_BELOW.powi(2) * error < expected).then(|| {
        format!(
            "the points miss the model by {} mm rms, far below the {} mm of the recording's noise: they are probably computed (a target, \
             a nominal point), not measured; check the column mapping in `ingest`, or state the `instrument` there. Where they were measured, the \
             noise is stated too large: check the unit of `sigma_x`, `u95` or the like",
            plain(rms),
            plain(stated)
        )
    })
}

/// To three digits, without a power of ten.
fn plain(mm: f64) -> String {
    let digits = if mm > 0.0 {
        (2.0 - mm.log10().floor()).clamp(0.0, 12.0)
    } else {
        0.0
    };
    format!("{mm:.*}", digits as usize)
}

/// Sentences for the remarks of redundant and unseen parameters, by name; the measurements that would show most are noted.
pub(crate) fn advice(context: &Context, session: &Session) -> BTreeMap<String, String> {
    let Session { model, fitted, .. } = *session;
    let found = remedies(session);
    let last = model.robot.joints();
    let mut counts: BTreeMap<&Remedy, usize> = BTreeMap::new();
    let mut sentences = BTreeMap::new();
    for (k, remedy) in &found {
        *counts.entry(remedy).or_default() += 1;
        let redundant = matches!(fitted.statuses[*k], ParameterStatus::Redundant(_));
        let sentence = match measure(remedy, last) {
            Some(measure) => format!("{measure} would show it"),
            None if redundant => {
                "no measured point can: they move every point in the same way".into()
            }
            None => continue,
        };
        sentences.insert(model.stack.specs()[*k].name.clone(), sentence);
    }
    for (remedy, count) in counts {
        if let Some(measure) = measure(remedy, last) {
            let what = if count == 1 {
                "one parameter".into()
            } else {
                format!("{count} parameters")
            };
            context.note(format!(
                "{measure} would show {what} that these data do not"
            ));
        }
    }
    sentences
}

/// The measurement as a noun, if there is one.
fn measure(remedy: &Remedy, last: usize) -> Option<String> {
    match remedy {
        Remedy::Nothing => None,
        Remedy::Payload => Some("poses with and without the payload".into()),
        Remedy::SecondTarget => Some(format!("a second target off the axis of joint {last}")),
        Remedy::Move(joints) => Some(match joints.as_slice() {
            [] => "poses all over the joints' ranges".into(),
            [joint] => format!("moving joint {}", joint + 1),
            [some @ .., joint] => {
                let some: Vec<String> = some.iter().map(|joint| (joint + 1).to_string()).collect();
                format!("moving joints {} and {}", some.join(", "), joint + 1)
            }
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize, error_mm: f64) -> impl Iterator<Item = [f64; 2]> {
        std::iter::repeat_n([error_mm, 0.02], count)
    }

    #[test]
    fn only_a_residual_far_below_the_noise_is_suspected() {
        assert!(
            suspicion(points(20, 0.0003), 30)
                .unwrap()
                .contains("0.000300 mm rms, far below the 0.0200 mm")
        );
        assert!(suspicion(points(20, 0.005), 30).is_none());
        // Ten points and thirty parameters: a fit passes through all of them.
        assert!(suspicion(points(10, 0.0), 30).is_none());
        assert!(suspicion(points(10, 0.0), 20).is_some());
    }
}
