//! The robot, the recording, and what was read, used and rejected.
//!
//! `report.json`: what the report says, for other programs. Every figure is a column of a table.

use crate::certificate::Judgement;
use crate::error::Result;
use crate::language::{Locale, say};
use crate::number::count;
use crate::table::{RejectedRow, Robot, RobotRow, VerdictTopic, picked, picked_of};
use crate::units::Unit;
use crate::{Report, Tables, result};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Rejected rows that are listed; the table holds all.
const LISTED: usize = 50;

/// The base's name is the robot's.
pub(super) fn robot_name(locale: &Locale, robot: &Robot) -> String {
    let base = robot.0.iter().find(|body| body.kind == "base");
    base.map(|body| body.name.trim().to_owned())
        .filter(|name| !name.is_empty())
        .unwrap_or_else(|| say!(locale, "a robot without a name"))
}

pub(super) fn section(locale: &Locale, tables: &Tables) -> Value {
    let recording = &tables.recording;
    let quantities = [
        (
            recording.position_sigma.is_some(),
            say!(locale, "measurement sigma"),
        ),
        (recording.time.is_some(), say!(locale, "time")),
        (recording.payload.is_some(), say!(locale, "payload")),
        (recording.temperature.is_some(), say!(locale, "temperature")),
        (recording.current.is_some(), say!(locale, "motor current")),
        (
            recording.direction.is_some(),
            say!(locale, "direction of approach"),
        ),
        (
            recording.velocity.is_some(),
            say!(locale, "joint velocities"),
        ),
    ];
    let mut sets: BTreeMap<&str, i64> = BTreeMap::new();
    for row in &tables.split.0 {
        *sets.entry(&row.set).or_default() += 1;
    }
    let rejected: Vec<&RejectedRow> = tables.rejected.iter().flat_map(|table| &table.0).collect();
    let reasons: BTreeSet<&String> = rejected.iter().map(|row| &row.reason).collect();
    json!({
        "joints": joints(locale, &tables.robot),
        "tool": tool(locale, &tables.robot),
        "points": count(recording.rows() as i64),
        "quantities": quantities.into_iter().filter_map(|(there, name)| there.then_some(name)).collect::<Vec<_>>().join(", "),
        // Set and its rows.
        "sets": sets.into_iter().map(|(name, rows)| format!("{name} {}", count(rows))).collect::<Vec<_>>().join(", "),
        "files": tables.intake.iter().flat_map(|table| &table.0).collect::<Vec<_>>(),
        "reasons": reasons.into_iter().cloned().collect::<Vec<_>>(),
        "rejected": rejected.iter().take(LISTED).collect::<Vec<_>>(),
        "rejected_count": count(rejected.len() as i64),
        "unlisted": rejected.len() > LISTED,
        // Table kind and its rows, as read by the report; a sum where several stages wrote one.
        "tables": kinds(locale, tables),
    })
}

fn joints(locale: &Locale, robot: &Robot) -> Vec<Value> {
    let is_joint = |body: &&RobotRow| body.kind == "revolute" || body.kind == "prismatic";
    let with_travel = |body: &RobotRow| {
        let mut joint = json!(body);
        let degrees = |v| locale.fixed(Unit::Degree.from_si(v), 1);
        let travel = match (
            body.lower_rad.zip(body.upper_rad),
            body.lower_mm.zip(body.upper_mm),
        ) {
            (Some((from, to)), _) => {
                say!(
                    locale,
                    "{from} to {to} deg",
                    from = degrees(from),
                    to = degrees(to)
                )
            }
            (None, Some((from, to))) => {
                let [from, to] = [from, to].map(|v| locale.fixed(v, 1));
                say!(locale, "{from} to {to} mm", from, to)
            }
            (None, None) => String::new(),
        };
        joint["travel"] = travel.into();
        joint
    };
    robot.0.iter().filter(is_joint).map(with_travel).collect()
}

fn tool(locale: &Locale, robot: &Robot) -> Option<String> {
    let tool = robot.0.iter().find(|body| body.kind == "tool")?;
    let [x, y, z] =
        [tool.point_x_mm?, tool.point_y_mm?, tool.point_z_mm?].map(|v| locale.fixed(v, 3));
    let point = say!(locale, "{x}, {y}, {z}", x, y, z);
    Some(match tool.mass_kg.filter(|kg| *kg > 0.0) {
        Some(kg) => {
            let mass = locale.fixed(kg, 1);
            say!(
                locale,
                "measured point {point} mm, rated payload {mass} kg",
                point,
                mass
            )
        }
        None => say!(locale, "measured point {point} mm", point),
    })
}

fn kinds(locale: &Locale, tables: &Tables) -> Vec<(&'static str, String)> {
    // Of a list of tables the rows of each.
    macro_rules! rows {
        ($table:ident) => {
            (stringify!($table), vec![tables.$table.0.len()])
        };
        ([$table:ident]) => {
            (
                stringify!($table),
                tables.$table.iter().map(|table| table.0.len()).collect(),
            )
        };
    }
    let kinds: [(&str, Vec<usize>); 15] = [
        rows!(robot),
        ("recording", vec![tables.recording.rows()]),
        rows!([intake]),
        rows!([rejected]),
        rows!(split),
        rows!(parameters),
        rows!([fit]),
        rows!([observability]),
        rows!([training]),
        rows!([corrections]),
        rows!([prediction]),
        rows!(statistics),
        rows!([suspects]),
        rows!([findings]),
        rows!(curves),
    ];
    kinds
        .map(|(kind, lengths)| {
            let rows: Vec<String> = lengths.iter().map(|rows| count(*rows as i64)).collect();
            let words = match rows.is_empty() {
                true => say!(locale, "not written"),
                false => say!(locale, "{rows} rows", rows = rows.join(" + ")),
            };
            (kind, words)
        })
        .into()
}

/// The document; `judgement` is that of the page.
pub(super) fn document(
    tables: &Tables,
    asked: &Report,
    (robot, title): (String, String),
    judgement: Option<&Judgement>,
) -> Result<String> {
    let findings = tables.findings_with_rivals();
    let findings = findings.iter().map(|finding| {
        let evidence = "f_statistic p_value delta_bic heldout_gain_mm";
        let mut document = result::document(finding, evidence);
        document["rank"] = finding["rank"].clone();
        document
    });
    let diagnosis = tables.verdict.iter().flat_map(|table| &table.0).next_back().map(|row| {
        let columns = "step verdict statement noise_basis noise_floor_mm before_rms_mm after_rms_mm clock";
        let mut diagnosis = picked(row, columns);
        diagnosis["not_observable"] = json!(tables.statements(&row.step, VerdictTopic::NotObservable));
        diagnosis
    });
    let limits = judgement.map(|judgement| {
        let figures = judgement.found().map(|(row, _)| row);
        json!({
            "asked": !judgement.limits.is_empty(), "kept": judgement.kept, "sentence": judgement.sentence(&Locale::default()),
            "figures": picked_of(figures, "figure found_mm limit_mm kept"),
        })
    });
    let counting = tables.counting.as_ref().map_or_else(
        || "robot file".into(),
        |difference| format!("robot file; the controller counts otherwise: {difference}"),
    );
    let document = json!({
        "calib_report": 1,
        "title": title,
        "robot": robot,
        "calib": env!("CARGO_PKG_VERSION"),
        "identity": asked.identity,
        "standing": tables.standing,
        "withdrawn": tables.withdrawn,
        "limits": limits,
        "statistics": picked_of(
            &tables.statistics.0,
            "step set held_out points mean_mm std_mm p95_mm max_mm rms_mm median_mm noise_rms_mm noise_basis",
        ),
        "diagnosis": diagnosis,
        "findings": findings.collect::<Vec<_>>(),
        "corrections": picked_of(
            tables.corrections.iter().flat_map(|table| &table.0),
            "step rival chosen reason before_mm mean_mm rms_mm max_mm gain_mm gain_sigma_mm numbers",
        ),
        "parameters_counting": counting,
        "parameters": picked_of(&tables.parameters.0, "name where=place unit nominal value sigma status"),
        "rejected_rows": tables.rejected.iter().map(|table| table.0.len()).sum::<usize>(),
        "suspects": tables.suspects.iter().map(|table| table.0.len()).sum::<usize>(),
        "tables": tables.hashes.iter().map(|(kind, hash)| json!({ "table": kind, "content": hash })).collect::<Vec<_>>(),
    });
    Ok(format!("{document:#}\n"))
}
