//! The first page: what was calibrated with what, how accurate it is, whether that is accepted, under which conditions, and what was not seen.
//!
//! The verdict against the user's limits: figures of the held-out points of the model that stands, each next to its limit.

use super::Tables;
use super::errors::{Steps, before};
use super::findings::wrong_setup;
use super::number::{count, fixed, mm};
use crate::table::{AcceptanceRow, StatisticsRow, VerdictRow, VerdictTopic};
use crate::units::Unit;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Standard deviations of an expanded uncertainty (VIM: coverage factor).
const COVERAGE: f64 = 2.0;

pub(super) fn certificate(
    tables: &Tables,
    robot: &str,
    identity: &BTreeMap<String, String>,
    judgement: Option<&Judgement>,
    set: Option<&str>,
) -> Value {
    let after = judged(tables, set).filter(|_| wrong_setup(tables).is_none());
    let first = after.and_then(|after| before(&tables.statistics.0, after));
    let diagnosis = tables.verdict.iter().flat_map(|table| &table.0).next_back();
    let (kind, verdict) = standing(tables, judgement, diagnosis, first.zip(after));
    let subject = [("robot".to_string(), robot.to_string())];
    let limit = |(row, found): (&AcceptanceRow, f64)| {
        json!([row.figure, mm(found), mm(row.limit_mm), row.kept])
    };
    let given = identity
        .iter()
        .map(|(name, value)| (name.clone(), value.clone()));
    json!({
        // `better` (accepted and explained), `open` (not explained, or not asked), `worse` (not accepted), `unknown`: the class of its colour.
        "kind": kind,
        "verdict": verdict,
        // What was calibrated, by whom, with what: name and value.
        "subject": subject.into_iter().chain(given).chain(files(tables)).collect::<Vec<_>>(),
        // Model, points, mean, 95 %, largest.
        "figures": first
            .map(|row| ("before", row))
            .into_iter()
            .chain(after.map(|row| ("after", row)))
            .flat_map(figures)
            .collect::<Vec<_>>(),
        // Figures that stand beside the table.
        "uncertainty": after.map(uncertainty).unwrap_or_default(),
        // Figure, found, allowed, whether it is kept.
        "limits": judgement.map(|judgement| judgement.found().map(limit).collect::<Vec<_>>()),
        "conditions": conditions(tables),
        "not_observable": diagnosis.map(|row| tables.statements(&row.step, VerdictTopic::NotObservable)).unwrap_or_default(),
    })
}

/// Colour and sentence. Green is what is within the limits and explained; nothing else.
fn standing(
    tables: &Tables,
    judgement: Option<&Judgement>,
    diagnosis: Option<&VerdictRow>,
    course: Option<(&StatisticsRow, &StatisticsRow)>,
) -> (&'static str, String) {
    if wrong_setup(tables).is_some() {
        return (
            "worse",
            judgement
                .map(|judged| judged.sentence.clone())
                .unwrap_or_default(),
        );
    }
    if let Some(judged) = judgement.filter(|judged| !judged.kept) {
        return ("worse", judged.sentence.clone());
    }
    if course.is_some_and(|(before, after)| after.mean_mm >= before.mean_mm) {
        return (
            "worse",
            "The calibration did not make the robot more accurate.".into(),
        );
    }
    let within = judgement.map(|judged| judged.sentence.trim_end_matches('.').to_string());
    let cause = match diagnosis.map(|row| row.verdict.as_str()) {
        Some("explained" | "nothing_missing") => None,
        Some("unexplained") => Some("unexplained: a part of the error has no known cause"),
        Some(_) => Some("too few points were fitted to say what the error consists of"),
        None => Some("what the error consists of was not asked"),
    };
    match (within, cause) {
        (Some(within), None) => ("better", format!("{within}. The error is explained.")),
        (Some(within), Some(cause)) => (
            "open",
            format!(
                "{}, but {cause}.",
                within.replacen("Accepted: within", "Within", 1)
            ),
        ),
        (None, None) => (
            "unknown",
            "Explained. No limits were stated, so that nothing is accepted or refused.".into(),
        ),
        (None, Some(cause)) => (
            "open",
            format!("Not judged, as no limits were stated; {cause}."),
        ),
    }
}

/// Files that were read, and their rows.
fn files(tables: &Tables) -> Option<(String, String)> {
    let files: Vec<String> = tables
        .intake
        .iter()
        .flat_map(|table| &table.0)
        .map(|row| {
            format!(
                "{} ({} of {} rows used)",
                row.file,
                count(row.accepted),
                count(row.read)
            )
        })
        .collect();
    (!files.is_empty()).then(|| ("recording".to_string(), files.join("; ")))
}

/// A row with all points, and one without suspects where there are any.
fn figures((when, row): (&str, &StatisticsRow)) -> Vec<[String; 5]> {
    let none = || "\u{2013}".to_string();
    let name = format!("{when} ({})", row.step);
    let mut rows = vec![[
        name,
        count(row.points),
        mm(row.mean_mm),
        mm(row.p95_mm),
        mm(row.max_mm),
    ]];
    if let Some(mean) = row.mean_without_mm {
        let name = format!(
            "{when}, without {}",
            if row.suspects == 1 {
                "a suspect".into()
            } else {
                format!("{} suspects", row.suspects)
            }
        );
        rows.push([
            name,
            count(row.points - row.suspects),
            mm(mean),
            none(),
            row.max_without_mm.map_or_else(none, mm),
        ]);
    }
    rows
}

fn uncertainty(after: &StatisticsRow) -> Vec<(&'static str, String)> {
    let axis = after.rms_x_mm.max(after.rms_y_mm).max(after.rms_z_mm);
    let basis = match after.noise_basis.as_deref() {
        _ if after.is_inferred() => " (assumed: none is recorded, no instrument is stated)".into(),
        Some(basis) => format!(" (by {basis})"),
        None => String::new(),
    };
    vec![
        (
            "expanded uncertainty of the corrected robot in the measured region, along an axis (k = 2, from the held-out points)",
            format!("\u{b1}\u{a0}{}\u{a0}mm", mm(COVERAGE * axis)),
        ),
        (
            "standard uncertainty of a measured point, rms length",
            format!("{} mm{basis}", mm(after.noise_rms_mm)),
        ),
    ]
}

/// Temperature, payload and region, as recorded.
fn conditions(tables: &Tables) -> Vec<(&'static str, String)> {
    let recording = &tables.recording;
    let range = |values: &Option<Vec<f64>>, unit: &str, decimals: usize| {
        let finite = values
            .iter()
            .flatten()
            .copied()
            .filter(|value| value.is_finite());
        let (lower, upper) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
            (a.min(x), b.max(x))
        });
        match (lower <= upper, lower == upper) {
            (false, _) => "not recorded".into(),
            (_, true) => format!("{} {unit}", fixed(lower, decimals)),
            _ => format!(
                "{} to {} {unit}",
                fixed(lower, decimals),
                fixed(upper, decimals)
            ),
        }
    };
    let joint = |k: usize| {
        let values = (0..recording.rows()).map(|row| recording.q(row)[k]);
        let (lower, upper) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| {
            (a.min(q), b.max(q))
        });
        let unit = if recording.prismatic.get(k).copied().unwrap_or(false) {
            Unit::Millimetre
        } else {
            Unit::Degree
        };
        format!(
            "J{} {} to {}",
            k + 1,
            fixed(unit.from_si(lower), 0),
            fixed(unit.from_si(upper), 0)
        )
    };
    let region: Vec<String> = if recording.rows() == 0 {
        Vec::new()
    } else {
        (0..recording.joints).map(joint).collect()
    };
    let sliding = recording.prismatic.iter().any(|prismatic| *prismatic);
    let region = if region.is_empty() {
        "no point was measured".into()
    } else {
        format!(
            "{} {}",
            region.join(", "),
            if sliding { "deg, mm" } else { "deg" }
        )
    };
    vec![
        ("temperature", range(&recording.temperature, "\u{b0}C", 1)),
        ("payload", range(&recording.payload, "kg", 1)),
        ("region, by joints", region),
        ("measured points", count(recording.rows() as i64)),
    ]
}

/// What the user accepts, mm; of held-out points of the diagnosed model, without a diagnosis after the last step.
#[derive(Debug, Clone, Copy, Default)]
pub struct AcceptanceLimits {
    /// Largest mean error of the held-out points.
    pub(crate) mean_mm: Option<f64>,
    /// Largest 95th percentile of the errors of the held-out points.
    pub(crate) p95_mm: Option<f64>,
    /// Largest error of any held-out point.
    pub(crate) max_mm: Option<f64>,
}

#[derive(Debug)]
pub(super) struct Judgement {
    pub(crate) sentence: String,
    /// Limits as they were set; none where a wrong set-up alone is not accepted.
    pub(crate) limits: Vec<AcceptanceRow>,
    pub(crate) kept: bool,
}

/// The row that is judged: of `set`, else of the held-out set with most points, after the step that stands.
pub(super) fn judged<'a>(tables: &'a Tables, set: Option<&str>) -> Option<&'a StatisticsRow> {
    let standing = Steps::new(&tables.statistics, tables.standing.as_deref()).standing()?;
    let rows = tables
        .statistics
        .0
        .iter()
        .filter(|row| row.held_out && row.order == standing);
    let rows = rows.filter(|row| set.is_none_or(|set| row.set == set));
    rows.max_by_key(|row| row.points)
}

impl Judgement {
    /// None where there are no limits and the set-up is right.
    pub fn new(tables: &Tables, limits: &AcceptanceLimits, set: Option<&str>) -> Option<Self> {
        let figures = [
            ("mean", limits.mean_mm),
            ("95 % of the points", limits.p95_mm),
            ("largest", limits.max_mm),
        ];
        let wrong = wrong_setup(tables);
        if wrong.is_none() && figures.iter().all(|(_, limit)| limit.is_none()) {
            return None;
        }
        let row = judged(tables, set).filter(|_| wrong.is_none());
        let found = row.map_or([None; 3], |row| {
            [row.mean_mm, row.p95_mm, row.max_mm].map(Some)
        });
        let asked = figures
            .into_iter()
            .zip(found)
            .filter_map(|((name, limit), found)| Some((name, found, limit?)));
        let asked: Vec<(&str, Option<f64>, f64)> = asked.collect();
        let is_within = |found: Option<f64>, limit: f64| found.is_some_and(|found| found <= limit);
        let kept = row.is_some()
            && asked
                .iter()
                .all(|(_, found, limit)| is_within(*found, *limit));
        let sentence = match (wrong, row) {
            (Some(wrong), _) => format!("Not accepted: {wrong}."),
            (None, None) => "The limits cannot be judged: no points were held out.".into(),
            (None, Some(row)) => format!(
                "{} the limits at {} held-out points of set {}, step {}.",
                if kept {
                    "Accepted: within"
                } else {
                    "Not accepted: beyond"
                },
                row.points,
                row.set,
                row.step
            ),
        };
        let limit =
            |(order, (name, found_mm, limit_mm)): (i64, (&str, Option<f64>, f64))| AcceptanceRow {
                order,
                figure: name.into(),
                found_mm,
                limit_mm,
                kept: is_within(found_mm, limit_mm),
                accepted: kept,
                sentence: sentence.clone(),
            };
        let limits = (1..).zip(asked).map(limit).collect();
        Some(Self {
            sentence,
            limits,
            kept,
        })
    }

    /// Limits with what was found.
    pub(crate) fn found(&self) -> impl Iterator<Item = (&AcceptanceRow, f64)> {
        self.limits
            .iter()
            .filter_map(|row| Some((row, row.found_mm?)))
    }
}
