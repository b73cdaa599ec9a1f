//! Measurements as the numerics see them: rows with their joints and circumstances, and what was read in them by kind.

use crate::robot::instrument::NoiseBasis;
use crate::robot::pose_groups::{NEAR, SAME, Sequence, near};
use crate::robot::readings::{Named, PointReadings, Reading, Readings};
use nalgebra::{Matrix3, Vector3};
use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, PoisonError, RwLock};

/// When a row is for a model: by the clock of the recording from which it was identified, or after all that this recording saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowTime {
    /// s of that clock.
    At(f64),
    /// Long after that recording: what steps has stepped, and the arm is warm.
    LongAfter,
}

/// Numbers that are kept: before more, all are forgotten.
const KEPT: usize = 1 << 22;

/// Which state: its kind, a joint, the bits of its constant.
pub(super) type Key = (u8, usize, u64);

/// States of a recording, one of each row. A copy begins with none, since its rows may be changed.
#[derive(Default)]
pub struct Memories {
    known: RwLock<HashMap<Key, Arc<[f64]>>>,
}

impl Clone for Memories {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl std::fmt::Debug for Memories {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Memories")
    }
}

impl Memories {
    /// A state at a row, computed for every row where it was not asked for before.
    pub(super) fn of(&self, key: Key, row: usize, along: impl FnOnce() -> Arc<[f64]>) -> f64 {
        let known = self
            .known
            .read()
            .unwrap_or_else(PoisonError::into_inner)
            .get(&key)
            .map(|states| states[row]);
        known.unwrap_or_else(|| {
            let states = along();
            let value = states[row];
            let mut known = self.known.write().unwrap_or_else(PoisonError::into_inner);
            if known.len() * states.len() > KEPT {
                known.clear();
            }
            known.insert(key, states);
            value
        })
    }
}

/// Measured rows, struct of arrays; per-joint quantities row-major (`row * joints + joint`). SI; NaN where a row lacks a quantity.
#[derive(Debug, Clone, Default)]
pub struct Measurements {
    /// Joints of the arm, the width of per-joint rows.
    pub joints: usize,
    /// rad or m.
    pub q: Vec<f64>,
    /// kg; 0 where nothing was said.
    pub payload: Vec<f64>,
    /// A.
    pub current: Option<Vec<f64>>,
    /// s; where no row has one, the number of the row stands for it.
    pub time: Option<Vec<f64>>,
    /// Whether the model that predicts these rows knows another clock than theirs and was identified long before. Their times then tell what
    /// lies between them, and nothing else.
    pub long_after: bool,
    /// Temperature of the arm, C.
    pub temperature: Option<Vec<f64>>,
    /// Circumstances that declared laws read by name, SI: one number a row, or one for each joint.
    pub circumstances: BTreeMap<&'static str, Vec<f64>>,
    /// Direction of the last move of each joint, +1 / -1; without it the order of the rows tells.
    pub direction: Option<Vec<f64>>,
    /// Velocity of each joint when the point was measured, rad/s or m/s; without it the arm stood.
    pub velocity: Option<Vec<f64>>,
    /// What the standard deviations of points and `spread` rest on.
    pub noise_basis: NoiseBasis,
    /// Covariance (m2) of where each row's target is beyond the instrument's, e.g. from the joints' repeatability.
    pub spread: Option<Vec<Matrix3<f64>>>,
    /// By kind beside points and row: variance of each number beyond the instrument's, from the joints' repeatability, in the kind's unit squared.
    pub reading_spread: BTreeMap<&'static str, Vec<f64>>,
    /// The target that each row measured; the tool point where rows name none.
    pub target: Option<Named>,
    /// What was read of points.
    pub points: PointReadings,
    /// What was read of other kinds; one entry a kind.
    pub readings: Vec<Readings>,
    /// The order in which the rows were measured, where it is another one than theirs.
    pub sequence: Option<Sequence>,
    /// What was asked of what rows remember.
    pub memories: Memories,
}

impl Measurements {
    /// How many rows were measured, of whatever kinds.
    #[inline]
    pub fn rows(&self) -> usize {
        self.q.len().checked_div(self.joints).unwrap_or(0)
    }

    /// Joint positions of a row, rad or m.
    #[inline]
    pub fn q(&self, row: usize) -> &[f64] {
        &self.q[row * self.joints..(row + 1) * self.joints]
    }

    /// Motor currents of a row, A, where recorded.
    pub fn current(&self, row: usize) -> Option<&[f64]> {
        self.current
            .as_ref()
            .map(|all| &all[row * self.joints..(row + 1) * self.joints])
    }

    /// Whether any row has a time: else [`Measurements::time`] counts rows.
    pub fn has_clock(&self) -> bool {
        self.time
            .as_ref()
            .is_some_and(|all| all.iter().any(|time| time.is_finite()))
    }

    /// s from some start, that of the last row that has one where this row has none; without a clock the number of the row, from 0.
    pub fn time(&self, row: usize) -> f64 {
        self.time
            .as_ref()
            .and_then(|all| nearest(all, row))
            .unwrap_or(row as f64)
    }

    /// When a row is for a law of time.
    pub(crate) fn row_time(&self, row: usize) -> RowTime {
        if self.long_after {
            RowTime::LongAfter
        } else {
            RowTime::At(self.time(row))
        }
    }

    /// C; that of the last row that has one where this row has none.
    pub fn temperature(&self, row: usize) -> Option<f64> {
        nearest(self.temperature.as_ref()?, row)
    }

    /// A circumstance (SI) of a joint, from 0, or of the whole row: that of the last row that has one where this row has none.
    pub(crate) fn circumstance(
        &self,
        column: &str,
        row: usize,
        joint: Option<usize>,
    ) -> Option<f64> {
        let all = self.circumstances.get(column)?;
        match joint {
            None => nearest(all, row),
            Some(joint) => all
                .get(row * self.joints + joint)
                .copied()
                .filter(|value| value.is_finite()),
        }
    }

    /// The row that was measured at a place, from 0, of the order of measurement.
    pub fn at_place(&self, place: usize) -> usize {
        self.sequence
            .as_ref()
            .map_or(place, |sequence| sequence.row(place))
    }

    /// The place of a row in the order of measurement, from 0.
    pub fn rank_in_time(&self, row: usize) -> usize {
        self.sequence
            .as_ref()
            .map_or(row, |sequence| sequence.rank_in_time(row))
    }

    /// The first row of the stop at which a row was measured: several targets in a row, one after the other in one pose.
    pub fn stop(&self, row: usize) -> usize {
        let Some(target) = &self.target else {
            return row;
        };
        let (here, name) = (self.rank_in_time(row), |place: usize| {
            target.name(self.at_place(place))
        });
        let mut first = (0..here)
            .rev()
            .take_while(|other| self.near_pose(self.at_place(*other), row))
            .last()
            .unwrap_or(here);
        for other in first + 1..=here {
            // The same target again: the arm came back to the pose.
            if (first..other).any(|k| name(k) == name(other)) {
                first = other;
            }
        }
        self.at_place(first)
    }

    /// Whether a row was measured at the recording's first stop, to which nobody knows the way.
    pub fn at_first_stop(&self, row: usize) -> bool {
        self.rank_in_time(self.stop(row)) == 0
    }

    /// The last row of the stop before that of a row, and the first row of its own; none at the first stop.
    pub(crate) fn preceding_move(&self, row: usize) -> Option<[usize; 2]> {
        let mut first = self.stop(row);
        loop {
            let before = self.at_place(self.rank_in_time(first).checked_sub(1)?);
            // Measured again before the arm left.
            if !self.near_pose(before, first) {
                return Some([before, first]);
            }
            first = self.stop(before);
        }
    }

    /// What joint `joint` moved (rad or m) from the stop before to that of this row; 0 at the first.
    pub fn last_move(&self, row: usize, joint: usize) -> f64 {
        self.preceding_move(row)
            .map_or(0.0, |[from, to]| self.q(to)[joint] - self.q(from)[joint])
    }

    /// Direction (+1 or -1) from which joint `joint` came to rest, as recorded or by the order of measurement; 0 if it never moved.
    pub fn direction(&self, row: usize, joint: usize) -> f64 {
        if let Some(direction) = self.recorded_direction(row, joint) {
            return direction;
        }
        let moves = (0..=self.rank_in_time(row))
            .rev()
            .map(|place| self.last_move(self.at_place(place), joint));
        moves
            .map(|moved| if moved == 0.0 { 0.0 } else { moved.signum() })
            .find(|sign| *sign != 0.0)
            .unwrap_or(0.0)
    }

    /// Direction (+1 or -1) that the recording gives a joint, if it gives one.
    pub(crate) fn recorded_direction(&self, row: usize, joint: usize) -> Option<f64> {
        let recorded = self
            .direction
            .as_ref()
            .map(|all| all[row * self.joints + joint]);
        recorded
            .filter(|value| value.is_finite() && *value != 0.0)
            .map(f64::signum)
    }

    /// Velocity of a joint, rad/s or m/s; 0 where none was recorded.
    pub fn velocity(&self, row: usize, joint: usize) -> f64 {
        let all = self.velocity.as_ref();
        all.and_then(|all| all.get(row * self.joints + joint))
            .copied()
            .filter(|value| value.is_finite())
            .unwrap_or(0.0)
    }

    /// Whether these rows are a recording of motion: in one of ten at least a joint moved.
    pub fn in_motion(&self, rows: &[usize]) -> bool {
        let moves = |row: &&usize| (0..self.joints).any(|joint| self.velocity(**row, joint) != 0.0);
        self.velocity.is_some() && 10 * rows.iter().filter(moves).count() > rows.len()
    }

    /// The name of the target that a row measured; empty for the tool point.
    pub fn target(&self, row: usize) -> &str {
        self.target.as_ref().map_or("", |target| target.name(row))
    }

    /// The point of a row (tracker frame, m) where all of its axes were measured: who needs a point in space asks for it here.
    pub fn point(&self, row: usize) -> Option<Vector3<f64>> {
        self.points.all_axes(row)
    }

    /// Whether all three axes of a row's point were measured.
    pub fn has_point(&self, row: usize) -> bool {
        self.points.all_axes(row).is_some()
    }

    /// Length (m) of the one-sigma noise of a row's point: root of the summed variances of what was measured of it.
    pub fn noise(&self, row: usize) -> f64 {
        self.points
            .noise(row, self.spread.as_ref().map(|all| &all[row]))
    }

    /// What a row measured of a kind beside points, by the kind's name.
    pub fn reading(&self, kind: &str, row: usize) -> Option<Reading<'_>> {
        self.readings
            .iter()
            .find(|readings| readings.kind == kind)?
            .row(row)
    }

    /// The anchor that a row measured from; empty where it has no name.
    pub fn anchor(&self, row: usize) -> Option<&str> {
        let mut anchored = self
            .readings
            .iter()
            .filter(|readings| readings.anchor.is_some());
        anchored
            .find_map(|readings| readings.row(row))
            .map(|reading| reading.anchor)
    }

    /// Whether rows `a` and `b` are the same pose under the same payload.
    pub fn same_pose(&self, a: usize, b: usize) -> bool {
        self.payload[a] == self.payload[b] && near(self.q(a), self.q(b), SAME)
    }

    /// The same of poses that differ by no more than a joint's return to one and the geometry of an arm is sure of.
    pub fn near_pose(&self, a: usize, b: usize) -> bool {
        self.payload[a] == self.payload[b] && near(self.q(a), self.q(b), NEAR)
    }
}

/// The value of a row, of the last one that has one, or of the next.
fn nearest(all: &[f64], row: usize) -> Option<f64> {
    (0..=row)
        .rev()
        .chain(row + 1..all.len())
        .map(|k| all[k])
        .find(|value| value.is_finite())
}
