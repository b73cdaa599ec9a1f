//! The chosen effects, composed: the only place with the chain rule Ad(prefix) J_left(xi) d(xi)/dp.
//!
//! P = base E_0 exp(x1 (q1 + d1)) E_1 ... exp(xn (qn + dn)) E_n tool, with E_k = exp of the summed twists at station k.

use super::{ArmState, Deflection, Direction, Effect, ParameterSpec};
use crate::robot::{Measurements, RobotModel};
use crate::spatial::{Pose, Twist, left_jacobian};
use nalgebra::{Matrix6, Vector3};
use std::ops::Range;

/// Effects in a fixed order with their parameters numbered through.
pub struct EffectStack {
    effects: Vec<(Box<dyn Effect>, Range<usize>)>,
    specs: Vec<ParameterSpec>,
    base: Pose,
    needs_torque: bool,
}

/// Buffers of one evaluation, made once per thread.
pub struct Scratch {
    deflection: Deflection,
    torque: Vec<f64>,
    /// Frame before E_k, and J_left of the twist there.
    before: Vec<(Pose, Option<Matrix6<f64>>)>,
    /// Frame behind E_k, in front of joint k.
    behind: Vec<Pose>,
    /// Frame of the body moved by joint k.
    body: Vec<Pose>,
}

impl EffectStack {
    /// Composes effects; `base` is the start of `base_frame`.
    pub fn new(robot: &RobotModel, base: Pose, effects: Vec<Box<dyn Effect>>) -> Self {
        let mut specs = Vec::new();
        let mut numbered = Vec::new();
        for effect in effects {
            let own = effect.parameters(robot);
            numbered.push((effect, specs.len()..specs.len() + own.len()));
            specs.extend(own);
        }
        let needs_torque = numbered.iter().any(|(effect, _)| effect.needs_torque());
        Self { effects: numbered, specs, base, needs_torque }
    }

    /// All parameters in the order of `x`.
    pub fn specs(&self) -> &[ParameterSpec] {
        &self.specs
    }

    pub fn base(&self) -> &Pose {
        &self.base
    }

    /// Effects and the range of their parameters.
    pub fn effects(&self) -> impl Iterator<Item = (&dyn Effect, Range<usize>)> {
        self.effects.iter().map(|(effect, range)| (effect.as_ref(), range.clone()))
    }

    pub fn scratch(&self, robot: &RobotModel) -> Scratch {
        let n = robot.joints();
        Scratch {
            deflection: Deflection::new(n),
            torque: vec![0.0; n],
            before: vec![(Pose::identity(), None); n + 1],
            behind: vec![Pose::identity(); n + 1],
            body: vec![Pose::identity(); n],
        }
    }

    /// The measured point (m, tracker frame) of a row under parameters `x`.
    pub fn point(&self, robot: &RobotModel, data: &Measurements, row: usize, x: &[f64], scratch: &mut Scratch) -> Vector3<f64> {
        self.settle(robot, data, row, x, scratch)
    }

    /// The measured point, and its derivative by every parameter through `emit(parameter, derivative)`.
    ///
    /// A parameter may be emitted more than once; derivatives of one parameter add up. Torques are treated as constant: their
    /// change with the parameters is of second order.
    pub fn derivatives(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        row: usize,
        x: &[f64],
        scratch: &mut Scratch,
        mut emit: impl FnMut(usize, Vector3<f64>),
    ) -> Vector3<f64> {
        let point = self.settle(robot, data, row, x, scratch);
        for (parameter, direction) in &scratch.deflection.partials {
            let derivative = match direction {
                Direction::Joint(joint, rate) => along(&scratch.behind[*joint], &point, &robot.screws()[*joint]) * *rate,
                Direction::Station(station, rate) => {
                    let (frame, jacobian) = &scratch.before[*station];
                    match jacobian {
                        Some(jacobian) => along(frame, &point, &(jacobian * rate)),
                        None => along(frame, &point, rate),
                    }
                }
            };
            emit(*parameter, derivative);
        }
        point
    }

    /// The arm where it comes to rest. Torques are taken at the arm's own geometry, first unwound, then wound up; what a third
    /// pass would add is of the order of the wind-up (rad) cubed.
    fn settle(&self, robot: &RobotModel, data: &Measurements, row: usize, x: &[f64], scratch: &mut Scratch) -> Vector3<f64> {
        scratch.torque.fill(0.0);
        let mut point = self.pass(robot, data, row, x, scratch);
        if self.needs_torque {
            for _ in 0..2 {
                let Scratch { behind, body, torque, .. } = scratch;
                // Gravity is known in the base frame as corrected, hence behind[0].
                robot.gravity_torque(&behind[0], behind, body, data.payload[row], torque);
                point = self.pass(robot, data, row, x, scratch);
            }
        }
        point
    }

    fn pass(&self, robot: &RobotModel, data: &Measurements, row: usize, x: &[f64], scratch: &mut Scratch) -> Vector3<f64> {
        scratch.deflection.clear();
        let payload = data.payload[row];
        let state = ArmState { q: data.q(row), torque: &scratch.torque, current: data.current(row), payload };
        for (effect, range) in &self.effects {
            scratch.deflection.start(range.start);
            effect.deflect(robot, &state, &x[range.clone()], &mut scratch.deflection);
        }
        self.chain(robot, data.q(row), scratch)
    }

    fn chain(&self, robot: &RobotModel, q: &[f64], scratch: &mut Scratch) -> Vector3<f64> {
        let n = robot.joints();
        let mut frame = self.base;
        for (station, twist) in scratch.deflection.station.iter().enumerate() {
            let still = twist.iter().all(|value| *value == 0.0);
            scratch.before[station] = (frame, (!still).then(|| left_jacobian(twist)));
            if !still {
                frame = frame * Pose::exp(twist);
            }
            scratch.behind[station] = frame;
            if station < n {
                frame = frame * Pose::exp(&(robot.screws()[station] * (q[station] + scratch.deflection.joint[station])));
                scratch.body[station] = frame;
            }
        }
        frame.point(&robot.home().translation)
    }
}

/// Velocity of `point` under the twist, given in `frame`: R (v + w x y), y the point in that frame.
fn along(frame: &Pose, point: &Vector3<f64>, twist: &Twist) -> Vector3<f64> {
    let v: Vector3<f64> = twist.fixed_rows::<3>(0).into();
    let w: Vector3<f64> = twist.fixed_rows::<3>(3).into();
    frame.rotation * (v + w.cross(&frame.inverse_point(point)))
}
