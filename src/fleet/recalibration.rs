//! One campaign after another: limits for changes over all robots and parameters, and why a person should look at a robot.

use super::Fleet;
use super::ledger::{Ledger, Member, RobotRecord, RunNote};
use crate::error::{Error, Result};
use crate::statistics::normal_quantile;
use crate::table::{Changes, Findings, FleetChangeRow, FleetChanges, Table};

/// Changes of all robots with their control limits: alpha, the chance of a false alarm in the whole fleet, shared by every robot and parameter
/// that was tested (Bonferroni).
pub(super) fn with_limits(robots: &[(&str, &Changes)], alpha: f64) -> FleetChanges {
    let tests: usize = robots.iter().map(|(_, changes)| changes.0.len()).sum();
    let each = alpha / tests.max(1) as f64;
    // A normal variable is farther from its mean, either way, with this chance.
    let width = normal_quantile(0.5 * each);
    let mut table = FleetChanges::default();
    for (robot, changes) in robots {
        for row in &changes.0 {
            table.0.push(FleetChangeRow {
                robot: (*robot).into(),
                parameter: row.name.clone(),
                effect: row.effect.clone(),
                place: row.place.clone(),
                unit: row.unit.clone(),
                previous: row.previous,
                change: row.change,
                sigma: row.sigma,
                p_value: row.p_value,
                limit: width * row.sigma,
                rank: row.rank,
                flagged: row.rank.is_some() && row.p_value < each,
            });
        }
    }
    table
        .0
        .sort_by(|a, b| (&a.robot, &a.parameter).cmp(&(&b.robot, &b.parameter)));
    table
}

/// The latest run of an earlier fleet in the same store.
pub(super) struct Earlier {
    fleet: String,
    note: RunNote,
}

impl Earlier {
    /// The latest run of the fleet that the file names as `previous`, if it names one; fails where that fleet has none.
    pub(crate) fn find(fleet: &Fleet, ledger: &Ledger) -> Result<Option<Self>> {
        fleet
            .file
            .previous
            .as_ref()
            .map(|previous| Self::named(&previous.fleet, "previous.fleet", ledger))
            .transpose()
    }

    pub(crate) fn named(name: &str, place: &str, ledger: &Ledger) -> Result<Self> {
        let missing = || {
            Error::spec(
                place,
                format!(
                    "no fleet `{name}` was run in store {}",
                    ledger.store.root().display()
                ),
            )
        };
        let note = Ledger::new(ledger.store, name)
            .closed()?
            .ok_or_else(missing)?;
        Ok(Self {
            fleet: name.into(),
            note,
        })
    }

    pub(crate) fn members(&self) -> &[Member] {
        &self.note.robots
    }

    /// The record of a robot, where it has one there.
    pub(crate) fn record(&self, ledger: &Ledger, robot: &str) -> Result<Option<RobotRecord>> {
        let member = self.note.robots.iter().find(|member| member.name == robot);
        let Some(key) = member.and_then(|member| member.key.as_deref()) else {
            return Ok(None);
        };
        Ledger::new(ledger.store, &self.fleet).find(key)
    }

    /// Why a person should look at a robot: `changed` beyond their limits, and another diagnosis than before.
    pub(crate) fn flags(
        &self,
        ledger: &Ledger,
        robot: &str,
        mut changed: Vec<&FleetChangeRow>,
        findings: Option<&Findings>,
    ) -> Result<Vec<String>> {
        let Some(record) = self.record(ledger, robot)? else {
            return Ok(vec!["not in the campaign before".into()]);
        };
        let member = self.note.robots.iter().find(|member| member.name == robot);
        let since = member
            .and_then(|member| member.groups.campaign.as_deref())
            .unwrap_or(&self.fleet);
        changed.sort_by_key(|row| row.rank);
        let mut flags: Vec<String> = changed
            .into_iter()
            .map(|row| sentence(row, since))
            .collect();
        if let (Some(now), Some(before)) = (
            findings,
            ledger.load::<Findings>(record.last(Findings::KIND))?,
        ) {
            flags.extend(diagnosed(&causes(&before), &causes(now), since));
        }
        Ok(flags)
    }
}

/// Single wrong points are the recording's, not the robot's.
const OUTLIER: &str = "outlier";

/// `backlash joint 2`, strongest first.
fn causes(findings: &Findings) -> Vec<String> {
    let physical = findings.0.iter().filter(|row| row.effect != OUTLIER);
    physical
        .map(|row| format!("{} {}", row.effect, row.place))
        .collect()
}

/// `backlash joint 2 since 2026-04-01: diagnosed, it was not before`, for every cause that only one of two diagnoses names.
fn diagnosed(before: &[String], now: &[String], since: &str) -> Vec<String> {
    let come = now.iter().filter(|cause| !before.contains(cause));
    let gone = before.iter().filter(|cause| !now.contains(cause));
    let mut flags: Vec<String> = come
        .map(|cause| format!("{cause} since {since}: diagnosed, it was not before"))
        .collect();
    flags.extend(
        gone.map(|cause| format!("{cause} since {since}: diagnosed before, it is not now")),
    );
    flags
}

/// `zero_shift joint 3 since 2026-04-01: +0.021 +- 0.002 deg`.
fn sentence(row: &FleetChangeRow, since: &str) -> String {
    let (factor, unit) = if row.unit == "rad" {
        (180.0 / std::f64::consts::PI, "deg")
    } else {
        (1.0, row.unit.as_str())
    };
    format!(
        "{} {} since {since}: {} {unit} {} ({:.1} sigma)",
        row.effect,
        row.place,
        figure(row.change * factor, row.sigma * factor),
        row.parameter,
        (row.change / row.sigma).abs()
    )
}

/// A value with two digits of its uncertainty.
fn figure(value: f64, sigma: f64) -> String {
    let digits = (1.0 - sigma.abs().log10().floor()).clamp(0.0, 12.0);
    let digits = if digits.is_finite() {
        digits as usize
    } else {
        6
    };
    if digits > 6 {
        return format!("{value:+.3e} +- {sigma:.1e}");
    }
    format!("{value:+.digits$} +- {sigma:.digits$}")
}
