//! Poses that are given instead of drawn, as somebody proposed them: joints, the side from which each joint comes, the load.

use calib_foundation::description::{JointKind, RobotDescription};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pose to measure. It is driven to as it is: neither the floor nor the ranges of drawn poses are asked for.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenPose {
    /// Every joint, deg (mm for a prismatic joint).
    pub joints_deg: Vec<f64>,
    /// The side to which each joint moves last: +1 upwards, -1 downwards, 0: it stands already. Before the pose the arm stops 5 deg
    /// (5 mm) short of it on the other side. Empty: straight from the pose before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub direction: Vec<f64>,
    /// Mass at the flange, kg; missing: the block's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload_kg: Option<f64>,
}

/// How far off a pose the arm stops before its last move, deg or mm: more than any lost motion or hysteresis needs.
const SHORT: f64 = 5.0;

impl GivenPose {
    /// The joints, rad or m, and where the arm stops before, if it does.
    pub(super) fn postures(&self, robot: &RobotDescription) -> (Vec<f64>, Option<Vec<f64>>) {
        let si = |(value, kind): (f64, JointKind)| {
            if kind == JointKind::Revolute {
                value.to_radians()
            } else {
                1e-3 * value
            }
        };
        let kinds = || robot.joints.iter().map(|joint| joint.kind);
        let q = self
            .joints_deg
            .iter()
            .copied()
            .zip(kinds())
            .map(si)
            .collect();
        let sides = self.joints_deg.iter().zip(&self.direction);
        let short = sides
            .map(|(value, side)| value - side * SHORT)
            .zip(kinds())
            .map(si);
        (q, (!self.direction.is_empty()).then(|| short.collect()))
    }

    /// What cannot be, whatever the robot: place below the pose and message.
    pub fn faults(&self) -> Vec<(&'static str, String)> {
        let mut out = Vec::new();
        if self.joints_deg.is_empty() || !self.joints_deg.iter().all(|value| value.is_finite()) {
            out.push((
                "joints_deg",
                "expected a number for every joint, deg (mm for a prismatic joint)".to_string(),
            ));
        }
        if !self
            .direction
            .iter()
            .all(|side| [-1.0, 0.0, 1.0].contains(side))
        {
            out.push((
                "direction",
                "allowed: 1, -1 or 0 for every joint, or nothing".to_string(),
            ));
        }
        if self
            .payload_kg
            .is_some_and(|mass| !(mass.is_finite() && mass >= 0.0))
        {
            out.push(("payload_kg", "expected a mass, 0 or more".to_string()));
        }
        out
    }

    /// What this robot cannot do.
    pub fn against(&self, robot: &RobotDescription) -> Vec<(&'static str, String)> {
        let joints = robot.joints.len();
        let mut out = Vec::new();
        for (name, count) in [
            ("joints_deg", self.joints_deg.len()),
            ("direction", self.direction.len()),
        ] {
            if count != joints && (name == "joints_deg" || count > 0) {
                out.push((
                    name,
                    format!("has {count} numbers, the robot {joints} joints"),
                ));
            }
        }
        let (q, _) = self.postures(robot);
        for (index, (at, joint)) in q.iter().zip(&robot.joints).enumerate() {
            // A limit that was rounded to the decimals of a pose is no breach of it.
            let beyond = joint
                .limits
                .filter(|[low, high]| *at < low - 1e-6 || *at > high + 1e-6);
            if let Some(limits) = beyond {
                let (unit, [low, high]) = match joint.kind {
                    JointKind::Revolute => ("deg", limits.map(f64::to_degrees)),
                    JointKind::Prismatic => ("mm", limits.map(|metres| 1e3 * metres)),
                };
                let message = format!(
                    "joint {} is at {} {unit}; allowed: {low:.3} to {high:.3}",
                    index + 1,
                    self.joints_deg[index]
                );
                out.push(("joints_deg", message));
            }
        }
        out
    }
}
