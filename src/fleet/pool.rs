//! What an earlier fleet says of parameters: a robot's own values, or mean and spread over the robots of its model.
//!
//! Random effects by moments (DerSimonian and Laird, 1986): values x_i with errors s_i scatter by tau about a mean. A robot's own
//! value is left out of the prior that it gets, so that nothing is counted twice.

use super::Fleet;
use super::causes::noted;
use super::file::{Groups, PriorBy, PriorFrom};
use super::ledger::{Ending, Ledger};
use super::recalibration::Earlier;
use crate::error::{Error, Result};
use crate::table::{FleetFindingRow, FleetFindings, Parameters, Table};
use serde_json::{Value, json};
use std::collections::BTreeMap;

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
                    for (port, table) in [
                        ("previous_parameters", parameters),
                        ("previous_recording", recording),
                    ] {
                        let path = ledger.store.object(table)?;
                        robot.set_text(
                            &format!("{}.{port}", previous.stage),
                            &path.to_string_lossy(),
                        );
                    }
                }
            }
        }
        let by_causes = |prior: &PriorFrom| prior.by == PriorBy::Causes;
        if let Some(wanted) = self.file.prior.clone().filter(by_causes) {
            self.expect_causes(&wanted, ledger)?;
        }
        let by_parameters = |prior: &PriorFrom| prior.by != PriorBy::Causes;
        if let Some(wanted) = self.file.prior.clone().filter(by_parameters) {
            let earlier = Earlier::named(&wanted.fleet, "prior.fleet", ledger)?;
            let known = EarlierChanges::read(&earlier, &wanted, ledger)?;
            for robot in &mut self.roster.0 {
                let priors = match wanted.by {
                    PriorBy::Robot => known.own(&robot.name),
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

    /// Sets for every robot what the diagnosis of an earlier fleet says of the causes of its model.
    fn expect_causes(&mut self, wanted: &PriorFrom, ledger: &Ledger) -> Result<()> {
        let earlier = Ledger::new(ledger.store, &wanted.fleet);
        let findings = noted::<FleetFindings>(&earlier, "fleet_findings")?.ok_or_else(|| {
            let message = format!(
                "no fleet `{}` was diagnosed in store {}: calib fleet diagnose",
                wanted.fleet,
                ledger.store.root().display()
            );
            Error::spec("prior.fleet", message)
        })?;
        for robot in &mut self.roster.0 {
            let model = robot.groups.model.clone().unwrap_or_default();
            let of_model = findings
                .0
                .iter()
                .filter(|row| row.robot.is_empty() && row.group == model);
            let prior = |row: &FleetFindingRow| {
                json!({
                    "cell": row.cell, "share": row.robots as f64 / row.of_robots as f64,
                    "size_mm": row.size_mm.max(1e-3), "spread_mm": row.spread_mm.unwrap_or(0.0),
                })
            };
            let priors: Vec<Value> = of_model.map(prior).collect();
            let target = format!("{}.prior", wanted.stage);
            robot.set_values(&BTreeMap::from([(target, Value::Array(priors))]));
        }
        Ok(())
    }
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

    fn own(&self, robot: &str) -> BTreeMap<String, PooledPrior> {
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
    use super::pool;

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
