//! The steps of a diagnosis of torques, one after the other.

use super::arm::DynamicArm;
use super::cause::UNKNOWN;
use super::cells::{CauseChoice, all_but};
use super::contact::contacts;
use super::latency::{Latency, latency, take_friction_lead};
use super::problem::{
    TorqueBand, TorqueProblem, basic_forms, noise_apart, noise_left, noise_of, noise_of_fit,
    rich_forms,
};
use super::recording::{RecordingClock, TorqueRecording};
use super::refine::{
    ShapeSlopes, list_own_shapes, polish, refine, take_out_ends, take_sign_widths,
};
use super::search::{faint, from_common, priors, search};
use super::sweep::SweptColumns;
use super::types::{ContactEvent, TorqueQuestion};
use super::weighted::{JointNoise, NoiseMemory, WeightedColumns};
use crate::criteria::torque::{BLOCKS, CONFIRMED, NAMED};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

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
    /// Noise that a rich model leaves.
    rich_noise: Vec<JointNoise>,
    /// Forms of the model.
    pub(crate) set: Vec<usize>,
    /// Those of them that are too little to be named.
    pub(crate) silent: Vec<usize>,
    /// Slopes of the set.
    pub(crate) slopes: ShapeSlopes,
    pub(crate) latency: Option<Latency>,
}

impl SolvedTorques<'_> {
    /// Weighs by the noise that a rich model leaves, as fits what may still join: what the causes leave holds that, too, and it would count
    /// as noise.
    pub(super) fn weigh_by_rich_noise(&mut self) {
        self.problem.noise.clone_from(&self.rich_noise);
        self.weighted = self.problem.weighted(&self.set);
        let priors = priors(&CauseChoice::new(&self.problem, &self.weighted), &self.set);
        self.weighted.know(&priors);
    }
}

/// Looks for causes.
pub(super) fn solve<'a>(
    arm: &'a DynamicArm,
    recording: TorqueRecording,
    question: &TorqueQuestion,
    clock: &RecordingClock,
    band: TorqueBand,
    tell: &mut dyn FnMut(String),
) -> SolvedTorques<'a> {
    let mut problem = TorqueProblem::new(arm, recording, question, clock, band);
    take_sign_widths(&mut problem, false);
    problem.form();
    let found = clocked(&mut problem);
    if let Some(latency) = &found {
        tell(format!(
            "torques come {:.1} ms after the positions",
            1e3 * latency.seconds
        ));
    }
    problem.let_come_later();
    problem.events = first_contacts(&problem);
    learn(&mut problem, &[]);
    if problem.has_own_laws() {
        let weighted = problem.weighted(&[]);
        list_own_shapes(&mut problem, weighted);
    }
    let mut weighted = problem.weighted(&[]);
    let mut set = from_common(&CauseChoice::named(&problem, &weighted));
    tell(explained_by(&problem, &set));
    refine(&mut problem, &mut weighted, &mut set);
    set = again(&mut problem, &mut weighted, set);
    let residual = left_by(&problem, &weighted, &set);
    problem.events = contacts(&problem, &residual, &problem.noise, true);
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
        for form in leave {
            problem.barred.push(problem.all.forms[form].clone());
        }
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
    // Of this noise are the numbers that are stated, too.
    let left = noise_left(&problem, &set);
    let rich_noise = std::mem::replace(&mut problem.noise, left);
    weighted = problem.weighted(&set);
    silent.extend(faint(&CauseChoice::new(&problem, &weighted), &set, &silent));
    let small = too_small(&mut problem, &weighted, &set, &silent);
    silent.extend(small);
    let priors = priors(&CauseChoice::new(&problem, &weighted), &set);
    weighted.know(&priors);
    let slopes = ShapeSlopes::of(&mut problem, &mut weighted, &set);
    SolvedTorques {
        problem,
        weighted,
        rich_noise,
        set,
        silent,
        slopes,
        latency: found,
    }
}

/// Finds by how much torques come late and by how much friction turns before the velocity, each given the other, and takes both.
fn clocked(problem: &mut TorqueProblem) -> Option<Latency> {
    let mut found = None;
    for _ in 0..CLOCK_ROUNDS {
        found = latency(problem);
        problem.shift(found.map_or(0.0, |latency| latency.seconds));
        if !take_friction_lead(problem) {
            break;
        }
        problem.form();
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
        set = search(&CauseChoice::new(problem, weighted), &set);
    }
    set
}

/// Takes noise from what the rich model and a set leave.
fn learn(problem: &mut TorqueProblem, set: &[usize]) {
    problem.noise = noise_of(problem, &rich_forms(problem, set), NoiseMemory::Short);
}

/// What of a set makes less torque than differentiation and rounding of the positions may: in rigid torques, and in friction where a joint turns.
fn too_small(
    problem: &mut TorqueProblem,
    weighted: &WeightedColumns,
    set: &[usize],
    silent: &[usize],
) -> Vec<usize> {
    let solution = SweptColumns::base(&problem.all, weighted)
        .with(set)
        .solution();
    let moved = problem.moved_by_filter(weighted, set, &solution);
    let is_small = |form: &usize| {
        let joints = problem.all.forms[*form].acts_on(problem.joints());
        let rms = problem.rms_of(*form, &solution);
        rms < problem.numerics_at(&joints) || rms < *NAMED * problem.rms_of(*form, &moved)
    };
    let asked = set.iter().copied().filter(|form| !silent.contains(form));
    asked.filter(is_small).collect()
}

/// A set as a line.
fn explained_by(problem: &TorqueProblem, set: &[usize]) -> String {
    let names = set.iter().map(|number| {
        let form = &problem.all.forms[*number];
        format!("{} {}", form.name(), form.place)
    });
    format!("explained by {}", names.collect::<Vec<_>>().join(", "))
}

/// A column of which less than this share is new adds nothing.
const REDUNDANT: f64 = 1e-9;

/// A block of rows in time, and what is fitted to all others.
struct Fold {
    left_out: Vec<Range<usize>>,
    others: WeightedColumns,
}

impl Fold {
    /// The blocks of the fitted rows, with 1 / variance beforehand of columns of a set.
    fn all(problem: &TorqueProblem, set: &[usize], priors: &[(usize, f64)]) -> Vec<Self> {
        let runs = problem.runs(false);
        let rows: usize = runs.iter().map(Range::len).sum();
        let base = problem
            .all
            .prior
            .iter()
            .copied()
            .enumerate()
            .take(problem.all.base);
        let of_set = set.iter().flat_map(|form| problem.all.of(*form));
        let of_set = of_set.map(|column| (column, problem.all.prior[column]));
        let known: Vec<(usize, f64)> = base.chain(of_set).collect();
        let fold = |block: usize| {
            let [first, last] = [block, block + 1].map(|block| rows * block / *BLOCKS);
            let others = [between(&runs, 0..first), between(&runs, last..rows)].concat();
            let mut others = problem.weighted_by(problem.weighing(&others), set);
            others.know(&known);
            others.know(priors);
            Self {
                left_out: between(&runs, first..last),
                others,
            }
        };
        (0..*BLOCKS).map(fold).collect()
    }

    /// Whitened errors of the rows that are left out; none where the others do not determine the model.
    fn errors(&self, problem: &TorqueProblem, set: &[usize]) -> Option<Vec<f64>> {
        let columns = problem.all.with_base(set);
        let count = columns.len();
        let mut gram = DMatrix::from_fn(count, count, |a, b| {
            self.others.gram[columns[a]][columns[b]]
        });
        (0..count).for_each(|k| gram[(k, k)] += REDUNDANT * gram[(k, k)] + f64::MIN_POSITIVE);
        let right = DVector::from_fn(count, |k, _| self.others.right[columns[k]]);
        let values = gram.cholesky()?.solve(&right);
        let solution: Vec<(usize, f64)> = columns.into_iter().zip(values.iter().copied()).collect();
        let left_out = problem.weighing(&self.left_out);
        Some(left_out.measured(&problem.residual(&solution)).concat())
    }
}

/// The parts of runs that lie between two rows, counted over all of them.
fn between(runs: &[Range<usize>], rows: Range<usize>) -> Vec<Range<usize>> {
    let (mut passed, mut parts) = (0, Vec::new());
    for run in runs {
        let first = rows.start.clamp(passed, passed + run.len());
        let last = rows.end.clamp(passed, passed + run.len());
        if first < last {
            parts.push(run.start + first - passed..run.start + last - passed);
        }
        passed += run.len();
    }
    parts
}

/// What of a set has no name and does not predict rows that are left out as it would if it were right; the worst goes first, and the others are
/// asked without it. Coefficients have such 1 / variances beforehand.
fn unconfirmed(choice: &CauseChoice, set: &[usize], priors: &[(usize, f64)]) -> Vec<usize> {
    let folds = Fold::all(choice.problem, set, priors);
    let (mut set, mut leave) = (set.to_vec(), Vec::new());
    loop {
        let asked = set.iter().copied();
        let asked = asked.filter(|form| choice.form(*form).name() == UNKNOWN);
        let short = asked.map(|form| (form, short(choice, &folds, &set, form)));
        let worst = short.filter(|(_, short)| *short < 0.0);
        let Some((worst, _)) = worst.min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return leave;
        };
        set.retain(|form| *form != worst);
        leave.push(worst);
    }
}

/// What rows that are left out gain by a form of a set, less what they would if it were right, whitened squares.
fn short(choice: &CauseChoice, folds: &[Fold], set: &[usize], form: usize) -> f64 {
    let others = all_but(set, form);
    let (mut gain, mut expected) = (0.0, 0.0);
    for fold in folds {
        let [Some(whole), Some(without)] =
            [set, &others].map(|set| fold.errors(choice.problem, set))
        else {
            continue;
        };
        for (without, with) in without.iter().zip(&whole) {
            gain += without * without - with * with;
            expected += (without - with).powi(2);
        }
    }
    // The gain of a right cause scatters about its own square by twice its root.
    let scatter = *NAMED * 2.0 * expected.sqrt();
    gain - (expected - scatter).min(*CONFIRMED * choice.form(form).width as f64)
}
