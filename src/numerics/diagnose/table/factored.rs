//! Columns as directions of a motion times functions of a row: their products with each other, with the base and with the residual are had
//! row by row, without writing the columns down.

use super::cell::alternates;
use crate::effect::Motion;
use crate::linear::{dot, product, view};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;
use std::sync::Arc;

/// A direction in which a motion moves the rows.
pub(super) struct WeighedDirection {
    /// By a unit, weighed, residual rows of readings.
    pub(super) weighed: Vec<f64>,
    /// Squared motion of each row by a unit, its share in the mean over the rows.
    pub(super) square: Vec<f64>,
}

/// A motion with its directions, and what products of its columns are made of.
pub(super) struct MotionRows {
    pub(super) motion: Motion,
    pub(super) directions: Vec<WeighedDirection>,
    /// Of each direction, row by row: its products with the base's columns.
    by_base: Vec<DMatrix<f64>>,
    /// Of each direction, row by row: its product with the residual.
    by_residual: Vec<Vec<f64>>,
    /// Of each two directions, row by row: their product.
    by_each_other: Vec<Vec<f64>>,
}

/// Functions at every row, rows x functions.
pub(super) struct Functions {
    pub(super) values: DMatrix<f64>,
}

impl Functions {
    pub(super) fn count(&self) -> usize {
        self.values.ncols()
    }

    /// A function at every row.
    pub(super) fn at(&self, function: usize) -> &[f64] {
        column(&self.values, function)
    }
}

/// A column of a matrix.
fn column(matrix: &DMatrix<f64>, k: usize) -> &[f64] {
    &matrix.as_slice()[k * matrix.nrows()..(k + 1) * matrix.nrows()]
}

/// Columns as directions of a motion times functions of a row: what is asked of them is had without writing them down.
pub(super) struct FactoredColumns {
    /// Position among the motions of the frame.
    pub(super) motion: usize,
    functions: Arc<Functions>,
    /// Of each column: direction, function, and what makes it one of unit motion.
    columns: Vec<(usize, usize, f64)>,
    /// Mean squared motion by a unit of each coefficient.
    pub(super) square: Vec<f64>,
}

impl MotionRows {
    /// Directions alone.
    pub(super) fn of(motion: Motion, directions: Vec<WeighedDirection>) -> Self {
        Self {
            motion,
            directions,
            by_base: Vec::new(),
            by_residual: Vec::new(),
            by_each_other: Vec::new(),
        }
    }

    /// With what products of its columns are made of: `base` is columns x residual rows, `row_of` the row of each of these.
    pub(super) fn by_row(self, base: &DMatrix<f64>, residual: &[f64], row_of: &[usize]) -> Self {
        let along = |weighed: &[f64], with: &[f64]| {
            let rows = self.directions.first().map_or(0, |one| one.square.len());
            let mut sums = vec![0.0; rows];
            for ((a, b), row) in weighed.iter().zip(with).zip(row_of) {
                sums[*row] += a * b;
            }
            sums
        };
        let weighed = self.directions.iter().map(|direction| &direction.weighed);
        let all: Vec<&[f64]> = weighed.map(Vec::as_slice).collect();
        let with_each = |one: &&[f64]| {
            all.iter()
                .map(|other| along(one, other))
                .collect::<Vec<_>>()
        };
        Self {
            by_base: self.with(&[base], row_of),
            by_residual: all.iter().map(|one| along(one, residual)).collect(),
            by_each_other: all.iter().flat_map(with_each).collect(),
            ..self
        }
    }

    /// Products of each direction with blocks of columns (columns x residual rows) row by row, columns x rows.
    pub(super) fn with(&self, blocks: &[&DMatrix<f64>], row_of: &[usize]) -> Vec<DMatrix<f64>> {
        let count: usize = blocks.iter().map(|block| block.nrows()).sum();
        let row_products = |direction: &WeighedDirection| {
            let mut out = DMatrix::zeros(count, direction.square.len());
            let mut first = 0;
            for block in blocks {
                let size = block.nrows();
                for ((line, row), by) in row_of.iter().enumerate().zip(&direction.weighed) {
                    let from = row * count + first;
                    let sums = &mut out.as_mut_slice()[from..from + size];
                    let each = sums.iter_mut().zip(column(block, line));
                    each.for_each(|(sum, value)| *sum += by * value);
                }
                first += size;
            }
            out
        };
        self.directions.iter().map(row_products).collect()
    }

    /// Products of factored columns of this motion with each other and with the residual, the base projected off.
    pub(super) fn products(&self, factored: &[&FactoredColumns]) -> (DMatrix<f64>, DVector<f64>) {
        let functions = stacked(factored);
        let mut first = 0;
        let mut columns = Vec::new();
        for form in factored {
            let column = |(direction, function, scale): &(usize, usize, f64)| {
                (*direction, first + function, *scale)
            };
            columns.extend(form.columns.iter().map(column));
            first += form.functions.count();
        }
        // Of each two directions once.
        let count = self.directions.len();
        let mut of_pairs = vec![DMatrix::zeros(0, 0); count * count];
        for (k, products) in self.by_each_other.iter().enumerate() {
            if k / count > k % count {
                continue;
            }
            let mut weighed = (*functions).clone();
            for mut column in weighed.column_iter_mut() {
                let entries = column.iter_mut().zip(products);
                entries.for_each(|(value, by)| *value *= by);
            }
            of_pairs[k] = product(view(functions.as_ref()), view(&weighed));
        }
        let shares = sums(factored, &self.by_base);
        let base = shares.len() / columns.len().max(1);
        let shares = DMatrix::from_vec(base, columns.len(), shares);
        let mut gram = product(view(&shares), view(&shares));
        let mut before = vec![0.0; columns.len()];
        for (j, (of_j, at_j, scale_j)) in columns.iter().enumerate() {
            for (i, (of_i, at_i, scale_i)) in columns[..=j].iter().enumerate() {
                let pair = &of_pairs[of_i.min(of_j) * count + of_i.max(of_j)];
                let whole = pair[(*at_i, *at_j)] * scale_i * scale_j;
                gram[(i, j)] = whole - gram[(i, j)];
                gram[(j, i)] = gram[(i, j)];
                before[j] = whole;
            }
        }
        // What lies in the span of the base cannot be distinguished from rounding.
        let rounding = 1e-12;
        for j in 0..columns.len() {
            if gram[(j, j)] >= rounding * before[j] {
                continue;
            }
            gram.row_mut(j).fill(0.0);
            gram.column_mut(j).fill(0.0);
            gram[(j, j)] = rounding * rounding * before[j];
        }
        let along = columns.iter().map(|(direction, function, scale)| {
            scale * dot(column(&functions, *function), &self.by_residual[*direction])
        });
        let along = DVector::from_iterator(columns.len(), along);
        (gram, along)
    }
}

impl FactoredColumns {
    /// A law's functions along the directions of a motion, which has this position in the frame.
    pub(super) fn of(motion: usize, rows: &MotionRows, functions: Arc<Functions>) -> Self {
        let (mut columns, mut square) = (Vec::new(), Vec::new());
        for (direction, function) in pairs(rows.motion, rows.directions.len(), functions.count()) {
            let length = weighed_square(functions.at(function), &rows.directions[direction].square);
            columns.push((direction, function, unit(length)));
            square.push(length);
        }
        Self {
            motion,
            functions,
            columns,
            square,
        }
    }

    /// The direction of each column, and its function for a motion of unit size.
    pub(super) fn scaled(&self) -> impl Iterator<Item = (usize, Vec<f64>)> {
        self.columns.iter().map(|(direction, function, scale)| {
            let values = self.functions.at(*function).iter();
            (*direction, values.map(|value| value * scale).collect())
        })
    }
}

/// The products of columns of one motion with others by those of each direction with these, row by row; one column after another.
pub(super) fn sums(factored: &[&FactoredColumns], by_row: &[DMatrix<f64>]) -> Vec<f64> {
    let count = by_row.first().map_or(0, DMatrix::nrows);
    let functions = stacked(factored);
    let total = functions.ncols();
    let products = |by_row: &DMatrix<f64>| {
        let mut sums = Mat::zeros(count, total);
        matmul(
            sums.as_mut(),
            Accum::Replace,
            view(by_row),
            view(functions.as_ref()),
            1.0,
            Par::Seq,
        );
        sums
    };
    let products: Vec<Mat<f64>> = by_row.iter().map(products).collect();
    let columns = factored.iter().map(|form| form.columns.len());
    let mut out = Vec::with_capacity(count * columns.sum::<usize>());
    let mut first = 0;
    for form in factored {
        for (direction, function, scale) in &form.columns {
            let sums = products[*direction].col_as_slice(first + function);
            out.extend(sums.iter().map(|sum| sum * scale));
        }
        first += form.functions.count();
    }
    out
}

/// The functions of several forms next to each other, rows x functions: one product of matrices reads the rows once for all of them.
fn stacked<'f>(factored: &[&'f FactoredColumns]) -> Cow<'f, DMatrix<f64>> {
    if let [one] = factored {
        return Cow::Borrowed(&one.functions.values);
    }
    let each = || factored.iter().map(|one| &one.functions.values);
    let rows = each().next().map_or(0, DMatrix::nrows);
    let mut values = Vec::with_capacity(each().map(DMatrix::len).sum());
    each().for_each(|one| values.extend_from_slice(one.as_slice()));
    Cow::Owned(DMatrix::from_vec(rows, values.len() / rows.max(1), values))
}

/// Direction and function of each column, in the order of a term's coefficients.
fn pairs(
    motion: Motion,
    directions: usize,
    functions: usize,
) -> impl Iterator<Item = (usize, usize)> {
    let alternate = alternates(motion);
    (0..directions * functions).map(move |k| {
        if alternate {
            (k % directions, k / directions)
        } else {
            (k / functions, k % functions)
        }
    })
}

/// The sum of squares, each by its weight.
fn weighed_square(values: &[f64], weights: &[f64]) -> f64 {
    // Four sums: the compiler may not reorder one.
    let ((values, last), (weights, by)) = (values.as_chunks::<4>(), weights.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (values, weights) in values.iter().zip(weights) {
        for lane in 0..4 {
            sums[lane] += values[lane] * values[lane] * weights[lane];
        }
    }
    let last: f64 = last
        .iter()
        .zip(by)
        .map(|(value, by)| value * value * by)
        .sum();
    sums[0] + sums[1] + sums[2] + sums[3] + last
}

/// What makes a motion of this mean square one of unit size; 0 of none.
pub(super) fn unit(square: f64) -> f64 {
    if square > 0.0 {
        square.sqrt().recip()
    } else {
        0.0
    }
}
