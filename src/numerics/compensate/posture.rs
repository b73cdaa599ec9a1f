//! The posture in which a Cartesian target is to be reached, as controllers state it: ranges of joints, as they count them, and sides of
//! shoulder, elbow and wrist.

use super::sides::{ArmSides, StatedSides};
use super::solve::{Nominal, REACHED, ToolGoal, excess, into_limits, least_change, spread};
use crate::robot::{JointConvention, RobotModel};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// rad or m: a joint at the border of its range, to the decimals of programs, may be solved beyond it by this.
const BORDER: f64 = 1e-3;

/// rad: joints of one posture are no farther apart, and those of two are.
const NEAR: f64 = 0.35;

/// Starts that are tried.
const STARTS: usize = 120;

/// Postures among which starts on the stated sides are looked for.
const SPREAD: u32 = 4000;

/// Ranges of joints as the controller counts them, rad or m, none where a joint is free; and sides.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedPosture {
    ranges: Vec<Option<[f64; 2]>>,
    sides: StatedSides,
}

/// An arm, how its joints are counted, and its sides, where it has some.
#[derive(Clone, Copy)]
pub(super) struct CountedArm<'a> {
    pub(crate) robot: &'a RobotModel,
    pub(crate) convention: &'a JointConvention,
    pub(crate) sides: Option<&'a ArmSides>,
}

impl StatedPosture {
    /// That of any posture.
    fn free(joints: usize) -> Self {
        Self {
            ranges: vec![None; joints],
            sides: [None; 3],
        }
    }

    /// A posture of so many joints; `quadrants` are joints, from 0, with their quarter turns: 0 from 0 to 90 deg, -1 from -90 to 0 deg.
    pub fn of_quadrants(joints: usize, quadrants: &[(usize, i32)]) -> Self {
        Self::within(joints, quadrants, |quadrant| {
            [quadrant * FRAC_PI_2, (quadrant + 1.0) * FRAC_PI_2]
        })
    }

    /// A posture of so many joints; `turns` are joints, from 0, with their whole turns: 0 from -180 to 180 deg.
    pub fn of_turns(joints: usize, turns: &[(usize, i32)]) -> Self {
        Self::within(joints, turns, |turn| [-PI, PI].map(|end| TAU * turn + end))
    }

    fn within(joints: usize, numbers: &[(usize, i32)], range: impl Fn(f64) -> [f64; 2]) -> Self {
        let mut out = Self::free(joints);
        for (joint, number) in numbers {
            out.ranges[*joint] = Some(range(f64::from(*number)));
        }
        out
    }

    /// A posture near these joints.
    pub fn near(q: &[f64]) -> Self {
        Self {
            ranges: q.iter().map(|q| Some([q - NEAR, q + NEAR])).collect(),
            ..Self::free(q.len())
        }
    }

    /// By the sign of every joint: whether it is below 0.
    pub fn of_signs(below: &[bool]) -> Self {
        let range = |below: &bool| {
            Some(if *below {
                [f64::NEG_INFINITY, 0.0]
            } else {
                [0.0, f64::INFINITY]
            })
        };
        Self {
            ranges: below.iter().map(range).collect(),
            ..Self::free(below.len())
        }
    }

    /// A posture of so many joints, on these sides.
    pub fn of_sides(joints: usize, sides: StatedSides) -> Self {
        Self::free(joints).on(sides)
    }

    /// The same on these sides.
    pub fn on(self, sides: StatedSides) -> Self {
        Self { sides, ..self }
    }

    /// Whether joints (rad or m, of the robot file) are in this posture.
    fn holds(&self, arm: &CountedArm, q: &[f64]) -> bool {
        (0..q.len()).all(|joint| self.holds_joint(arm, q, joint))
            && self.is_on_sides(arm, q, &self.sides)
    }

    fn is_on_sides(&self, arm: &CountedArm, q: &[f64], stated: &StatedSides) -> bool {
        arm.sides
            .is_none_or(|sides| sides.hold(arm.robot, q, stated))
    }

    fn holds_joint(&self, arm: &CountedArm, q: &[f64], joint: usize) -> bool {
        let mut numbers = q.to_vec();
        arm.convention.to_controller(&mut numbers);
        self.ranges[joint]
            .is_none_or(|[low, high]| (low - BORDER..=high + BORDER).contains(&numbers[joint]))
    }

    /// Joints of the robot file by whole turns in their ranges and limits, of several the nearest to `from`; none where that is not in the
    /// posture.
    fn turned(&self, arm: &CountedArm, mut q: Vec<f64>, from: &[f64]) -> Option<Vec<f64>> {
        for joint in (0..q.len()).filter(|joint| arm.robot.is_revolute(*joint)) {
            let by = |turns: f64| {
                let mut q = q.clone();
                q[joint] += turns * TAU;
                q
            };
            let fits = |q: &Vec<f64>| {
                self.holds_joint(arm, q, joint) && excess(arm.robot, joint, q[joint]) == 0.0
            };
            let apart = |q: &Vec<f64>| (q[joint] - from[joint]).abs();
            q = [0.0, 1.0, -1.0]
                .map(by)
                .into_iter()
                .filter(fits)
                .min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        }
        let inside = (0..q.len()).all(|joint| excess(arm.robot, joint, q[joint]) == 0.0);
        (inside && self.holds(arm, &q)).then_some(q)
    }

    /// A start next to `q`: joints that have a range are put where `q` is within its limits.
    fn start(&self, arm: &CountedArm, q: &[f64]) -> Vec<f64> {
        let mut numbers = q.to_vec();
        arm.convention.to_controller(&mut numbers);
        for (joint, number) in numbers.iter_mut().enumerate() {
            let Some([low, high]) = self.ranges[joint] else {
                continue;
            };
            let [lower, upper] = arm.robot.description().joints[joint]
                .limits
                .unwrap_or([-PI, PI]);
            let share = ((q[joint] - lower) / (upper - lower)).clamp(0.0, 1.0);
            // An open range is searched over half a turn.
            let low = if low.is_finite() { low } else { high - PI };
            let high = if high.is_finite() { high } else { low + PI };
            *number = low + share * (high - low);
        }
        arm.convention.to_robot(&mut numbers);
        numbers
    }

    /// Starts of a search: `from`, then others on the stated sides of shoulder and elbow.
    fn starts<'a>(
        &'a self,
        arm: &'a CountedArm,
        from: &'a [f64],
    ) -> impl Iterator<Item = Vec<f64>> + 'a {
        let [shoulder, elbow, _] = self.sides;
        let others = (0..=SPREAD).map(move |number| match number {
            0 => self.start(arm, from),
            number => self.start(arm, &spread(arm.robot, number)),
        });
        let on_sides =
            others.filter(move |start| self.is_on_sides(arm, start, &[shoulder, elbow, None]));
        std::iter::once(from.to_vec()).chain(on_sides.take(STARTS))
    }
}

/// Joint positions (rad or m) at which the nominal robot is where it is wanted, in a posture and within its limits, near to `from`
/// where that leads there; none where none was found.
pub(super) fn inverse_in(
    arm: &CountedArm,
    wanted: &ToolGoal,
    from: &[f64],
    posture: &StatedPosture,
) -> Option<Vec<f64>> {
    let robot = arm.robot;
    let solved = |start: &[f64]| {
        let found = least_change(&mut Nominal::new(robot), wanted, start, start);
        let reached = found.residual + found.turn < REACHED;
        reached.then(|| into_limits(robot, &found.q))
    };
    let in_posture = |q: &Vec<f64>| posture.turned(arm, q.clone(), from);
    posture
        .starts(arm, from)
        .filter_map(|start| solved(&start))
        .find_map(|q| {
            let turned_over = || {
                arm.sides
                    .and_then(|sides| solved(&sides.turned_over(robot, &q)))
            };
            in_posture(&q).or_else(|| turned_over().as_ref().and_then(in_posture))
        })
}
