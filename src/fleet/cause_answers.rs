//! What the sums of a fleet mean: causes of groups with their size, spread and trend; robots that lack one, or have another size, or one alone.

use super::cause_sums::{CellProfile, CellTotal, GroupSums, each};
use super::ledger::{Ending, RobotRecord};
use super::round::Round;
use super::{Fleet, Ledger};
use crate::criteria::cells::{MISLED, RIVAL};
use crate::criteria::fleet::{APART, CHANCE, DECIDED, LACKS, LEAST_SPREAD, SIBLINGS, USUALLY};
use crate::error::{Result, counted};
use crate::estimate::tail;
use crate::statistics::{nearest, normal_quantile};
use crate::table::{
    FleetCellRow, FleetCells, FleetFindingRow, FleetFindings, FleetOutlierRow, FleetOutliers,
};
use std::collections::BTreeMap;

/// What was found.
pub(crate) struct Answers {
    /// Causes of groups and of single robots.
    pub(crate) findings: FleetFindings,
    /// Every robot's size of each.
    pub(crate) cells: FleetCells,
    /// Robots that are not like their group.
    pub(crate) outliers: FleetOutliers,
}

/// Sizes of robots, in their unit: the usual one and how it scatters from robot to robot.
pub(super) struct Population {
    pub(crate) usual: f64,
    pub(crate) spread: f64,
}

/// Answers by the last round.
pub(super) fn of(
    fleet: &Fleet,
    ledger: &Ledger,
    round: &Round,
    records: &[Option<RobotRecord>],
) -> Result<Answers> {
    let mut sums: BTreeMap<String, GroupSums> = BTreeMap::new();
    let mut sized: BTreeMap<(String, String), Vec<FleetCellRow>> = BTreeMap::new();
    let mut follows: BTreeMap<String, String> = BTreeMap::new();
    each(fleet, ledger, records, &mut |robot, cells| {
        let group = round.by.of(&robot.groups).to_string();
        let given = round.groups.get(&group).map_or(&[][..], Vec::as_slice);
        sums.entry(group.clone()).or_default().add(cells, given);
        for CellProfile { row, .. } in cells {
            let Some(sigma) = row.sigma else { continue };
            follows
                .entry(row.cell.clone())
                .or_insert_with(|| row.follows.clone());
            let key = (group.clone(), row.cell.clone());
            sized.entry(key).or_default().push(FleetCellRow {
                cell: row.cell.clone(),
                robot: robot.name.clone(),
                group: group.clone(),
                plant: robot.groups.plant.clone(),
                campaign: robot.groups.campaign.clone(),
                effect: row.effect.clone(),
                place: row.place.clone(),
                log_evidence: row.log_evidence,
                probability: 1.0,
                size: row.size,
                sigma: sigma.max(1e-6),
                log_ratio: row.log_ratio.unwrap_or_default(),
                unit: row.unit.clone(),
                ..FleetCellRow::default()
            });
        }
    })?;
    let mut out = Answers {
        findings: FleetFindings::default(),
        cells: FleetCells::default(),
        outliers: not_asked(fleet, round, records),
    };
    let tests = sized.values().map(Vec::len).sum::<usize>().max(1) as f64;
    let limit = normal_quantile(0.5 * *CHANCE / tests);
    for ((group, cell), mut robots) in sized {
        let (Some(first), Some(sums)) = (robots.first(), sums.get(&group)) else {
            continue;
        };
        let unit = first.unit.clone();
        let mut words = format!("{} at {}", first.effect.replace('_', " "), first.place);
        let finding = FleetFindingRow {
            group: group.clone(),
            cell: cell.clone(),
            effect: first.effect.clone(),
            place: first.place.clone(),
            follows: follows.get(&cell).cloned().unwrap_or_default(),
            robots: 1,
            of_robots: sums.robots as i64,
            unit: first.unit.clone(),
            decided: Some(true),
            ..FleetFindingRow::default()
        };
        let mut given = round.groups.get(&group).into_iter().flatten();
        let Some(given) = given.find(|given| given.cell == cell) else {
            let found = sums.cells(&cell).find(|found| found.cell == cell);
            let prior = found.map_or(0.0, |found| found.sum.log_prior);
            for robot in robots {
                let odds = robot.log_evidence + prior;
                if odds < 0.0 {
                    continue;
                }
                let statement = format!(
                    "{}: {words}, {}; its siblings do not show it",
                    robot.robot,
                    size_of(&robot)
                );
                out.findings.0.push(FleetFindingRow {
                    robot: robot.robot.clone(),
                    log_odds: odds,
                    probability: (1.0 - *MISLED) / (1.0 + (-odds).exp()),
                    size: robot.size,
                    statement: statement.clone(),
                    ..finding.clone()
                });
                let outliers = &mut out.outliers.0;
                outliers.push(outlier(&robot, "alone", None, statement));
                out.cells.0.push(robot);
            }
            continue;
        };
        let population = population(&mut robots);
        let have = robots.iter().filter(|robot| has(robot)).count();
        let is_usual = have as f64 >= *USUALLY * robots.len() as f64;
        let trend = trend(&robots, tests);
        let Named {
            log_odds,
            probability,
            rival,
        } = named(sums, &cell).unwrap_or_default();
        let decided = probability >= *DECIDED;
        if let Some((name, _)) = rival.as_ref().filter(|_| !decided) {
            words = format!("{words} or {name}");
        }
        let statement = format!(
            "{words} in {have} of {}: {:.3} {unit}, {:.3} from robot to robot{}",
            counted(sums.robots, "robot"),
            population.usual,
            population.spread,
            trend
                .as_ref()
                .map(|trend| format!("; {trend}"))
                .unwrap_or_default()
        );
        out.findings.0.push(FleetFindingRow {
            shape: given.shape.clone(),
            robots: have as i64,
            log_odds,
            probability,
            rival: rival.map(|(name, probability)| format!("{name} ({probability:.2})")),
            size: population.usual,
            spread: Some(population.spread),
            trend,
            decided: Some(decided),
            statement,
            ..finding
        });
        for mut robot in robots {
            let deviation = (robot.size - population.usual) / population.spread.hypot(robot.sigma);
            let ratio = robot.size / population.usual.max(1e-9);
            robot.deviation = Some(deviation);
            let kind = match () {
                () if have < *SIBLINGS => None,
                () if 1.0 - robot.probability > *LACKS && decided && is_usual => Some("lacks"),
                () if !has(&robot) => None,
                () if deviation > limit && ratio > *APART => Some("larger"),
                () if -deviation > limit && ratio < 1.0 / *APART => Some("smaller"),
                () => None,
            };
            if let Some(kind) = kind {
                let size = size_of(&robot);
                let statement = match kind {
                    "lacks" => format!(
                        "{}: {}no {words} ({size}), which {have} of {} have",
                        robot.robot,
                        if has(&robot) { "perhaps " } else { "" },
                        sums.robots
                    ),
                    _ => format!(
                        "{}: {words} is {size}, {ratio:.1} times that of its siblings",
                        robot.robot
                    ),
                };
                let usual = Some(population.usual);
                let outliers = &mut out.outliers.0;
                outliers.push(outlier(&robot, kind, usual, statement));
            }
            out.cells.0.push(robot);
        }
    }
    let finding = |row: &FleetFindingRow| (row.group.clone(), row.cell.clone(), row.robot.clone());
    out.findings.0.sort_by_cached_key(finding);
    out.cells
        .0
        .sort_by(|a, b| (&a.cell, &a.robot).cmp(&(&b.cell, &b.robot)));
    out.outliers
        .0
        .sort_by(|a, b| (&a.robot, &a.kind, &a.cell).cmp(&(&b.robot, &b.kind, &b.cell)));
    Ok(out)
}

/// Whether a robot has a cause, more probably than not.
pub(super) fn has(robot: &FleetCellRow) -> bool {
    robot.probability >= 0.5
}

/// Robots without a table: their data were rejected, or the machine failed.
fn not_asked(fleet: &Fleet, round: &Round, records: &[Option<RobotRecord>]) -> FleetOutliers {
    let robots = fleet.roster.0.iter().zip(records);
    let row = |(robot, record): (&super::FleetRobot, &Option<RobotRecord>)| {
        let reason = match record {
            Some(record) if record.ending == Ending::Done => return None,
            Some(record) => record.reason.as_deref(),
            None => Some("not computed yet"),
        };
        let reason = reason.and_then(|reason| reason.lines().next());
        Some(FleetOutlierRow {
            robot: robot.name.clone(),
            kind: "not_asked".into(),
            group: round.by.of(&robot.groups).into(),
            statement: format!("{}: {}", robot.name, reason.unwrap_or("failed")),
            ..FleetOutlierRow::default()
        })
    };
    FleetOutliers(robots.filter_map(row).collect())
}

/// The usual size and its scatter, and of every robot how probable it is that it has the cause: its size is one of those, or noise.
pub(super) fn population(robots: &mut [FleetCellRow]) -> Population {
    let mut population = Population {
        usual: 0.0,
        spread: 0.0,
    };
    let mut share: f64 = 0.9;
    for robot in robots.iter_mut() {
        robot.probability = f64::from(robot.log_evidence > 0.0);
    }
    if !robots.iter().any(has) {
        robots.iter_mut().for_each(|robot| robot.probability = 1.0);
    }
    for _ in 0..10 {
        let median = |value_of: &dyn Fn(&FleetCellRow) -> f64| {
            let mut values: Vec<f64> = robots
                .iter()
                .filter(|robot| has(robot))
                .map(value_of)
                .collect();
            nearest(&mut values, 0.5)
        };
        let Some(usual) = median(&|robot| robot.size) else {
            break;
        };
        let scatter = 1.4826 * median(&|robot| (robot.size - usual).abs()).unwrap_or(0.0);
        let error = median(&|robot| robot.sigma).unwrap_or(0.0);
        let least = *LEAST_SPREAD * usual;
        let spread = (scatter * scatter - error * error)
            .max(least * least)
            .sqrt();
        population = Population { usual, spread };
        for robot in robots.iter_mut() {
            let wide = spread.hypot(robot.sigma);
            let off = ((robot.size - usual).min(0.0) / wide).powi(2);
            let log = robot.log_ratio - 0.5 * off + (robot.sigma / wide).ln();
            let odds = (share / (1.0 - share)).ln() + log;
            robot.probability = 1.0 / (1.0 + (-odds).exp());
        }
        let having: f64 = robots.iter().map(|robot| robot.probability).sum();
        share = (having + 4.5) / (robots.len() as f64 + 5.0);
    }
    population
}

/// ln of the odds of a cell of a group, the probability of its name, and the next probable name with its probability.
#[derive(Default)]
struct Named {
    log_odds: f64,
    probability: f64,
    rival: Option<(String, f64)>,
}

/// The name of a cell of a group.
fn named(sums: &GroupSums, cell: &str) -> Option<Named> {
    let all: Vec<CellTotal> = sums.cells(cell).collect();
    let named = all.iter().find(|named| named.cell == cell)?;
    let is_same =
        |one: &&CellTotal| one.sum.effect == named.sum.effect && one.sum.place == named.sum.place;
    // Where models are as good as they think, a log ratio has twice its mean as variance; one that scatters by more from robot to robot is
    // worth less (Vuong, 1989).
    let ratio = |one: &CellTotal| {
        let prior = one.sum.log_prior - named.sum.log_prior;
        let more = one.odds - named.odds - prior;
        let worth = 2.0 * more.abs() / one.scatter.max(f64::MIN_POSITIVE);
        (prior + more * worth.min(1.0)).exp()
    };
    let of_name: f64 = all
        .iter()
        .filter(is_same)
        .map(|one| (one.odds - named.odds).exp())
        .sum();
    let rivals = all
        .iter()
        .filter(|one| !is_same(one))
        .map(|one| (one, ratio(one)));
    let whole = of_name + (-named.odds).exp() + rivals.clone().map(|(_, ratio)| ratio).sum::<f64>();
    let best = rivals.max_by(|a, b| a.1.total_cmp(&b.1));
    let rival = best.map(|(one, ratio)| {
        let name = format!("{} at {}", one.sum.effect.replace('_', " "), one.sum.place);
        (name, (1.0 - *MISLED) * ratio / whole)
    });
    Some(Named {
        log_odds: named.odds,
        probability: (1.0 - *MISLED) * of_name / whole,
        rival: rival.filter(|(_, probability)| *probability > *RIVAL),
    })
}

/// How sizes differ by plant or campaign, where that is no chance (weighted means, Fisher's F with the scatter inside the labels).
fn trend(robots: &[FleetCellRow], tests: f64) -> Option<String> {
    let labels: [fn(&FleetCellRow) -> Option<&String>; 2] =
        [|row| row.plant.as_ref(), |row| row.campaign.as_ref()];
    let sentence = |label: fn(&FleetCellRow) -> Option<&String>| {
        let mut by: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for robot in robots.iter().filter(|robot| has(robot)) {
            by.entry(label(robot)?).or_default().push(robot.size);
        }
        by.retain(|_, sizes| sizes.len() > 1);
        let count: usize = by.values().map(Vec::len).sum();
        if by.len() < 2 || count < by.len() + 4 {
            return None;
        }
        let mean = |sizes: &[f64]| sizes.iter().sum::<f64>() / sizes.len() as f64;
        let all = by.values().flatten().sum::<f64>() / count as f64;
        let (mut between, mut within) = (0.0, 0.0);
        for sizes in by.values() {
            let group_mean = mean(sizes);
            between += sizes.len() as f64 * (group_mean - all).powi(2);
            within += sizes
                .iter()
                .map(|size| (size - group_mean).powi(2))
                .sum::<f64>();
        }
        let freedom = [(by.len() - 1) as f64, (count - by.len()) as f64];
        let ratio = between / freedom[0] / (within / freedom[1]).max(f64::MIN_POSITIVE);
        (tail(ratio, freedom[0], freedom[1]) < *CHANCE / tests.min(20.0)).then(|| {
            let sentences = by
                .iter()
                .map(|(label, sizes)| format!("{:.3} {} at {label}", mean(sizes), robots[0].unit));
            sentences.collect::<Vec<_>>().join(", ")
        })
    };
    let sentences: Vec<String> = labels.into_iter().filter_map(sentence).collect();
    (!sentences.is_empty()).then(|| sentences.join("; "))
}

fn size_of(robot: &FleetCellRow) -> String {
    format!("{:.3} +- {:.3} {}", robot.size, robot.sigma, robot.unit)
}

fn outlier(
    robot: &FleetCellRow,
    kind: &str,
    usual: Option<f64>,
    statement: String,
) -> FleetOutlierRow {
    FleetOutlierRow {
        robot: robot.robot.clone(),
        kind: kind.into(),
        cell: robot.cell.clone(),
        group: robot.group.clone(),
        size: Some(robot.size),
        usual,
        unit: Some(robot.unit.clone()),
        probability: (kind == "lacks").then_some(1.0 - robot.probability),
        statement,
    }
}
