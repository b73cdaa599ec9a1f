//! A case as text: what the user has (robot.json, recording.csv), and the truth.

use super::draw::TorqueCase;
use super::law::Law;
use super::record::TorqueRows;
use crate::folder::robot_json;
use serde_json::{Value, json};
use std::fmt::Write;

/// A file's name and its bytes.
pub type TorqueFile = (&'static str, String);

impl TorqueCase {
    /// robot.json and recording.csv.
    pub fn recording(&self) -> [TorqueFile; 2] {
        let rows = self.true_rows();
        [
            ("robot.json", pretty(&self.robot_json())),
            ("recording.csv", self.csv(&rows)),
        ]
    }

    /// The truth: what is concealed, with its numbers and how visible each effect is.
    pub fn sealed(&self) -> String {
        let rows = self.true_rows();
        let pair = |effect: &str, place: &str| json!({ "effect": effect, "where": place });
        let seen = self.visible(&rows);
        let mut accepted = Vec::new();
        let mut effects = Vec::new();
        for (number, (law, seen)) in self.laws.iter().zip(&seen).enumerate() {
            let kin = law.kin().iter().map(|effect| pair(effect, &law.place()));
            let same: Vec<Value> = seen
                .same
                .iter()
                .map(|(effect, place)| pair(effect, place))
                .chain(kin)
                .collect();
            let other = law.is_of_another_form();
            accepted.extend(same.iter().cloned());
            effects.push(json!({
                "effect": law.name(), "where": law.place(), "form": if other { "other" } else { "usual" }, "strange": other,
                "wanted": number >= self.common, "same": same, "law": format!("{law:?}"),
                "L": seen.l, "L_before_projection": seen.before, "parameters": [],
            }));
        }
        let names: Vec<&str> = self.laws[self.common..].iter().map(Law::name).collect();
        let to_fit = rows.to_fit();
        pretty(&json!({
            "case": self.name, "content": self.content.name(), "family": names.join("+"), "robot": self.robot.name,
            "seed": self.seed, "accepted": accepted, "effects": effects, "tampered": [],
            "points": { "fit": to_fit, "validate": rows.validate.len() - to_fit },
            "noise_nm": { "white": self.white, "lasting": self.lasting },
        }))
    }

    fn csv(&self, rows: &TorqueRows) -> String {
        let n = self.stated.axes.len();
        let (angles, signal) = self.measured(rows);
        let names = |name: &str| {
            (1..=n)
                .map(|j| name.replace("{j}", &j.to_string()))
                .collect::<Vec<_>>()
                .join(",")
        };
        let (signal_name, decimals) = if self.sensors {
            ("tau{j}_nm", 2)
        } else {
            ("i{j}_a", 3)
        };
        let mut text = format!(
            "time_s,traj,use,{},{}\n",
            names("q{j}_deg"),
            names(signal_name)
        );
        for row in 0..rows.time.len() {
            let usage = if rows.validate[row] {
                "validate"
            } else {
                "fit"
            };
            let _ = write!(
                text,
                "{:.3},{},{usage}",
                rows.time[row], rows.trajectory[row]
            );
            angles[row * n..(row + 1) * n].iter().for_each(|angle| {
                let _ = write!(text, ",{angle:.5}");
            });
            signal[row * n..(row + 1) * n].iter().for_each(|value| {
                let _ = write!(text, ",{value:.decimals$}");
            });
            text.push('\n');
        }
        text
    }

    /// What the robot file of points states, and what moving bodies take.
    fn robot_json(&self) -> Value {
        let (robot, moments) = (&self.robot, &self.robot.inertias);
        let mut out = robot_json(robot).expect("an arm of the library has such a file");
        out["inertia"] = json!(moments.links);
        out["payload_inertia"] = json!(moments.payload);
        out["gravity"] = json!(robot.gravity);
        out["inertia_tolerance"] = json!(moments.tolerance.map(|one| {
            json!({ "mass_rel": one.mass, "com_mm": one.centre * 1e3, "inertia_rel": one.inertia })
        }));
        out
    }
}

fn pretty(value: &Value) -> String {
    serde_json::to_string_pretty(value).unwrap_or_default() + "\n"
}
