//! How a controller may count an arm's joints otherwise than the robot file: signs, zeros by quarter turns and couplings of parallel neighbours,
//! searched together, since each of them hides behind the others.
//!
//! From every choice of signs, and of the two zeros nearest to the base, zeros and couplings descend one by one, then two by two. What a counting leaves is judged without fitting a base:
//! where joints are counted rightly the point in the robot's frame, R s + t by the bodies' poses and the unknown seat s, is an affine image
//! of the measured one, which is linear in all unknowns. Rigid placements judge the best of them.

use crate::criteria::setup::{CLOUD, COUNTINGS, FAR, SAME, SCREENED};
use crate::robot::RobotModel;
use crate::setup::placement::{PointPairs, bodies, median, turning};
use crate::spatial::Pose;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// Arms of more joints are not searched.
pub(super) const LIMIT: usize = 8;
/// Share of a normal equation's diagonal that keeps unseen numbers where they are.
const RIDGE: f64 = 1e-9;
/// A choice that leaves less by this share is better.
const SETTLED: f64 = 1e-6;

/// A joint's number: sign (true + quarter turns), and so often the joint before it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct CountedJoint {
    pub(crate) reversed: bool,
    /// What is shown at the robot file's zero.
    pub(crate) quarters: i32,
    /// -1, 0 or 1.
    pub(crate) coupled: i32,
}

/// Of each joint of an arm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Counting([CountedJoint; LIMIT]);

/// A number that is searched, of a joint.
#[derive(Clone, Copy)]
enum Searched {
    Sign(usize),
    Zero(usize),
    Coupling(usize),
}

impl Searched {
    /// The zero of the first joint is the base's, that of the last one the tool's.
    fn all(robot: &RobotModel) -> Vec<Self> {
        let n = robot.joints();
        let zeros = (1..n.saturating_sub(1))
            .filter(|joint| robot.is_revolute(*joint))
            .map(Self::Zero);
        let coupled = |joint: &usize| {
            robot.is_revolute(*joint)
                && robot.is_revolute(joint - 1)
                && robot.is_parallel(joint - 1, *joint)
        };
        zeros
            .chain((1..n).filter(coupled).map(Self::Coupling))
            .collect()
    }

    fn values(self) -> &'static [i32] {
        match self {
            Self::Sign(_) => &[0, 1],
            Self::Zero(_) => &[0, 1, -1, 2],
            Self::Coupling(_) => &[0, 1, -1],
        }
    }

    /// A counting with every value of it, and of another number.
    fn choices(self, other: Option<Self>, counting: Counting) -> Vec<Counting> {
        let first = self.values().iter().map(|value| self.set(counting, *value));
        match other {
            Some(other) => first
                .flat_map(|counting| other.choices(None, counting))
                .collect(),
            None => first.collect(),
        }
    }

    fn set(self, mut counting: Counting, value: i32) -> Counting {
        match self {
            Self::Sign(joint) => counting.0[joint].reversed = value == 1,
            Self::Zero(joint) => counting.0[joint].quarters = value,
            Self::Coupling(joint) => counting.0[joint].coupled = value,
        }
        counting
    }
}

impl Counting {
    pub(crate) fn joints(&self) -> &[CountedJoint] {
        &self.0
    }

    /// The controller's numbers -> joint positions of the robot file, in the order of `ingest`: zeros, signs, couplings.
    pub(crate) fn to_robot(self, q: &mut [f64]) {
        for (q, joint) in q.iter_mut().zip(&self.0) {
            *q -= f64::from(joint.quarters) * FRAC_PI_2;
            if joint.reversed {
                *q = -*q;
            }
        }
        for joint in 1..q.len().min(LIMIT) {
            q[joint] -= f64::from(self.0[joint].coupled) * q[joint - 1];
        }
    }

    /// How much is otherwise: of two countings that are the same by kinematics the smaller one is meant.
    fn effort(&self) -> i32 {
        let changes = |joint: &CountedJoint| {
            2 * i32::from(joint.reversed) + 3 * joint.quarters.abs() + 5 * joint.coupled.abs()
        };
        self.0.iter().map(changes).sum()
    }

    /// Those that leave least of these points, from the one that changes least on, each in its simplest form.
    pub(crate) fn likely(pairs: &PointPairs) -> Vec<Self> {
        let robot = pairs.robot;
        let turning = &turning(robot);
        if robot.joints() > LIMIT {
            return Vec::new();
        }
        let affine = AffineImage {
            pairs: &pairs.every(*SCREENED),
        };
        let searched = Searched::all(robot);
        // The zeros with the longest levers are tried all: no descent leads from one of them to another.
        let levers = searched
            .iter()
            .filter(|one| matches!(one, Searched::Zero(_)));
        let mut levers = levers.copied();
        let turned: Vec<Self> = match (levers.next(), levers.next()) {
            (Some(first), second) => first.choices(second, Self::default()),
            _ => vec![Self::default()],
        };
        let with_signs = |bits: usize| {
            turned.iter().map(move |counting| {
                let mut counting = *counting;
                for (bit, joint) in turning.iter().enumerate() {
                    counting.0[*joint].reversed = bits >> bit & 1 == 1;
                }
                counting
            })
        };
        let starts: Vec<Self> = (0..1usize << turning.len()).flat_map(with_signs).collect();
        let alone = starts
            .into_par_iter()
            .map(|start| affine.descended(start, &searched, 1));
        let alone = best(alone.collect(), 2 * *COUNTINGS);
        let together = alone
            .into_par_iter()
            .map(|start| affine.descended(start, &searched, 2));
        let found = best(together.collect(), *COUNTINGS);
        let mut all: Vec<Searched> = turning.iter().map(|joint| Searched::Sign(*joint)).collect();
        all.extend(searched);
        let found = found.into_par_iter().map(|one| affine.simplest(one, &all));
        let mut simple: Vec<Self> = Vec::new();
        for one in found.collect::<Vec<_>>() {
            if !simple.contains(&one) {
                simple.push(one);
            }
        }
        simple.sort_by_key(Self::effort);
        simple
    }
}

/// The best of countings with what they leave.
fn best(mut all: Vec<(f64, Counting)>, most: usize) -> Vec<Counting> {
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<Counting> = Vec::new();
    for (_, counting) in all {
        if out.len() < most && !out.contains(&counting) {
            out.push(counting);
        }
    }
    out
}

pub(super) struct AffineImage<'a, 'b> {
    pub(crate) pairs: &'b PointPairs<'a>,
}

impl AffineImage<'_, '_> {
    /// Changes so many numbers at once as long as that leaves less.
    fn descended(&self, start: Counting, searched: &[Searched], at_once: usize) -> (f64, Counting) {
        let mut now = (self.left(start), start);
        loop {
            let before = now.0;
            for (k, one) in searched.iter().enumerate() {
                let others: Vec<Option<Searched>> = match at_once {
                    1 => vec![None],
                    _ => searched[k + 1..].iter().copied().map(Some).collect(),
                };
                for other in others {
                    for tried in one.choices(other, now.1) {
                        let left = if tried == now.1 {
                            now.0
                        } else {
                            self.left(tried)
                        };
                        if left < (1.0 - SETTLED) * now.0 {
                            now = (left, tried);
                        }
                    }
                }
            }
            if now.0 >= (1.0 - SETTLED) * before {
                return now;
            }
        }
    }

    /// The counting of least effort that leaves the same, one number or two changed at a time: turned wrists and mirrored arms are the same.
    fn simplest(&self, start: Counting, searched: &[Searched]) -> Counting {
        let most = *SAME * self.left(start);
        let mut now = start;
        loop {
            let choices = searched.iter().enumerate().flat_map(|(k, one)| {
                let others = searched[k + 1..].iter().copied().map(Some);
                let others = std::iter::once(None).chain(others);
                others.flat_map(move |other| one.choices(other, now))
            });
            let mut simpler: Vec<Counting> = choices
                .filter(|tried| tried.effort() < now.effort())
                .collect();
            simpler.sort_by_key(Counting::effort);
            let Some(next) = simpler.into_iter().find(|tried| self.left(*tried) <= most) else {
                return now;
            };
            now = next;
        }
    }

    fn left(&self, counting: Counting) -> f64 {
        self.left_with(|q| counting.to_robot(q))
    }

    /// What is left of the points with the joints of every row changed, as a share of how far the points are apart; far ones trimmed once.
    pub(crate) fn left_with(&self, change: impl Fn(&mut [f64])) -> f64 {
        let pairs = self.pairs;
        let poses: Vec<Pose> = (0..pairs.rows())
            .map(|row| {
                let mut q = pairs.q(row).to_vec();
                change(&mut q);
                bodies(pairs.robot, &q)[pairs.joints()]
            })
            .collect();
        let all: Vec<usize> = (0..poses.len()).collect();
        let Some((off, spread)) = self.off(&poses, &all) else {
            return f64::INFINITY;
        };
        let middle = median(&off);
        // Where most points are far from each other's images none is an exception.
        if middle > *CLOUD * spread {
            return middle / spread;
        }
        let near: Vec<usize> = all
            .iter()
            .copied()
            .filter(|row| off[*row] <= *FAR * middle)
            .collect();
        if near.len() == all.len() {
            return middle / spread;
        }
        self.off(&poses, &near)
            .map_or(f64::INFINITY, |(off, spread)| median(&off) / spread)
    }

    /// Distance of each of some rows from the best affine image of its point, and how far the images are apart, m.
    fn off(&self, poses: &[Pose], rows: &[usize]) -> Option<(Vec<f64>, f64)> {
        let pairs = self.pairs;
        let (count, width) = (rows.len(), 3 * pairs.targets);
        let points = DMatrix::from_fn(count, 4, |row, k| {
            if k < 3 {
                pairs.points[rows[row]][k]
            } else {
                1.0
            }
        });
        let basis = points.qr().q();
        // Columns of the seats, and that of the bodies' own places.
        let columns = |k: usize| {
            let mut out = DMatrix::zeros(count, width + 1);
            for (row, number) in rows.iter().enumerate() {
                let pose = &poses[*number];
                (0..3).for_each(|c| {
                    out[(row, 3 * pairs.target[*number] + c)] = pose.rotation[(k, c)]
                });
                out[(row, width)] = pose.translation[k];
            }
            out
        };
        let blocks: [DMatrix<f64>; 3] = [0, 1, 2].map(columns);
        let projected = blocks
            .each_ref()
            .map(|block| block - &basis * basis.tr_mul(block));
        let normal = projected
            .iter()
            .map(|part| part.tr_mul(part))
            .fold(DMatrix::zeros(width + 1, width + 1), |sum, one| sum + one);
        let mut seats = normal.view((0, 0), (width, width)).into_owned();
        let ridge = RIDGE * seats.diagonal().max().max(f64::MIN_POSITIVE);
        (0..width).for_each(|k| seats[(k, k)] += ridge);
        let right: DVector<f64> = -normal.view((0, width), (width, 1)).column(0);
        let seat = seats.cholesky()?.solve(&right).push(1.0);
        let size = |all: &[DMatrix<f64>; 3]| -> Vec<f64> {
            let [x, y, z] = all.each_ref().map(|one| one * &seat);
            (0..count)
                .map(|row| (x[row] * x[row] + y[row] * y[row] + z[row] * z[row]).sqrt())
                .collect()
        };
        let centred = blocks.map(|block| {
            let mean = block.row_mean();
            DMatrix::from_fn(count, width + 1, |row, column| {
                block[(row, column)] - mean[column]
            })
        });
        let spread =
            (size(&centred).iter().map(|x| x * x).sum::<f64>() / count.max(1) as f64).sqrt();
        Some((size(&projected), spread.max(f64::MIN_POSITIVE)))
    }
}
