//! The page of a diagnosis of torques: what was found, and measured, simulated and corrected torque of each joint over time.

use super::data;
use super::language::Locale;
use super::number::render;
use super::result;
use super::svg::{Area, Scale, Svg, baseline, name_x, name_y};
use crate::error::{Error, Result};
use crate::table::{
    BodyConsistencies, Contacts, FrictionCurveRow, FrictionCurves, Inertials, JointTorques,
    Labelled, Robot, TorqueCourse, TorqueFindingRow, TorqueFindings, TorqueNumbers, TorqueRivals,
    TorqueVerdict, VerdictSentences, VerdictTopic,
};
use serde_json::{Value, json};

crate::table::reads! {
    /// What the page is made of; sentences are of every diagnosis, each asked for by its step.
    pub struct ReportTorquesReads {
        robot: Robot,
        verdict: TorqueVerdict,
        sentences: Vec<Labelled<VerdictSentences>>,
        findings: TorqueFindings,
        numbers: TorqueNumbers,
        rivals: TorqueRivals,
        joints: JointTorques,
        course: TorqueCourse,
        friction: FrictionCurves,
        inertials: Inertials,
        contacts: Contacts,
        consistency: BodyConsistencies,
    }
}

/// The page; fails where the verdict is missing.
pub fn torque_page(
    tables: &ReportTorquesReads,
    title: Option<&str>,
    hashes: &[(String, String)],
) -> Result<String> {
    let verdict = tables.verdict.0.first();
    let verdict =
        verdict.ok_or_else(|| Error::Bug("a diagnosis of torques without a verdict".into()))?;
    let locale = Locale::default();
    let robot = data::robot_name(&locale, &tables.robot);
    let sentences_of = |topic| -> Vec<&str> {
        let all = tables.sentences.iter();
        all.flat_map(|table| table.about(&verdict.step, topic))
            .collect()
    };
    let page = json!({
        "title": title.map_or_else(|| format!("Torques of {robot}"), str::to_owned),
        "robot": robot,
        "joints": tables.course.joints,
        "slides": &tables.course.prismatic,
        "verdict": verdict,
        "grid": grid(&tables.findings.0),
        "findings": result::findings(&tables.findings.0, &tables.numbers.0, &tables.rivals.0),
        "errors": &tables.joints.0,
        "pictures": (0..tables.course.joints).map(|joint| pictures(&locale, tables, joint)).collect::<Vec<_>>(),
        "contacts": &tables.contacts.0,
        "inertials": &tables.inertials.0,
        "bodies": &tables.consistency.0,
        "not_observable": sentences_of(VerdictTopic::NotObservable),
        "remarks": sentences_of(VerdictTopic::Remark),
        "hashes": hashes,
    });
    render(&locale, "torques.html", include_str!("torques.html"), page)
}

/// What torques follow, as columns of the table of causes, each with the causes that do.
const FOLLOWED: [(&str, &[&str]); 6] = [
    (
        "own speed",
        &[
            "viscous_friction",
            "coulomb_friction",
            "asymmetric_friction",
            "stribeck_friction",
            "presliding_friction",
            "backlash_spikes",
        ],
    ),
    ("load", &["load_friction", "torque_constant"]),
    (
        "own angle",
        &[
            "torque_ripple",
            "spring_balance",
            "cable_stiffness",
            "link_mass",
            "link_com",
            "payload_error",
            "gravity_direction",
        ],
    ),
    (
        "acceleration",
        &["rotor_inertia", "link_inertia", "joint_elasticity"],
    ),
    ("time", &["warmup_friction", "contact", "current_latency"]),
    ("constant", &["current_offset"]),
];
/// What a cause without a name follows is the end of its statement.
const DEPENDS: [(&str, &str); 3] = [
    ("the angle of the joint", "own angle"),
    ("the velocity of the joint", "own speed"),
    ("the load of the joint", "load"),
];
const OTHER: &str = "other";

/// What a finding's torque follows.
fn followed(finding: &TorqueFindingRow) -> &'static str {
    let of_name = |(_, names): &&(&str, &[&str])| names.contains(&&*finding.effect);
    let statement = finding.statement.trim_end_matches('.');
    let depends = DEPENDS.iter().find(|(end, _)| statement.ends_with(end));
    let named = FOLLOWED.iter().find(of_name).map(|(column, _)| *column);
    named
        .or(depends.map(|(_, column)| *column))
        .unwrap_or(OTHER)
}

/// The table of causes: places down the chain, what is followed across; size in Nm and the names.
fn grid(findings: &[TorqueFindingRow]) -> Value {
    let columns = FOLLOWED.iter().map(|(column, _)| *column).chain([OTHER]);
    let columns: Vec<&str> = columns
        .filter(|column| findings.iter().any(|finding| followed(finding) == *column))
        .collect();
    let mut places: Vec<&str> = findings.iter().map(|finding| &*finding.place).collect();
    places.sort_by_key(|place| place_order(place));
    places.dedup();
    let largest = findings
        .iter()
        .map(|finding| finding.effect_rms_nm)
        .fold(0.0, f64::max);
    let cell = |place: &str, column: &str| {
        let here: Vec<&TorqueFindingRow> = findings
            .iter()
            .filter(|finding| finding.place == place && followed(finding) == column)
            .collect();
        let nm = here
            .iter()
            .map(|finding| finding.effect_rms_nm)
            .reduce(f64::max)?;
        let names: Vec<&str> = here.iter().map(|finding| &*finding.effect).collect();
        let share = nm / largest.max(f64::MIN_POSITIVE);
        let shade = [0.01, 0.03, 0.1, 0.3, 0.6, 0.9]
            .iter()
            .filter(|edge| share >= **edge)
            .count();
        Some(json!({ "nm": nm, "names": names, "shade": shade, "open": names == ["unknown"] }))
    };
    let row = |place: &&str| {
        let cells: Vec<_> = columns.iter().map(|column| cell(place, column)).collect();
        json!({ "place": place, "cells": cells })
    };
    json!({ "columns": columns, "rows": places.iter().map(row).collect::<Vec<_>>() })
}

/// Down the chain; what is no joint or link stands below.
fn place_order(place: &str) -> (i64, String) {
    let number = place.split([' ', '-']).find_map(|word| word.parse().ok());
    (number.unwrap_or(i64::MAX), place.into())
}

fn pictures(locale: &Locale, tables: &ReportTorquesReads, joint: usize) -> Value {
    let course = &tables.course;
    let of_joint = |all: &[f64]| course.of_joint(all, joint).collect::<Vec<f64>>();
    let (measured, simulated, corrected) = (
        of_joint(&course.measured),
        of_joint(&course.simulated),
        of_joint(&course.corrected),
    );
    let less = |model: &[f64]| {
        measured
            .iter()
            .zip(model)
            .map(|(m, model)| m - model)
            .collect::<Vec<f64>>()
    };
    let (before, after) = (less(&simulated), less(&corrected));
    let slides = course.prismatic[joint];
    let unit = if slides { "N" } else { "Nm" };
    let name = format!("joint {}", joint + 1);
    let clock = (course.time.as_slice(), course.held_out.as_slice());
    let torque = [
        ("s1", simulated.as_slice()),
        ("s0", &measured),
        ("s-last", &corrected),
    ];
    let curve: Vec<&FrictionCurveRow> = tables
        .friction
        .0
        .iter()
        .filter(|row| row.joint == joint as i64 + 1)
        .collect();
    json!({
        "torque": over_time(locale, clock, &torque, [&format!("torque of {name}: measured, simulated, corrected"), unit]),
        "error": over_time(locale, clock, &[("s1", &before), ("s-last", &after)], [&format!("error of {name} before and after"), unit]),
        "friction": (!curve.is_empty()).then(|| friction(locale, &curve, slides, &format!("friction of {name}"))),
        "name": name,
    })
}

const WIDTH: f64 = 640.0;
/// Steps of time in a picture: more would not be seen; of each the least and the largest value are drawn.
const STEPS: usize = 300;
/// Steps of the clock without rows that break a line.
const GAP: f64 = 8.0;

/// Lines over time, of rows with whether they are held out, which is shaded; the title, and what is over time.
pub(super) fn over_time(
    locale: &Locale,
    (time, held_out): (&[f64], &[bool]),
    lines: &[(&str, &[f64])],
    [title, what]: [&str; 2],
) -> String {
    let area = Area::new([52.0, 26.0, WIDTH - 14.0, 200.0]);
    let (first, last) = (
        time.first().copied().unwrap_or(0.0),
        time.last().copied().unwrap_or(1.0),
    );
    let all = || lines.iter().flat_map(|(_, values)| values.iter().copied());
    let (low, high) = (
        all().fold(f64::INFINITY, f64::min),
        all().fold(f64::NEG_INFINITY, f64::max),
    );
    let x = Scale::linear(first, last).over(area.left, area.right);
    let y = Scale::linear(low.min(0.0), high.max(0.0)).over(area.bottom, area.top);
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    let stretches = stretches(time);
    for rows in &stretches {
        let held = |row: &usize| held_out.get(*row).copied().unwrap_or(false);
        if let (Some(from), Some(to)) = (rows.clone().find(held), rows.clone().rfind(held)) {
            let (left, right) = (x.at(time[from]), x.at(time[to]));
            svg.rect(
                "held",
                [left, area.top],
                [right - left, area.bottom - area.top],
            );
        }
    }
    x.grid_x(&mut svg, area, 8);
    y.grid_y(&mut svg, area, 5);
    let every = time.len().div_ceil(STEPS).max(1);
    for (colour, values) in lines {
        for rows in &stretches {
            let mut points = Vec::new();
            for from in rows.clone().step_by(every) {
                let step = from..(from + every).min(rows.end);
                let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
                let mut ends = [step.clone().min_by(by_value), step.max_by(by_value)];
                ends.sort();
                points.extend(
                    ends.into_iter()
                        .flatten()
                        .map(|row| [x.at(time[row]), y.at(values[row])]),
                );
            }
            points.dedup();
            svg.path(&format!("curve {colour}"), &points);
        }
    }
    baseline(&mut svg, area);
    name_x(&mut svg, area, "time, s");
    name_y(&mut svg, area, what);
    svg.finish(title)
}

/// Rows without a gap of the clock.
fn stretches(time: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let mut stretches = Vec::new();
    let mut begin = 0;
    for row in 1..time.len() {
        if time[row] - time[row - 1] > GAP * usual {
            stretches.push(begin..row);
            begin = row;
        }
    }
    stretches.push(begin..time.len());
    stretches
}

/// Friction over velocity with a band of two standard deviations.
fn friction(locale: &Locale, curve: &[&FrictionCurveRow], slides: bool, title: &str) -> String {
    let area = Area::new([52.0, 26.0, 406.0, 200.0]);
    let ends = |sign: f64| {
        curve
            .iter()
            .map(move |row| row.torque_nm + sign * 2.0 * row.sigma_nm)
    };
    let (low, high) = (
        ends(-1.0).fold(0.0, f64::min),
        ends(1.0).fold(0.0, f64::max),
    );
    let velocity = || curve.iter().map(|row| row.velocity_rad_s);
    let x = Scale::linear(
        velocity().fold(0.0, f64::min),
        velocity().fold(0.0, f64::max),
    )
    .over(area.left, area.right);
    let y = Scale::linear(low, high).over(area.bottom, area.top);
    let mut svg = Svg::new(locale, 420.0, area.bottom + 38.0);
    x.grid_x(&mut svg, area, 6);
    y.grid_y(&mut svg, area, 5);
    let point = |row: &&FrictionCurveRow, sigmas: f64| {
        [
            x.at(row.velocity_rad_s),
            y.at(row.torque_nm + sigmas * row.sigma_nm),
        ]
    };
    let upper = curve.iter().map(|row| point(row, 2.0));
    let lower = curve.iter().rev().map(|row| point(row, -2.0));
    svg.path("band s-last", &upper.chain(lower).collect::<Vec<_>>());
    svg.path(
        "curve s-last",
        &curve.iter().map(|row| point(row, 0.0)).collect::<Vec<_>>(),
    );
    baseline(&mut svg, area);
    let [x, y] = match slides {
        true => ["velocity, m/s", "friction, N"],
        false => ["velocity, rad/s", "friction, Nm"],
    };
    name_x(&mut svg, area, x);
    name_y(&mut svg, area, y);
    svg.finish(title)
}
