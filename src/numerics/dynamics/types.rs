//! What a diagnosis of joint torques is asked, and what it answers.
//!
//! Recordings of joint torques while the arm moves: arrays in SI on the joint side, rows in the order of time; of those that may be longer than
//! memory, rows come in blocks, as often as they are asked for.

use crate::cause::TorqueParameter;
use crate::diagnose::{Evidence, Probabilities, RivalCause, VerdictKind};
use crate::effect::Place;
use crate::error::Result;
use crate::model::TorqueModel;
use std::ops::Range;

/// How a recording of torques is to be diagnosed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TorqueQuestion {
    /// Whether masses are identified without regard to what is declared.
    pub free_inertials: bool,
    /// Hz: of the low-pass applied alike to measured and simulated torque; `None`: chosen from how fast the joints come
    /// and go.
    pub cutoff: Option<f64>,
    /// Names of causes that are not tried.
    pub without: Vec<String>,
    /// Whether the numbers of declared links are moved to the nearest that bodies have.
    pub enforce_bodies: bool,
}

/// What the simulated torques rest on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InertialBasis {
    /// Declared inertials, free within their tolerance: payload, link and torque constant can be findings.
    Declared,
    /// Identified ones, so many base parameters: errors of masses, of the payload and of torque constants vanish in them.
    Free(usize),
}

/// Noise of a joint's torque after the low-pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueNoise {
    /// Nm.
    pub sigma: f64,
    /// How many judged rows in a row count as one.
    pub autocorrelation: f64,
}

/// Differences of measured and predicted torque, per joint.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueErrors {
    /// Nm.
    pub rms: Vec<f64>,
    /// Rms over rms of measured torque about its mean.
    pub nrmse: Vec<f64>,
    /// Mean of `nrmse` over joints.
    pub nrmse_mean: f64,
    /// Rms (Nm) of rows in which the joint moves; `None` where there are none.
    pub rms_moving: Vec<Option<f64>>,
    /// Rms (Nm) of rows in which the joint rests: friction is any value inside the Coulomb band there.
    pub rms_rest: Vec<Option<f64>>,
}

/// A cause of what the rigid arm leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueFinding {
    /// Canonical name of the cause.
    pub effect: &'static str,
    /// Where it acts.
    pub place: Place,
    /// The finding in a sentence, with its size.
    pub statement: String,
    /// Fitted numbers, in units that people read.
    pub parameters: Vec<TorqueParameter>,
    /// Its weight in the data.
    pub evidence: Evidence,
    /// Explanations that these data do not exclude, the closest first.
    pub rivals: Vec<RivalCause>,
    /// How probable its name and its place are.
    pub probabilities: Probabilities,
}

/// What is left at a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueLeftover {
    /// Nm, of fitted rows.
    pub rms: f64,
    /// The same over the noise.
    pub over_noise: f64,
    /// What it looks like, where it is not noise.
    pub signature: Option<String>,
}

/// A time in which something pushed on the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactEvent {
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
    /// Joints that feel it most, from 0, strongest first.
    pub joints: Vec<usize>,
    /// Peak force at the tool, N, base frame.
    pub force: [f64; 3],
    /// One standard deviation of each component, N.
    pub sigma: [f64; 3],
    /// Fall of the whitened squared residual by it.
    pub gain: f64,
}

/// An inertial number as identified, in units that people read.
#[derive(Debug, Clone, PartialEq)]
pub struct InertialEstimate {
    /// From 0.
    pub link: usize,
    /// `mass`, `moment_x` (mass times centre from the joint's point), ..., `inertia_xx` (about the joint's point), ...
    pub quantity: &'static str,
    /// kg, kg m, kg m^2.
    pub unit: &'static str,
    /// With the findings on masses and payload.
    pub value: f64,
    /// As declared, with the declared payload; `None` where nothing is declared.
    pub declared: Option<f64>,
    /// One standard deviation of the posterior.
    pub sigma: f64,
}

/// Torque of friction over velocity, as found.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionCurve {
    /// From 0.
    pub joint: usize,
    /// rad/s, ascending, over the range of the recording.
    pub velocity: Vec<f64>,
    /// Nm.
    pub torque: Vec<f64>,
    /// One standard deviation, Nm.
    pub sigma: Vec<f64>,
}

/// The judged rows (after low-pass and decimation), row-major (rows x n).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TorqueCourses {
    /// Rows of the recording, length rows.
    pub row: Vec<usize>,
    /// s, length rows.
    pub time: Vec<f64>,
    /// Length rows.
    pub held_out: Vec<bool>,
    /// Whether the row lies in an event: neither fitted nor judged.
    pub in_event: Vec<bool>,
    /// Whether the joint rests, rows x n.
    pub at_rest: Vec<bool>,
    /// rad/s, rows x n.
    pub velocity: Vec<f64>,
    /// Nm, rows x n: measured, brought onto the clock of the positions.
    pub measured: Vec<f64>,
    /// Nm, rows x n: of the arm as declared (of the identified rigid arm where nothing is declared).
    pub simulated: Vec<f64>,
    /// Nm, rows x n: with the findings.
    pub corrected: Vec<f64>,
}

/// Links that were moved to bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct EnforcedBodies {
    /// Links that were no bodies, from 0.
    pub links: Vec<usize>,
    /// What the whitened squared residual rises by, tolerances of the declared masses included.
    pub cost: f64,
}

/// The outcome of a diagnosis of torques.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueDiagnosis {
    /// The answer in one word.
    pub verdict: VerdictKind,
    /// The verdict in a sentence, with what its noise rests on.
    pub statement: String,
    /// What is odd about the recording and what was decided from it, a sentence each.
    pub remarks: Vec<String>,
    /// Which of the two bases was run.
    pub basis: InertialBasis,
    /// Hz, of the low-pass.
    pub cutoff: f64,
    /// Hz, of the judged rows.
    pub rate: f64,
    /// Per joint.
    pub noise: Vec<TorqueNoise>,
    /// Errors of held-out rows (of the fitted ones where none are held out), of the arm as declared (with identified masses alone where nothing is
    /// declared).
    pub before: TorqueErrors,
    /// The same with the findings.
    pub after: TorqueErrors,
    /// Whether the errors are of held-out rows.
    pub held_out: bool,
    /// Strongest first.
    pub findings: Vec<TorqueFinding>,
    /// What these data cannot show, a sentence each.
    pub not_observable: Vec<String>,
    /// Per joint.
    pub leftover: Vec<TorqueLeftover>,
    /// Pushes on the arm, in the order of time.
    pub events: Vec<ContactEvent>,
    /// Measured and predicted torques.
    pub courses: TorqueCourses,
    /// Ten a link.
    pub inertials: Vec<InertialEstimate>,
    /// Curves of joints with friction found.
    pub friction: Vec<FrictionCurve>,
    /// All that was identified, as torques are predicted with it.
    pub model: TorqueModel,
    /// Links whose numbers were moved to those of bodies, where that was asked and any had to be.
    pub enforced: Option<EnforcedBodies>,
}

/// Rows of n joints, row-major (rows x n).
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueRecording {
    /// Number of joints n.
    pub joints: usize,
    /// s, ascending inside a trajectory; length rows.
    pub time: Vec<f64>,
    /// rad (m for a prismatic joint), rows x n.
    pub position: Vec<f64>,
    /// rad/s, rows x n, where the controller gives it. `None`: found from positions.
    pub velocity: Option<Vec<f64>>,
    /// Nm at the joint, rows x n: a torque sensor's, or current times ratio and torque constant.
    pub torque: Vec<f64>,
    /// Temperature of the gears, K or degrees C; length rows.
    pub temperature: Option<Vec<f64>>,
    /// Which trajectory a row belongs to, length rows: nothing is filtered from one into the next unless the clock goes on without a gap.
    pub trajectory: Vec<u32>,
    /// Rows that judge in the end and choose nothing, length rows.
    pub held_out: Vec<bool>,
    /// Whether torques are motor currents times ratio and torque constant; else a torque sensor's.
    pub from_current: bool,
}

impl TorqueRecording {
    /// A motion of one trajectory without torques, s and rad, positions row-major.
    pub(super) fn of_motion(joints: usize, time: Vec<f64>, position: Vec<f64>) -> Self {
        let rows = time.len();
        Self {
            joints,
            time,
            position,
            velocity: None,
            torque: Vec::new(),
            temperature: None,
            trajectory: vec![1; rows],
            held_out: vec![false; rows],
            from_current: false,
        }
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.time.len()
    }

    /// No rows of the columns that another has.
    pub(super) fn like(other: &Self) -> Self {
        Self {
            velocity: other.velocity.as_ref().map(|_| Vec::new()),
            temperature: other.temperature.as_ref().map(|_| Vec::new()),
            from_current: other.from_current,
            trajectory: Vec::new(),
            held_out: Vec::new(),
            ..Self::of_motion(other.joints, Vec::new(), Vec::new())
        }
    }

    /// Appends rows of a recording with the same columns.
    pub(super) fn extend(&mut self, other: &Self, rows: Range<usize>) {
        let wide = rows.start * self.joints..rows.end * self.joints;
        let both =
            |extended: &mut Option<Vec<f64>>, other: &Option<Vec<f64>>, rows: Range<usize>| {
                extended
                    .iter_mut()
                    .zip(other)
                    .for_each(|(values, other)| values.extend_from_slice(&other[rows.clone()]));
            };
        self.time.extend_from_slice(&other.time[rows.clone()]);
        self.position
            .extend_from_slice(&other.position[wide.clone()]);
        both(&mut self.velocity, &other.velocity, wide.clone());
        self.torque.extend_from_slice(&other.torque[wide]);
        both(&mut self.temperature, &other.temperature, rows.clone());
        self.trajectory
            .extend_from_slice(&other.trajectory[rows.clone()]);
        self.held_out.extend_from_slice(&other.held_out[rows]);
    }

    /// Takes the first rows away.
    pub(super) fn forget(&mut self, rows: usize) {
        let wide = rows * self.joints;
        self.time.drain(..rows);
        self.position.drain(..wide);
        self.velocity
            .iter_mut()
            .for_each(|all| drop(all.drain(..wide)));
        self.torque.drain(..wide);
        self.temperature
            .iter_mut()
            .for_each(|all| drop(all.drain(..rows)));
        self.trajectory.drain(..rows);
        self.held_out.drain(..rows);
    }
}

/// A recording of torques that is read in blocks.
pub trait TorqueSource {
    /// Number of joints n.
    fn joints(&self) -> usize;

    /// Number of rows.
    fn rows(&self) -> usize;

    /// Hands on all rows in their order, block after block, each with the same columns.
    ///
    /// # Errors
    /// What reading fails with, and what `take` fails with.
    fn blocks(&self, take: &mut dyn FnMut(&TorqueRecording) -> Result<()>) -> Result<()>;

    /// Recorded rows that some rows (ascending) are, or come after where they are made up.
    ///
    /// # Errors
    /// What reading it fails with.
    fn recorded(&self, rows: &[usize]) -> Result<Vec<usize>> {
        Ok(rows.to_vec())
    }
}

impl TorqueSource for TorqueRecording {
    fn joints(&self) -> usize {
        self.joints
    }

    fn rows(&self) -> usize {
        self.rows()
    }

    fn blocks(&self, take: &mut dyn FnMut(&TorqueRecording) -> Result<()>) -> Result<()> {
        take(self)
    }
}
