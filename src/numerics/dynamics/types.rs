//! What a diagnosis of joint torques is asked, and what it answers.

use super::cause::TorqueParameter;
use super::model::{FrictionCurve, TorqueModel};
use crate::diagnose::{Evidence, Probabilities, RivalCause, VerdictKind};
use crate::effect::{DeclaredTorque, Place};
use std::borrow::Cow;

/// How a recording of torques is to be diagnosed.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueQuestion {
    /// Whether masses are identified without regard to what is declared.
    pub free_inertials: bool,
    /// Hz: of the low-pass applied alike to measured and simulated torque; `None`: chosen from how fast the joints come
    /// and go.
    pub cutoff: Option<f64>,
    /// Names that are not given: what such a cause explains is without a name at its place.
    pub without: Vec<String>,
    /// Prior probability that what acts somewhere is no cause of the list: its odds scale those of causes without a name.
    pub open_world: f64,
    /// Laws of a user's own, which are compared with those of the library.
    pub effects: Vec<DeclaredTorque>,
    /// Whether the numbers of declared links are moved to the nearest that bodies have.
    pub enforce_bodies: bool,
}

impl Default for TorqueQuestion {
    fn default() -> Self {
        Self {
            free_inertials: false,
            cutoff: None,
            without: Vec::new(),
            open_world: *crate::criteria::cells::USUAL,
            effects: Vec::new(),
            enforce_bodies: false,
        }
    }
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
    pub effect: Cow<'static, str>,
    /// Where it acts.
    pub place: Place,
    /// The kind of variable that it follows: own speed, own angle, other angle, load, acceleration, time, temperature, constant.
    pub follows: &'static str,
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
    /// Nm, rows x n: measured, interpolated at the times of the positions.
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
