//! What a correction is learnt from.

use super::perceptron::OUTPUTS;

/// Rows to learn from: sources (joints, payload) and the residual to be explained, m.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    pub sources: Vec<Vec<f64>>,
    pub residual: Vec<[f64; OUTPUTS]>,
}

impl Samples {
    pub fn rows(&self) -> usize {
        self.residual.len()
    }
    pub fn pick(&self, rows: &[usize]) -> Self {
        Self {
            sources: rows.iter().map(|r| self.sources[*r].clone()).collect(),
            residual: rows.iter().map(|r| self.residual[*r]).collect(),
        }
    }
}
