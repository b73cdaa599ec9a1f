//! The closed list of set-up errors, and what a recording is without one.
//!
//! Of an upright arm the axes of pitch are parallel to that of the first pitch joint, the others (swivel and roll) lie in the arm's
//! plane: joints 1, 4 and 6 of the usual six, which are tried whatever the wrist. Then come all joints, and every two.

use crate::criteria::setup::{FAR, FARTHEST, SHIFTS, SORTED};
use crate::robot::RobotModel;
use crate::setup::counting::Counting;
use crate::setup::order::ColumnOrder;
use crate::setup::placement::{FreeNumber, PointPairs, median, turning};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};

/// What an engineer may have got wrong; joints from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum WrongSetup {
    /// The points, by position in [`LENGTHS`].
    PointUnit(usize),
    /// The joints are in rad and were read in deg, or the other way round.
    InRadians,
    InDegrees,
    /// Joints turn the other way.
    Signs(SignGroup),
    Exchanged(usize, usize),
    /// More than two columns of joints stand in another order.
    Columns(ColumnOrder),
    /// What is reported at the robot file's zero, in quarters of a turn: 1, -1, or 2.
    Zero(usize, i32),
    /// The same of a joint and of the parallel one that follows it, such that only the link between them has another direction.
    Zeros {
        joint: usize,
        quarters: i32,
        next: i32,
    },
    /// Signs, zeros and couplings at once.
    Counting(Counting),
    /// The angle of joint `by` times `sign` is in that of joint `moved`.
    Coupled {
        moved: usize,
        by: usize,
        sign: f64,
    },
    /// One axis of the points has the wrong sign, or two are exchanged: a base that is fitted makes them one.
    Mirrored,
    Order(RowOrder),
    Number(FreeNumber),
}

/// By how much the points are longer than they were read, the unit that was read and the one that they are in.
pub(super) const LENGTHS: [(f64, &str, &str); 9] = [
    (25.4, "mm", "in"),
    (1e3, "mm", "m"),
    (1e-3, "mm", "um"),
    (1.0 / 25.4, "in", "mm"),
    (1e3 / 25.4, "in", "m"),
    (25.4e-3, "m", "in"),
    (1e6, "um", "m"),
    (1e-6, "m", "um"),
    (10.0, "mm", "cm"),
];

impl WrongSetup {
    /// All that this robot and these rows, in their order, may have.
    pub(crate) fn all(pairs: &PointPairs) -> Vec<Self> {
        let robot = pairs.robot;
        let turning = turning(robot);
        let mut out: Vec<Self> = (0..LENGTHS.len()).map(Self::PointUnit).collect();
        out.extend([Self::InRadians, Self::InDegrees]);
        out.extend(SignGroup::each(&turning).map(Self::Signs));
        // Before the mirror image: reversing all joints whose axes lie in the plane of a symmetric arm is one, and the usual reason.
        out.extend(SignGroup::all(robot).into_iter().map(Self::Signs));
        out.push(Self::Mirrored);
        out.extend(every_two(&turning).map(|(a, b)| Self::Exchanged(a, b)));
        let zeros = |joint: &usize| [1, -1, 2].map(|quarters| Self::Zero(*joint, quarters));
        out.extend(turning.iter().flat_map(zeros));
        let parallel = turning
            .windows(2)
            .filter(|pair| pair[1] == pair[0] + 1 && robot.is_parallel(pair[0], pair[1]));
        out.extend(parallel.clone().flat_map(|pair| {
            let against = if robot.axis(pair[0]).dot(robot.axis(pair[1])) > 0.0 {
                -1
            } else {
                1
            };
            [1, -1].map(|quarters| Self::Zeros {
                joint: pair[0],
                quarters,
                next: against * quarters,
            })
        }));
        out.extend(parallel.flat_map(|pair| {
            [1.0, -1.0].map(|sign| Self::Coupled {
                moved: pair[1],
                by: pair[0],
                sign,
            })
        }));
        out.extend(RowOrder::all(pairs).into_iter().map(Self::Order));
        out.extend(FreeNumber::all(robot).into_iter().map(Self::Number));
        out
    }

    /// The place of its mend in the order in which `ingest` applies them: columns, units, zeros, signs, couplings.
    pub(crate) fn rank(self) -> usize {
        match self {
            Self::Order(_) | Self::Exchanged(..) | Self::Columns(_) => 0,
            Self::PointUnit(_) | Self::InRadians | Self::InDegrees | Self::Mirrored => 1,
            Self::Zero(..) | Self::Zeros { .. } => 2,
            Self::Signs(_) | Self::Counting(_) => 3,
            Self::Coupled { .. } => 4,
            Self::Number(_) => 5,
        }
    }

    /// Whether it says of all joints at once how they are read.
    pub(crate) fn is_of_all_joints(self) -> bool {
        matches!(self, Self::Columns(_) | Self::Counting(_))
    }

    /// The number of the robot file that is to be found.
    pub fn number(self) -> Option<FreeNumber> {
        match self {
            Self::Number(number) => Some(number),
            _ => None,
        }
    }

    pub(crate) fn order(self) -> Option<RowOrder> {
        match self {
            Self::Order(order) => Some(order),
            _ => None,
        }
    }

    /// The recording without it; the order of rows and numbers of the robot file are mended elsewhere.
    pub(crate) fn mended<'a>(self, pairs: &PointPairs<'a>) -> PointPairs<'a> {
        let robot = pairs.robot;
        let scaled = |factor: f64| {
            pairs.with_joints(|q| {
                (0..q.len())
                    .filter(|joint| robot.is_revolute(*joint))
                    .for_each(|joint| q[joint] *= factor)
            })
        };
        match self {
            Self::PointUnit(unit) => pairs.with_points(|point| point * LENGTHS[unit].0),
            Self::InRadians => scaled(180.0 / PI),
            Self::InDegrees => scaled(PI / 180.0),
            Self::Signs(group) => {
                pairs.with_joints(|q| group.joints().for_each(|joint| q[joint] = -q[joint]))
            }
            Self::Exchanged(a, b) => pairs.with_joints(|q| q.swap(a, b)),
            Self::Columns(order) => pairs.with_joints(|q| order.to_robot(q)),
            Self::Zero(joint, quarters) => {
                pairs.with_joints(|q| q[joint] -= f64::from(quarters) * FRAC_PI_2)
            }
            Self::Zeros {
                joint,
                quarters,
                next,
            } => pairs.with_joints(|q| {
                q[joint] -= f64::from(quarters) * FRAC_PI_2;
                q[joint + 1] -= f64::from(next) * FRAC_PI_2;
            }),
            Self::Coupled { moved, by, sign } => pairs.with_joints(|q| q[moved] -= sign * q[by]),
            Self::Counting(counting) => pairs.with_joints(|q| counting.to_robot(q)),
            Self::Mirrored => pairs.with_points(|point| point.yxz()),
            Self::Order(_) | Self::Number(_) => pairs.clone(),
        }
    }
}

/// Every two of some joints.
fn every_two(joints: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    let with = |(k, a): (usize, &usize)| {
        let a = *a;
        joints[k + 1..].iter().map(move |b| (a, *b))
    };
    joints.iter().enumerate().flat_map(with)
}

/// Joints, from 0, as bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SignGroup(u64);

impl SignGroup {
    /// The groups of two joints or more that a robot may have: swivel and roll, pitch, the pitch of the main axes, all, and every two.
    pub(crate) fn all(robot: &RobotModel) -> Vec<Self> {
        let mut turning = turning(robot);
        turning.retain(|joint| *joint < 64);
        let mut neighbours = turning.windows(2);
        let pitch = neighbours.find(|pair| robot.is_parallel(pair[0], pair[1]));
        let pitch = pitch.map(|pair| pair[0]);
        let chosen = |choose: &dyn Fn(usize) -> bool| {
            Self::of(turning.iter().copied().filter(|joint| choose(*joint)))
        };
        let is_roll_of_six = |joint| robot.joints() == 6 && [0, 3, 5].contains(&joint);
        let mut out = vec![chosen(&is_roll_of_six)];
        if let Some(pitch) = pitch {
            let is_pitch = |joint: usize| robot.is_parallel(pitch, joint);
            let mut after = pitch..robot.joints();
            let wrist = after.find(|joint| !is_pitch(*joint));
            let wrist = wrist.unwrap_or(robot.joints());
            out.extend([
                chosen(&|joint| !is_pitch(joint)),
                chosen(&is_pitch),
                chosen(&|joint| is_pitch(joint) && joint < wrist),
            ]);
        }
        out.push(chosen(&|_| true));
        out.extend(every_two(&turning).map(|(a, b)| Self::of([a, b].into_iter())));
        let mut all: Vec<Self> = Vec::new();
        for group in out.into_iter().filter(|group| group.0.count_ones() > 1) {
            if !all.contains(&group) {
                all.push(group);
            }
        }
        all
    }

    /// A joint each.
    fn each(joints: &[usize]) -> impl Iterator<Item = Self> {
        let joints = joints.iter().filter(|joint| **joint < 64);
        joints.map(|joint| Self::of(std::iter::once(*joint)))
    }

    fn of(joints: impl Iterator<Item = usize>) -> Self {
        Self(joints.fold(0, |bits, joint| bits | 1 << joint))
    }

    /// Its joints, from 0.
    pub(crate) fn joints(self) -> impl Iterator<Item = usize> {
        (0..64).filter(move |joint| self.0 >> joint & 1 == 1)
    }
}

/// How the points are matched with the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RowOrder {
    /// The point of a row stands so many rows further on.
    Shifted(i64),
    Reversed,
    /// The points are sorted by name as text (1, 10, 11, 2), the joints are not; names count from `first`.
    PointsByText {
        first: usize,
    },
    /// The other way round.
    JointsByText {
        first: usize,
    },
}

impl RowOrder {
    /// Those that these rows, in their order, may be in.
    pub(crate) fn all(pairs: &PointPairs) -> Vec<Self> {
        let mut out = likely_shifts(pairs);
        out.push(Self::Reversed);
        if pairs.rows() >= *SORTED {
            out.extend(
                [1, 0]
                    .into_iter()
                    .flat_map(|first| [Self::PointsByText { first }, Self::JointsByText { first }]),
            );
        }
        out
    }

    /// The row of the point that belongs to the joints of each of `count` rows.
    pub(crate) fn partners(self, count: usize) -> Vec<usize> {
        let by_text = |first: usize| {
            let mut names: Vec<usize> = (first..first + count).collect();
            names.sort_by_key(usize::to_string);
            names
                .into_iter()
                .map(move |name| name - first)
                .collect::<Vec<usize>>()
        };
        match self {
            Self::Shifted(by) => (0..count)
                .map(|row| (row as i64 + by).rem_euclid(count.max(1) as i64) as usize)
                .collect(),
            Self::Reversed => (0..count).rev().collect(),
            Self::JointsByText { first } => by_text(first),
            Self::PointsByText { first } => {
                let mut out = vec![0; count];
                by_text(first)
                    .into_iter()
                    .enumerate()
                    .for_each(|(row, name)| out[name] = row);
                out
            }
        }
    }
}

/// The shifts by which the steps from point to point are most like those of the nominal arm: a rigid motion does not change them.
fn likely_shifts(pairs: &PointPairs) -> Vec<RowOrder> {
    let (robot, count) = (pairs.robot, pairs.rows());
    let forward = |row: usize| robot.forward(pairs.q(row)).translation;
    let model: Vec<Vector3<f64>> = (0..count).map(forward).collect();
    let (model, measured) = (steps(&model), steps(&pairs.points));
    let likeness = |shift: usize| {
        let products = (0..count).map(|row| model[row] * measured[(row + shift) % count]);
        products.sum::<f64>()
    };
    let tried = (1..count).filter(|shift| *shift.min(&(count - shift)) <= *FARTHEST);
    let mut all: Vec<(f64, usize)> = tried.map(|shift| (likeness(shift), shift)).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let signed = |shift: usize| {
        if 2 * shift > count {
            shift as i64 - count as i64
        } else {
            shift as i64
        }
    };
    all.into_iter()
        .take(*SHIFTS)
        .map(|(_, shift)| RowOrder::Shifted(signed(shift)))
        .collect()
}

/// Distances from each point to the next, the first being next to the last, less their mean.
fn steps(points: &[Vector3<f64>]) -> Vec<f64> {
    let next = points.iter().cycle().skip(1);
    let lengths = points.iter().zip(next);
    let mut lengths: Vec<f64> = lengths.map(|(a, b)| (b - a).norm()).collect();
    let limit = *FAR * median(&lengths);
    lengths
        .iter_mut()
        .for_each(|length| *length = length.min(limit));
    let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
    lengths.into_iter().map(|length| length - mean).collect()
}

#[cfg(test)]
mod tests {
    use super::RowOrder;

    #[test]
    fn partners_undo_the_sorting_of_one_file() {
        // Sorted as text, 1 to 12 stand as 1, 10, 11, 12, 2, ..., 9.
        let points = RowOrder::PointsByText { first: 1 }.partners(12);
        assert_eq!(points, [0, 4, 5, 6, 7, 8, 9, 10, 11, 1, 2, 3]);
        let joints = RowOrder::JointsByText { first: 1 }.partners(12);
        assert_eq!(joints, [0, 9, 10, 11, 1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(RowOrder::Shifted(-1).partners(4), [3, 0, 1, 2]);
        assert_eq!(RowOrder::Reversed.partners(3), [2, 1, 0]);
    }
}
