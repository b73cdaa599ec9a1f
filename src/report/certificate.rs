//! The first page: what was calibrated with what, how accurate it is, whether that is accepted, under which conditions, and what was not seen.
//!
//! The verdict against the user's limits: figures of the held-out points of the model that stands, each next to its limit.

use super::Tables;
use super::errors::{Steps, before};
use super::findings::{noise_basis, wrong_setup};
use super::language::{Locale, say};
use super::number::count;
use crate::table::{AcceptanceRow, IntakeRow, StatisticsRow, VerdictRow, VerdictTopic};
use crate::units::Unit;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Standard deviations of an expanded uncertainty (VIM: coverage factor).
const COVERAGE: f64 = 2.0;

pub(super) fn certificate(
    locale: &Locale,
    tables: &Tables,
    robot: &str,
    identity: &BTreeMap<String, String>,
    judgement: Option<&Judgement>,
    set: Option<&str>,
) -> Value {
    let after = judged(tables, set).filter(|_| wrong_setup(tables).is_none());
    let first = after.and_then(|after| before(&tables.statistics.0, after));
    let diagnosis = tables.verdict.iter().flat_map(|table| &table.0).next_back();
    let (kind, verdict) = standing(locale, judgement, diagnosis, first.zip(after));
    let subject = [(say!(locale, "robot"), robot.to_string(), true)];
    let limit = |(row, found): (&AcceptanceRow, f64)| {
        json!([
            locale.stored(&row.figure),
            locale.mm(found),
            locale.mm(row.limit_mm),
            row.kept
        ])
    };
    let given = identity
        .iter()
        .map(|(name, value)| (name.clone(), value.clone(), true));
    json!({
        // `better` (accepted and explained), `open` (not explained, or not asked), `worse` (not accepted), `unknown`: the class of its colour.
        "kind": kind,
        "verdict": verdict,
        // What was calibrated, by whom, with what: name, value, and whether that is a name which no language changes.
        "subject": subject.into_iter().chain(given).chain(files(locale, tables)).collect::<Vec<_>>(),
        // Model, points, mean, 95 %, largest.
        "figures": first
            .map(|row| figures(locale, false, row))
            .into_iter()
            .chain(after.map(|row| figures(locale, true, row)))
            .flatten()
            .collect::<Vec<_>>(),
        // Figures that stand beside the table.
        "uncertainty": after.map(|after| uncertainty(locale, after)).unwrap_or_default(),
        // Figure, found, allowed, whether it is kept.
        "limits": judgement.map(|judgement| judgement.found().map(limit).collect::<Vec<_>>()),
        "conditions": conditions(locale, tables),
        "not_observable": diagnosis.map(|row| tables.statements(&row.step, VerdictTopic::NotObservable)).unwrap_or_default(),
    })
}

/// Colour and sentence. Green is what is within the limits and explained; nothing else.
fn standing(
    locale: &Locale,
    judgement: Option<&Judgement>,
    diagnosis: Option<&VerdictRow>,
    course: Option<(&StatisticsRow, &StatisticsRow)>,
) -> (&'static str, String) {
    if let Some(refused) = judgement.filter(|judged| !judged.kept) {
        return ("worse", refused.sentence(locale));
    }
    if course.is_some_and(|(before, after)| after.mean_mm >= before.mean_mm) {
        return (
            "worse",
            say!(
                locale,
                "The calibration did not make the robot more accurate."
            ),
        );
    }
    let cause = match diagnosis.map(|row| row.verdict.as_str()) {
        Some("explained" | "nothing_missing") => None,
        Some("unexplained") => Some(say!(
            locale,
            "unexplained: a part of the error has no known cause"
        )),
        Some(_) => Some(say!(
            locale,
            "too few points were fitted to say what the error consists of"
        )),
        None => Some(say!(locale, "what the error consists of was not asked")),
    };
    match (judgement, cause) {
        (Some(within), None) => (
            "better",
            within.sentence(locale) + " " + &say!(locale, "The error is explained."),
        ),
        (Some(within), Some(cause)) => ("open", within.but(locale, &cause)),
        (None, None) => (
            "unknown",
            say!(
                locale,
                "Explained. No limits were stated, so that nothing is accepted or refused."
            ),
        ),
        (None, Some(cause)) => (
            "open",
            say!(
                locale,
                "Not judged, as no limits were stated; {cause}.",
                cause
            ),
        ),
    }
}

/// Files that were read, and their rows.
fn files(locale: &Locale, tables: &Tables) -> Option<(String, String, bool)> {
    let rows = tables.intake.iter().flat_map(|table| &table.0);
    let file = |row: &IntakeRow| {
        let (used, read) = (count(row.accepted), count(row.read));
        say!(
            locale,
            "{file} ({used} of {read} rows used)",
            file = row.file,
            used,
            read
        )
    };
    let files: Vec<String> = rows.map(file).collect();
    (!files.is_empty()).then(|| (say!(locale, "recording"), files.join("; "), false))
}

/// A row with all points, and one without suspects where there are any.
fn figures(locale: &Locale, is_after: bool, row: &StatisticsRow) -> Vec<[String; 5]> {
    let none = || "\u{2013}".to_string();
    let (step, suspects) = (&row.step, row.suspects);
    let [name, without] = match (is_after, suspects) {
        (false, 1) => [
            say!(locale, "before ({step})", step),
            say!(locale, "before, without a suspect"),
        ],
        (true, 1) => [
            say!(locale, "after ({step})", step),
            say!(locale, "after, without a suspect"),
        ],
        (false, _) => [
            say!(locale, "before ({step})", step),
            say!(locale, "before, without {suspects} suspects", suspects),
        ],
        (true, _) => [
            say!(locale, "after ({step})", step),
            say!(locale, "after, without {suspects} suspects", suspects),
        ],
    };
    let mm = |length| locale.mm(length);
    let mut rows = vec![[
        name,
        count(row.points),
        mm(row.mean_mm),
        mm(row.p95_mm),
        mm(row.max_mm),
    ]];
    if let Some(mean) = row.mean_without_mm {
        rows.push([
            without,
            count(row.points - suspects),
            mm(mean),
            none(),
            row.max_without_mm.map_or_else(none, mm),
        ]);
    }
    rows
}

fn uncertainty(locale: &Locale, after: &StatisticsRow) -> Vec<(String, String)> {
    let axis = after.rms_x_mm.max(after.rms_y_mm).max(after.rms_z_mm);
    let noise = say!(locale, "{value} mm", value = locale.mm(after.noise_rms_mm));
    let expanded = locale.mm(COVERAGE * axis);
    vec![
        (
            say!(
                locale,
                "expanded uncertainty of the corrected robot in the measured region, along an axis (k = 2, from the held-out points)"
            ),
            format!("\u{b1}\u{a0}{expanded}\u{a0}mm"),
        ),
        (
            say!(
                locale,
                "standard uncertainty of a measured point, rms length"
            ),
            noise_basis(
                locale,
                noise,
                after.noise_basis.as_deref(),
                after.is_inferred(),
            ),
        ),
    ]
}

/// Temperature, payload and region, as recorded.
fn conditions(locale: &Locale, tables: &Tables) -> Vec<(String, String)> {
    let recording = &tables.recording;
    let extent = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| {
            (a.min(value), b.max(value))
        })
    };
    let range = |values: &Option<Vec<f64>>, unit: &str| {
        let mut finite = values
            .iter()
            .flatten()
            .copied()
            .filter(|value| value.is_finite());
        let (lower, upper) = extent(&mut finite);
        let [from, to] = [lower, upper].map(|value| locale.fixed(value, 1));
        match (lower <= upper, lower == upper) {
            (false, _) => say!(locale, "not recorded"),
            (_, true) => format!("{from} {unit}"),
            _ => say!(locale, "{from} to {to} {unit}", from, to, unit),
        }
    };
    let joint = |k: usize| {
        let (lower, upper) = extent(&mut (0..recording.rows()).map(|row| recording.q(row)[k]));
        let unit = if recording.prismatic.get(k).copied().unwrap_or(false) {
            Unit::Millimetre
        } else {
            Unit::Degree
        };
        let [from, to] = [lower, upper].map(|value| locale.fixed(unit.from_si(value), 0));
        say!(locale, "J{joint} {from} to {to}", joint = k + 1, from, to)
    };
    let joints = recording.joints.min(recording.rows() * recording.joints);
    let region: Vec<String> = (0..joints).map(joint).collect();
    let joined = region.join(", ");
    let region = match recording.prismatic.contains(&true) {
        _ if region.is_empty() => say!(locale, "no point was measured"),
        true => say!(locale, "{region} deg, mm", region = joined),
        false => say!(locale, "{region} deg", region = joined),
    };
    vec![
        (
            say!(locale, "temperature"),
            range(&recording.temperature, "\u{b0}C"),
        ),
        (say!(locale, "payload"), range(&recording.payload, "kg")),
        (say!(locale, "region, by joints"), region),
        (
            say!(locale, "measured points"),
            count(recording.rows() as i64),
        ),
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
pub(super) struct Judgement<'a> {
    /// What is wrong with the set-up, where something is.
    wrong: Option<String>,
    /// What is judged.
    row: Option<&'a StatisticsRow>,
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

impl<'a> Judgement<'a> {
    /// None where there are no limits and the set-up is right.
    pub fn new(tables: &'a Tables, limits: &AcceptanceLimits, set: Option<&str>) -> Option<Self> {
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
        let judgement = Self {
            wrong,
            row,
            limits: Vec::new(),
            kept,
        };
        let limit =
            |(order, (name, found_mm, limit_mm)): (i64, (&str, Option<f64>, f64))| AcceptanceRow {
                order,
                figure: name.into(),
                found_mm,
                limit_mm,
                kept: is_within(found_mm, limit_mm),
                accepted: kept,
                sentence: judgement.sentence(&Locale::default()),
            };
        let limits = (1..).zip(asked).map(limit).collect();
        Some(Self {
            limits,
            ..judgement
        })
    }

    /// The judgement in a sentence.
    pub(crate) fn sentence(&self, locale: &Locale) -> String {
        let Some(row) = self.row else {
            return match &self.wrong {
                Some(wrong) => say!(
                    locale,
                    "Not accepted: {wrong}.",
                    wrong = locale.stored(wrong)
                ),
                None => say!(
                    locale,
                    "The limits cannot be judged: no points were held out."
                ),
            };
        };
        let (points, set, step) = (row.points, &row.set, &row.step);
        match self.kept {
            true => say!(
                locale,
                "Accepted: within the limits at {points} held-out points of set {set}, step {step}.",
                points,
                set,
                step
            ),
            false => say!(
                locale,
                "Not accepted: beyond the limits at {points} held-out points of set {set}, step {step}.",
                points,
                set,
                step
            ),
        }
    }

    /// The same of limits that are kept where the error is not explained.
    fn but(&self, locale: &Locale, cause: &str) -> String {
        let (points, set, step) = self
            .row
            .map_or((0, "", ""), |row| (row.points, &row.set, &row.step));
        say!(
            locale,
            "Within the limits at {points} held-out points of set {set}, step {step}, but {cause}.",
            points,
            set,
            step,
            cause
        )
    }

    /// Limits with what was found.
    pub(crate) fn found(&self) -> impl Iterator<Item = (&AcceptanceRow, f64)> {
        self.limits
            .iter()
            .filter_map(|row| Some((row, row.found_mm?)))
    }
}
