//! Inclinations: how far the x and y axes of a target point above the horizon, as a two-axis level (inclinometer) on the tool logs them.
//!
//! tilt = asin(up . R e) with up the z axis of the recording's frame, which is levelled (trackers are, by a level of their own), or
//! where the level is the only instrument defines it. The target's z axis points above the horizon: such instruments work upright.

use super::{Dimension, KindDescription, MeasurementKind, Rank, RowView, Sensitivity, Weight};
use crate::robot::{Measurements, columns};
use crate::units::Quantity::Angle;
use nalgebra::{Matrix3, Vector3};

/// The kind `inclination`.
#[derive(Debug, Clone, Copy)]
pub struct Inclination;

const BOTH: &[&str] = &["tilt_x", "tilt_y"];
/// rad
const UPRIGHT: [f64; 2] = [-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2];

static ABOUT: KindDescription = KindDescription {
    name: "inclination",
    word: "inclination",
    dimension: Dimension::Angle,
    axes: 2,
    columns: columns! {
        value(&["tilt_x"], Angle, UPRIGHT) "Angle of the target's x axis above the horizon: a level on the tool." with BOTH;
        value(&["tilt_y"], Angle, UPRIGHT) "Angle of the target's y axis above the horizon." with BOTH;
        sigma(&["sigma_tilt"], Angle) "Standard deviation of the level's angles.";
    },
    own_sigma: true,
    rank: Rank {
        places: false,
        rotations: true,
        scale: true,
        blind: [3, 1],
    },
    is_screened: false,
};

impl MeasurementKind for Inclination {
    fn about(&self) -> &'static KindDescription {
        &ABOUT
    }

    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let RowView { data, row, placed } = at;
        let reading = self.reading(data, row)?;
        let rotation = placed.orientation();
        let left = |axis: usize| reading.values[axis] - rotation[(2, axis)].clamp(-1.0, 1.0).asin();
        Some((
            Vector3::new(left(0), left(1), 0.0),
            reading.sigma * reading.sigma,
        ))
    }

    /// A rotation w changes up . R e by w . (R e x up), and the angle by as much over its cosine, the length of R e x up.
    fn sensitivity(&self, at: RowView, weight: Weight) -> Sensitivity {
        let rotation = at.placed.orientation();
        let line = |axis: usize| {
            rotation
                .column(axis)
                .cross(&Vector3::z())
                .try_normalize(0.0)
                .unwrap_or_else(Vector3::zeros)
        };
        let lines = Matrix3::from_columns(&[line(0), line(1), Vector3::zeros()]).transpose();
        Sensitivity::Rotation(weight.after(&lines))
    }

    /// What is up to the target is up to the last body.
    fn attitude(
        &self,
        data: &Measurements,
        row: usize,
        body: &Matrix3<f64>,
    ) -> Option<Matrix3<f64>> {
        let [x, y] = [0, 1].map(|axis: usize| {
            self.reading(data, row)
                .map(|reading| reading.values[axis].sin())
        });
        let (x, y) = x.zip(y)?;
        let up = Vector3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt());
        Some(body.tr_mul(&Vector3::z()) * up.transpose())
    }
}
