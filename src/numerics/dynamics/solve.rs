//! The steps of a diagnosis of torques, one after the other.

use super::arm::DynamicArm;
use super::cells::{faint, from_common, priors, search, settle};
use super::choice::CauseChoice;
use super::clock::RecordingClock;
use super::contact::contacts;
use super::latency::{Latency, latency, take_friction_lead};
use super::left_out::unconfirmed;
use super::problem::TorqueProblem;
use super::refine::{polish, refine};
use super::rich::{basic_forms, noise_apart, noise_left, noise_of_fit, rich_forms};
use super::shape_slopes::ShapeSlopes;
use super::sweep::SweptColumns;
use super::types::{ContactEvent, TorqueQuestion};
use super::weighted::WeightedColumns;
use crate::findings::take_out_ends;
use crate::shape_slopes::sign_width;
use crate::types::TorqueRecording;
use crate::weighted::NoiseMemory;

/// Rounds in which others are looked for in place of forms with a number at an end of its search, at most.
const END_ROUNDS: usize = 3;
/// Rounds in which others are looked for in place of what does not predict rows that are left out, at most.
const CONFIRMED_ROUNDS: usize = 6;
/// Rounds in which a latency and the lead of friction find each other, at most.
const CLOCK_ROUNDS: usize = 4;

/// A recording with what explains it.
pub(super) struct SolvedTorques<'a> {
    pub(crate) problem: TorqueProblem<'a>,
    pub(crate) weighted: WeightedColumns,
    /// Forms of the model.
    pub(crate) set: Vec<usize>,
    /// Those of them that are too little to be named.
    pub(crate) silent: Vec<usize>,
    /// Slopes of the set.
    pub(crate) slopes: ShapeSlopes,
    pub(crate) latency: Option<Latency>,
}

/// Looks for causes.
pub(super) fn solve<'a>(
    arm: &'a DynamicArm,
    recording: TorqueRecording,
    question: &TorqueQuestion,
    clock: &RecordingClock,
    cutoff: f64,
    tell: &mut dyn FnMut(String),
) -> SolvedTorques<'a> {
    let mut problem = TorqueProblem::new(arm, recording, question, clock, cutoff);
    let width = sign_width(&mut problem);
    problem.scene.turn_over(width);
    problem.form(&question.without);
    let asked = |name: &str| question.without.iter().all(|without| without != name);
    let touched = asked(super::CONTACT);
    let found = clocked(&mut problem, question, asked(super::LATENCY));
    if let Some(latency) = &found {
        tell(format!(
            "torques come {:.1} ms after the positions",
            1e3 * latency.seconds
        ));
    }
    if touched {
        problem.events = first_contacts(&problem);
    }
    learn(&mut problem, &[]);
    let mut weighted = problem.weighted(&[]);
    let mut set = from_common(&CauseChoice::named(&problem, &weighted));
    tell(explained_by(&problem, &set));
    refine(&mut problem, &mut weighted, &mut set);
    set = again(&mut problem, &mut weighted, set);
    if touched {
        let residual = left_by(&problem, &weighted, &set);
        problem.events = contacts(&problem, &residual, &problem.noise, true);
    }
    learn(&mut problem, &set);
    weighted = problem.weighted_of(&set);
    polish(&mut problem, &mut weighted, &mut set);
    for _ in 0..END_ROUNDS {
        if !take_out_ends(&mut problem, &mut weighted, &mut set) {
            break;
        }
        set = again(&mut problem, &mut weighted, set);
        polish(&mut problem, &mut weighted, &mut set);
    }
    weighted = problem.weighted(&set);
    for _ in 0..CONFIRMED_ROUNDS {
        let choice = CauseChoice::new(&problem, &weighted);
        let leave = unconfirmed(&choice, &set, &priors(&choice, &set));
        if leave.is_empty() {
            break;
        }
        set.retain(|form| !leave.contains(form));
        let barred = leave.iter().map(|form| problem.all.forms[*form].clone());
        let barred: Vec<_> = barred.collect();
        problem.barred.extend(barred);
        // Something else may be in their place.
        set = again(&mut problem, &mut weighted, set);
        polish(&mut problem, &mut weighted, &mut set);
        weighted = problem.weighted(&set);
    }
    let named = set.len();
    set.extend(CauseChoice::new(&problem, &weighted).other_friction(&set));
    weighted = problem.weighted_of(&set);
    polish(&mut problem, &mut weighted, &mut set);
    let mut silent = set[named..].to_vec();
    let rich = problem.noise.clone();
    problem.noise = noise_left(&problem, &set);
    weighted = problem.weighted(&set);
    silent.extend(faint(&CauseChoice::new(&problem, &weighted), &set, &silent));
    problem.noise = rich;
    weighted = problem.weighted(&set);
    for (column, precision) in priors(&CauseChoice::new(&problem, &weighted), &set) {
        weighted.gram[column][column] += precision;
    }
    let slopes = ShapeSlopes::of(&mut problem, &mut weighted, &set);
    SolvedTorques {
        problem,
        weighted,
        set,
        silent,
        slopes,
        latency: found,
    }
}

/// Finds by how much torques come late and by how much friction turns before the velocity, each given the other, and takes both.
fn clocked(
    problem: &mut TorqueProblem,
    question: &TorqueQuestion,
    is_asked: bool,
) -> Option<Latency> {
    let mut found = None;
    for _ in 0..CLOCK_ROUNDS {
        found = latency(problem).filter(|_| is_asked);
        problem.shift(found.map_or(0.0, |latency| latency.seconds));
        if !take_friction_lead(problem) {
            break;
        }
        problem.form(&question.without);
    }
    found
}

/// Candidates for pushes before anything else is known: in what the common causes leave, as a rich model bends around a push that comes early.
fn first_contacts(problem: &TorqueProblem) -> Vec<ContactEvent> {
    let (_, residual) = noise_of_fit(problem, &basic_forms(problem), NoiseMemory::Short);
    let noise = noise_apart(problem, &residual);
    contacts(problem, &residual, &noise, false)
}

/// What the base and a set leave of the measured torque, Nm.
fn left_by(problem: &TorqueProblem, weighted: &WeightedColumns, set: &[usize]) -> Vec<Vec<f64>> {
    let fit = SweptColumns::base(&problem.all, weighted).with(set);
    problem.residual(&fit.solution())
}

/// From the fitted rigid torque and noise: searches on from a set and refines it.
fn again(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: Vec<usize>,
) -> Vec<usize> {
    let choice = CauseChoice::new(problem, weighted);
    let solution = choice.base.with(&set).solution();
    let theta = problem.inertials(&set, &solution);
    problem.believe(&theta, &set, &solution);
    problem.refresh();
    learn(problem, &set);
    *weighted = problem.weighted(&set);
    let mut set = search(&CauseChoice::new(problem, weighted), &set);
    if refine(problem, weighted, &mut set) {
        set = settle(&CauseChoice::new(problem, weighted), &set);
    }
    set
}

/// Takes noise from what the rich model and a set leave.
fn learn(problem: &mut TorqueProblem, set: &[usize]) {
    problem.noise = noise_of_fit(problem, &rich_forms(problem, set), NoiseMemory::Short).0;
}

/// A set as a line.
fn explained_by(problem: &TorqueProblem, set: &[usize]) -> String {
    let names = set.iter().map(|number| {
        let form = &problem.all.forms[*number];
        format!("{} {}", form.cause.name, form.place)
    });
    format!("explained by {}", names.collect::<Vec<_>>().join(", "))
}
