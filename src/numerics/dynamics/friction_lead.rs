//! By how much friction turns before the velocity does: friction that a simulator lets a solver find turns with velocity and
//! acceleration, and velocities that a drive smooths lag behind the friction that it feels.

use super::problem::TorqueProblem;
use super::sign_width::{FrictionFit, own_sign_widths, sign_width};

/// s: most on either side, and the first step.
const MOST: f64 = 0.024;
const STEP: f64 = 0.004;
/// s: steps about the best of the grid.
const STEPS: [f64; 4] = [0.002, 0.001, 0.0005, 0.00025];
/// Steps of STEP on either side by which lead and latency are moved together: friction alone tells only their difference.
const TOGETHER: i32 = 4;
/// s: less is none; two that differ by less are one.
const LEAST: f64 = 0.001;
const SAME: f64 = 2e-4;
/// Fall of rows times the logarithm of the mean square, over all joints; residuals last over some rows.
const GAIN: f64 = 200.0;
/// The same of moving the latency too.
const MOVED_GAIN: f64 = 30.0;
/// The same of one joint, to agree.
const OWN_GAIN: f64 = 10.0;
/// Share of the joints that must agree.
const AGREEING: f64 = 0.6;

/// What is left, by which lead and by what change of the latency, s.
type Best = (f64, f64, f64);

/// Looks in finer steps about the best lead.
fn finer(try_lead: &mut dyn FnMut(f64, f64, &mut Best), best: &mut Best) {
    for step in STEPS {
        let (_, about, moved) = *best;
        [about - step, about + step]
            .iter()
            .for_each(|lead| try_lead(*lead, moved, best));
    }
}

/// Takes the lead that most joints agree on, 0 where they do not, with the width of the sign beside it; tells whether it is another than
/// before.
pub(super) fn take_friction_lead(problem: &mut TorqueProblem) -> bool {
    let (before, latency) = (problem.scene.friction_lead, problem.latency);
    let mut fit = FrictionFit::new(problem);
    let rows = fit.rows() as f64;
    let mut left_by = |problem: &mut TorqueProblem, lead: f64, moved: f64| {
        problem.scene.friction_lead = lead;
        fit.take(&problem.difference(latency + moved));
        fit.left(problem)
    };
    let unmoved = left_by(problem, 0.0, 0.0);
    let mut best: Best = (unmoved.iter().sum(), 0.0, 0.0);
    let mut try_lead = |lead: f64, moved: f64, best: &mut Best| {
        let left = left_by(problem, lead, moved).iter().sum::<f64>();
        if left < best.0 {
            *best = (left, lead, moved);
        }
    };
    let steps = (MOST / STEP).round() as i32;
    (-steps..=steps)
        .filter(|step| *step != 0)
        .for_each(|step| try_lead(STEP * f64::from(step), 0.0, &mut best));
    finer(&mut try_lead, &mut best);
    let alone = best;
    let moves = (-TOGETHER..=TOGETHER)
        .filter(|step| *step != 0)
        .map(|step| STEP * f64::from(step));
    moves
        .filter(|moved| latency + moved >= 0.0)
        .for_each(|moved| try_lead(alone.1 + moved, moved, &mut best));
    if (alone.0 - best.0) * rows < MOVED_GAIN {
        best = alone;
    } else {
        finer(&mut try_lead, &mut best);
    }
    let left = left_by(problem, best.1, best.2);
    let gains: Vec<f64> = unmoved
        .iter()
        .zip(&left)
        .map(|(unmoved, left)| rows * (unmoved - left))
        .collect();
    let agreeing = gains.iter().filter(|gain| **gain > OWN_GAIN).count();
    let needed = ((AGREEING * gains.len() as f64).ceil() as usize).max(2);
    let is_one = (LEAST..MOST - SAME).contains(&best.1.abs())
        && gains.iter().sum::<f64>() > GAIN
        && agreeing >= needed;
    let found = if is_one { best.1 } else { 0.0 };
    let is_new = (found - before).abs() > SAME;
    problem.scene.friction_lead = if is_new { found } else { before };
    if is_new {
        let width = sign_width(problem);
        problem.scene.turn_over(width);
        if is_one {
            // A solver lets friction turn over an acceleration: the lighter a joint, the wider.
            let own = own_sign_widths(problem);
            problem.scene.turn_each_over(own);
        }
    }
    is_new
}

#[cfg(test)]
mod tests {
    use super::super::cases::{arm, record};
    use super::super::{TorqueQuestion, diagnose};

    /// s.
    const LEAD: f64 = 0.0095;

    #[test]
    fn friction_that_turns_before_the_velocity_is_plain_friction_with_its_lead() {
        // As a solver lets it, rad/s.
        let widths = [0.001, 0.002, 0.006, 0.03];
        let soft = |(joint, _, _, velocity, acceleration, _): (usize, f64, f64, f64, f64, f64)| {
            3.0 * velocity
                + 8.0 * ((velocity + LEAD * acceleration) / widths[joint]).clamp(-1.0, 1.0)
        };
        let diagnosis = diagnose(
            &arm(),
            &record(&arm(), 0.0, &soft),
            &TorqueQuestion::default(),
            &mut |_| (),
        )
        .unwrap();
        let others = diagnosis
            .findings
            .iter()
            .filter(|finding| !["viscous_friction", "coulomb_friction"].contains(&finding.effect));
        let others = others.map(|finding| finding.statement.clone());
        let (lead, others) = (
            diagnosis.model.friction_lead,
            others.collect::<Vec<String>>(),
        );
        assert!(
            (lead - LEAD).abs() < 0.001 && others.is_empty(),
            "{lead}: {others:?}"
        );
    }
}
