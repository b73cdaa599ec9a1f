//! Where the model was measured, and whether a command leaves that or the joint limits.

use super::arm::Circumstance;
use super::remark::Unmeasured;
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

    /// What of a command was never measured; empty inside.
    pub fn beyond(&self, q: &[f64], circumstance: &Circumstance) -> Vec<Unmeasured> {
        let outside = |value: f64, [lower, upper]: [f64; 2], least: f64| {
            let slack = (SLACK * (upper - lower)).max(least);
            value < lower - slack || value > upper + slack
        };
        let mut out = Vec::new();
        let joints = (0..).zip(q.iter().zip(&self.joints)).filter(|(_, (q, range))| outside(**q, **range, 1e-3));
        let joints: Vec<usize> = joints.map(|(joint, _)| joint).collect();
        out.extend((!joints.is_empty()).then_some(Unmeasured::Joints(joints)));
        if outside(circumstance.payload, self.payload, 0.05 * self.payload[1].abs()) {
            out.push(Unmeasured::Payload);
        }
        if let (Some(now), Some(range)) = (circumstance.temperature, self.temperature)
            && outside(now, range, 1.0)
        {
            out.push(Unmeasured::Temperature);
        }
        out
    }
}

/// The joints, from 0, that a command takes out of their limits.
pub(crate) fn beyond_limits(robot: &RobotDescription, q: &[f64]) -> Vec<usize> {
    let limits = robot.joints.iter().map(|joint| joint.limits);
    let outside = |q: f64, limits: Option<[f64; 2]>| limits.is_some_and(|[lower, upper]| q < lower || q > upper);
    (0..).zip(q.iter().zip(limits)).filter(|(_, (q, limits))| outside(**q, *limits)).map(|(joint, _)| joint).collect()
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lower, upper], value| [lower.min(value), upper.max(value)])
}
