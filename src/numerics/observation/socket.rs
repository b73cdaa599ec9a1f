//! Sockets: a ball on the tool lies in one, whose centre is estimated too; nothing is read but the joints.

use super::{
    DeclaredColumn, Dimension, KindDescription, MeasurementKind, Part, Rank, RowView, Sensitivity,
    Weight,
};
use crate::effect::Closing;
use crate::robot::{Anchor, Measurements, RobotModel, Shape};
use crate::spatial::Pose;
use crate::units::Quantity::Length;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// The kind `socket`.
#[derive(Debug, Clone, Copy)]
pub struct SocketKind;

static ABOUT: KindDescription = KindDescription {
    name: "socket",
    word: "socket",
    dimension: Dimension::Length,
    axes: 3,
    columns: &[
        DeclaredColumn::text(
            "socket",
            "The socket (cone, nest) that the ball on the tool lies in; its centre is estimated.",
        )
        .as_part(Part::Anchor),
        DeclaredColumn::sigma(
            &["sigma_socket"],
            Length,
            "Standard deviation per axis with which the ball comes back to a socket.",
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

/// Where the nominal robot puts the target of every row that names something of a kind, tracker frame, m, by that name: of the rows to
/// fit or, of what these do not name, of all.
pub(super) fn touches<'a>(
    kind: &dyn MeasurementKind,
    robot: &RobotModel,
    data: &'a Measurements,
    rows: &[usize],
    base: &Pose,
) -> BTreeMap<&'a str, Vec<Vector3<f64>>> {
    let mut touched: BTreeMap<&str, Vec<Vector3<f64>>> = BTreeMap::new();
    let mut fitted = vec![false; data.rows()];
    rows.iter().for_each(|row| fitted[*row] = true);
    for fit in [true, false] {
        let known: Vec<&str> = touched.keys().copied().collect();
        for row in (0..data.rows()).filter(|row| fitted[*row] == fit) {
            if let Some(reading) = kind
                .reading(data, row)
                .filter(|reading| !known.contains(&reading.anchor))
            {
                let ball = robot.mounting_at(data, row).translation;
                touched
                    .entry(reading.anchor)
                    .or_default()
                    .push((*base * robot.last_body(data.q(row))).point(&ball));
            }
        }
    }
    touched
}

impl MeasurementKind for SocketKind {
    fn about(&self) -> &'static KindDescription {
        &ABOUT
    }

    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let RowView { data, row, placed } = at;
        let reading = self.reading(data, row)?;
        placed
            .anchor_shape(reading.anchor)
            .filter(|shape| *shape == Shape::Point)?;
        Some((
            -placed.anchor_reach(reading.anchor)?,
            reading.sigma * reading.sigma,
        ))
    }

    fn sensitivity(&self, _at: RowView, weight: Weight) -> Sensitivity {
        Sensitivity::FromAnchor(weight, Vector3::zeros())
    }

    fn weight(&self, data: &Measurements, row: usize, variance: f64, excess: f64) -> Weight {
        let variance = variance + excess * excess;
        let spread = data
            .spread
            .as_ref()
            .map(|all| all[row] + Matrix3::from_diagonal_element(variance));
        let inverse = spread
            .and_then(|covariance| covariance.cholesky())
            .and_then(|factor| factor.l().try_inverse());
        inverse.map_or_else(|| Weight::uniform(variance.sqrt()), Weight::Full)
    }

    fn noise(&self, data: &Measurements, row: usize) -> Option<f64> {
        let joints = data.spread.as_ref().map_or(0.0, |all| all[row].trace());
        self.reading(data, row)
            .map(|reading| (3.0 * reading.sigma * reading.sigma + joints).sqrt())
    }

    fn closing(&self, at: RowView) -> Option<Closing> {
        self.reading(at.data, at.row).map(|_| Closing::Point)
    }

    /// The middle of where the nominal robot puts the ball.
    fn anchors(
        &self,
        robot: &RobotModel,
        data: &Measurements,
        rows: &[usize],
        base: &Pose,
    ) -> Result<Vec<Anchor>, String> {
        let touched = touches(self, robot, data, rows, base).into_iter();
        let middle =
            |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        Ok(touched
            .map(|(name, points)| Anchor::point(name, middle(&points)))
            .collect())
    }
}
