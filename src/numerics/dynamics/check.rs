//! Whether a recording can be used at all: each fault is said with its joint or row and what is allowed.

use super::arm::DynamicArm;
use super::bridge::Bridged;
use super::check_gravity::gravity_faults;
use super::clock::RecordingClock;
use super::recording::TorqueRecording;
use crate::error::{Error, Fault, Result};
use crate::statistics::nearest;

/// Rows, at least.
const FEWEST: usize = 200;
/// s from row to row: more shows no motion, less is no controller's.
const SLOWEST: f64 = 0.2;
const FASTEST: f64 = 2e-5;
/// rad: the widest range that a joint turns through.
const WIDEST: f64 = 50.0;
/// rad: few joints turn farther, and not most of an arm's.
const TWO_TURNS: f64 = 4.0 * std::f64::consts::PI + 0.5;
/// rad.
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// rad: the arm must move over so much at one joint at least, and at half of them over a fifth of it.
const LEAST_RANGE: f64 = 0.1;
/// m: points of an arm are nearer to the base.
const FARTHEST: f64 = 50.0;
/// Of rows at one extreme value: a torque that is cut off.
const SATURATED: f64 = 0.02;
/// Rows at least of those.
const SATURATED_ROWS: usize = 40;
/// Of the correlation of recorded and differentiated velocity.
const SAME_VELOCITY: f64 = 0.5;

/// All faults of sizes and numbers.
pub(super) fn check(arm: &DynamicArm, recording: &TorqueRecording) -> Result<()> {
    let mut faults = sizes(arm, recording);
    if faults.is_empty() {
        faults.extend(numbers(arm, recording));
    }
    if faults.is_empty() { Ok(()) } else { Err(Error::Data(faults)) }
}

fn fault(place: impl Into<String>, message: impl Into<String>) -> Fault {
    Fault::new(place, message)
}

fn sizes(arm: &DynamicArm, recording: &TorqueRecording) -> Vec<Fault> {
    let (n, rows) = (recording.joints, recording.rows());
    let mut faults = Vec::new();
    if n == 0 || arm.joints() != n {
        faults.push(fault("torques", format!("{n} joints are recorded, the arm has {}", arm.joints())));
    }
    if rows < FEWEST {
        faults.push(fault("torques", format!("{rows} rows; at least {FEWEST} are needed")));
    }
    let lengths = [
        ("position", recording.position.len(), n * rows),
        ("torque", recording.torque.len(), n * rows),
        ("velocity", recording.velocity.as_ref().map_or(n * rows, Vec::len), n * rows),
        ("trajectory", recording.trajectory.len(), rows),
        ("held_out", recording.held_out.len(), rows),
    ];
    for (name, found, wanted) in lengths {
        if found != wanted {
            faults.push(fault(name, format!("{found} numbers instead of {wanted}")));
        }
    }
    let of_arm = [("points", arm.points.len()), ("prismatic", arm.prismatic.len()), ("ratio", arm.ratio.len())];
    for (name, found) in of_arm.into_iter().chain(arm.links.as_ref().map(|links| ("links", links.len()))) {
        if found != arm.joints() {
            faults.push(fault(name, format!("{found} entries for {} joints", arm.joints())));
        }
    }
    faults
}

fn numbers(arm: &DynamicArm, recording: &TorqueRecording) -> Vec<Fault> {
    let n = recording.joints;
    let mut faults = Vec::new();
    let not_a_number =
        |values: &[f64], each: usize| values.iter().position(|value| !value.is_finite()).map(|at| at / each.max(1));
    for (name, values, each) in
        [("time", &recording.time, 1), ("position", &recording.position, n), ("torque", &recording.torque, n)]
    {
        if let Some(row) = not_a_number(values, each) {
            faults.push(fault(name, format!("row {}: not a finite number", row + 1)));
        }
    }
    if !faults.is_empty() {
        return faults;
    }
    for row in 1..recording.rows() {
        let back = recording.time[row] <= recording.time[row - 1];
        if back && recording.trajectory[row] == recording.trajectory[row - 1] {
            let times = [recording.time[row - 1], recording.time[row]];
            faults.push(fault(
                "time",
                format!("row {}: the clock goes from {} s to {} s; it must ascend", row + 1, times[0], times[1]),
            ));
            return faults;
        }
    }
    let mut steps: Vec<f64> = recording.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = nearest(&mut steps, 0.5).unwrap_or(0.0);
    if !(FASTEST..=SLOWEST).contains(&usual) {
        let [most, least] = [1.0 / SLOWEST, 1.0 / FASTEST];
        let message =
            format!("rows come at {:.3} Hz, {most:.0} to {least:.0} Hz are allowed: times are in s (milliseconds?)", 1.0 / usual);
        faults.push(fault("time", message));
        return faults;
    }
    if recording.held_out.iter().all(|held| *held) {
        faults.push(fault("held_out", "all rows are held out; some must be fitted"));
    }
    if let Some(far) = arm.points.iter().chain([&arm.tool]).map(|point| point.coords.norm()).find(|far| *far > FARTHEST) {
        faults.push(fault("points", format!("{far:.0} m from the base: lengths are in m (millimetres?)")));
    }
    let ranges: Vec<f64> = (0..n).map(|joint| range(recording, joint)).collect();
    for (joint, range) in ranges.iter().enumerate() {
        faults.extend(joint_faults(arm, recording, joint, *range));
    }
    let moving = ranges.iter().filter(|range| **range > 0.2 * LEAST_RANGE).count();
    let widest = ranges.iter().copied().fold(0.0, f64::max);
    if widest < LEAST_RANGE || 2 * moving < n {
        let radians = if widest > LEAST_RANGE * DEGREE { "; or radians were read as degrees" } else { "" };
        faults.push(fault(
            "position",
            format!("the arm hardly moves (its widest joint over {widest:.3} rad, {moving} of {n} joints at all): masses and friction cannot be seen; at least half of the joints must move, one over {LEAST_RANGE} rad{radians}"),
        ));
    }
    let turned = ranges.iter().zip(&arm.prismatic).filter(|(range, slides)| **range > TWO_TURNS && !**slides).count();
    if faults.is_empty() && 2 * turned > n {
        faults.push(fault(
            "position",
            format!("{turned} of {n} joints turn over more than two turns (the widest over {widest:.0} rad): angles are in rad (degrees?)"),
        ));
    }
    if faults.is_empty() {
        faults.extend(gravity_faults(arm, recording));
    }
    faults
}

fn range(recording: &TorqueRecording, joint: usize) -> f64 {
    let positions = || recording.position.iter().skip(joint).step_by(recording.joints);
    positions().copied().fold(f64::NEG_INFINITY, f64::max) - positions().copied().fold(f64::INFINITY, f64::min)
}

fn joint_faults(arm: &DynamicArm, recording: &TorqueRecording, joint: usize, range: f64) -> Vec<Fault> {
    let (n, name) = (recording.joints, format!("joint {}", joint + 1));
    let mut faults = Vec::new();
    if range > WIDEST && !arm.prismatic[joint] {
        faults.push(fault(&name, format!("positions span {range:.0} rad: angles are in rad (degrees?)")));
    }
    let torques: Vec<f64> = recording.torque.iter().skip(joint).step_by(n).copied().collect();
    let (least, most) =
        torques.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(*value), most.max(*value)));
    if least == most {
        faults.push(fault(&name, format!("torque is {least} in every row: the column holds no measurement")));
        return faults;
    }
    for extreme in [least, most] {
        let rows = torques.iter().filter(|value| **value == extreme).count();
        if rows >= SATURATED_ROWS && rows as f64 > SATURATED * torques.len() as f64 {
            faults.push(fault(
                &name,
                format!(
                    "{rows} of {} torques are exactly {extreme:.4} Nm, the largest: the current is cut off there",
                    torques.len()
                ),
            ));
        }
    }
    if let Some(velocity) = &recording.velocity {
        faults.extend(velocity_fault(recording, velocity, joint));
    }
    faults
}

/// A recorded velocity that is not that of the positions.
fn velocity_fault(recording: &TorqueRecording, velocity: &[f64], joint: usize) -> Option<Fault> {
    let n = recording.joints;
    let (mut product, mut own, mut other) = (0.0, 0.0, 0.0);
    for row in 1..recording.rows() - 1 {
        let lasted = recording.time[row + 1] - recording.time[row - 1];
        let moved = recording.position[(row + 1) * n + joint] - recording.position[(row - 1) * n + joint];
        if lasted > 0.0 && recording.trajectory[row + 1] == recording.trajectory[row - 1] {
            let (a, b) = (moved / lasted, velocity[row * n + joint]);
            product += a * b;
            own += a * a;
            other += b * b;
        }
    }
    let correlation = product / (own * other).sqrt().max(f64::MIN_POSITIVE);
    let ratio = (other / own.max(f64::MIN_POSITIVE)).sqrt();
    let wrong = own > 0.0 && other > 0.0 && (correlation < SAME_VELOCITY || !(0.2..5.0).contains(&ratio));
    wrong.then(|| {
        fault(
            format!("joint {}", joint + 1),
            format!("recorded velocities are {ratio:.3} times those of the positions (correlation {correlation:.2}): another unit, joint or sign"),
        )
    })
}

/// What is odd about a recording that can be used, a sentence each.
pub(super) fn remarks(bridged: &Bridged, clock: &RecordingClock) -> Vec<String> {
    let recording = &bridged.recording;
    let mut remarks = Vec::new();
    let usual = 1.0 / clock.rate;
    for stretch in &clock.stretches[1..] {
        let lasted = recording.time[stretch.start] - recording.time[stretch.start - 1];
        let what = if lasted > 1.5 * usual { format!("the clock jumps by {lasted:.3} s") } else { "a joint jumps".into() };
        remarks.push(format!("row {}: {what}; nothing is filtered across it", bridged.origin[stretch.start] + 1));
    }
    let uneven = recording.time.windows(2).filter(|pair| (pair[1] - pair[0] - usual).abs() > 0.2 * usual).count();
    if uneven > recording.rows() / 20 {
        remarks.push(format!(
            "{uneven} steps of the clock are more than 20 % off {usual:.4} s; they are filtered as if they were even"
        ));
    }
    if !recording.held_out.contains(&true) {
        remarks.push("no rows are held out: errors are of the rows that were fitted".into());
    }
    remarks
}
