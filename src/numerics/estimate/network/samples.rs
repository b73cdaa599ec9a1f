//! What a correction is learnt from.

use super::perceptron::OUTPUTS;
use crate::robot::pose_groups::{NEAR, grouped};

/// Rows to learn from: sources (joints, payload) and the residual to be explained, m.
#[derive(Debug, Clone, Default)]
pub struct TrainingSamples {
    /// Inputs of each row: joints (rad or m), then payload (kg).
    pub sources: Vec<Vec<f64>>,
    /// Measured minus predicted of each row, m.
    pub residual: Vec<[f64; OUTPUTS]>,
}

impl TrainingSamples {
    /// How many rows.
    pub fn rows(&self) -> usize {
        self.residual.len()
    }
    /// The pose of each row, numbered in the order of their first rows: several targets measured in one pose share it.
    pub fn poses(&self) -> Vec<usize> {
        let rows: Vec<usize> = (0..self.rows()).collect();
        let mut number = vec![0; self.rows()];
        // A payload (kg) as near as joints (rad, m) are is the same one.
        let poses = grouped(&rows, |row| &self.sources[row], NEAR, |_, _| true);
        for (pose, rows) in poses.iter().enumerate() {
            rows.iter().for_each(|row| number[*row] = pose);
        }
        number
    }

    /// Some of the rows.
    pub fn pick(&self, rows: &[usize]) -> Self {
        Self {
            sources: rows.iter().map(|r| self.sources[*r].clone()).collect(),
            residual: rows.iter().map(|r| self.residual[*r]).collect(),
        }
    }
}
