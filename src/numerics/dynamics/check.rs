//! Whether a recording can be used at all: each fault is said with its joint or row and what is allowed.

use super::arm::DynamicArm;
use super::check_gravity::gravity_faults;
use super::clock::RecordingClock;
use super::scene::ends;
use crate::error::{Error, Fault, Result, counted};
use crate::statistics::nearest;
use crate::types::TorqueRecording;

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
/// Correlation of recorded and differentiated velocity above which they are the same.
const SAME_VELOCITY: f64 = 0.5;

/// All faults of sizes and numbers.
pub(super) fn check(arm: &DynamicArm, recording: &TorqueRecording) -> Result<()> {
    let mut faults = sizes(arm, recording);
    if faults.is_empty() {
        faults.extend(numbers(arm, recording));
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(Error::Data(faults))
    }
}

fn fault(place: impl Into<String>, message: impl Into<String>) -> Fault {
    Fault::new(place, message)
}

fn sizes(arm: &DynamicArm, recording: &TorqueRecording) -> Vec<Fault> {
    let (n, rows) = (recording.joints, recording.rows());
    let mut faults = Vec::new();
    if n == 0 || arm.joints() != n {
        faults.push(fault(
            "torques",
            format!("{n} joints are recorded, the arm has {}", arm.joints()),
        ));
    }
    if rows < FEWEST {
        faults.push(fault(
            "torques",
            format!("{rows} rows; at least {FEWEST} are needed"),
        ));
    }
    let lengths = [
        ("position", recording.position.len(), n * rows),
        ("torque", recording.torque.len(), n * rows),
        (
            "velocity",
            recording.velocity.as_ref().map_or(n * rows, Vec::len),
            n * rows,
        ),
        ("trajectory", recording.trajectory.len(), rows),
        ("held_out", recording.held_out.len(), rows),
    ];
    for (name, found, wanted) in lengths {
        if found != wanted {
            faults.push(fault(name, format!("{found} numbers instead of {wanted}")));
        }
    }
    let of_arm = [
        ("points", arm.points.len()),
        ("prismatic", arm.prismatic.len()),
        ("ratio", arm.ratio.len()),
    ];
    for (name, found) in of_arm
        .into_iter()
        .chain(arm.links.as_ref().map(|links| ("links", links.len())))
    {
        if found != arm.joints() {
            faults.push(fault(
                name,
                format!("{found} entries for {} joints", arm.joints()),
            ));
        }
    }
    faults
}

fn numbers(arm: &DynamicArm, recording: &TorqueRecording) -> Vec<Fault> {
    let n = recording.joints;
    let mut faults = Vec::new();
    faults.extend(row_faults(recording, 0, None));
    if !faults.is_empty() {
        return faults;
    }
    let mut steps: Vec<f64> = recording
        .time
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .collect();
    let usual = nearest(&mut steps, 0.5).unwrap_or(0.0);
    if !(FASTEST..=SLOWEST).contains(&usual) {
        let [most, least] = [1.0 / SLOWEST, 1.0 / FASTEST];
        let message = format!(
            "rows come at {:.3} Hz, {most:.0} to {least:.0} Hz are allowed: times are in s (milliseconds?)",
            1.0 / usual
        );
        faults.push(fault("time", message));
        return faults;
    }
    if recording.held_out.iter().all(|held| *held) {
        faults.push(fault(
            "held_out",
            "all rows are held out; some must be fitted",
        ));
    }
    if let Some(far) = arm
        .points
        .iter()
        .chain([&arm.tool])
        .map(|point| point.coords.norm())
        .find(|far| *far > FARTHEST)
    {
        faults.push(fault(
            "points",
            format!("{far:.0} m from the base: lengths are in m (millimetres?)"),
        ));
    }
    let range = |joint: usize| {
        let [least, most] = ends(recording.position.iter().skip(joint).step_by(n).copied());
        most - least
    };
    let ranges: Vec<f64> = (0..n).map(range).collect();
    let mut extremes = TorqueExtremes::new(n);
    extremes.push(&recording.torque);
    for (joint, range) in ranges.iter().enumerate() {
        faults.extend(joint_faults(arm, recording, &extremes, joint, *range));
    }
    let moving = ranges
        .iter()
        .filter(|range| **range > 0.2 * LEAST_RANGE)
        .count();
    let widest = ranges.iter().copied().fold(0.0, f64::max);
    if widest < LEAST_RANGE || 2 * moving < n {
        let radians = if widest > LEAST_RANGE * DEGREE {
            "; or radians were read as degrees"
        } else {
            ""
        };
        faults.push(fault(
            "position",
            format!("the arm hardly moves (its widest joint over {widest:.3} rad, {moving} of {n} joints at all): masses and friction cannot be seen; at least half of the joints must move, one over {LEAST_RANGE} rad{radians}"),
        ));
    }
    let turned = ranges
        .iter()
        .zip(&arm.prismatic)
        .filter(|(range, slides)| **range > TWO_TURNS && !**slides)
        .count();
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

/// Time (s) and trajectory of a row.
type Stamp = (f64, u32);

/// Numbers that are none, and a clock that does not ascend, in rows that begin at row `first` of the recording, after one of this time and
/// trajectory.
pub(super) fn row_faults(
    rows: &TorqueRecording,
    first: usize,
    before: Option<Stamp>,
) -> Vec<Fault> {
    let n = rows.joints.max(1);
    let not_a_number = |(name, values, each): (&'static str, &Vec<f64>, usize)| {
        let at = values.iter().position(|value| !value.is_finite())?;
        Some(fault(
            name,
            format!("row {}: not a finite number", first + at / each + 1),
        ))
    };
    let columns = [
        ("time", &rows.time, 1),
        ("position", &rows.position, n),
        ("torque", &rows.torque, n),
    ];
    let faults: Vec<Fault> = columns.into_iter().filter_map(not_a_number).collect();
    if !faults.is_empty() {
        return faults;
    }
    let all = || {
        rows.time
            .iter()
            .copied()
            .zip(rows.trajectory.iter().copied())
    };
    let pairs = before
        .into_iter()
        .chain(all())
        .zip(all().skip(usize::from(before.is_none())));
    let row = first + usize::from(before.is_none()) + 1;
    let back = |(row, ((then, from), (now, to))): (usize, (Stamp, Stamp))| {
        let message =
            || format!("row {row}: the clock goes from {then} s to {now} s; it must ascend");
        (now <= then && from == to).then(|| fault("time", message()))
    };
    (row..).zip(pairs).find_map(back).into_iter().collect()
}

fn joint_faults(
    arm: &DynamicArm,
    recording: &TorqueRecording,
    extremes: &TorqueExtremes,
    joint: usize,
    range: f64,
) -> Vec<Fault> {
    let name = format!("joint {}", joint + 1);
    let mut faults = Vec::new();
    if range > WIDEST && !arm.prismatic[joint] {
        faults.push(fault(
            &name,
            format!("positions span {range:.0} rad: angles are in rad (degrees?)"),
        ));
    }
    if let Some(constant) = extremes.constant(joint) {
        faults.push(constant);
        return faults;
    }
    faults.extend(extremes.saturated(joint));
    if let Some(velocity) = &recording.velocity {
        faults.extend(velocity_fault(recording, velocity, joint));
    }
    faults
}

/// A recorded velocity that is not that of the positions.
fn velocity_fault(recording: &TorqueRecording, velocity: &[f64], joint: usize) -> Option<Fault> {
    let n = recording.joints;
    let (mut product, mut square, mut other) = (0.0, 0.0, 0.0);
    for row in 1..recording.rows() - 1 {
        let lasted = recording.time[row + 1] - recording.time[row - 1];
        let moved =
            recording.position[(row + 1) * n + joint] - recording.position[(row - 1) * n + joint];
        if lasted > 0.0 && recording.trajectory[row + 1] == recording.trajectory[row - 1] {
            let (a, b) = (moved / lasted, velocity[row * n + joint]);
            product += a * b;
            square += a * a;
            other += b * b;
        }
    }
    let correlation = product / (square * other).sqrt().max(f64::MIN_POSITIVE);
    let ratio = (other / square.max(f64::MIN_POSITIVE)).sqrt();
    let wrong = square > 0.0
        && other > 0.0
        && (correlation < SAME_VELOCITY || !(0.2..5.0).contains(&ratio));
    wrong.then(|| {
        fault(
            format!("joint {}", joint + 1),
            format!("recorded velocities are {ratio:.3} times those of the positions (correlation {correlation:.2}): another unit, joint or sign"),
        )
    })
}

/// What is odd about a recording that can be used, a sentence each.
pub(super) fn remarks(
    recording: &TorqueRecording,
    origin: &[usize],
    clock: &RecordingClock,
) -> Vec<String> {
    let usual = 1.0 / clock.rate;
    let torn = |stretch: &std::ops::Range<usize>| {
        let lasted = recording.time[stretch.start] - recording.time[stretch.start - 1];
        torn_at(origin[stretch.start], lasted, usual)
    };
    few(clock.stretches[1..].iter().map(torn))
        .into_iter()
        .chain(of_sets(recording))
        .collect()
}

/// The first sentences of many that are alike, and how many more there are.
pub(super) fn few(all: impl Iterator<Item = String>) -> Vec<String> {
    /// That are told one by one.
    const TOLD: usize = 3;
    let mut all: Vec<String> = all.collect();
    let more = all.len().saturating_sub(TOLD);
    all.truncate(TOLD);
    all.extend((more > 0).then(|| format!("the same at {} more", counted(more, "row"))));
    all
}

/// A sentence on a row before which clock or joints jump: `lasted` s after the row before, where `usual` s are usual.
pub(super) fn torn_at(row: usize, lasted: f64, usual: f64) -> String {
    let what = if lasted > 1.5 * usual {
        format!("the clock jumps by {lasted:.3} s")
    } else {
        "a joint jumps".into()
    };
    format!("row {}: {what}; nothing is filtered across it", row + 1)
}

/// A sentence where no rows judge.
pub(super) fn of_sets(recording: &TorqueRecording) -> Option<String> {
    (!recording.held_out.contains(&true))
        .then(|| "no rows are held out: errors are of the rows that were fitted".into())
}

// The least and the largest torque of each joint and how many rows have them, gathered over rows that may be read in blocks: what a dead or
// saturated channel shows.

/// Share of rows at one extreme value: a torque that is cut off.
const SATURATED: f64 = 0.02;
/// Rows at least of those.
const SATURATED_ROWS: usize = 40;

/// An extreme value and how many rows have it.
type Extreme = (f64, usize);

/// Extremes of n joints.
pub(super) struct TorqueExtremes {
    rows: usize,
    /// Per joint: least, largest.
    joints: Vec<[Extreme; 2]>,
}

impl TorqueExtremes {
    /// The extremes of no rows of n joints.
    pub(crate) fn new(joints: usize) -> Self {
        Self {
            rows: 0,
            joints: vec![[(f64::INFINITY, 0), (f64::NEG_INFINITY, 0)]; joints],
        }
    }

    /// Takes rows x n torques, Nm.
    pub(crate) fn push(&mut self, torque: &[f64]) {
        for row in torque.chunks_exact(self.joints.len().max(1)) {
            self.rows += 1;
            for (value, [least, most]) in row.iter().zip(&mut self.joints) {
                meet(least, *value, *value < least.0);
                meet(most, *value, *value > most.0);
            }
        }
    }

    /// A column that holds one number.
    pub(crate) fn constant(&self, joint: usize) -> Option<Fault> {
        let [(least, _), (most, _)] = self.joints[joint];
        let message = || format!("torque is {least} in every row: the column holds no measurement");
        (least == most).then(|| Fault::new(name(joint), message()))
    }

    /// Extremes that many rows share.
    pub(crate) fn saturated(&self, joint: usize) -> impl Iterator<Item = Fault> {
        let all = self.rows;
        let shared = move |(_, rows): &Extreme| {
            *rows >= SATURATED_ROWS && *rows as f64 > SATURATED * all as f64
        };
        self.joints[joint].into_iter().filter(shared).map(move |(extreme, rows)| {
            let message =
                format!("{rows} of {all} torques are exactly {extreme:.4} Nm, the largest: the current is cut off there");
            Fault::new(name(joint), message)
        })
    }

    /// All of it, joint after joint.
    pub(crate) fn faults(&self) -> Vec<Fault> {
        let of_joint = |joint: usize| match self.constant(joint) {
            Some(constant) => vec![constant],
            None => self.saturated(joint).collect(),
        };
        (0..self.joints.len()).flat_map(of_joint).collect()
    }
}

fn meet(extreme: &mut Extreme, value: f64, beyond: bool) {
    if beyond {
        *extreme = (value, 1);
    } else if value == extreme.0 {
        extreme.1 += 1;
    }
}

fn name(joint: usize) -> String {
    format!("joint {}", joint + 1)
}
