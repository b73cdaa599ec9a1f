//! Planes: the target touches one (a table, a cube's face, a dial gauge at zero), which is estimated too; nothing is read but the joints.

use super::socket::touches;
use super::{
    DeclaredColumn, Dimension, KindDescription, MeasurementKind, Part, Rank, RowView, Sensitivity,
    Weight,
};
use crate::effect::Closing;
use crate::robot::{Anchor, Measurements, RobotModel, Shape};
use crate::spatial::Pose;
use crate::units::Quantity::Length;
use nalgebra::{Matrix3, Vector3};

/// The kind `plane`.
#[derive(Debug, Clone, Copy)]
pub struct PlaneKind;

/// Touches that place a plane.
const FEWEST: usize = 3;

static ABOUT: KindDescription = KindDescription {
    name: "plane",
    word: "plane",
    dimension: Dimension::Length,
    axes: 1,
    columns: &[
        DeclaredColumn::text(
            "plane",
            "The plane that the target touches: a table, the face of a cube; it is estimated.",
        )
        .as_part(Part::Anchor),
        DeclaredColumn::sigma(
            &["sigma_plane"],
            Length,
            "Standard deviation, along its normal, with which a plane is touched.",
        ),
    ],
    own_sigma: true,
    rank: Rank {
        places: true,
        rotations: false,
        scale: false,
        blind: [3, 3],
    },
    is_screened: false,
};

impl PlaneKind {
    /// The vector from the row's plane, and the plane's normal.
    fn touch(&self, at: RowView) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let anchor = self.reading(at.data, at.row)?.anchor;
        let Shape::Plane(normal) = at.placed.anchor_shape(anchor)? else {
            return None;
        };
        Some((at.placed.anchor_reach(anchor)?, normal))
    }
}

impl MeasurementKind for PlaneKind {
    fn about(&self) -> &'static KindDescription {
        &ABOUT
    }

    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let (reach, normal) = self.touch(at)?;
        let sigma = self.reading(at.data, at.row)?.sigma;
        let variance = sigma * sigma + at.joint_variance_along(&normal);
        Some((Vector3::new(-normal.dot(&reach), 0.0, 0.0), variance))
    }

    fn sensitivity(&self, at: RowView, weight: Weight) -> Sensitivity {
        let (reach, normal) = self.touch(at).unwrap_or_default();
        Sensitivity::FromAnchor(Weight::Along(weight.apply(&normal)), reach)
    }

    fn closing(&self, at: RowView) -> Option<Closing> {
        self.touch(at).map(|(_, normal)| Closing::Plane(normal))
    }

    /// Through the middle of the touches, across the direction in which they scatter least.
    fn anchors(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        rows: &[usize],
        base: &Pose,
    ) -> Result<Vec<Anchor>, String> {
        let place = |(name, points): (&str, Vec<Vector3<f64>>)| {
            if points.len() < FEWEST {
                return Err(format!(
                    "plane `{name}`: {} touches cannot place it, at least {FEWEST} are needed",
                    points.len()
                ));
            }
            let place = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            let scatter: Matrix3<f64> = points
                .iter()
                .map(|point| (point - place) * (point - place).transpose())
                .sum();
            let axes = scatter.symmetric_eigen();
            let normal: Vector3<f64> = axes.eigenvectors.column(axes.eigenvalues.imin()).into();
            // Two normals are one plane: that which points up is taken.
            let sign = if normal.z < 0.0 { -1.0 } else { 1.0 };
            Ok(Anchor {
                name: name.into(),
                place,
                shape: Shape::Plane(normal.normalize() * sign),
            })
        };
        touches(self, robot, data, rows, base)
            .into_iter()
            .map(place)
            .collect()
    }
}
