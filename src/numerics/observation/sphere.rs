//! Spheres: the target lies on the surface of one (a probe sphere, a ball bar's ball), whose centre and radius are estimated too; nothing
//! is read but the joints.

use super::socket::touches;
use super::{
    DeclaredColumn, Dimension, KindDescription, MeasurementKind, Part, Rank, RowView, Sensitivity,
    Weight,
};
use crate::effect::Closing;
use crate::robot::{Anchor, Measurements, RobotModel, Shape};
use crate::spatial::Pose;
use crate::units::Quantity::Length;
use nalgebra::{DMatrix, DVector, Vector3};

/// The kind `sphere`.
#[derive(Debug, Clone, Copy)]
pub struct SphereKind;

/// Touches that place a sphere.
const FEWEST: usize = 4;

static ABOUT: KindDescription = KindDescription {
    name: "sphere",
    word: "sphere",
    dimension: Dimension::Length,
    axes: 1,
    columns: &[
        DeclaredColumn::text(
            "sphere",
            "The sphere whose surface the target touches; its centre is estimated, and its radius with that of a ball on the tool.",
        )
        .as_part(Part::Anchor),
        DeclaredColumn::sigma(&["sigma_sphere"], Length, "Standard deviation, along its normal, with which a sphere is touched."),
    ],
    own_sigma: true,
    rank: Rank { places: true, rotations: false, scale: false, blind: [3, 3] },
    is_screened: false,
};

impl SphereKind {
    /// The vector from the centre of the row's sphere, and the sphere's radius.
    fn touch(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let anchor = self.reading(at.data, at.row)?.anchor;
        let Shape::Sphere(radius) = at.placed.anchor_shape(anchor)? else {
            return None;
        };
        at.placed
            .anchor_reach(anchor)
            .filter(|reach| reach.norm() > 0.0)
            .map(|reach| (reach, radius))
    }
}

impl MeasurementKind for SphereKind {
    fn about(&self) -> &'static KindDescription {
        &ABOUT
    }

    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let (reach, radius) = self.touch(at)?;
        let sigma = self.reading(at.data, at.row)?.sigma;
        let variance = sigma * sigma + at.joint_variance_along(&reach.normalize());
        Some((Vector3::new(radius - reach.norm(), 0.0, 0.0), variance))
    }

    fn sensitivity(&self, at: RowView, weight: Weight) -> Sensitivity {
        let reach = self
            .touch(at)
            .map_or_else(Vector3::zeros, |(reach, _)| reach);
        let along = reach.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        Sensitivity::FromAnchor(Weight::Along(weight.apply(&along)), reach)
    }

    fn closing(&self, at: RowView) -> Option<Closing> {
        self.touch(at).map(|(reach, _)| Closing::Sphere(reach))
    }

    /// Centre and radius from p2 = 2 c p + (r2 - c2), linear in both.
    fn anchors(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        rows: &[usize],
        base: &Pose,
    ) -> Result<Vec<Anchor>, String> {
        let place = |(name, points): (&str, Vec<Vector3<f64>>)| {
            let count = points.len();
            if count < FEWEST {
                return Err(format!(
                    "sphere `{name}`: {count} touches cannot place it, at least {FEWEST} are needed"
                ));
            }
            let middle = points.iter().sum::<Vector3<f64>>() / count as f64;
            let lines = DMatrix::from_fn(count, 4, |i, j| {
                if j < 3 {
                    2.0 * (points[i] - middle)[j]
                } else {
                    1.0
                }
            });
            let right = DVector::from_fn(count, |i, _| (points[i] - middle).norm_squared());
            let solution = lines
                .svd(true, true)
                .solve(&right, 1e-12)
                .map_err(|_| format!("sphere `{name}` cannot be placed"))?;
            let centre = Vector3::new(solution[0], solution[1], solution[2]);
            let radius = (solution[3] + centre.norm_squared()).max(0.0).sqrt();
            Ok(Anchor {
                name: name.into(),
                place: middle + centre,
                shape: Shape::Sphere(radius),
            })
        };
        touches(self, robot, data, rows, base)
            .into_iter()
            .map(place)
            .collect()
    }
}
