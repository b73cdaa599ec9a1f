//! The closed list of set-up errors, and what a recording is without one.

use super::counting::Counting;
use super::number::FreeNumber;
use super::order::RowOrder;
use super::pairs::PointPairs;
use super::sign_group::SignGroup;
use std::f64::consts::{FRAC_PI_2, PI};

/// What an engineer may have got wrong; joints from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum WrongSetup {
    /// The points, by position in [`LENGTHS`].
    PointUnit(usize),
    /// The joints are in rad and were read in deg, or the other way round.
    InRadians,
    InDegrees,
    Sign(usize),
    /// Several joints turn the other way.
    Signs(SignGroup),
    Exchanged(usize, usize),
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
        let turning: Vec<usize> = (0..robot.joints())
            .filter(|joint| robot.is_revolute(*joint))
            .collect();
        let mut out: Vec<Self> = (0..LENGTHS.len()).map(Self::PointUnit).collect();
        out.extend([Self::InRadians, Self::InDegrees]);
        out.extend(turning.iter().map(|joint| Self::Sign(*joint)));
        // Before the mirror image: reversing all joints whose axes lie in the plane of a symmetric arm is one, and the usual reason.
        out.extend(SignGroup::all(robot).into_iter().map(Self::Signs));
        out.push(Self::Mirrored);
        let pairs_from = |k: usize| turning[k + 1..].iter().map(move |b| (k, b));
        out.extend(
            (0..turning.len())
                .flat_map(pairs_from)
                .map(|(k, b)| Self::Exchanged(turning[k], *b)),
        );
        out.extend(
            turning
                .iter()
                .flat_map(|joint| [1, -1, 2].map(|quarters| Self::Zero(*joint, quarters))),
        );
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
            Self::Order(_) | Self::Exchanged(..) => 0,
            Self::PointUnit(_) | Self::InRadians | Self::InDegrees | Self::Mirrored => 1,
            Self::Zero(..) | Self::Zeros { .. } => 2,
            Self::Sign(_) | Self::Signs(_) | Self::Counting(_) => 3,
            Self::Coupled { .. } => 4,
            Self::Number(_) => 5,
        }
    }

    /// The number of the robot file that is to be found.
    pub fn number(self) -> Option<FreeNumber> {
        if let Self::Number(number) = self {
            Some(number)
        } else {
            None
        }
    }

    pub(crate) fn order(self) -> Option<RowOrder> {
        if let Self::Order(order) = self {
            Some(order)
        } else {
            None
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
            Self::Sign(joint) => pairs.with_joints(|q| q[joint] = -q[joint]),
            Self::Signs(group) => {
                pairs.with_joints(|q| group.joints().for_each(|joint| q[joint] = -q[joint]))
            }
            Self::Exchanged(a, b) => pairs.with_joints(|q| q.swap(a, b)),
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
