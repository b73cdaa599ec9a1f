//! What a diagnosis identified as one model: inertial numbers of the links, and the causes that add torque at joints.

use super::cause::{TORQUE_CAUSES, TorqueForm};
use super::choice::CauseChoice;
use super::coefficients::coefficient_names;
use super::inertial_names::{inertial_name, inertial_unit};
use super::newton_euler::INERTIAL_NUMBERS;
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use crate::effect::Place;
use crate::error::{Error, Result};

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

/// Positions, speed and acceleration of a joint in the judged rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRange {
    /// Least and greatest, rad.
    pub position: [f64; 2],
    /// rad/s.
    pub speed: f64,
    /// rad/s^2.
    pub acceleration: f64,
}

/// The identified model of an arm's torques.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueModel {
    /// 10 n, as the regressor counts them, payload on the last link; 0 where [`TorqueModel::identified`] is false.
    pub inertials: Vec<f64>,
    /// 10 n: all where masses were declared, else the base parameters, which stand for others too.
    pub identified: Vec<bool>,
    /// All findings that add torque at joints.
    pub terms: Vec<TorqueTerm>,
    /// Of identified inertials, then of all coefficients, row-major; with the noise's autocorrelation. Empty where it is not known.
    pub covariance: Vec<f64>,
    /// rad/s over which the sign of a velocity turns.
    pub sign_width: f64,
    /// s by which the recording's torques came late; they do not when they are commanded.
    pub latency: f64,
    /// Hz, of the low-pass of the recording.
    pub cutoff: f64,
    /// Per joint.
    pub range: Vec<JointRange>,
}

impl TorqueTerm {
    /// Its form. Fails where no cause has its name or its numbers are too few.
    pub(super) fn form(&self) -> Result<TorqueForm> {
        let cause = TORQUE_CAUSES.into_iter().find(|cause| cause.name() == self.effect);
        let cause =
            cause.ok_or_else(|| Error::data("torque model", format!("`{}` is no cause that adds torque", self.effect)))?;
        let form =
            TorqueForm { cause, place: self.place, with: self.with, shape: self.shape.clone(), width: self.coefficients.len() };
        Ok(form)
    }

    /// Quantity and unit of each coefficient. Fails where no cause has its name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        self.form().map(|form| coefficient_names(&form))
    }
}

impl TorqueModel {
    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.range.len()
    }

    /// Name of each number of the covariance, in its order: `rigid_body.l3.mass`, `viscous_friction.j2.viscous`; a second cause of a name
    /// at a place is `torque_ripple.j2.2.sine`. Fails where no cause has a term's name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        let inertials = (0..self.inertials.len()).filter(|number| self.identified[*number]);
        let mut names: Vec<(String, &'static str)> =
            inertials.map(|number| (inertial_name(number), inertial_unit(number))).collect();
        for (place, term) in self.terms.iter().enumerate() {
            let own = self.prefix(place);
            names.extend(term.names()?.into_iter().map(|(quantity, unit)| (format!("{own}.{quantity}"), unit)));
        }
        Ok(names)
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
        self.identified[INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)].iter().all(|known| *known)
    }

    /// Of a judged set.
    pub(super) fn of(choice: &CauseChoice, set: &[usize], sweep: &SweptColumns, solution: &[(usize, f64)]) -> Self {
        let problem = choice.problem;
        let adds = |number: &usize| {
            let form = choice.form(*number);
            !problem.scene.declared.as_ref().is_some_and(|declared| form.cause.inertial(form, declared).is_some())
        };
        let adding: Vec<usize> = set.iter().copied().filter(adds).collect();
        let value = |column: usize| solution.iter().find(|(pivot, _)| *pivot == column).map_or(0.0, |(_, value)| *value);
        let term = |number: &usize| {
            let form = choice.form(*number);
            TorqueTerm {
                effect: form.cause.name().into(),
                place: form.place,
                with: form.with,
                shape: form.shape.clone(),
                coefficients: problem.all.of(*number).map(value).collect(),
                rms: rms(problem, problem.all.of(*number).map(|column| (column, value(column))).collect()),
            }
        };
        let (identified, covariance) = covariance(problem, set, &adding, sweep);
        let mut inertials = problem.inertials(set, solution);
        inertials.iter_mut().zip(&identified).filter(|(_, known)| !**known).for_each(|(number, _)| *number = 0.0);
        Self {
            inertials,
            identified,
            terms: adding.iter().map(term).collect(),
            covariance,
            sign_width: problem.scene.sign_width,
            latency: problem.latency,
            cutoff: problem.reduction.cutoff,
            range: (0..problem.joints()).map(|joint| range(problem, joint)).collect(),
        }
    }
}

/// Rms of the torque of coefficients over the joints that have some, Nm.
fn rms(problem: &TorqueProblem, own: Vec<(usize, f64)>) -> f64 {
    let torque = problem.predicted(&own);
    let acting: Vec<&Vec<f64>> = torque.iter().filter(|course| course.iter().any(|value| *value != 0.0)).collect();
    let count = (acting.len() * problem.reduction.rows.len()).max(1) as f64;
    (acting.into_iter().flatten().map(|value| value * value).sum::<f64>() / count).sqrt()
}

fn range(problem: &TorqueProblem, joint: usize) -> JointRange {
    let rows = || (0..problem.reduction.rows.len()).filter(|row| !problem.in_event(*row)).map(|row| problem.reduction.rows[row]);
    let most = |course: &[f64]| rows().map(|row| course[row].abs()).fold(0.0, f64::max);
    let position = &problem.scene.position[joint];
    let ends = rows()
        .map(|row| position[row])
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, greatest], value| [least.min(value), greatest.max(value)]);
    JointRange {
        position: ends,
        speed: most(&problem.scene.velocity[joint]),
        acceleration: most(&problem.scene.acceleration[joint]),
    }
}

/// Which inertial numbers are identified, and the covariance of these and of the coefficients of `adding`.
fn covariance(problem: &TorqueProblem, set: &[usize], adding: &[usize], sweep: &SweptColumns) -> (Vec<bool>, Vec<f64>) {
    let mut columns: Vec<usize> = Vec::new();
    // Each number of the model as a sum of coefficients: position in `columns`, and share.
    let mut sums: Vec<Vec<(usize, f64)>> = Vec::new();
    let mut identified = Vec::with_capacity(INERTIAL_NUMBERS * problem.joints());
    for link in 0..problem.joints() {
        let changes = problem.inertial_changes(set, link);
        let first = columns.len();
        columns.extend(changes.iter().map(|(column, _)| *column));
        for number in 0..INERTIAL_NUMBERS {
            let own = changes.iter().enumerate().map(|(place, (_, ten))| (first + place, ten[number]));
            let own: Vec<(usize, f64)> = own.filter(|(_, share)| *share != 0.0).collect();
            let known = problem.scene.declared.is_some() || !own.is_empty();
            identified.push(known);
            if known {
                sums.push(own);
            }
        }
    }
    for column in adding.iter().flat_map(|number| problem.all.of(*number)) {
        sums.push(vec![(columns.len(), 1.0)]);
        columns.push(column);
    }
    let (all, width) = (sweep.covariance(&columns), columns.len());
    let entry = |a: &[(usize, f64)], b: &[(usize, f64)]| -> f64 {
        a.iter().map(|(row, left)| left * b.iter().map(|(column, right)| right * all[row * width + column]).sum::<f64>()).sum()
    };
    let covariance = sums.iter().flat_map(|a| sums.iter().map(move |b| entry(a, b))).collect();
    (identified, covariance)
}
