//! The chosen effects, composed: the only place with the chain rule Ad(prefix) J_left(xi) d(xi)/dp.
//!
//! P = base E_0 exp(x1 (q1 + d1)) E_1 ... exp(xn (qn + dn)) E_n tool, with E_k = exp of the summed twists at station k.

use super::{ArmState, Deflection, Direction, Effect, ParameterSpec};
use crate::robot::{LoadCorrection, Measurements, Posture, RobotModel, Travel};
use crate::spatial::{Pose, Twist, hat, left_jacobian};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3};
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
    /// Commanded travel of each joint.
    commanded: Vec<Travel>,
    load_correction: LoadCorrection,
    posture: Posture,
    stations: Vec<Station>,
    /// Frame in front of E_k.
    before: Vec<Pose>,
    /// Velocity of the point by the twist of E_k.
    by_station: Vec<Matrix3x6<f64>>,
    /// Velocity of the point by the travel of joint k.
    by_joint: Vec<Vector3<f64>>,
    /// The row's target.
    target: Option<usize>,
    /// Whether `commanded` is near the next row's joints.
    near: bool,
    /// Travel of each joint and twist at each station by the constant effects, where only points are wanted, all of the same parameters.
    constant: Option<(Vec<f64>, Vec<Twist>)>,
}

impl Scratch {
    /// Partials are wanted again.
    pub(crate) fn points_and_partials(&mut self) {
        self.deflection.bare = false;
        self.constant = None;
    }

    /// Whether the next row's joints are near those placed last; their sines then follow by addition theorems.
    pub(crate) fn near(&mut self, near: bool) {
        self.near = near;
    }
}

/// What follows from a station's summed twist. Kept until the twist changes: most are the same in every row.
#[derive(Clone)]
struct Station {
    twist: Twist,
    /// Whether nothing moves here: most stations of most models.
    still: bool,
    motion: Pose,
    jacobian: Matrix6<f64>,
}

impl Station {
    fn of(twist: &Twist) -> Self {
        Self { twist: *twist, still: *twist == Twist::zeros(), motion: Pose::exp(twist), jacobian: left_jacobian(twist) }
    }
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
            commanded: vec![Travel::default(); n],
            load_correction: LoadCorrection::new(n),
            posture: Posture::new(n),
            stations: vec![Station::of(&Twist::zeros()); n + 1],
            before: vec![Pose::identity(); n + 1],
            by_station: vec![Matrix3x6::zeros(); n + 1],
            by_joint: vec![Vector3::zeros(); n],
            target: None,
            near: false,
            constant: None,
        }
    }

    /// Prepares for rows of which only the points are wanted, all under the same `x`: there are no partials, and what is the same at
    /// every row is summed once.
    pub(crate) fn only_points(&self, robot: &RobotModel, data: &Measurements, x: &[f64], scratch: &mut Scratch) {
        scratch.deflection.clear();
        scratch.deflection.bare = true;
        scratch.constant = None;
        let state = ArmState::new(data, 0, &scratch.posture);
        for (effect, range) in self.effects.iter().filter(|(effect, _)| effect.is_constant()) {
            effect.deflect(robot, &state, &x[range.clone()], &mut scratch.deflection);
        }
        scratch.constant = Some((scratch.deflection.joint.clone(), scratch.deflection.station.clone()));
    }

    /// The measured point (m, tracker frame) of a row under parameters `x`.
    ///
    /// Torques are taken at the arm's own geometry, first unwound, then wound up; what a third pass would add is of the order of
    /// the wind-up (rad) cubed.
    pub fn point(&self, robot: &RobotModel, data: &Measurements, row: usize, x: &[f64], scratch: &mut Scratch) -> Vector3<f64> {
        for (travel, q) in scratch.commanded.iter_mut().zip(data.q(row)) {
            *travel = if scratch.near { travel.moved(q - travel.value()) } else { Travel::new(*q) };
        }
        scratch.deflection.clear();
        if let Some((joint, station)) = &scratch.constant {
            scratch.deflection.joint.copy_from_slice(joint);
            scratch.deflection.station.copy_from_slice(station);
        }
        scratch.target = robot.gauging().target(data.target(row));
        self.deflect(Needs::Nothing, robot, data, row, x, scratch);
        let mut point = self.chain(robot, scratch);
        if self.needs_torque {
            scratch.deflection.keep();
            scratch.load_correction.clear();
            for (effect, range) in &self.effects {
                effect.load_correction(data.q(row), data.payload[row], &x[range.clone()], &mut scratch.load_correction);
            }
            for _ in 0..2 {
                scratch.posture.gravity_torques(robot, data.payload[row], &scratch.load_correction);
                scratch.deflection.restore();
                self.deflect(Needs::Torque, robot, data, row, x, scratch);
                point = self.chain(robot, scratch);
            }
        }
        point
    }

    /// The measured point, and its derivative by every parameter through `emit(parameter, derivative)`, as [`Self::partials`].
    pub fn derivatives(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        row: usize,
        x: &[f64],
        scratch: &mut Scratch,
        emit: impl FnMut(usize, Vector3<f64>),
    ) -> Vector3<f64> {
        let point = self.point(robot, data, row, x, scratch);
        self.partials(robot, &point, scratch, emit);
        point
    }

    /// Derivatives of the `point` that [`Self::point`] has just returned.
    ///
    /// A parameter may be emitted more than once; derivatives of one parameter add up. Torques are treated as constant: their
    /// change with the parameters is of second order.
    pub(crate) fn partials(
        &self,
        robot: &RobotModel,
        point: &Vector3<f64>,
        scratch: &mut Scratch,
        mut emit: impl FnMut(usize, Vector3<f64>),
    ) {
        self.velocities(robot, point, scratch);
        let Scratch { deflection, by_station, by_joint, .. } = scratch;
        for (parameter, direction) in &deflection.partials {
            emit(*parameter, along(direction, by_joint, by_station, &deflection.compliance));
        }
    }

    /// Tool frame (tracker frame) of the row that [`Self::point`] has just placed, and the velocity (v; w) of its origin by each joint.
    pub(crate) fn tool(&self, robot: &RobotModel, scratch: &Scratch, velocities: &mut [Twist]) -> Pose {
        let behind = &scratch.posture.behind;
        let tool = behind[robot.joints()] * *robot.home();
        for (joint, velocity) in velocities.iter_mut().enumerate() {
            *velocity = robot.velocity(joint, &behind[joint], &tool.translation);
        }
        tool
    }

    /// The orientation of the row's target (tracker frame), after [`Self::point`].
    pub(crate) fn orientation(&self, robot: &RobotModel, scratch: &Scratch) -> Matrix3<f64> {
        scratch.posture.behind[robot.joints()].rotation * robot.seat(scratch.target).rotation
    }

    /// Derivatives (rad, tracker axes) of [`Self::orientation`], as [`Self::partials`].
    pub(crate) fn turning(&self, robot: &RobotModel, scratch: &Scratch, mut emit: impl FnMut(usize, Vector3<f64>)) {
        let Scratch { deflection, posture, stations, before, .. } = scratch;
        let joint = |joint: usize| {
            if robot.is_revolute(joint) { posture.behind[joint].rotation * robot.axis(joint) } else { Vector3::zeros() }
        };
        for (parameter, direction) in &deflection.partials {
            let turn = match direction {
                Direction::Joint(k, rate) => joint(*k) * *rate,
                Direction::Station(k, rate) => before[*k].rotation * (stations[*k].jacobian * rate).fixed_rows::<3>(3),
                Direction::Torque(k, rate) => joint(*k) * (deflection.compliance[*k] * *rate),
                Direction::Anchor(_) => continue,
            };
            emit(*parameter, turn);
        }
    }

    /// From where a row's anchor is to its `point`, after [`Self::point`]. `None` where the robot knows no such anchor.
    pub(crate) fn reach(
        &self,
        robot: &RobotModel,
        anchor: &str,
        point: &Vector3<f64>,
        scratch: &Scratch,
    ) -> Option<Vector3<f64>> {
        let gauging = robot.gauging();
        let anchor = gauging.anchors.get(gauging.anchor(anchor)?)?;
        Some(point - anchor.place - scratch.deflection.anchor)
    }

    /// Derivatives of [`Self::reach`], as [`Self::partials`].
    pub(crate) fn reaching(
        &self,
        robot: &RobotModel,
        point: &Vector3<f64>,
        scratch: &mut Scratch,
        mut emit: impl FnMut(usize, Vector3<f64>),
    ) {
        self.velocities(robot, point, scratch);
        let Scratch { deflection, by_station, by_joint, .. } = scratch;
        for (parameter, direction) in &deflection.partials {
            let velocity = match direction {
                Direction::Anchor(rate) => -rate,
                other => along(other, by_joint, by_station, &deflection.compliance),
            };
            emit(*parameter, velocity);
        }
    }

    /// How the point moves with every joint and station.
    fn velocities(&self, robot: &RobotModel, point: &Vector3<f64>, scratch: &mut Scratch) {
        let Scratch { posture: Posture { behind, .. }, stations, before, by_station, by_joint, .. } = scratch;
        for ((velocity, frame), station) in by_station.iter_mut().zip(&*before).zip(&*stations) {
            // Of a twist (v; w) in the frame: R v + R w x arm.
            let mut spatial = Matrix3x6::zeros();
            spatial.fixed_view_mut::<3, 3>(0, 0).copy_from(&frame.rotation);
            spatial.fixed_view_mut::<3, 3>(0, 3).copy_from(&(hat(&(frame.translation - point)) * frame.rotation));
            *velocity = spatial * station.jacobian;
        }
        for (joint, velocity) in by_joint.iter_mut().enumerate() {
            let axis = behind[joint].rotation * robot.axis(joint);
            *velocity =
                if robot.is_revolute(joint) { axis.cross(&(point - behind[joint].point(robot.point(joint)))) } else { axis };
        }
    }

    /// What the row shows of any effect, in the stack or not. The arm hangs as the stack makes it hang.
    pub fn point_motion(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        row: usize,
        x: &[f64],
        scratch: &mut Scratch,
    ) -> PointMotion {
        let point = self.point(robot, data, row, x, scratch);
        if !self.needs_torque {
            scratch.posture.gravity_torques(robot, data.payload[row], &scratch.load_correction);
        }
        self.velocities(robot, &point, scratch);
        PointMotion {
            row,
            point,
            posture: scratch.posture.clone(),
            compliance: scratch.deflection.compliance.clone(),
            by_station: scratch.by_station.clone(),
            by_joint: scratch.by_joint.clone(),
        }
    }

    /// Adds the motions of the effects with the given need.
    fn deflect(&self, needs: Needs, robot: &RobotModel, data: &Measurements, row: usize, x: &[f64], scratch: &mut Scratch) {
        let state = ArmState::new(data, row, &scratch.posture);
        let summed = scratch.constant.is_some();
        let due = |effect: &dyn Effect| effect.needs_torque() == (needs == Needs::Torque) && !(summed && effect.is_constant());
        for (effect, range) in self.effects.iter().filter(|(effect, _)| due(effect.as_ref())) {
            scratch.deflection.start(range.start);
            effect.deflect(robot, &state, &x[range.clone()], &mut scratch.deflection);
        }
    }

    fn chain(&self, robot: &RobotModel, scratch: &mut Scratch) -> Vector3<f64> {
        let n = robot.joints();
        let mut frame = self.base;
        for (k, (twist, station)) in scratch.deflection.station.iter().zip(&mut scratch.stations).enumerate() {
            if *twist != station.twist {
                *station = Station::of(twist);
            }
            scratch.before[k] = frame;
            if !station.still {
                frame = frame * station.motion;
            }
            scratch.posture.behind[k] = frame;
            if k < n {
                frame = frame * robot.motion(k, &scratch.commanded[k].moved(scratch.deflection.joint[k]));
                scratch.posture.body[k] = frame;
            }
        }
        frame.point(&robot.seat(scratch.target).translation)
    }
}

/// How a row's point moves with everything that an effect can do.
pub struct PointMotion {
    row: usize,
    /// Predicted point, tracker frame, m.
    pub point: Vector3<f64>,
    pub posture: Posture,
    /// rad/Nm.
    compliance: Vec<f64>,
    by_station: Vec<Matrix3x6<f64>>,
    /// m/rad (m/m).
    pub by_joint: Vec<Vector3<f64>>,
}

impl PointMotion {
    /// Derivative of the point by each parameter of an effect at zero, through `emit(parameter, derivative)`, as
    /// [`EffectStack::derivatives`].
    pub fn derivatives(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        effect: &dyn Effect,
        zeros: &[f64],
        buffer: &mut Deflection,
        mut emit: impl FnMut(usize, Vector3<f64>),
    ) {
        buffer.clear();
        buffer.start(0);
        effect.deflect(robot, &ArmState::new(data, self.row, &self.posture), zeros, buffer);
        for (parameter, direction) in &buffer.partials {
            emit(*parameter, along(direction, &self.by_joint, &self.by_station, &self.compliance));
        }
    }
}

fn along(direction: &Direction, by_joint: &[Vector3<f64>], by_station: &[Matrix3x6<f64>], compliance: &[f64]) -> Vector3<f64> {
    match direction {
        Direction::Joint(joint, rate) => by_joint[*joint] * *rate,
        Direction::Station(station, rate) => by_station[*station] * rate,
        Direction::Torque(joint, rate) => by_joint[*joint] * (compliance[*joint] * *rate),
        Direction::Anchor(_) => Vector3::zeros(),
    }
}

/// What an effect must know before it can deflect.
#[derive(Clone, Copy, PartialEq)]
enum Needs {
    Nothing,
    /// Gravity torque, known only once the arm stands somewhere.
    Torque,
}
