//! Whitened rows of all columns and their inner products, formed once for one noise and one choice of rows.

use super::columns::TorqueColumns;
use super::noise::JointNoise;
use super::reduce::TorqueColumn;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use std::ops::Range;

/// Noise per joint, and which runs of judged rows are looked at.
#[derive(Clone, Copy)]
pub(super) struct Weighing<'a> {
    pub(crate) noise: &'a [JointNoise],
    pub(crate) runs: &'a [Range<usize>],
}

impl Weighing<'_> {
    /// A course of a joint.
    fn course(&self, joint: usize, course: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(course.len());
        self.noise[joint].whiten(course, self.runs, &mut out);
        out
    }

    /// A column, joint after joint.
    pub(crate) fn column(&self, column: &TorqueColumn) -> TorqueColumn {
        let courses = column
            .joints
            .iter()
            .zip(&column.courses)
            .map(|(joint, course)| self.course(*joint, course));
        TorqueColumn {
            courses: courses.collect(),
            joints: column.joints.clone(),
        }
    }

    /// Measured minus rigid, of all joints.
    pub(crate) fn measured(&self, measured: &[Vec<f64>]) -> Vec<Vec<f64>> {
        measured
            .iter()
            .enumerate()
            .map(|(joint, course)| self.course(joint, course))
            .collect()
    }
}

/// Inner products of whitened columns; those that are left out have none.
pub(super) struct WeightedColumns {
    pub(crate) columns: Vec<TorqueColumn>,
    /// `[joint]`: whitened rows of measured minus rigid torque.
    pub(crate) measured: Vec<Vec<f64>>,
    /// Symmetric, row after row.
    pub(crate) gram: Vec<Vec<f64>>,
    /// With the measured torque.
    pub(crate) right: Vec<f64>,
    /// Product of the measured torque with itself.
    pub(crate) square: f64,
    /// Rows of a joint.
    pub(crate) rows: usize,
}

impl WeightedColumns {
    /// Products of the columns whose numbers are `chosen`, ascending.
    pub(crate) fn new(
        columns: &TorqueColumns,
        measured: &[Vec<f64>],
        weighing: Weighing,
        chosen: &[usize],
    ) -> Self {
        let count = columns.columns.len();
        let nothing = || TorqueColumn {
            joints: Vec::new(),
            courses: Vec::new(),
        };
        let mut white: Vec<TorqueColumn> = (0..count).map(|_| nothing()).collect();
        chosen
            .iter()
            .for_each(|number| white[*number] = weighing.column(&columns.columns[*number]));
        Self::of_white(white, weighing.measured(measured), chosen)
    }

    /// The same of columns and torques that are whitened already.
    pub(crate) fn of_white(
        columns: Vec<TorqueColumn>,
        measured: Vec<Vec<f64>>,
        chosen: &[usize],
    ) -> Self {
        let count = columns.len();
        let mut all = Self {
            columns,
            square: measured.iter().flatten().map(|value| value * value).sum(),
            rows: measured.iter().map(Vec::len).max().unwrap_or(0),
            measured,
            gram: vec![Vec::new(); count],
            right: vec![0.0; count],
        };
        chosen
            .iter()
            .for_each(|number| all.gram[*number] = vec![0.0; count]);
        (0..all.measured.len()).for_each(|joint| all.take_joint(joint, chosen));
        all
    }

    /// Adds the inner products of a joint.
    fn take_joint(&mut self, joint: usize, chosen: &[usize]) {
        let own: Vec<(usize, &[f64])> = chosen
            .iter()
            .filter_map(|number| {
                let column = &self.columns[*number];
                let place = column.joints.iter().position(|one| *one == joint)?;
                Some((*number, column.courses[place].as_slice()))
            })
            .collect();
        let measured = &self.measured[joint];
        let rows = Mat::from_fn(measured.len(), own.len(), |row, column| own[column].1[row]);
        let mut products = Mat::<f64>::zeros(own.len(), own.len());
        matmul(
            products.as_mut(),
            Accum::Replace,
            rows.transpose(),
            rows.as_ref(),
            1.0,
            Par::Seq,
        );
        for (a, (number, course)) in own.iter().enumerate() {
            self.right[*number] += dot(course, measured);
            let row = &mut self.gram[*number];
            own.iter()
                .enumerate()
                .for_each(|(b, (other, _))| row[*other] += products[(b, a)]);
        }
    }

    /// The same columns with another measured torque (whitened, `[joint]`).
    pub(crate) fn with_measured(&self, measured: Vec<Vec<f64>>) -> Self {
        let along = |column: &TorqueColumn| {
            column
                .joints
                .iter()
                .zip(&column.courses)
                .map(|(joint, course)| dot(course, &measured[*joint]))
                .sum()
        };
        Self {
            right: self.columns.iter().map(along).collect(),
            square: measured.iter().flatten().map(|value| value * value).sum(),
            measured,
            columns: self.columns.clone(),
            gram: self.gram.clone(),
            rows: self.rows,
        }
    }

    /// Whether a column has inner products.
    pub(crate) fn has(&self, column: usize) -> bool {
        !self.gram[column].is_empty()
    }

    /// Takes what coefficients explain off the measured torque; inner products stay as they were.
    pub(crate) fn subtract(&mut self, solution: &[(usize, f64)]) {
        for (column, value) in solution {
            self.columns[*column].add(-value, &mut self.measured);
        }
    }

    /// Takes one more column.
    pub(crate) fn push(&mut self, column: &TorqueColumn, weighing: Weighing) {
        let white = weighing.column(column);
        let product = |other: &TorqueColumn| {
            let pairs = white.joints.iter().zip(&white.courses);
            let with = |(joint, course): (&usize, &Vec<f64>)| {
                other
                    .joints
                    .iter()
                    .position(|one| one == joint)
                    .map(|place| dot(course, &other.courses[place]))
            };
            pairs.filter_map(with).sum::<f64>()
        };
        let mut row: Vec<f64> = self.columns.iter().map(&product).collect();
        row.push(product(&white));
        let right = white
            .joints
            .iter()
            .zip(&white.courses)
            .map(|(joint, course)| dot(course, &self.measured[*joint]))
            .sum();
        self.gram
            .iter_mut()
            .zip(&row)
            .filter(|(old, _)| !old.is_empty())
            .for_each(|(old, value)| old.push(*value));
        self.gram.push(row);
        self.right.push(right);
        self.columns.push(white);
    }
}

/// Product of two courses of one length.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums at once: one would wait for itself.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4
        .remainder()
        .iter()
        .zip(b4.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in a4.zip(b4) {
        for lane in 0..4 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}
