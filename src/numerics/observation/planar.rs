//! Image coordinates of a target: where it stands in the plane at distance 1 before a camera (or a theodolite) at the recording's origin.
//!
//! u = -y / x to the right, v = -z / x downwards: the frame's x axis is the optical axis, z is up. They are pixels from the principal point
//! over the focal length, lens distortion taken off. One view sees neither depth nor how large the arm is.

use super::{Dimension, KindDescription, MeasurementKind, Rank, RowView, Sensitivity, Weight};
use crate::robot::{Measurements, RobotModel, columns};
use crate::spatial::Pose;
use crate::units::Quantity::Number;
use nalgebra::{DMatrix, Matrix3, RowVector3, Vector3, Vector4};

/// The kind `planar`.
#[derive(Debug, Clone, Copy)]
pub struct Planar;

const BOTH: &[&str] = &["image_x", "image_y"];
const VIEW: [f64; 2] = [-10.0, 10.0];
/// Right, down and forward of the camera in the recording's frame, a row each.
const CAMERA: Matrix3<f64> = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
/// m: what is nearer than this is not seen.
const NEAREST: f64 = 1e-3;
/// Rows that place a camera.
const FEWEST: usize = 6;

static ABOUT: KindDescription = KindDescription {
    name: "planar",
    word: "image",
    dimension: Dimension::Angle,
    axes: 2,
    columns: columns! {
        value(&["image_x"], Number, VIEW)
            "Image x of the target over the focal length, to the right, of a camera that is the recording's frame; no unit." with BOTH;
        value(&["image_y"], Number, VIEW) "Image y of the target over the focal length, downwards; no unit." with BOTH;
        sigma(&["sigma_image"], Number) "Standard deviation of each of the two; no unit.";
    },
    own_sigma: true,
    rank: Rank {
        places: true,
        rotations: false,
        scale: false,
        blind: [0, 0],
    },
    is_screened: false,
};

impl MeasurementKind for Planar {
    fn about(&self) -> &'static KindDescription {
        &ABOUT
    }

    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let RowView { data, row, placed } = at;
        let (reading, point) = (self.reading(data, row)?, CAMERA * placed.point);
        let left = |axis: usize| reading.values[axis] - point[axis] / point.z.max(NEAREST);
        Some((
            Vector3::new(left(0), left(1), 0.0),
            reading.sigma * reading.sigma,
        ))
    }

    /// The derivative of a quotient: d(a / c) = (da - a / c dc) / c.
    fn sensitivity(&self, at: RowView, weight: Weight) -> Sensitivity {
        let point = CAMERA * at.placed.point;
        let depth = point.z.max(NEAREST);
        let line = |axis: usize| {
            let mut line = RowVector3::new(0.0, 0.0, -point[axis] / (depth * depth));
            line[axis] = 1.0 / depth;
            line
        };
        let lines = Matrix3::from_rows(&[line(0), line(1), RowVector3::zeros()]) * CAMERA;
        Sensitivity::Point(weight.after(&lines))
    }

    /// The camera's pose by the direct linear transform (Hartley and Zisserman, 2004, 7.1): the nominal arm's points against their images.
    fn base(&self, robot: &RobotModel, data: &Measurements, rows: &[usize]) -> Option<Pose> {
        let seen = rows
            .iter()
            .filter_map(|row| Some((*row, self.reading(data, *row)?)));
        let pairs: Vec<(Vector3<f64>, [f64; 2])> = seen
            .map(|(row, reading)| {
                let target = robot.last_body(data.q(row)) * *robot.mounting_at(data, row);
                (target.translation, [reading.values[0], reading.values[1]])
            })
            .collect();
        if pairs.len() < FEWEST {
            return None;
        }
        // About their centre and by their size, without which squares lose half of the digits.
        let centre =
            pairs.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / pairs.len() as f64;
        let size = pairs
            .iter()
            .map(|(point, _)| (point - centre).norm())
            .fold(f64::MIN_POSITIVE, f64::max);
        let mut normal = DMatrix::zeros(12, 12);
        for (point, image) in &pairs {
            let homogeneous =
                Vector4::from_iterator(((point - centre) / size).iter().copied().chain([1.0]));
            for (axis, seen) in image.iter().enumerate() {
                let mut line = DMatrix::zeros(12, 1);
                line.view_mut((4 * axis, 0), (4, 1)).copy_from(&homogeneous);
                line.view_mut((8, 0), (4, 1))
                    .copy_from(&(-homogeneous * *seen));
                normal += &line * line.transpose();
            }
        }
        let eigen = normal.symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        let camera = eigen.eigenvectors.column(least);
        let turned = Matrix3::from_fn(|i, j| camera[4 * i + j]);
        // It is a rotation times a scale, which has the sign of the determinant.
        let scale = libm::cbrt(turned.determinant());
        let svd = (turned / scale).svd(true, true);
        let rotation = svd.u? * svd.v_t?;
        let shift = Vector3::from_fn(|i, _| camera[4 * i + 3]) * (size / scale);
        let base = Pose::new(
            CAMERA.tr_mul(&rotation),
            CAMERA.tr_mul(&(shift - rotation * centre)),
        );
        (base.translation.iter().all(|value| value.is_finite()) && shift.z > 0.0).then_some(base)
    }
}
