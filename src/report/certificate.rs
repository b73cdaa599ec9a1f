//! The first page: what was calibrated with what, how accurate it is, whether that is accepted, under which conditions, and what was not seen.

use crate::error::{Error, Result};
use crate::errors::{Steps, before};
use crate::findings::wrong_setup;
use crate::language::{Locale, say};
use crate::table::{AcceptanceRow, StatisticsRow, SuspectsRow, VerdictRow, VerdictTopic, inert};
use crate::units::Unit;
use crate::{Accepted, Tables};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Standard deviations of an expanded uncertainty (VIM: coverage factor): 2 is what calibration laboratories state, for some 95 %.
const COVERAGE: f64 = 2.0;

pub(super) fn certificate(
    locale: &Locale,
    tables: &Tables,
    judgement: Option<&Judgement>,
    set: Option<&str>,
) -> Value {
    let after = judged(tables, set).filter(|_| wrong_setup(tables).is_none());
    let first = after.and_then(|after| before(&tables.statistics.0, after));
    let diagnosis = tables.verdict.iter().flat_map(|table| &table.0).next_back();
    let recording = &tables.recording;
    let region = |k: usize| {
        let unit = if recording.prismatic.get(k) == Some(&true) {
            Unit::Millimetre
        } else {
            Unit::Degree
        };
        extent((0..recording.rows()).map(|row| unit.from_si(recording.q(row)[k])))
    };
    json!({
        // `better` (accepted and explained), `open` (not explained, or not asked), `refused`, `worse` (less accurate), `unknown` (no limits).
        "kind": kind(judgement, diagnosis, first.zip(after)),
        "judgement": judgement.map(|judgement| judgement.sentence(locale)),
        "judged": judgement.and_then(|judgement| judgement.row),
        "before": first,
        "after": after,
        "assumed": after.is_some_and(StatisticsRow::is_inferred),
        "expanded_mm": after.map(|row| COVERAGE * row.rms_x_mm.max(row.rms_y_mm).max(row.rms_z_mm)),
        "limits": judgement.map(|judgement| &judgement.limits),
        "temperature": extent(recording.temperature.iter().flatten().copied()),
        "payload": extent(recording.payload.iter().flatten().copied()),
        // Smallest and largest position of each joint, deg or mm.
        "region": (0..recording.joints).filter_map(region).collect::<Vec<_>>(),
        "slides": recording.prismatic.contains(&true),
        "not_observable": diagnosis.map(|row| tables.statements(&row.step, VerdictTopic::NotObservable)).unwrap_or_default(),
    })
}

/// What a certificate states: the keys of `identity` by which each is given.
const STATED: [&[&str]; 8] = [
    &["certificate number", "number", "certificate"],
    &["date", "date of measurement"],
    &["operator"],
    &["instrument", "tracker"],
    &[
        "instrument serial",
        "tracker serial",
        "serial number of the instrument",
    ],
    &["instrument calibrated", "tracker calibrated", "calibrated"],
    &["standard", "traceability"],
    &["robot serial", "serial"],
];

/// Names with what is stated; none is a line to fill in. What else `identity` has follows as given.
pub(super) fn identity(
    locale: &Locale,
    tables: &Tables,
    given: &BTreeMap<String, String>,
) -> Vec<(String, Option<String>)> {
    let names = [
        say!(locale, "certificate number"),
        say!(locale, "date of the measurement"),
        say!(locale, "operator"),
        say!(locale, "instrument"),
        say!(locale, "serial number of the instrument"),
        say!(locale, "instrument calibrated on"),
        say!(locale, "standard, traceability"),
        say!(locale, "serial number of the robot"),
    ];
    let plain = |key: &str| key.trim().to_lowercase().replace('_', " ");
    let stated = |keys: &[&str]| {
        let mut all = given.iter();
        let (_, value) = all.find(|(key, _)| keys.contains(&plain(key).as_str()))?;
        Some(value.clone())
    };
    let dated = |k: usize| if k == 1 { dates(locale, tables) } else { None };
    let fields = STATED.iter().enumerate().zip(names);
    let fields = fields.map(|((k, keys), name)| (name, stated(keys).or_else(|| dated(k))));
    let is_other = |key: &String| {
        !STATED
            .iter()
            .any(|keys| keys.contains(&plain(key).as_str()))
    };
    let others = given.iter().filter(|(key, _)| is_other(key));
    let others = others.map(|(key, value)| (key.clone(), Some(value.clone())));
    fields.chain(others).collect()
}

/// A clock that shows more than this (s, a year) counts since 1970: no recording lasts a year, and no controller was on for longer without
/// a restart of its own clock.
const EPOCH: f64 = 3e7;

/// The days of a recording whose clock counts since 1970.
fn dates(locale: &Locale, tables: &Tables) -> Option<String> {
    let [first, last] = extent(tables.recording.time.iter().flatten().copied())?;
    let day = |seconds: f64| {
        let moment = jiff::Timestamp::from_second(seconds as i64).ok()?;
        Some(moment.to_string().get(..10)?.to_string())
    };
    let [from, to] = [day(first).filter(|_| first > EPOCH)?, day(last)?];
    Some(match from == to {
        true => from,
        false => say!(locale, "{from} to {to}", from, to),
    })
}

/// Points of the certificate that are listed first, and the worst of them.
const LISTED: usize = 50;
const WORST: usize = 10;

/// A held-out point as the certificate lists it, mm.
#[derive(Serialize)]
struct HeldOutPoint<'a> {
    point_id: &'a str,
    measured: [f64; 3],
    before_mm: Option<f64>,
    error: [f64; 3],
    error_mm: f64,
    suspect: bool,
}

/// Points of the set that is judged, in the order of the recording.
fn judged_points<'a>(tables: &'a Tables, set: Option<&str>) -> Vec<HeldOutPoint<'a>> {
    let Some(judged) = judged(tables, set) else {
        return Vec::new();
    };
    let of_step = |step: &str| {
        let mut all = tables.prediction.iter();
        all.find(|table| table.0.first().is_some_and(|row| row.step == step))
    };
    let earlier = before(&tables.statistics.0, judged).and_then(|row| of_step(&row.step));
    let earlier: BTreeMap<i64, f64> = earlier
        .iter()
        .flat_map(|table| &table.0)
        .map(|row| (row.sequence, row.error_mm))
        .collect();
    let rows = of_step(&judged.step).into_iter().flat_map(|table| &table.0);
    rows.filter(|row| row.held_out && row.set == judged.set)
        .map(|row| HeldOutPoint {
            point_id: &row.point_id,
            measured: [
                row.x_mm + row.dx_mm,
                row.y_mm + row.dy_mm,
                row.z_mm + row.dz_mm,
            ],
            before_mm: earlier.get(&row.sequence).copied(),
            error: [row.dx_mm, row.dy_mm, row.dz_mm],
            error_mm: row.error_mm,
            suspect: row.suspect,
        })
        .collect()
}

/// What the certificate lists: the first points, and the worst of all where that are more.
pub(super) fn held_out(tables: &Tables, set: Option<&str>) -> Value {
    let points = judged_points(tables, set);
    let mut worst: Vec<&HeldOutPoint> = points.iter().collect();
    worst.sort_by(|a, b| b.error_mm.total_cmp(&a.error_mm));
    let diagnosed = tables.verdict.iter().flat_map(|table| &table.0).next_back();
    let diagnosed = diagnosed.map(|verdict| verdict.step.as_str());
    let standing = tables.standing.as_deref();
    let is_gone =
        |row: &&SuspectsRow| !row.used && [diagnosed, standing].contains(&Some(row.step.as_str()));
    worst.truncate(if points.len() > LISTED { WORST } else { 0 });
    json!({
        "points": points.len(),
        "listed": points.iter().take(LISTED).collect::<Vec<_>>(),
        "worst": worst,
        "suspects": tables.suspects.iter().flat_map(|table| &table.0).filter(is_gone).collect::<Vec<_>>(),
    })
}

/// All of them as text for a spreadsheet, mm.
pub(super) fn points(tables: &Tables, set: Option<&str>) -> Result<String> {
    let bug = |error: csv::Error| Error::Bug(format!("points.csv: {error}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header = "point_id,x_mm,y_mm,z_mm,error_before_mm,dx_mm,dy_mm,dz_mm,error_mm,suspect";
    writer.write_record(header.split(',')).map_err(bug)?;
    for point in judged_points(tables, set) {
        let mut record = vec![inert(point.point_id.into())];
        record.extend(point.measured.map(|mm| format!("{mm:.4}")));
        record.push(
            point
                .before_mm
                .map_or_else(String::new, |mm| format!("{mm:.4}")),
        );
        record.extend(point.error.map(|mm| format!("{mm:.4}")));
        record.extend([format!("{:.4}", point.error_mm), point.suspect.to_string()]);
        writer.write_record(record).map_err(bug)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|error| Error::Bug(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| Error::Bug(error.to_string()))
}

/// The least and the largest; none where there is no number.
fn extent(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let finite = values.filter(|value| value.is_finite());
    finite.fold(None, |ends, value| {
        let [lower, upper] = ends.unwrap_or([value; 2]);
        Some([lower.min(value), upper.max(value)])
    })
}

/// The class of its colour. Green is what is within the limits and explained; nothing else.
fn kind(
    judgement: Option<&Judgement>,
    diagnosis: Option<&VerdictRow>,
    course: Option<(&StatisticsRow, &StatisticsRow)>,
) -> &'static str {
    let is_explained = diagnosis
        .is_some_and(|row| ["explained", "nothing_missing"].contains(&row.verdict.as_str()));
    match judgement {
        Some(judged) if !judged.kept => "refused",
        _ if course.is_some_and(|(before, after)| after.mean_mm >= before.mean_mm) => "worse",
        Some(_) if is_explained => "better",
        None if is_explained => "unknown",
        _ => "open",
    }
}

#[derive(Debug)]
pub(super) struct Judgement<'a> {
    /// What is wrong with the set-up, where something is.
    wrong: Option<String>,
    row: Option<&'a StatisticsRow>,
    /// Limits as they were set; none where a wrong set-up alone is not accepted.
    pub limits: Vec<AcceptanceRow>,
    pub kept: bool,
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
    pub fn new(tables: &'a Tables, limits: &Accepted, set: Option<&str>) -> Option<Self> {
        let wrong = wrong_setup(tables);
        let row = judged(tables, set).filter(|_| wrong.is_none());
        let figures = [
            ("mean", limits.mean_mm, row.map(|row| row.mean_mm)),
            (
                "95 % of the points",
                limits.p95_mm,
                row.map(|row| row.p95_mm),
            ),
            ("largest", limits.max_mm, row.map(|row| row.max_mm)),
        ];
        let asked = figures
            .into_iter()
            .filter_map(|(figure, limit_mm, found_mm)| {
                let limit_mm = limit_mm?;
                Some(AcceptanceRow {
                    figure: figure.into(),
                    found_mm,
                    limit_mm,
                    kept: found_mm.is_some_and(|found| found <= limit_mm),
                    ..AcceptanceRow::default()
                })
            });
        let mut limits: Vec<AcceptanceRow> = asked.collect();
        if wrong.is_none() && limits.is_empty() {
            return None;
        }
        let kept = row.is_some() && limits.iter().all(|limit| limit.kept);
        let mut judgement = Self {
            wrong,
            row,
            limits: Vec::new(),
            kept,
        };
        let sentence = judgement.sentence(&Locale::default());
        for (order, limit) in (1..).zip(&mut limits) {
            limit.order = order;
            limit.accepted = kept;
            limit.sentence.clone_from(&sentence);
        }
        judgement.limits = limits;
        Some(judgement)
    }

    /// The judgement in a sentence.
    pub fn sentence(&self, locale: &Locale) -> String {
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

    /// Limits with what was found.
    pub fn found(&self) -> impl Iterator<Item = (&AcceptanceRow, f64)> {
        self.limits
            .iter()
            .filter_map(|row| Some((row, row.found_mm?)))
    }
}
