//! Least squares of the base and a set of forms, and what every further column would gain: Gram-Schmidt on inner products.

use super::columns::TorqueColumns;
use super::recording::add;
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
    pub(crate) square: f64,
    /// Columns of it that are seen.
    pub(crate) rank: usize,
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
    pub(crate) square: f64,
}

/// The coefficient of a column; 0 of one that is not seen.
pub(super) fn value_of(solution: &[(usize, f64)], column: usize) -> f64 {
    let known = solution.iter().find(|(pivot, _)| *pivot == column);
    known.map_or(0.0, |(_, value)| *value)
}

impl<'a> SweptColumns<'a> {
    /// The base alone.
    pub(crate) fn base(all: &'a TorqueColumns, weighted: &'a WeightedColumns) -> Self {
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
    pub(crate) fn with(&self, forms: &[usize]) -> Self {
        let mut sweep = self.clone();
        forms.iter().for_each(|form| sweep.add(*form));
        sweep
    }

    /// Takes a form.
    pub(crate) fn add(&mut self, form: usize) {
        self.all.of(form).for_each(|column| self.take(column));
    }

    /// Takes a column.
    pub(crate) fn take(&mut self, column: usize) {
        let prior = self.prior(column);
        let diagonal = self.weighted.gram[column][column] + prior;
        let mut row = self.left_of(column);
        let left = row[column] + prior;
        if left <= REDUNDANT * diagonal || diagonal <= 0.0 {
            return;
        }
        let root = left.sqrt();
        row[column] = left;
        row.iter_mut().for_each(|value| *value /= root);
        let along = self.right[column] / root;
        add(&mut self.right, -along, &row);
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
    pub(crate) fn gain(&self, form: usize) -> f64 {
        let (gram, right) = self.left_among(form);
        let first = self.all.of(form).start;
        let size = |a: usize| self.weighted.gram[first + a][first + a].max(f64::MIN_POSITIVE);
        let scale: Vec<f64> = (0..right.len()).map(|a| size(a).sqrt()).collect();
        let mut block = DMatrix::from_fn(right.len(), right.len(), |a, b| {
            gram[(a, b)] / (scale[a] * scale[b])
        });
        (0..right.len()).for_each(|a| {
            block[(a, a)] += INVISIBLE + self.prior(first + a) / (scale[a] * scale[a])
        });
        let along = DVector::from_fn(right.len(), |a, _| right[a] / scale[a]);
        block
            .cholesky()
            .map_or(0.0, |factor| along.dot(&factor.solve(&along)))
    }

    /// What the present ones leave of the inner products of a column with all others.
    pub(crate) fn left_of(&self, column: usize) -> Vec<f64> {
        let mut left = self.weighted.gram[column].clone();
        for known in &self.rows {
            let share = known[column];
            if share != 0.0 {
                add(&mut left, -share, known);
            }
        }
        left
    }

    /// The same of columns of a form among each other, and with the measured torque.
    pub(crate) fn left_among(&self, form: usize) -> (DMatrix<f64>, DVector<f64>) {
        let columns = self.all.of(form);
        let (first, width) = (columns.start, columns.len());
        let swept = |a: usize, b: usize| -> f64 {
            let products = self.rows.iter().map(|row| row[first + a] * row[first + b]);
            products.sum()
        };
        let gram = |a: usize, b: usize| self.weighted.gram[first + a][first + b] - swept(a, b);
        (
            DMatrix::from_fn(width, width, gram),
            DVector::from_fn(width, |a, _| self.right[first + a]),
        )
    }

    /// What is left of the inner product of a column with the measured torque.
    pub(crate) fn right_of(&self, column: usize) -> f64 {
        self.right[column]
    }

    /// Whether each coefficient of a form would be positive alone.
    pub(crate) fn rises(&self, form: usize) -> bool {
        self.all.of(form).all(|column| self.right[column] > 0.0)
    }

    /// What a form of the set gains in addition to the others.
    pub(crate) fn loss(&self, form: usize, solution: &[(usize, f64)]) -> Gain {
        let of_column =
            |column: usize| solution.iter().find(|(pivot, _)| *pivot == column).copied();
        let (columns, values): (Vec<usize>, Vec<f64>) =
            self.all.of(form).filter_map(of_column).unzip();
        let covariance =
            DMatrix::from_row_slice(columns.len(), columns.len(), &self.covariance(&columns));
        let values = DVector::from_vec(values);
        let square = covariance
            .cholesky()
            .map_or(0.0, |factor| values.dot(&factor.solve(&values)));
        Gain {
            square,
            rank: columns.len(),
        }
    }

    /// Coefficients of the pivots.
    pub(crate) fn solution(&self) -> Vec<(usize, f64)> {
        let count = self.pivots.len();
        let mut values = self.along.clone();
        for i in (0..count).rev() {
            let sum: f64 = (i + 1..count)
                .map(|m| self.rows[i][self.pivots[m]] * values[m])
                .sum();
            values[i] = (values[i] - sum) / self.rows[i][self.pivots[i]];
        }
        self.pivots.iter().copied().zip(values).collect()
    }

    /// Standard deviation of the coefficient of a column; 0 of one that is no pivot.
    pub(crate) fn sigma(&self, column: usize) -> f64 {
        self.covariance(&[column])[0].max(0.0).sqrt()
    }

    /// Covariance of some columns, row-major; columns that are no pivots have none.
    pub(crate) fn covariance(&self, columns: &[usize]) -> Vec<f64> {
        // Rows of the factor's inverse: covariance is their inner products.
        let count = self.pivots.len();
        let unit = |column: &usize| {
            let here = |pivot: &usize| f64::from(u8::from(pivot == column));
            self.pivots.iter().map(here).collect()
        };
        let mut halves: Vec<Vec<f64>> = columns.iter().map(unit).collect();
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
        halves
            .iter()
            .flat_map(|a| halves.iter().map(move |b| product(a, b)))
            .collect()
    }
}
