//! Normal equations, row by row.

use nalgebra::DMatrix;

/// Sums of products of columns.
pub(crate) struct Normal {
    count: usize,
    gram: Vec<f64>,
    pub(crate) gradient: Vec<f64>,
    pub(crate) square: f64,
}

impl Normal {
    pub(crate) fn new(count: usize) -> Self {
        Self {
            count,
            gram: vec![0.0; count * count],
            gradient: vec![0.0; count],
            square: 0.0,
        }
    }

    pub(crate) fn add(&mut self, x: &[f64], residual: f64) {
        self.square += residual * residual;
        for i in 0..self.count {
            if x[i] != 0.0 {
                self.gradient[i] += x[i] * residual;
                let line = &mut self.gram[i * self.count..(i + 1) * self.count];
                line.iter_mut()
                    .zip(x)
                    .for_each(|(sum, x_k)| *sum += x[i] * x_k);
            }
        }
    }

    pub(crate) fn gram_matrix(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.count, self.count, &self.gram)
    }
}
