//! Commanded joints beside measured points, as the files say or as they would be with a set-up error mended.

use crate::criteria::setup::MOST;
use crate::robot::{Measurements, RobotModel, Travel};
use crate::spatial::Pose;
use crate::statistics::nearest;
use nalgebra::Vector3;

/// Rows of joints and points.
#[derive(Clone)]
pub(super) struct PointPairs<'a> {
    pub(crate) robot: &'a RobotModel,
    /// rad or m, row-major.
    pub(crate) q: Vec<f64>,
    /// m, tracker frame.
    pub(crate) points: Vec<Vector3<f64>>,
    /// The target of each point, numbered from 0, and how many there are.
    pub(crate) target: Vec<usize>,
    pub(crate) targets: usize,
}

/// Some of the rows, evenly over all of them.
pub(super) fn sampled(rows: &[usize]) -> Vec<usize> {
    rows.iter()
        .copied()
        .step_by(rows.len().div_ceil(*MOST).max(1))
        .collect()
}

impl<'a> PointPairs<'a> {
    /// Joints of rows, each beside the point of a row that has a whole one.
    pub(crate) fn of(
        robot: &'a RobotModel,
        data: &Measurements,
        rows: impl Iterator<Item = (usize, usize)>,
    ) -> Self {
        let (mut q, mut points, mut target) = (Vec::new(), Vec::new(), Vec::new());
        for (joints, point) in rows {
            let Some(place) = data.point(point) else {
                continue;
            };
            q.extend_from_slice(data.q(joints));
            points.push(place);
            target.push(robot.setup().target(data.target(point)).unwrap_or(0));
        }
        Self {
            robot,
            q,
            points,
            target,
            targets: robot.setup().targets.len().max(1),
        }
    }

    pub(crate) fn joints(&self) -> usize {
        self.robot.joints()
    }

    pub(crate) fn rows(&self) -> usize {
        self.points.len()
    }

    pub(crate) fn q(&self, row: usize) -> &[f64] {
        &self.q[row * self.joints()..(row + 1) * self.joints()]
    }

    /// The same with a joint's positions changed row by row.
    pub(crate) fn with_joints(&self, change: impl Fn(&mut [f64])) -> Self {
        let mut out = self.clone();
        out.q.chunks_mut(self.joints()).for_each(change);
        out
    }

    /// Some of the rows.
    pub(crate) fn only(&self, rows: &[usize]) -> Self {
        Self {
            q: rows.iter().flat_map(|row| self.q(*row).to_vec()).collect(),
            points: rows.iter().map(|row| self.points[*row]).collect(),
            target: rows.iter().map(|row| self.target[*row]).collect(),
            ..self.clone()
        }
    }

    pub(crate) fn with_points(&self, change: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Self {
        Self {
            points: self.points.iter().map(change).collect(),
            ..self.clone()
        }
    }

    /// Root mean square distance of the points from their centre, m.
    pub(crate) fn cloud(&self) -> f64 {
        let count = self.rows().max(1) as f64;
        let centre = self.points.iter().sum::<Vector3<f64>>() / count;
        (self
            .points
            .iter()
            .map(|point| (point - centre).norm_squared())
            .sum::<f64>()
            / count)
            .sqrt()
    }

    /// How far the tool point of the robot file gets in these rows from the first axis that turns, or from its middle, m.
    pub(crate) fn reach(&self) -> f64 {
        let robot = self.robot;
        let first = (0..robot.joints()).find(|joint| robot.is_revolute(*joint));
        let all: Vec<Vec<Pose>> = (0..self.rows())
            .map(|row| bodies(robot, self.q(row)))
            .collect();
        let tool = |bodies: &Vec<Pose>| bodies[robot.joints()].point(&robot.home().translation);
        let middle = all.iter().map(tool).sum::<Vector3<f64>>() / all.len().max(1) as f64;
        let distance = |bodies: &Vec<Pose>| {
            let of_axis =
                first.map(|joint| (tool(bodies) - bodies[joint].point(robot.point(joint))).norm());
            of_axis.unwrap_or(0.0).max((tool(bodies) - middle).norm())
        };
        all.iter().map(distance).fold(0.0, f64::max)
    }
}

/// Motions from the zero pose of the base and of the bodies that the joints move, base frame.
pub(super) fn bodies(robot: &RobotModel, q: &[f64]) -> Vec<Pose> {
    let mut out = vec![Pose::identity()];
    for (joint, travel) in q.iter().enumerate().take(robot.joints()) {
        out.push(out[joint] * robot.motion(joint, &Travel::new(*travel)));
    }
    out
}

/// The middle of lengths; infinite of none, and where any is not a number.
pub(super) fn median(lengths: &[f64]) -> f64 {
    if lengths.iter().any(|length| length.is_nan()) {
        return f64::INFINITY;
    }
    nearest(&mut lengths.to_vec(), 0.5).unwrap_or(f64::INFINITY)
}
