//! A case as text: what the user has (robot.json, recording.csv), and the truth.

use super::draw::TorqueCase;
use super::law::Law;
use super::record::TorqueRows;
use calib_foundation::description::RobotDescription;
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

    fn robot_json(&self) -> Value {
        let robot: &RobotDescription = &self.robot;
        let mm = |point: [f64; 3]| point.map(|x| (x * 1e6).round() / 1e3);
        let each =
            |of: &dyn Fn(usize) -> Value| (0..robot.joints.len()).map(of).collect::<Vec<Value>>();
        let offset: [f64; 3] = std::array::from_fn(|k| robot.payload_centre[k] - robot.tool[k]);
        let tolerance = robot
            .inertias
            .tolerance
            .map(|one| json!({ "mass_rel": one.mass, "com_mm": one.centre * 1e3, "inertia_rel": one.inertia }));
        json!({
            "name": robot.name,
            "axes": each(&|j| json!(robot.joints[j].axis)),
            "points": each(&|j| json!(mm(robot.joints[j].point))),
            "tool": mm(robot.tool),
            "mass": each(&|j| json!(robot.joints[j].mass)),
            "com": each(&|j| json!(robot.joints[j].centre.map(mm))),
            "inertia": each(&|j| json!(robot.inertias.links[j])),
            "ratio": each(&|j| json!(robot.joints[j].reduction_ratio)),
            "kt": each(&|j| json!(robot.joints[j].motor_constant)),
            "payload": robot.payload_mass,
            "payload_com": mm(offset),
            "payload_inertia": robot.inertias.payload,
            "gravity": robot.gravity,
            "coupling": robot.couplings.iter().map(|one| [one.moved, one.by]).collect::<Vec<_>>(),
            "inertia_tolerance": tolerance,
        })
    }
}

fn pretty(value: &Value) -> String {
    serde_json::to_string_pretty(value).unwrap_or_default() + "\n"
}
