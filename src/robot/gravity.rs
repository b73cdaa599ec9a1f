//! Generalised gravity forces on the joints, from link masses and payload (static part of Eq. 24).

use crate::robot::model::RobotModel;
use crate::spatial::Pose;
use nalgebra::Vector3;

impl RobotModel {
    /// True when every link has a mass, so that torques mean something without a payload.
    pub fn has_masses(&self) -> bool {
        self.description().joints.iter().all(|joint| joint.mass.is_some() && joint.centre.is_some())
    }

    /// Writes the gravity torque (Nm; N for prismatic joints) about each joint with `payload` kg on the tool.
    ///
    /// `joint[j]` is the frame that carries the axis of joint j, `body[j]` the frame of the body that it moves, both such that
    /// zero-pose coordinates map to where the arm is now; the last body carries the payload. `base` turns the base frame's
    /// gravity into the frames' common one. Positive along the axis: what gravity would turn the joint by if it could. Bodies
    /// without mass count as massless.
    pub fn gravity_torque(&self, base: &Pose, joint: &[Pose], body: &[Pose], payload: f64, torque: &mut [f64]) {
        let description = self.description();
        let gravity = base.rotation * Vector3::from(description.gravity);
        let mut mass = payload;
        let mut moment =
            body.last().map_or(Vector3::zeros(), |last| last.point(&Vector3::from(description.payload_centre))) * payload;
        for j in (0..self.joints()).rev() {
            if let (Some(own), Some(centre)) = (description.joints[j].mass, description.joints[j].centre) {
                mass += own;
                moment += body[j].point(&Vector3::from(centre)) * own;
            }
            let axis = joint[j].rotation * self.axis(j);
            torque[j] = if self.is_revolute(j) {
                axis.dot(&(moment - joint[j].point(self.point(j)) * mass).cross(&gravity))
            } else {
                axis.dot(&gravity) * mass
            };
        }
    }
}
