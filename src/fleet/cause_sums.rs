//! Log evidence summed over the robots of a group at each amplitude, since robots of a model share the size of a cause: a robot may lack it, and
//! what is one in one robot alone is none of the group.

use super::ledger::{Ledger, RobotRecord};
use super::{Fleet, FleetRobot};
use crate::criteria::fleet::{LEAST_EVIDENCE, WRITTEN};
use crate::effect::names;
use crate::error::{Error, Result};
use crate::stage::{Given, STEPS, amplitude_step};
use crate::table::{CellAmplitudeRow, CellAmplitudes, CellEvidence, CellEvidenceRow, Table};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::LazyLock;

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

/// ln of what robots contribute at each amplitude and share.
type Grid = [[f64; SHARES]; STEPS];

/// What a robot contributes by its log evidence at each amplitude.
fn grid_of(at: &[f64; STEPS]) -> Grid {
    let mut grid = [[0.0; SHARES]; STEPS];
    for (row, log) in grid.iter_mut().zip(at) {
        for (value, share) in row.iter_mut().zip(shares()) {
            *value = mixed(*log, share);
        }
    }
    grid
}

/// ln of the mean over all amplitudes and shares.
fn log_mean(grid: &Grid) -> f64 {
    let most = grid
        .as_flattened()
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    let whole: f64 = grid
        .as_flattened()
        .iter()
        .map(|log| (log - most).exp())
        .sum();
    most + (whole / (STEPS * SHARES) as f64).ln()
}

/// What a cell contributes of which no row is written, with a name or else: one column that hides nothing, so well seen that it is just not
/// written.
static UNWRITTEN: LazyLock<[Grid; 2]> = LazyLock::new(|| {
    (*WRITTEN).map(|limit| {
        // Up to an amplitude that the rows just see ln of the evidence is 0, beyond it falls by one for each e-fold.
        let nothing = |seen: f64| -> [f64; STEPS] {
            let beyond = |k: usize| 2.0 * (k as f64 - seen) * amplitude_step();
            std::array::from_fn(|k| -0.5 * beyond(k).exp().ln_1p())
        };
        let is_less = |at: &[f64; STEPS]| {
            at.iter().map(|log| log.exp()).sum::<f64>() < STEPS as f64 * limit.exp()
        };
        let (mut low, mut high) = (-(STEPS as f64), STEPS as f64);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            match is_less(&nothing(middle)) {
                true => low = middle,
                false => high = middle,
            }
        }
        grid_of(&nothing(low))
    })
});

/// The evidence of a robot for a cell, or a shape of it, over its amplitude.
#[derive(Debug, Clone)]
pub(super) struct CellProfile {
    pub(super) row: CellEvidenceRow,
    /// ln of its evidence at each amplitude.
    pub(super) at: [f64; STEPS],
}

/// What a cell, or one of its shapes, says of a group.
#[derive(Debug, Clone)]
pub(super) struct Sum {
    pub(crate) effect: String,
    pub(crate) place: String,
    pub(crate) follows: String,
    pub(crate) log_prior: f64,
    /// Over that of robots of which no row is written.
    grid: Box<Grid>,
    /// What robots contribute of which no row is written.
    unwritten: &'static Grid,
    /// What the robot in which it is plainest contributes, and its log evidence.
    strongest: (f64, Box<Grid>),
    /// Sum of ln of what a unit of amplitude is in the unit of the sizes, and of how many robots.
    unit: (f64, f64),
    /// Robots, and sums of what its log evidence is less than that of the cell in whose place it is asked: differences, their squares.
    less: [f64; 3],
    /// Sums of that cell's log evidence in the same robots, and of its square.
    owner: [f64; 2],
    /// Robots that have found it by themselves.
    pub(crate) found: usize,
}

impl Sum {
    fn new(row: &CellEvidenceRow) -> Self {
        let has_name = row.shape.is_empty() && row.effect != names::UNKNOWN;
        let unwritten = &UNWRITTEN[usize::from(!has_name)];
        Self {
            effect: row.effect.clone(),
            place: row.place.clone(),
            follows: row.follows.clone(),
            log_prior: row.log_prior,
            grid: Box::new([[0.0; SHARES]; STEPS]),
            unwritten,
            strongest: (*LEAST_EVIDENCE, Box::new(*unwritten)),
            unit: (0.0, 0.0),
            less: [0.0; 3],
            owner: [0.0; 2],
            found: 0,
        }
    }

    fn add(&mut self, CellProfile { row, at }: &CellProfile, owner: f64) {
        let log = row.log_evidence.max(*LEAST_EVIDENCE);
        let less = owner - log;
        for (sum, value) in self.less.iter_mut().zip([1.0, less, less * less]) {
            *sum += value;
        }
        self.found += usize::from(row.given.is_empty() && row.sigma.is_some());
        self.owner[0] += owner;
        self.owner[1] += owner * owner;
        let grid = grid_of(at);
        let new = grid
            .as_flattened()
            .iter()
            .zip(self.unwritten.as_flattened());
        for (sum, (value, unwritten)) in self.grid.as_flattened_mut().iter_mut().zip(new) {
            *sum += value - unwritten;
        }
        if log > self.strongest.0 {
            self.strongest = (log, Box::new(grid));
        }
        if row.sigma.is_none() && row.size > 0.0 {
            let likeliest = (0..STEPS).max_by(|a, b| at[*a].total_cmp(&at[*b]));
            self.unit.0 += row.size.ln() - likeliest.unwrap_or(0) as f64 * amplitude_step();
            self.unit.1 += 1.0;
        }
    }

    /// At each amplitude and share, of so many robots.
    fn of_all(&self, robots: usize) -> Grid {
        let mut all = *self.grid;
        let unwritten = self.unwritten.as_flattened();
        for (sum, one) in all.as_flattened_mut().iter_mut().zip(unwritten) {
            *sum += robots as f64 * one;
        }
        all
    }

    /// ln of the evidence for it over that of nothing, of so many robots.
    pub(crate) fn total(&self, robots: usize) -> f64 {
        log_mean(&self.of_all(robots))
    }

    /// The same without the robot in which it is plainest.
    pub(crate) fn of_the_others(&self, robots: usize) -> f64 {
        let mut all = self.of_all(robots);
        let strongest = self.strongest.1.as_flattened();
        for (sum, one) in all.as_flattened_mut().iter_mut().zip(strongest) {
            *sum -= one;
        }
        log_mean(&all)
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

    /// The size that robots share, in its unit.
    pub(crate) fn size(&self, robots: usize) -> f64 {
        let all = self.of_all(robots);
        let whole = log_mean(&all);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (k, shares) in all.iter().enumerate() {
            let weight: f64 = shares.iter().map(|log| (log - whole).exp()).sum();
            sum += weight * k as f64 * amplitude_step();
            weights += weight;
        }
        let unit = self.unit.0 / self.unit.1.max(1.0);
        (unit + sum / weights.max(f64::MIN_POSITIVE))
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

impl CellTotal<'_> {
    /// The size that robots share, in its unit.
    pub(crate) fn size(&self, sums: &GroupSums) -> f64 {
        self.sum.size(sums.robots)
    }
}

impl GroupSums {
    /// Takes a robot that was asked with some given cells.
    pub(crate) fn add(&mut self, cells: &[CellProfile], given: &[Given]) {
        self.robots += 1;
        let mut logs: BTreeMap<&str, f64> = BTreeMap::new();
        for one in given {
            let shape = one.shape.as_deref().unwrap_or_default();
            let is_own = |profile: &&CellProfile| {
                let row = &profile.row;
                row.given == one.cell && row.cell == one.cell && row.shape == shape
            };
            let present = cells.iter().find(is_own);
            let log = present.map_or(*LEAST_EVIDENCE, |profile| {
                profile.row.log_evidence.max(*LEAST_EVIDENCE)
            });
            logs.insert(&one.cell, log);
            let sums = self.owners.entry(one.cell.clone()).or_default();
            (sums[0], sums[1]) = (sums[0] + log, sums[1] + log * log);
        }
        for profile in cells {
            let row = &profile.row;
            let key = (row.given.clone(), row.cell.clone(), row.shape.clone());
            let owner = logs
                .get(row.given.as_str())
                .copied()
                .unwrap_or(*LEAST_EVIDENCE);
            self.sums
                .entry(key)
                .or_insert_with(|| Sum::new(row))
                .add(profile, owner);
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
    take: &mut dyn FnMut(&FleetRobot, &[CellProfile]),
) -> Result<()> {
    let robots: Vec<_> = fleet.roster.0.iter().zip(records).collect();
    for some in robots.chunks(CHUNK) {
        let tables: Vec<Option<Vec<CellProfile>>> = some
            .par_iter()
            .map(|(_, record)| {
                let table = |kind| record.as_ref().and_then(|record| record.last(kind));
                let rows: Option<CellEvidence> = ledger.load(table(CellEvidence::KIND))?;
                let at: Option<CellAmplitudes> = ledger.load(table(CellAmplitudes::KIND))?;
                rows.zip(at).map(profiles).transpose()
            })
            .collect::<Result<_>>()?;
        for ((robot, _), cells) in some.iter().zip(tables) {
            if let Some(cells) = cells {
                take(robot, &cells);
            }
        }
    }
    Ok(())
}

/// The rows of both tables, which have one order.
fn profiles((rows, amplitudes): (CellEvidence, CellAmplitudes)) -> Result<Vec<CellProfile>> {
    let (steps, rest) = amplitudes.0.as_chunks::<STEPS>();
    let is_own = |(row, steps): (&CellEvidenceRow, &[CellAmplitudeRow; STEPS])| {
        let [first, ..] = steps;
        (&first.given, &first.cell, &first.shape) == (&row.given, &row.cell, &row.shape)
    };
    let all = rows.0.len() == steps.len() && rest.is_empty();
    if !all || !rows.0.iter().zip(steps).all(is_own) {
        return Err(Error::Bug("cell_amplitudes is not of cell_evidence".into()));
    }
    let cells = rows
        .0
        .into_iter()
        .zip(steps)
        .map(|(row, steps)| CellProfile {
            row,
            at: std::array::from_fn(|k| steps[k].log_evidence),
        });
    Ok(cells.collect())
}

fn log_add(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    most + ((a - most).exp() + (b - most).exp()).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(log: f64) -> CellProfile {
        let row = CellEvidenceRow {
            cell: "backlash@joint 2".into(),
            effect: "backlash".into(),
            place: "joint 2".into(),
            follows: "approach".into(),
            log_evidence: log,
            size: 0.05,
            unit: "mm".into(),
            ..CellEvidenceRow::default()
        };
        let at = [log; STEPS];
        CellProfile { row, at }
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
        let given = |cell: &str, log: f64| {
            let mut profile = row(log);
            (profile.row.given, profile.row.cell) = ("a".into(), cell.into());
            profile
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

    /// A column whose coefficient is seen to so many standard deviations, one of which is the 5th amplitude.
    fn seen_to(deviations: f64) -> CellProfile {
        let at: [f64; STEPS] = std::array::from_fn(|k| {
            let signal = (2.0 * (k as f64 - 5.0) * amplitude_step()).exp();
            0.5 * (deviations * deviations * signal / (1.0 + signal) - signal.ln_1p())
        });
        let mut profile = row(0.0);
        let whole: f64 = at.iter().map(|log| log.exp()).sum();
        profile.row.log_evidence = (whole / STEPS as f64).ln();
        profile.at = at;
        profile
    }

    #[test]
    fn what_no_robot_shows_twenty_of_one_size_do() {
        let total = |deviations: f64, robots: usize| {
            let mut sums = GroupSums::default();
            (0..robots).for_each(|_| sums.add(&[seen_to(deviations)], &[]));
            sums.cells("").next().expect("a cell").odds
        };
        let alone = seen_to(2.4).row.log_evidence;
        assert!(alone < 1.0, "{alone}");
        // 20 times a fit of 0.5 x 2.4 x 2.4 for a determinant and a price of the amplitude and share.
        assert!(total(2.4, 20) > 20.0 && total(2.4, 20) < 20.0 * 2.88);
        assert!(total(0.0, 20) < 0.0 && total(1.0, 20) < 1.0);
    }

    #[test]
    fn a_size_that_robots_share_is_where_they_say_most_together() {
        let mut sums = GroupSums::default();
        for deviations in [1.0, 2.0, 3.0, 4.0] {
            let mut profile = seen_to(deviations);
            // The likeliest amplitude of each, as one of mm.
            let at = profile.at;
            let best = (0..STEPS).max_by(|a, b| at[*a].total_cmp(&at[*b]));
            profile.row.size = 1e-3 * (best.unwrap_or(0) as f64 * amplitude_step()).exp();
            sums.add(&[profile], &[]);
        }
        // By their sum of squares, a^2 = (1 + 4 + 9 + 16) / 4 - 1 standard errors.
        let size = sums.cells("").next().expect("a cell").size(&sums);
        let by_hand = 1e-3 * (5.0 * amplitude_step()).exp() * 6.5f64.sqrt();
        assert!((size / by_hand).ln().abs() < 0.5, "{size} {by_hand}");
    }

    #[test]
    fn what_one_robot_alone_shows_is_not_of_the_others() {
        let mut logs = vec![-1.0; 19];
        logs.push(30.0);
        let (all, others) = odds(&logs, 20);
        assert!(all > 20.0 && others < 0.0, "{all} {others}");
    }
}
