//! Generalised gravity forces on the joints, from link masses and payload (static part of Eq. 24).

use crate::robot::model::RobotModel;
use crate::spatial::Pose;
use nalgebra::Vector3;

impl RobotModel {
    /// True when every link has a mass, so that torques mean something without a payload.
    pub fn has_masses(&self) -> bool {
        self.description().joints.iter().all(|joint| joint.mass.is_some() && joint.centre.is_some())
    }

    /// Writes the gravity torque (Nm; N for prismatic joints) about each joint at `q` with `payload` kg on the tool.
    ///
    /// Positive along the joint's axis: what gravity would turn the joint by if it could. Bodies without mass count as massless.
    pub fn gravity_torque(&self, q: &[f64], payload: f64, torque: &mut [f64]) {
        let n = self.joints();
        let description = self.description();
        let gravity = Vector3::from(description.gravity);
        // First pass: axes, points and centres where they are now, kept on the stack for up to 16 joints.
        let mut pose = Pose::identity();
        let mut mass_moment = [(0.0, Vector3::zeros()); 16];
        let mut axis_point = [(Vector3::zeros(), Vector3::zeros()); 16];
        assert!(n <= 16, "robots with more than 16 joints are refused on import");
        for j in 0..n {
            axis_point[j] = (pose.rotation * self.axis(j), pose.point(self.point(j)));
            pose = pose * Pose::exp(&(self.screws()[j] * q[j]));
            let joint = &description.joints[j];
            if let (Some(mass), Some(centre)) = (joint.mass, joint.centre) {
                mass_moment[j] = (mass, pose.point(&Vector3::from(centre)) * mass);
            }
        }
        let mut mass = payload;
        let mut moment = pose.point(&Vector3::from(description.payload_centre)) * payload;
        for j in (0..n).rev() {
            mass += mass_moment[j].0;
            moment += mass_moment[j].1;
            let (axis, point) = &axis_point[j];
            torque[j] =
                if self.is_revolute(j) { axis.dot(&(moment - point * mass).cross(&gravity)) } else { axis.dot(&gravity) * mass };
        }
    }
}
