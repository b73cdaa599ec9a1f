//! What a row may measure beside or instead of a whole point: another target, an orientation, some axes only, a distance.

use crate::robot::observation::Measurements;
use nalgebra::{Matrix3, Vector3};

/// A name for each row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Named {
    /// Different names, in their order.
    pub names: Vec<String>,
    /// By row, position in `names`.
    pub of: Vec<u32>,
}

/// Orientations of targets; tracker frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Turns {
    pub rotation: Vec<Option<Matrix3<f64>>>,
    /// Standard deviation about each axis, rad.
    pub sigma: Vec<f64>,
}

/// Distances of targets from anchors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Distances {
    pub anchor: Named,
    /// m; NaN where none was measured.
    pub length: Vec<f64>,
    /// m.
    pub sigma: Vec<f64>,
}

/// A row's distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance<'a> {
    pub anchor: &'a str,
    /// m.
    pub length: f64,
    /// m.
    pub sigma: f64,
}

impl Named {
    /// From the name of each row.
    pub fn of<'a>(rows: impl Iterator<Item = &'a str> + Clone) -> Self {
        let all: std::collections::BTreeSet<&str> = rows.clone().collect();
        let names: Vec<String> = all.into_iter().map(String::from).collect();
        let number = |name: &str| names.binary_search_by(|other| other.as_str().cmp(name)).unwrap_or_default() as u32;
        Self { of: rows.map(number).collect(), names }
    }

    pub fn name(&self, row: usize) -> &str {
        self.of.get(row).and_then(|number| self.names.get(*number as usize)).map_or("", String::as_str)
    }
}

impl Measurements {
    /// The name of the target that a row measured; empty for the tool point.
    pub fn target(&self, row: usize) -> &str {
        self.target.as_ref().map_or("", |target| target.name(row))
    }

    /// Whether all three axes of a row's point were measured.
    pub fn whole(&self, row: usize) -> bool {
        self.sigma[row].iter().all(|sigma| sigma.is_finite())
    }

    /// How many axes of a row's point were measured.
    pub fn axes(&self, row: usize) -> usize {
        self.sigma[row].iter().filter(|sigma| sigma.is_finite()).count()
    }

    /// Measured - predicted (m); zero along axes that were not measured.
    pub fn residual(&self, row: usize, predicted: &Vector3<f64>) -> Vector3<f64> {
        let residual = self.position[row] - predicted;
        if self.whole(row) {
            return residual;
        }
        Vector3::from_fn(|axis, _| if self.sigma[row][axis].is_finite() { residual[axis] } else { 0.0 })
    }

    /// The measured orientation of a row's target and its standard deviation about each axis, rad.
    pub fn turn(&self, row: usize) -> Option<(&Matrix3<f64>, f64)> {
        let turn = self.turn.as_ref()?;
        Some((turn.rotation[row].as_ref()?, turn.sigma[row]))
    }

    pub fn distance(&self, row: usize) -> Option<Distance<'_>> {
        let all = self.distance.as_ref()?;
        let length = all.length[row];
        length.is_finite().then(|| Distance { anchor: all.anchor.name(row), length, sigma: all.sigma[row] })
    }

    /// Numbers that a row measured: axes of its point, angles, distance.
    pub fn values(&self, row: usize) -> usize {
        self.axes(row) + 3 * usize::from(self.turn(row).is_some()) + usize::from(self.distance(row).is_some())
    }
}
