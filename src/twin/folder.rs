//! A recording as the files that a user has: robot.json, controller.csv, tracker.csv.

use super::matrix::Vector;
use calib_foundation::description::{JointKind, RobotDescription};
use serde_json::{Value, json};
use std::fmt::Write;

/// Time from the controller's stamp to the tracker's, s.
const TRACKER_LATER_S: f64 = 1.5;

/// Decimals of what is written: joint angles in deg and deg/s, coordinates in mm, times in s.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decimals {
    pub angle: usize,
    pub length: usize,
    pub time: usize,
}

/// A recording in SI; per-joint quantities are row-major. A quantity that is missing is not written.
#[derive(Debug, Clone)]
pub struct Log {
    /// Joints of the arm.
    pub joints: usize,
    /// Names of the points.
    pub id: Vec<String>,
    /// Clock, s.
    pub time_s: Option<Vec<f64>>,
    /// What a row is for: `fit`, `validate`, ...
    pub usage: Vec<String>,
    /// Declared, kg.
    pub payload_kg: Vec<f64>,
    /// rad.
    pub q: Vec<f64>,
    /// A.
    pub current: Option<Vec<f64>>,
    /// +1, -1 or 0.
    pub direction: Option<Vec<f64>>,
    /// rad/s; the arm moved, and both clocks were one.
    pub velocity: Option<Vec<f64>>,
    /// Whether the tracker's stamps are the controller's: of standing points it looks some time after the arm has settled.
    pub at_once: bool,
    /// C.
    pub temperature_c: Option<Vec<f64>>,
    /// Tracker frame, m.
    pub position: Vec<Vector>,
}

/// A column of every joint: its title, its values if they are known, and how they are written.
type OfJoints<'a> = (&'a str, Option<&'a Vec<f64>>, &'a dyn Fn(f64) -> String);

impl Log {
    /// controller.csv.
    pub fn controller(&self, decimals: Decimals) -> String {
        let angle = |value: f64| fixed(value.to_degrees(), decimals.angle);
        let of_joints: [OfJoints; 4] = [
            ("q{}_deg", Some(&self.q), &angle),
            ("i{}_a", self.current.as_ref(), &|value| fixed(value, 4)),
            ("dir{}", self.direction.as_ref(), &|value| fixed(value, 0)),
            ("dq{}_deg_s", self.velocity.as_ref(), &angle),
        ];
        let known = || {
            let known = |(title, values, text)| Some((title, values?, text));
            of_joints.into_iter().filter_map(known)
        };
        let mut titles = vec!["point_id".to_string()];
        titles.extend(self.time_s.is_some().then(|| "time_s".into()));
        titles.extend(["use".into(), "payload_kg".into()]);
        for (title, ..) in known() {
            titles.extend((1..=self.joints).map(|joint| title.replace("{}", &joint.to_string())));
        }
        titles.extend(self.temperature_c.is_some().then(|| "temp_c".into()));
        let mut text = titles.join(",") + "\n";
        for (row, id) in self.id.iter().enumerate() {
            let mut cells = vec![word(id)];
            let time = self.time_s.iter();
            cells.extend(time.map(|time| fixed(time[row], decimals.time)));
            cells.push(word(&self.usage[row]));
            cells.push(fixed(self.payload_kg[row], 1));
            for (_, values, write) in known() {
                let values = &values[row * self.joints..(row + 1) * self.joints];
                cells.extend(values.iter().map(|value| write(*value)));
            }
            let celsius = self.temperature_c.iter();
            cells.extend(celsius.map(|celsius| fixed(celsius[row], 2)));
            let _ = writeln!(text, "{}", cells.join(","));
        }
        text
    }

    /// tracker.csv.
    pub fn tracker(&self, decimals: Decimals) -> String {
        let title = if self.time_s.is_some() { "time_s," } else { "" };
        let mut text = format!("point_id,{title}x_mm,y_mm,z_mm\n");
        let later = if self.at_once { 0.0 } else { TRACKER_LATER_S };
        for (row, (id, position)) in self.id.iter().zip(&self.position).enumerate() {
            let time = self.time_s.as_ref().map_or_else(String::new, |time| {
                fixed(time[row] + later, decimals.time) + ","
            });
            let [x, y, z] = position.map(|coordinate| fixed(1e3 * coordinate, decimals.length));
            let _ = writeln!(text, "{},{time}{x},{y},{z}", word(id));
        }
        text
    }
}

/// A text of somebody else's as a cell: quoted where it holds a separator, and no formula for a spreadsheet.
fn word(text: &str) -> String {
    let guard = if text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        "'"
    } else {
        ""
    };
    if guard.is_empty() && !text.contains([',', '"', '\n', '\r']) {
        return text.to_string();
    }
    format!("\"{guard}{}\"", text.replace('"', "\"\""))
}

/// So many decimals, and no negative zero.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_string(),
        _ => text,
    }
}

/// robot.json: mm, kg, Nm/A, joints from 0. Fails with what of the robot this layout cannot state.
pub fn robot(robot: &RobotDescription) -> Result<String, String> {
    Ok(format!("{:#}\n", robot_json(robot)?))
}

/// The same as a document, to which more may be added.
pub(crate) fn robot_json(robot: &RobotDescription) -> Result<Value, String> {
    let joints = &robot.joints;
    if let Some(number) = joints
        .iter()
        .position(|joint| joint.kind == JointKind::Prismatic)
    {
        return Err(format!(
            "joint {} is prismatic, which robot.json cannot state",
            number + 1
        ));
    }
    if let Some(pair) = robot.couplings.iter().find(|pair| pair.ratio != 0.0) {
        let (moved, by) = (pair.moved + 1, pair.by + 1);
        return Err(format!(
            "the coupling {by}->{moved} has a nominal ratio of {}, which robot.json cannot state",
            pair.ratio
        ));
    }
    let mm = |v: Vector| json!(v.map(|x| (1e9 * x).round() / 1e6));
    let mut out = json!({
        "name": robot.name,
        "axes": joints.iter().map(|joint| json!(joint.axis)).collect::<Vec<_>>(),
        "points": joints.iter().map(|joint| mm(joint.point)).collect::<Vec<_>>(),
        "tool": mm(robot.tool),
        "payload": robot.payload_mass,
        "payload_com": mm(std::array::from_fn(|axis| robot.payload_centre[axis] - robot.tool[axis])),
        "coupling": robot.couplings.iter().map(|pair| [pair.moved, pair.by]).collect::<Vec<_>>(),
    });
    // What is not known of every joint is left out.
    let mut state = |key: &str, values: Option<Vec<Value>>| {
        if let Some(values) = values {
            out[key] = json!(values);
        }
    };
    state(
        "mass",
        joints
            .iter()
            .map(|joint| joint.mass.map(|mass| json!(mass)))
            .collect(),
    );
    state(
        "com",
        joints.iter().map(|joint| joint.centre.map(mm)).collect(),
    );
    state(
        "ratio",
        joints
            .iter()
            .map(|joint| joint.reduction_ratio.map(|ratio| json!(ratio)))
            .collect(),
    );
    state(
        "kt",
        joints
            .iter()
            .map(|joint| joint.motor_constant.map(|constant| json!(constant)))
            .collect(),
    );
    Ok(out)
}
