//! The identified model of an arm's torques as data: inertial numbers of the links, and the causes that add torque at joints.

use super::newton_euler::INERTIAL_NUMBERS;
use crate::effect::Place;

/// A cause that adds torque at joints, with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueTerm {
    /// Canonical name of the cause.
    pub effect: String,
    /// Where it acts.
    pub place: Place,
    /// Further joints (from 0) or an order, as the cause reads them.
    pub with: [usize; 2],
    /// Numbers that enter nonlinearly, SI.
    pub shape: Vec<f64>,
    /// Numbers that enter linearly, SI; names by [`TorqueTerm::names`].
    pub coefficients: Vec<f64>,
    /// Rms of its torque over the recording, Nm, over the joints that it acts on.
    pub rms: f64,
}

/// What the judged rows visited at a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRange {
    /// Least and greatest, rad.
    pub position: [f64; 2],
    /// rad/s.
    pub speed: f64,
    /// rad/s^2.
    pub acceleration: f64,
    /// Nm, of the rigid arm.
    pub load: f64,
    /// Nm, one standard deviation: what held-out rows leave beyond noise and the covariance of the model's numbers.
    pub misfit: f64,
    /// Nm, 95 %: what is usual for the model's torque there, by the covariance and the misfit.
    pub usual: f64,
    /// rad/s over which the sign of its velocity turns: the model's, but where friction leads.
    pub sign_width: f64,
}

/// The identified model of an arm's torques.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueModel {
    /// 10 n, as the regressor counts them, payload on the last link; 0 where [`TorqueModel::identified`] is false.
    pub inertials: Vec<f64>,
    /// 10 n: all where masses were declared, else the base parameters, which stand for others too.
    pub identified: Vec<bool>,
    /// All causes that add torque at joints: findings, and of viscous and Coulomb friction the one that is too small to be named beside the
    /// other.
    pub terms: Vec<TorqueTerm>,
    /// Covariance of identified inertials, of all coefficients, of the numbers of shapes that were found, term after term, and of the width of a
    /// sign, row-major; with the noise's autocorrelation. Empty where it is not known.
    pub covariance: Vec<f64>,
    /// rad/s over which the sign of a velocity turns.
    pub sign_width: f64,
    /// s by which friction turns before the velocity does.
    pub friction_lead: f64,
    /// s by which the recording's torques came late; they do not when they are commanded.
    pub latency: f64,
    /// Hz, of the low-pass of the recording.
    pub cutoff: f64,
    /// Per joint.
    pub range: Vec<JointRange>,
    /// Least and greatest of the recording, C; `None` where it was not recorded.
    pub temperature: Option<[f64; 2]>,
}

impl TorqueModel {
    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.range.len()
    }

    /// The beginning of the names of a term's numbers.
    pub fn prefix(&self, term: usize) -> String {
        let own = &self.terms[term];
        let alike = |other: &&TorqueTerm| other.effect == own.effect && other.place == own.place;
        let before = self.terms[..term].iter().filter(alike).count();
        match before {
            0 => format!("{}.{}", own.effect, own.place.tag()),
            _ => format!("{}.{}.{}", own.effect, own.place.tag(), before + 1),
        }
    }

    /// Whether every inertial number of a link is identified, not only what base parameters stand for.
    pub fn is_whole(&self, link: usize) -> bool {
        self.identified[INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)]
            .iter()
            .all(|known| *known)
    }
}
