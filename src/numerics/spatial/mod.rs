//! Rigid motions: poses, twists, exponential, left Jacobian.
//!
//! Twists are ordered (v; w) and frames read left to right: `base_tool = base_flange * flange_tool`. Formulas: Lynch and Park,
//! Modern Robotics, ch. 3; Barfoot, State Estimation for Robotics, ch. 7.

use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};
use std::ops::Mul;

/// Rotation (3x3) and translation (m); maps points of the right frame into the left one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Orthonormal, right-handed.
    pub rotation: Matrix3<f64>,
    /// m.
    pub translation: Vector3<f64>,
}

/// Below this angle (rad) the closed forms lose digits to cancellation and the series is exact in f64.
const SMALL_ANGLE: f64 = 2e-2;

impl Pose {
    /// No motion.
    pub fn identity() -> Self {
        Self {
            rotation: Matrix3::identity(),
            translation: Vector3::zeros(),
        }
    }

    /// A pose from its parts; `rotation` must be orthonormal.
    pub fn new(rotation: Matrix3<f64>, translation: Vector3<f64>) -> Self {
        Self {
            rotation,
            translation,
        }
    }

    /// Builds a pose from a rotation vector (rad) and a translation (m).
    pub fn from_rotation_vector(rotation_vector: Vector3<f64>, translation: Vector3<f64>) -> Self {
        Self {
            rotation: Rotation3::new(rotation_vector).into_inner(),
            translation,
        }
    }

    /// Returns the rotation vector (rad), angle in [0, pi].
    pub fn rotation_vector(&self) -> Vector3<f64> {
        // By way of a quaternion: the arc cosine of the trace would lose half the digits of a small angle.
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(self.rotation))
            .scaled_axis()
    }

    /// Exponential of a twist (v; w): Modern Robotics, Eq. 3.88.
    pub fn exp(twist: &Twist) -> Self {
        let v: Vector3<f64> = twist.fixed_rows::<3>(0).into();
        let w: Vector3<f64> = twist.fixed_rows::<3>(3).into();
        let angle_squared = w.norm_squared();
        if angle_squared == 0.0 {
            return Self {
                rotation: Matrix3::identity(),
                translation: v,
            };
        }
        let (a, b, c) = coefficients(angle_squared);
        let cross = hat(&w);
        let cross_squared = cross * cross;
        Self {
            rotation: Matrix3::identity() + cross * a + cross_squared * b,
            translation: v + cross * v * b + cross_squared * v * c,
        }
    }

    /// The motion back: `pose * pose.inverse()` is the identity.
    #[inline]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            translation: -(rotation * self.translation),
        }
    }

    /// The point (m) as it stands after this motion.
    #[inline]
    pub fn point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }

    /// The point's coordinates in this frame.
    #[inline]
    pub(crate) fn inverse_point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.tr_mul(&(point - self.translation))
    }
}

/// sin t / t, (1 - cos t) / t^2, (t - sin t) / t^3 of the angle t.
fn coefficients(angle_squared: f64) -> (f64, f64, f64) {
    let t2 = angle_squared;
    if t2 < SMALL_ANGLE * SMALL_ANGLE {
        return (
            1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0)),
            0.5 * (1.0 - t2 / 12.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0))),
            1.0 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0))),
        );
    }
    let t = t2.sqrt();
    (t.sin() / t, (1.0 - t.cos()) / t2, (t - t.sin()) / (t2 * t))
}

impl Mul for Pose {
    type Output = Pose;
    #[inline]
    fn mul(self, right: Pose) -> Pose {
        Pose {
            rotation: self.rotation * right.rotation,
            translation: self.rotation * right.translation + self.translation,
        }
    }
}

/// A small or joint motion (v; w): m and rad, or per unit of joint travel.
pub type Twist = Vector6<f64>;

/// The matrix of `w x`.
pub fn hat(w: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0)
}

/// The unit screw of a rotation about `axis` through `point` (m): v = -w x q (Modern Robotics, Eq. 3.79).
pub(crate) fn screw(axis: &Vector3<f64>, point: &Vector3<f64>) -> Twist {
    let v = point.cross(axis);
    Twist::new(v.x, v.y, v.z, axis.x, axis.y, axis.z)
}

/// The left Jacobian J with exp(x + dx) = exp(J dx) exp(x), as series in the adjoint ad(x); meant for small motions (|w| < 1).
pub(crate) fn left_jacobian(twist: &Twist) -> Matrix6<f64> {
    let cross_v = hat(&twist.fixed_rows::<3>(0).into());
    let cross_w = hat(&twist.fixed_rows::<3>(3).into());
    let mut ad = Matrix6::zeros();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&cross_w);
    ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross_v);
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&cross_w);
    let mut sum = Matrix6::identity();
    let mut term = Matrix6::identity();
    for order in 1..30 {
        term = term * ad / f64::from(order + 1);
        sum += term;
        if term.amax() < 1e-17 {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_series_meets_the_closed_form() {
        let direction = Twist::new(0.3, -0.2, 0.5, 0.6, 0.0, 0.8);
        for angle in [1.9e-2, 2.1e-2] {
            let (a, b, c) = coefficients(angle * angle);
            let t: f64 = angle;
            assert!((a - t.sin() / t).abs() < 1e-15);
            assert!((b - (1.0 - t.cos()) / (t * t)).abs() < 1e-12);
            assert!((c - (t - t.sin()) / t.powi(3)).abs() < 1e-11);
        }
        let twice = Pose::exp(&direction) * Pose::exp(&direction);
        let double = Pose::exp(&(direction * 2.0));
        assert!((twice.rotation - double.rotation).norm() < 1e-14);
        assert!((twice.translation - double.translation).norm() < 1e-14);
    }

    #[test]
    fn inverse_undoes_a_pose() {
        let pose = Pose::exp(&Twist::new(1.0, 2.0, 3.0, 0.4, -0.5, 1.6));
        let identity = pose * pose.inverse();
        assert!((identity.rotation - Matrix3::identity()).norm() < 1e-14);
        assert!(identity.translation.norm() < 1e-14);
        let again = Pose::from_rotation_vector(pose.rotation_vector(), pose.translation);
        assert!((again.rotation - pose.rotation).norm() < 1e-13);
    }
}

#[cfg(test)]
mod twist_tests {
    use super::*;
    use crate::spatial::Pose;

    #[test]
    fn left_jacobian_is_the_derivative_of_exp() {
        let twist = Twist::new(0.02, -0.01, 0.03, 0.2, -0.1, 0.15);
        let jacobian = left_jacobian(&twist);
        let h = 1e-5;
        let back = Pose::exp(&twist).inverse();
        for k in 0..6 {
            let mut step = Twist::zeros();
            step[k] = h;
            let (plus, minus) = (
                Pose::exp(&(twist + step)) * back,
                Pose::exp(&(twist - step)) * back,
            );
            let rotation = (plus.rotation_vector() - minus.rotation_vector()) / (2.0 * h);
            let translation = (plus.translation - minus.translation) / (2.0 * h);
            for i in 0..3 {
                assert!((jacobian[(i, k)] - translation[i]).abs() < 1e-8);
                assert!((jacobian[(3 + i, k)] - rotation[i]).abs() < 1e-8);
            }
        }
    }
}
