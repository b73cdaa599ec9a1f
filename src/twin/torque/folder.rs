//! A case as text: what the user has (robot.json, recording.csv), and the truth.

use super::draw::TorqueCase;
use super::law::Law;
use super::record::TorqueRows;
use calib_foundation::description::RobotDescription;
use serde_json::{Value, json};
use std::fmt::Write;

/// A file's name and its bytes.
pub type TorqueFile = (&'static str, String);

/// An effect that shows less than this need not be found.
const PLAIN: f64 = 80.0;

impl TorqueCase {
    /// robot.json and recording.csv.
    pub fn recording(&self) -> [TorqueFile; 2] {
        let rows = self.all();
        [("robot.json", pretty(&self.robot_json())), ("recording.csv", self.csv(&rows))]
    }

    /// truth.json (what is concealed, with numbers) and want.json (what a diagnosis is asked for).
    pub fn truth(&self) -> [TorqueFile; 2] {
        let rows = self.all();
        let effects = self.laws.iter().zip(&self.other_form).map(
            |(law, other)| json!({ "effect": law.name(), "where": law.place(), "law": format!("{law:?}"), "other_form": other }),
        );
        let truth = json!({
            "case": self.name, "robot": self.robot.name, "seed": self.seed, "effects": effects.collect::<Vec<_>>(),
            "noise_nm": { "white": self.white, "lasting": self.lasting },
        });
        let wanted = self.laws.iter().zip(self.visible(&rows)).map(|(law, seen)| {
            let own = json!([law.name(), law.place()]);
            let accept: Vec<Value> = std::iter::once(own).chain(seen.same.iter().map(|pair| json!(pair))).collect();
            let mut wanted = json!({
                "effect": law.name(), "where": law.place(), "accept": accept,
                "L": seen.l, "L_before_projection": seen.before, "optional": seen.l < PLAIN,
            });
            if let Law::Contact { start, end, .. } = law {
                wanted["window"] = json!([start, end]);
            }
            wanted
        });
        let want = json!({ "case": self.name, "effects": wanted.collect::<Vec<_>>() });
        [("truth.json", pretty(&truth)), ("want.json", pretty(&want))]
    }

    fn all(&self) -> TorqueRows {
        self.rows(&(0..self.laws.len()).collect::<Vec<_>>())
    }

    fn csv(&self, rows: &TorqueRows) -> String {
        let n = self.stated.axes.len();
        let (angles, signal) = self.measured(rows);
        let names = |name: &str| (1..=n).map(|j| name.replace("{j}", &j.to_string())).collect::<Vec<_>>().join(",");
        let (signal_name, decimals) = if self.sensors { ("tau{j}_nm", 2) } else { ("i{j}_a", 3) };
        let mut text = format!("time_s,traj,use,{},{}\n", names("q{j}_deg"), names(signal_name));
        for row in 0..rows.time.len() {
            let usage = if rows.validate[row] { "validate" } else { "fit" };
            let _ = write!(text, "{:.3},{},{usage}", rows.time[row], rows.trajectory[row]);
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
        let each = |of: &dyn Fn(usize) -> Value| (0..robot.joints.len()).map(of).collect::<Vec<Value>>();
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
