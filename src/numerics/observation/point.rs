//! Points: where a target is in the tracker's frame, all of its axes or some of them.

use super::{Dimension, KindDescription, MeasurementKind, Rank, RowView, Sensitivity, Weight};
use crate::robot::{Measurements, columns};
use crate::units::Quantity::Length;
use nalgebra::Vector3;

/// The kind `point`.
#[derive(Debug, Clone, Copy)]
pub struct PointKind;

const AXES: [&str; 3] = ["x", "y", "z"];
const SIGMAS: &[&str] = &["sigma_x", "sigma_y", "sigma_z"];
const EXPANDED: &[&str] = &["u95_x", "u95_y", "u95_z"];
const STANDARD: &[&str] = &["u_x", "u_y", "u_z"];
/// Standard deviations to 95 % coverage, as certificates round them (GUM, 6.3.3).
const TWO: f64 = 2.0;
/// m; no tracker sees farther.
const FAR: [f64; 2] = [-200.0, 200.0];

static ABOUT: KindDescription = KindDescription {
    name: "point",
    word: "point",
    dimension: Dimension::Length,
    axes: 3,
    columns: columns! {
        value(&["x"], Length, FAR) "Measured point, x in the tracker's frame.";
        value(&["y"], Length, FAR) "Measured point, y in the tracker's frame.";
        value(&["z"], Length, FAR) "Measured point, z in the tracker's frame.";
        sigma(&["sigma_x"], Length) "Standard deviation of x." with SIGMAS;
        sigma(&["sigma_y"], Length) "Standard deviation of y." with SIGMAS;
        sigma(&["sigma_z"], Length) "Standard deviation of z." with SIGMAS;
        uncertainty("u95", SIGMAS, TWO) "Uncertainty of each coordinate with 95 % coverage: two standard deviations.";
        uncertainty("u95_x", &["sigma_x"], TWO) "Uncertainty of x with 95 % coverage." with EXPANDED;
        uncertainty("u95_y", &["sigma_y"], TWO) "Uncertainty of y with 95 % coverage." with EXPANDED;
        uncertainty("u95_z", &["sigma_z"], TWO) "Uncertainty of z with 95 % coverage." with EXPANDED;
        uncertainty("u", SIGMAS, 1.0) "Standard uncertainty of each coordinate, or with `coverage_factor` an expanded one.";
        uncertainty("u_x", &["sigma_x"], 1.0) "Standard uncertainty of x." with STANDARD;
        uncertainty("u_y", &["sigma_y"], 1.0) "Standard uncertainty of y." with STANDARD;
        uncertainty("u_z", &["sigma_z"], 1.0) "Standard uncertainty of z." with STANDARD;
    },
    own_sigma: false,
    rank: Rank {
        places: true,
        rotations: false,
        scale: true,
        blind: [0, 0],
    },
    is_screened: true,
};

impl MeasurementKind for PointKind {
    fn about(&self) -> &'static KindDescription {
        &ABOUT
    }

    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let RowView { data, row, placed } = at;
        // Each axis has a variance of its own: see `weight`.
        (data.points.axes(row) > 0).then(|| (data.points.residual(row, &placed.point), f64::NAN))
    }

    fn sensitivity(&self, _at: RowView, weight: Weight) -> Sensitivity {
        Sensitivity::Point(weight)
    }

    fn axes(&self, data: &Measurements, row: usize) -> usize {
        data.points.axes(row)
    }

    fn weight(&self, data: &Measurements, row: usize, _variance: f64, excess: f64) -> Weight {
        Weight::of(data, row, excess)
    }

    fn noise(&self, data: &Measurements, row: usize) -> Option<f64> {
        (data.points.axes(row) > 0).then(|| data.noise(row))
    }

    fn lines(&self, data: &Measurements, row: usize) -> &'static [usize] {
        match [0, 1, 2].map(|axis| data.points.has(row, axis)) {
            [true, true, true] => &[0, 1, 2],
            [true, true, false] => &[0, 1],
            [true, false, true] => &[0, 2],
            [false, true, true] => &[1, 2],
            [true, false, false] => &[0],
            [false, true, false] => &[1],
            [false, false, true] => &[2],
            [false, false, false] => &[],
        }
    }

    fn instrument(&self, data: &Measurements, row: usize) -> Option<f64> {
        let finite = |sigma: f64| if sigma.is_finite() { sigma } else { 0.0 };
        (data.points.axes(row) > 0).then(|| data.points.sigma[row].map(finite).norm())
    }

    fn stated(&self, data: &Measurements, row: usize, error: &Vector3<f64>) -> f64 {
        error
            .iter()
            .zip(&data.points.sigma[row])
            .map(|(error, sigma)| (error / sigma) * (error / sigma))
            .sum()
    }

    /// Every recording has its columns.
    fn is_in(&self, _data: &Measurements) -> bool {
        true
    }

    fn words(&self, data: &Measurements, row: usize) -> Vec<&'static str> {
        let measured = AXES
            .into_iter()
            .enumerate()
            .filter(|(axis, _)| data.points.has(row, *axis));
        measured.map(|(_, name)| name).collect()
    }
}
