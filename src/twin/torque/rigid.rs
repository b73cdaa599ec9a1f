//! Rigid bodies on moving joints: accelerations from the base outwards, and for each joint the sum over the bodies beyond it of what
//! moves them (d'Alembert), about the joint's axis. Base frame throughout; no recursion of forces, no regressor.

use crate::matrix::{self, Matrix, Vector, add, cross, dot, minus, scale};

/// A body with its mass where it is, base frame at the zero pose, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub centre: Vector,
    /// kg m2 about the centre: xx, xy, xz, yy, yz, zz.
    pub inertia: [f64; 6],
}

/// An arm of revolute joints and its bodies, base frame at the zero pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Unit vectors of the axes.
    pub axes: Vec<Vector>,
    /// A point on each axis, m.
    pub points: Vec<Vector>,
    /// The tool point, m.
    pub tool: Vector,
    /// One a joint.
    pub links: Vec<Body>,
    /// On the last link.
    pub payload: Option<Body>,
    /// m/s2.
    pub gravity: Vector,
}

/// Where joints are and how they move: rad, rad/s, rad/s2.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointState {
    /// rad.
    pub q: Vec<f64>,
    /// rad/s.
    pub v: Vec<f64>,
    /// rad/s2.
    pub a: Vec<f64>,
}

/// What a body takes: force at its centre and moment about it.
struct Load {
    centre: Vector,
    force: Vector,
    moment: Vector,
}

/// Axes and points of the joints and the frames of the links as they are now.
struct Pose {
    axes: Vec<Vector>,
    points: Vec<Vector>,
    frames: Vec<Matrix>,
}

impl Machine {
    fn pose(&self, q: &[f64]) -> Pose {
        let mut pose = Pose {
            axes: Vec::new(),
            points: Vec::new(),
            frames: Vec::new(),
        };
        let mut at = matrix::IDENTITY;
        for ((axis, point), angle) in self.axes.iter().zip(&self.points).zip(q) {
            pose.axes.push(matrix::direct(&at, *axis));
            pose.points.push(matrix::place(&at, *point));
            let about = matrix::times(&matrix::shift(*point), &matrix::turn(*axis, *angle));
            at = matrix::times(
                &at,
                &matrix::times(&about, &matrix::shift(scale(*point, -1.0))),
            );
            pose.frames.push(at);
        }
        pose
    }

    /// Nm that each joint needs for this motion, no friction.
    pub fn torque(&self, state: &JointState) -> Vec<f64> {
        let pose = self.pose(&state.q);
        let n = self.axes.len();
        let (mut spin, mut turn, mut push) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        let mut before = pose.points[0];
        let mut loads: Vec<(usize, Load)> = Vec::with_capacity(n + 1);
        for j in 0..n {
            let arm = minus(pose.points[j], before);
            push = add(push, add(cross(turn, arm), cross(spin, cross(spin, arm))));
            before = pose.points[j];
            let rate = scale(pose.axes[j], state.v[j]);
            turn = add(
                turn,
                add(scale(pose.axes[j], state.a[j]), cross(spin, rate)),
            );
            spin = add(spin, rate);
            let last = (j + 1 == n).then_some(self.payload.as_ref()).flatten();
            for body in std::iter::once(&self.links[j]).chain(last) {
                loads.push((
                    j,
                    self.load(body, &pose.frames[j], pose.points[j], [spin, turn, push]),
                ));
            }
        }
        let about = |j: usize| {
            let beyond = loads
                .iter()
                .filter(|(link, _)| *link >= j)
                .map(|(_, load)| {
                    dot(
                        pose.axes[j],
                        add(
                            load.moment,
                            cross(minus(load.centre, pose.points[j]), load.force),
                        ),
                    )
                });
            beyond.sum::<f64>()
        };
        (0..n).map(about).collect()
    }

    fn load(
        &self,
        body: &Body,
        frame: &Matrix,
        point: Vector,
        [spin, turn, push]: [Vector; 3],
    ) -> Load {
        let centre = matrix::place(frame, body.centre);
        let arm = minus(centre, point);
        let moves = add(push, add(cross(turn, arm), cross(spin, cross(spin, arm))));
        // In the axes of the body, where its inertia does not change.
        let within = |v: Vector| matrix::see(frame, v);
        let (w, a) = (within(spin), within(turn));
        let moment = add(tensor(&body.inertia, a), cross(w, tensor(&body.inertia, w)));
        Load {
            centre,
            force: scale(minus(moves, self.gravity), body.mass),
            moment: matrix::direct(frame, moment),
        }
    }

    /// Nm at each joint that hold against a force at the tool (N, base frame).
    pub(crate) fn against(&self, q: &[f64], force: Vector) -> Vec<f64> {
        let pose = self.pose(q);
        let tool = pose
            .frames
            .last()
            .map_or(self.tool, |frame| matrix::place(frame, self.tool));
        let own = pose.axes.iter().zip(&pose.points);
        own.map(|(axis, point)| -dot(*axis, cross(minus(tool, *point), force)))
            .collect()
    }
}

fn tensor([xx, xy, xz, yy, yz, zz]: &[f64; 6], v: Vector) -> Vector {
    [
        xx * v[0] + xy * v[1] + xz * v[2],
        xy * v[0] + yy * v[1] + yz * v[2],
        xz * v[0] + yz * v[1] + zz * v[2],
    ]
}
