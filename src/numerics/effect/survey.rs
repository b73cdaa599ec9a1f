//! What a recording offers to hypotheses: ranges, loads, times, and which columns it has.

use super::Form;
use crate::robot::{Measurements, Posture, RobotModel, range};
use nalgebra::Vector3;

/// The fitted rows of a recording as seen from the present model.
pub struct Survey<'a> {
    /// The present model's arm.
    pub robot: &'a RobotModel,
    /// All rows of the recording.
    pub data: &'a Measurements,
    /// Fitted rows of the recording, ascending.
    pub rows: &'a [usize],
    /// Load torque (Nm) of every fitted row and joint, row-major.
    pub torque: &'a [f64],
    /// How far each joint yields under load in the present model, rad/Nm.
    pub(crate) compliance: &'a [f64],
    /// Lowest and highest position of each joint, rad or m.
    pub range: Vec<[f64; 2]>,
    /// Times (s) between neighbouring fitted rows, ascending, ends left out.
    pub boundaries: Vec<f64>,
    /// First and last time of fitted rows, s.
    pub(crate) time: [f64; 2],
    /// First temperature, C, where recorded.
    pub(crate) reference_c: Option<f64>,
    /// First and last boundary about the only change of the payload, s; none where it does not change or changes more often.
    payload_change: Option<[f64; 2]>,
}

/// At either end of a recording so many rows must lie beyond a change point: fewer are a few wrong points.
const EDGE: usize = 5;

/// A joint that moves by less stands: rad or m.
pub const STANDS: f64 = 1e-3;

impl<'a> Survey<'a> {
    /// Ranges and times of the fitted rows; `torque` (Nm) row-major by fitted row, `compliance` (rad/Nm) by joint.
    pub fn new(
        robot: &'a RobotModel,
        data: &'a Measurements,
        rows: &'a [usize],
        torque: &'a [f64],
        compliance: &'a [f64],
    ) -> Self {
        let of_joint = |joint: usize| range(rows.iter().map(|row| data.q(*row)[joint]));
        let mut times: Vec<f64> = rows.iter().map(|row| data.time(*row)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let between: Vec<f64> = times
            .windows(2)
            .map(|pair| 0.5 * (pair[0] + pair[1]))
            .collect();
        let boundaries = between
            .get(EDGE - 1..between.len().saturating_sub(EDGE - 1))
            .unwrap_or_default()
            .to_vec();
        let time = [
            times.first().copied().unwrap_or(0.0),
            times.last().copied().unwrap_or(0.0),
        ];
        let reference_c = rows.first().and_then(|row| data.temperature(*row));
        let payload_change = only_payload_change(data, rows).and_then(|at| {
            let near = near(&boundaries, at);
            Some([*near.first()?, *near.last()?])
        });
        Self {
            robot,
            data,
            rows,
            torque,
            compliance,
            range: (0..robot.joints()).map(of_joint).collect(),
            boundaries,
            time,
            reference_c,
            payload_change,
        }
    }

    /// Whether the payload changes once, so that what follows it may as well have moved then.
    pub fn payload_changes_once(&self) -> bool {
        self.payload_change.is_some()
    }

    /// Whether what steps at a time may as well follow the payload, which changes once, and about then.
    pub fn is_payload_change(&self, time: f64) -> bool {
        self.payload_change
            .is_some_and(|[first, last]| (first..=last).contains(&time))
    }

    /// Joints of the arm.
    pub fn joints(&self) -> usize {
        self.robot.joints()
    }

    /// Joints that turn.
    pub fn revolute(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.joints()).filter(|joint| self.robot.is_revolute(*joint))
    }

    /// Whether the arm moved while it was measured.
    pub(crate) fn moves(&self) -> bool {
        self.data.in_motion(self.rows)
    }

    /// How far a joint moves, rad or m.
    pub fn travel(&self, joint: usize) -> f64 {
        (self.range[joint][1] - self.range[joint][0]).max(0.0)
    }

    /// Whether a joint stands in all rows.
    pub fn stands(&self, joint: usize) -> bool {
        self.travel(joint) < STANDS
    }

    /// Load torques of a joint, Nm.
    pub(crate) fn torques(&self, joint: usize) -> impl Iterator<Item = f64> + '_ {
        self.torque
            .iter()
            .skip(joint)
            .step_by(self.joints().max(1))
            .copied()
    }

    /// Largest load torque of a joint, Nm.
    pub(crate) fn load(&self, joint: usize) -> f64 {
        self.torques(joint)
            .fold(0.0, |most, torque| most.max(torque.abs()))
    }

    /// Largest load torque (Nm) of a joint that the recording holds: by the present model, and no more than robot file and stated payloads
    /// make, since a load that a model itself makes up is not recorded.
    pub(crate) fn recorded_load(&self, joint: usize) -> f64 {
        let stated = |row: &usize| {
            Posture::as_stated(self.robot, self.data.q(*row), self.data.payload[*row]).torque[joint]
                .abs()
        };
        self.rows
            .iter()
            .map(stated)
            .fold(0.0, f64::max)
            .min(self.load(joint))
    }

    /// From the first fitted row to the last, s.
    pub(crate) fn length(&self) -> f64 {
        self.time[1] - self.time[0]
    }

    /// Whether gravity loads the joint enough to speak of it.
    pub fn is_loaded(&self, joint: usize) -> bool {
        let most = (0..self.joints())
            .map(|joint| self.load(joint))
            .fold(0.0, f64::max);
        self.robot.is_revolute(joint) && self.load(joint) > (1e-3 * most).max(1e-6)
    }

    /// Whether the joint came from both sides.
    pub fn both_directions(&self, joint: usize) -> bool {
        let signs = || self.rows.iter().map(|row| self.data.direction(*row, joint));
        signs().any(|sign| sign > 0.0) && signs().any(|sign| sign < 0.0)
    }

    /// At most `most` change points, evenly taken.
    pub fn changes(&self, most: usize) -> impl Iterator<Item = f64> + '_ {
        self.boundaries
            .iter()
            .step_by(self.boundaries.len().div_ceil(most.max(1)).max(1))
            .copied()
    }

    /// The change points around one.
    pub(crate) fn changes_near(&self, time: f64) -> &[f64] {
        near(&self.boundaries, time)
    }

    /// Whether an instrument at the recording's origin sees the points from outside: then they are nowhere as far apart as it is away.
    pub fn seen_from_outside(&self) -> bool {
        let points = || self.rows.iter().filter_map(|row| self.data.point(*row));
        let count = points().count();
        let middle = points().sum::<Vector3<f64>>() / count.max(1) as f64;
        count > 0 && points().all(|point| (point - middle).norm() < middle.norm())
    }

    /// Whether some but not all rows carry (more than half of the largest) payload.
    pub fn payload_changes(&self) -> bool {
        let heavy = self.heavy_payload();
        let loaded = self
            .rows
            .iter()
            .filter(|row| self.data.payload[**row] > heavy)
            .count();
        loaded > 0 && loaded < self.rows.len()
    }

    /// Half of the largest payload, kg.
    pub fn heavy_payload(&self) -> f64 {
        let payloads = self.rows.iter().map(|row| self.data.payload[*row]);
        0.5 * payloads.fold(0.0, f64::max)
    }
}

/// Those of some change points that are around a time.
fn near(boundaries: &[f64], time: f64) -> &[f64] {
    let at = boundaries.partition_point(|other| *other < time);
    let reach = boundaries.len().div_ceil(40).max(1) + 1;
    &boundaries[at.saturating_sub(reach)..(at + reach).min(boundaries.len())]
}

/// When the payload of some rows changes (s), where it does so once.
fn only_payload_change(data: &Measurements, rows: &[usize]) -> Option<f64> {
    let mut by_time: Vec<(f64, f64)> = rows
        .iter()
        .map(|row| (data.time(*row), data.payload[*row]))
        .collect();
    by_time.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut changes = by_time
        .windows(2)
        .filter(|pair| pair[0].1 != pair[1].1)
        .map(|pair| 0.5 * (pair[0].0 + pair[1].0));
    changes.next().filter(|_| changes.next().is_none())
}

/// An effect at a place in a form: a shape of the cell that its cause is there.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// What it would add to the model.
    pub form: Form,
    /// How many forms of the kind are tried, which share the weight of one among the shapes of a cell.
    pub tried: f64,
    /// -2 ln of the prior odds against the other shapes of its cell.
    pub prior_penalty: f64,
    /// True where only positive coefficients make sense.
    pub positive: bool,
    /// The largest coefficient that makes sense, SI.
    pub largest: f64,
}

impl Hypothesis {
    /// A hypothesis of `tried` like ones.
    pub fn new(form: impl Into<Form>, tried: usize) -> Self {
        Self {
            form: form.into(),
            tried: tried.max(1) as f64,
            prior_penalty: 0.0,
            positive: false,
            largest: f64::INFINITY,
        }
    }

    /// With coefficients that must be positive.
    pub(crate) fn positive(self) -> Self {
        Self {
            positive: true,
            ..self
        }
    }

    /// With coefficients up to `largest`, SI.
    pub(crate) fn within(self, largest: f64) -> Self {
        Self { largest, ..self }
    }

    /// Less likely beside the other shapes of its cell, -2 ln of the odds.
    pub(crate) fn penalised(self, prior_penalty: f64) -> Self {
        Self {
            prior_penalty: self.prior_penalty + prior_penalty,
            ..self
        }
    }
}
