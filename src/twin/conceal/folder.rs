//! A case as text: what the user has (robot.json, controller.csv, tracker.csv), and the truth that is sealed apart.

use super::case::{Case, Concealed};
use super::design::Content;
use super::family::{Column, FAMILIES};
use super::points::FIT;
use crate::robot::description::RobotDescription;
use crate::twin::effect::Physical;
use serde_json::{Value, json};
use std::fmt::Write;

/// A file's name and its bytes.
pub type File = (&'static str, String);

/// Time from the controller's stamp to the tracker's, s.
const TRACKER_LATER_S: f64 = 1.5;

impl Case {
    /// The files that a user has.
    pub fn recording(&self) -> [File; 3] {
        [("robot.json", pretty(&robot(&self.robot))), ("controller.csv", self.controller()), ("tracker.csv", self.tracked())]
    }

    /// The truth.
    pub fn sealed(&self) -> String {
        let pair = |(effect, place): &(&'static str, String)| json!({ "effect": effect, "where": place });
        let hidden: Vec<&str> = self.hidden.iter().map(|column| title(*column)).collect();
        let tampered = self.tampered.iter().map(|one| {
            let points: Vec<String> = one.rows.iter().map(|row| id(*row)).collect();
            json!({ "effect": one.effect, "where": "recording", "points": points })
        });
        let (family, content) = match self.content {
            Content::Null => (String::new(), "null"),
            Content::Single(row) if FAMILIES[row].name == "unknown" => ("unknown".into(), "open"),
            Content::Single(row) => (FAMILIES[row].name.into(), "single"),
            Content::Pair(a, b) => (format!("{}+{}", FAMILIES[a].name, FAMILIES[b].name), "pair"),
        };
        pretty(&json!({
            "case": self.name,
            "content": content,
            "family": family,
            "seed": self.seed,
            "robot": self.kind.name(),
            "want": self.want().iter().map(pair).collect::<Vec<_>>(),
            "accepted": self.accepted.iter().map(pair).collect::<Vec<_>>(),
            "effects": self.concealed.iter().map(effect).collect::<Vec<_>>(),
            "tampered": tampered.collect::<Vec<_>>(),
            "hidden_columns": hidden,
            "points": { "fit": self.fit, "validate": self.shots.len() - self.fit },
            "geometry_rank": self.geometry_rank,
            "noise": {
                "fit_rms_per_axis_mm": self.noise_mm[0],
                "validate_rms_per_axis_mm": self.noise_mm[1],
                "joint_repeatability_rad": self.play_rad,
                "scatter": self.tracker.scatter,
            },
            "tracker": self.tracker,
            "climate": self.climate,
            "true": self.truth,
        }))
    }

    fn shown(&self, column: Column) -> bool {
        !self.hidden.contains(&column)
    }

    fn controller(&self) -> String {
        let joints = self.robot.joints.len();
        let mut titles = vec!["point_id".to_string()];
        titles.extend(self.shown(Column::Time).then(|| "time_s".into()));
        titles.extend(["use".into(), "payload_kg".into()]);
        titles.extend((1..=joints).map(|joint| format!("q{joint}_deg")));
        if self.shown(Column::Current) {
            titles.extend((1..=joints).map(|joint| format!("i{joint}_a")));
        }
        if self.shown(Column::Direction) {
            titles.extend((1..=joints).map(|joint| format!("dir{joint}")));
        }
        titles.extend(self.shown(Column::Temperature).then(|| "temp_c".into()));
        let mut text = titles.join(",") + "\n";
        for (row, shot) in self.shots.iter().enumerate() {
            let mut cells = vec![id(row)];
            cells.extend(self.shown(Column::Time).then(|| fixed(shot.time_s, 2)));
            cells.push(if shot.block == FIT { "fit".into() } else { "validate".into() });
            cells.push(fixed(self.payload_kg[row], 1));
            // A log that is behind is finer than the controller's steps.
            cells.extend(shot.q.iter().map(|angle| fixed(angle.to_degrees(), 4)));
            if self.shown(Column::Current) {
                cells.extend(shot.current.iter().map(|current| fixed(*current, 4)));
            }
            if self.shown(Column::Direction) {
                cells.extend(shot.direction.iter().map(|side| fixed(*side, 0)));
            }
            cells.extend(self.shown(Column::Temperature).then(|| fixed(self.thermometer_c[row], 2)));
            let _ = writeln!(text, "{}", cells.join(","));
        }
        text
    }

    fn tracked(&self) -> String {
        let timed = self.shown(Column::Time);
        let mut text = format!("point_id,{}x_mm,y_mm,z_mm\n", if timed { "time_s," } else { "" });
        for (row, shot) in self.shots.iter().enumerate() {
            let time = if timed { fixed(shot.time_s + TRACKER_LATER_S, 2) + "," } else { String::new() };
            let [x, y, z] = shot.position.map(|coordinate| fixed(1e3 * coordinate, 5));
            let _ = writeln!(text, "{},{time}{x},{y},{z}", id(row));
        }
        text
    }
}

fn id(row: usize) -> String {
    format!("P{:04}", row + 1)
}

/// So many decimals, and no negative zero.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_string(),
        _ => text,
    }
}

fn title(column: Column) -> &'static str {
    match column {
        Column::Time => "time_s",
        Column::Temperature => "temp_c",
        Column::Current => "current",
        Column::Direction => "direction",
    }
}

fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

/// The layout of a case folder's robot.json: mm, kg, Nm/A, joints from 0.
fn robot(robot: &RobotDescription) -> Value {
    let mm = |v: [f64; 3]| json!(v.map(|x| (1e9 * x).round() / 1e6));
    let joints = &robot.joints;
    let number = |value: Option<f64>| json!(value.unwrap_or_default());
    json!({
        "name": robot.name,
        "axes": joints.iter().map(|joint| json!(joint.axis)).collect::<Vec<_>>(),
        "points": joints.iter().map(|joint| mm(joint.point)).collect::<Vec<_>>(),
        "tool": mm(robot.tool),
        "mass": joints.iter().map(|joint| number(joint.mass)).collect::<Vec<_>>(),
        "com": joints.iter().map(|joint| mm(joint.centre.unwrap_or_default())).collect::<Vec<_>>(),
        "ratio": joints.iter().map(|joint| number(joint.reduction_ratio)).collect::<Vec<_>>(),
        "kt": joints.iter().map(|joint| number(joint.motor_constant)).collect::<Vec<_>>(),
        "payload": robot.payload_mass,
        "payload_com": mm(std::array::from_fn(|axis| robot.payload_centre[axis] - robot.tool[axis])),
        "coupling": robot.couplings.iter().map(|pair| [pair.moved, pair.by]).collect::<Vec<_>>(),
    })
}

fn effect(one: &Concealed) -> Value {
    let numbers = one
        .cause
        .physical
        .iter()
        .flat_map(Physical::truth)
        .map(|number| json!({ "name": number.name, "value": number.value, "unit": number.unit }));
    json!({
        "effect": one.cause.effect,
        "where": one.cause.place,
        "form": one.form,
        "L": one.strength,
        "L_alone": one.strength_alone,
        "rms_mm": one.raw_mm,
        "visible_rms_mm": one.visible_mm,
        "parameters": numbers.collect::<Vec<_>>(),
        "physical": one.cause.physical,
    })
}
