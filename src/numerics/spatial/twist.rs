//! Twists and the left Jacobian of SE(3).

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// A small or joint motion (v; w): m and rad, or per unit of joint travel.
pub type Twist = Vector6<f64>;

/// The matrix of `w x`.
pub fn hat(w: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0)
}

/// The unit screw of a rotation about `axis` through `point` (m): v = -w x q (Modern Robotics, Eq. 3.79).
pub fn screw(axis: &Vector3<f64>, point: &Vector3<f64>) -> Twist {
    let v = point.cross(axis);
    Twist::new(v.x, v.y, v.z, axis.x, axis.y, axis.z)
}

/// The left Jacobian J with exp(x + dx) = exp(J dx) exp(x), as series in the adjoint ad(x); meant for small motions (|w| < 1).
pub fn left_jacobian(twist: &Twist) -> Matrix6<f64> {
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
