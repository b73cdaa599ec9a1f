//! Which column of the targets holds what, by its name: `q1_deg`, `A1_deg`, `x_mm`, `qw`, `a_deg`, `payload_kg`, `temp_c`, `dir1`, ...

use crate::error::{Error, Fault, Result};
use crate::robot::description::{JointKind, RobotDescription};
use crate::units::{Quantity, Unit};

/// What a column holds; joints and axes from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Role {
    Joint(usize, Unit),
    Axis(usize, Unit),
    /// w, x, y, z.
    Quaternion(usize),
    /// A about z, then B about the new y, then C about the new x.
    Turn(usize, Unit),
    Payload,
    Temperature,
    Time,
    Direction(usize),
    Current(usize),
}

/// Units of columns whose names do not end in one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Units {
    pub angle: Option<Unit>,
    pub length: Option<Unit>,
}

/// The columns of a file of targets.
#[derive(Debug, Clone)]
pub(super) struct Columns {
    pub count: usize,
    pub roles: Vec<(usize, Role)>,
    /// Column and unit of each joint; empty where joints are not given.
    pub joints: Vec<(usize, Unit)>,
    pub point: bool,
    pub orientation: bool,
}

/// What columns of joints may be called beside the robot's own names.
const JOINT_NAMES: [&str; 4] = ["q", "a", "j", "joint"];

impl Columns {
    /// Reads the header; fails where it names no whole target, or a unit is missing.
    pub fn read(place: &str, header: &[String], robot: &RobotDescription, units: Units) -> Result<Self> {
        let mut faults = Vec::new();
        let mut roles = Vec::new();
        for (index, name) in header.iter().enumerate() {
            match role(name, robot, units) {
                Ok(Some(role)) if roles.iter().any(|(_, known)| same(known, &role)) => {
                    faults.push(Fault::new(place, format!("column `{name}` says again what another column says")));
                }
                Ok(Some(role)) => roles.push((index, role)),
                Ok(None) => {}
                Err(message) => faults.push(Fault::new(place, message)),
            }
        }
        let n = robot.joints.len();
        let joint = |j: usize| {
            roles.iter().find_map(|(index, role)| match role {
                Role::Joint(k, unit) if *k == j => Some((*index, *unit)),
                _ => None,
            })
        };
        let joints: Vec<(usize, Unit)> = (0..n).filter_map(joint).collect();
        let count = |of: fn(&Role) -> bool| roles.iter().filter(|(_, role)| of(role)).count();
        let point = count(|role| matches!(role, Role::Axis(..)));
        let quaternion = count(|role| matches!(role, Role::Quaternion(_)));
        let turns = count(|role| matches!(role, Role::Turn(..)));
        if !joints.is_empty() && joints.len() < n {
            let missing: Vec<String> = (0..n).filter(|j| joint(*j).is_none()).map(|j| format!("q{}", j + 1)).collect();
            faults.push(Fault::new(place, format!("has no column for {} of the robot's {n} joints", missing.join(", "))));
        }
        for (found, whole, what) in [(point, 3, "x, y, z"), (quaternion, 4, "qw, qx, qy, qz"), (turns, 3, "a, b, c")] {
            if found != 0 && found != whole {
                faults.push(Fault::new(place, format!("has only {found} of the columns {what}")));
            }
        }
        if faults.is_empty() && joints.is_empty() && point == 0 {
            let names = header.iter().take(12).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            faults.push(Fault::new(
                place,
                format!("no targets found in the columns {names}; expected q1_deg..q{n}_deg (joints), or x_mm, y_mm, z_mm with qw, qx, qy, qz or a_deg, b_deg, c_deg, in a header line"),
            ));
        }
        if !faults.is_empty() {
            return Err(Error::Spec(faults));
        }
        Ok(Self { count: header.len(), roles, joints, point: point == 3, orientation: quaternion == 4 || turns == 3 })
    }
}

fn same(a: &Role, b: &Role) -> bool {
    match (a, b) {
        (Role::Joint(a, _), Role::Joint(b, _)) | (Role::Axis(a, _), Role::Axis(b, _)) | (Role::Turn(a, _), Role::Turn(b, _)) => {
            a == b
        }
        _ => a == b,
    }
}

fn role(name: &str, robot: &RobotDescription, units: Units) -> Result<Option<Role>, String> {
    let lower = name.trim().to_ascii_lowercase();
    let (stem, ending) = match lower.rsplit_once('_') {
        Some((stem, ending)) if Unit::parse(unit_symbol(ending)).is_some() => (stem, Unit::parse(unit_symbol(ending))),
        _ => (lower.as_str(), None),
    };
    let of = |quantity: Quantity, otherwise: Option<Unit>, option: &str| match ending.or(otherwise) {
        Some(unit) if unit.quantity() == quantity => Ok(unit),
        Some(unit) => Err(format!("column `{name}`: {unit} is no unit of it; allowed: {}", Unit::symbols(quantity).join(", "))),
        None => Err(format!(
            "column `{name}` has no unit; call it e.g. `{stem}_{}`, or give {option}",
            option.rsplit(' ').next().unwrap_or_default()
        )),
    };
    let numbered = |prefix: &str| {
        stem.strip_prefix(prefix).and_then(|number| number.parse::<usize>().ok()).filter(|n| (1..=robot.joints.len()).contains(n))
    };
    let by_name = robot.joints.iter().position(|joint| joint.name.to_ascii_lowercase() == stem);
    let joint = by_name.or_else(|| JOINT_NAMES.iter().find_map(|prefix| numbered(prefix)).map(|n| n - 1));
    if let Some(joint) = joint {
        let unit = match robot.joints[joint].kind {
            JointKind::Revolute => of(Quantity::Angle, units.angle, "--angle deg")?,
            JointKind::Prismatic => of(Quantity::Length, units.length, "--length mm")?,
        };
        return Ok(Some(Role::Joint(joint, unit)));
    }
    if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == stem) {
        return Ok(Some(Role::Axis(axis, of(Quantity::Length, units.length, "--length mm")?)));
    }
    if let (Some(part), None) = (["qw", "qx", "qy", "qz"].iter().position(|part| *part == stem), ending) {
        return Ok(Some(Role::Quaternion(part)));
    }
    if let Some(turn) = ["a", "b", "c"].iter().position(|turn| *turn == stem) {
        return Ok(Some(Role::Turn(turn, of(Quantity::Angle, units.angle, "--angle deg")?)));
    }
    let role = match lower.as_str() {
        "payload_kg" => Some(Role::Payload),
        "temp_c" | "temperature_c" => Some(Role::Temperature),
        "time_s" => Some(Role::Time),
        _ => numbered("dir").map(|n| Role::Direction(n - 1)),
    };
    let current = || (ending == Some(Unit::Ampere)).then(|| numbered("i")).flatten().map(|n| Role::Current(n - 1));
    Ok(role.or_else(current))
}

/// Symbols as column names have them are lower-case.
fn unit_symbol(ending: &str) -> &str {
    if ending == "a" { "A" } else { ending }
}
