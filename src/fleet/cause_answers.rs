//! What the sums of a fleet mean: causes of groups with their size, spread and trend; robots that lack one, or have another size, or one alone.

use super::cause_sums::{GroupSums, each};
use super::ledger::{Ending, RobotRecord};
use super::round::Round;
use super::{Fleet, Groups, Ledger};
use crate::criteria::cells::MISLED;
use crate::error::{Result, counted};
use crate::estimate::tail;
use crate::statistics::{nearest, normal_quantile};
use crate::table::{
    FleetCellRow, FleetCells, FleetFindingRow, FleetFindings, FleetOutlierRow, FleetOutliers,
};
use std::collections::BTreeMap;

/// Chance of a false word on sizes or trends in the whole fleet, shared by all that are tested.
const ALPHA: f64 = 0.01;
/// Ratio of a size to the usual one from which a robot is looked at, however sure it is.
const APART: f64 = 1.5;
/// Probability of lacking a cause from which a robot is listed.
const LACKS: f64 = 0.8;
/// Robots whose sizes make a usual one.
const SIBLINGS: usize = 4;

/// What was found.
pub struct Answers {
    /// Causes of groups and of single robots.
    pub findings: FleetFindings,
    /// Every robot's size of each.
    pub cells: FleetCells,
    /// Robots that are not like their group.
    pub outliers: FleetOutliers,
}

/// A robot's size of a cell.
struct Sized {
    robot: String,
    groups: Groups,
    log: f64,
    size: f64,
    sigma: f64,
    has: f64,
}

/// Sizes of robots: the usual one and how it scatters from robot to robot.
struct Population {
    usual: f64,
    spread: f64,
}

/// Answers by the last round.
pub(super) fn of(
    fleet: &Fleet,
    ledger: &Ledger,
    round: &Round,
    records: &[Option<RobotRecord>],
) -> Result<Answers> {
    let mut sums: BTreeMap<String, GroupSums> = BTreeMap::new();
    let mut sized: BTreeMap<(String, String), Vec<Sized>> = BTreeMap::new();
    let mut labels: BTreeMap<String, (String, String, String)> = BTreeMap::new();
    each(fleet, ledger, records, &mut |robot, rows| {
        let group = round.by.of(&robot.groups).to_string();
        sums.entry(group.clone()).or_default().add(rows);
        for row in rows {
            let Some(sigma) = row.sigma_mm else { continue };
            let label = (row.effect.clone(), row.place.clone(), row.follows.clone());
            labels.entry(row.cell.clone()).or_insert(label);
            let key = (group.clone(), row.cell.clone());
            sized.entry(key).or_default().push(Sized {
                robot: robot.name.clone(),
                groups: robot.groups.clone(),
                log: row.log_evidence,
                size: row.size_mm,
                sigma: sigma.max(1e-6),
                has: 1.0,
            });
        }
    })?;
    let mut out = Answers {
        findings: FleetFindings::default(),
        cells: FleetCells::default(),
        outliers: not_asked(fleet, round, records),
    };
    let tests = sized.values().map(Vec::len).sum::<usize>().max(1) as f64;
    for ((group, cell), mut robots) in sized {
        let (Some((effect, place, follows)), Some(sums)) = (labels.get(&cell), sums.get(&group))
        else {
            continue;
        };
        let shared = round.groups.get(&group).into_iter().flatten();
        let mut shared = shared.filter(|given| given.cell == cell);
        let words = format!("{} at {place}", effect.replace('_', " "));
        let Some(given) = shared.next() else {
            for robot in robots {
                let prior = sums
                    .cells(&cell)
                    .find(|own| own.cell == cell)
                    .map_or(0.0, |own| own.sum.log_prior);
                let odds = robot.log + prior;
                if odds < 0.0 {
                    continue;
                }
                let statement = format!(
                    "{}: {words}, {} mm; its siblings do not show it",
                    robot.robot,
                    length(robot.size, robot.sigma)
                );
                out.findings.0.push(FleetFindingRow {
                    group: group.clone(),
                    cell: cell.clone(),
                    robot: robot.robot.clone(),
                    effect: effect.clone(),
                    place: place.clone(),
                    follows: follows.clone(),
                    shape: None,
                    robots: 1,
                    of_robots: sums.robots as i64,
                    log_odds: odds,
                    probability: (1.0 - *MISLED) / (1.0 + (-odds).exp()),
                    rival: None,
                    size_mm: robot.size,
                    spread_mm: None,
                    trend: None,
                    statement: statement.clone(),
                });
                out.outliers
                    .0
                    .push(outlier(&robot, &group, &cell, "alone", None, statement));
                out.cells
                    .0
                    .push(size_row(robot, &group, &cell, [effect, place], None));
            }
            continue;
        };
        let population = population(&mut robots);
        let have = robots.iter().filter(|robot| robot.has >= 0.5).count();
        let trend = trend(&robots, tests);
        let (odds, probability, rival) = named(sums, &cell, [effect, place]);
        let statement = format!(
            "{words} in {have} of {}: {:.3} mm, {:.3} from robot to robot{}",
            counted(sums.robots, "robot"),
            population.usual,
            population.spread,
            trend
                .as_ref()
                .map(|trend| format!("; {trend}"))
                .unwrap_or_default()
        );
        out.findings.0.push(FleetFindingRow {
            group: group.clone(),
            cell: cell.clone(),
            robot: String::new(),
            effect: effect.clone(),
            place: place.clone(),
            follows: follows.clone(),
            shape: given.shape.clone(),
            robots: have as i64,
            of_robots: sums.robots as i64,
            log_odds: odds,
            probability,
            rival,
            size_mm: population.usual,
            spread_mm: Some(population.spread),
            trend,
            statement,
        });
        let limit = normal_quantile(0.5 * ALPHA / tests);
        for robot in robots {
            let deviation = (robot.size - population.usual) / population.spread.hypot(robot.sigma);
            let ratio = robot.size / population.usual.max(1e-9);
            let kind = if have < SIBLINGS {
                None
            } else if robot.has < 1.0 - LACKS {
                Some("lacks")
            } else if deviation > limit && ratio > APART {
                Some("larger")
            } else if -deviation > limit && ratio < 1.0 / APART {
                Some("smaller")
            } else {
                None
            };
            if let Some(kind) = kind {
                let size = length(robot.size, robot.sigma);
                let statement = match kind {
                    "lacks" => format!(
                        "{}: no {words} ({size} mm), which {have} of {} have",
                        robot.robot, sums.robots
                    ),
                    _ => format!(
                        "{}: {words} moves the tool by {size} mm, {ratio:.1} times that of its siblings",
                        robot.robot
                    ),
                };
                let usual = Some(population.usual);
                out.outliers
                    .0
                    .push(outlier(&robot, &group, &cell, kind, usual, statement));
            }
            out.cells.0.push(size_row(
                robot,
                &group,
                &cell,
                [effect, place],
                Some(deviation),
            ));
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
            cell: String::new(),
            group: round.by.of(&robot.groups).into(),
            size_mm: None,
            usual_mm: None,
            probability: None,
            statement: format!("{}: {}", robot.name, reason.unwrap_or("failed")),
        })
    };
    FleetOutliers(robots.filter_map(row).collect())
}

/// The usual size and its scatter, and of every robot how probable it is that it has the cause: its size is one of those, or noise.
fn population(robots: &mut [Sized]) -> Population {
    let mut population = Population {
        usual: 0.0,
        spread: 0.0,
    };
    let mut share: f64 = 0.9;
    for robot in robots.iter_mut() {
        robot.has = f64::from(robot.log > 0.0);
    }
    if robots.iter().all(|robot| robot.has == 0.0) {
        robots.iter_mut().for_each(|robot| robot.has = 1.0);
    }
    for _ in 0..10 {
        let having = || robots.iter().filter(|robot| robot.has >= 0.5);
        let mut sizes: Vec<f64> = having().map(|robot| robot.size).collect();
        let Some(usual) = nearest(&mut sizes, 0.5) else {
            break;
        };
        let mut off: Vec<f64> = having().map(|robot| (robot.size - usual).abs()).collect();
        let scatter = 1.4826 * nearest(&mut off, 0.5).unwrap_or(0.0);
        let mut errors: Vec<f64> = having().map(|robot| robot.sigma).collect();
        let error = nearest(&mut errors, 0.5).unwrap_or(0.0);
        // That few robots scatter by little is chance.
        let least = 0.1 * usual;
        let spread = (scatter * scatter - error * error)
            .max(least * least)
            .sqrt();
        population = Population { usual, spread };
        for robot in robots.iter_mut() {
            let wide = spread.hypot(robot.sigma);
            let off = ((robot.size - usual).min(0.0) / wide).powi(2);
            let none = (robot.size / robot.sigma).powi(2);
            let log = 0.5 * (none - off) + (robot.sigma / wide).ln() - 2f64.ln();
            let odds = (share / (1.0 - share)).ln() + log;
            robot.has = 1.0 / (1.0 + (-odds).exp());
        }
        let having: f64 = robots.iter().map(|robot| robot.has).sum();
        share = (having + 4.5) / (robots.len() as f64 + 5.0);
    }
    population
}

/// ln of the odds of a cell of a group, the probability of its name, and the next probable one.
fn named(sums: &GroupSums, cell: &str, name: [&str; 2]) -> (f64, f64, Option<String>) {
    let all: Vec<_> = sums.cells(cell).collect();
    let odds = all
        .iter()
        .find(|own| own.cell == cell)
        .map_or(0.0, |own| own.odds);
    let whole: f64 = all.iter().map(|one| (one.odds - odds).exp()).sum::<f64>() + (-odds).exp();
    let is_same =
        |one: &&super::cause_sums::CellTotal| [&one.sum.effect[..], &one.sum.place] == name;
    let own: f64 = all
        .iter()
        .filter(is_same)
        .map(|one| (one.odds - odds).exp())
        .sum();
    let rival = all
        .iter()
        .filter(|one| !is_same(one))
        .max_by(|a, b| a.odds.total_cmp(&b.odds))
        .filter(|one| (one.odds - odds).exp() / whole > 0.01);
    let rival = rival.map(|one| {
        format!(
            "{} at {} ({:.2})",
            one.sum.effect.replace('_', " "),
            one.sum.place,
            (one.odds - odds).exp() / whole
        )
    });
    (odds, (1.0 - *MISLED) * own / whole, rival)
}

/// How sizes differ by plant or campaign, where that is no chance (weighted means, Fisher's F with the scatter inside the labels).
fn trend(robots: &[Sized], tests: f64) -> Option<String> {
    let labels: [fn(&Groups) -> Option<&String>; 2] =
        [|g| g.plant.as_ref(), |g| g.campaign.as_ref()];
    let sentence = |label: fn(&Groups) -> Option<&String>| {
        let mut by: BTreeMap<&str, Vec<&Sized>> = BTreeMap::new();
        for robot in robots.iter().filter(|robot| robot.has >= 0.5) {
            by.entry(label(&robot.groups)?).or_default().push(robot);
        }
        by.retain(|_, robots| robots.len() > 1);
        let count: usize = by.values().map(Vec::len).sum();
        if by.len() < 2 || count < by.len() + 4 {
            return None;
        }
        let mean = |robots: &[&Sized]| {
            robots.iter().map(|robot| robot.size).sum::<f64>() / robots.len() as f64
        };
        let all = by.values().flatten().map(|robot| robot.size).sum::<f64>() / count as f64;
        let (mut between, mut within) = (0.0, 0.0);
        for robots in by.values() {
            let own = mean(robots);
            between += robots.len() as f64 * (own - all).powi(2);
            within += robots
                .iter()
                .map(|robot| (robot.size - own).powi(2))
                .sum::<f64>();
        }
        let freedom = [(by.len() - 1) as f64, (count - by.len()) as f64];
        let ratio = between / freedom[0] / (within / freedom[1]).max(f64::MIN_POSITIVE);
        (tail(ratio, freedom[0], freedom[1]) < ALPHA / tests.min(20.0)).then(|| {
            let sentences = by
                .iter()
                .map(|(label, robots)| format!("{:.3} mm at {label}", mean(robots)));
            sentences.collect::<Vec<_>>().join(", ")
        })
    };
    let sentences: Vec<String> = labels.into_iter().filter_map(sentence).collect();
    (!sentences.is_empty()).then(|| sentences.join("; "))
}

fn length(size: f64, sigma: f64) -> String {
    format!("{size:.3} +- {sigma:.3}")
}

fn outlier(
    robot: &Sized,
    group: &str,
    cell: &str,
    kind: &str,
    usual_mm: Option<f64>,
    statement: String,
) -> FleetOutlierRow {
    FleetOutlierRow {
        robot: robot.robot.clone(),
        kind: kind.into(),
        cell: cell.into(),
        group: group.into(),
        size_mm: Some(robot.size),
        usual_mm,
        probability: (kind == "lacks").then_some(1.0 - robot.has),
        statement,
    }
}

fn size_row(
    robot: Sized,
    group: &str,
    cell: &str,
    [effect, place]: [&str; 2],
    deviation: Option<f64>,
) -> FleetCellRow {
    FleetCellRow {
        cell: cell.into(),
        robot: robot.robot,
        group: group.into(),
        plant: robot.groups.plant,
        campaign: robot.groups.campaign,
        effect: effect.into(),
        place: place.into(),
        log_evidence: robot.log,
        probability: robot.has,
        size_mm: robot.size,
        sigma_mm: robot.sigma,
        deviation,
    }
}
