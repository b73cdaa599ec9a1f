//! Where the model was measured, and whether a command leaves that or the joint limits.

use super::arm::Circumstance;
use crate::robot::Measurements;
use crate::robot::description::RobotDescription;

/// How far beyond the measured range a joint still counts as inside, as a share of the range.
const SLACK: f64 = 0.02;

/// Ranges of what was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// rad or m, by joint.
    pub joints: Vec<[f64; 2]>,
    /// kg.
    pub payload: [f64; 2],
    /// C.
    pub temperature: Option<[f64; 2]>,
}

impl Coverage {
    pub fn of(data: &Measurements) -> Self {
        let joint = |j: usize| range((0..data.rows()).map(|row| data.q(row)[j]));
        let temperature = data.temperature.as_ref().map(|all| range(all.iter().copied().filter(|value| value.is_finite())));
        Self { joints: (0..data.joints).map(joint).collect(), payload: range(data.payload.iter().copied()), temperature }
    }

    /// What of a command was never measured, in words; empty inside.
    pub fn beyond(&self, q: &[f64], circumstance: &Circumstance) -> Vec<String> {
        let outside = |value: f64, [lower, upper]: [f64; 2], least: f64| {
            let slack = (SLACK * (upper - lower)).max(least);
            value < lower - slack || value > upper + slack
        };
        let mut out = Vec::new();
        let joints = (1..).zip(q.iter().zip(&self.joints)).filter(|(_, (q, range))| outside(**q, **range, 1e-3));
        out.extend(listed(joints.map(|(joint, _)| joint), "beyond the measured range"));
        if outside(circumstance.payload, self.payload, 0.05 * self.payload[1].abs()) {
            out.push("payload beyond the measured range".into());
        }
        if let (Some(now), Some(range)) = (circumstance.temperature, self.temperature)
            && outside(now, range, 1.0)
        {
            out.push("temperature beyond the measured range".into());
        }
        out
    }
}

/// The joints that a command takes out of their limits, in words.
pub(crate) fn beyond_limits(robot: &RobotDescription, q: &[f64]) -> Option<String> {
    let limits = robot.joints.iter().map(|joint| joint.limits);
    let outside = |q: f64, limits: Option<[f64; 2]>| limits.is_some_and(|[lower, upper]| q < lower || q > upper);
    listed(
        (1..).zip(q.iter().zip(limits)).filter(|(_, (q, limits))| outside(**q, *limits)).map(|(joint, _)| joint),
        "beyond its limits",
    )
}

/// `joint 3, 5 <what>`; none where there is none.
fn listed(joints: impl Iterator<Item = usize>, what: &str) -> Option<String> {
    let joints: Vec<String> = joints.map(|joint| joint.to_string()).collect();
    (!joints.is_empty()).then(|| format!("joint {} {what}", joints.join(", ")))
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lower, upper], value| [lower.min(value), upper.max(value)])
}
