//! Motion of the links, and the regressor of a rigid arm's inverse dynamics: torque = Y(q, dq, ddq) theta, linear in the ten inertial
//! numbers of each link (Atkeson, An, Hollerbach, IJRR 1986; Khalil & Dombre 2002, ch. 9).
//!
//! Link frames sit at the joints' points and are parallel to the base at zero pose; the ten numbers of a link are mass, mass times centre
//! (3) and the inertia about the joint's point (xx xy xz yy yz zz), in these axes.

use super::arm::DynamicArm;
use crate::spatial::Pose;
use nalgebra::{Matrix3, Vector3};

/// Inertial numbers of a link.
pub const INERTIAL_NUMBERS: usize = 10;

/// Position, velocity and acceleration of the joints in one row, length n each.
#[derive(Clone, Copy)]
pub struct JointMotion<'a> {
    /// rad or m.
    pub position: &'a [f64],
    /// Per s.
    pub velocity: &'a [f64],
    /// Per s^2.
    pub acceleration: &'a [f64],
}

/// A link in its own frame: how it turns, and how its joint's point accelerates (gravity included).
#[derive(Debug, Clone, Copy)]
struct LinkMotion {
    /// From the link's frame into that of the link before.
    rotation: Matrix3<f64>,
    /// From the frame before to this one, in the axes of the frame before.
    arm: Vector3<f64>,
    spin: Vector3<f64>,
    spin_change: Vector3<f64>,
    acceleration: Vector3<f64>,
}

/// The inverse dynamics of one arm, with room for one row: nothing is allocated from row to row.
pub struct InverseDynamics {
    axes: Vec<Vector3<f64>>,
    /// From the point of the joint before.
    steps: Vec<Vector3<f64>>,
    prismatic: Vec<bool>,
    links: Vec<LinkMotion>,
}

/// A force and a moment per inertial number.
#[derive(Clone, Copy)]
struct Wrench {
    force: Vector3<f64>,
    moment: Vector3<f64>,
}

impl InverseDynamics {
    /// Of an arm's axes and points.
    pub fn new(arm: &DynamicArm) -> Self {
        let still = LinkMotion {
            rotation: Matrix3::identity(),
            arm: Vector3::zeros(),
            spin: Vector3::zeros(),
            spin_change: Vector3::zeros(),
            acceleration: Vector3::zeros(),
        };
        let before = |joint: usize| if joint == 0 { Vector3::zeros() } else { arm.points[joint - 1].coords };
        Self {
            axes: arm.axes.clone(),
            steps: (0..arm.joints()).map(|joint| arm.points[joint].coords - before(joint)).collect(),
            prismatic: arm.prismatic.clone(),
            links: vec![still; arm.joints()],
        }
    }

    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.axes.len()
    }

    /// Moves the links.
    fn advance(&mut self, motion: JointMotion, gravity: &Vector3<f64>) {
        let (mut spin, mut spin_change, mut acceleration) = (Vector3::zeros(), Vector3::zeros(), -gravity);
        for joint in 0..self.joints() {
            let axis = self.axes[joint];
            let (q, dq, ddq) = (motion.position[joint], motion.velocity[joint], motion.acceleration[joint]);
            let slides = self.prismatic[joint];
            let rotation = if slides { Matrix3::identity() } else { turn(&axis, q) };
            let arm = self.steps[joint] + if slides { axis * q } else { Vector3::zeros() };
            acceleration += spin_change.cross(&arm) + spin.cross(&spin.cross(&arm));
            if slides {
                acceleration += axis * ddq + 2.0 * spin.cross(&(axis * dq));
            }
            let back = rotation.transpose();
            acceleration = back * acceleration;
            spin = back * spin;
            spin_change = back * spin_change;
            if !slides {
                spin_change += spin.cross(&(axis * dq)) + axis * ddq;
                spin += axis * dq;
            }
            self.links[joint] = LinkMotion { rotation, arm, spin, spin_change, acceleration };
        }
    }

    /// The regressor of a row: `write(joint, link, numbers)` for every link and the joints up to it.
    pub fn regressor(
        &mut self,
        motion: JointMotion,
        gravity: &Vector3<f64>,
        mut write: impl FnMut(usize, usize, &[f64; INERTIAL_NUMBERS]),
    ) {
        self.advance(motion, gravity);
        for link in 0..self.joints() {
            let mut wrenches = unit_wrenches(&self.links[link]);
            for joint in (0..=link).rev() {
                let axis = &self.axes[joint];
                let torque =
                    |wrench: &Wrench| if self.prismatic[joint] { axis.dot(&wrench.force) } else { axis.dot(&wrench.moment) };
                write(joint, link, &wrenches.each_ref().map(torque));
                let LinkMotion { rotation, arm, .. } = &self.links[joint];
                for wrench in &mut wrenches {
                    wrench.force = rotation * wrench.force;
                    wrench.moment = rotation * wrench.moment + arm.cross(&wrench.force);
                }
            }
        }
    }

    /// Joint torques (n) of inertial numbers `theta` (10 n) in a row.
    pub fn torque(&mut self, motion: JointMotion, gravity: &Vector3<f64>, theta: &[f64], torque: &mut [f64]) {
        self.advance(motion, gravity);
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for joint in (0..self.joints()).rev() {
            let link = &self.links[joint];
            let own = wrench_of(link, &theta[INERTIAL_NUMBERS * joint..INERTIAL_NUMBERS * (joint + 1)]);
            force += own.force;
            moment += own.moment;
            torque[joint] = self.axes[joint].dot(if self.prismatic[joint] { &force } else { &moment });
            force = link.rotation * force;
            moment = link.rotation * moment + link.arm.cross(&force);
        }
    }
}

/// A turn about an axis.
pub fn turn(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    Pose::from_rotation_vector(axis * angle, Vector3::zeros()).rotation
}

/// What each inertial number asks of the joint's point for the motion of its link.
fn unit_wrenches(link: &LinkMotion) -> [Wrench; INERTIAL_NUMBERS] {
    let (w, dw, a) = (&link.spin, &link.spin_change, &link.acceleration);
    let none = Wrench { force: Vector3::zeros(), moment: Vector3::zeros() };
    let mut all = [none; INERTIAL_NUMBERS];
    all[0].force = *a;
    for axis in 0..3 {
        let unit = Vector3::ith(axis, 1.0);
        all[1 + axis].force = dw.cross(&unit) + w.cross(&w.cross(&unit));
        all[1 + axis].moment = unit.cross(a);
    }
    for (number, (row, column)) in INERTIA_ENTRIES.iter().enumerate() {
        let times = |v: &Vector3<f64>| {
            let mut product = Vector3::zeros();
            product[*row] += v[*column];
            if row != column {
                product[*column] += v[*row];
            }
            product
        };
        all[4 + number].moment = times(dw) + w.cross(&times(w));
    }
    all
}

/// The same of one link with numbers.
fn wrench_of(link: &LinkMotion, theta: &[f64]) -> Wrench {
    let (w, dw, a) = (&link.spin, &link.spin_change, &link.acceleration);
    let moment = Vector3::new(theta[1], theta[2], theta[3]);
    let inertia = inertia_matrix(&theta[4..]);
    Wrench {
        force: a * theta[0] + dw.cross(&moment) + w.cross(&w.cross(&moment)),
        moment: moment.cross(a) + inertia * dw + w.cross(&(inertia * w)),
    }
}

/// Where xx xy xz yy yz zz stand in the matrix.
pub const INERTIA_ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// The matrix of xx xy xz yy yz zz.
pub fn inertia_matrix(six: &[f64]) -> Matrix3<f64> {
    let mut matrix = Matrix3::zeros();
    for (number, (row, column)) in INERTIA_ENTRIES.into_iter().enumerate() {
        matrix[(row, column)] = six[number];
        matrix[(column, row)] = six[number];
    }
    matrix
}
