//! Where a model is not to be believed without a word: uncertain corrections, residuals below the noise; and what to measure so that data show
//! more.

use crate::Context;
use crate::compensate::{IdentifiedArm, Scatter, Uncertainty, doubts};
use crate::error::{counted, first_of};
use crate::estimate::{
    Covariance, Fitted, Model, Remedy, Screening, Session, Suspect, SuspectKind, fit_screened,
    remedies,
};
use crate::table::{Prediction, PredictionRow, Recording, Split, slip};
use calib_numerics::robot::Measurements;
use std::collections::BTreeMap;

/// A model, and where it was measured.
pub struct KnownModel<'a> {
    pub model: &'a Model,
    /// Covariance of all of its parameters; none where that is not known.
    pub covariance: Option<&'a Covariance>,
    /// The recording that it was identified by.
    pub measured: &'a Measurements,
}

impl KnownModel<'_> {
    /// A remark for each row of `data` among `rows` of which the correction is doubtful, none for all others.
    pub fn remarks(&self, data: &Measurements, rows: &[usize]) -> Vec<Option<String>> {
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
pub fn sentence(prediction: &Prediction) -> Option<String> {
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
pub fn named(rows: &[&PredictionRow]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.point_id.as_str()) {
            names.push(&row.point_id);
        }
    }
    let first = rows.first().and_then(|row| row.remark.as_deref());
    let first = first.unwrap_or_default();
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
pub fn suspicion(points: impl Iterator<Item = [f64; 2]>, parameters: usize) -> Option<String> {
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

/// Sentences for the remarks of parameters that the data do not determine, by name; the measurements that would determine most are noted.
pub fn advice(context: &Context, session: &Session) -> BTreeMap<String, String> {
    let model = session.model;
    let found = remedies(session);
    let last = model.robot.joints();
    let mut counts: BTreeMap<&Remedy, usize> = BTreeMap::new();
    let mut sentences = BTreeMap::new();
    for (k, remedy) in &found {
        *counts.entry(remedy).or_default() += 1;
        let sentence = match measure(remedy, last) {
            Some(measure) => format!("{measure} would determine it"),
            None => "other parameters move every measured point in the same way".into(),
        };
        sentences.insert(model.stack.specs()[*k].name.clone(), sentence);
    }
    for (remedy, count) in counts {
        let what = match count {
            1 => "one parameter".into(),
            _ => format!("{count} parameters"),
        };
        if let Some(measure) = measure(remedy, last) {
            context.note(format!(
                "{measure} would determine {what} that these data do not"
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

/// A model fitted to rows of a recording.
pub struct FittedRows {
    pub model: Model,
    pub fitted: Fitted,
    pub screening: Screening,
}

impl FittedRows {
    pub fn session<'a>(&'a self, data: &'a Measurements) -> Session<'a> {
        Session {
            data,
            rows: &self.screening.kept,
            model: &self.model,
            fitted: &self.fitted,
        }
    }
}

/// Fits, and with a split whose sets are `screened` sets aside what does not belong.
pub fn fit_rows(
    start: &Model,
    data: &Measurements,
    rows: &[usize],
    candidates: &[usize],
    screened: Option<&Split>,
) -> FittedRows {
    let set = screened.map(numbered);
    let (model, fitted, screening) = fit_screened(start, data, rows, candidates, set.as_deref());
    FittedRows {
        model,
        fitted,
        screening,
    }
}

/// The number of the set that each row belongs to.
pub fn numbered(split: &Split) -> Vec<usize> {
    let mut numbers: BTreeMap<&str, usize> = BTreeMap::new();
    let rows = split.0.iter().map(|row| {
        let next = numbers.len();
        *numbers.entry(&row.set).or_insert(next)
    });
    rows.collect()
}

/// So many cases of one kind are named; the table has all.
const CASES_NAMED: usize = 4;

/// Notes for the person: who was set aside and why, and what looks like mistakes and was kept.
pub fn note_screened(context: &Context, screening: &Screening, recording: &Recording) {
    if let Some(offset) = screening.apart {
        context.warn(format!(
            "most points belong to the joints {offset:+} rows away: the two logs are misaligned: join them again before anything else"
        ));
    }
    let id = |row: usize| recording.point_id[row].as_str();
    let all = screening.suspects.iter();
    let (events, aside): (Vec<&Suspect>, Vec<&Suspect>) = all.partition(|suspect| suspect.used());
    if !aside.is_empty() {
        let mut by_kind: BTreeMap<u8, Vec<String>> = BTreeMap::new();
        for case in cases(&aside) {
            let first = case[0];
            let who = match case.len() {
                1 => id(first.row).to_string(),
                _ => run_of(case, id),
            };
            let partner = first.partner.map_or("another row", id);
            let are = if case.len() > 1 { "are" } else { "is" };
            let (order, text) = match first.kind {
                SuspectKind::Exchanged if first.partner > Some(first.row) => {
                    (0, format!("{who} and {partner} look exchanged"))
                }
                SuspectKind::Exchanged => continue,
                SuspectKind::ShiftedBlock(offset) => (
                    1,
                    format!("{who}: points and joints are {offset:+} rows apart"),
                ),
                SuspectKind::Mislabelled => (
                    2,
                    format!("{who} lies where the joints of {partner} put it"),
                ),
                SuspectKind::UnitSlip(factor) => (3, format!("{who} {are} {}", slip(factor))),
                SuspectKind::Zero => (4, format!("{who} {are} zero")),
                SuspectKind::Outlier | SuspectKind::Event => {
                    (5, format!("{who} is {:.3} mm off", first.size * 1e3))
                }
            };
            by_kind.entry(order).or_default().push(text);
        }
        let texts = by_kind.into_values().flat_map(|mut texts| {
            let more = texts.len().saturating_sub(CASES_NAMED);
            texts.truncate(CASES_NAMED);
            texts.extend((more > 0).then(|| format!("{more} more like these (table suspects)")));
            texts
        });
        let texts: Vec<String> = texts.collect();
        let rows = counted(aside.len(), "row");
        context.warn(format!("{rows} set aside: {}", texts.join("; ")));
    }
    for run in events.chunk_by(|a, b| a.row + 1 == b.row) {
        context.warn(format!(
            "{} stand out together: something happened there that the model does not know; they are kept",
            run_of(run, id)
        ));
    }
    if screening.crowd > 0 {
        context.note(format!(
            "{} far out without evidence other than this model that they are mistakes of the recording: it lacks something there; they are kept",
            if screening.crowd == 1 { "one row stands".into() } else { format!("{} rows stand", screening.crowd) }
        ));
    }
}

/// The first and the last of some rows, and how many they are.
fn run_of<'r>(run: &[&Suspect], id: impl Fn(usize) -> &'r str) -> String {
    let (first, last) = (id(run[0].row), id(run[run.len() - 1].row));
    format!("{first} to {last} ({} rows)", run.len())
}

/// Suspects that are one thing to a person: consecutive rows with the same slip, zero or shift; all others one by one.
fn cases<'a>(suspects: &'a [&'a Suspect]) -> impl Iterator<Item = &'a [&'a Suspect]> {
    suspects.chunk_by(|a, b| {
        let together = matches!(
            a.kind,
            SuspectKind::ShiftedBlock(_) | SuspectKind::UnitSlip(_) | SuspectKind::Zero
        );
        together && a.kind == b.kind && a.row + 1 == b.row
    })
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
