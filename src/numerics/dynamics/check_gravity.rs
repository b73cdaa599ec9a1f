//! A recording against the gravity of the declared arm: torques in a wrong unit, with another sign or of another joint, and angles in a wrong
//! unit or of another joint. Gravity itself is asked before them.

use super::arm::{DeclaredInertials, DynamicArm};
use super::newton_euler::at_rest;
use super::recording::{TorqueRecording, add};
use super::seen_gravity::SeenGravity;
use crate::criteria::torque::{UNIT, WEIGHS, WEIGHTY};
use crate::error::Fault;
use crate::statistics::nearest;

/// Ratio of measured to simulated torque: beyond it, or below its inverse, a unit is wrong.
const UNIT_RATIO: f64 = 50.0;
/// Ratio of the squared error with another reading of the columns to that without.
const EXCHANGED: f64 = 0.2;
/// Share of the torques that another reading may leave, at most: one that makes gravity constant explains what is nearly nothing.
const MEANT: f64 = 0.5;
/// Nm: below it gravity shows nothing of units.
const SMALL_TORQUE: f64 = 1e-3;
/// Rows at which other readings of the angles are tried.
const TRIED: usize = 300;
/// rad.
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// All of them; none where no masses are declared, or where another simulation stands for them.
pub(super) fn gravity_faults(arm: &DynamicArm, recording: &TorqueRecording) -> Vec<Fault> {
    let Some(links) = arm.links.as_ref().filter(|_| recording.simulated.is_none()) else {
        return Vec::new();
    };
    let theta = DeclaredInertials::of(arm, links).theta;
    let seen = SeenGravity::of(arm, recording, &theta);
    if let Some(fault) = seen.and_then(|seen| seen.fault(arm)) {
        return vec![fault];
    }
    let faults = torque_faults(arm, recording, &theta);
    if faults.is_empty() {
        angle_fault(arm, recording, &theta).into_iter().collect()
    } else {
        faults
    }
}

/// Torques against those of the declared arm standing still: units, signs, joints.
fn torque_faults(arm: &DynamicArm, recording: &TorqueRecording, theta: &[f64]) -> Vec<Fault> {
    let n = recording.joints;
    let mut gravity_at = at_rest(arm, theta);
    let (mut measured_square, mut gravity_square) = (vec![0.0; n], vec![0.0; n]);
    let mut products = vec![vec![0.0; n]; n];
    let rows = recording.position.chunks_exact(n);
    for (position, torque) in rows.zip(recording.torque.chunks_exact(n)) {
        let gravity = gravity_at(position);
        for (joint, torque) in torque.iter().enumerate() {
            measured_square[joint] += torque * torque;
            gravity_square[joint] += gravity[joint] * gravity[joint];
            add(&mut products[joint], *torque, &gravity);
        }
    }
    let is_weighty =
        |joint: &usize| (gravity_square[*joint] / recording.rows() as f64).sqrt() > SMALL_TORQUE;
    let weighty: Vec<usize> = (0..n).filter(is_weighty).collect();
    let ratio = |joint: usize| (measured_square[joint] / gravity_square[joint]).sqrt();
    let mut ratios: Vec<f64> = weighty.iter().map(|joint| ratio(*joint)).collect();
    let mut faults = Vec::new();
    let heaviest = weighty.iter().copied();
    let heaviest = heaviest.max_by(|a, b| gravity_square[*a].total_cmp(&gravity_square[*b]));
    if let (Some(usual), Some(heaviest)) = (nearest(&mut ratios, 0.5), heaviest) {
        let ratio = ratio(heaviest);
        let share = |joint: &usize| products[*joint][*joint] / gravity_square[*joint];
        let wrong = |times: f64, most: f64| !(1.0 / most..=most).contains(&times.abs());
        let weighs = |joint: &&usize| {
            let explained = products[**joint][**joint].powi(2)
                / (measured_square[**joint] * gravity_square[**joint]);
            gravity_square[**joint] > WEIGHTY.powi(2) * gravity_square[heaviest]
                && explained > *WEIGHS
        };
        let heavy = || weighty.iter().filter(weighs);
        // Friction and acceleration are in the rms of a torque, not in its share along gravity.
        // Beyond on one side alone: joints that are exchanged are on both.
        let beyond = |more: bool| {
            heavy().all(|joint| wrong(share(joint), *UNIT) && (share(joint).abs() > 1.0) == more)
        };
        let of_gravity = heavy().any(|joint| *joint == heaviest) && (beyond(true) || beyond(false));
        if of_gravity || wrong(ratio, UNIT_RATIO) {
            let times = match of_gravity {
                true => share(&heaviest).abs(),
                false => ratio,
            };
            let message = format!(
                "torques are {times:.3e} times those of the declared masses at joint {} ({usual:.3e} at most joints): a unit, ratio or \
                 torque constant is wrong{}",
                heaviest + 1,
                remedy(recording.from_current, times)
            );
            return vec![Fault::new("torque", message)];
        }
    }
    let left = |joint: usize, other: usize| {
        measured_square[joint] - 2.0 * products[joint][other] + gravity_square[other]
    };
    for (place, joint) in weighty.iter().enumerate() {
        if products[*joint][*joint]
            < -0.8 * (measured_square[*joint] * gravity_square[*joint]).sqrt()
        {
            let message = "torques are those of the declared masses with the other sign";
            faults.push(Fault::new(format!("joint {}", joint + 1), message));
        }
        for other in &weighty[place + 1..] {
            let straight = left(*joint, *joint) + left(*other, *other);
            if left(*joint, *other) + left(*other, *joint) < EXCHANGED * straight {
                let (one, other) = (joint + 1, other + 1);
                let message =
                    format!("the columns of joint {one} and joint {other} look exchanged");
                faults.push(Fault::new("torque", message));
            }
        }
    }
    faults
}

/// What is likely wrong where torques are so many times those of the declared masses, and what to do.
fn remedy(from_current: bool, times: f64) -> String {
    const THOUSAND: f64 = 100.0;
    let thousand = if (1.0 / THOUSAND..=THOUSAND).contains(&times) {
        ""
    } else {
        " (by 1,000?)"
    };
    let remedy = match (from_current, times > 1.0) {
        (false, false) => {
            "if the columns are motor currents (A), map them as `current` and state `ratio` and `kt` (Nm/A) of each joint in the robot file; \
             if they are torques of the motors, set `torque_side: motor`"
        }
        (true, true) => {
            "if the columns are joint torques (Nm), map them as `torque`; else correct their unit, `kt` (Nm/A) or `ratio`"
        }
        _ => {
            "correct the unit of the columns, or masses, `kt` (Nm/A) and `ratio` of the robot file"
        }
    };
    format!("{thousand}. Remedy: {remedy}")
}

/// Another reading of the recorded angles.
#[derive(Clone, Copy)]
enum AngleReading {
    /// As they stand.
    Straight,
    /// One position in all rows, so that gravity explains nothing.
    Constant,
    Scaled(f64),
    /// The angles of two joints.
    Exchanged(usize, usize),
    /// Angles and torques of two joints.
    Renamed(usize, usize),
}

/// What is wrong with the angles, where another reading of them explains the torques far better.
fn angle_fault(arm: &DynamicArm, recording: &TorqueRecording, theta: &[f64]) -> Option<Fault> {
    let n = recording.joints;
    let straight = unexplained(arm, recording, theta, AngleReading::Straight);
    let pairs = || (0..n).flat_map(|one| (one + 1..n).map(move |other| (one, other)));
    let others = [1.0 / DEGREE, DEGREE].map(AngleReading::Scaled).into_iter();
    let others = others
        .chain(pairs().map(|(one, other)| AngleReading::Exchanged(one, other)))
        .chain(pairs().map(|(one, other)| AngleReading::Renamed(one, other)));
    let left = others.map(|reading| (reading, unexplained(arm, recording, theta, reading)));
    let (best, left) = left.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let whole = unexplained(arm, recording, theta, AngleReading::Constant);
    (left < EXCHANGED * straight && left < MEANT * whole).then(|| {
        let better = (straight / left.max(f64::MIN_POSITIVE)).sqrt();
        let reading = match best {
            AngleReading::Scaled(factor) if factor > 1.0 => {
                "angles were radians already and were converted from degrees once more".into()
            }
            AngleReading::Straight | AngleReading::Constant | AngleReading::Scaled(_) => {
                "angles are degrees where radians are expected".into()
            }
            AngleReading::Exchanged(one, other) => {
                let (one, other) = (one + 1, other + 1);
                format!("the angles of joint {one} and joint {other} look exchanged")
            }
            AngleReading::Renamed(one, other) => {
                format!("joint {} and joint {} look exchanged", one + 1, other + 1)
            }
        };
        let message = format!(
            "{reading}: the declared masses explain the torques {better:.0} times better so"
        );
        Fault::new("position", message)
    })
}

/// Sums of torque and gravity of a joint over rows.
#[derive(Clone, Copy, Default)]
struct JointSums {
    torque: f64,
    gravity: f64,
    torque_square: f64,
    gravity_square: f64,
    product: f64,
}

impl JointSums {
    /// Sum of squares about the mean that gravity leaves, itself or `scaled` by what fits best: currents of another joint have its motor.
    fn left(&self, rows: f64, scaled: bool) -> f64 {
        let torque = self.torque_square - self.torque * self.torque / rows;
        let gravity = self.gravity_square - self.gravity * self.gravity / rows;
        let product = self.product - self.torque * self.gravity / rows;
        match scaled {
            true if gravity > 0.0 && product > 0.0 => torque - product * product / gravity,
            true => torque,
            false => torque - 2.0 * product + gravity,
        }
    }
}

/// Mean square of what gravity leaves of the torques about their means, Nm^2.
fn unexplained(
    arm: &DynamicArm,
    recording: &TorqueRecording,
    theta: &[f64],
    reading: AngleReading,
) -> f64 {
    let n = recording.joints;
    let mut gravity_at = at_rest(arm, theta);
    let (mut sums, mut rows) = (vec![JointSums::default(); n], 0.0);
    for row in (0..recording.rows()).step_by(recording.rows().div_ceil(TRIED).max(1)) {
        let mut position = recording.position[row * n..(row + 1) * n].to_vec();
        let mut torque = recording.torque[row * n..(row + 1) * n].to_vec();
        match reading {
            AngleReading::Straight => (),
            AngleReading::Constant => position.fill(0.0),
            AngleReading::Scaled(factor) => position.iter_mut().for_each(|angle| *angle *= factor),
            AngleReading::Exchanged(one, other) => position.swap(one, other),
            AngleReading::Renamed(one, other) => {
                position.swap(one, other);
                torque.swap(one, other);
            }
        }
        rows += 1.0;
        let gravity = gravity_at(&position);
        for (sums, (torque, gravity)) in sums.iter_mut().zip(torque.iter().zip(&gravity)) {
            sums.torque += torque;
            sums.gravity += gravity;
            sums.torque_square += torque * torque;
            sums.gravity_square += gravity * gravity;
            sums.product += torque * gravity;
        }
    }
    let scaled = |joint: usize| matches!(reading, AngleReading::Renamed(one, other) if recording.from_current && (joint == one || joint == other));
    let left = sums.iter().enumerate();
    let left = left.map(|(joint, sums)| sums.left(rows, scaled(joint)));
    left.sum::<f64>() / rows
}
