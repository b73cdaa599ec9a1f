//! What a correction is learnt from.

use super::perceptron::OUTPUTS;

/// Sources (rad, m, kg) closer than this are the same: below any controller's resolution.
const SAME: f64 = 1e-9;

/// Rows to learn from: sources (joints, payload) and the residual to be explained, m.
#[derive(Debug, Clone, Default)]
pub struct TrainingSamples {
    pub sources: Vec<Vec<f64>>,
    pub residual: Vec<[f64; OUTPUTS]>,
}

impl TrainingSamples {
    pub fn rows(&self) -> usize {
        self.residual.len()
    }
    /// The pose of each row, numbered in the order of their first rows: several targets measured in one pose share it.
    pub fn poses(&self) -> Vec<usize> {
        let by_source = |a: &usize, b: &usize| {
            let pairs = self.sources[*a].iter().zip(&self.sources[*b]).map(|(x, y)| x.total_cmp(y));
            pairs.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then).then(a.cmp(b))
        };
        let mut sorted: Vec<usize> = (0..self.rows()).collect();
        sorted.sort_unstable_by(by_source);
        let same = |a: &usize, b: &usize| self.sources[*a].iter().zip(&self.sources[*b]).all(|(x, y)| (x - y).abs() < SAME);
        let mut first = vec![0; self.rows()];
        for pose in sorted.chunk_by(same) {
            let least = pose.iter().min().copied().unwrap_or(0);
            pose.iter().for_each(|row| first[*row] = least);
        }
        let mut number = vec![usize::MAX; self.rows()];
        let mut count = 0;
        first
            .into_iter()
            .enumerate()
            .map(|(row, first)| {
                if first == row {
                    (number[row], count) = (count, count + 1);
                }
                number[first]
            })
            .collect()
    }

    pub fn pick(&self, rows: &[usize]) -> Self {
        Self {
            sources: rows.iter().map(|r| self.sources[*r].clone()).collect(),
            residual: rows.iter().map(|r| self.residual[*r]).collect(),
        }
    }
}
