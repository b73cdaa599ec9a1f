//! How the controller counts its joints, against the robot file: signs, zeros, and joints that are reported with a part of another one.
//!
//! q = sign * (controller - zero); then, coupling by coupling in their order, q(joint) -= ratio * q(by). rad or m throughout.

use super::RobotModel;
use crate::units::Unit;

/// A joint whose number at the controller holds a part of another joint's position. Joints from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CountedCoupling {
    /// The joint whose number it is.
    pub joint: usize,
    /// The joint whose position is in it.
    pub by: usize,
    /// How often it is.
    pub ratio: f64,
}

/// The controller's joint convention: what leads from its numbers to joint positions of the robot file, and back.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointConvention {
    sign: Vec<f64>,
    zero: Vec<f64>,
    coupled: Vec<CountedCoupling>,
}

impl JointConvention {
    /// A convention of as many joints as there are signs (1 or -1) and zeros (rad or m, as the controller shows them).
    pub fn new(sign: Vec<f64>, zero: Vec<f64>, coupled: Vec<CountedCoupling>) -> Self {
        Self {
            sign,
            zero,
            coupled,
        }
    }

    /// The robot file's own counting.
    pub fn of_the_robot_file(joints: usize) -> Self {
        Self {
            sign: vec![1.0; joints],
            zero: vec![0.0; joints],
            coupled: Vec::new(),
        }
    }

    /// 1 or -1, a joint.
    pub fn sign(&self) -> &[f64] {
        &self.sign
    }

    /// What the controller shows where the robot file has its zero, rad or m.
    pub fn zero(&self) -> &[f64] {
        &self.zero
    }

    /// In the order in which they are taken off.
    pub fn coupled(&self) -> &[CountedCoupling] {
        &self.coupled
    }

    /// Whether the controller counts as the robot file does.
    pub fn is_of_the_robot_file(&self) -> bool {
        self.sign.iter().all(|sign| *sign == 1.0)
            && self.zero.iter().all(|zero| *zero == 0.0)
            && self.coupled.is_empty()
    }

    /// The controller's numbers -> joint positions of the robot file, in place.
    pub fn to_robot(&self, q: &mut [f64]) {
        if self.is_of_the_robot_file() {
            return;
        }
        for (q, (sign, zero)) in q.iter_mut().zip(self.sign.iter().zip(&self.zero)) {
            *q = sign * (*q - zero);
        }
        for CountedCoupling { joint, by, ratio } in &self.coupled {
            q[*joint] -= ratio * q[*by];
        }
    }

    /// Joint positions of the robot file -> the controller's numbers, in place.
    pub fn to_controller(&self, q: &mut [f64]) {
        if self.is_of_the_robot_file() {
            return;
        }
        for CountedCoupling { joint, by, ratio } in self.coupled.iter().rev() {
            q[*joint] += ratio * q[*by];
        }
        for (q, (sign, zero)) in q.iter_mut().zip(self.sign.iter().zip(&self.zero)) {
            *q = sign * *q + zero;
        }
    }

    /// Sides of approach, +1, -1 or 0, between the two countings, in place.
    pub(crate) fn turn_sides(&self, sides: &mut [f64]) {
        for (side, sign) in sides.iter_mut().zip(&self.sign) {
            *side *= sign;
        }
    }

    /// What differs from the robot file's counting, deg and mm, e.g. `sign [-1, 1, 1], zero [0, -90, 0] deg`; none where nothing does.
    pub fn difference(&self, robot: &RobotModel) -> Option<String> {
        if self.is_of_the_robot_file() {
            return None;
        }
        let list = |values: Vec<String>| format!("[{}]", values.join(", "));
        let mut parts = Vec::new();
        if self.sign.contains(&-1.0) {
            parts.push(format!(
                "sign {}",
                list(self.sign.iter().map(f64::to_string).collect())
            ));
        }
        if self.zero.iter().any(|zero| *zero != 0.0) {
            let all_turn = (0..self.zero.len()).all(|joint| robot.is_revolute(joint));
            let shown = |(joint, zero): (usize, &f64)| {
                let unit = if robot.is_revolute(joint) {
                    Unit::Degree
                } else {
                    Unit::Millimetre
                };
                let value = (unit.from_si(*zero) * 1e6).round() / 1e6;
                if all_turn {
                    value.to_string()
                } else {
                    format!("{value} {unit}")
                }
            };
            let values = list(self.zero.iter().enumerate().map(shown).collect());
            parts.push(format!(
                "zero {values}{}",
                if all_turn { " deg" } else { "" }
            ));
        }
        for CountedCoupling { joint, by, ratio } in &self.coupled {
            parts.push(format!(
                "joint {} with {ratio} times joint {}",
                joint + 1,
                by + 1
            ));
        }
        Some(parts.join(", "))
    }
}
