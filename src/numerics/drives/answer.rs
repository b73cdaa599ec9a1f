//! What a diagnosis of drives says.

use crate::chain::Chain;
use crate::fit::DriveFit;
use crate::key::Key;
use crate::physics::Physics;
use crate::problem::Drives;
use crate::rollout::Which;
use crate::steps::HALVED;
use calib_engine::{Accepted, Cell, Finding, Options};
use nalgebra::DMatrix;
use std::borrow::Cow;

/// A number of a finding.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveNumber {
    /// What it is.
    pub name: String,
    /// In its unit.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// One standard deviation; `None` where it was chosen from a few.
    pub sigma: Option<f64>,
}

/// What else a finding may be.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveRival {
    /// A cause.
    pub effect: Cow<'static, str>,
    /// Where it would act.
    pub place: String,
    /// Twice the ln of the odds of the finding against it.
    pub delta_bic: f64,
    /// Probability that it is this.
    pub probability: f64,
}

/// A cause that the simulation lacks.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveFinding {
    /// Its cause.
    pub effect: Cow<'static, str>,
    /// Where it acts.
    pub place: String,
    /// The kind of variable that it follows: own speed, own angle, load, acceleration, error of the drive, command, time, constant ..
    pub follows: &'static str,
    /// A sentence for a person.
    pub statement: String,
    /// Its numbers.
    pub parameters: Vec<DriveNumber>,
    /// rad, rms of the whole effect over the fitted rows.
    pub effect_rms: f64,
    /// Of its name at its place.
    pub probability: f64,
    /// Of its place.
    pub place_probability: f64,
    /// That there is nothing.
    pub none_probability: f64,
    /// Twice the ln of the odds against the model without it.
    pub delta_bic: f64,
    /// What else it may be.
    pub rivals: Vec<DriveRival>,
}

/// Errors of a joint, rad rms.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointError {
    /// Of the noise as stated.
    pub noise: f64,
    /// Fitted rows, before and after.
    pub fitted: [f64; 2],
    /// Held-out rows, before and after; those of fitted rows where none are held out.
    pub held_out: [f64; 2],
    /// Whitened, of fitted rows after.
    pub over_noise: f64,
}

/// A diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveDiagnosis {
    /// Causes, strongest first.
    pub findings: Vec<DriveFinding>,
    /// By joint.
    pub joints: Vec<JointError>,
    /// Whether rows were held out.
    pub held_out: bool,
    /// rad rms over all joints: noise; fitted before and after; held out before and after.
    pub overall: JointError,
    /// The simulation with what was found.
    pub physics: Physics,
    /// rad, simulated angles before and after, `rows x joints`.
    pub angles: [Vec<f64>; 2],
    /// Whether noise alone remains.
    pub explained: bool,
    /// Rows that were fitted.
    pub rows: usize,
}

/// Times the noise from which on something remains.
const REMAINS: f64 = 1.1;

/// Diagnoses a recording of drives; `tell` receives the progress.
pub fn diagnose(
    problem: &Drives,
    options: &Options,
    mut tell: impl FnMut(String),
) -> DriveDiagnosis {
    let part = problem.part();
    let is_part = part.is_some();
    let mut searched = part.unwrap_or_else(|| problem.clone());
    let mut whole = problem.clone();
    let mut start = Vec::new();
    let answer = loop {
        let answer = calib_engine::diagnose(&searched, &start, options, &mut tell);
        if searched.halved == HALVED {
            break answer;
        }
        if let Some((finer, rest)) = searched.without_gears(&answer.after, options) {
            whole.chain.step = finer.chain.step;
            (searched, start) = (finer, rest);
            continue;
        }
        // Steps that serve the simulation as it is may be too long for what was found: a finding that explains no more than they err by may
        // be their error. Then they are halved, and what finer ones may still err by is noise.
        let found = searched.physics(&answer.after.inertia, &answer.after.set);
        let coarse = searched.coarseness(&found);
        let odds = answer.findings.iter().map(|one| one.log_odds);
        if answer.is_accurate && searched.exceed(odds, &answer.after, coarse.square) {
            break answer;
        }
        let finer = searched.finer(&found, &coarse);
        whole = whole.stepped_as(&finer, &coarse);
        searched = finer;
        let chain = &searched.chain;
        tell(format!(
            "steps of {:.2} ms, {:.2} ms where a gear yields",
            1e3 * chain.step,
            1e3 * chain.geared_step
        ));
        start = answer.after.set;
    };
    // What stands is fitted to all rows.
    let problem = &whole;
    let after = match is_part {
        true => {
            let (found, least) = (&answer.after, f64::NEG_INFINITY);
            problem.fitted_with(&found.set, Some(found), true, least)
        }
        false => answer.after,
    };
    let findings = answer.findings.iter();
    let findings = findings
        .map(|finding| problem.finding(&after, finding))
        .collect();
    let physics = problem.physics(&after.inertia, &after.set);
    let before = problem.angles(&problem.base, Which::All);
    let after = problem.angles(&physics, Which::All);
    let n = problem.chain.joints();
    let held_out = problem.recording.held_out.contains(&true);
    let mut joints: Vec<JointError> = (0..n)
        .map(|joint| problem.errors(Some(joint), [&before, &after]))
        .collect();
    let rows = problem.fitted().count();
    let squares = problem.noise_squares(&after);
    for (joint, square) in joints.iter_mut().zip(&squares) {
        joint.over_noise = (square / rows as f64).sqrt();
    }
    let mut overall = problem.errors(None, [&before, &after]);
    overall.over_noise = (squares.iter().sum::<f64>() / (rows * n) as f64).sqrt();
    DriveDiagnosis {
        findings,
        explained: joints.iter().all(|joint| joint.over_noise < REMAINS),
        joints,
        held_out,
        overall,
        physics,
        angles: [before, after],
        rows,
    }
}

impl Drives {
    /// The chain of the arm.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    fn errors(&self, joint: Option<usize>, angles: [&Vec<f64>; 2]) -> JointError {
        let n = self.chain.joints();
        let of = |row: usize| -> Vec<usize> {
            (0..n)
                .filter(|j| joint.is_none_or(|one| one == *j))
                .map(|j| row * n + j)
                .collect()
        };
        let rms = |held: bool, angles: &Vec<f64>| {
            let trajectories = self.recording.trajectories.iter();
            let rows = trajectories
                .flat_map(|t| t.rows.clone())
                .filter(|row| self.recording.held_out[*row] == held);
            let all: Vec<f64> = rows
                .flat_map(of)
                .map(|at| (self.recording.angle[at] - angles[at]).powi(2))
                .collect();
            (all.iter().sum::<f64>() / all.len().max(1) as f64).sqrt()
        };
        let any = self.recording.held_out.contains(&true);
        let noise =
            |j: usize| self.recording.noise[j].powi(2) + self.recording.encoder[j].powi(2) / 12.0;
        let noises: Vec<f64> = (0..n)
            .filter(|j| joint.is_none_or(|one| one == *j))
            .map(noise)
            .collect();
        JointError {
            noise: (noises.iter().sum::<f64>() / noises.len() as f64).sqrt(),
            fitted: angles.map(|angles| rms(false, angles)),
            held_out: angles.map(|angles| rms(any, angles)),
            over_noise: 0.0,
        }
    }

    fn finding(&self, fit: &DriveFit, finding: &Finding<Key>) -> DriveFinding {
        let one = &finding.accepted;
        let at = fit.set.iter().position(|other| other.cell == one.cell);
        let covariance = at.map(|at| &fit.covariances[at]);
        let sigma = |k: usize| covariance.map(|all| all[(k, k)].sqrt());
        let rest: Vec<Accepted<Key>> = fit
            .set
            .iter()
            .filter(|other| other.cell != one.cell)
            .cloned()
            .collect();
        let without = self.angles(&self.physics(&fit.inertia, &rest), Which::Fitted);
        let rows: Vec<f64> = self
            .fitted()
            .flat_map(|row| row * self.chain.joints()..(row + 1) * self.chain.joints())
            .map(|k| (without[k] - fit.angles[k]).powi(2))
            .collect();
        let cell = &one.cell;
        let fitted = at.map_or(&one.numbers, |at| &fit.set[at].numbers);
        let numbers = cell.cause.numbers.iter().zip(fitted).enumerate();
        let mut parameters: Vec<DriveNumber> = numbers
            .map(|(k, (number, x))| {
                let sigma = sigma(k).filter(|sigma| *sigma > 0.0);
                let value = if number.by_logarithm { x.exp() } else { *x };
                let by = if number.by_logarithm { value } else { 1.0 };
                DriveNumber {
                    name: number.name.into(),
                    value,
                    unit: number.unit,
                    sigma: sigma.map(|sigma| sigma * by),
                }
            })
            .collect();
        if let (Key::Cable(_), [stiffness, at_zero]) = (cell.key, &mut parameters[..]) {
            // Where it rests is its torque at 0 rad over its stiffness.
            let rest = at_zero.value / stiffness.value;
            let variance = |all: &DMatrix<f64>| {
                let common = rest * (rest * all[(0, 0)] - 2.0 * all[(0, 1)]);
                (common + all[(1, 1)]) / stiffness.value.powi(2)
            };
            let sigma = covariance.map(|all| variance(all).max(0.0).sqrt());
            (at_zero.value, at_zero.sigma) = (rest, sigma.filter(|sigma| *sigma > 0.0));
        }
        if let Key::Coupling(_, by) = cell.key {
            parameters.push(DriveNumber {
                name: "by joint".into(),
                value: by as f64 + 1.0,
                unit: "1",
                sigma: None,
            });
        }
        DriveFinding {
            effect: cell.cause.name.clone(),
            place: cell.place.clone(),
            follows: cell.key.variable().unwrap_or(cell.cause.follows),
            statement: sentence(cell),
            parameters,
            effect_rms: (rows.iter().sum::<f64>() / rows.len().max(1) as f64).sqrt(),
            probability: finding.probability,
            place_probability: finding.place_probability,
            none_probability: finding.none_probability,
            delta_bic: 2.0 * finding.log_odds,
            rivals: finding
                .rivals
                .iter()
                .map(|rival| DriveRival {
                    effect: rival.accepted.cell.cause.name.clone(),
                    place: rival.accepted.cell.place.clone(),
                    delta_bic: -2.0 * rival.log_odds,
                    probability: rival.probability,
                })
                .collect(),
        }
    }
}

fn sentence(cell: &Cell<Key>) -> String {
    let text = cell.cause.sentence.replace("{}", &cell.place);
    let mut letters = text.chars();
    let first = letters
        .next()
        .map(|letter| letter.to_uppercase().to_string());
    let follows = cell.key.follows();
    let follows = follows.map_or(String::new(), |what| format!(": {what}"));
    first.unwrap_or_default() + letters.as_str() + &follows + "."
}
