//! Where the weight of an arm of unknown masses hangs: along the lines from joint to joint, from the feet of the axes' common normals
//! to the tool, every line as heavy as it is long.
//!
//! First moments are base parameters (Gautier and Khalil, 1990): what a body carries counts at the point where it carries it, and a moment
//! along the axis of a joint counts to the body before, which sees the same.

use crate::robot::RobotModel;
use nalgebra::Vector3;

/// Axes are parallel where the sine of their angle is below this: the foot of their common normal would be anywhere.
const PARALLEL: f64 = 0.1;

/// First moment of each body across the axis of its joint and about a point on that axis: zero-pose base axes, m2.
pub(super) fn moments(robot: &RobotModel) -> Vec<Vector3<f64>> {
    let n = robot.joints();
    let knots = knots(robot);
    let mut moments = vec![Vector3::zeros(); n];
    let (mut carried, mut weight) = (Vector3::zeros(), 0.0);
    for body in (0..n).rev() {
        let line = knots[body + 1] - knots[body];
        let length = line.norm();
        let moment = line * (0.5 * length + weight) + carried;
        let axis = robot.axis(body);
        let along = axis * axis.dot(&moment);
        moments[body] = moment - along;
        carried = if robot.is_revolute(body) {
            along
        } else {
            moment
        };
        weight += length;
    }
    moments
}

/// Points from joint to joint and the tool, zero pose, m.
fn knots(robot: &RobotModel) -> Vec<Vector3<f64>> {
    let n = robot.joints();
    let mut knots = vec![robot.home().translation; n + 1];
    for joint in (0..n).rev() {
        let (axis, point) = (robot.axis(joint), robot.point(joint));
        let normal = (joint + 1 < n).then(|| axis.cross(robot.axis(joint + 1)));
        knots[joint] = match normal.filter(|normal| normal.norm() > PARALLEL) {
            Some(normal) => {
                let across = robot.axis(joint + 1).cross(&normal);
                point + axis * ((robot.point(joint + 1) - point).dot(&across) / axis.dot(&across))
            }
            None => point + axis * axis.dot(&(knots[joint + 1] - point)),
        };
    }
    knots
}
