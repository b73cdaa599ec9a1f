//! Whether torques come later than the positions beside them: the fit of base, friction, offset and rotor over a common shift.

use super::noise::NoiseMemory;
use super::noise::{basic_forms, noise_beside};
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::weighted::{Weighing, WeightedColumns};

/// s: least, most, step of the shifts that are tried.
const SHIFTS: [f64; 3] = [-0.016, 0.048, 0.004];
/// s: less is none.
const LEAST: f64 = 0.002;
/// Fall of the whitened squared residual of all joints, per autocorrelation time.
const GAIN: f64 = 60.0;
/// The same of one joint, to agree.
const OWN_GAIN: f64 = 6.0;
/// Share of the joints that must agree.
const AGREEING: f64 = 0.6;

/// A shift and what it gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Latency {
    /// s.
    pub seconds: f64,
    /// s.
    pub sigma: f64,
    /// Fall of the whitened squared residual.
    pub gain: f64,
}

/// The latency, where there is one that most joints agree on.
pub(super) fn latency(problem: &TorqueProblem) -> Option<Latency> {
    let basic = basic_forms(problem);
    let (noise, _) = noise_beside(problem, &basic, NoiseMemory::Short);
    let runs = problem.runs(false);
    let weighing = Weighing {
        noise: &noise,
        runs: &runs,
    };
    let mut chosen: Vec<usize> = (0..problem.all.base)
        .chain(basic.iter().flat_map(|form| problem.all.of(*form)))
        .collect();
    chosen.sort_unstable();
    let weighted = WeightedColumns::new(&problem.all, &problem.measured, weighing, &chosen);
    let left_at = |shift: f64| {
        let mut weighted = weighted.with_measured(weighing.measured(&problem.difference(shift)));
        let solution = SweptColumns::base(&problem.all, &weighted)
            .with(&basic)
            .solution();
        weighted.subtract(&solution);
        weighted
            .measured
            .iter()
            .map(|course| course.iter().map(|value| value * value).sum())
            .collect::<Vec<f64>>()
    };
    let steps = ((SHIFTS[1] - SHIFTS[0]) / SHIFTS[2]).round() as usize;
    let shifts: Vec<f64> = (0..=steps)
        .map(|step| SHIFTS[0] + SHIFTS[2] * step as f64)
        .collect();
    let left: Vec<Vec<f64>> = shifts.iter().map(|shift| left_at(*shift)).collect();
    let total: Vec<f64> = left.iter().map(|joints| joints.iter().sum()).collect();
    let least = (0..total.len()).min_by(|a, b| total[*a].total_cmp(&total[*b]))?;
    // What is least at an end would be less beyond it.
    if least == 0 || least == total.len() - 1 {
        return None;
    }
    let unmoved = (0..shifts.len()).min_by(|a, b| shifts[*a].abs().total_cmp(&shifts[*b].abs()))?;
    let curvature = total[least + 1] - 2.0 * total[least] + total[least - 1];
    let aside = if curvature > 0.0 {
        0.5 * (total[least - 1] - total[least + 1]) / curvature
    } else {
        0.0
    };
    let seconds = shifts[least] + SHIFTS[2] * aside.clamp(-1.0, 1.0);
    let gain = total[unmoved] - total[least];
    let agreeing = (0..problem.joints())
        .filter(|joint| left[unmoved][*joint] - left[least][*joint] > OWN_GAIN)
        .count();
    let needed = ((AGREEING * problem.joints() as f64).ceil() as usize).max(2);
    let sigma = SHIFTS[2] * (2.0 / curvature.max(f64::MIN_POSITIVE)).sqrt();
    (gain > GAIN && agreeing >= needed && seconds > LEAST).then_some(Latency {
        seconds,
        sigma,
        gain,
    })
}
