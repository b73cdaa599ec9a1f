//! The nominal robot placed on measured points: its base and where each target sits on the tool, and one number of the robot file where
//! that is asked. Gauss-Newton from Kabsch's solution, with far points trimmed.

use crate::criteria::setup::{FAR, SAMPLE};
use crate::estimate::align_points;
use crate::robot::{Measurements, RobotModel, Travel};
use crate::spatial::{Pose, hat};
use crate::statistics::nearest;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

/// Steps: from a tool point that is a third of the arm off it takes seven.
const STEPS: usize = 20;
/// A step that brings less than this share ends it.
const SETTLED: f64 = 1e-4;
/// Share of a normal equation's diagonal that keeps unseen numbers where they are.
const RIDGE: f64 = 1e-9;

/// Where robot and targets stand, and what is left.
#[derive(Clone)]
pub(super) struct Placement {
    /// Pose of the base in the tracker's frame.
    base: Pose,
    /// Positions of the targets at the zero pose, base frame, m.
    seats: Vec<Vector3<f64>>,
    /// Values of the number that was asked for: m or rad.
    pub(crate) values: Vec<f64>,
    /// Distance of each point, m.
    pub(crate) off: Vec<f64>,
    /// Their median.
    pub(crate) left: f64,
}

impl Placement {
    /// One that is not judged yet.
    fn at(base: Pose, seats: Vec<Vector3<f64>>, values: Vec<f64>) -> Self {
        Self {
            base,
            seats,
            values,
            off: Vec::new(),
            left: 0.0,
        }
    }

    /// By how much it misses points, in the tracker's frame and in that of the last body.
    pub(crate) fn missed(&self, pairs: &PointPairs) -> [Vec<Vector3<f64>>; 2] {
        let missed = |row: usize| {
            let body = pairs.last_body(row);
            let missed =
                pairs.points[row] - self.base.point(&body.point(&self.seats[pairs.target[row]]));
            (
                missed,
                (self.base.rotation * body.rotation).transpose() * missed,
            )
        };
        let (there, turned) = (0..pairs.rows()).map(missed).unzip();
        [there, turned]
    }

    /// How far another one's base stands from its own, m.
    pub(crate) fn base_apart(&self, other: &Self) -> f64 {
        (self.base.translation - other.base.translation).norm()
    }

    /// How far another one's targets sit from its own at most, m.
    pub(crate) fn tool_apart(&self, other: &Self) -> f64 {
        let seats = self.seats.iter().zip(&other.seats);
        seats.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }
}

/// The best placement.
pub(super) fn place(pairs: &PointPairs, number: Option<FreeNumber>) -> Placement {
    let robot = pairs.robot;
    let bodies: Vec<Pose> = (0..pairs.rows()).map(|row| pairs.last_body(row)).collect();
    let seats = vec![robot.home().translation; pairs.targets];
    let model = bodies.iter().zip(&pairs.target);
    let model: Vec<Vector3<f64>> = model
        .map(|(body, target)| body.point(&seats[*target]))
        .collect();
    let base = align_points(&model, &pairs.points);
    let values = vec![0.0; number.map_or(0, FreeNumber::width)];
    let problem = PlacementProblem {
        pairs,
        bodies,
        number,
    };
    let mut now = problem.judged(Placement::at(base, seats, values));
    let mut best = now.clone();
    for _ in 0..STEPS {
        let Some(next) = problem.step(&now).map(|next| problem.judged(next)) else {
            break;
        };
        let settled = (now.left - next.left).abs() <= SETTLED * now.left;
        now = next;
        if now.left < best.left {
            best = now.clone();
        }
        if settled {
            break;
        }
    }
    best
}

struct PlacementProblem<'a, 'b> {
    pairs: &'b PointPairs<'a>,
    bodies: Vec<Pose>,
    number: Option<FreeNumber>,
}

impl PlacementProblem<'_, '_> {
    fn seen(&self, now: &Placement, row: usize) -> SeenNumber {
        match self.number {
            Some(number) => number.seen(
                self.pairs.robot,
                self.pairs.q(row),
                &now.values,
                &now.seats[self.pairs.target[row]],
            ),
            None => SeenNumber {
                body: self.bodies[row],
                shift: Vector3::zeros(),
                columns: Vec::new(),
            },
        }
    }

    /// A row's point in the base frame.
    fn point(&self, now: &Placement, row: usize, seen: &SeenNumber) -> Vector3<f64> {
        seen.body.point(&now.seats[self.pairs.target[row]]) + seen.shift
    }

    /// With its distances.
    fn judged(&self, mut now: Placement) -> Placement {
        let off = |row: usize| {
            let seen = self.seen(&now, row);
            (self.pairs.points[row] - now.base.point(&self.point(&now, row, &seen))).norm()
        };
        now.off = (0..self.pairs.rows()).map(off).collect();
        now.left = median(&now.off);
        now
    }

    /// One step of Gauss and Newton over the rows that are not far off.
    fn step(&self, now: &Placement) -> Option<Placement> {
        let targets = 3 * now.seats.len();
        let width = 6 + targets + now.values.len();
        let mut normal = DMatrix::<f64>::zeros(width, width);
        let mut right = DVector::<f64>::zeros(width);
        let kept: Vec<usize> = (0..now.off.len())
            .filter(|row| now.off[*row] <= *FAR * now.left)
            .collect();
        let points = kept.iter().map(|row| self.pairs.points[*row]);
        let centre = points.sum::<Vector3<f64>>() / kept.len().max(1) as f64;
        for row in kept {
            let seen = self.seen(now, row);
            let at = now.base.point(&self.point(now, row, &seen));
            let residual = self.pairs.points[row] - at;
            let turned = now.base.rotation * seen.body.rotation;
            let block = |first: usize, matrix: Matrix3<f64>| {
                (0..3).map(move |k| (first + k, matrix.column(k).into_owned()))
            };
            let mut columns: Vec<(usize, Vector3<f64>)> = block(0, -hat(&(at - centre))).collect();
            columns.extend(block(3, Matrix3::identity()));
            columns.extend(block(6 + 3 * self.pairs.target[row], turned));
            let numbers = (6 + targets..).zip(&seen.columns);
            columns.extend(numbers.map(|(k, column)| (k, now.base.rotation * column)));
            for (i, a) in &columns {
                right[*i] += a.dot(&residual);
                columns
                    .iter()
                    .for_each(|(j, b)| normal[(*i, *j)] += a.dot(b));
            }
        }
        let ridge = RIDGE * normal.diagonal().max();
        (0..width).for_each(|k| normal[(k, k)] += ridge);
        let by = normal.cholesky()?.solve(&right);
        let three = |first: usize| Vector3::new(by[first], by[first + 1], by[first + 2]);
        let turn = Rotation3::new(three(0)).into_inner();
        let base = Pose::new(
            turn * now.base.rotation,
            centre + turn * (now.base.translation - centre) + three(3),
        );
        let seats = now.seats.iter().enumerate();
        let seats = seats.map(|(k, seat)| seat + three(6 + 3 * k)).collect();
        let values = now.values.iter().enumerate();
        let values = values.map(|(k, value)| value + by[6 + targets + k]);
        Some(Placement::at(base, seats, values.collect()))
    }
}

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
        .step_by(rows.len().div_ceil(*SAMPLE).max(1))
        .collect()
}

impl<'a> PointPairs<'a> {
    /// Joints of rows, each with the point of a row that has a whole one.
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

    fn last_body(&self, row: usize) -> Pose {
        bodies(self.robot, self.q(row))[self.joints()]
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

    /// So many of the rows at most, evenly over all of them.
    pub(crate) fn every(&self, most: usize) -> Self {
        let step = self.rows().div_ceil(most).max(1);
        let rows: Vec<usize> = (0..self.rows()).step_by(step).collect();
        self.only(&rows)
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
        let squares = self
            .points
            .iter()
            .map(|point| (point - centre).norm_squared());
        (squares.sum::<f64>() / count).sqrt()
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
            let from_axis =
                first.map(|joint| (tool(bodies) - bodies[joint].point(robot.point(joint))).norm());
            from_axis.unwrap_or(0.0).max((tool(bodies) - middle).norm())
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

/// The joints that turn.
pub(super) fn turning(robot: &RobotModel) -> Vec<usize> {
    let joints = 0..robot.joints();
    joints.filter(|joint| robot.is_revolute(*joint)).collect()
}

/// The middle of lengths; infinite of none, and where any is not a number.
pub(super) fn median(lengths: &[f64]) -> f64 {
    if lengths.iter().any(|length| length.is_nan()) {
        return f64::INFINITY;
    }
    nearest(&mut lengths.to_vec(), 0.5).unwrap_or(f64::INFINITY)
}

/// A number, or the three of a displacement, to be found from the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FreeNumber {
    /// All behind the link that joint `.0` (from 0) moves stands elsewhere: base axes at the zero pose, m.
    Length(usize),
    /// The axis of a joint alone stands elsewhere, m.
    Axis(usize),
    /// The zero of a joint, rad.
    Zero(usize),
}

/// What a row sees of it: the last body, a displacement of the point, and the motion of the point by each number, base frame.
pub(super) struct SeenNumber {
    pub(crate) body: Pose,
    pub(crate) shift: Vector3<f64>,
    pub(crate) columns: Vec<Vector3<f64>>,
}

impl FreeNumber {
    /// All that a robot has.
    pub(crate) fn all(robot: &RobotModel) -> Vec<Self> {
        let (turning, last) = (turning(robot), robot.joints().saturating_sub(1));
        let axes = turning.iter().filter(|joint| **joint > 0);
        // The first zero is the base's, the last one the tool's.
        let zeros = turning.iter().filter(|joint| (1..last).contains(*joint));
        let mut out: Vec<Self> = (0..last).map(Self::Length).collect();
        out.extend(axes.map(|joint| Self::Axis(*joint)));
        out.extend(zeros.map(|joint| Self::Zero(*joint)));
        out
    }

    pub(crate) fn width(self) -> usize {
        if matches!(self, Self::Zero(_)) { 1 } else { 3 }
    }

    /// What a row sees of it at joint positions `q`; `seat` is where the point sits at the zero pose.
    pub(crate) fn seen(
        self,
        robot: &RobotModel,
        q: &[f64],
        values: &[f64],
        seat: &Vector3<f64>,
    ) -> SeenNumber {
        if let Self::Zero(joint) = self {
            let mut turned = q.to_vec();
            turned[joint] += values[0];
            let all = bodies(robot, &turned);
            let body = all[robot.joints()];
            let arm = body.point(seat) - all[joint].point(robot.point(joint));
            return SeenNumber {
                body,
                shift: Vector3::zeros(),
                columns: vec![(all[joint].rotation * robot.axis(joint)).cross(&arm)],
            };
        }
        let all = bodies(robot, q);
        let by: Matrix3<f64> = match self {
            Self::Axis(joint) => all[joint].rotation - all[joint + 1].rotation,
            Self::Length(joint) | Self::Zero(joint) => all[joint + 1].rotation,
        };
        let columns: Vec<Vector3<f64>> = (0..3).map(|axis| by.column(axis).into()).collect();
        let shift = columns.iter().zip(values);
        SeenNumber {
            body: all[robot.joints()],
            shift: shift.map(|(column, value)| column * *value).sum(),
            columns,
        }
    }
}
