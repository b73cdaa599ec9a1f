//! Whether a recording can be used at all: each fault is said with its joint or row and what is allowed.

use super::arm::DynamicArm;
use super::check_gravity::gravity_faults;
use super::recording::{ClockPace, RecordingClock, TorqueRecording, column, ends};
use crate::error::{Error, Fault, Result, counted};

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
    none_of(faults)
}

/// An error of faults, where there are any.
pub(super) fn none_of(faults: Vec<Fault>) -> Result<()> {
    match faults.is_empty() {
        true => Ok(()),
        false => Err(Error::Data(faults)),
    }
}

fn sizes(arm: &DynamicArm, recording: &TorqueRecording) -> Vec<Fault> {
    let (n, rows) = (recording.joints, recording.rows());
    let mut faults = Vec::new();
    let mut claim = |place: &str, is_so: bool, message: String| {
        faults.extend((!is_so).then(|| Fault::new(place, message)));
    };
    let joints = arm.joints();
    let message = format!("{n} joints are recorded, the arm has {joints}");
    claim("torques", n > 0 && joints == n, message);
    let message = format!("{rows} rows; at least {FEWEST} are needed");
    claim("torques", rows >= FEWEST, message);
    let [velocity, simulated] = [&recording.velocity, &recording.simulated]
        .map(|values| values.as_ref().map_or(n * rows, Vec::len));
    let lengths = [
        ("position", recording.position.len(), n * rows),
        ("torque", recording.torque.len(), n * rows),
        ("velocity", velocity, n * rows),
        ("simulated", simulated, n * rows),
        ("trajectory", recording.trajectory.len(), rows),
        ("held_out", recording.held_out.len(), rows),
    ];
    for (name, found, wanted) in lengths {
        let message = format!("{found} numbers instead of {wanted}");
        claim(name, found == wanted, message);
    }
    let links = arm.links.as_ref().map_or(joints, Vec::len);
    let of_arm = [
        ("points", arm.points.len()),
        ("prismatic", arm.prismatic.len()),
        ("ratio", arm.ratio.len()),
        ("links", links),
    ];
    for (name, found) in of_arm {
        let message = format!("{found} entries for {joints} joints");
        claim(name, found == joints, message);
    }
    faults
}

fn numbers(arm: &DynamicArm, recording: &TorqueRecording) -> Vec<Fault> {
    let n = recording.joints;
    let mut faults = row_faults(recording, 0, None);
    if !faults.is_empty() {
        return faults;
    }
    let usual = ClockPace::usual_step(&recording.time);
    if !(FASTEST..=SLOWEST).contains(&usual) {
        let [most, least] = [1.0 / SLOWEST, 1.0 / FASTEST];
        let message = format!(
            "rows come at {:.3} Hz, {most:.0} to {least:.0} Hz are allowed: times are in s (milliseconds?)",
            1.0 / usual
        );
        return vec![Fault::new("time", message)];
    }
    if recording.held_out.iter().all(|held| *held) {
        let message = "all rows are held out; some must be fitted";
        faults.push(Fault::new("held_out", message));
    }
    let points = arm.points.iter().chain([&arm.tool]);
    let mut distances = points.map(|point| point.coords.norm());
    if let Some(far) = distances.find(|far| *far > FARTHEST) {
        let message = format!("{far:.0} m from the base: lengths are in m (millimetres?)");
        faults.push(Fault::new("points", message));
    }
    let range = |joint: usize| {
        let [least, most] = ends(column(&recording.position, n, joint));
        most - least
    };
    let ranges: Vec<f64> = (0..n).map(range).collect();
    let mut extremes = TorqueExtremes::new(n);
    extremes.push(&recording.torque);
    for (joint, range) in ranges.iter().enumerate() {
        faults.extend(joint_faults(arm, recording, &extremes, joint, *range));
    }
    let moving = ranges.iter().filter(|range| **range > 0.2 * LEAST_RANGE);
    let moving = moving.count();
    let widest = ranges.iter().copied().fold(0.0, f64::max);
    if widest < LEAST_RANGE || 2 * moving < n {
        let unit = match arm.prismatic.contains(&true) {
            true => "rad (m)",
            false => "rad",
        };
        let radians = match widest > LEAST_RANGE * DEGREE {
            true => "; or radians were read as degrees",
            false => "",
        };
        let message = format!(
            "the arm hardly moves (its widest joint over {widest:.3} {unit}, {moving} of {n} joints at all): masses and friction cannot be seen; at least half of the joints must move, one over {LEAST_RANGE} {unit}{radians}"
        );
        faults.push(Fault::new("position", message));
    }
    let turned = ranges.iter().zip(&arm.prismatic);
    let turned = turned.filter(|(range, slides)| **range > TWO_TURNS && !**slides);
    let turned = turned.count();
    if faults.is_empty() && 2 * turned > n {
        let message = format!(
            "{turned} of {n} joints turn over more than two turns (the widest over {widest:.0} rad): angles are in rad (degrees?)"
        );
        faults.push(Fault::new("position", message));
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
        let message = format!("row {}: not a finite number", first + at / each + 1);
        Some(Fault::new(name, message))
    };
    let columns = [
        ("time", &rows.time, 1),
        ("position", &rows.position, n),
        ("torque", &rows.torque, n),
    ];
    let simulated = rows.simulated.iter().map(|values| ("simulated", values, n));
    let faults = columns.into_iter().chain(simulated);
    let faults: Vec<Fault> = faults.filter_map(not_a_number).collect();
    if !faults.is_empty() {
        return faults;
    }
    let all = || {
        let stamps = rows.time.iter().copied();
        stamps.zip(rows.trajectory.iter().copied())
    };
    let next = all().skip(usize::from(before.is_none()));
    let pairs = before.into_iter().chain(all()).zip(next);
    let row = first + usize::from(before.is_none()) + 1;
    let back = |(row, ((then, from), (now, to))): (usize, (Stamp, Stamp))| {
        let message =
            || format!("row {row}: the clock goes from {then} s to {now} s; it must ascend");
        (now <= then && from == to).then(|| Fault::new("time", message()))
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
    let mut faults = Vec::new();
    if range > WIDEST && !arm.prismatic[joint] {
        let message = format!("positions span {range:.0} rad: angles are in rad (degrees?)");
        faults.push(Fault::new(name(joint), message));
    }
    faults.extend(extremes.faults_of(joint));
    if extremes.constant(joint).is_none() {
        let velocity = recording.velocity.as_ref();
        faults.extend(velocity.and_then(|velocity| velocity_fault(recording, velocity, joint)));
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
    let message = || {
        format!(
            "recorded velocities are {ratio:.3} times those of the positions (correlation {correlation:.2}): another unit, joint or sign"
        )
    };
    wrong.then(|| Fault::new(name(joint), message()))
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
    let mut remarks = few(clock.stretches[1..].iter().map(torn));
    remarks.extend(of_sets(recording));
    remarks
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
    fn constant(&self, joint: usize) -> Option<Fault> {
        let [(least, _), (most, _)] = self.joints[joint];
        let message = || format!("torque is {least} in every row: the column holds no measurement");
        (least == most).then(|| Fault::new(name(joint), message()))
    }

    /// Extremes that many rows share.
    fn saturated(&self, joint: usize) -> impl Iterator<Item = Fault> {
        let all = self.rows;
        let shared = move |(_, rows): &Extreme| {
            *rows >= SATURATED_ROWS && *rows as f64 > SATURATED * all as f64
        };
        self.joints[joint].into_iter().filter(shared).map(move |(extreme, rows)| {
            let message =
                format!("{rows} of {all} torques are exactly {extreme:.4}, the largest: the current is cut off there");
            Fault::new(name(joint), message)
        })
    }

    /// Both of a joint.
    fn faults_of(&self, joint: usize) -> Vec<Fault> {
        match self.constant(joint) {
            Some(constant) => vec![constant],
            None => self.saturated(joint).collect(),
        }
    }

    /// All of it, joint after joint.
    pub(crate) fn faults(&self) -> Vec<Fault> {
        let joints = 0..self.joints.len();
        joints.flat_map(|joint| self.faults_of(joint)).collect()
    }
}

fn meet(extreme: &mut Extreme, value: f64, beyond: bool) {
    if beyond {
        *extreme = (value, 1);
    } else if value == extreme.0 {
        extreme.1 += 1;
    }
}

/// What a joint is called.
pub(super) fn name(joint: usize) -> String {
    format!("joint {}", joint + 1)
}
