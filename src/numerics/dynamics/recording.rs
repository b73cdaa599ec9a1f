//! Rows of torques as they were recorded: arrays in SI on the joint side, in the order of time; of those that may be longer than memory, rows
//! come in blocks, as often as they are asked for. With their clock: its rate, and the runs of rows over which a filter may work.

use crate::error::{Result, counted};
use crate::statistics::nearest;
use std::f64::consts::PI;
use std::ops::Range;

/// Rows of n joints, row-major (rows x n).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TorqueRecording {
    /// Number of joints n.
    pub joints: usize,
    /// s, ascending inside a trajectory; length rows.
    pub time: Vec<f64>,
    /// rad (m for a prismatic joint), rows x n.
    pub position: Vec<f64>,
    /// rad/s, rows x n, where the controller gives it. `None`: found from positions.
    pub velocity: Option<Vec<f64>>,
    /// Nm at the joint, rows x n: a torque sensor's, or current times ratio and torque constant.
    pub torque: Vec<f64>,
    /// Nm at the joint by another simulation, rows x n: what is looked at is measured minus simulated. `None`: those of the declared masses, or of
    /// identified ones, are the simulation.
    pub simulated: Option<Vec<f64>>,
    /// Temperature of the gears, K or degrees C; length rows.
    pub temperature: Option<Vec<f64>>,
    /// Which trajectory a row belongs to, length rows: nothing is filtered from one into the next unless the clock goes on without a gap.
    pub trajectory: Vec<u32>,
    /// Rows that judge in the end and choose nothing, length rows.
    pub held_out: Vec<bool>,
    /// Whether torques are motor currents times ratio and torque constant; else a torque sensor's.
    pub from_current: bool,
}

impl TorqueRecording {
    /// A motion of one trajectory without torques, s and rad, positions row-major.
    pub(super) fn of_motion(joints: usize, time: Vec<f64>, position: Vec<f64>) -> Self {
        let rows = time.len();
        Self {
            joints,
            time,
            position,
            trajectory: vec![1; rows],
            held_out: vec![false; rows],
            ..Self::default()
        }
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.time.len()
    }

    /// No rows of the columns that another has.
    pub(super) fn like(other: &Self) -> Self {
        Self {
            joints: other.joints,
            velocity: other.velocity.as_ref().map(|_| Vec::new()),
            simulated: other.simulated.as_ref().map(|_| Vec::new()),
            temperature: other.temperature.as_ref().map(|_| Vec::new()),
            from_current: other.from_current,
            ..Self::default()
        }
    }

    /// Columns of numbers, and how many of them a row has.
    pub(super) fn columns(&self) -> [(Option<&Vec<f64>>, usize); 6] {
        [
            (Some(&self.time), 1),
            (Some(&self.position), self.joints),
            (self.velocity.as_ref(), self.joints),
            (Some(&self.torque), self.joints),
            (self.simulated.as_ref(), self.joints),
            (self.temperature.as_ref(), 1),
        ]
    }

    /// Does something with each column of numbers and the same of another; the number of values per row is passed on.
    pub(super) fn each(
        &mut self,
        other: &Self,
        mut take: impl FnMut(&mut Vec<f64>, &[f64], usize),
    ) {
        let columns = [
            Some(&mut self.time),
            Some(&mut self.position),
            self.velocity.as_mut(),
            Some(&mut self.torque),
            self.simulated.as_mut(),
            self.temperature.as_mut(),
        ];
        for (column, (other, wide)) in columns.into_iter().zip(other.columns()) {
            if let (Some(column), Some(other)) = (column, other) {
                take(column, other, wide);
            }
        }
    }

    /// Appends rows of a recording with the same columns.
    pub(super) fn extend(&mut self, other: &Self, rows: Range<usize>) {
        self.each(other, |column, other, wide| {
            column.extend_from_slice(&other[rows.start * wide..rows.end * wide]);
        });
        self.trajectory.extend(&other.trajectory[rows.clone()]);
        self.held_out.extend(&other.held_out[rows]);
    }

    /// Takes the first rows away.
    pub(super) fn forget(&mut self, rows: usize) {
        let mut kept = Self::like(self);
        kept.extend(self, rows..self.rows());
        *self = kept;
    }
}

/// A recording of torques that is read in blocks.
pub trait TorqueSource {
    /// Number of joints n.
    fn joints(&self) -> usize;

    /// Number of rows.
    fn rows(&self) -> usize;

    /// Hands on all rows in their order, block after block, each with the same columns.
    ///
    /// # Errors
    /// What reading fails with, and what `take` fails with.
    fn blocks(&self, take: &mut dyn FnMut(&TorqueRecording) -> Result<()>) -> Result<()>;

    /// Recorded rows that some rows (ascending) are, or come after where they are made up.
    ///
    /// # Errors
    /// What reading it fails with.
    fn recorded(&self, rows: &[usize]) -> Result<Vec<usize>> {
        Ok(rows.to_vec())
    }
}

impl TorqueSource for TorqueRecording {
    fn joints(&self) -> usize {
        self.joints
    }

    fn rows(&self) -> usize {
        self.rows()
    }

    fn blocks(&self, take: &mut dyn FnMut(&TorqueRecording) -> Result<()>) -> Result<()> {
        take(self)
    }
}

// Arithmetic of courses.

/// One column of row-major values.
pub(super) fn column(values: &[f64], n: usize, joint: usize) -> Vec<f64> {
    values.iter().skip(joint).step_by(n).copied().collect()
}

/// All columns of row-major values.
pub(super) fn by_joint(values: &[f64], n: usize) -> Vec<Vec<f64>> {
    (0..n).map(|joint| column(values, n, joint)).collect()
}

/// Adds so much of a course.
pub(super) fn add(sum: &mut [f64], share: f64, part: &[f64]) {
    sum.iter_mut()
        .zip(part)
        .for_each(|(sum, part)| *sum += share * part);
}

/// Product of two courses of one length.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums at once: one would wait for itself.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let pairs = a4.remainder().iter().zip(b4.remainder());
    let remainder: f64 = pairs.map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for lane in 0..4 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    sums.iter().sum::<f64>() + remainder
}

/// Sum of the squares of a course.
pub(super) fn square(course: &[f64]) -> f64 {
    course.iter().map(|value| value * value).sum()
}

/// Least and greatest of what is known of some values; none are beyond each other.
pub(super) fn ends(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let known = values.into_iter().filter(|value| value.is_finite());
    known.fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[least, most], value| [least.min(value), most.max(value)],
    )
}

/// The largest size of some values, 0 of none.
pub(super) fn largest<'v>(values: impl IntoIterator<Item = &'v f64>) -> f64 {
    let sizes = values.into_iter().map(|value| value.abs());
    sizes.fold(0.0, f64::max)
}

/// Weight of each of some nodes in the polynomial through them, at a place.
pub(super) fn lagrange(nodes: &[f64], at: f64) -> impl Iterator<Item = f64> {
    nodes.iter().map(move |node| {
        let others = nodes.iter().filter(move |other| *other != node);
        others
            .map(|other| (at - other) / (node - other))
            .product::<f64>()
    })
}

/// A step of the clock longer than so many usual ones is a gap.
const GAP: f64 = 1.5;
/// A step of a joint so many times the largest usual one is a jump: trajectories that were cut out and put together.
const JUMP: f64 = 4.0;

/// Rate and runs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RecordingClock {
    /// Hz.
    pub(crate) rate: f64,
    /// Rows without a gap in time or position, ascending.
    pub(crate) stretches: Vec<Range<usize>>,
}

impl RecordingClock {
    /// The clock of a motion of one trajectory in even steps, s.
    pub(crate) fn even(time: &[f64]) -> Self {
        let rows = time.len();
        let rate = (rows - 1) as f64 / (time[rows - 1] - time[0]);
        Self {
            rate,
            stretches: std::iter::once(0..rows).collect(),
        }
    }

    /// The clock of a checked recording.
    pub(crate) fn of(recording: &TorqueRecording) -> Self {
        Self::paced(recording, &ClockPace::of(recording))
    }

    /// The clock of rows of a recording whose pace is known.
    pub(crate) fn paced(recording: &TorqueRecording, pace: &ClockPace) -> Self {
        let mut stretches = Vec::new();
        let mut start = 0;
        for row in 1..=recording.rows() {
            if row == recording.rows() || pace.is_torn(recording, row) {
                stretches.push(start..row);
                start = row;
            }
        }
        Self {
            rate: 1.0 / pace.usual,
            stretches,
        }
    }
}

/// How fast rows come, and how far joints go from row to row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ClockPace {
    /// s from row to row, median.
    pub(crate) usual: f64,
    /// rad from row to row, per joint: 999 of 1000 steps are shorter.
    pub(crate) fastest: Vec<f64>,
}

impl ClockPace {
    /// The pace of a checked recording.
    pub(crate) fn of(recording: &TorqueRecording) -> Self {
        let fastest = |joint: usize| {
            let mut all: Vec<f64> = (1..recording.rows())
                .map(|row| step(recording, row, joint))
                .collect();
            nearest(&mut all, 0.999).unwrap_or(0.0)
        };
        Self {
            usual: Self::usual_step(&recording.time),
            fastest: (0..recording.joints).map(fastest).collect(),
        }
    }

    /// s from row to row, median.
    pub(crate) fn usual_step(time: &[f64]) -> f64 {
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        nearest(&mut steps, 0.5).unwrap_or(1.0)
    }

    /// Whether clock or joints jump before a row, which is not the first one.
    pub(crate) fn is_torn(&self, recording: &TorqueRecording, row: usize) -> bool {
        let lasted = recording.time[row] - recording.time[row - 1];
        let jumps =
            |(joint, fastest): (usize, &f64)| step(recording, row, joint) > JUMP * fastest + 1e-12;
        lasted > GAP * self.usual || lasted <= 0.0 || self.fastest.iter().enumerate().any(jumps)
    }
}

/// rad from the row before.
fn step(recording: &TorqueRecording, row: usize, joint: usize) -> f64 {
    let n = recording.joints;
    (recording.position[row * n + joint] - recording.position[(row - 1) * n + joint]).abs()
}

// The cut-off of the low-pass, where none is asked for: from how fast the joints come and go.

/// Friction that turns with a joint's direction needs so many harmonics of how often the joint comes and goes.
const HARMONICS: f64 = 60.0;
/// Hz, at least: joints swing faster than they are moved.
const LEAST: f64 = 10.0;
/// At most this share of the rate.
const LARGEST: f64 = 0.1;
/// s over which a velocity is taken: beyond the steps of encoders.
const STEP: f64 = 0.02;

/// Hz; the rate of the clock still bounds it.
pub(super) fn cutoff(recording: &TorqueRecording, clock: &RecordingClock) -> f64 {
    let mut pace = MotionPace::new(recording.joints);
    pace.push(recording, clock, false);
    pace.cutoff(clock.rate)
}

/// How often joints come and go, gathered over rows that may be read in blocks.
pub(super) struct MotionPace {
    joints: Vec<JointPace>,
}

/// The sums of one joint.
#[derive(Debug, Clone, Copy, Default)]
struct JointPace {
    /// Squared velocity, and squared angle about the mean of its stretch, summed over rows of all stretches that have ended.
    ended: [f64; 2],
    /// Sums of the present stretch: rows, mean angle and squares about it; rows of which a velocity is known, and its squares.
    rows: f64,
    mean: f64,
    apart: f64,
    moving: f64,
    moved: f64,
}

impl JointPace {
    /// Takes rows of the present stretch: angles (rad) at `rate` Hz, velocities over so many rows.
    fn push(&mut self, angles: &[f64], rate: f64, step: usize) {
        let rows = angles.len() as f64;
        let mean = angles.iter().sum::<f64>() / rows;
        let away = mean - self.mean;
        let share = rows / (self.rows + rows);
        self.apart += angles
            .iter()
            .map(|angle| (angle - mean).powi(2))
            .sum::<f64>()
            + away * away * self.rows * share;
        self.mean += away * share;
        self.rows += rows;
        let later = angles.get(step..).unwrap_or_default();
        self.moved += angles
            .iter()
            .zip(later)
            .map(|(from, to)| ((to - from) * rate / step as f64).powi(2))
            .sum::<f64>();
        self.moving += later.len() as f64;
    }

    fn end_stretch(&mut self) {
        let [moved, apart] = self.ended;
        let known = self.moving > 0.0;
        let ended = if known {
            [
                moved + self.moved / self.moving * self.rows,
                apart + self.apart,
            ]
        } else {
            self.ended
        };
        *self = Self {
            ended,
            ..Self::default()
        };
    }
}

impl MotionPace {
    /// The sums of no rows of n joints.
    pub(crate) fn new(joints: usize) -> Self {
        Self {
            joints: vec![JointPace::default(); joints],
        }
    }

    /// Takes rows; whether the first stretch of them continues the last one of those before.
    pub(crate) fn push(
        &mut self,
        recording: &TorqueRecording,
        clock: &RecordingClock,
        continues: bool,
    ) {
        let step = ((STEP * clock.rate) as usize).max(1);
        for (joint, pace) in self.joints.iter_mut().enumerate() {
            let angles = column(&recording.position, recording.joints, joint);
            for (place, stretch) in clock.stretches.iter().enumerate() {
                if place > 0 || !continues {
                    pace.end_stretch();
                }
                pace.push(&angles[stretch.clone()], clock.rate, step);
            }
        }
    }

    /// Hz, for a clock of `rate` Hz. A joint comes and goes as often as a sine of the same rms of velocity and of angle.
    pub(crate) fn cutoff(mut self, rate: f64) -> f64 {
        self.joints.iter_mut().for_each(JointPace::end_stretch);
        let often = |[moved, apart]: [f64; 2]| {
            if apart > 0.0 {
                (moved / apart).sqrt() / (2.0 * PI)
            } else {
                0.0
            }
        };
        let mut paces: Vec<f64> = self.joints.iter().map(|joint| often(joint.ended)).collect();
        let usual = nearest(&mut paces, 0.5).unwrap_or(0.0);
        (HARMONICS * usual).clamp(LEAST, (LARGEST * rate).max(LEAST))
    }
}

/// Rows lost in a row, at most; a longer gap ends a stretch.
const LOST: usize = 5;
/// Steps before and after a long one that say whether rows are lost there or a row is stamped late.
const AROUND: usize = 2;

/// A recording without small gaps.
pub(super) struct Bridged {
    pub(crate) recording: TorqueRecording,
    /// The recorded row of each, or the one before it where it is made up.
    pub(crate) origin: Vec<usize>,
}

impl Bridged {
    /// Bridges the gaps of a checked recording.
    pub(crate) fn of(recording: TorqueRecording) -> Self {
        let usual = ClockPace::usual_step(&recording.time);
        Self::by_steps(recording, usual)
    }

    /// The same of rows that usually come every so many s.
    pub(crate) fn by_steps(recording: TorqueRecording, usual: f64) -> Self {
        let lost = lost(&recording, usual);
        let mut origin: Vec<usize> = (0..recording.rows()).collect();
        if lost.is_empty() {
            return Self { recording, origin };
        }
        origin.clear();
        // Recorded rows with their weights, of each row.
        let mut weights = Vec::new();
        let mut next = lost.iter().peekable();
        for row in 0..recording.rows() {
            origin.push(row);
            weights.push(vec![(row, 1.0)]);
            if let Some((_, count)) = next.next_if(|(before, _)| *before == row) {
                origin.extend(std::iter::repeat_n(row, *count));
                let steps = (count + 1) as f64;
                let made = |k: usize| between(&recording.trajectory, row, k as f64 / steps, steps);
                weights.extend((1..=*count).map(made));
            }
        }
        let mut whole = TorqueRecording::like(&recording);
        whole.each(&recording, |column, recorded, wide| {
            let value = |row: &[(usize, f64)], entry: usize| -> f64 {
                let parts = row.iter();
                parts
                    .map(|(at, weight)| weight * recorded[at * wide + entry])
                    .sum()
            };
            let rows = weights.iter();
            column.extend(rows.flat_map(|row| (0..wide).map(move |entry| value(row, entry))));
        });
        whole.trajectory = origin
            .iter()
            .map(|row| recording.trajectory[*row])
            .collect();
        whole.held_out = origin.iter().map(|row| recording.held_out[*row]).collect();
        Self {
            recording: whole,
            origin,
        }
    }
}

/// A sentence where rows are made up.
pub(super) fn bridged_remark(made_up: usize) -> Option<String> {
    (made_up > 0).then(|| {
        format!(
            "bridged between their neighbours: {} of the clock without a row",
            counted(made_up, "step")
        )
    })
}

/// Recorded rows with their weights of a row that is so far from one to the next: of the cubic through two on either side, since a straight
/// line has a jump of speed at its ends; of the straight line where a stretch begins or ends there.
fn between(trajectory: &[u32], row: usize, share: f64, steps: f64) -> Vec<(usize, f64)> {
    let goes_on =
        row >= 1 && row + 2 < trajectory.len() && trajectory[row - 1] == trajectory[row + 2];
    let (first, nodes) = match goes_on {
        true => (row - 1, vec![-1.0, 0.0, steps, steps + 1.0]),
        false => (row, vec![0.0, steps]),
    };
    (first..).zip(lagrange(&nodes, share * steps)).collect()
}

/// Rows after which some are lost, and how many.
fn lost(recording: &TorqueRecording, usual: f64) -> Vec<(usize, usize)> {
    let time = &recording.time;
    let after = |row: usize| {
        let (first, last) = (
            row.saturating_sub(AROUND),
            (row + 1 + AROUND).min(time.len() - 1),
        );
        if recording.trajectory[first] != recording.trajectory[last] {
            return None;
        }
        let here = ((time[row + 1] - time[row]) / usual).round() - 1.0;
        let around = ((time[last] - time[first]) / usual).round() - (last - first) as f64;
        let count = here.min(around);
        (count >= 1.0 && count <= LOST as f64).then_some((row, count as usize))
    };
    (0..time.len().saturating_sub(1))
        .filter_map(after)
        .collect()
}
