//! Upper triangular matrices, column after column in one piece of memory: factors, their inverses, roots of covariances.

/// Zero below the diagonal.
#[derive(Debug, Clone)]
pub(crate) struct Triangle {
    size: usize,
    /// Column j is `j + 1` long.
    values: Vec<f64>,
}

impl Triangle {
    /// `entry(i, j)` for `i <= j < size`.
    pub(crate) fn from_fn(size: usize, mut entry: impl FnMut(usize, usize) -> f64) -> Self {
        let mut values = Vec::with_capacity(size * (size + 1) / 2);
        for j in 0..size {
            for i in 0..=j {
                values.push(entry(i, j));
            }
        }
        Self { size, values }
    }

    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Column `j` down to the diagonal.
    pub(crate) fn column(&self, j: usize) -> &[f64] {
        let first = j * (j + 1) / 2;
        &self.values[first..=first + j]
    }

    pub(crate) fn at(&self, i: usize, j: usize) -> f64 {
        if i <= j {
            self.values[j * (j + 1) / 2 + i]
        } else {
            0.0
        }
    }

    pub(crate) fn scaled(mut self, by: f64) -> Self {
        for value in &mut self.values {
            *value *= by;
        }
        self
    }

    /// The first `size` rows and columns.
    pub(crate) fn head(&self, size: usize) -> Self {
        Self {
            size,
            values: self.values[..size * (size + 1) / 2].to_vec(),
        }
    }

    /// Solves in place for a right-hand side that ends with row `right.len() - 1`. The diagonal must not be zero there.
    pub(crate) fn solve(&self, right: &mut [f64]) {
        for j in (0..right.len()).rev() {
            let column = self.column(j);
            let value = right[j] / column[j];
            right[j] = value;
            axpy(-value, &column[..j], &mut right[..j]);
        }
    }

    /// `None` where the diagonal has a zero.
    pub fn inverse(&self) -> Option<Self> {
        if (0..self.size).any(|j| self.at(j, j) == 0.0) {
            return None;
        }
        let mut values = vec![0.0; self.values.len()];
        for j in 0..self.size {
            let first = j * (j + 1) / 2;
            let column = &mut values[first..=first + j];
            column[j] = 1.0;
            self.solve(column);
        }
        Some(Self {
            size: self.size,
            values,
        })
    }
}

/// Four sums at once: three times as fast, and in a fixed order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    let (a, b) = (&a[..length], &b[..length]);
    let (mut sums, mut i) = ([0.0; 4], 0);
    while i + 4 <= length {
        sums[0] += a[i] * b[i];
        sums[1] += a[i + 1] * b[i + 1];
        sums[2] += a[i + 2] * b[i + 2];
        sums[3] += a[i + 3] * b[i + 3];
        i += 4;
    }
    let mut sum = sums[0] + sums[1] + sums[2] + sums[3];
    while i < length {
        sum += a[i] * b[i];
        i += 1;
    }
    sum
}

/// `to += by * from`.
pub(crate) fn axpy(by: f64, from: &[f64], to: &mut [f64]) {
    let length = from.len().min(to.len());
    let (from, to) = (&from[..length], &mut to[..length]);
    let mut i = 0;
    while i < length {
        to[i] += by * from[i];
        i += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_times_its_inverse_is_one() {
        let triangle = Triangle::from_fn(7, |i, j| {
            if i == j {
                2.0 + j as f64
            } else {
                ((3 * i + 5 * j) % 7) as f64 - 3.0
            }
        });
        let inverse = triangle.inverse().unwrap();
        for i in 0..7 {
            for j in 0..7 {
                let entry: f64 = (0..7).map(|k| triangle.at(i, k) * inverse.at(k, j)).sum();
                assert!((entry - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        assert!(Triangle::from_fn(2, |i, _| i as f64).inverse().is_none());
    }
}
