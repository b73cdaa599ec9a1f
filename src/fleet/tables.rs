//! Records -> the fleet's tables and page, published as any other: equal records give equal tables.

use super::Fleet;
use super::earlier::{Earlier, with_limits};
use super::ledger::{Ending, Ledger, RobotRecord};
use crate::error::Result;
use crate::report::fleet as page;
use crate::table::{
    Changes, Findings, FleetChangeRow, FleetRow, FleetTable, Statistics, StatisticsRow, Table,
    Verdict, VerdictRow,
};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The stage's id and name in keys and paths.
const STAGE: &str = "fleet";

/// What a fleet came to.
pub(crate) struct FleetSummary {
    /// A row for each robot.
    pub(crate) fleet: FleetTable,
    /// Where people find the tables and the page.
    pub(crate) tables: Vec<PathBuf>,
    /// The page about the fleet.
    pub(crate) page: PathBuf,
    /// A warning for each text of it that its language lacks.
    pub(crate) untranslated: Vec<String>,
}

/// Makes the tables and the page from the records (in the order of the roster; none: missing) and publishes them.
pub(crate) fn publish(
    fleet: &Fleet,
    ledger: &Ledger,
    records: &[Option<RobotRecord>],
) -> Result<FleetSummary> {
    let earlier = Earlier::find(fleet, ledger)?;
    let read: Vec<Read> = records
        .par_iter()
        .map(|record| Read::of(ledger, record.as_ref()))
        .collect::<Result<_>>()?;
    let changes: Vec<(&str, &Changes)> = (fleet.roster.0.iter().zip(&read))
        .filter_map(|(robot, read)| Some((robot.name.as_str(), read.changes.as_ref()?)))
        .collect();
    let alpha = fleet
        .file
        .previous
        .as_ref()
        .map_or(1.0, |previous| previous.alpha);
    let changes = with_limits(&changes, alpha);
    let mut flagged: BTreeMap<&str, Vec<&FleetChangeRow>> = BTreeMap::new();
    for change in changes.0.iter().filter(|change| change.flagged) {
        flagged.entry(&change.robot).or_default().push(change);
    }
    let mut table = FleetTable::default();
    for ((robot, record), read) in fleet.roster.0.iter().zip(records).zip(&read) {
        let mut row = read.row(robot, record.as_ref());
        let is_done = |record: &RobotRecord| record.ending == Ending::Done;
        if let Some(earlier) = &earlier
            && record.as_ref().is_some_and(is_done)
        {
            let changed = flagged.remove(robot.name.as_str()).unwrap_or_default();
            row.changes = Some(changed.len() as i64);
            let flags = earlier.flags(ledger, &robot.name, changed, read.findings.as_ref())?;
            row.flags = (!flags.is_empty()).then(|| flags.join("; "));
        }
        table.0.push(row);
    }
    let links: BTreeMap<String, String> = (fleet.roster.0.iter().zip(records))
        .filter_map(|(robot, record)| {
            let record = record.as_ref()?;
            let document = record.documents.first()?;
            Some((
                robot.name.clone(),
                format!("../{}.{}/{document}", fleet.name(), record.handle),
            ))
        })
        .collect();
    let language = fleet.file.language;
    let made = page::html(fleet.name(), &table, &changes, &links, language)?;
    let untranslated = made.untranslated(language);
    let frames = vec![
        ("fleet", table.to_frame()?),
        ("fleet_changes", changes.to_frame()?),
    ];
    let page = ("fleet.html", made.html.as_str());
    let settings = settings(fleet, &table, records);
    let (tables, page) = ledger.publish((STAGE, 1), settings, frames, "tables.json", page)?;
    Ok(FleetSummary {
        fleet: table,
        tables,
        page,
        untranslated,
    })
}

/// What the tables were made of: the settings and the robots' own tables.
fn settings(fleet: &Fleet, table: &FleetTable, records: &[Option<RobotRecord>]) -> Value {
    let robots = fleet
        .roster
        .0
        .iter()
        .zip(&table.0)
        .zip(records)
        .map(|((robot, row), record)| {
            let tables = record
                .iter()
                .flat_map(|record| &record.tables)
                .map(|made| made.table.table_hash.to_string());
            json!([
                robot.name,
                robot.groups,
                row.status,
                row.reason,
                row.flags,
                tables.collect::<Vec<_>>()
            ])
        });
    let alpha = fleet.file.previous.as_ref().map(|previous| previous.alpha);
    json!({ "robots": robots.collect::<Vec<_>>(), "alpha": alpha, "language": fleet.file.language })
}

/// The tables of a robot that the fleet's row is made of.
#[derive(Default)]
struct Read {
    statistics: Option<Statistics>,
    verdict: Option<Verdict>,
    findings: Option<Findings>,
    changes: Option<Changes>,
}

impl Read {
    fn of(ledger: &Ledger, record: Option<&RobotRecord>) -> Result<Self> {
        let Some(record) = record else {
            return Ok(Self::default());
        };
        Ok(Self {
            statistics: ledger.load(record.last(Statistics::KIND))?,
            verdict: ledger.load(record.last(Verdict::KIND))?,
            findings: ledger.load(record.last(Findings::KIND))?,
            changes: ledger.load(record.last(Changes::KIND))?,
        })
    }

    fn row(&self, robot: &super::FleetRobot, record: Option<&RobotRecord>) -> FleetRow {
        let rows = self.statistics.as_ref().map(final_rows).unwrap_or_default();
        let (first, last) = (rows.first().copied(), rows.last().copied());
        let verdict = self.verdict.as_ref().and_then(|verdict| verdict.0.first());
        let findings = self.findings.as_ref();
        // A pipeline that does not predict with what it found still says how much better that is.
        let diagnosed = verdict.filter(|_| last.is_none());
        let either = |row: Option<&StatisticsRow>,
                      of_row: fn(&StatisticsRow) -> f64,
                      of_verdict: fn(&VerdictRow) -> Option<f64>| {
            row.map(of_row).or(diagnosed.and_then(of_verdict))
        };
        let course: Vec<String> = (rows.iter())
            .map(|row| format!("{:.4}", row.rms_mm))
            .collect();
        FleetRow {
            robot: robot.name.clone(),
            model: robot.groups.model.clone(),
            plant: robot.groups.plant.clone(),
            campaign: robot.groups.campaign.clone(),
            status: record
                .map_or("missing", |record| record.ending.name())
                .into(),
            reason: record.and_then(|record| record.reason.clone()),
            points: last.map(|row| row.points),
            held_out: last.map(|row| row.held_out),
            before_mean_mm: either(first, |row| row.mean_mm, |v| v.before_mean_mm),
            before_rms_mm: either(first, |row| row.rms_mm, |v| v.before_rms_mm),
            before_max_mm: either(first, |row| row.max_mm, |v| v.before_max_mm),
            after_mean_mm: either(last, |row| row.mean_mm, |v| v.after_mean_mm),
            after_rms_mm: either(last, |row| row.rms_mm, |v| v.after_rms_mm),
            after_max_mm: either(last, |row| row.max_mm, |v| v.after_max_mm),
            floor_mm: verdict
                .and_then(|v| v.noise_floor_mm)
                .or(last.map(|row| row.noise_rms_mm)),
            noise_basis: verdict.map_or_else(
                || last.and_then(|row| row.noise_basis.clone()),
                |v| v.noise_basis.clone(),
            ),
            course: (!course.is_empty()).then(|| course.join(" ")),
            verdict: verdict.map(|v| v.verdict.clone()),
            findings: findings.map(|findings| findings.0.len() as i64),
            causes: findings.map(causes).filter(|causes| !causes.is_empty()),
            ..FleetRow::default()
        }
    }
}

/// `effect at place`, strongest first.
fn causes(findings: &Findings) -> String {
    findings
        .0
        .iter()
        .map(|row| format!("{} at {}", row.effect, row.place))
        .collect::<Vec<_>>()
        .join("; ")
}

/// One row a step, in pipeline order: of held-out points where the last step has some, of the set with most of them.
fn final_rows(statistics: &Statistics) -> Vec<&StatisticsRow> {
    let rows = &statistics.0;
    let last = rows.iter().map(|row| row.order).max();
    let most = (rows.iter().filter(|row| Some(row.order) == last))
        .max_by_key(|row| (row.held_out, row.points));
    let Some(most) = most else { return Vec::new() };
    let is_like = |row: &&StatisticsRow| row.held_out == most.held_out && row.set == most.set;
    let of_order = |order| rows.iter().filter(is_like).find(|row| row.order == order);
    (0..=most.order).filter_map(of_order).collect()
}
