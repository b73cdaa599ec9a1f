//! Diagnosis: where simulation and recording differ, what physics was left out, and how much better the model is with it.
//!
//! The base is the robot as its user believes it: rigid geometry, reduction ratios, declared couplings. Every cause of the
//! library and form-free signatures are projected off it and compared in one pool; what wins is refitted together with the base
//! on the full model, and everything is looked at again from there, until nothing changes.

mod currents;
mod finding;
mod gate;
mod group;
mod judge;
mod lens;
mod locate;
mod noise;
mod outside;
mod pool;
mod rivals;
mod search;
mod sense;
mod separate;
mod state;
mod statement;
mod unasked;
mod unseen;
mod verdict;
mod withdraw;

pub use crate::effect::Number;
pub use finding::{Evidence, Finding, Rival};
pub use locate::{Line, Located, Share};
pub use noise::Repeatability;
pub use outside::beside;
pub use separate::{Standing, contest, other_means};
pub use verdict::{Diagnosis, Errors, Verdict};

use crate::effect::{
    BaseFrame, Effect, EffectStack, Form, Hypothesis, Load, ParameterSpec, ReductionRatio, Setting, Survey, Term, identified,
    whole,
};
use crate::error::counted;
use crate::estimate::{Fate, FitOptions, Fitted, Known, Model, Prior, Screening, align, fit_screened, rows_alike};
use crate::robot::{Measurements, RobotModel};
use lens::Lens;
use nalgebra::Matrix3;
use pool::Pool;
use search::{Search, SearchOptions};
use withdraw::Court;

/// Effects that the user's simulation has.
pub const BASE: [&str; 6] = ["base_frame", "tool_offset", "joint_offset", "link_geometry", "reduction_ratio", "coupling_ratio"];

/// What is to be diagnosed.
pub struct Question<'a> {
    pub robot: &'a RobotModel,
    pub data: &'a Measurements,
    /// Rows to fit, ascending.
    pub fit: &'a [usize],
    /// Rows that judge, ascending; empty if none are held out.
    pub validate: &'a [usize],
    /// The number of the set that each row belongs to.
    pub set: &'a [usize],
    pub seed: u64,
}

/// Most rounds of search and refit; it settles in two or three.
const ROUNDS: usize = 6;
/// Repeats that make the noise known; with fewer it is taken from a residual without structure.
const REPEATS: usize = 10;
/// The gate is closed above this probability that what is left is noise.
const SIGNIFICANT: f64 = 0.004;
/// Explanations whose criterion is this close fit alike (Kass and Raftery, 1995).
const ALIKE: f64 = 6.0;
/// Rows beyond this tell the search nothing new about which cause it is, and cost it time.
const SEARCHED: usize = 800;
/// The error of a reduction ratio whose joint turns the other way.
const REVERSED: f64 = -2.0;
/// The scale of a curve's numbers in medians of their size: twice that of normal ones.
const TYPICAL: f64 = 2.0 * 1.4826;
/// Cosines of a curve of less than two periods over its range are all but geometry, which alone carries on beyond the range: they are
/// held down to this share.
const SLOW: usize = 3;
const GEOMETRY: f64 = 0.2;
/// Rows that count as fewer than this are independent; with fewer stretches than this signs by stretch say nothing.
const ALONE: f64 = 1.2;
const STRETCHES: usize = 40;
/// A repeatability that changes by less than this share is settled.
const SETTLED: f64 = 0.25;

/// The model between rounds.
struct Course {
    model: Model,
    fitted: Fitted,
    screening: Screening,
    chosen: Vec<Chosen>,
}

/// A cause with its coefficients, and what the motor currents say of them.
#[derive(Clone)]
struct Chosen {
    form: Form,
    coefficients: Vec<f64>,
    known: Vec<Prior>,
}

/// Diagnoses a recording; of very few rows only what the nominal robot makes of them. `tell` hears what is going on.
pub fn diagnose(question: &Question, mut tell: impl FnMut(String)) -> Diagnosis {
    let robot = question.robot;
    let mut data = question.data.clone();
    if question.fit.len() < unasked::FEWEST {
        return unasked::not_asked(question);
    }
    let base = base_model(robot, &data, question.fit);
    let rigid = base.stack.effects().count();
    let mut now = fitted((&base, rigid), None, &[], &data, question);
    let free: Vec<usize> = (0..now.fitted.fates.len()).filter(|k| matches!(now.fitted.fates[*k], Fate::Free(_))).collect();
    let spread = spreads(&now.model, &data);
    let mut repeatability = noise::from_repeats(&data, &now.screening.kept, &spread);
    if repeatability.sigma > 0.0 {
        data.spread = Some(scaled(&spread, repeatability.sigma));
        now = fitted((&base, rigid), Some(&free), &[], &data, question);
    }
    let before = now.model.predict(&data);
    tell(format!("{}, {} of the base model estimated", counted(now.screening.kept.len(), "row"), counted(free.len(), "number")));
    let mut asked_residual = false;
    let mut first = None;
    let mut located = None;
    let mut seen: Vec<Vec<Form>> = Vec::new();
    let mut round = 0;
    loop {
        round += 1;
        let looked_at = thinned(&now.screening.kept);
        let yielding = yielding(&now.model);
        let lens = Lens::new(&now.model, &data, &looked_at, yielding.iter().any(|compliance| *compliance > 0.0));
        let alike = alike(&data, &looked_at, &lens);
        let pose = poses(&data, &looked_at, alike);
        let torque = lens.torques();
        let survey = Survey::new(robot, &data, &looked_at, &torque, &yielding);
        let mut pool = pool_of(&lens, &now, &free, &survey).with_alike(alike);
        located.get_or_insert_with(|| locate::locate(&pool, &pool.state(&[]), &survey));
        let options = SearchOptions { seed: question.seed, ..SearchOptions::default() };
        let mut search = Search::new(&mut pool, &survey, &pose, options);
        let mut start: Vec<usize> =
            now.chosen.iter().map(|cause| search.position(Hypothesis::new(cause.form.clone(), 1))).collect();
        start.sort_unstable();
        start.dedup();
        let found = search.run(start);
        first.get_or_insert(found.first);
        let forms: Vec<Form> = found.set.iter().map(|k| search.pool.hypotheses[*k].form.clone()).collect();
        let coefficients: Vec<Vec<f64>> = search.coefficients(&found.set);
        tell(format!("round {round}: {}", told(search.pool.hypotheses.len(), &forms, found.last)));
        let same = same_forms(&forms, &now.chosen);
        // A set that comes back after another goes in circles: both fit alike.
        let circles = !same && seen.contains(&forms);
        seen.push(forms.clone());
        let start = chosen(&lens, forms, coefficients);
        let next = fitted((&now.model, rigid), Some(&free), &start, &data, question);
        let kept_same = next.screening.kept == now.screening.kept;
        let last_round = round >= ROUNDS || circles || now.screening.apart.is_some();
        if same && kept_same && !last_round && repeatability.repeats < REPEATS && !asked_residual && found.last > SIGNIFICANT {
            asked_residual = true;
            let other = noise_of(&next, &data, &spread);
            if (other.sigma - repeatability.sigma).abs() > SETTLED * other.sigma.max(repeatability.sigma) {
                repeatability = Repeatability { sigma: other.sigma, repeats: repeatability.repeats };
                data.spread = (other.sigma > 0.0).then(|| scaled(&spread, other.sigma));
                now = fitted((&next.model, rigid), Some(&free), &start_of(&next), &data, question);
                continue;
            }
        }
        if (same && kept_same) || last_round {
            let mut set = found.set.clone();
            let (last, mut worths) = judge::judge(next, &mut set, search.pool, &free, rigid, &data, question);
            let refit = |now: &Course, chosen: &[Chosen]| fitted((&now.model, rigid), Some(&free), chosen, &data, question);
            let court = Court { pool: search.pool, survey: &survey, data: &data, question, refit: &refit };
            let (last, withdrawn) = withdraw::withdraw(last, &mut set, &mut worths, &court);
            withdrawn.iter().for_each(|sentence| tell(format!("taken back: {sentence}")));
            let rest = if set == found.set { found.last } else { search.gate(&set) };
            let first = first.unwrap_or(1.0);
            let located = located.unwrap_or_default();
            let looked =
                verdict::Looked { pool: search.pool, set, first, last: rest, survey: &survey, worths, withdrawn, located };
            return verdict::conclude(question, &data, &before, &last, repeatability, looked);
        }
        drop(pool);
        now = next;
    }
}

/// A round in a line.
fn told(tried: usize, forms: &[Form], rest: f64) -> String {
    let keys: String = forms.iter().map(|form| format!("; {}", form.key())).collect();
    let causes = counted(forms.len(), "cause");
    format!("{tried} hypotheses, {causes}{keys} (p = {rest:.3} that the rest is noise)")
}

/// The joints' repeatability by what a fit leaves.
fn noise_of(now: &Course, data: &Measurements, spread: &[Matrix3<f64>]) -> Repeatability {
    let rows = &now.screening.kept;
    let predicted = now.model.predict(data);
    let residuals: Vec<_> = rows.iter().map(|row| data.position[*row] - predicted[*row]).collect();
    noise::from_residuals(data, rows, &residuals, spread, now.fitted.singular.len())
}

fn same_forms(a: &[Form], b: &[Chosen]) -> bool {
    a.len() == b.len() && a.iter().all(|form| b.iter().any(|cause| cause.form == *form))
}

/// Causes with their coefficients; what belongs to the torque model also with what the motor currents say of it.
fn chosen(lens: &Lens, forms: Vec<Form>, coefficients: Vec<Vec<f64>>) -> Vec<Chosen> {
    let borrowed: Vec<usize> = (0..forms.len()).filter(|i| forms[*i].is_of_torque_model()).collect();
    let own: Vec<&Form> = borrowed.iter().map(|i| &forms[*i]).collect();
    // The residual is that of the present model; what is asked is the whole number, hence at zero where it is new.
    let opinion = if own.is_empty() { None } else { lens.opinion(&own, &lens.present(&own)) };
    let mut opinion = opinion.unwrap_or_default().into_iter();
    let mut out = Vec::with_capacity(forms.len());
    for (i, (form, coefficients)) in forms.iter().zip(coefficients).enumerate() {
        let known: Vec<Prior> = if borrowed.contains(&i) {
            opinion.by_ref().take(coefficients.len()).collect()
        } else {
            held_down(form, lens.robot, &coefficients)
        };
        out.push(Chosen { form: form.clone(), coefficients, known });
    }
    out
}

/// What keeps the numbers of a free curve small where the data cannot tell, as its slow part, which is nearly geometry, or between
/// sparse points: most of its numbers are of one size (empirical Bayes), and none is larger than is plausible.
fn held_down(form: &Form, robot: &RobotModel, coefficients: &[f64]) -> Vec<Prior> {
    if !form.term().is_some_and(Term::is_own_curve) {
        return Vec::new();
    }
    let mut sizes: Vec<f64> = coefficients.iter().map(|value| value.abs()).collect();
    let middle = sizes.len() / 2;
    let typical = if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 };
    let share = |k: usize| if k < SLOW { GEOMETRY } else { 1.0 };
    let sigma =
        |k: usize, spec: ParameterSpec| (share(k) * spec.prior_sigma.min(TYPICAL * typical)).max(f64::MIN_POSITIVE.sqrt());
    let specs = form.parameters(robot).into_iter().enumerate();
    specs.map(|(k, spec)| Prior { mean: 0.0, sigma: sigma(k, spec) }).collect()
}

/// Causes of a model with their fitted coefficients.
fn start_of(now: &Course) -> Vec<Chosen> {
    let ranges = now.model.stack.effects().map(|(_, range)| range);
    let own = ranges.skip(now.model.stack.effects().count() - now.chosen.len());
    let fitted =
        |(cause, range): (&Chosen, std::ops::Range<usize>)| Chosen { coefficients: now.model.x[range].to_vec(), ..cause.clone() };
    now.chosen.iter().zip(own).map(fitted).collect()
}

/// The base model at its start: the nominal robot, aligned.
fn base_model(robot: &RobotModel, data: &Measurements, rows: &[usize]) -> Model {
    let reversed = sense::reversed(robot, data, rows);
    let mut turned = data.clone();
    reversed.iter().for_each(|joint| sense::reverse(&mut turned, *joint));
    let setting = Setting { base: align(robot, &turned, rows), load: Load::GravityTorque };
    let effects: Vec<Box<dyn Effect>> = identified()
        .filter(|cause| BASE.contains(&cause.name()))
        .filter_map(|cause| cause.whole(&setting))
        .filter(|effect| effect.missing(robot, data).is_none())
        .collect();
    let mut model = Model::nominal(robot.clone(), EffectStack::new(robot, setting.base, effects));
    for joint in reversed {
        let name = format!("{}.j{}", ReductionRatio::NAME, joint + 1);
        if let Some(k) = model.stack.specs().iter().position(|spec| spec.name == name) {
            model.x[k] = REVERSED;
        }
    }
    model
}

/// The first `base` effects of `from` with causes at their coefficients, fitted to the rows that belong.
///
/// `free` are the base parameters to estimate, all of them if `None`.
fn fitted(
    (from, base): (&Model, usize),
    free: Option<&[usize]>,
    causes: &[Chosen],
    data: &Measurements,
    question: &Question,
) -> Course {
    let robot = question.robot;
    // The base starts where it was found, so that its correction is too small to matter to what else moves it.
    let setting = Setting { base: from.base(), load: Load::GravityTorque };
    let rigid: Vec<Box<dyn Effect>> =
        from.stack.effects().take(base).filter_map(|(effect, _)| whole(effect.name(), &setting)).collect();
    let count = rigid.iter().map(|effect| effect.parameters(robot).len()).sum::<usize>();
    let own = causes.iter().map(|cause| Box::new(cause.form.clone()) as Box<dyn Effect>);
    let stack = EffectStack::new(robot, setting.base, rigid.into_iter().chain(own).collect());
    let mut model = Model::nominal(robot.clone(), stack);
    model.x[..count].copy_from_slice(&from.x[..count]);
    if let Some((_, range)) = model.stack.effects().find(|(effect, _)| effect.name() == BaseFrame::NAME) {
        model.x[range].fill(0.0);
    }
    let mut at = count;
    for cause in causes {
        for (k, value) in cause.coefficients.iter().enumerate() {
            model.x[at] = *value;
            if let Some(prior) = cause.known.get(k) {
                model.known.insert(at, Known { prior: Some(*prior), bounds: None });
            }
            at += 1;
        }
    }
    let all: Vec<usize> = (0..count).collect();
    let candidates: Vec<usize> = free.unwrap_or(&all).iter().copied().chain(count..model.x.len()).collect();
    let options = FitOptions { rows: question.fit, candidates: &candidates };
    let (fitted, screening) = fit_screened(&mut model, data, &options, question.set);
    Course { model, fitted, screening, chosen: causes.to_vec() }
}

/// The pool of all causes around the present model: the residual is that without them.
fn pool_of<'a>(lens: &'a Lens<'a>, now: &Course, free: &[usize], survey: &Survey) -> Pool<'a> {
    let jacobian = lens.jacobian(&now.model, free);
    let mut residual = lens.residual.clone();
    for Chosen { form, coefficients, .. } in start_of(now) {
        let columns = lens.columns(&form);
        for (column, coefficient) in columns.chunks(lens.lines()).zip(coefficients) {
            residual.iter_mut().zip(column).for_each(|(value, c)| *value += c * coefficient);
        }
    }
    Pool::new(lens, &jacobian, &residual, crate::effect::hypotheses(survey))
}

/// How far each joint yields in a model, rad/Nm.
fn yielding(model: &Model) -> Vec<f64> {
    let mut out = vec![0.0; model.robot.joints()];
    for (effect, range) in model.stack.effects() {
        if let Some((joint, compliance)) = effect.form().and_then(|form| form.compliance(&model.x[range])) {
            out[joint] += compliance.max(0.0);
        }
    }
    out
}

/// Rows that the search looks at: all but the recording's first, to which nobody knows the way, or [`SEARCHED`] of them by a sequence
/// that keeps no step with any design of the recording; the model is fitted to all.
fn thinned(rows: &[usize]) -> Vec<usize> {
    let rows = rows.strip_prefix(&[0]).unwrap_or(rows);
    if rows.len() <= SEARCHED {
        return rows.to_vec();
    }
    // Multiples of the golden ratio fill the unit interval evenly (Kuipers and Niederreiter, 1974).
    let share = SEARCHED as f64 / rows.len() as f64;
    let chosen = |i: &usize| (*i as f64 * 0.618_033_988_749_895).fract() < share;
    (0..rows.len()).filter(chosen).map(|i| rows[i]).collect()
}

/// How many rows of a moving arm count as one, by what is left; of standing points each is one.
fn alike(data: &Measurements, rows: &[usize], lens: &Lens) -> f64 {
    let alike = if data.in_motion(rows) { rows_alike(&lens.residual[..3 * rows.len()], 3) } else { 1.0 };
    if alike < ALONE { 1.0 } else { alike.min(rows.len() as f64 / STRETCHES as f64).max(1.0) }
}

/// Poses of rows, numbered in order: repeats share one. Where some rows are alike, stretches beyond which what is left is forgotten.
fn poses(data: &Measurements, rows: &[usize], alike: f64) -> Vec<usize> {
    if alike > 1.0 {
        let stretch = ((2.0 * alike).ceil() as usize).min(rows.len() / STRETCHES).max(1);
        return (0..rows.len()).map(|i| i / stretch).collect();
    }
    let mut out = Vec::with_capacity(rows.len());
    let mut number = 0;
    for (i, row) in rows.iter().enumerate() {
        if i > 0 && !data.same_pose(rows[i - 1], *row) {
            number += 1;
        }
        out.push(number);
    }
    out
}

/// Covariance of every row's point per squared joint deviation.
fn spreads(model: &Model, data: &Measurements) -> Vec<Matrix3<f64>> {
    let all: Vec<usize> = (0..data.rows()).collect();
    let lens = Lens::new(model, data, &all, false);
    all.iter().map(|row| noise::by_all(lens.by_joint(*row))).collect()
}

fn scaled(spread: &[Matrix3<f64>], sigma: f64) -> Vec<Matrix3<f64>> {
    spread.iter().map(|matrix| matrix * (sigma * sigma)).collect()
}
