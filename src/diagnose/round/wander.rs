//! Whether what changes slowly is a cause that follows time, or noise that lasts from point to point.
//!
//! Two explanations of the same residual are compared by likelihood and number of parameters: all causes with noise as it is believed, and the
//! causes that do not follow time with noise that lasts. Searched causes take a part of what wanders with them, so that what they leave
//! alone would show too little of it.

use super::fit_state::{FitState, Fitter};
use super::stretches::thinned;
use crate::diagnose::pool::{orthonormal, project};
use crate::diagnose::whitened::{Memory, WhitenedProblem};
use crate::effect::{Form, Variable};
use faer::Mat;

/// The criterion must be better by this much for another belief: strong evidence (Kass and Raftery, 1995), doubled.
const PLAIN: f64 = 20.0;

/// What noise does from row to row (nothing: `Some(None)`), if the settled model shows it to be otherwise than believed.
pub(crate) fn memory_left_by(settled: &FitState, fitter: &Fitter) -> Option<Option<Memory>> {
    if !fitter.may_recall(settled) {
        return None;
    }
    let problem = WhitenedProblem::new(&settled.model, &fitter.data, thinned(&settled.screening.kept));
    let n = problem.residual_rows() as f64;
    let cost = |residual: &[f64], memory: Option<Memory>| {
        memory.unwrap_or(Memory::NONE).cost(residual, &problem.rows) + n.ln() * if memory.is_some() { 2.0 } else { 0.0 }
    };
    let slow: Vec<bool> = settled.causes.iter().map(|cause| follows_time(&cause.form)).collect();
    let with_all = residual(&problem, settled, fitter, &vec![true; slow.len()]);
    let numbers: usize =
        settled.causes.iter().zip(&slow).filter(|(_, slow)| **slow).map(|(cause, _)| cause.coefficients.len() + 1).sum();
    let price = n.ln() * numbers as f64;
    let believed = cost(&with_all, fitter.memory) + price;
    let mut best = Memory::all().map(|memory| (cost(&with_all, memory) + price, memory)).min_by(|a, b| a.0.total_cmp(&b.0))?;
    if slow.contains(&true) {
        let kept: Vec<bool> = slow.iter().map(|slow| !slow).collect();
        let without = residual(&problem, settled, fitter, &kept);
        let other = Memory::all().map(|memory| (cost(&without, memory), memory)).min_by(|a, b| a.0.total_cmp(&b.0))?;
        if other.0 < best.0 && other.1.is_some() {
            best = other;
        }
    }
    (best.0 < believed - PLAIN && best.1 != fitter.memory).then_some(best.1)
}

fn follows_time(form: &Form) -> bool {
    form.variables().contains(&Variable::Time)
}

/// What the base model and the `kept` causes leave of the points, all of them estimated anew in a linear picture.
fn residual(problem: &WhitenedProblem, settled: &FitState, fitter: &Fitter, kept: &[bool]) -> Vec<f64> {
    let rows = problem.residual_rows();
    let mut residual = problem.of_points().to_vec();
    let base = problem.jacobian(fitter.free());
    let mut columns: Vec<f64> = (0..base.ncols()).flat_map(|j| base.col_as_slice(j).to_vec()).collect();
    for (cause, kept) in settled.causes.iter().zip(kept) {
        let own = problem.columns(&cause.form);
        if *kept {
            columns.extend(own);
            continue;
        }
        for (column, coefficient) in own.chunks(rows).zip(&cause.coefficients) {
            residual.iter_mut().zip(column).for_each(|(value, c)| *value += c * coefficient);
        }
    }
    let all = Mat::from_fn(rows, columns.len() / rows, |i, j| columns[j * rows + i]);
    project(orthonormal(&all).as_ref(), &mut residual);
    Memory::without_gross(&mut residual);
    residual
}
