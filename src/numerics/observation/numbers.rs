//! What is left of a reading: as many numbers as its kind has in a row.

use nalgebra::Vector3;

/// Numbers of one kind in one row, at most; more are two kinds.
pub const WIDEST: usize = 8;

/// Measured - predicted of one kind in one row, in its unit or in standard deviations; as a slice it is as wide as the kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualNumbers {
    values: [f64; WIDEST],
    count: usize,
}

impl ResidualNumbers {
    /// A residual of so many numbers, [`WIDEST`] at most.
    pub fn new<const N: usize>(own: [f64; N]) -> Self {
        let mut values = [0.0; WIDEST];
        values[..N].copy_from_slice(&own);
        Self { values, count: N }
    }

    /// The sum of their squares.
    pub fn norm_squared(&self) -> f64 {
        self.iter().map(|value| value * value).sum()
    }

    /// The root of the sum of their squares.
    pub fn norm(&self) -> f64 {
        self.norm_squared().sqrt()
    }

    /// All of them times a factor.
    pub fn times(mut self, factor: f64) -> Self {
        self.values[..self.count]
            .iter_mut()
            .for_each(|value| *value *= factor);
        self
    }

    /// The first three of them; 0 where there are fewer.
    pub fn first_three(&self) -> Vector3<f64> {
        Vector3::new(self.values[0], self.values[1], self.values[2])
    }

    /// As many numbers as these, of which the first three are others.
    pub(super) fn with_first_three(mut self, first: &Vector3<f64>) -> Self {
        let count = self.count.min(3);
        self.values[..count].copy_from_slice(&first.as_slice()[..count]);
        self
    }
}

impl std::ops::Deref for ResidualNumbers {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

impl From<Vector3<f64>> for ResidualNumbers {
    fn from(values: Vector3<f64>) -> Self {
        Self::new(values.into())
    }
}
