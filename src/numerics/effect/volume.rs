//! What a target that is brought to a place closes, and by how much joint noise is spread there: the change of variables from joints to
//! points.
//!
//! Where nothing but joints was recorded, their density has the factor sqrt(det(G G^T)), G = S dp/dq. Without it least squares rewards an
//! arm that is too small: its points scatter less.

use super::{Direction, PlacedRow};
use nalgebra::{Matrix3, Vector3};

/// The directions in which a target must be where it was brought to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Closing {
    /// All: its point.
    Point,
    /// One: a plane, by its unit normal.
    Plane(Vector3<f64>),
    /// Along the vector from a sphere's centre.
    Sphere(Vector3<f64>),
}

impl Closing {
    /// Its directions as lines; zero lines beyond the last.
    fn lines(&self) -> Matrix3<f64> {
        let one = |direction: &Vector3<f64>| {
            let mut lines = Matrix3::zeros();
            lines.set_row(0, &direction.transpose());
            lines
        };
        match self {
            Self::Point => Matrix3::identity(),
            Self::Plane(normal) => one(normal),
            Self::Sphere(reach) => one(&reach.try_normalize(0.0).unwrap_or_else(Vector3::zeros)),
        }
    }
}

/// G = S dp/dq by its columns, and the inverse of G G^T.
struct Spread {
    lines: Matrix3<f64>,
    columns: Vec<Vector3<f64>>,
    inverse: Matrix3<f64>,
    log_volume: f64,
}

impl PlacedRow<'_> {
    /// `None` where the joints cannot move the target in one of the directions.
    fn spread(&mut self, closing: &Closing) -> Option<Spread> {
        self.scratch.velocities(self.robot, &self.point);
        let lines = closing.lines();
        let columns: Vec<Vector3<f64>> = self
            .scratch
            .by_joint
            .iter()
            .map(|velocity| lines * velocity)
            .collect();
        let mut square: Matrix3<f64> = columns
            .iter()
            .map(|column| column * column.transpose())
            .sum();
        for axis in 0..3 {
            if lines.row(axis).norm() == 0.0 {
                square[(axis, axis)] = 1.0;
            }
        }
        let factor = square.cholesky()?;
        let log_volume = factor.l_dirty().diagonal().map(f64::ln).sum();
        Some(Spread {
            lines,
            columns,
            inverse: factor.inverse(),
            log_volume,
        })
    }

    /// The least motion of the joints (rad or m) that takes off `error`, measured - predicted, of what is closed.
    pub(crate) fn closing_step(
        &mut self,
        closing: &Closing,
        error: &Vector3<f64>,
    ) -> Option<Vec<f64>> {
        let spread = self.spread(closing)?;
        let pull = spread.inverse * error;
        Some(
            spread
                .columns
                .iter()
                .map(|column| column.dot(&pull))
                .collect(),
        )
    }

    /// ln sqrt(det(G G^T)), and its derivatives by every parameter through `emit(parameter, derivative)`, which add up.
    pub(crate) fn log_volume(
        &mut self,
        closing: &Closing,
        mut emit: impl FnMut(usize, f64),
    ) -> Option<f64> {
        let Spread {
            lines,
            columns,
            inverse,
            log_volume,
        } = self.spread(closing)?;
        let (robot, scratch) = (self.robot, &*self.scratch);
        let joints = robot.joints();
        // How the volume changes with the velocity of each joint.
        let by_velocity: Vec<Vector3<f64>> = columns
            .iter()
            .map(|column| lines.tr_mul(&(inverse * column)))
            .collect();
        // A motion of what is beyond joint k turns the velocities by the joints behind it, and moves the point for those in front.
        let mut turned = vec![Vector3::zeros(); joints + 1];
        let mut moved = turned.clone();
        for joint in (0..joints).rev() {
            turned[joint] = turned[joint + 1] + scratch.by_joint[joint].cross(&by_velocity[joint]);
        }
        for joint in 0..joints {
            let axis = scratch.posture.behind[joint].rotation * robot.axis(joint);
            let own_turn = if robot.is_revolute(joint) {
                by_velocity[joint].cross(&axis)
            } else {
                Vector3::zeros()
            };
            moved[joint + 1] = moved[joint] + own_turn;
        }
        // The direction of what is closed turns too.
        let along: Vector3<f64> = match closing {
            Closing::Point => Vector3::zeros(),
            _ => scratch
                .by_joint
                .iter()
                .zip(&columns)
                .map(|(velocity, column)| velocity * (inverse[(0, 0)] * column.x))
                .sum(),
        };
        let curved = match closing {
            Closing::Sphere(reach) => {
                let direction = reach.normalize();
                (along - direction * direction.dot(&along)) / reach.norm()
            }
            _ => Vector3::zeros(),
        };
        let rigid = |beyond: usize, rotation: &Vector3<f64>, velocity: &Vector3<f64>| {
            turned[beyond].dot(rotation) + (moved[beyond] + curved).dot(velocity)
        };
        let by_joint = |joint: usize, rate: f64| {
            let axis = scratch.posture.behind[joint].rotation * robot.axis(joint);
            let rotation = if robot.is_revolute(joint) {
                axis * rate
            } else {
                Vector3::zeros()
            };
            rigid(joint + 1, &rotation, &(scratch.by_joint[joint] * rate))
        };
        for (parameter, direction) in &scratch.deflection.partials {
            let change = match direction {
                Direction::Joint(joint, rate) => by_joint(*joint, *rate),
                Direction::Torque(joint, rate) => {
                    by_joint(*joint, scratch.deflection.compliance[*joint] * *rate)
                }
                Direction::Station(station, rate) => {
                    let turn = scratch.stations[*station].jacobian * rate;
                    let rotation = scratch.before[*station].rotation * turn.fixed_rows::<3>(3);
                    rigid(*station, &rotation, &(scratch.by_station[*station] * rate))
                }
                Direction::Anchor(rate) => -curved.dot(rate),
                Direction::AnchorTilt(_, turn) => along.dot(turn),
                Direction::AnchorGrowth(_) | Direction::Instrument(_) => continue,
            };
            emit(*parameter, change);
        }
        Some(log_volume)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{EffectContext, EffectStack, Load, arm_effect};
    use crate::robot::import::{RobotFileText, read_calib};
    use crate::robot::{
        Anchor, MeasurementSetup, Measurements, Named, Readings, RobotModel, Shape,
    };
    use crate::spatial::Pose;

    const ARM: &str = "
calib_robot: 1
units: {length: mm, angle: deg}
kinematics:
  dh:
    - {theta: 0, d: 120, a: 0, alpha: 90}
    - {theta: 0, d: 0, a: -610, alpha: 0}
    - {theta: 0, d: 0, a: -570, alpha: 0}
    - {theta: 0, d: 160, a: 0, alpha: 90}
    - {theta: 0, d: 115, a: 0, alpha: -90}
    - {theta: 0, d: 90, a: 0, alpha: 0}
tool: {point: [20, 10, 60]}
";

    #[test]
    fn derivatives_of_the_volume_are_central_differences() {
        let text = RobotFileText::new("arm.yaml", ARM);
        let robot = RobotModel::new(read_calib(text, None).expect("sound").robot);
        let shapes = [
            Shape::Point,
            Shape::Plane(Vector3::new(0.3, -0.2, 0.9).normalize()),
            Shape::Sphere(0.05),
        ];
        for shape in shapes {
            let anchor = Anchor {
                name: "a".into(),
                place: Vector3::new(0.4, -0.3, 0.2),
                shape,
            };
            let robot = robot.clone().measured_by(MeasurementSetup {
                targets: Vec::new(),
                anchors: vec![anchor],
            });
            let setting = EffectContext {
                base: Pose::identity(),
                load: Load::GravityTorque,
            };
            let names = [
                "anchor",
                "base_frame",
                "tool_offset",
                "joint_offset",
                "link_geometry",
            ];
            let effects = names
                .iter()
                .filter_map(|name| arm_effect(name, &setting))
                .collect();
            let stack = EffectStack::new(&robot, Pose::identity(), effects);
            let x: Vec<f64> = (0..stack.specs().len())
                .map(|k| 3e-3 * (1.7 * k as f64).sin())
                .collect();
            let readings = Readings {
                kind: "socket",
                sigma: vec![1e-4],
                anchor: Some(Named::of(["a"].into_iter())),
                ..Readings::default()
            };
            let data = Measurements {
                joints: 6,
                q: vec![0.4, -1.1, 0.9, 0.5, -0.8, 0.3],
                payload: vec![0.0],
                readings: vec![readings],
                ..Measurements::default()
            };
            let volume = |x: &[f64], emit: &mut dyn FnMut(usize, f64)| {
                let mut scratch = stack.scratch(&robot);
                let mut placed = stack.place(&robot, &data, 0, x, &mut scratch);
                let closing = match placed.anchor_shape("a").expect("there") {
                    Shape::Point => Closing::Point,
                    Shape::Plane(normal) => Closing::Plane(normal),
                    Shape::Sphere(_) => Closing::Sphere(placed.anchor_reach("a").expect("there")),
                };
                placed
                    .log_volume(&closing, emit)
                    .expect("no singular posture")
            };
            let mut rates = vec![0.0; x.len()];
            volume(&x, &mut |k, rate| rates[k] += rate);
            for (k, rate) in rates.iter().enumerate() {
                let moved = |step: f64| {
                    let mut shifted = x.clone();
                    shifted[k] += step;
                    volume(&shifted, &mut |_, _| {})
                };
                let central = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                let name = &stack.specs()[k].name;
                assert!(
                    (central - rate).abs() < 1e-5 * (1.0 + rate.abs()),
                    "{shape:?}, {name}: {central} by differences, {rate}"
                );
            }
        }
    }
}
