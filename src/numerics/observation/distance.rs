//! Distances of a target from an anchor (draw-wire, ballbar) whose place is estimated too.

use super::{
    DeclaredColumn, Dimension, KindDescription, MeasurementKind, Part, Rank, RowView, Sensitivity,
    Weight,
};
use crate::robot::{Anchor, Measurements, RobotModel};
use crate::spatial::Pose;
use crate::units::Quantity::Length;
use nalgebra::{DMatrix, DVector, Vector3};
use std::collections::BTreeMap;

/// The kind `distance`.
#[derive(Debug, Clone, Copy)]
pub struct Distance;

/// Distances that place an anchor.
const FEWEST: usize = 4;

static ABOUT: KindDescription = KindDescription {
    name: "distance",
    word: "distance",
    dimension: Dimension::Length,
    axes: 1,
    columns: &[
        DeclaredColumn::value(
            &["distance"],
            Length,
            [1e-6, 200.0],
            "Distance of the target from an anchor: a draw-wire or ballbar.",
        ),
        DeclaredColumn::sigma(
            &["sigma_distance"],
            Length,
            "Standard deviation of the distance.",
        ),
        DeclaredColumn::text(
            "anchor",
            "Which of several anchors the distance goes to; their places are estimated.",
        )
        .as_part(Part::Anchor),
    ],
    own_sigma: true,
    rank: Rank {
        places: true,
        rotations: false,
        scale: true,
        blind: [3, 3],
    },
    is_screened: false,
};

impl Distance {
    /// The unit vector from the row's anchor.
    fn along(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let reach = at
            .placed
            .anchor_reach(self.reading(at.data, at.row)?.anchor)?;
        Some((reach.try_normalize(0.0)?, reach.norm()))
    }
}

impl MeasurementKind for Distance {
    fn about(&self) -> &'static KindDescription {
        &ABOUT
    }

    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let RowView { data, row, .. } = at;
        let reading = self.reading(data, row)?;
        let (along, length) = self.along(at)?;
        let variance = reading.sigma * reading.sigma + at.joint_variance_along(&along);
        Some((Vector3::new(reading.values[0] - length, 0.0, 0.0), variance))
    }

    fn sensitivity(&self, at: RowView, weight: Weight) -> Sensitivity {
        let along = self
            .along(at)
            .map_or_else(Vector3::zeros, |(along, _)| along);
        let anchor = self
            .reading(at.data, at.row)
            .map_or("", |reading| reading.anchor);
        let reach = at
            .placed
            .anchor_reach(anchor)
            .unwrap_or_else(Vector3::zeros);
        Sensitivity::FromAnchor(Weight::Along(weight.apply(&along)), reach)
    }

    /// With a third of what the joints' repeatability moves the point by, squared: its share along a line in the mean over directions.
    fn noise(&self, data: &Measurements, row: usize) -> Option<f64> {
        let joints = data
            .spread
            .as_ref()
            .map_or(0.0, |all| all[row].trace() / 3.0);
        self.reading(data, row).map(|reading| {
            if joints > 0.0 {
                reading.sigma.hypot(joints.sqrt())
            } else {
                reading.sigma
            }
        })
    }

    /// Each from d2 - p2 = a2 - 2 p a over its rows, linear in a and a2.
    fn anchors(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        rows: &[usize],
        base: &Pose,
    ) -> Result<Vec<Anchor>, String> {
        let mut by_name: BTreeMap<&str, Vec<(Vector3<f64>, f64)>> = BTreeMap::new();
        for row in rows {
            if let Some(reading) = self.reading(data, *row) {
                let mounting = robot.mounting_at(data, *row);
                let point = (*base * robot.last_body(data.q(*row))).point(&mounting.translation);
                by_name
                    .entry(reading.anchor)
                    .or_default()
                    .push((point, reading.values[0]));
            }
        }
        let place = |(name, seen): (&str, Vec<(Vector3<f64>, f64)>)| {
            let called = if name.is_empty() {
                "the anchor".to_string()
            } else {
                format!("anchor `{name}`")
            };
            let count = seen.len();
            if count < FEWEST {
                return Err(format!(
                    "{called}: {count} distances to fit cannot place it, at least {FEWEST} are needed"
                ));
            }
            // About the points' middle, so that nothing cancels.
            let middle = seen.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / count as f64;
            let lines = DMatrix::from_fn(count, 4, |i, j| {
                if j < 3 {
                    -2.0 * (seen[i].0 - middle)[j]
                } else {
                    1.0
                }
            });
            let right = DVector::from_fn(count, |i, _| {
                seen[i].1.powi(2) - (seen[i].0 - middle).norm_squared()
            });
            let solution = lines
                .svd(true, true)
                .solve(&right, 1e-9)
                .map_err(|_| format!("{called} cannot be placed"))?;
            Ok(Anchor::point(
                name,
                middle + Vector3::new(solution[0], solution[1], solution[2]),
            ))
        };
        by_name.into_iter().map(place).collect()
    }
}
