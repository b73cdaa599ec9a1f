//! What the true robot is, apart from its effects: lengths, zero positions, gears, couplings and linear wind-up.
//!
//! Joint i stands at `offset_i + k_i (q_i - sum c_ij q_j) + sum k_j (c_ij + e_ij) q_j`, where c_ij is the nominal coupling (the
//! motion of joint i caused by joint j, which the controller takes out) and e_ij its error.

use super::matrix::Vector;
use calib_foundation::description::{JointKind, RobotDescription};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Rigid errors of a link's far end, where the next joint (or the measured point) sits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkError {
    /// Number of the link, from 1: the body moved by joint N.
    pub link: usize,
    /// Displacement at the zero pose along the base axes, mm.
    #[serde(default)]
    pub shift_mm: Vector,
    /// Rotation vector at the zero pose along the base axes, arcsec.
    #[serde(default)]
    pub tilt_arcsec: Vector,
}

/// Error of a coupling between two joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouplingError {
    /// The joint that moves along, from 1.
    pub moved: usize,
    /// The joint that moves it, from 1.
    pub by: usize,
    /// True coupling ratio minus the one that the controller takes out, joint turn per joint turn.
    pub error: f64,
}

/// The true robot against its description.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrueRobot {
    /// Manufacturing errors, any number of entries a link.
    #[serde(default)]
    pub links: Vec<LinkError>,
    /// Error of the zero position of every joint, deg (mm for a prismatic joint); empty: none.
    #[serde(default)]
    pub offset_deg: Vec<f64>,
    /// True motion of every joint per reported motion; empty: 1.
    #[serde(default)]
    pub ratio: Vec<f64>,
    /// Errors of couplings; others are as in the description.
    #[serde(default)]
    pub couplings: Vec<CouplingError>,
    /// Wind-up of every joint per ampere of holding current, in the controller's sign, rad/A; empty: none.
    #[serde(default)]
    pub compliance_rad_a: Vec<f64>,
    /// Wind-up of every joint per torque of the load, rad/Nm, added to `compliance_rad_a`; empty: none.
    #[serde(default)]
    pub compliance_rad_nm: Vec<f64>,
}

/// Summed errors of one link in m and rad.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RigidError {
    /// m.
    pub(crate) shift: Vector,
    /// rad.
    pub(crate) tilt: Vector,
}

/// rad.
pub(crate) const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

impl TrueRobot {
    /// Errors of the link that joint `index` (from 0) moves.
    pub(crate) fn link_error(&self, index: usize) -> RigidError {
        let mut out = RigidError::default();
        for error in self.links.iter().filter(|error| error.link == index + 1) {
            for axis in 0..3 {
                out.shift[axis] += 1e-3 * error.shift_mm[axis];
                out.tilt[axis] += ARCSEC * error.tilt_arcsec[axis];
            }
        }
        out
    }

    /// Joint positions (rad or m) without load for reported positions `q`.
    pub fn drive(&self, robot: &RobotDescription, q: &[f64]) -> Vec<f64> {
        let ratio = |joint: usize| self.ratio.get(joint).copied().unwrap_or(1.0);
        let mut out: Vec<f64> = (0..q.len())
            .map(|joint| self.offset(robot, joint) + ratio(joint) * q[joint])
            .collect();
        for nominal in &robot.couplings {
            // The controller takes the nominal coupling out with the gear it believes in; the true gears put it back.
            out[nominal.moved] +=
                nominal.ratio * q[nominal.by] * (ratio(nominal.by) - ratio(nominal.moved));
        }
        for wrong in &self.couplings {
            out[wrong.moved - 1] += wrong.error * q[wrong.by - 1] * ratio(wrong.by - 1);
        }
        out
    }

    /// Error of a joint's zero position, rad or m.
    pub(crate) fn offset(&self, robot: &RobotDescription, joint: usize) -> f64 {
        let revolute = robot.joints[joint].kind == JointKind::Revolute;
        self.offset_deg.get(joint).copied().unwrap_or(0.0)
            * if revolute {
                std::f64::consts::PI / 180.0
            } else {
                1e-3
            }
    }

    /// Linear wind-up of a joint per torque, rad/Nm; `per_ampere` is the joint's torque per ampere of its motor.
    pub(crate) fn compliance(&self, joint: usize, per_ampere: f64) -> f64 {
        let by_current = self
            .compliance_rad_a
            .get(joint)
            .map_or(0.0, |c| c.abs() / per_ampere.abs());
        by_current + self.compliance_rad_nm.get(joint).copied().unwrap_or(0.0)
    }

    /// The true numbers under the names that identified parameters have; those of a link's rigid errors summed.
    pub fn values(&self, robot: &RobotDescription) -> Vec<TrueValue> {
        let mut out = Vec::new();
        for (joint, described) in robot.joints.iter().enumerate() {
            let number = joint + 1;
            let mut push = |effect, word: &str, unit, value| {
                let (tag, place) = (format!("j{number}"), format!("joint {number}"));
                out.extend(true_values(effect, &tag, &place, [(word, unit, value)]));
            };
            let offset = self.offset(robot, joint);
            match described.kind {
                JointKind::Revolute => push("joint_offset", "", "rad", offset),
                JointKind::Prismatic => push("joint_offset", "", "mm", 1e3 * offset),
            }
            let ratio = self.ratio.get(joint).map_or(0.0, |ratio| ratio - 1.0);
            push("reduction_ratio", "", "1", ratio);
            if let Some(factor) = self.compliance_rad_a.get(joint) {
                push("joint_compliance", "", "rad/A", *factor);
            }
            let per_ampere =
                described.reduction_ratio.unwrap_or(1.0) * described.motor_constant.unwrap_or(1.0);
            let compliance = self.compliance(joint, per_ampere);
            push("joint_compliance", "torque", "rad/Nm", compliance);
            let error = self.link_error(joint);
            for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
                let (shift, tilt) = (1e3 * error.shift[axis], error.tilt[axis]);
                if number == robot.joints.len() {
                    let numbers = [("", "mm", shift)];
                    out.extend(true_values("tool_offset", letter, "tool", numbers));
                    continue;
                }
                let (tag, place) = (format!("l{number}"), format!("link {number}"));
                let turned = format!("r{letter}");
                let numbers = [(letter, "mm", shift), (turned.as_str(), "rad", tilt)];
                out.extend(true_values("link_geometry", &tag, &place, numbers));
            }
        }
        for wrong in &self.couplings {
            let tag = format!("j{}_j{}", wrong.by, wrong.moved);
            let place = format!("joint {}->{}", wrong.by, wrong.moved);
            let ratio = self.ratio.get(wrong.by - 1).copied().unwrap_or(1.0);
            let numbers = [("", "1", wrong.error * ratio)];
            out.extend(true_values("coupling_ratio", &tag, &place, numbers));
        }
        out
    }

    /// What cannot be true of a robot with this description: place below `truth` and message.
    pub fn faults(&self, robot: &RobotDescription) -> Vec<(String, String)> {
        let joints = robot.joints.len();
        let is_one = |number: usize| (1..=joints).contains(&number);
        let mut out = Vec::new();
        for (name, list) in [
            ("offset_deg", &self.offset_deg),
            ("ratio", &self.ratio),
            ("compliance_rad_a", &self.compliance_rad_a),
            ("compliance_rad_nm", &self.compliance_rad_nm),
        ] {
            let count = list.len();
            if count != 0 && count != joints {
                let message = format!(
                    "has {count} numbers, the robot {joints} joints; give one a joint or none"
                );
                out.push((name.into(), message));
            }
        }
        for (index, LinkError { link, .. }) in self.links.iter().enumerate() {
            if !is_one(*link) {
                let message = format!("is {link}; allowed: 1 to {joints}");
                out.push((format!("links[{index}].link"), message));
            }
        }
        for (index, CouplingError { moved, by, .. }) in self.couplings.iter().enumerate() {
            if !is_one(*moved) || !is_one(*by) || moved == by {
                let message = format!("needs two different joints out of 1 to {joints}");
                out.push((format!("couplings[{index}]"), message));
            }
        }
        out
    }
}

/// A true number under its canonical name.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueValue {
    pub name: String,
    pub effect: &'static str,
    pub place: String,
    pub unit: &'static str,
    pub value: f64,
}

/// Numbers of the effect `effect` at `place`: name, unit and value of each, whose canonical name is `effect.tag.number`.
pub(crate) fn true_values<N: AsRef<str>>(
    effect: &'static str,
    tag: &str,
    place: &str,
    numbers: impl IntoIterator<Item = (N, &'static str, f64)>,
) -> Vec<TrueValue> {
    let value = |(number, unit, value): (N, _, _)| {
        let number = number.as_ref();
        let dot = if number.is_empty() { "" } else { "." };
        TrueValue {
            name: format!("{effect}.{tag}{dot}{number}"),
            effect,
            place: place.into(),
            unit,
            value,
        }
    };
    numbers.into_iter().map(value).collect()
}
