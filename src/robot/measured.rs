//! What a row may measure beside or instead of a whole point: another target, an orientation, some axes only, a distance.

use nalgebra::Matrix3;

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
