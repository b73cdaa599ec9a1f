//! What has no name: forms without one that held-out rows do not confirm, and joints of which the named causes leave too much.

use super::cause::{COULOMB, TORQUE_CAUSES, UNKNOWN, VISCOUS};
use super::choice::CauseChoice;
use super::findings::plain_finding;
use super::noise::JointNoise;
use super::sweep::SweptColumns;
use super::types::TorqueFinding;
use crate::diagnose::RivalCause;
use crate::effect::Place;
use crate::statistics::nearest;
use std::ops::Range;

/// Standard deviations of the mean square of noise.
const DEVIATIONS: f64 = 3.0;
/// Residual over the noise, of fitted and of held-out rows, above which something is left at a joint.
const LEFT: f64 = 1.2;
/// Two torques cancel that are together less than this share of either.
const CANCELLED: f64 = 0.5;
/// Standard deviations from which on something is shown.
const SHOWN: f64 = 2.0;
/// Times what is left that a name must explain: less than two thirds of what stands at a joint is no explanation.
const EXPLAINED: f64 = 2.0;

/// Something without a name of which held-out rows confirm that it is there, though not its shape: what they leave at its joint stands
/// above the noise.
pub(super) fn unconfirmed(choice: &CauseChoice, withdrawn: &[(usize, f64)], residual: &[Vec<f64>]) -> Vec<TorqueFinding> {
    let problem = choice.problem;
    let runs = problem.runs(true);
    let errors = problem.weighing(&runs).measured(residual);
    let mut found: Vec<TorqueFinding> = Vec::new();
    for form in withdrawn.iter().map(|(number, _)| choice.form(*number)).filter(|form| form.cause.name() == UNKNOWN) {
        let own = &errors[form.joint()];
        let rows = own.len() as f64;
        let above = own.iter().map(|error| error * error).sum::<f64>() / rows - 1.0;
        if above < DEVIATIONS * (2.0 / rows).sqrt() || found.iter().any(|known| known.place == form.place) {
            continue;
        }
        let statement = format!(
            "something without a name acts at {}: held-out rows are {:.0} % further off than noise, of a shape that they do not confirm",
            form.place,
            100.0 * ((1.0 + above).sqrt() - 1.0)
        );
        found.push(plain_finding(UNKNOWN, form.place, statement, Vec::new(), above * rows, form.width as f64));
    }
    found
}

/// "None of the list" competes with each name: where the causes of a joint leave more than noise and explain less than two thirds of what
/// stands there, it is something without a name, with theirs as rivals; where there are none, too.
pub(super) fn unname(choice: &CauseChoice, residual: &[Vec<f64>], found: &mut Vec<TorqueFinding>) {
    let problem = choice.problem;
    let (fitted, held_out) = (problem.runs(false), problem.runs(true));
    let shape = usual_shape(residual, &fitted);
    for (joint, course) in residual.iter().enumerate() {
        let noise = &problem.noise[joint];
        let here = |finding: &TorqueFinding| finding.place == Place::Joint(joint) && is_judged(finding.effect);
        // A torque that lasts spoils the noise of its own joint: what is new in a row, and how long noise lasts at the others, tell what
        // noise would be. Where nothing is named, a joint may have a noise of its own.
        let expected = match found.iter().any(here) {
            true => noise.sigma.min(JointNoise::of(course, &fitted, 0.0).innovation * shape),
            false => noise.sigma,
        };
        let over = |runs: &[Range<usize>]| JointNoise::of(course, runs, 0.0).sigma / expected;
        if over(&fitted) < LEFT || (!held_out.is_empty() && over(&held_out) < LEFT) {
            continue;
        }
        let rows = fitted.iter().map(Range::len).sum::<usize>() as f64 / noise.autocorrelation().max(1.0);
        let left = rows * (over(&fitted).powi(2) - 1.0);
        let explained: f64 = found.iter().filter(|finding| here(finding)).map(|finding| finding.evidence.gain).sum();
        if explained > EXPLAINED * left || found.iter().any(|known| known.effect == UNKNOWN && known.place == Place::Joint(joint))
        {
            continue;
        }
        let (names, others): (Vec<TorqueFinding>, Vec<TorqueFinding>) = found.drain(..).partition(here);
        *found = others;
        found.push(without_name(joint, left, over(&fitted), names));
    }
}

/// A curve over the joint's angle that a nameless one of the same joint nearly cancels is a part of it: together they are one torque.
pub(super) fn absorb(choice: &CauseChoice, set: &[usize], solution: &[(usize, f64)], found: &mut Vec<TorqueFinding>) {
    let torque = |numbers: &[usize], joint: usize| {
        let columns: Vec<usize> = numbers.iter().flat_map(|number| choice.problem.all.of(*number)).collect();
        let own: Vec<(usize, f64)> = solution.iter().copied().filter(|(column, _)| columns.contains(column)).collect();
        choice.problem.predicted(&own).swap_remove(joint).iter().map(|value| value * value).sum::<f64>()
    };
    let nameless = set.iter().copied().filter(|number| choice.form(*number).cause.name() == UNKNOWN);
    for unnamed in nameless.collect::<Vec<usize>>() {
        let (place, joint) = (choice.form(unnamed).place, choice.form(unnamed).joint());
        for curve in set.iter().copied() {
            let form = choice.form(curve);
            if form.place != place || !form.cause.about().of_angle {
                continue;
            }
            let [one, other, both] = [vec![unnamed], vec![curve], vec![unnamed, curve]].map(|numbers| torque(&numbers, joint));
            if both > CANCELLED * CANCELLED * one.min(other) {
                continue;
            }
            found.retain(|finding| finding.effect != form.cause.name() || finding.place != place);
        }
    }
}

/// Coulomb friction that is left nowhere once a nameless drag that changes with the joint's angle is least is a part of it.
pub(super) fn absorb_drag(choice: &CauseChoice, set: &[usize], uncertain: &SweptColumns, found: &mut Vec<TorqueFinding>) {
    let solution = uncertain.solution();
    let all = &choice.problem.all;
    let column_of = |number: usize| all.of(number).start;
    let value = |column: usize| solution.iter().find(|(pivot, _)| *pivot == column).map_or(0.0, |(_, value)| *value);
    let is_drag = |number: &&usize| {
        let cause = choice.form(**number).cause;
        cause.name() == UNKNOWN && cause.about().modifies == [COULOMB]
    };
    for drag in set.iter().filter(is_drag) {
        let place = choice.form(*drag).place;
        let is_coulomb = |number: &&usize| choice.form(**number).cause.name() == COULOMB && choice.form(**number).place == place;
        let Some(coulomb) = set.iter().find(is_coulomb) else { continue };
        let columns = [column_of(*coulomb), column_of(*drag), column_of(*drag) + 1];
        let [whole, cosine, sine] = columns.map(value);
        let amplitude = cosine.hypot(sine).max(f64::MIN_POSITIVE);
        // What is least of friction over a turn, with its variance.
        let slope = [1.0, -cosine / amplitude, -sine / amplitude];
        let covariance = uncertain.covariance(&columns);
        let variance: f64 = (0..9).map(|entry| slope[entry / 3] * slope[entry % 3] * covariance[entry]).sum();
        if whole - amplitude < SHOWN * variance.max(0.0).sqrt() {
            found.retain(|finding| finding.effect != COULOMB || finding.place != place);
        }
    }
}

/// Standard deviation of a residual over that of what is new in a row, as most joints have it.
fn usual_shape(residual: &[Vec<f64>], runs: &[Range<usize>]) -> f64 {
    let of = |course: &Vec<f64>| {
        let own = JointNoise::of(course, runs, 0.0);
        own.sigma / own.innovation
    };
    nearest(&mut residual.iter().map(of).collect::<Vec<f64>>(), 0.5).unwrap_or(1.0)
}

/// Whether a name is of neither viscous nor Coulomb friction, which nearly every joint has, nor of a wrong mass.
fn is_judged(effect: &str) -> bool {
    let is_inertial = TORQUE_CAUSES.iter().any(|cause| cause.name() == effect && cause.about().inertial);
    ![VISCOUS, COULOMB, UNKNOWN].contains(&effect) && !is_inertial
}

/// Something at a joint, with the names that explain a part of it.
fn without_name(joint: usize, left: f64, over: f64, mut names: Vec<TorqueFinding>) -> TorqueFinding {
    names.sort_by(|a, b| b.evidence.gain.total_cmp(&a.evidence.gain));
    let place = Place::Joint(joint);
    let known: Vec<&str> = names.iter().map(|finding| finding.effect).collect();
    let part = match known.is_empty() {
        true => "no cause that is known explains any of it".into(),
        false => format!("{} explains a part of it", known.join(" and ").replace('_', " ")),
    };
    let statement = format!("something without a name acts at {place}: {over:.1} times the noise is left there; {part}");
    let mut finding = plain_finding(UNKNOWN, place, statement, Vec::new(), left, 1.0);
    for name in names {
        // Names share what the nameless leaves them.
        let own = RivalCause { effect: name.effect, place, delta_bic: 0.0, probability: 0.3 * name.probabilities.name };
        finding.rivals.extend(std::iter::once(own).chain(name.rivals));
        finding.evidence.gain = finding.evidence.gain.max(name.evidence.gain);
        finding.evidence.effect_rms = finding.evidence.effect_rms.max(name.evidence.effect_rms);
        finding.evidence.heldout_gain = finding.evidence.heldout_gain.or(name.evidence.heldout_gain);
    }
    let rivals: f64 = finding.rivals.iter().map(|rival| rival.probability).sum();
    if rivals > 0.0 {
        let share = 0.4 / rivals.max(0.4);
        finding.rivals.iter_mut().for_each(|rival| rival.probability *= share);
        finding.probabilities.name -= rivals * share;
    }
    finding
}
