//! The posture in which a Cartesian target is to be reached, as controllers state it: ranges of joints, as they count them.

use super::inverse::{REACHED, excess, into_limits, spread};
use super::solve::{Nominal, ToolGoal, least_change};
use crate::robot::{JointConvention, RobotModel};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// rad or m: a joint at the border of its range, to the decimals of programs, may be solved beyond it by this.
const BORDER: f64 = 1e-3;

/// Starts that are tried.
const STARTS: u32 = 120;

/// Ranges of joints as the controller counts them, rad or m; none where a joint is free.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedPosture {
    ranges: Vec<Option<[f64; 2]>>,
}

impl StatedPosture {
    /// Of so many joints; `quadrants` are joints, from 0, with their quarter turns: 0 from 0 to 90 deg, -1 from -90 to 0 deg.
    pub fn of_quadrants(joints: usize, quadrants: &[(usize, i32)]) -> Self {
        let mut ranges = vec![None; joints];
        for (joint, quadrant) in quadrants {
            ranges[*joint] = Some([f64::from(*quadrant) * FRAC_PI_2, (f64::from(*quadrant) + 1.0) * FRAC_PI_2]);
        }
        Self { ranges }
    }

    /// By the sign of every joint: whether it is below 0.
    pub fn of_signs(below: &[bool]) -> Self {
        let range = |below: &bool| Some(if *below { [f64::NEG_INFINITY, 0.0] } else { [0.0, f64::INFINITY] });
        Self { ranges: below.iter().map(range).collect() }
    }

    /// Whether joints (rad or m, of the robot file) are in this posture.
    pub fn holds(&self, convention: &JointConvention, q: &[f64]) -> bool {
        (0..q.len()).all(|joint| self.holds_joint(convention, q, joint))
    }

    fn holds_joint(&self, convention: &JointConvention, q: &[f64], joint: usize) -> bool {
        let mut numbers = q.to_vec();
        convention.to_controller(&mut numbers);
        self.ranges[joint].is_none_or(|[low, high]| (low - BORDER..=high + BORDER).contains(&numbers[joint]))
    }

    /// Joints of the robot file that are out turned by whole turns into their ranges; none where that is not in the posture, or beyond
    /// the limits.
    fn turned(&self, robot: &RobotModel, convention: &JointConvention, mut q: Vec<f64>) -> Option<Vec<f64>> {
        for joint in (0..q.len()).filter(|joint| robot.is_revolute(*joint)) {
            let by = |turns: f64| {
                let mut q = q.clone();
                q[joint] += turns * TAU;
                q
            };
            let fitting = [0.0, 1.0, -1.0].map(by).into_iter().find(|q| self.holds_joint(convention, q, joint));
            q = fitting?;
        }
        let inside = q.iter().enumerate().all(|(joint, q)| excess(robot, joint, *q) == 0.0);
        (inside && self.holds(convention, &q)).then_some(q)
    }

    /// A start next to `q`: joints that have a range are put where `q` is within its limits.
    fn start(&self, robot: &RobotModel, convention: &JointConvention, q: &[f64]) -> Vec<f64> {
        let mut numbers = q.to_vec();
        convention.to_controller(&mut numbers);
        for (joint, number) in numbers.iter_mut().enumerate() {
            let Some([low, high]) = self.ranges[joint] else { continue };
            let [lower, upper] = robot.description().joints[joint].limits.unwrap_or([-PI, PI]);
            let share = ((q[joint] - lower) / (upper - lower)).clamp(0.0, 1.0);
            // An open range is searched over half a turn.
            let low = if low.is_finite() { low } else { high - PI };
            let high = if high.is_finite() { high } else { low + PI };
            *number = low + share * (high - low);
        }
        convention.to_robot(&mut numbers);
        numbers
    }
}

/// Joint positions (rad or m) at which the nominal robot is where it is wanted, in a posture and within its limits, near to `from`
/// where that leads there; none where none was found.
pub(super) fn inverse_in(
    robot: &RobotModel,
    convention: &JointConvention,
    wanted: &ToolGoal,
    from: &[f64],
    posture: &StatedPosture,
) -> Option<Vec<f64>> {
    let starts = (0..STARTS).map(|number| match number {
        0 => from.to_vec(),
        1 => posture.start(robot, convention, from),
        number => posture.start(robot, convention, &spread(robot, number)),
    });
    let reached = starts.filter_map(|start| {
        let found = least_change(&mut Nominal::new(robot), wanted, &start, &start);
        let reached = found.residual + found.turn < REACHED;
        reached.then(|| found.q.iter().enumerate().map(|(joint, q)| into_limits(robot, joint, *q)).collect())
    });
    reached.filter_map(|q: Vec<f64>| posture.turned(robot, convention, q)).next()
}
