//! The recording as causes see it: motion, rigid torque and clock at the recording's own rate, joint after joint.

use super::arm::{DeclaredInertials, DynamicArm, INERTIAL_NUMBERS};
use super::filter::{ZeroPhase, derivatives};
use super::newton_euler::{InverseDynamics, MotionRow, turn};
use super::recording::{RecordingClock, TorqueRecording, add, by_joint};
use crate::effect::Variable;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Positions are filtered at so many times the final cut-off before they are differentiated.
const MOTION_BAND: f64 = 3.0;
/// At most this share of the rate.
const HIGHEST_BAND: f64 = 0.35;

/// Courses of all rows, `[joint][row]`.
pub(super) struct DynamicScene<'a> {
    pub(crate) arm: &'a DynamicArm,
    /// Hz.
    pub(crate) rate: f64,
    /// s from the first row.
    pub(crate) time: Vec<f64>,
    pub(crate) stretches: Vec<Range<usize>>,
    /// C, a value a row; empty where it is not known.
    pub(crate) temperature: Vec<f64>,
    /// rad.
    pub(crate) position: Vec<Vec<f64>>,
    /// rad/s.
    pub(crate) velocity: Vec<Vec<f64>>,
    /// rad/s^2.
    pub(crate) acceleration: Vec<Vec<f64>>,
    /// Nm, of the inertials as they are believed at present, payload included.
    pub(crate) rigid: Vec<Vec<f64>>,
    /// Nm, of the recording's own simulation less those of the declared masses (of none where none are declared).
    pub(crate) beyond: Option<Vec<Vec<f64>>>,
    /// Nm, of friction as it is believed at present.
    pub(crate) friction: Vec<Vec<f64>>,
    /// Nm, under a gravity as strong as the declared one along two directions across it ([`across`]): of the declared masses, once a tilt is known
    /// of those that are believed.
    pub(crate) sideways: [Vec<Vec<f64>>; 2],
    /// rad/s over which the sign of a velocity turns; at each joint, over that.
    pub(crate) sign_width: f64,
    sign_shares: Vec<f64>,
    /// s by which friction turns before the velocity does.
    pub(crate) friction_lead: f64,
    /// Declared inertials; `None` where none are declared.
    pub(crate) declared: Option<DeclaredInertials>,
}

impl<'a> DynamicScene<'a> {
    /// The scene of a checked recording; the final low-pass will be at `cutoff` (Hz).
    pub(crate) fn new(
        arm: &'a DynamicArm,
        recording: &TorqueRecording,
        clock: &RecordingClock,
        cutoff: f64,
        free: bool,
    ) -> Self {
        Self::filtered(arm, recording, clock, motion_band(cutoff, clock.rate), free)
    }

    /// The same with positions filtered at half the frequency: what differs is what differentiation and rounding make.
    pub(crate) fn half_band(
        arm: &'a DynamicArm,
        recording: &TorqueRecording,
        clock: &RecordingClock,
        cutoff: f64,
        free: bool,
    ) -> Self {
        let half = 0.5 * motion_band(cutoff, clock.rate);
        Self::filtered(arm, recording, clock, half, free)
    }

    /// The same with positions filtered at `band`, Hz.
    fn filtered(
        arm: &'a DynamicArm,
        recording: &TorqueRecording,
        clock: &RecordingClock,
        band: f64,
        free: bool,
    ) -> Self {
        let n = recording.joints;
        let (rows, first) = (recording.rows(), recording.time[0]);
        let filter = ZeroPhase::new(clock.rate, band);
        let nothing = || vec![vec![0.0; rows]; n];
        let declared = arm.links.as_ref().filter(|_| !free);
        let mut scene = Self {
            arm,
            rate: clock.rate,
            time: recording.time.iter().map(|time| time - first).collect(),
            stretches: clock.stretches.clone(),
            temperature: recording.temperature.clone().unwrap_or_default(),
            position: by_joint(&recording.position, n),
            velocity: nothing(),
            acceleration: nothing(),
            rigid: nothing(),
            beyond: None,
            friction: nothing(),
            sideways: [nothing(), nothing()],
            sign_width: SIGN_WIDTHS[1],
            sign_shares: vec![1.0; n],
            friction_lead: 0.0,
            declared: declared.map(|links| DeclaredInertials::of(arm, links)),
        };
        for stretch in &clock.stretches {
            filter.apply_to(&mut scene.position, stretch);
            for joint in 0..n {
                derivatives(
                    &scene.position[joint][stretch.clone()],
                    clock.rate,
                    &mut scene.velocity[joint][stretch.clone()],
                    &mut scene.acceleration[joint][stretch.clone()],
                );
            }
        }
        let theta = scene
            .declared
            .as_ref()
            .map(|declared| declared.theta.clone());
        scene.beyond = recording.simulated.as_ref().map(|simulated| {
            let mut beyond = by_joint(simulated, n);
            if let Some(theta) = &theta {
                let rigid = scene.torques_of(theta);
                let courses = beyond.iter_mut().zip(&rigid);
                courses.for_each(|(course, rigid)| add(course, -1.0, rigid));
            }
            beyond
        });
        match theta {
            Some(theta) => {
                scene.believe(&theta);
                scene.tilt(&theta);
            }
            None => scene.believe(&vec![0.0; INERTIAL_NUMBERS * n]),
        }
        scene
    }

    /// Number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.position.len()
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.time.len()
    }

    /// What a row says of a variable; nothing of one that rows of torques do not have.
    pub(crate) fn says(&self, variable: Variable, row: usize) -> Option<f64> {
        let of_joint = |courses: &[Vec<f64>], joint: usize| Some(courses.get(joint)?[row]);
        match variable {
            Variable::Angle { joint } => of_joint(&self.position, joint),
            Variable::Velocity { joint } => of_joint(&self.velocity, joint),
            Variable::Load { joint } => of_joint(&self.rigid, joint),
            Variable::Temperature => self.temperature.get(row).copied(),
            Variable::Time => Some(self.time[row]),
            _ => None,
        }
    }

    /// Smoothed sign of a velocity.
    pub(crate) fn sign(&self, velocity: f64) -> f64 {
        (velocity / self.sign_width).tanh()
    }

    /// Takes one width over which the sign of a velocity turns, rad/s, for all joints.
    pub(crate) fn turn_over(&mut self, width: f64) {
        self.sign_width = width;
        self.sign_shares.fill(1.0);
    }

    /// rad/s over which the sign of a joint's velocity turns.
    pub(crate) fn width_at(&self, joint: usize) -> f64 {
        self.sign_width * self.sign_shares[joint]
    }

    /// Takes a width of each joint's own, rad/s.
    pub(crate) fn turn_each_over(&mut self, widths: impl IntoIterator<Item = f64>) {
        let widths = widths.into_iter();
        self.sign_shares = widths.map(|width| width / self.sign_width).collect();
    }

    /// Takes a width of one joint's own, rad/s.
    pub(crate) fn turn_one_over(&mut self, joint: usize, width: f64) {
        self.sign_shares[joint] = width / self.sign_width;
    }

    /// Smoothed sign of a joint's velocity in a row, as friction has it.
    pub(crate) fn direction(&self, joint: usize, row: usize) -> f64 {
        let ahead = self.friction_lead * self.acceleration[joint][row];
        ((self.velocity[joint][row] + ahead) / self.width_at(joint)).tanh()
    }

    /// s from first to last row.
    pub(crate) fn duration(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    /// Takes 10 n inertial numbers for the rigid torques.
    pub(crate) fn believe(&mut self, theta: &[f64]) {
        self.rigid = self.torques_of(theta);
        let beyond = self.beyond.iter().flatten();
        let courses = self.rigid.iter_mut().zip(beyond);
        courses.for_each(|(course, beyond)| add(course, 1.0, beyond));
    }

    /// Rigid torques of 10 n inertial numbers, `[joint][row]`.
    pub(crate) fn torques_of(&self, theta: &[f64]) -> Vec<Vec<f64>> {
        self.torques(theta, &self.arm.gravity, true)
    }

    /// Takes 10 n inertial numbers for the torques of a gravity from the side.
    pub(crate) fn tilt(&mut self, theta: &[f64]) {
        let length = self.arm.gravity.norm();
        self.sideways =
            across(&self.arm.gravity).map(|side| self.torques(theta, &(side * length), false));
    }

    fn torques(&self, theta: &[f64], gravity: &Vector3<f64>, moving: bool) -> Vec<Vec<f64>> {
        let (n, mut dynamics) = (self.joints(), InverseDynamics::new(self.arm));
        let mut torques = vec![vec![0.0; self.rows()]; n];
        let (mut motion, mut torque) = (vec![0.0; 3 * n], vec![0.0; n]);
        for row in 0..self.rows() {
            self.motion_into(row, &mut motion);
            if !moving {
                motion[n..].fill(0.0);
            }
            dynamics.torque(split(&motion, n), gravity, theta, &mut torque);
            torques
                .iter_mut()
                .zip(&torque)
                .for_each(|(course, value)| course[row] = *value);
        }
        torques
    }

    /// Positions, velocities and accelerations (3 n) of a row.
    pub(crate) fn motion_into(&self, row: usize, motion: &mut [f64]) {
        let n = self.joints();
        for joint in 0..n {
            motion[joint] = self.position[joint][row];
            motion[n + joint] = self.velocity[joint][row];
            motion[2 * n + joint] = self.acceleration[joint][row];
        }
    }

    /// Jacobian of the tool point in a row: per joint the velocity of the point per velocity of the joint.
    pub(crate) fn tool_jacobian(&self, row: usize) -> Vec<Vector3<f64>> {
        let (mut rotation, mut origin, mut before) =
            (Matrix3::identity(), Vector3::zeros(), Vector3::zeros());
        let mut axes = Vec::with_capacity(self.joints());
        for joint in 0..self.joints() {
            origin += rotation * (self.arm.points[joint].coords - before);
            before = self.arm.points[joint].coords;
            let (axis, slides) = (rotation * self.arm.axes[joint], self.arm.prismatic[joint]);
            axes.push((axis, origin, slides));
            match slides {
                true => origin += axis * self.position[joint][row],
                false => rotation *= turn(&self.arm.axes[joint], self.position[joint][row]),
            }
        }
        let tip = origin + rotation * (self.arm.tool.coords - before);
        let moves = |(axis, origin, slides): (Vector3<f64>, Vector3<f64>, bool)| match slides {
            true => axis,
            false => axis.cross(&(tip - origin)),
        };
        axes.into_iter().map(moves).collect()
    }
}

/// Hz, at which positions are filtered before they are differentiated.
fn motion_band(cutoff: f64, rate: f64) -> f64 {
    (MOTION_BAND * cutoff).min(HIGHEST_BAND * rate)
}

/// Two unit vectors across a direction, by the axes of the base that are farthest from it, in their order: x and y for an arm that stands on a floor.
fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let down = direction.try_normalize(0.0).unwrap_or_else(Vector3::z);
    let along = down.iamax();
    let mut axes = [0, 1, 2].into_iter().filter(|axis| *axis != along);
    let mut next = || {
        axes.next()
            .map_or_else(Vector3::zeros, |axis| Vector3::ith(axis, 1.0))
    };
    let first: Vector3<f64> = next();
    let first = (first - down * down.dot(&first)).normalize();
    let second: Vector3<f64> = next();
    let second = second - down * down.dot(&second) - first * first.dot(&second);
    [first, second.normalize()]
}

/// rad/s, candidates of the width of a sign.
pub(super) const SIGN_WIDTHS: [f64; 6] = [0.003, 0.006, 0.012, 0.025, 0.05, 0.1];

/// The parts of 3 n numbers.
pub(super) fn split(motion: &[f64], n: usize) -> MotionRow<'_> {
    MotionRow {
        position: &motion[..n],
        velocity: &motion[n..2 * n],
        acceleration: &motion[2 * n..],
    }
}
