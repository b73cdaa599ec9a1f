//! The robot, the recording, and what was read, used and rejected.

use super::Tables;
use super::number::{count, fixed};
use crate::table::{RejectedRow, Robot, RobotRow};
use crate::units::Unit;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Rejected rows that are listed; the table holds all.
const LISTED: usize = 50;

/// The base's name is the robot's.
pub(super) fn robot_name(robot: &Robot) -> String {
    let base = robot.0.iter().find(|body| body.kind == "base");
    base.map(|body| body.name.trim())
        .filter(|name| !name.is_empty())
        .unwrap_or("a robot without a name")
        .to_owned()
}

pub(super) fn section(tables: &Tables) -> Value {
    let recording = &tables.recording;
    let quantities = [
        (recording.position_sigma.is_some(), "measurement sigma"),
        (recording.time.is_some(), "time"),
        (recording.payload.is_some(), "payload"),
        (recording.temperature.is_some(), "temperature"),
        (recording.current.is_some(), "motor current"),
        (recording.direction.is_some(), "direction of approach"),
        (recording.velocity.is_some(), "joint velocities"),
    ];
    let mut sets: BTreeMap<&str, i64> = BTreeMap::new();
    for row in &tables.split.0 {
        *sets.entry(&row.set).or_default() += 1;
    }
    let rejected: Vec<&RejectedRow> = tables.rejected.iter().flat_map(|table| &table.0).collect();
    let reasons: BTreeSet<&String> = rejected.iter().map(|row| &row.reason).collect();
    json!({
        "joints": joints(&tables.robot),
        "tool": tool(&tables.robot),
        "points": count(recording.rows() as i64),
        "quantities": quantities.into_iter().filter_map(|(there, name)| there.then_some(name)).collect::<Vec<_>>(),
        // Set and its rows.
        "sets": sets.into_iter().map(|(name, rows)| (name, count(rows))).collect::<Vec<_>>(),
        "files": tables.intake.iter().flat_map(|table| &table.0).collect::<Vec<_>>(),
        "reasons": reasons.into_iter().cloned().collect::<Vec<_>>(),
        "rejected": rejected.iter().take(LISTED).collect::<Vec<_>>(),
        "rejected_count": count(rejected.len() as i64),
        "unlisted": rejected.len() > LISTED,
        // Table kind and its rows, as read by the report; a sum where several stages wrote one.
        "tables": kinds(tables),
    })
}

fn joints(robot: &Robot) -> Vec<Value> {
    let is_joint = |body: &&RobotRow| body.kind == "revolute" || body.kind == "prismatic";
    let with_travel = |body: &RobotRow| {
        let mut joint = json!(body);
        let degrees = |v| fixed(Unit::Degree.from_si(v), 1);
        let travel = match (
            body.lower_rad.zip(body.upper_rad),
            body.lower_mm.zip(body.upper_mm),
        ) {
            (Some((from, to)), _) => format!("{} to {} deg", degrees(from), degrees(to)),
            (None, Some((from, to))) => format!("{} to {} mm", fixed(from, 1), fixed(to, 1)),
            (None, None) => String::new(),
        };
        joint["travel"] = travel.into();
        joint
    };
    robot.0.iter().filter(is_joint).map(with_travel).collect()
}

fn tool(robot: &Robot) -> Option<String> {
    let tool = robot.0.iter().find(|body| body.kind == "tool")?;
    let mass = tool
        .mass_kg
        .filter(|kg| *kg > 0.0)
        .map_or_else(String::new, |kg| {
            format!(", rated payload {} kg", fixed(kg, 1))
        });
    let point = [tool.point_x_mm?, tool.point_y_mm?, tool.point_z_mm?]
        .map(|v| fixed(v, 3))
        .join(", ");
    Some(format!("{point} mm{mass}"))
}

fn kinds(tables: &Tables) -> Vec<(&'static str, String)> {
    let one = |rows: usize| vec![rows];
    let kinds: [(&str, Vec<usize>); 15] = [
        ("robot", one(tables.robot.0.len())),
        ("recording", one(tables.recording.rows())),
        ("intake", tables.intake.iter().map(|t| t.0.len()).collect()),
        (
            "rejected",
            tables.rejected.iter().map(|t| t.0.len()).collect(),
        ),
        ("split", one(tables.split.0.len())),
        ("parameters", one(tables.parameters.0.len())),
        ("fit", tables.fit.iter().map(|t| t.0.len()).collect()),
        (
            "observability",
            tables.observability.iter().map(|t| t.0.len()).collect(),
        ),
        (
            "training",
            tables.training.iter().map(|t| t.0.len()).collect(),
        ),
        (
            "corrections",
            tables.corrections.iter().map(|t| t.0.len()).collect(),
        ),
        (
            "prediction",
            tables.prediction.iter().map(|t| t.0.len()).collect(),
        ),
        ("statistics", one(tables.statistics.0.len())),
        (
            "suspects",
            tables.suspects.iter().map(|t| t.0.len()).collect(),
        ),
        (
            "findings",
            tables.findings.iter().map(|t| t.0.len()).collect(),
        ),
        ("curves", one(tables.curves.0.len())),
    ];
    let of = |lengths: Vec<usize>| {
        let texts: Vec<String> = lengths.into_iter().map(|n| count(n as i64)).collect();
        if texts.is_empty() {
            "not written".into()
        } else {
            format!("{} rows", texts.join(" + "))
        }
    };
    kinds.map(|(kind, lengths)| (kind, of(lengths))).into()
}
