//! Recordings of joint torques while the arm moves: arrays in SI on the joint side, rows in the order of time; of those that may be longer than
//! memory, rows come in blocks, as often as they are asked for.

use crate::error::Result;
use std::ops::Range;

/// Rows of n joints, row-major (rows x n).
#[derive(Debug, Clone, PartialEq)]
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
            velocity: None,
            torque: Vec::new(),
            temperature: None,
            trajectory: vec![1; rows],
            held_out: vec![false; rows],
            from_current: false,
        }
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.time.len()
    }

    /// No rows of the columns that another has.
    pub(super) fn like(other: &Self) -> Self {
        Self {
            velocity: other.velocity.as_ref().map(|_| Vec::new()),
            temperature: other.temperature.as_ref().map(|_| Vec::new()),
            from_current: other.from_current,
            trajectory: Vec::new(),
            held_out: Vec::new(),
            ..Self::of_motion(other.joints, Vec::new(), Vec::new())
        }
    }

    /// Appends rows of a recording with the same columns.
    pub(super) fn extend(&mut self, other: &Self, rows: Range<usize>) {
        let wide = rows.start * self.joints..rows.end * self.joints;
        let both = |own: &mut Option<Vec<f64>>, other: &Option<Vec<f64>>, rows: Range<usize>| {
            own.iter_mut()
                .zip(other)
                .for_each(|(own, other)| own.extend_from_slice(&other[rows.clone()]));
        };
        self.time.extend_from_slice(&other.time[rows.clone()]);
        self.position
            .extend_from_slice(&other.position[wide.clone()]);
        both(&mut self.velocity, &other.velocity, wide.clone());
        self.torque.extend_from_slice(&other.torque[wide]);
        both(&mut self.temperature, &other.temperature, rows.clone());
        self.trajectory
            .extend_from_slice(&other.trajectory[rows.clone()]);
        self.held_out.extend_from_slice(&other.held_out[rows]);
    }

    /// Takes the first rows away.
    pub(super) fn forget(&mut self, rows: usize) {
        let wide = rows * self.joints;
        self.time.drain(..rows);
        self.position.drain(..wide);
        self.velocity
            .iter_mut()
            .for_each(|all| drop(all.drain(..wide)));
        self.torque.drain(..wide);
        self.temperature
            .iter_mut()
            .for_each(|all| drop(all.drain(..rows)));
        self.trajectory.drain(..rows);
        self.held_out.drain(..rows);
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
