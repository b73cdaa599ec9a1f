//! What rows measure beside or instead of a point: readings of other kinds, and names of what was measured.

use nalgebra::{Matrix3, Vector3};

/// A name for each row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Named {
    /// Different names, in their order.
    pub names: Vec<String>,
    /// By row, position in `names`.
    pub(crate) numbers: Vec<u32>,
}

/// What rows measured of one kind, SI.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Readings {
    /// The kind's name.
    pub kind: &'static str,
    /// Numbers of a row; none of contacts.
    pub width: usize,
    /// Row-major; NaN where a row measured none.
    pub values: Vec<f64>,
    /// Standard deviation of what a row measured.
    pub sigma: Vec<f64>,
    /// The anchors that readings go to, of kinds that have one.
    pub anchor: Option<Named>,
}

/// What a row measured of one kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading<'a> {
    /// SI, as many as the kind has.
    pub values: &'a [f64],
    /// Standard deviation of each, SI.
    pub sigma: f64,
    /// Empty where it has no name.
    pub anchor: &'a str,
}

impl Readings {
    /// The readings of some rows, in their order.
    pub(crate) fn subset(&self, rows: &[usize]) -> Self {
        Self {
            kind: self.kind,
            width: self.width,
            values: rows
                .iter()
                .flat_map(|row| &self.values[row * self.width..(row + 1) * self.width])
                .copied()
                .collect(),
            sigma: rows.iter().map(|row| self.sigma[*row]).collect(),
            anchor: self
                .anchor
                .as_ref()
                .map(|names| Named::of(rows.iter().map(|row| names.name(*row)))),
        }
    }

    /// What was read in a row; none where nothing was.
    pub fn row(&self, row: usize) -> Option<Reading<'_>> {
        let values = &self.values[row * self.width..(row + 1) * self.width];
        let anchor = self.anchor.as_ref().map_or("", |anchor| anchor.name(row));
        // What has no number was measured where it has a name.
        let there = self.width > 0 || !anchor.is_empty();
        (there && values.iter().all(|value| value.is_finite())).then(|| Reading {
            values,
            sigma: self.sigma[row],
            anchor,
        })
    }
}

impl Named {
    /// From the name of each row.
    pub fn of<'a>(rows: impl Iterator<Item = &'a str> + Clone) -> Self {
        let all: std::collections::BTreeSet<&str> = rows.clone().collect();
        let names: Vec<String> = all.into_iter().map(String::from).collect();
        let number = |name: &str| {
            names
                .binary_search_by(|other| other.as_str().cmp(name))
                .unwrap_or_default() as u32
        };
        Self {
            numbers: rows.map(number).collect(),
            names,
        }
    }

    /// The name that a row carries; empty where it carries none.
    pub fn name(&self, row: usize) -> &str {
        self.numbers
            .get(row)
            .and_then(|number| self.names.get(*number as usize))
            .map_or("", String::as_str)
    }
}

/// Where targets were measured, one entry a row; empty where no row measured a point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointReadings {
    /// Tracker frame, m; 0 along an axis that was not measured.
    pub position: Vec<Vector3<f64>>,
    /// Standard deviation per axis, m; infinite along an axis that was not measured.
    pub sigma: Vec<Vector3<f64>>,
}

impl PointReadings {
    /// Whole points with one standard deviation, m.
    pub fn new(position: Vec<Vector3<f64>>, sigma: f64) -> Self {
        Self {
            sigma: vec![Vector3::repeat(sigma); position.len()],
            position,
        }
    }

    /// Readings of so many rows, none of which measured a point.
    pub fn none(rows: usize) -> Self {
        Self::new(vec![Vector3::zeros(); rows], f64::INFINITY)
    }

    /// The readings of some rows, in their order.
    pub fn subset(&self, rows: &[usize]) -> Self {
        let picked = |all: &[Vector3<f64>]| {
            rows.iter()
                .filter_map(|row| all.get(*row))
                .copied()
                .collect()
        };
        Self {
            position: picked(&self.position),
            sigma: picked(&self.sigma),
        }
    }

    /// One more whole point with a standard deviation, m.
    pub(crate) fn push(&mut self, position: Vector3<f64>, sigma: f64) {
        self.position.push(position);
        self.sigma.push(Vector3::repeat(sigma));
    }

    /// Puts a whole point (m) in place of what a row measured.
    pub fn set(&mut self, row: usize, position: Vector3<f64>, sigma: f64) {
        self.position[row] = position;
        self.sigma[row] = Vector3::repeat(sigma);
    }

    /// Moves the point of a row by so much, m.
    pub fn shift(&mut self, row: usize, by: Vector3<f64>) {
        self.position[row] += by;
    }

    /// Takes the point of a row away.
    pub fn forget(&mut self, row: usize) {
        self.sigma[row] = Vector3::repeat(f64::INFINITY);
    }

    /// Where all three axes of a row were measured: its point.
    pub(crate) fn all_axes(&self, row: usize) -> Option<Vector3<f64>> {
        let is_whole = self
            .sigma
            .get(row)
            .is_some_and(|sigma| sigma.iter().all(|sigma| sigma.is_finite()));
        is_whole.then(|| self.position[row])
    }

    /// Whether an axis, from 0, of a row's point was measured.
    pub(crate) fn has(&self, row: usize, axis: usize) -> bool {
        self.sigma
            .get(row)
            .is_some_and(|sigma| sigma[axis].is_finite())
    }

    /// How many axes of a row's point were measured.
    pub fn axes(&self, row: usize) -> usize {
        self.sigma.get(row).map_or(0, |sigma| {
            sigma.iter().filter(|sigma| sigma.is_finite()).count()
        })
    }

    /// Length (m) of the one-sigma noise of a row's point, with the covariance (m2) beyond the instrument's: root of the summed
    /// variances of what was measured of it.
    pub fn noise(&self, row: usize, beyond: Option<&Matrix3<f64>>) -> f64 {
        let Some(sigma) = self.sigma.get(row) else {
            return 0.0;
        };
        if self.axes(row) == 3 {
            return (sigma.norm_squared() + beyond.map_or(0.0, Matrix3::trace)).sqrt();
        }
        let measured = (0..3).filter(|axis| sigma[*axis].is_finite());
        let variance: f64 = measured
            .map(|axis| sigma[axis].powi(2) + beyond.map_or(0.0, |beyond| beyond[(axis, axis)]))
            .sum();
        variance.sqrt()
    }

    /// Measured - predicted (m) of a row's point; zero along axes that were not measured.
    pub fn residual(&self, row: usize, predicted: &Vector3<f64>) -> Vector3<f64> {
        match self.all_axes(row) {
            Some(point) => point - predicted,
            None => Vector3::from_fn(|axis, _| {
                if self.has(row, axis) {
                    self.position[row][axis] - predicted[axis]
                } else {
                    0.0
                }
            }),
        }
    }
}
