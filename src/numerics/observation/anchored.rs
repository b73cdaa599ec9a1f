//! What is measured from an anchor whose place is estimated too: distances, and contacts (sockets, planes, spheres) of which nothing is read
//! but the joints.

use super::{Dimension, KindDescription, MeasurementKind, Rank, RowView, Sensitivity, Weight};
use crate::effect::Closing;
use crate::robot::{Anchor, Measurements, RobotModel, Shape, columns};
use crate::spatial::Pose;
use crate::units::Quantity::Length;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::collections::BTreeMap;

/// What contacts have in common.
const CONTACT: KindDescription = KindDescription {
    name: "",
    word: "",
    dimension: Dimension::Length,
    axes: 1,
    columns: &[],
    own_sigma: true,
    rank: Rank {
        places: true,
        rotations: false,
        scale: false,
        blind: [3, 3],
    },
    is_screened: false,
};

/// What a row measured along a line from its anchor.
struct Line {
    /// Measured - predicted, m.
    error: f64,
    /// Unit vector of the line.
    along: Vector3<f64>,
    /// The vector from the anchor to the target, m.
    reach: Vector3<f64>,
    /// One standard deviation, m.
    sigma: f64,
}

impl Line {
    fn residual(line: Option<Self>, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let Self {
            error,
            along,
            sigma,
            ..
        } = line?;
        let variance = sigma * sigma + at.joint_variance_along(&along);
        Some((Vector3::new(error, 0.0, 0.0), variance))
    }

    fn sensitivity(line: Option<Self>, weight: Weight) -> Sensitivity {
        let (along, reach) = line.map_or_else(Default::default, |line| (line.along, line.reach));
        Sensitivity::FromAnchor(Weight::Along(weight.apply(&along)), reach)
    }
}

/// Kinds that measure one number along a line.
macro_rules! along_a_line {
    () => {
        fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
            Line::residual(self.line(at), at)
        }

        fn sensitivity(&self, at: RowView, weight: Weight) -> Sensitivity {
            Line::sensitivity(self.line(at), weight)
        }
    };
}

/// The place a and the number b that solve `factor` p . a + b = right of each of some points p in the mean: four numbers.
fn linear(
    points: &[Vector3<f64>],
    factor: f64,
    right: impl Fn(usize) -> f64,
    least: f64,
) -> Option<DVector<f64>> {
    let of_point = |i: usize, j: usize| points[i].get(j).map_or(1.0, |value| factor * value);
    let lines = DMatrix::from_fn(points.len(), 4, of_point);
    let right = DVector::from_fn(points.len(), |i, _| right(i));
    lines.svd(true, true).solve(&right, least).ok()
}

/// The middle of some points, m.
fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len() as f64
}

/// Where the nominal robot puts the target of every row that names something of a kind, tracker frame, m, by that name: of the rows to
/// fit or, of what these do not name, of all.
fn touches<'a>(
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

/// The kind `distance`: distances of a target from an anchor (draw-wire, ballbar) whose place is estimated too.
#[derive(Debug, Clone, Copy)]
pub struct Distance;

/// Distances that place an anchor.
const FEWEST_DISTANCES: usize = 4;

static DISTANCE: KindDescription = KindDescription {
    name: "distance",
    word: "distance",
    dimension: Dimension::Length,
    axes: 1,
    columns: columns! {
        value(&["distance"], Length, [1e-6, 200.0]) "Distance of the target from an anchor: a draw-wire or ballbar.";
        sigma(&["sigma_distance"], Length) "Standard deviation of the distance.";
        anchor("anchor") "Which of several anchors the distance goes to; their places are estimated.";
    },
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
    fn line(&self, at: RowView) -> Option<Line> {
        let reading = self.reading(at.data, at.row)?;
        let reach = at.placed.anchor_reach(reading.anchor)?;
        Some(Line {
            error: reading.values[0] - reach.norm(),
            along: reach.try_normalize(0.0)?,
            reach,
            sigma: reading.sigma,
        })
    }
}

impl MeasurementKind for Distance {
    fn about(&self) -> &'static KindDescription {
        &DISTANCE
    }

    along_a_line!();

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
            if count < FEWEST_DISTANCES {
                return Err(format!(
                    "{called}: {count} distances to fit cannot place it, at least {FEWEST_DISTANCES} are needed"
                ));
            }
            let points: Vec<Vector3<f64>> = seen.iter().map(|(point, _)| *point).collect();
            // About the points' middle, so that nothing cancels.
            let middle = middle(&points);
            let from_middle: Vec<Vector3<f64>> = points.iter().map(|p| p - middle).collect();
            let right = |k: usize| seen[k].1.powi(2) - from_middle[k].norm_squared();
            let solution = linear(&from_middle, -2.0, right, 1e-9)
                .ok_or_else(|| format!("{called} cannot be placed"))?;
            Ok(Anchor::point(
                name,
                middle + Vector3::new(solution[0], solution[1], solution[2]),
            ))
        };
        by_name.into_iter().map(place).collect()
    }
}

/// The kind `socket`: a ball on the tool lies in one, whose centre is estimated too.
#[derive(Debug, Clone, Copy)]
pub struct SocketKind;

static SOCKET: KindDescription = KindDescription {
    name: "socket",
    word: "socket",
    axes: 3,
    columns: columns! {
        anchor("socket") "The socket (cone, nest) that the ball on the tool lies in; its centre is estimated.";
        sigma(&["sigma_socket"], Length) "Standard deviation per axis with which the ball comes back to a socket.";
    },
    ..CONTACT
};

impl MeasurementKind for SocketKind {
    fn about(&self) -> &'static KindDescription {
        &SOCKET
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
        Ok(touched
            .map(|(name, points)| Anchor::point(name, middle(&points)))
            .collect())
    }
}

/// The kind `plane`: the target touches one (a table, a cube's face, a dial gauge at zero), which is estimated too.
#[derive(Debug, Clone, Copy)]
pub struct PlaneKind;

/// Touches that place a plane.
const FEWEST_OF_PLANE: usize = 3;

static PLANE: KindDescription = KindDescription {
    name: "plane",
    word: "plane",
    columns: columns! {
        anchor("plane") "The plane that the target touches: a table, the face of a cube; it is estimated.";
        sigma(&["sigma_plane"], Length) "Standard deviation, along its normal, with which a plane is touched.";
    },
    ..CONTACT
};

impl PlaneKind {
    fn line(&self, at: RowView) -> Option<Line> {
        let reading = self.reading(at.data, at.row)?;
        let Shape::Plane(along) = at.placed.anchor_shape(reading.anchor)? else {
            return None;
        };
        let reach = at.placed.anchor_reach(reading.anchor)?;
        Some(Line {
            error: -along.dot(&reach),
            along,
            reach,
            sigma: reading.sigma,
        })
    }
}

impl MeasurementKind for PlaneKind {
    fn about(&self) -> &'static KindDescription {
        &PLANE
    }

    along_a_line!();

    fn closing(&self, at: RowView) -> Option<Closing> {
        self.line(at).map(|line| Closing::Plane(line.along))
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
            if points.len() < FEWEST_OF_PLANE {
                return Err(format!(
                    "plane `{name}`: {} touches cannot place it, at least {FEWEST_OF_PLANE} are needed",
                    points.len()
                ));
            }
            let place = middle(&points);
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

/// The kind `sphere`: the target lies on the surface of one (a probe sphere, a ball bar's ball), whose centre and radius are estimated too.
#[derive(Debug, Clone, Copy)]
pub struct SphereKind;

/// Touches that place a sphere.
const FEWEST_OF_SPHERE: usize = 4;

static SPHERE: KindDescription = KindDescription {
    name: "sphere",
    word: "sphere",
    columns: columns! {
        anchor("sphere") "The sphere whose surface the target touches; its centre is estimated, and its radius with that of a ball on the tool.";
        sigma(&["sigma_sphere"], Length) "Standard deviation, along its normal, with which a sphere is touched.";
    },
    ..CONTACT
};

impl SphereKind {
    fn line(&self, at: RowView) -> Option<Line> {
        let reading = self.reading(at.data, at.row)?;
        let Shape::Sphere(radius) = at.placed.anchor_shape(reading.anchor)? else {
            return None;
        };
        let reach = at.placed.anchor_reach(reading.anchor)?;
        (reach.norm() > 0.0).then(|| Line {
            error: radius - reach.norm(),
            along: reach.normalize(),
            reach,
            sigma: reading.sigma,
        })
    }
}

impl MeasurementKind for SphereKind {
    fn about(&self) -> &'static KindDescription {
        &SPHERE
    }

    along_a_line!();

    fn closing(&self, at: RowView) -> Option<Closing> {
        self.line(at).map(|line| Closing::Sphere(line.reach))
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
            if count < FEWEST_OF_SPHERE {
                return Err(format!(
                    "sphere `{name}`: {count} touches cannot place it, at least {FEWEST_OF_SPHERE} are needed"
                ));
            }
            let middle = middle(&points);
            let from_middle: Vec<Vector3<f64>> = points.iter().map(|p| p - middle).collect();
            let right = |k: usize| from_middle[k].norm_squared();
            let solution = linear(&from_middle, 2.0, right, 1e-12)
                .ok_or_else(|| format!("sphere `{name}` cannot be placed"))?;
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
