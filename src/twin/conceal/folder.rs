//! A case as text: what the user has (robot.json, controller.csv, tracker.csv), and the truth that is sealed apart.

use super::case::Case;
use super::design::Content;
use super::family::Column;
use super::points::FIT;
use super::size::Concealed;
use crate::effect::Physical;
use crate::folder::{Decimals, File, Log, pretty, robot};
use crate::recorder::Shot;
use crate::true_value::TrueValue;
use calib_foundation::description::RobotDescription;
use serde_json::{Value, json};

/// A controller's display and a tracker's.
const DECIMALS: Decimals = Decimals {
    angle: 4,
    length: 5,
    time: 2,
};

impl Case {
    /// The files that a user has; fails with what of the robot they cannot state.
    pub fn recording(&self) -> Result<[File; 3], String> {
        let log = self.log();
        let (controller, tracker) = (log.controller(DECIMALS), log.tracker(DECIMALS));
        Ok([
            ("robot.json", robot(&self.stated())?),
            ("controller.csv", controller),
            ("tracker.csv", tracker),
        ])
    }

    /// The robot as its file states it.
    fn stated(&self) -> RobotDescription {
        let mut stated = self.robot.clone();
        for joint in stated.joints.iter_mut().filter(|_| self.bare) {
            (joint.mass, joint.centre) = (None, None);
        }
        stated
    }

    /// The truth.
    pub fn sealed(&self) -> String {
        let pair =
            |(effect, place): &(&'static str, String)| json!({ "effect": effect, "where": place });
        let hidden: Vec<&str> = self.hidden.iter().map(|column| column.name()).collect();
        let tampered = self.tampered.iter().map(|one| {
            let points: Vec<String> = one.rows.iter().map(|row| id(*row)).collect();
            json!({ "effect": one.effect, "where": "recording", "points": points })
        });
        let families = self.collection.families();
        let (family, content) = match self.content {
            Content::Null => (String::new(), "null"),
            Content::Single(row) if families[row].name == "unknown" => ("unknown".into(), "open"),
            Content::Single(row) => (families[row].name.into(), "single"),
            Content::Foreign => ("unknown".into(), "foreign"),
            Content::Pair(a, b) => (format!("{}+{}", families[a].name, families[b].name), "pair"),
        };
        pretty(&json!({
            "case": self.name,
            "content": content,
            "family": family,
            "seed": self.seed,
            "robot": self.kind.name(),
            "want": self.want().iter().map(pair).collect::<Vec<_>>(),
            // Whole answers that are as good as `want`; single names that neither count nor hurt.
            "accept": [self.want_all().iter().map(pair).collect::<Vec<_>>()],
            "accepted": self.accepted.iter().map(pair).collect::<Vec<_>>(),
            "effects": self.concealed.iter().map(effect).collect::<Vec<_>>(),
            "tampered": tampered.collect::<Vec<_>>(),
            "hidden_columns": hidden,
            "points": { "fit": self.fit, "validate": self.shots.len() - self.fit },
            "geometry_rank": self.geometry_rank,
            "noise": {
                "fit_rms_per_axis_mm": self.noise_mm[0],
                "validate_rms_per_axis_mm": self.noise_mm[1],
                "unseen_rms_per_axis_mm": self.unseen_mm,
                "joint_repeatability_rad": self.play_rad,
                "scatter": self.tracker.scatter,
            },
            // The whole robot in the settings of the stage `simulate`, effects apart: it can be measured again.
            "tracker": self.tracker,
            "climate": self.climate,
            "true": self.truth,
            "motors": self.motors,
            "friction": self.friction,
        }))
    }

    fn log(&self) -> Log {
        let shown = |column: Column| !self.hidden.contains(&column);
        let each = |value: fn(&Shot) -> f64| self.shots.iter().map(value).collect::<Vec<f64>>();
        let joints = |value: fn(&Shot) -> &Vec<f64>| -> Vec<f64> {
            self.shots.iter().flat_map(value).copied().collect()
        };
        let usage = |shot: &Shot| if shot.block == FIT { "fit" } else { "validate" }.to_string();
        Log {
            joints: self.robot.joints.len(),
            id: (0..self.shots.len()).map(id).collect(),
            time_s: shown(Column::Time).then(|| each(|shot| shot.time_s)),
            usage: self.shots.iter().map(usage).collect(),
            payload_kg: self.payload_kg.clone(),
            q: joints(|shot| &shot.q),
            current: shown(Column::Current).then(|| joints(|shot| &shot.current)),
            direction: shown(Column::Direction).then(|| joints(|shot| &shot.direction)),
            velocity: None,
            at_once: false,
            temperature_c: shown(Column::Temperature).then(|| self.thermometer_c.clone()),
            position: self.shots.iter().map(|shot| shot.position).collect(),
        }
    }
}

fn id(row: usize) -> String {
    format!("P{:04}", row + 1)
}

fn effect(one: &Concealed) -> Value {
    let number = |one: TrueValue| json!({ "name": one.name, "value": one.value, "unit": one.unit });
    let numbers = one
        .cause
        .physical
        .iter()
        .flat_map(Physical::truth)
        .map(number);
    let mut out = json!({
        "effect": one.cause.effect,
        "where": one.cause.place,
        "form": one.form,
        "wanted": one.cause.wanted,
        "L": one.strength,
        "L_alone": one.strength_alone,
        "rms_mm": one.raw_mm,
        "visible_rms_mm": one.visible_mm,
        "parameters": numbers.collect::<Vec<_>>(),
        "physical": one.cause.physical,
    });
    if one.strange {
        out["strange"] = json!(true);
    }
    out
}
