//! Least squares of the base and a set of forms, and what every further column would gain: Gram-Schmidt on inner products.

use super::columns::TorqueColumns;
use super::weighted::WeightedColumns;
use nalgebra::{DMatrix, DVector};

/// A column of which less than this share is new adds nothing.
const REDUNDANT: f64 = 1e-9;
/// The same inside a form: what the base and the set leave of its columns.
const INVISIBLE: f64 = 2e-5;

/// What a form would gain.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Gain {
    /// Fall of the whitened squared residual, what the base's tolerances are stretched by included.
    pub square: f64,
    /// Columns of it that are seen.
    pub rank: usize,
}

/// The base and a set of forms, swept out of all columns.
#[derive(Clone)]
pub(super) struct SweptColumns<'a> {
    all: &'a TorqueColumns,
    weighted: &'a WeightedColumns,
    pivots: Vec<usize>,
    /// Per pivot: its direction's inner products with all columns.
    rows: Vec<Vec<f64>>,
    /// Per pivot: its direction's inner product with the measured torque.
    along: Vec<f64>,
    /// Per column: what is left of its inner product with the measured torque.
    right: Vec<f64>,
    /// Whitened squared residual and what the base's tolerances are stretched by.
    pub square: f64,
}

impl<'a> SweptColumns<'a> {
    /// The base alone.
    pub fn base(all: &'a TorqueColumns, weighted: &'a WeightedColumns) -> Self {
        let mut sweep = Self {
            all,
            weighted,
            pivots: Vec::new(),
            rows: Vec::new(),
            along: Vec::new(),
            right: weighted.right.clone(),
            square: weighted.square,
        };
        (0..all.base).for_each(|column| sweep.take(column));
        sweep
    }

    /// With forms.
    pub fn with(&self, forms: &[usize]) -> Self {
        let mut sweep = self.clone();
        forms.iter().for_each(|form| sweep.add(*form));
        sweep
    }

    /// Takes a form.
    pub fn add(&mut self, form: usize) {
        self.all.of(form).for_each(|column| self.take(column));
    }

    /// Takes a column.
    pub fn take(&mut self, column: usize) {
        let prior = self.prior(column);
        let own = self.weighted.gram[column][column] + prior;
        let mut row = self.weighted.gram[column].clone();
        for known in &self.rows {
            let share = known[column];
            if share != 0.0 {
                row.iter_mut().zip(known).for_each(|(value, other)| *value -= share * other);
            }
        }
        let left = row[column] + prior;
        if left <= REDUNDANT * own || own <= 0.0 {
            return;
        }
        let root = left.sqrt();
        row[column] = left;
        row.iter_mut().for_each(|value| *value /= root);
        let along = self.right[column] / root;
        self.right.iter_mut().zip(&row).for_each(|(right, value)| *right -= along * value);
        self.square -= along * along;
        self.pivots.push(column);
        self.rows.push(row);
        self.along.push(along);
    }

    /// 1 / variance beforehand of a coefficient.
    fn prior(&self, column: usize) -> f64 {
        self.all.prior.get(column).copied().unwrap_or(0.0)
    }

    /// What a form would gain, given the present ones.
    pub fn gain(&self, form: usize) -> Gain {
        self.gain_of(form, &self.right)
    }

    /// Whether each coefficient of a form would be positive alone.
    pub fn rises(&self, form: usize) -> bool {
        self.all.of(form).all(|column| self.right[column] > 0.0)
    }

    /// Coefficients that a form would have beside the present ones; of columns that are not seen, 0.
    pub fn values(&self, form: usize) -> Vec<f64> {
        let columns: Vec<usize> = self.all.of(form).collect();
        let swept = |a: usize, b: usize| self.weighted.gram[a][b] - self.rows.iter().map(|row| row[a] * row[b]).sum::<f64>();
        let own = |column: &usize| self.weighted.gram[*column][*column];
        let scale: Vec<f64> = columns.iter().map(|column| own(column).max(f64::MIN_POSITIVE).sqrt()).collect();
        let mut block =
            DMatrix::from_fn(columns.len(), columns.len(), |a, b| swept(columns[a], columns[b]) / (scale[a] * scale[b]));
        (0..columns.len()).for_each(|k| block[(k, k)] += REDUNDANT + self.prior(columns[k]) / (scale[k] * scale[k]));
        let right = DVector::from_fn(columns.len(), |a, _| self.right[columns[a]] / scale[a]);
        match block.cholesky() {
            Some(factor) => factor.solve(&right).iter().zip(&scale).map(|(value, scale)| value / scale).collect(),
            None => vec![0.0; columns.len()],
        }
    }

    /// The same with other inner products of its columns with a residual.
    pub fn gain_with(&self, form: usize, right: &[f64]) -> f64 {
        self.gain_of(form, right).square
    }

    fn gain_of(&self, form: usize, right: &[f64]) -> Gain {
        let columns = self.all.of(form);
        let (first, width) = (columns.start, columns.len());
        let mut block = [0.0; 100];
        let mut along = [0.0; 10];
        for a in 0..width {
            let scale = self.weighted.gram[first + a][first + a];
            if scale <= 0.0 {
                continue;
            }
            for b in 0..=a {
                let other = self.weighted.gram[first + b][first + b];
                if other <= 0.0 {
                    continue;
                }
                let swept: f64 = self.rows.iter().map(|row| row[first + a] * row[first + b]).sum();
                block[10 * a + b] = (self.weighted.gram[first + a][first + b] - swept) / (scale * other).sqrt();
            }
            block[11 * a] += self.prior(first + a) / scale;
            along[a] = right[first + a] / scale.sqrt();
        }
        small_gain(&mut block, &mut along, width)
    }

    /// What a form of the set gains beside the others.
    pub fn loss(&self, form: usize, solution: &[(usize, f64)]) -> Gain {
        let of = |column: usize| solution.iter().find(|(pivot, _)| *pivot == column).copied();
        let (columns, values): (Vec<usize>, Vec<f64>) = self.all.of(form).filter_map(of).unzip();
        let covariance = DMatrix::from_row_slice(columns.len(), columns.len(), &self.covariance(&columns));
        let values = DVector::from_vec(values);
        let square = covariance.cholesky().map_or(0.0, |factor| values.dot(&factor.solve(&values)));
        Gain { square, rank: columns.len() }
    }

    /// Whether a form is among the present ones.
    pub fn has(&self, form: usize) -> bool {
        self.all.of(form).any(|column| self.pivots.contains(&column))
    }

    /// Coefficients of the pivots.
    pub fn solution(&self) -> Vec<(usize, f64)> {
        let count = self.pivots.len();
        let mut values = self.along.clone();
        for i in (0..count).rev() {
            let sum: f64 = (i + 1..count).map(|m| self.rows[i][self.pivots[m]] * values[m]).sum();
            values[i] = (values[i] - sum) / self.rows[i][self.pivots[i]];
        }
        self.pivots.iter().copied().zip(values).collect()
    }

    /// Covariance of some columns, row-major; columns that are no pivots have none.
    pub fn covariance(&self, columns: &[usize]) -> Vec<f64> {
        // Rows of the factor's inverse: covariance is their inner products.
        let count = self.pivots.len();
        let inverse = |column: &usize| {
            let mut row = vec![0.0; count];
            if let Some(place) = self.pivots.iter().position(|pivot| pivot == column) {
                // Solve U x = e by back substitution: x is the column of the inverse of U = L^T; the row is what multiplies `along`.
                row[place] = 1.0;
            }
            row
        };
        let mut halves: Vec<Vec<f64>> = columns.iter().map(inverse).collect();
        for half in &mut halves {
            // w^T = e^T U^-1, forward through U.
            for i in 0..count {
                if half[i] == 0.0 {
                    continue;
                }
                half[i] /= self.rows[i][self.pivots[i]];
                let value = half[i];
                for (entry, pivot) in half.iter_mut().zip(&self.pivots).skip(i + 1) {
                    *entry -= value * self.rows[i][*pivot];
                }
            }
        }
        let product = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(x, y)| x * y).sum();
        halves.iter().flat_map(|a| halves.iter().map(move |b| product(a, b))).collect()
    }

    /// Sweeps the pivots out of other inner products of all columns with a residual.
    pub fn swept(&self, mut right: Vec<f64>) -> Vec<f64> {
        for (pivot, row) in self.pivots.iter().zip(&self.rows) {
            let along = right[*pivot] / row[*pivot];
            right.iter_mut().zip(row).for_each(|(value, other)| *value -= along * other);
        }
        right
    }
}

/// Gain of a small scaled system, by a pivoted Cholesky factor; only the lower triangle (rows of 10) is read.
fn small_gain(block: &mut [f64; 100], along: &mut [f64; 10], width: usize) -> Gain {
    let mut gain = Gain::default();
    let mut left: Vec<usize> = (0..width).collect();
    let at = |a: usize, b: usize| if a >= b { 10 * a + b } else { 10 * b + a };
    while let Some(place) = (0..left.len()).max_by(|a, b| block[11 * left[*a]].total_cmp(&block[11 * left[*b]])) {
        let pivot = left.swap_remove(place);
        let size = block[11 * pivot];
        if size <= INVISIBLE {
            break;
        }
        let value = along[pivot];
        gain.square += value * value / size;
        gain.rank += 1;
        for a in &left {
            let share = block[at(*a, pivot)] / size;
            along[*a] -= share * value;
            for b in left.iter().filter(|b| *b <= a) {
                block[at(*a, *b)] -= share * block[at(*b, pivot)];
            }
        }
    }
    gain
}
