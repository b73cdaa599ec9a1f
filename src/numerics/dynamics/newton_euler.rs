//! Motion of the links, and the regressor of a rigid arm's inverse dynamics: torque = Y(q, dq, ddq) theta, linear in the ten inertial
//! numbers of each link (Atkeson, An, Hollerbach, IJRR 1986; Khalil & Dombre 2002, ch. 9).
//!
//! Link frames sit at the joints' points and are parallel to the base at zero pose; the ten numbers of a link are mass, mass times centre
//! (3) and the inertia about the joint's point (xx xy xz yy yz zz), in these axes.

use super::arm::{DynamicArm, INERTIA_ENTRIES, INERTIAL_NUMBERS, inertia_matrix};
use crate::spatial::Pose;
use nalgebra::{Matrix3, Vector3};

/// Position, velocity and acceleration of the joints in one row, length n each.
#[derive(Clone, Copy)]
pub struct MotionRow<'a> {
    /// rad or m.
    pub position: &'a [f64],
    /// Per s.
    pub velocity: &'a [f64],
    /// Per s^2.
    pub acceleration: &'a [f64],
}

/// A link in its own frame: how it turns, and how its joint's point accelerates (gravity included).
#[derive(Debug, Clone, Copy, Default)]
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
#[derive(Clone, Copy, Default)]
struct Wrench {
    force: Vector3<f64>,
    moment: Vector3<f64>,
}

impl InverseDynamics {
    /// The inverse dynamics by an arm's axes and points.
    pub fn new(arm: &DynamicArm) -> Self {
        let points = arm.points.iter().map(|point| point.coords);
        let before = std::iter::once(Vector3::zeros()).chain(points.clone());
        Self {
            axes: arm.axes.clone(),
            steps: points
                .zip(before)
                .map(|(point, before)| point - before)
                .collect(),
            prismatic: arm.prismatic.clone(),
            links: vec![LinkMotion::default(); arm.joints()],
        }
    }

    /// Number of joints n.
    pub(crate) fn joints(&self) -> usize {
        self.axes.len()
    }

    /// Moves the links.
    fn advance(&mut self, motion: MotionRow, gravity: &Vector3<f64>) {
        let (mut spin, mut spin_change, mut acceleration) =
            (Vector3::zeros(), Vector3::zeros(), -gravity);
        for joint in 0..self.joints() {
            let axis = self.axes[joint];
            let (q, dq, ddq) = (
                motion.position[joint],
                motion.velocity[joint],
                motion.acceleration[joint],
            );
            let slides = self.prismatic[joint];
            let rotation = match slides {
                true => Matrix3::identity(),
                false => turn(&axis, q),
            };
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
            self.links[joint] = LinkMotion {
                rotation,
                arm,
                spin,
                spin_change,
                acceleration,
            };
        }
    }

    /// The regressor of a row: `write(joint, link, numbers)` for every link and the joints up to it.
    pub fn regressor(
        &mut self,
        motion: MotionRow,
        gravity: &Vector3<f64>,
        mut write: impl FnMut(usize, usize, &[f64; INERTIAL_NUMBERS]),
    ) {
        self.advance(motion, gravity);
        for link in 0..self.joints() {
            let mut wrenches = unit_wrenches(&self.links[link]);
            for joint in (0..=link).rev() {
                let axis = &self.axes[joint];
                let torque = |wrench: &Wrench| match self.prismatic[joint] {
                    true => axis.dot(&wrench.force),
                    false => axis.dot(&wrench.moment),
                };
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
    pub fn torque(
        &mut self,
        motion: MotionRow,
        gravity: &Vector3<f64>,
        theta: &[f64],
        torque: &mut [f64],
    ) {
        self.advance(motion, gravity);
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for joint in (0..self.joints()).rev() {
            let link = &self.links[joint];
            let wrench = wrench_of(link, &theta[INERTIAL_NUMBERS * joint..][..INERTIAL_NUMBERS]);
            force += wrench.force;
            moment += wrench.moment;
            torque[joint] = self.axes[joint].dot(if self.prismatic[joint] {
                &force
            } else {
                &moment
            });
            force = link.rotation * force;
            moment = link.rotation * moment + link.arm.cross(&force);
        }
    }
}

/// Torques of an arm with inertial numbers that stands still at some positions.
pub(super) fn at_rest(arm: &DynamicArm, theta: &[f64]) -> impl FnMut(&[f64]) -> Vec<f64> {
    let mut torque_at = at_rest_under(arm, theta);
    move |position| torque_at(position, &arm.gravity)
}

/// The same under any gravity, m/s^2 in the base frame.
pub(super) fn at_rest_under(
    arm: &DynamicArm,
    theta: &[f64],
) -> impl FnMut(&[f64], &Vector3<f64>) -> Vec<f64> {
    let (mut dynamics, still) = (InverseDynamics::new(arm), vec![0.0; arm.joints()]);
    move |position, gravity| {
        let motion = MotionRow {
            position,
            velocity: &still,
            acceleration: &still,
        };
        let mut torque = still.clone();
        dynamics.torque(motion, gravity, theta, &mut torque);
        torque
    }
}

/// A turn about an axis.
pub(crate) fn turn(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    Pose::from_rotation_vector(axis * angle, Vector3::zeros()).rotation
}

/// What each inertial number asks of the joint's point for the motion of its link.
fn unit_wrenches(link: &LinkMotion) -> [Wrench; INERTIAL_NUMBERS] {
    let (w, dw, a) = (&link.spin, &link.spin_change, &link.acceleration);
    let mut all = [Wrench::default(); INERTIAL_NUMBERS];
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

#[cfg(test)]
mod tests {
    use super::super::arm::{Inertial, numbers};
    use super::super::cases::bare_arm;
    use super::*;
    use nalgebra::{Point3, Rotation3};

    /// An arm of links whose numbers have nothing in common; the third joint slides.
    fn arm() -> (DynamicArm, Vec<Inertial>) {
        let body = |mass: f64, at: [f64; 3], six: [f64; 6]| Inertial {
            mass,
            centre: Point3::from(at),
            inertia: inertia_matrix(&six),
        };
        let links = vec![
            body(8.0, [0.1, -0.05, 0.2], [0.3, 0.02, -0.01, 0.4, 0.03, 0.2]),
            body(5.0, [0.4, 0.1, 0.5], [0.2, -0.03, 0.02, 0.15, 0.01, 0.1]),
            body(3.0, [0.7, 0.0, 0.6], [0.05, 0.01, 0.0, 0.06, -0.01, 0.04]),
            body(2.0, [0.9, 0.1, 0.7], [0.02, 0.0, 0.005, 0.03, 0.002, 0.01]),
        ];
        let axes = [
            [0.1, 0.2, 1.0],
            [0.3, -1.0, 0.1],
            [1.0, 0.2, 0.0],
            [0.2, 1.0, 0.5],
        ];
        let points = [
            [0.0, 0.0, 0.1],
            [0.2, 0.0, 0.4],
            [0.5, 0.1, 0.6],
            [0.8, 0.0, 0.6],
        ];
        let arm = DynamicArm {
            prismatic: vec![false, false, true, false],
            links: Some(links.clone()),
            gravity: Vector3::new(1.0, -2.0, -9.0),
            ..bare_arm(axes, points, [1.0, 0.1, 0.8])
        };
        (arm, links)
    }

    /// Centre and rotation of each link, by plain products of motions from the base.
    fn placed(
        arm: &DynamicArm,
        links: &[Inertial],
        q: &[f64],
    ) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
        let (mut rotation, mut shift) = (Matrix3::identity(), Vector3::zeros());
        (0..q.len())
            .map(|joint| {
                let point = arm.points[joint].coords;
                if arm.prismatic[joint] {
                    shift += rotation * arm.axes[joint] * q[joint];
                } else {
                    let turn = Rotation3::new(arm.axes[joint] * q[joint]).into_inner();
                    shift += rotation * (point - turn * point);
                    rotation *= turn;
                }
                (rotation * links[joint].centre.coords + shift, rotation)
            })
            .collect()
    }

    /// Kinetic minus potential energy, with velocities by differences of places.
    fn lagrangian(arm: &DynamicArm, links: &[Inertial], q: &[f64], dq: &[f64]) -> f64 {
        const STEP: f64 = 1e-5;
        let at = |sign: f64| {
            let moved = q.iter().zip(dq).map(|(q, dq)| q + sign * STEP * dq);
            placed(arm, links, &moved.collect::<Vec<f64>>())
        };
        let (here, before, after) = (placed(arm, links, q), at(-1.0), at(1.0));
        (0..q.len())
            .map(|link| {
                let velocity = (after[link].0 - before[link].0) / (2.0 * STEP);
                let turning =
                    (after[link].1 - before[link].1) / (2.0 * STEP) * here[link].1.transpose();
                let spin = Vector3::new(turning[(2, 1)], turning[(0, 2)], turning[(1, 0)]);
                let inertia = here[link].1 * links[link].inertia * here[link].1.transpose();
                let mass = links[link].mass;
                0.5 * mass * velocity.norm_squared()
                    + 0.5 * spin.dot(&(inertia * spin))
                    + mass * arm.gravity.dot(&here[link].0)
            })
            .sum()
    }

    #[test]
    fn torques_are_those_of_lagrange_and_the_regressor_says_the_same() {
        const STEP: f64 = 1e-3;
        let (arm, links) = arm();
        let (q, dq, ddq) = (
            [0.3, -0.5, 0.2, 0.7],
            [0.8, -0.4, 0.3, 1.1],
            [1.5, 0.7, -0.9, 2.0],
        );
        let theta: Vec<f64> = links
            .iter()
            .zip(&arm.points)
            .flat_map(|(link, point)| numbers(link, &point.coords))
            .collect();
        let mut dynamics = InverseDynamics::new(&arm);
        let mut torque = [0.0; 4];
        let motion = MotionRow {
            position: &q,
            velocity: &dq,
            acceleration: &ddq,
        };
        dynamics.torque(motion, &arm.gravity, &theta, &mut torque);
        let mut by_regressor = [0.0; 4];
        dynamics.regressor(motion, &arm.gravity, |joint, link, numbers| {
            by_regressor[joint] += numbers
                .iter()
                .zip(&theta[10 * link..])
                .map(|(a, b)| a * b)
                .sum::<f64>();
        });
        // d/dt dL/d(dq) - dL/dq along the motion, by central differences.
        let shifted = |values: &[f64; 4], joint: usize, by: f64| {
            let mut moved = *values;
            moved[joint] += by;
            moved
        };
        for joint in 0..4 {
            let momentum = |time: f64| {
                let q: [f64; 4] =
                    std::array::from_fn(|k| q[k] + time * dq[k] + 0.5 * time * time * ddq[k]);
                let dq: [f64; 4] = std::array::from_fn(|k| dq[k] + time * ddq[k]);
                let l = |by: f64| lagrangian(&arm, &links, &q, &shifted(&dq, joint, by));
                (l(STEP) - l(-STEP)) / (2.0 * STEP)
            };
            let change = (momentum(STEP) - momentum(-STEP)) / (2.0 * STEP);
            let l = |by: f64| lagrangian(&arm, &links, &shifted(&q, joint, by), &dq);
            let expected = change - (l(STEP) - l(-STEP)) / (2.0 * STEP);
            assert!(
                (torque[joint] - expected).abs() < 1e-3 * (1.0 + expected.abs()),
                "joint {}: {} {expected}",
                joint + 1,
                torque[joint]
            );
            assert!((torque[joint] - by_regressor[joint]).abs() < 1e-11 * (1.0 + expected.abs()));
        }
    }
}
