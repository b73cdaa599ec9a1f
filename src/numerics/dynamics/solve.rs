//! The steps of a diagnosis of torques, one after the other.

use super::arm::DynamicArm;
use super::cause::TorqueForm;
use super::choice::CauseChoice;
use super::clock::RecordingClock;
use super::contact::{ContactModel, contacts};
use super::judge::judge;
use super::latency::{Latency, latency, take_friction_lead};
use super::problem::TorqueProblem;
use super::refine::{one_power_of_speed, polish, power_for_curve, refine};
use super::rich::{basic_forms, noise_apart, noise_left, noise_of_fit, rich_forms};
use super::shape_slopes::ShapeSlopes;
use super::sweep::SweptColumns;
use super::types::{ContactEvent, TorqueQuestion};
use super::weighted::WeightedColumns;
use crate::findings::{JudgedSet, settle_names, take_out_ends};
use crate::judge::{OtherInertials, faint, from_common, search, settle, settle_with_priors};
use crate::shape_slopes::sign_width;
use crate::types::TorqueRecording;
use crate::weighted::NoiseMemory;

/// Rounds in which others are looked for in place of forms with a number at an end of its search, at most.
const END_ROUNDS: usize = 3;
/// Rounds in which causes that predict left-out rows worse are replaced, at most.
const JUDGED_ROUNDS: usize = 6;
/// s.
const SAME_TIME: f64 = 0.1;
/// Rounds in which a latency and the lead of friction find each other, at most.
const CLOCK_ROUNDS: usize = 4;

/// A recording with what explains it.
pub(super) struct SolvedTorques<'a> {
    pub(crate) problem: TorqueProblem<'a>,
    pub(crate) weighted: WeightedColumns,
    pub(crate) judged: JudgedSet,
    /// Slopes of the judged set.
    pub(crate) slopes: ShapeSlopes,
    pub(crate) latency: Option<Latency>,
    /// Wrong masses or drives in place of those of the set.
    pub(crate) other: Option<OtherInertials>,
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
    let (mut set, mut other) = from_common(&CauseChoice::named(&problem, &weighted));
    let before = problem.events.clone();
    if touched {
        look_for_contacts(&mut problem, &weighted, &set, ContactModel::Present);
    }
    if !alike(&before, &problem.events) {
        learn(&mut problem, &[]);
        weighted = problem.weighted(&[]);
        (set, other) = from_common(&CauseChoice::named(&problem, &weighted));
    }
    tell(explained_by(&problem, &set));
    refine(&mut problem, &mut weighted, &mut set);
    set = again(&mut problem, &mut weighted, set);
    if touched {
        look_for_contacts(&mut problem, &weighted, &set, ContactModel::Judged);
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
    for joint in 0..problem.scene.joints() {
        if power_for_curve(&mut problem, &mut weighted, &mut set, joint) {
            polish(&mut problem, &mut weighted, &mut set);
        }
    }
    let mut judged = JudgedSet::default();
    for _ in 0..JUDGED_ROUNDS {
        weighted = problem.weighted(&set);
        let choice = CauseChoice::new(&problem, &weighted);
        let (settled, priors) = settle_with_priors(&choice, &set);
        let found = judge(&choice, settled, &priors);
        judged.set = found.set;
        if found.withdrawn.is_empty() {
            break;
        }
        let form = |number: &usize| problem.all.forms[*number].clone();
        let barred: Vec<TorqueForm> = found
            .withdrawn
            .iter()
            .map(|(number, _)| form(number))
            .collect();
        problem.barred.extend(barred);
        judged.withdrawn.extend(found.withdrawn);
        // Something else may be in their place.
        set = again(&mut problem, &mut weighted, judged.set.clone());
        polish(&mut problem, &mut weighted, &mut set);
    }
    weighted = problem.weighted(&judged.set);
    judged.silent = CauseChoice::new(&problem, &weighted).other_friction(&judged.set);
    judged.set.extend(&judged.silent);
    weighted = problem.weighted_of(&judged.set);
    polish(&mut problem, &mut weighted, &mut judged.set);
    settle_names(&mut problem, &mut weighted, &mut judged);
    let rich = problem.noise.clone();
    problem.noise = noise_left(&problem, &judged.set);
    weighted = problem.weighted(&judged.set);
    let faint = faint(&CauseChoice::new(&problem, &weighted), &judged);
    judged.silent.extend(faint);
    problem.noise = rich;
    weighted = problem.weighted(&judged.set);
    let slopes = ShapeSlopes::of(&mut problem, &mut weighted, &judged.set);
    SolvedTorques {
        problem,
        weighted,
        judged,
        slopes,
        latency: found,
        other,
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

/// Candidates for pushes before anything else is known: in what the common causes leave, as a rich model bends around a push that comes early;
/// where there are none, in what a rich model leaves. What only looks like one is dropped with the first set.
fn first_contacts(problem: &TorqueProblem) -> Vec<ContactEvent> {
    let (_, residual) = noise_of_fit(problem, &basic_forms(problem), NoiseMemory::Short);
    let noise = noise_apart(problem, &residual);
    let events = contacts(problem, &residual, &noise, ContactModel::Present);
    if !events.is_empty() {
        return events;
    }
    let (noise, residual) = noise_of_fit(problem, &rich_forms(problem, &[]), NoiseMemory::Short);
    contacts(problem, &residual, &noise, ContactModel::Rich)
}

/// Sets rows aside in which the residual of a set looks like a push.
fn look_for_contacts(
    problem: &mut TorqueProblem,
    weighted: &WeightedColumns,
    set: &[usize],
    model: ContactModel,
) {
    let solution = SweptColumns::base(&problem.all, weighted)
        .with(set)
        .solution();
    problem.events = contacts(problem, &problem.residual(&solution), &problem.noise, model);
}

/// Whether the same rows are set aside, to a tenth of a second.
fn alike(before: &[ContactEvent], after: &[ContactEvent]) -> bool {
    let near = |(a, b): (&ContactEvent, &ContactEvent)| {
        (a.start - b.start).abs() < SAME_TIME && (a.end - b.end).abs() < SAME_TIME
    };
    before.len() == after.len() && before.iter().zip(after).all(near)
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
    let mut changed = refine(problem, weighted, &mut set);
    for joint in 0..problem.scene.joints() {
        changed |= one_power_of_speed(problem, weighted, &mut set, joint);
    }
    if changed {
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
