//! Noise and its autocorrelation, from what a rich model leaves: the base and every smooth named form once, whether it acts or not.
//!
//! Noise taken from the present model would be full of the very torque that is looked for.

use super::cause::{COULOMB, OFFSET, ROTOR, VISCOUS};
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::weighted::{Weighing, WeightedColumns};
use crate::criteria::cells::FAR;
use crate::statistics::nearest;
use crate::weighted::{JointNoise, NoiseMemory};
use std::ops::Range;

/// Scale and weights find each other in so many rounds.
const ROUNDS: usize = 4;
/// Standard deviation over the median of absolute values, of normal noise.
const MEDIAN: f64 = 1.4826;

/// The rich model's forms, and those of `set`.
pub(super) fn rich_forms(problem: &TorqueProblem, set: &[usize]) -> Vec<usize> {
    let forms = &problem.all.forms;
    let mut rich = set.to_vec();
    rich.extend(
        (0..forms.len())
            .filter(|form| (forms[*form].cause.rich)(&forms[*form]) && !set.contains(form)),
    );
    rich
}

/// What hardly an arm is without.
pub(super) fn basic_forms(problem: &TorqueProblem) -> Vec<usize> {
    let forms = &problem.all.forms;
    let is_basic = |form: &usize| {
        let form = &forms[*form];
        form.width == 1 && [VISCOUS, COULOMB, OFFSET, ROTOR].contains(&form.cause.name)
    };
    (0..problem.all.listed).filter(is_basic).collect()
}

/// Noise of each joint and the residual of a fit of the base and some forms to the fitted rows.
pub(super) fn noise_of_fit(
    problem: &TorqueProblem,
    forms: &[usize],
    memory: NoiseMemory,
) -> (Vec<JointNoise>, Vec<Vec<f64>>) {
    let runs = problem.runs(false);
    let mut chosen: Vec<usize> = (0..problem.all.base)
        .chain(forms.iter().flat_map(|form| problem.all.of(*form)))
        .collect();
    chosen.sort_unstable();
    let mut noise: Vec<JointNoise> = problem
        .measured
        .iter()
        .map(|course| JointNoise::white(robust_sigma(course, &runs)))
        .collect();
    let mut residual = Vec::new();
    for _ in 0..ROUNDS {
        let weighing = Weighing {
            noise: &noise,
            runs: &runs,
        };
        let weighted = WeightedColumns::new(&problem.all, &problem.measured, weighing, &chosen);
        let sweep = SweptColumns::base(&problem.all, &weighted).with(forms);
        residual = problem.residual(&sweep.solution());
        noise = residual
            .iter()
            .map(|course| JointNoise::white(robust_sigma(course, &runs)))
            .collect();
    }
    let spent = chosen.len() as f64 / problem.joints() as f64;
    (
        residual
            .iter()
            .map(|course| JointNoise::of(course, &runs, spent, memory))
            .collect(),
        residual,
    )
}

/// Noise by which what is found is weighed in the end: what the rich model leaves has lost its slow part with what is slow in that model, so
/// that its course is that of what a set leaves.
pub(super) fn noise_left(problem: &TorqueProblem, set: &[usize]) -> Vec<JointNoise> {
    let left = noise_of_fit(problem, set, NoiseMemory::Long).0;
    let rich = problem.noise.iter();
    rich.zip(left)
        .map(|(rich, left)| JointNoise {
            sigma: rich.sigma,
            ..left
        })
        .collect()
}

/// Noise of a residual without the rows that stand far out: a push is none.
pub(super) fn noise_apart(problem: &TorqueProblem, residual: &[Vec<f64>]) -> Vec<JointNoise> {
    let runs = problem.runs(false);
    let of_course = |course: &Vec<f64>| {
        let rows = runs.iter().flat_map(|run| &course[run.clone()]);
        let mut sizes: Vec<f64> = rows.map(|value| value.abs()).collect();
        let most = *FAR * MEDIAN * nearest(&mut sizes, 0.5).unwrap_or(0.0);
        let near = |run: &Range<usize>| {
            let rows = run.clone().collect::<Vec<usize>>();
            let parts = rows.split(|row| course[*row].abs() > most);
            let ends = parts.filter_map(|part| Some(*part.first()?..part.last()? + 1));
            ends.collect::<Vec<Range<usize>>>()
        };
        let near: Vec<Range<usize>> = runs.iter().flat_map(near).collect();
        JointNoise::of(course, &near, 0.0, NoiseMemory::Short)
    };
    residual.iter().map(of_course).collect()
}

/// Half of the mean square, half of the median: neither outliers alone nor their absence decides.
fn robust_sigma(course: &[f64], runs: &[Range<usize>]) -> f64 {
    let rows = || runs.iter().flat_map(|run| course[run.clone()].iter());
    let count = rows().count().max(1) as f64;
    let square = rows().map(|value| value * value).sum::<f64>() / count;
    let mut sizes: Vec<f64> = rows().map(|value| value.abs()).collect();
    let middle = MEDIAN * nearest(&mut sizes, 0.5).unwrap_or(0.0);
    (0.5 * square + 0.5 * middle * middle).sqrt() + 1e-9
}
