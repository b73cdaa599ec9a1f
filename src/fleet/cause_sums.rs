//! Log evidence summed over the robots of a group: a robot may lack a cause, and what is one in one robot alone is none of the group.

use super::ledger::{Ledger, RobotRecord};
use super::{Fleet, FleetRobot};
use crate::criteria::fleet::LEAST_EVIDENCE;
use crate::error::Result;
use crate::stage::Given;
use crate::table::{CellEvidence, CellEvidenceRow, Table};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Robots whose tables are in memory at once.
const CHUNK: usize = 64;
/// Shares of a group's robots that may have a cause, all alike probable.
const SHARES: usize = 20;

/// ln of what a robot contributes where a share of all has a cause: it may have it or lack it.
fn mixed(log: f64, share: f64) -> f64 {
    let most = log.max(0.0);
    most + (share * (log - most).exp() + (1.0 - share) * (-most).exp()).ln()
}

fn shares() -> impl Iterator<Item = f64> + Clone {
    (1..=SHARES).map(|k| k as f64 / SHARES as f64)
}

fn log_mean(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    let count = logs.clone().count() as f64;
    most + (logs.map(|log| (log - most).exp()).sum::<f64>() / count).ln()
}

/// What a cell, or one of its shapes, says of a group.
#[derive(Debug, Clone)]
pub(super) struct Sum {
    pub(crate) effect: String,
    pub(crate) place: String,
    pub(crate) follows: String,
    pub(crate) log_prior: f64,
    /// At each share, over that of robots of which no more is known than the least.
    logs: [f64; SHARES],
    /// Of the robot in which it is plainest.
    strongest: f64,
    /// Sizes weighed by how plain they are, and the weights.
    sized: (f64, f64),
    /// Robots, and sums of what its log evidence is less than that of the cell in whose place it is asked: differences, their squares.
    less: [f64; 3],
    /// Sums of that cell's log evidence in the same robots, and of its square.
    owner: [f64; 2],
    /// Robots that have found it by themselves.
    pub(crate) found: usize,
}

impl Sum {
    fn new(row: &CellEvidenceRow) -> Self {
        Self {
            effect: row.effect.clone(),
            place: row.place.clone(),
            follows: row.follows.clone(),
            log_prior: row.log_prior,
            logs: [0.0; SHARES],
            strongest: *LEAST_EVIDENCE,
            sized: (0.0, 0.0),
            less: [0.0; 3],
            owner: [0.0; 2],
            found: 0,
        }
    }

    fn add(&mut self, row: &CellEvidenceRow, owner: f64) {
        let log = row.log_evidence.max(*LEAST_EVIDENCE);
        let less = owner - log;
        for (sum, value) in self.less.iter_mut().zip([1.0, less, less * less]) {
            *sum += value;
        }
        self.found += usize::from(row.given.is_empty() && row.sigma.is_some());
        self.owner[0] += owner;
        self.owner[1] += owner * owner;
        for (sum, share) in self.logs.iter_mut().zip(shares()) {
            *sum += mixed(log, share) - mixed(*LEAST_EVIDENCE, share);
        }
        self.strongest = self.strongest.max(log);
        let weight = 1.0 / (1.0 + (-log).exp());
        self.sized.0 += weight * row.size.max(1e-6).ln();
        self.sized.1 += weight;
    }

    /// ln of the evidence for it over that of nothing, of so many robots.
    pub(crate) fn total(&self, robots: usize) -> f64 {
        let at = |(log, share): (&f64, f64)| log + robots as f64 * mixed(*LEAST_EVIDENCE, share);
        log_mean(self.logs.iter().zip(shares()).map(at))
    }

    /// The same without the robot in which it is plainest.
    pub(crate) fn of_the_others(&self, robots: usize) -> f64 {
        let at = |(log, share): (&f64, f64)| {
            log + robots as f64 * mixed(*LEAST_EVIDENCE, share) - mixed(self.strongest, share)
        };
        log_mean(self.logs.iter().zip(shares()).map(at))
    }

    /// Variance of the sum of what it says less than its owner, whose sums over so many robots are given, by the scatter from robot to robot.
    fn scatter(&self, owner: &[f64; 2], robots: usize) -> f64 {
        // Robots without a row say the least.
        let (count, missing) = (robots as f64, robots as f64 - self.less[0]);
        let [absent, square] = [0, 1].map(|k| owner[k] - self.owner[k]);
        let sum = self.less[1] + absent - missing * *LEAST_EVIDENCE;
        let square = self.less[2] + square - 2.0 * *LEAST_EVIDENCE * absent
            + missing * *LEAST_EVIDENCE * *LEAST_EVIDENCE;
        (square - sum * sum / count.max(1.0)).max(0.0)
    }

    /// A usual size, in its unit.
    pub(crate) fn size(&self) -> f64 {
        (self.sized.0 / self.sized.1.max(f64::MIN_POSITIVE))
            .exp()
            .clamp(1e-3, 1e5)
    }
}

/// A row's cell with all others, or in the place of a given one; and its shape.
type CellKey = (String, String, String);

/// The sums of a group.
#[derive(Debug, Default)]
pub(super) struct GroupSums {
    pub(crate) robots: usize,
    /// Sums of what each given cell says in its shape, and of the squares.
    owners: BTreeMap<String, [f64; 2]>,
    sums: BTreeMap<CellKey, Sum>,
}

/// What a cell says of a group, with the shape that all robots share where that says more.
pub(super) struct CellTotal<'a> {
    pub(crate) cell: &'a str,
    pub(crate) shape: Option<&'a str>,
    pub(crate) sum: &'a Sum,
    /// ln of its posterior odds.
    pub(crate) odds: f64,
    /// The same without the robot in which it is plainest.
    pub(crate) of_the_others: f64,
    /// Variance of what it says less than the cell in whose place it is asked.
    pub(crate) scatter: f64,
}

impl GroupSums {
    /// Takes a robot that was asked with some given cells.
    pub(crate) fn add(&mut self, rows: &[CellEvidenceRow], given: &[Given]) {
        self.robots += 1;
        let mut logs: BTreeMap<&str, f64> = BTreeMap::new();
        for one in given {
            let shape = one.shape.as_deref().unwrap_or_default();
            let is_own = |row: &&CellEvidenceRow| {
                row.given == one.cell && row.cell == one.cell && row.shape == shape
            };
            let present = rows.iter().find(is_own);
            let log = present.map_or(*LEAST_EVIDENCE, |row| row.log_evidence.max(*LEAST_EVIDENCE));
            logs.insert(&one.cell, log);
            let sums = self.owners.entry(one.cell.clone()).or_default();
            (sums[0], sums[1]) = (sums[0] + log, sums[1] + log * log);
        }
        for row in rows {
            let key = (row.given.clone(), row.cell.clone(), row.shape.clone());
            let owner = logs
                .get(row.given.as_str())
                .copied()
                .unwrap_or(*LEAST_EVIDENCE);
            self.sums
                .entry(key)
                .or_insert_with(|| Sum::new(row))
                .add(row, owner);
        }
    }

    /// All cells in the place of a given one; of none: next to all.
    pub(crate) fn cells<'a>(&'a self, given: &'a str) -> impl Iterator<Item = CellTotal<'a>> {
        let mut shared: BTreeMap<&str, (f64, f64, f64, &str, &Sum)> = BTreeMap::new();
        let here = move || self.sums.iter().filter(move |(key, _)| key.0 == given);
        for ((_, cell, shape), sum) in here().filter(|(key, _)| !key.2.is_empty()) {
            let [all, others] = [sum.total(self.robots), sum.of_the_others(self.robots)]
                .map(|total| total + sum.log_prior);
            let best = shared
                .entry(cell)
                .or_insert((all, others, f64::NEG_INFINITY, shape, sum));
            if best.2 > f64::NEG_INFINITY {
                best.0 = log_add(best.0, all);
                best.1 = log_add(best.1, others);
            }
            if all > best.2 {
                (best.2, best.3, best.4) = (all, shape, sum);
            }
        }
        let owner = self.owners.get(given).copied().unwrap_or_default();
        here()
            .filter(|(key, _)| key.2.is_empty())
            .map(move |((_, cell, _), sum)| {
                let alone = sum.total(self.robots);
                let together = shared.get(cell.as_str()).filter(|shared| shared.0 > alone);
                let total = together.map_or(alone, |shared| shared.0);
                let others =
                    together.map_or_else(|| sum.of_the_others(self.robots), |shared| shared.1);
                CellTotal {
                    cell,
                    shape: together.map(|shared| shared.3),
                    sum,
                    odds: total + sum.log_prior,
                    of_the_others: others + sum.log_prior,
                    scatter: together
                        .map_or(sum, |shared| shared.4)
                        .scatter(&owner, self.robots),
                }
            })
    }
}

/// Hands every robot's rows over, in the order of the roster; few are in memory at once.
pub(super) fn each(
    fleet: &Fleet,
    ledger: &Ledger,
    records: &[Option<RobotRecord>],
    take: &mut dyn FnMut(&FleetRobot, &[CellEvidenceRow]),
) -> Result<()> {
    let robots: Vec<_> = fleet.roster.0.iter().zip(records).collect();
    for some in robots.chunks(CHUNK) {
        let tables: Vec<Option<CellEvidence>> = some
            .par_iter()
            .map(|(_, record)| {
                let record = record.as_ref();
                ledger.load(record.and_then(|record| record.last(CellEvidence::KIND)))
            })
            .collect::<Result<_>>()?;
        for ((robot, _), table) in some.iter().zip(tables) {
            if let Some(table) = table {
                take(robot, &table.0);
            }
        }
    }
    Ok(())
}

fn log_add(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    most + ((a - most).exp() + (b - most).exp()).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(log: f64) -> CellEvidenceRow {
        CellEvidenceRow {
            cell: "backlash@joint 2".into(),
            effect: "backlash".into(),
            place: "joint 2".into(),
            follows: "approach".into(),
            log_evidence: log,
            size: 0.05,
            unit: "mm".into(),
            ..CellEvidenceRow::default()
        }
    }

    fn odds(logs: &[f64], robots: usize) -> (f64, f64) {
        let mut sums = GroupSums::default();
        logs.iter().for_each(|log| sums.add(&[row(*log)], &[]));
        sums.robots = robots;
        let cell = sums.cells("").next().expect("a cell");
        (cell.odds, cell.of_the_others)
    }

    #[test]
    fn weak_causes_add_up_and_robots_without_one_cost_little() {
        // Of 10 robots with e^2 each: 20 less the price of the share, which is at most ln 20.
        let (all, _) = odds(&[2.0; 10], 10);
        assert!(all < 20.0 && all > 20.0 - 20f64.ln(), "{all}");
        // Ten more robots that show nothing (by Beta(11, 11) at the least: 10 ln 0.5 and the price).
        let (half, _) = odds(&[2.0; 10], 20);
        assert!(half > 2.0 && half < all, "{half}");
    }

    #[test]
    fn the_scatter_of_a_difference_is_that_of_its_terms() {
        let mut sums = GroupSums::default();
        let given = |cell: &str, log: f64| CellEvidenceRow {
            given: "a".into(),
            cell: cell.into(),
            ..row(log)
        };
        // Differences 1, 4 and, where the rival has no row, 5 + 3.3.
        let asked = [Given {
            cell: "a".into(),
            shape: None,
            size: 0.05,
        }];
        sums.add(&[given("a", 3.0), given("b", 2.0)], &asked);
        sums.add(&[given("a", 6.0), given("b", 2.0)], &asked);
        sums.add(&[given("a", 5.0)], &asked);
        let cells: Vec<_> = sums.cells("a").collect();
        let mean = (1.0 + 4.0 + 8.3) / 3.0;
        let by_hand: f64 = [1.0f64, 4.0, 8.3].iter().map(|d| (d - mean).powi(2)).sum();
        assert!((cells[1].scatter - by_hand).abs() < 1e-9);
        assert_eq!(cells[0].scatter, 0.0);
    }

    #[test]
    fn what_one_robot_alone_shows_is_not_of_the_others() {
        let mut logs = vec![-1.0; 19];
        logs.push(30.0);
        let (all, others) = odds(&logs, 20);
        assert!(all > 20.0 && others < 0.0, "{all} {others}");
    }
}
