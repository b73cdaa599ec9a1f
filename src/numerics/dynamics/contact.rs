//! Pushes on the arm: times whose residual stands far above the rest and which one force at the tool explains.

use super::problem::TorqueProblem;
use super::types::ContactEvent;
use super::weighted::JointNoise;
use crate::criteria::torque::{
    PUSH_APART, PUSH_AVERAGED, PUSH_DEVIATIONS, PUSH_FEWEST, PUSH_GAIN, PUSH_MOVING, PUSH_OTHERS,
    PUSH_OTHERS_GAIN, PUSH_SHARE, PUSH_TIMES_USUAL, PUSHES,
};
use crate::statistics::nearest;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// s that are tried.
const DURATIONS: [f64; 6] = [0.6, 0.9, 1.2, 1.6, 2.0, 2.6];
/// Share of a push in which it rises and falls: all of it, or one that is held between.
const TAPERS: [f64; 3] = [1.0, 0.4, 0.1];
/// s: nothing shorter is a push, arms are pushed for about a second.
const SHORTEST: f64 = 0.3;
/// s about the highest point that are tried as middles: steps on either side, and their length.
const STEPS: i32 = 6;
const STEP: f64 = 0.1;
/// s by which start and end are then moved, so many steps on either side.
const FINE: [f64; 2] = [0.08, 0.02];
const FINE_STEPS: i32 = 3;

/// Noise by how many rows count as one.
#[derive(Clone, Copy)]
struct EffectiveNoise<'a> {
    /// Nm per joint, of a row that counts as much as one of white noise.
    sigma: &'a [f64],
    /// Squared residual of a row over it, summed over joints, that is noise.
    usual: f64,
}

/// Contacts in a residual (`[joint][judged row]`, Nm) under noise, in the order of time: of the fitted rows, or of those that are held out too.
/// Rows count by how long noise lasts.
pub(super) fn contacts(
    problem: &TorqueProblem,
    residual: &[Vec<f64>],
    noise: &[JointNoise],
    held_out: bool,
) -> Vec<ContactEvent> {
    let lasting = noise.iter().map(|joint| joint.autocorrelation().max(1.0));
    let lasting: Vec<f64> = lasting.collect();
    let sigma = noise.iter().zip(&lasting);
    let sigma: Vec<f64> = sigma
        .map(|(joint, lasting)| joint.sigma * lasting.sqrt())
        .collect();
    let sigma = &sigma[..];
    let usual: f64 = lasting.iter().map(|lasting| 1.0 / lasting).sum();
    let rows = 0..problem.reduction.rows.len();
    let time: Vec<f64> = rows.clone().map(|row| problem.time(row)).collect();
    let shown: Vec<usize> = rows
        .filter(|row| held_out || !problem.is_held_out(*row))
        .collect();
    let energy = |row: &usize| {
        let joints = residual.iter().zip(sigma).enumerate();
        let squares = joints.map(|(joint, (course, sigma))| {
            (course[*row] / sigma_of_row(problem, joint, *row, *sigma)).powi(2)
        });
        squares.sum::<f64>() / sigma.len() as f64
    };
    let energy: Vec<f64> = shown.iter().map(energy).collect();
    let width = ((*PUSH_AVERAGED * problem.reduction.rate) as usize).max(3);
    let average = averaged(&energy, width);
    let median = nearest(&mut average.clone(), 0.5).unwrap_or(0.0);
    let mut apart: Vec<f64> = average.iter().map(|value| (value - median).abs()).collect();
    let spread = 1.4826 * nearest(&mut apart, 0.5).unwrap_or(0.0);
    let (mut used, mut events) = (vec![false; shown.len()], Vec::new());
    for _ in 0..*PUSHES {
        let free = (0..shown.len()).filter(|row| !used[*row]);
        let Some(highest) = free.max_by(|a, b| average[*a].total_cmp(&average[*b])) else {
            break;
        };
        if average[highest] < median + *PUSH_DEVIATIONS * spread
            || average[highest] < *PUSH_TIMES_USUAL * median
        {
            break;
        }
        let (middle, noise) = (time[shown[highest]], EffectiveNoise { sigma, usual });
        let found = best_window(problem, residual, noise, &time, middle);
        events.extend(found.filter(|event| moves(problem, &time, event)));
        for (used, row) in used.iter_mut().zip(&shown) {
            *used |= (time[*row] - middle).abs() < *PUSH_APART;
        }
    }
    events.sort_by(|a: &ContactEvent, b| a.start.total_cmp(&b.start));
    events
}

/// Errors of differentiation last as long as a push does: so many times their size is noise.
const NUMERICS: f64 = 3.0;

/// Nm: the noise of a joint in a row with what differentiation may make there.
fn sigma_of_row(problem: &TorqueProblem, joint: usize, row: usize, sigma: f64) -> f64 {
    sigma.hypot(NUMERICS * problem.numerics[joint][row])
}

/// The window about `middle` in which a force gains most, if it explains the residual there.
fn best_window(
    problem: &TorqueProblem,
    residual: &[Vec<f64>],
    noise: EffectiveNoise,
    time: &[f64],
    middle: f64,
) -> Option<ContactEvent> {
    let mut best: Option<(ContactEvent, f64)> = None;
    let mut look = |start: f64, duration: f64| {
        let first = time.partition_point(|time| *time < start);
        let last = time.partition_point(|time| *time <= start + duration);
        if last >= first + *PUSH_FEWEST && duration > SHORTEST {
            for taper in TAPERS {
                let window = PushWindow {
                    start,
                    duration,
                    taper,
                };
                let found = pushed(problem, residual, noise, time, window, first..last);
                let known = best.as_ref().map(|(known, _)| known.gain);
                if known.is_none_or(|known| found.0.gain > known) {
                    best = Some(found);
                }
            }
        }
        let best = best.as_ref();
        best.map(|(event, _)| (event.start, event.end - event.start))
    };
    let mut now = None;
    for duration in DURATIONS {
        for step in -STEPS..=STEPS {
            now = look(middle + STEP * f64::from(step) - 0.5 * duration, duration);
        }
    }
    for fine in FINE {
        let (start, duration) = now?;
        for begin in -FINE_STEPS..=FINE_STEPS {
            for end in -FINE_STEPS..=FINE_STEPS {
                let [begin, end] = [begin, end].map(|steps| fine * f64::from(steps));
                now = look(start + begin, duration + end - begin);
            }
        }
    }
    best.filter(|(event, share)| event.gain > *PUSH_GAIN && *share > *PUSH_SHARE)
        .map(|(event, _)| event)
}

/// When a push begins, how long it lasts, s, and the share of this time in which it rises and falls.
#[derive(Clone, Copy)]
struct PushWindow {
    start: f64,
    duration: f64,
    taper: f64,
}

impl PushWindow {
    /// The force at a time over the greatest one: sin^2 at both ends, 1 between (a Tukey window).
    fn force(&self, time: f64) -> f64 {
        let from_end = (time - self.start).min(self.start + self.duration - time);
        let rise = 0.5 * self.taper * self.duration;
        if from_end < rise {
            (0.5 * PI * from_end / rise).sin().powi(2)
        } else {
            1.0
        }
    }
}

/// A push over a window, fitted; and the share that it explains of the squared residual above the noise.
fn pushed(
    problem: &TorqueProblem,
    residual: &[Vec<f64>],
    EffectiveNoise { sigma, usual }: EffectiveNoise,
    time: &[f64],
    window: PushWindow,
    rows: std::ops::Range<usize>,
) -> (ContactEvent, f64) {
    let usual = usual * rows.len() as f64;
    let (mut gram, mut right, mut square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    let mut by_joint = vec![0.0; sigma.len()];
    let mut along_force = vec![(Matrix3::zeros(), Vector3::zeros()); sigma.len()];
    for row in rows {
        let push = window.force(time[row]);
        let jacobian = problem.scene.tool_jacobian(problem.reduction.rows[row]);
        for (joint, along) in jacobian.iter().enumerate() {
            let sigma = sigma_of_row(problem, joint, row, sigma[joint]);
            let (column, value) = (-along * push / sigma, residual[joint][row] / sigma);
            gram += column * column.transpose();
            right += column * value;
            square += value * value;
            by_joint[joint] += value * value;
            along_force[joint].0 += column * column.transpose();
            along_force[joint].1 += column * value;
        }
    }
    let ridge = 1e-8 * gram.trace();
    let inverse = (gram + Matrix3::identity() * ridge)
        .try_inverse()
        .unwrap_or_else(Matrix3::zeros);
    let force = inverse * right;
    let gained = |(gram, right): &(Matrix3<f64>, Vector3<f64>)| {
        2.0 * force.dot(right) - force.dot(&(gram * force))
    };
    let gain = gained(&(gram, right));
    let most = along_force.iter().map(gained).fold(0.0, f64::max);
    let mut joints: Vec<usize> = (0..sigma.len()).collect();
    joints.sort_by(|a, b| by_joint[*b].total_cmp(&by_joint[*a]));
    joints.truncate(2);
    let event = ContactEvent {
        start: window.start,
        end: window.start + window.duration,
        joints,
        force: force.into(),
        sigma: [0, 1, 2].map(|axis| inverse[(axis, axis)].max(0.0).sqrt()),
        gain,
    };
    let share = if gain - most < (*PUSH_OTHERS * gain).max(*PUSH_OTHERS_GAIN) {
        0.0
    } else {
        gain / (square - usual).max(gain)
    };
    (event, share)
}

/// Whether the arm moves in a good part of an event.
fn moves(problem: &TorqueProblem, time: &[f64], event: &ContactEvent) -> bool {
    let during = |row: &usize| time[*row] >= event.start && time[*row] <= event.end;
    let rows: Vec<usize> = (0..time.len()).filter(during).collect();
    let scene = &problem.scene;
    let moving = rows.iter().filter(|row| {
        let row = problem.reduction.rows[**row];
        let mut courses = scene.velocity.iter();
        courses.any(|course| course[row].abs() > 2.0 * scene.sign_width)
    });
    moving.count() as f64 >= *PUSH_MOVING * rows.len() as f64
}

/// Mean over `width` values about each; beyond the ends there is nothing.
fn averaged(values: &[f64], width: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    values
        .iter()
        .for_each(|value| sums.push(sums[sums.len() - 1] + value));
    let of_row = |row: usize| {
        let first = (row + 1)
            .saturating_sub(width - width / 2)
            .min(values.len());
        let last = (row + width / 2 + 1).min(values.len());
        (sums[last] - sums[first.min(last)]) / width as f64
    };
    (0..values.len()).map(of_row).collect()
}
