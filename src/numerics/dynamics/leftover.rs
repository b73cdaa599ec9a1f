//! What has no name yet: a joint whose residual lasts from row to row although every smooth named form was in the model that noise was
//! taken from.
//!
//! Its noise is spoilt by the very torque that is looked for, so a form is judged by the likelihood of the residual under an
//! autoregressive course of its own, with and without it.

use super::cause::TorqueForm;
use super::choice::CauseChoice;
use super::noise::JointNoise;

/// Judged rows that count as one, from which on a joint is suspected.
const SUSPECT: f64 = 5.0;
/// Forms of a joint that are compared, those of the largest gain.
const COMPARED: usize = 8;
/// What a form must gain beyond its penalty.
const GAIN: f64 = 20.0;

/// The form that explains most of what lasts at some joint, beside a set.
pub(super) fn lasting_form(choice: &CauseChoice, set: &[usize]) -> Option<usize> {
    let (problem, sweep) = (choice.problem, choice.base.with(set));
    let runs = problem.runs(false);
    let residual = problem.residual(&sweep.solution());
    let mut best: Option<(f64, usize)> = None;
    for (joint, course) in residual.iter().enumerate() {
        let now = JointNoise::of(course, &runs, 0.0);
        if now.autocorrelation() < SUSPECT {
            continue;
        }
        let here = |form: &TorqueForm| form.place == crate::effect::Place::Joint(joint);
        let mut forms: Vec<(f64, usize)> = (0..choice.open)
            .filter(|number| here(choice.form(*number)) && choice.may_join(*number, set))
            .map(|number| (sweep.gain(number).square, number))
            .collect();
        forms.sort_by(|a, b| b.0.total_cmp(&a.0));
        forms.truncate(COMPARED);
        for (_, number) in forms {
            let with: Vec<usize> = set.iter().copied().chain([number]).collect();
            let left = problem.residual(&choice.base.with(&with).solution());
            let then = JointNoise::of(&left[joint], &runs, 0.0);
            let rank = choice.form(number).width;
            let gain = 2.0 * choice.weighted.rows as f64 * (now.innovation / then.innovation).ln() - choice.penalty(number, rank);
            if gain > GAIN && best.is_none_or(|(known, _)| gain > known) {
                best = Some((gain, number));
            }
        }
    }
    best.map(|(_, number)| number)
}
