//! One campaign after another: limits for changes over all robots and parameters, and why a person should look at a robot.
//!
//! Random effects by moments (DerSimonian and Laird, 1986): values x_i with errors s_i scatter by tau about a mean. A robot's own
//! value is left out of the prior that it gets, so that nothing is counted twice.

use super::Fleet;
use super::cause_answers::{Population, has, population};
use super::causes::noted;
use super::file::{Groups, PriorBy, PriorFrom};
use super::ledger::{Ending, Ledger, Member, RobotRecord, RunNote};
use crate::error::{Error, Result};
use crate::statistics::normal_quantile;
use crate::table::{
    Changes, Findings, FleetCellRow, FleetCells, FleetChangeRow, FleetChanges, FleetFindingRow,
    FleetFindings, Parameters, Table,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;

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

/// Mean and standard deviation, in the unit of the table `parameters`.
type PooledPrior = (f64, f64);

/// Robots that a pool needs beside the one that it serves.
const FEWEST: usize = 3;
/// A prior is never tighter than this share of the mean error of its members: figures are given with so many digits.
const TIGHTEST: f64 = 0.05;

impl Fleet {
    /// Sets for every robot what `previous` and `prior` of the file ask for. Fails where the earlier fleet is not in the store.
    pub(super) fn look_back(&mut self, ledger: &Ledger) -> Result<()> {
        if let Some(previous) = self.file.previous.clone() {
            let earlier = Earlier::named(&previous.fleet, "previous.fleet", ledger)?;
            for robot in &mut self.roster.0 {
                let record = earlier
                    .record(ledger, &robot.name)?
                    .filter(|record| record.ending == Ending::Done);
                let Some(record) = record else { continue };
                if let (Some(parameters), Some(recording)) =
                    (record.last("parameters"), record.last("recording"))
                {
                    for (kind, table) in [("parameters", parameters), ("recording", recording)] {
                        let path = ledger.store.object(table)?;
                        let target = format!("{}.previous_{kind}", previous.stage);
                        robot.set_text(&target, &path.to_string_lossy());
                    }
                }
            }
        }
        if let Some(wanted) = self.file.prior.clone() {
            if wanted.by == PriorBy::Causes {
                return self.expect_causes(&wanted, ledger);
            }
            let earlier = Earlier::named(&wanted.fleet, "prior.fleet", ledger)?;
            let known = EarlierChanges::read(&earlier, &wanted, ledger)?;
            for robot in &mut self.roster.0 {
                let priors = match wanted.by {
                    PriorBy::Robot => known.of_robot(&robot.name),
                    PriorBy::Model | PriorBy::Causes => known.pooled(&robot.name, &robot.groups),
                };
                if !priors.is_empty() {
                    let entry =
                        |(name, (mean, sigma))| (name, json!({ "mean": mean, "sigma": sigma }));
                    let priors = Value::Object(priors.into_iter().map(entry).collect());
                    robot.set_values(&BTreeMap::from([(
                        format!("{}.prior", wanted.stage),
                        priors,
                    )]));
                }
            }
        }
        Ok(())
    }

    /// Sets for every robot what the diagnosis of an earlier fleet says of the causes of its model; its own sizes are left out.
    fn expect_causes(&mut self, wanted: &PriorFrom, ledger: &Ledger) -> Result<()> {
        let earlier = Ledger::new(ledger.store, &wanted.fleet);
        let findings = noted::<FleetFindings>(&earlier, "fleet_findings")?;
        let cells = noted::<FleetCells>(&earlier, "fleet_cells")?;
        let (findings, cells) = findings.zip(cells).ok_or_else(|| {
            let message = format!(
                "no fleet `{}` was diagnosed in store {}: calib fleet diagnose",
                wanted.fleet,
                ledger.store.root().display()
            );
            Error::spec("prior.fleet", message)
        })?;
        if let Some(row) = findings.0.iter().find(|row| row.unit != "mm") {
            let message = format!(
                "fleet `{}` was diagnosed by torques (sizes in {}); allowed: a fleet that was diagnosed by positions",
                wanted.fleet, row.unit
            );
            return Err(Error::spec("prior.fleet", message));
        }
        let mut causes: Vec<(&FleetFindingRow, Vec<FleetCellRow>)> = Vec::new();
        for row in findings.0.iter().filter(|row| row.robot.is_empty()) {
            let of_row = |cell: &&FleetCellRow| cell.cell == row.cell && cell.group == row.group;
            causes.push((row, cells.0.iter().filter(of_row).cloned().collect()));
        }
        for robot in &mut self.roster.0 {
            let model = robot.groups.model.clone().unwrap_or_default();
            let of_model = causes.iter().filter(|(row, _)| row.group == model);
            let prior = |(row, sizes): &(&FleetFindingRow, Vec<FleetCellRow>)| {
                expected(row, sizes, &robot.name)
            };
            let priors: Vec<Value> = of_model.map(prior).collect();
            let target = format!("{}.prior", wanted.stage);
            robot.set_values(&BTreeMap::from([(target, Value::Array(priors))]));
        }
        Ok(())
    }
}

/// What a cause of the model lets expect of a robot, by the sizes of the others.
fn expected(row: &FleetFindingRow, sizes: &[FleetCellRow], robot: &str) -> Value {
    let (mut having, mut all) = (row.robots, row.of_robots);
    let (mut size_mm, mut spread_mm) = (row.size, row.spread.unwrap_or(0.0));
    let mut others = sizes.to_vec();
    others.retain(|other| other.robot != robot);
    if others.len() < sizes.len() {
        Population {
            usual: size_mm,
            spread: spread_mm,
        } = population(&mut others);
        having = others.iter().filter(|other| has(other)).count() as i64;
        all -= 1;
    }
    // A robot has it if its siblings do and if it is that cause.
    let share = row.probability * having as f64 / all.max(1) as f64;
    json!({ "cell": row.cell, "share": share, "size_mm": size_mm.max(1e-3), "spread_mm": spread_mm })
}

/// Changes from nominal that the earlier fleet estimated.
struct EarlierChanges {
    robots: BTreeMap<String, (Groups, BTreeMap<String, PooledPrior>)>,
}

impl EarlierChanges {
    fn read(earlier: &Earlier, wanted: &PriorFrom, ledger: &Ledger) -> Result<Self> {
        let mut robots = BTreeMap::new();
        for member in earlier.members() {
            let record = earlier.record(ledger, &member.name)?;
            let table = record
                .as_ref()
                .and_then(|record| record.of_stage(&wanted.stage, Parameters::KIND));
            let Some(table) = ledger.load::<Parameters>(table)? else {
                continue;
            };
            let estimated = table
                .0
                .into_iter()
                .filter(|row| row.status == "free" && wanted.effects.contains(&row.effect));
            let values = estimated.filter_map(|row| {
                Some((
                    row.name,
                    (row.change, row.sigma.filter(|sigma| *sigma > 0.0)?),
                ))
            });
            robots.insert(
                member.name.clone(),
                (member.groups.clone(), values.collect()),
            );
        }
        Ok(Self { robots })
    }

    fn of_robot(&self, robot: &str) -> BTreeMap<String, PooledPrior> {
        self.robots
            .get(robot)
            .map(|(_, values)| values.clone())
            .unwrap_or_default()
    }

    fn pooled(&self, robot: &str, groups: &Groups) -> BTreeMap<String, PooledPrior> {
        let kin = self
            .robots
            .iter()
            .filter(|(name, (other, _))| *name != robot && other.model == groups.model);
        let mut values: BTreeMap<&str, Vec<PooledPrior>> = BTreeMap::new();
        for (name, value) in kin.flat_map(|(_, (_, values))| values) {
            values.entry(name).or_default().push(*value);
        }
        values
            .into_iter()
            .filter_map(|(name, values)| Some((name.to_string(), pool(&values)?)))
            .collect()
    }
}

/// Mean and spread to expect of one robot more.
fn pool(values: &[PooledPrior]) -> Option<PooledPrior> {
    if values.len() < FEWEST {
        return None;
    }
    let sum = |f: &dyn Fn(f64, f64) -> f64| values.iter().map(|(x, s)| f(*x, *s)).sum::<f64>();
    let weight = sum(&|_, s| 1.0 / (s * s));
    let mean = sum(&|x, s| x / (s * s)) / weight;
    let scatter = sum(&|x, s| ((x - mean) / s).powi(2));
    let room = weight - sum(&|_, s| s.powi(-4)) / weight;
    let between = ((scatter - (values.len() - 1) as f64) / room).max(0.0);
    let weight = sum(&|_, s| 1.0 / (s * s + between));
    let mean = sum(&|x, s| x / (s * s + between)) / weight;
    let tightest = TIGHTEST * sum(&|_, s| s) / values.len() as f64;
    let sigma = (between + 1.0 / weight).sqrt().max(tightest);
    (mean.is_finite() && sigma > 0.0).then_some((mean, sigma))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_own_size_of_a_robot_is_no_part_of_what_is_expected_of_it() {
        let row = |name: &str, size_mm: f64| FleetCellRow {
            cell: "backlash@joint 2".into(),
            robot: name.into(),
            group: "m".into(),
            effect: "backlash".into(),
            place: "joint 2".into(),
            log_evidence: if size_mm > 0.0 { 9.0 } else { -2.0 },
            probability: f64::from(size_mm > 0.0),
            size: size_mm,
            sigma: 0.002,
            log_ratio: 0.5 * (size_mm / 0.002f64).powi(2),
            unit: "mm".into(),
            ..FleetCellRow::default()
        };
        let sizes = [
            row("a", 0.04),
            row("b", 0.04),
            row("c", 0.06),
            row("d", 0.06),
            row("e", 0.06),
            row("f", 0.0),
        ];
        let finding = FleetFindingRow {
            group: "m".into(),
            cell: "backlash@joint 2".into(),
            effect: "backlash".into(),
            place: "joint 2".into(),
            follows: "approach".into(),
            robots: 5,
            of_robots: 6,
            log_odds: 30.0,
            probability: 1.0,
            size: 0.06,
            spread: Some(0.01),
            unit: "mm".into(),
            decided: Some(true),
            ..FleetFindingRow::default()
        };
        let of_robot = |robot: &str| {
            let prior = expected(&finding, &sizes, robot);
            (prior["share"].as_f64(), prior["size_mm"].as_f64())
        };
        // By hand: five of six have it; a median of 0.06, 0.06, 0.06, 0.04, 0.04.
        assert_eq!(of_robot("new"), (Some(5.0 / 6.0), Some(0.06)));
        assert_eq!(of_robot("f"), (Some(1.0), Some(0.06)));
        assert_eq!(of_robot("a"), (Some(0.8), Some(0.06)));
        // Of the two that remain of c, d, e with a and b either is a median.
        let (share, size) = of_robot("c");
        assert!(share == Some(0.8) && size.is_some_and(|size| size < 0.0601));
    }

    #[test]
    fn a_pool_tells_scatter_from_error() {
        // Two-sided by construction: +-1 about 5 with errors far smaller, then with errors far larger.
        let values = |error: f64| {
            (0..40)
                .map(|k| (if k % 2 == 0 { 4.0 } else { 6.0 }, error))
                .collect::<Vec<_>>()
        };
        let (mean, sigma) = pool(&values(0.01)).unwrap();
        assert!(
            (mean - 5.0).abs() < 1e-9 && (sigma - 1.026).abs() < 0.01,
            "{mean} {sigma}"
        );
        let (mean, sigma) = pool(&values(3.0)).unwrap();
        assert!(
            (mean - 5.0).abs() < 1e-9 && (sigma - 3.0 / 40f64.sqrt()).abs() < 1e-9,
            "{mean} {sigma}"
        );
        assert_eq!(pool(&values(1.0)[..2]), None);
    }
}
