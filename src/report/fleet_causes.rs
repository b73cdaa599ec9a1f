//! What the robots of a fleet have in common, as one self-contained page: the table of causes, every robot's size, who needs a technician.

use super::Page;
use super::language::{Locale, PageLanguage, say};
use super::number::render;
use super::svg::Svg;
use crate::error::{Result, visible};
use crate::table::{FleetCellRow, FleetCells, FleetFindingRow, FleetFindings, FleetOutliers};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Name of an effect that no cause of the list is.
const UNNAMED: &str = "unknown";
/// Robots that are named at the head, at most: a morning of visits. The table has all.
const NAMED: usize = 40;
/// Standard deviations from its siblings from which a robot is marked: of 2,000 robots with five causes each, chance marks one.
const OFF: f64 = 4.0;
/// Sizes (mm) at the ends of the scale of colours: what a tracker just tells, and what stops a process. Of torques (Nm) a hundred times as much,
/// which is friction of a small wrist and of a large shoulder.
const SCALE: [f64; 2] = [0.003, 1.0];

/// The page.
pub fn html(
    name: &str,
    findings: &FleetFindings,
    cells: &FleetCells,
    outliers: &FleetOutliers,
    language: PageLanguage,
) -> Result<Page> {
    let locale = &Locale::new(language);
    // What a robot has or lacks comes before its size, and that before recordings that could not be asked.
    let rank = |kind: &str| {
        ["alone", "lacks", "larger", "smaller", "not_asked"]
            .iter()
            .position(|other| *other == kind)
    };
    let mut urgent: Vec<_> = outliers.0.iter().collect();
    urgent.sort_by_key(|row| rank(&row.kind));
    let shared: Vec<&FleetFindingRow> = findings
        .0
        .iter()
        .filter(|row| row.robot.is_empty())
        .collect();
    let names: BTreeSet<&str> = shared.iter().map(|row| row.group.as_str()).collect();
    let asked: BTreeSet<&str> = cells.0.iter().map(|row| row.robot.as_str()).collect();
    let groups = names.iter().map(|group| {
        let of_cell: Vec<&FleetFindingRow> = shared
            .iter()
            .copied()
            .filter(|row| row.group == **group)
            .collect();
        self::group(locale, group, &of_cell, cells)
    });
    let mut groups: Vec<Value> = groups.collect();
    if groups.is_empty() {
        groups.push(json!({ "name": "", "rows": [], "columns": [], "findings": [], "strips": [] }));
    }
    let page = json!({
        "name": name,
        "title": say!(locale, "Fleet {name}: causes", name),
        "policy": "; script-src 'unsafe-inline'; img-src data:",
        "style": concat!(include_str!("fleet.css"), include_str!("fleet_causes.css")),
        "script": include_str!("fleet.js"),
        "lead": say!(
            locale,
            "Causes that robots have in common: {shared}; of single robots: {single}; robots with a size of one of them: {asked}.",
            shared = shared.len(), single = findings.0.len() - shared.len(), asked = asked.len()
        ),
        "urgent": urgent.iter().take(NAMED).map(|row| outlier(locale, &row.kind, &visible(&row.statement))).collect::<Vec<_>>(),
        "more": urgent.len().saturating_sub(NAMED),
        "groups": groups,
        "heads": shared.iter().map(|row| words(locale, &row.effect, &row.place)).collect::<Vec<_>>(),
        "robots": robots(locale, &shared, cells),
    });
    let template = include_str!("fleet_causes.html");
    let html = render(locale, "fleet_causes.html", template, page)?;
    Ok(Page {
        html,
        missing: locale.missing(),
    })
}

fn words(locale: &Locale, effect: &str, place: &str) -> String {
    locale.stored(&format!("{} at {place}", effect.replace('_', " ")))
}

/// Why somebody should look at a robot; what kept it from being asked is as calib said it of the data.
fn outlier(locale: &Locale, kind: &str, statement: &str) -> String {
    match kind {
        "not_asked" => statement.into(),
        _ => locale.stored(statement),
    }
}

/// A size; a length in the unit in which it is short.
fn short(locale: &Locale, size: f64, unit: &str) -> String {
    match unit {
        "mm" if size < 1.0 => format!("{:.0} \u{b5}m", 1e3 * size),
        "mm" => format!("{} mm", locale.fixed(size, 1)),
        _ => format!("{} {unit}", locale.fixed(size, 2)),
    }
}

fn along(place: &str) -> (usize, String) {
    let number = |text: &str| {
        let digits: String = text.chars().take_while(char::is_ascii_digit).collect();
        digits.parse::<usize>().unwrap_or(0)
    };
    let rank = match place.split_once(' ') {
        Some(("joint", number_text)) => 2 * number(number_text),
        Some(("link", number_text)) => 2 * number(number_text) + 1,
        _ if place == "base" => 0,
        _ if place == "tool" => 1000,
        _ => 1001,
    };
    (rank, place.into())
}

fn group(locale: &Locale, name: &str, findings: &[&FleetFindingRow], cells: &FleetCells) -> Value {
    let columns: BTreeSet<&str> = findings.iter().map(|row| row.follows.as_str()).collect();
    let mut places: Vec<&str> = findings.iter().map(|row| row.place.as_str()).collect();
    places.sort_by_key(|place| along(place));
    places.dedup();
    let rows = places.iter().map(|place| {
        let cell = |column: &&str| {
            let here = findings
                .iter()
                .filter(|row| row.place == **place && row.follows == **column);
            let here: Vec<_> = here.collect();
            let Some(first) = here.first() else {
                return json!({ "name": "", "open": false });
            };
            let size = here.iter().map(|row| row.size).fold(0.0, f64::max);
            let effects: Vec<String> = here
                .iter()
                .map(|row| locale.stored(&row.effect.replace('_', " ")))
                .collect();
            let share = first.robots as f64 / first.of_robots.max(1) as f64;
            let scaled = if first.unit == "mm" {
                size
            } else {
                0.01 * size
            };
            let strong = (scaled / SCALE[0]).max(1.0).ln() / (SCALE[1] / SCALE[0]).ln();
            json!({
                "name": effects.join(", "),
                "open": here.iter().any(|row| row.effect == UNNAMED),
                "size": short(locale, size, &first.unit),
                "share": say!(locale, "{shown} of {all}", shown = first.robots, all = first.of_robots),
                "height": (100.0 * share).round(),
                "strong": (20.0 + 50.0 * strong.min(1.0)).round(),
            })
        };
        json!({ "place": place, "cells": columns.iter().map(cell).collect::<Vec<_>>() })
    });
    let lines = findings.iter().map(|row| {
        let statement = locale.stored(&visible(&row.statement));
        let p = locale.fixed(row.probability, 2);
        match &row.rival {
            None => say!(locale, "{statement} (probability {p})", statement, p),
            Some(rival) => {
                let rival = locale.stored(rival);
                say!(
                    locale,
                    "{statement} (probability {p}; or {rival})",
                    statement,
                    p,
                    rival
                )
            }
        }
    });
    let strips = findings.iter().map(|row| {
        let sizes: Vec<&FleetCellRow> = cells
            .0
            .iter()
            .filter(|cell| cell.cell == row.cell && cell.group == row.group)
            .filter(|cell| cell.deviation.is_some())
            .collect();
        json!({ "title": words(locale, &row.effect, &row.place), "svg": strip(locale, &sizes, row) })
    });
    json!({
        "name": visible(name),
        "columns": &columns,
        "rows": rows.collect::<Vec<_>>(),
        "findings": lines.collect::<Vec<_>>(),
        "strips": strips.collect::<Vec<_>>(),
    })
}

/// Width of a strip, and of the labels at its left.
const WIDTH: [f64; 2] = [760.0, 110.0];

/// Every robot's size with its standard deviation, a lane for each plant.
fn strip(locale: &Locale, robots: &[&FleetCellRow], finding: &FleetFindingRow) -> String {
    let (usual, all) = (finding.size, say!(locale, "all"));
    let mut lanes: BTreeMap<&str, Vec<&FleetCellRow>> = BTreeMap::new();
    for robot in robots {
        lanes
            .entry(robot.plant.as_deref().unwrap_or(&all))
            .or_default()
            .push(robot);
    }
    let largest = robots
        .iter()
        .map(|robot| robot.size + robot.sigma)
        .fold(usual, f64::max);
    let at = |mm: f64| WIDTH[1] + (WIDTH[0] - WIDTH[1] - 20.0) * mm.max(0.0) / largest.max(1e-9);
    let high = |count: usize| (3.0 * count as f64).clamp(26.0, 150.0);
    let height = lanes
        .values()
        .map(|lane| high(lane.len()) + 8.0)
        .sum::<f64>()
        + 22.0;
    let mut svg = Svg::new(locale, WIDTH[0], height);
    let mut top = 2.0;
    for (name, mut lane) in lanes {
        lane.sort_by(|a, b| a.size.total_cmp(&b.size));
        let (space, count) = (high(lane.len()), lane.len() as f64);
        svg.text("lane", [2.0, top + 0.5 * space + 4.0], &visible(name));
        for (k, robot) in lane.iter().enumerate() {
            let y = top + space * (k as f64 + 0.5) / count;
            let is_off =
                robot.deviation.is_some_and(|by| by.abs() > OFF) || robot.probability < 0.2;
            let [from, to] = [-1.0, 1.0].map(|sign| at(robot.size + sign * robot.sigma));
            svg.line("sigma", [from, y], [to, y]);
            svg.circle(
                if is_off { "off" } else { "robot" },
                [at(robot.size), y],
                if is_off { 3.2 } else { 2.0 },
            );
        }
        top += space + 8.0;
    }
    svg.line("usual", [at(usual), 0.0], [at(usual), top]);
    svg.line("axis", [at(0.0), top], [at(largest), top]);
    svg.text("first", [at(0.0), top + 16.0], "0");
    svg.text(
        "end",
        [at(largest), top + 16.0],
        &short(locale, largest, &finding.unit),
    );
    let usual = short(locale, usual, &finding.unit);
    svg.finish(&say!(
        locale,
        "Size of every robot, {usual} as a rule",
        usual
    ))
}

/// A row for each robot with its size of every shared cause.
fn robots(locale: &Locale, shared: &[&FleetFindingRow], cells: &FleetCells) -> Vec<Value> {
    let column: BTreeMap<(&str, &str), usize> = shared
        .iter()
        .enumerate()
        .map(|(k, row)| ((row.group.as_str(), row.cell.as_str()), k))
        .collect();
    let mut by: BTreeMap<&str, (Vec<Value>, f64, String)> = BTreeMap::new();
    for cell in &cells.0 {
        let Some(k) = column.get(&(cell.group.as_str(), cell.cell.as_str())) else {
            continue;
        };
        let labels = [
            Some(&cell.group),
            cell.plant.as_ref(),
            cell.campaign.as_ref(),
        ];
        let label = || {
            let given = labels
                .into_iter()
                .flatten()
                .filter(|label| !label.is_empty());
            given
                .map(|label| visible(label))
                .collect::<Vec<_>>()
                .join(", ")
        };
        let robot = by
            .entry(&cell.robot)
            .or_insert_with(|| (vec![Value::Null; shared.len()], 0.0, label()));
        robot.0[*k] = json!({ "value": cell.size, "shown": format!("{} \u{b1} {}", locale.fixed(cell.size, 3), locale.fixed(cell.sigma, 3)) });
        let off = cell.deviation.unwrap_or(0.0);
        if off.abs() > robot.1.abs() {
            robot.1 = off;
        }
    }
    let mut all: Vec<_> = by.into_iter().collect();
    all.sort_by(|a, b| b.1.1.abs().total_cmp(&a.1.1.abs()).then(a.0.cmp(b.0)));
    all.into_iter()
        .map(|(name, (cells, off, group))| {
            json!({ "name": visible(name), "group": group, "deviation": off, "is_off": off.abs() > OFF, "cells": cells })
        })
        .collect()
}
