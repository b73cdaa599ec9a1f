//! Recordings that may be longer than memory: rows come in blocks, as often as they are asked for.

use super::recording::TorqueRecording;
use crate::error::Result;

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
