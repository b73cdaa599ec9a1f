//! The verdict: findings with their evidence, before and after on held-out rows, and what is left.

use super::finding::{Finding, findings};
use super::judge::Worth;
use super::locate::{Located, locate};
use super::noise::Repeatability;
use super::pool::Pool;
use super::statement::{next, not_observable};
use super::unseen::by_speed;
use super::{Course, Question, REPEATS, SIGNIFICANT};
use crate::effect::{Effect, Survey};
use crate::estimate::{Fitted, Model, Screening, Weight};
use crate::robot::Measurements;
use nalgebra::Vector3;

/// What the data say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Explained,
    NothingMissing,
    Unexplained,
    /// Too few rows were fitted.
    NotAsked,
}

impl Verdict {
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::NothingMissing => "nothing_missing",
            Self::Unexplained => "unexplained",
            Self::NotAsked => "not_asked",
        }
    }
}

/// Lengths of position errors, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    pub mean: f64,
    pub rms: f64,
    pub max: f64,
}

impl Errors {
    /// Of some rows; `None` of no rows.
    pub(super) fn of(data: &Measurements, predicted: &[Vector3<f64>], rows: &[usize]) -> Option<Self> {
        let lengths: Vec<f64> = rows.iter().map(|row| (data.position[*row] - predicted[*row]).norm()).collect();
        let count = lengths.len() as f64;
        (count > 0.0).then(|| Self {
            mean: lengths.iter().sum::<f64>() / count,
            rms: (lengths.iter().map(|e| e * e).sum::<f64>() / count).sqrt(),
            max: lengths.iter().copied().fold(0.0, f64::max),
        })
    }
}

/// The outcome of a diagnosis.
pub struct Diagnosis {
    pub verdict: Verdict,
    /// Length of the noise of a row, rms, m.
    pub noise_floor: f64,
    /// Of held-out rows (of the fitted ones where none are held out), suspects apart.
    pub before: Option<Errors>,
    pub after: Option<Errors>,
    /// Whether the errors are of held-out rows.
    pub held_out: bool,
    /// Strongest first.
    pub findings: Vec<Finding>,
    /// Findings that the whole model left without size or made worse, a sentence each: they are not in the model.
    pub withdrawn: Vec<String>,
    /// Whether the recording has a clock; else times in the model count rows from 0.
    pub clock: bool,
    pub screening: Screening,
    /// What these data cannot show, a sentence each.
    pub not_observable: Vec<String>,
    /// What is left looks like, where it is not noise.
    pub signature: Option<String>,
    /// What to measure next, a sentence each.
    pub next_measurements: Vec<String>,
    /// Rms length of what is left at fitted rows, m; reduced chi-square; probability that it is noise, where that was asked.
    pub leftover_rms: f64,
    pub chi_square: f64,
    pub gate_first: Option<f64>,
    pub gate_last: Option<f64>,
    pub repeatability: Repeatability,
    /// Where the residual sits before and after the findings.
    pub located_before: Located,
    pub located_after: Located,
    /// The corrected model and its fit.
    pub model: Model,
    pub fitted: Fitted,
    /// Rows that were fitted.
    pub kept: Vec<usize>,
}

/// What the last round looked at.
pub(crate) struct Looked<'a, 'b> {
    pub pool: &'b Pool<'a>,
    /// The chosen causes' positions in the pool, in their order.
    pub set: Vec<usize>,
    /// The gate's probability at the start and at the end.
    pub first: f64,
    pub last: f64,
    pub worths: Vec<Worth>,
    /// What was found and taken back, a sentence each.
    pub withdrawn: Vec<String>,
    /// Where the residual of the base model sits.
    pub located: Located,
    pub survey: &'b Survey<'a>,
}

/// With structure left, a residual this much larger than the noise is not explained; without, this much.
const LOUD: f64 = 1.25;
const TOO_LOUD: f64 = 2.5;
/// Without repeats a residual is not called noise where it is this many times the instrument's.
const NOT_NOISE: f64 = 4.0;

/// A weak unnamed finding of less than this share of the strongest one's gain is its rest.
const REST: f64 = 0.03;
/// A criterion that is worse by more than this without it makes it a finding all the same.
const WEAK: f64 = 60.0;

impl Looked<'_, '_> {
    /// What the best hypothesis beside the chosen ones would be.
    fn best(&self) -> Option<String> {
        let mut set = self.set.clone();
        set.sort_unstable();
        let state = self.pool.state(&set);
        let (_, best) = *state.falls(self.pool).first()?;
        let form = &self.pool.hypotheses[best].form;
        Some(format!("most like {} at {}", form.name(), form.place()))
    }
}

/// Draws the conclusions of the last round.
pub(crate) fn conclude(
    question: &Question,
    data: &Measurements,
    before: &[Vector3<f64>],
    last: &Course,
    repeatability: Repeatability,
    looked: Looked,
) -> Diagnosis {
    let predicted = last.model.predict(data);
    let aside: Vec<usize> = last.screening.suspects.iter().filter(|s| !s.used()).map(|s| s.row).collect();
    let judges: Vec<usize> = question.validate.iter().copied().filter(|row| !aside.contains(row)).collect();
    let held_out = !judges.is_empty();
    let rows = if held_out { &judges } else { &last.screening.kept };
    let square = |rows: &[usize], length: &dyn Fn(usize) -> f64| {
        (rows.iter().map(|row| length(*row).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
    };
    let noise_floor = square(rows, &|row| data.noise(row));
    let instrument = square(rows, &|row| data.sigma[row].norm());
    let findings = findings(last, &looked);
    // A small rest that has no name beside strong findings is what their shapes leave: no cause of its own.
    let strongest = findings.iter().filter_map(|finding| finding.evidence).map(|e| e.gain).fold(0.0, f64::max);
    let small = |finding: &Finding| {
        finding.has_no_law() && finding.evidence.is_some_and(|e| e.gain < REST * strongest && e.delta_bic < WEAK)
    };
    let (rest, findings): (Vec<Finding>, Vec<Finding>) = findings.into_iter().partition(small);
    let mut signature =
        (!rest.is_empty()).then(|| rest.iter().map(|finding| finding.statement.clone()).collect::<Vec<_>>().join(" "));
    let kept = &last.screening.kept;
    let whitened = |rows: &[usize]| -> f64 {
        rows.iter().map(|row| Weight::of(data, *row, 0.0).apply(&(data.position[*row] - predicted[*row])).norm_squared()).sum()
    };
    let freedom = (3 * kept.len()).saturating_sub(last.fitted.singular.len()).max(1) as f64;
    let chi_square = whitened(kept) / freedom;
    // Points that were not fitted also see the errors of what was.
    let inflation = 1.0 + last.fitted.singular.len() as f64 / freedom;
    let not_carried = held_out && whitened(&judges) > TOO_LOUD * inflation * 3.0 * judges.len() as f64;
    let physics: Vec<&Finding> = findings.iter().filter(|finding| finding.is_physics()).collect();
    let blind = repeatability.repeats < REPEATS && noise_floor > NOT_NOISE * instrument;
    let left = (looked.last <= SIGNIFICANT && chi_square > LOUD) || chi_square > TOO_LOUD || not_carried;
    if left && signature.is_none() {
        signature = looked.best();
    }
    if not_carried {
        let text = "held-out points are off by more than the fitted ones and the noise allow: something differs there \
                    (another time, another region) that the fitted points do not show";
        signature = Some(signature.map_or(text.into(), |signature| format!("{signature}; {text}")));
    }
    let only_unknown = !physics.is_empty() && physics.iter().all(|finding| finding.effect == "unknown");
    let verdict = if blind || left || only_unknown {
        Verdict::Unexplained
    } else if findings.is_empty() {
        Verdict::NothingMissing
    } else {
        Verdict::Explained
    };
    let next_measurements = next(&findings);
    let mut set = looked.set.clone();
    set.sort_unstable();
    let mut not_observable = not_observable(looked.survey, &looked.pool.lens.reach());
    not_observable.extend(by_speed(&looked));
    let located_after = locate(looked.pool, &looked.pool.state(&set), looked.survey);
    Diagnosis {
        verdict,
        noise_floor,
        before: Errors::of(data, before, rows),
        after: Errors::of(data, &predicted, rows),
        held_out,
        findings,
        withdrawn: looked.withdrawn,
        clock: data.has_clock(),
        screening: last.screening.clone(),
        not_observable,
        signature,
        next_measurements,
        leftover_rms: square(kept, &|row| (data.position[row] - predicted[row]).norm()),
        chi_square,
        gate_first: Some(looked.first),
        gate_last: Some(looked.last),
        repeatability,
        located_before: looked.located,
        located_after,
        model: last.model.clone(),
        fitted: last.fitted.clone(),
        kept: kept.clone(),
    }
}
