//! Points of a recording as the numerics see them.

use crate::robot::{PointReadings, START, SigmaSource};
use nalgebra::Vector3;

/// Whether all three axes were measured.
pub(super) fn is_whole(point: &[f64; 3]) -> bool {
    point.iter().all(|axis| axis.is_finite())
}

/// Points (m, NaN along axes that were not measured) with their standard deviations, the weight that one starts from where a point has
/// none; and whether one of these was inferred.
pub(super) fn points(
    position: &[[f64; 3]],
    sigma: Option<&[[f64; 3]]>,
    source: Option<&[SigmaSource]>,
) -> (PointReadings, bool) {
    let there = |row: usize, axis: usize| position[row][axis].is_finite();
    let own = |row: usize, axis: usize| sigma.map(|all| all[row][axis]).filter(|own| *own > 0.0);
    let measured = |value: &f64| if value.is_finite() { *value } else { 0.0 };
    let points: Vec<Vector3<f64>> = position
        .iter()
        .map(|point| Vector3::from_iterator(point.iter().map(measured)))
        .collect();
    let of = |row: usize, axis: usize| match there(row, axis) {
        true => own(row, axis).unwrap_or_else(|| START.sigma(&points[row])),
        false => f64::INFINITY,
    };
    let sigma = (0..points.len())
        .map(|row| Vector3::from_fn(|axis, _| of(row, axis)))
        .collect();
    let inferred = |row: usize| {
        let is_inferred = source.is_some_and(|all| all[row] == SigmaSource::Inferred);
        (0..3).any(|axis| there(row, axis) && (is_inferred || own(row, axis).is_none()))
    };
    let is_inferred = (0..points.len()).any(inferred);
    (
        PointReadings {
            position: points,
            sigma,
        },
        is_inferred,
    )
}
