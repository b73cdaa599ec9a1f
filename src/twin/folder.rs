//! A recording as the files that a user has: robot.json, controller.csv, tracker.csv.

use super::matrix::Vector;
use calib_foundation::description::{JointDescription, JointKind, RobotDescription};
use serde_json::{Value, json};

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
    pub temperature_c: Option<Vec<f64>>,
    /// Tracker frame, m.
    pub position: Vec<Vector>,
}

/// A file's name and its bytes.
pub type File = (&'static str, String);

/// A document as a file holds it.
pub(crate) fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

/// A table as text: the title of every column, and its cell of a row.
#[derive(Default)]
pub(crate) struct Sheet<'a> {
    titles: Vec<String>,
    cells: Vec<Box<dyn Fn(usize) -> String + 'a>>,
}

impl<'a> Sheet<'a> {
    pub(crate) fn add(&mut self, title: &str, cell: impl Fn(usize) -> String + 'a) {
        self.titles.push(title.into());
        self.cells.push(Box::new(cell));
    }

    /// A column of every joint, with its number in the title.
    pub(crate) fn of_joints(
        &mut self,
        title: &str,
        joints: usize,
        values: &'a [f64],
        write: impl Fn(f64) -> String + Copy + 'a,
    ) {
        for joint in 0..joints {
            let title = title.replace("{}", &(joint + 1).to_string());
            self.add(&title, move |row| write(values[row * joints + joint]));
        }
    }

    pub(crate) fn text(&self, rows: usize) -> String {
        let mut text = self.titles.join(",") + "\n";
        for row in 0..rows {
            let cells: Vec<String> = self.cells.iter().map(|cell| cell(row)).collect();
            text.push_str(&cells.join(","));
            text.push('\n');
        }
        text
    }
}

impl Log {
    /// controller.csv.
    pub fn controller(&self, decimals: Decimals) -> String {
        let angle = |value: f64| fixed(value.to_degrees(), decimals.angle);
        let mut sheet = Sheet::default();
        sheet.add("point_id", |row| word(&self.id[row]));
        if let Some(time) = &self.time_s {
            sheet.add("time_s", |row| fixed(time[row], decimals.time));
        }
        sheet.add("use", |row| word(&self.usage[row]));
        sheet.add("payload_kg", |row| fixed(self.payload_kg[row], 1));
        sheet.of_joints("q{}_deg", self.joints, &self.q, angle);
        if let Some(current) = &self.current {
            sheet.of_joints("i{}_a", self.joints, current, |value| fixed(value, 4));
        }
        if let Some(direction) = &self.direction {
            sheet.of_joints("dir{}", self.joints, direction, |value| fixed(value, 0));
        }
        if let Some(velocity) = &self.velocity {
            sheet.of_joints("dq{}_deg_s", self.joints, velocity, angle);
        }
        if let Some(celsius) = &self.temperature_c {
            sheet.add("temp_c", |row| fixed(celsius[row], 2));
        }
        sheet.text(self.id.len())
    }

    /// tracker.csv.
    pub fn tracker(&self, decimals: Decimals) -> String {
        let later = if self.at_once { 0.0 } else { TRACKER_LATER_S };
        let mut sheet = Sheet::default();
        sheet.add("point_id", |row| word(&self.id[row]));
        if let Some(time) = &self.time_s {
            sheet.add("time_s", move |row| fixed(time[row] + later, decimals.time));
        }
        for (axis, title) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
            sheet.add(title, move |row| {
                fixed(1e3 * self.position[row][axis], decimals.length)
            });
        }
        sheet.text(self.id.len())
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
        Some(tail) if tail.chars().all(|c| c == '0' || c == '.') => tail.to_string(),
        _ => text,
    }
}

/// robot.json: mm, kg, Nm/A, joints from 0. Fails with what of the robot this layout cannot state.
pub fn robot(robot: &RobotDescription) -> Result<String, String> {
    robot_json(robot).map(|document| pretty(&document))
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
    // What is not known of every joint is not stated.
    let mut state = |key: &str, value: &dyn Fn(&JointDescription) -> Option<Value>| {
        if let Some(values) = joints.iter().map(value).collect::<Option<Vec<Value>>>() {
            out[key] = json!(values);
        }
    };
    let number = |value: Option<f64>| value.map(|value| json!(value));
    state("mass", &|joint| number(joint.mass));
    state("com", &|joint| joint.centre.map(mm));
    state("ratio", &|joint| number(joint.reduction_ratio));
    state("kt", &|joint| number(joint.motor_constant));
    Ok(out)
}
