//! How much later torques come than the positions of their rows, and by how much friction turns before the velocity does: friction that a
//! simulator lets a solver find turns with velocity and acceleration, and velocities that a drive smooths lag behind the friction that it feels.

use super::columns::TorqueColumn;
use super::problem::{TorqueProblem, basic_forms, noise_of_fit};
use super::recording::{add, square};
use super::refine::{FrictionFit, take_sign_widths};
use super::sweep::SweptColumns;
use super::weighted::{NoiseMemory, Weighing};

/// s: least, most, step of the shifts that are tried.
const SHIFTS: [f64; 3] = [-0.016, 0.048, 0.004];
/// s: less is none.
const LEAST: f64 = 0.002;
/// Fall of the whitened squared residual of all joints, per autocorrelation time.
const GAIN: f64 = 60.0;
/// The same of one joint, to agree.
const JOINT_GAIN: f64 = 6.0;
/// Share of the joints that must agree.
const AGREEING: f64 = 0.6;

/// A shift and what it gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Latency {
    /// s.
    pub(crate) seconds: f64,
    /// s.
    pub(crate) sigma: f64,
    /// Fall of the whitened squared residual.
    pub(crate) gain: f64,
}

impl TorqueProblem<'_> {
    /// Adds a column of the base for the time shift of each joint's torque, held at zero for now. Where masses are identified, held-out rows are
    /// predicted better without it (a UR10: 0.103 of the torques' rms against 0.109).
    pub(super) fn hold_shifts(&mut self) {
        if self.scene.declared.is_some() || self.scene.beyond.is_some() {
            for joint in 0..self.joints() {
                self.all.take_held(self.come_later(joint));
            }
        }
    }

    /// Nm per s by which the torque of a joint comes later.
    fn come_later(&self, joint: usize) -> TorqueColumn {
        let step = 0.5 / self.scene.rate;
        let [mut course, before] =
            [step, -step].map(|step| self.torque_at(joint, self.latency + step));
        add(&mut course, -1.0, &before);
        course.iter_mut().for_each(|value| *value /= -2.0 * step);
        TorqueColumn {
            joints: vec![joint],
            courses: vec![course],
        }
    }

    /// Lets the torque of each joint shift in time by less than what counts as a latency: a command that is held until the next row acts half
    /// a period later than its row, which a fit would otherwise take for friction.
    pub(super) fn let_come_later(&mut self) {
        let first = self.all.base_changes.len();
        for joint in 0..self.all.base - first {
            self.all.columns[first + joint] = self.come_later(joint);
            self.all.prior[first + joint] = LEAST.powi(-2);
        }
    }
}

/// Whether so many joints gain enough that all of them have it.
fn agree(gains: impl ExactSizeIterator<Item = f64>, least: f64) -> bool {
    let needed = ((AGREEING * gains.len() as f64).ceil() as usize).max(2);
    gains.filter(|gain| *gain > least).count() >= needed
}

/// The latency, where there is one that most joints agree on.
pub(super) fn latency(problem: &TorqueProblem) -> Option<Latency> {
    let basic = basic_forms(problem);
    let (noise, _) = noise_of_fit(problem, &basic, NoiseMemory::Short);
    let runs = problem.runs(false);
    let weighing = Weighing {
        noise: &noise,
        runs: &runs,
    };
    let weighted = problem.weighted_by(weighing, &basic);
    let left_at = |shift: f64| -> Vec<f64> {
        let mut weighted = weighted.with_measured(weighing.measured(&problem.difference(shift)));
        let sweep = SweptColumns::base(&problem.all, &weighted).with(&basic);
        let solution = sweep.solution();
        weighted.subtract(&solution);
        weighted
            .measured
            .iter()
            .map(|course| square(course))
            .collect()
    };
    let steps = ((SHIFTS[1] - SHIFTS[0]) / SHIFTS[2]).round() as usize;
    let shift = |step: usize| SHIFTS[0] + SHIFTS[2] * step as f64;
    let shifts: Vec<f64> = (0..=steps).map(shift).collect();
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
    let gains = (0..problem.joints()).map(|joint| left[unmoved][joint] - left[least][joint]);
    let agreed = agree(gains, JOINT_GAIN);
    let sigma = SHIFTS[2] * (2.0 / curvature.max(f64::MIN_POSITIVE)).sqrt();
    (gain > GAIN && agreed && seconds > LEAST).then_some(Latency {
        seconds,
        sigma,
        gain,
    })
}

/// s: most on either side, and the first step.
const LATEST: f64 = 0.024;
const STEP: f64 = 0.004;
/// s: steps about the best of the grid.
const STEPS: [f64; 4] = [0.002, 0.001, 0.0005, 0.00025];
/// Steps of STEP on either side by which lead and latency are moved together: friction alone tells only their difference.
const TOGETHER: i32 = 4;
/// s: less is none; two that differ by less are one.
const LEAST_LEAD: f64 = 0.001;
const SAME: f64 = 2e-4;
/// Fall of rows times the logarithm of the mean square, over all joints; residuals last over some rows.
const LEAD_GAIN: f64 = 200.0;
/// The same of moving the latency too.
const MOVED_GAIN: f64 = 30.0;
/// The same of one joint, to agree.
const JOINT_LEAD_GAIN: f64 = 10.0;

/// Residual, lead, and change of the latency, s.
type Best = (f64, f64, f64);

/// Looks in finer steps about the best lead.
fn finer(try_lead: &mut dyn FnMut(f64, f64, &mut Best), best: &mut Best) {
    for step in STEPS {
        let (_, about, moved) = *best;
        for lead in [about - step, about + step] {
            try_lead(lead, moved, best);
        }
    }
}

/// Takes the lead that most joints agree on, 0 where they do not, with the width of the sign for it; tells whether it is another than
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
    let steps = |most: i32| {
        let either = (-most..=most).filter(|step| *step != 0);
        either.map(|step| STEP * f64::from(step))
    };
    for lead in steps((LATEST / STEP).round() as i32) {
        try_lead(lead, 0.0, &mut best);
    }
    finer(&mut try_lead, &mut best);
    let alone = best;
    for moved in steps(TOGETHER).filter(|moved| latency + moved >= 0.0) {
        try_lead(alone.1 + moved, moved, &mut best);
    }
    if (alone.0 - best.0) * rows < MOVED_GAIN {
        best = alone;
    } else {
        finer(&mut try_lead, &mut best);
    }
    let left = left_by(problem, best.1, best.2);
    let gains = unmoved.iter().zip(&left);
    let gains: Vec<f64> = gains
        .map(|(unmoved, left)| rows * (unmoved - left))
        .collect();
    let is_one = (LEAST_LEAD..LATEST - SAME).contains(&best.1.abs())
        && gains.iter().sum::<f64>() > LEAD_GAIN
        && agree(gains.iter().copied(), JOINT_LEAD_GAIN);
    let found = if is_one { best.1 } else { 0.0 };
    let is_new = (found - before).abs() > SAME;
    problem.scene.friction_lead = if is_new { found } else { before };
    if is_new {
        // A solver lets friction turn over an acceleration: the lighter a joint, the wider.
        take_sign_widths(problem, is_one);
    }
    is_new
}
