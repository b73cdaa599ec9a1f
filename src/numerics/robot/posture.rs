//! The arm as it hangs: frames of all stations, what each joint carries, and gravity's torques (static part of Eq. 24).

use crate::robot::model::{RobotModel, Travel};
use crate::spatial::Pose;
use nalgebra::Vector3;

impl RobotModel {
    /// True when every link has a mass, so that torques mean something without a payload.
    pub(crate) fn has_masses(&self) -> bool {
        self.description()
            .joints
            .iter()
            .all(|joint| joint.mass.is_some() && joint.centre.is_some())
    }
}

/// What differs from the robot file's masses and the declared payload.
#[derive(Debug, Clone)]
pub struct LoadCorrection {
    /// Payload beyond the declared, kg.
    pub(crate) payload: f64,
    /// Its first moment beyond the declared, kg m, zero-pose base axes of the last body.
    pub(crate) payload_moment: Vector3<f64>,
    /// Mass of each body beyond the file's, at the file's centre, kg.
    pub(crate) body: Vec<f64>,
    /// First moment of each body beyond that, kg m, zero-pose base axes.
    pub(crate) body_moment: Vec<Vector3<f64>>,
    /// Torque on each joint that masses do not make, e.g. of a balancer, Nm.
    pub(crate) torque: Vec<f64>,
}

impl LoadCorrection {
    /// No correction, of an arm with so many joints.
    pub fn new(joints: usize) -> Self {
        let none = vec![0.0; joints];
        let body_moment = vec![Vector3::zeros(); joints];
        Self {
            payload: 0.0,
            payload_moment: Vector3::zeros(),
            body: none.clone(),
            body_moment,
            torque: none,
        }
    }

    /// Sets every correction to zero.
    pub(crate) fn clear(&mut self) {
        self.payload = 0.0;
        self.payload_moment = Vector3::zeros();
        self.body.fill(0.0);
        self.body_moment.fill(Vector3::zeros());
        self.torque.fill(0.0);
    }
}

/// Mass (kg) and first moment (kg m, common frame) of all that hangs beyond a station.
#[derive(Debug, Clone, Copy, Default)]
pub struct Carried {
    /// kg.
    pub(crate) mass: f64,
    /// First moment, kg m.
    pub(crate) moment: Vector3<f64>,
}

/// Where the arm is and what it carries. Frames map zero-pose coordinates to one common frame.
#[derive(Debug, Clone)]
pub struct Posture {
    /// Frame behind station k = 0..=n: it carries the axis of joint k (from 0), the last one the tool.
    pub(crate) behind: Vec<Pose>,
    /// Frame of the body that joint j moves.
    pub(crate) body: Vec<Pose>,
    /// What hangs beyond station k: bodies k.. and the payload.
    pub(crate) carried: Vec<Carried>,
    /// Torque of what hangs about each joint, Nm (N for a prismatic one): what it would turn the joint by if it could.
    pub torque: Vec<f64>,
    /// Common frame, m/s2.
    pub(crate) gravity: Vector3<f64>,
}

impl Posture {
    /// All frames at the zero pose, nothing carried.
    pub fn new(joints: usize) -> Self {
        Self {
            behind: vec![Pose::identity(); joints + 1],
            body: vec![Pose::identity(); joints],
            carried: vec![Carried::default(); joints + 1],
            torque: vec![0.0; joints],
            gravity: Vector3::zeros(),
        }
    }

    /// The arm of the robot file at joint positions `q` with `payload` kg declared on the tool, as if nothing yielded.
    pub fn as_stated(robot: &RobotModel, q: &[f64], payload: f64) -> Self {
        let mut posture = Self::new(robot.joints());
        for (joint, travel) in q.iter().enumerate() {
            let behind = posture.behind[joint] * robot.motion(joint, &Travel::new(*travel));
            (posture.body[joint], posture.behind[joint + 1]) = (behind, behind);
        }
        posture.gravity_torques(robot, payload, &LoadCorrection::new(robot.joints()));
        posture
    }

    /// Computes what is carried and the torques from the frames, with `payload` kg declared on the tool.
    ///
    /// Gravity is known in the base frame as corrected, hence `behind[0]`. Bodies without mass count as massless.
    pub fn gravity_torques(
        &mut self,
        robot: &RobotModel,
        payload: f64,
        load_correction: &LoadCorrection,
    ) {
        let description = robot.description();
        let n = robot.joints();
        self.gravity = self.behind[0].rotation * Vector3::from(description.gravity);
        let last = self.body[n - 1];
        let mut carried = Carried {
            mass: payload + load_correction.payload,
            moment: last.point(&Vector3::from(description.payload_centre))
                * (payload + load_correction.payload)
                + last.rotation * load_correction.payload_moment,
        };
        self.carried[n] = carried;
        for j in (0..n).rev() {
            if let (Some(stated), Some(centre)) =
                (description.joints[j].mass, description.joints[j].centre)
            {
                let mass = stated + load_correction.body[j];
                carried.mass += mass;
                carried.moment += self.body[j].point(&Vector3::from(centre)) * mass;
            }
            carried.moment += self.body[j].rotation * load_correction.body_moment[j];
            self.carried[j] = carried;
            let axis = self.axis(robot, j);
            self.torque[j] = load_correction.torque[j]
                + if robot.is_revolute(j) {
                    axis.dot(
                        &(carried.moment - self.behind[j].point(robot.point(j)) * carried.mass)
                            .cross(&self.gravity),
                    )
                } else {
                    axis.dot(&self.gravity) * carried.mass
                };
        }
    }

    /// Axis of joint `joint`, common frame.
    fn axis(&self, robot: &RobotModel, joint: usize) -> Vector3<f64> {
        self.behind[joint].rotation * robot.axis(joint)
    }

    /// Which way is down, in a station's zero-pose axes; `None` without gravity.
    pub(crate) fn down(&self, station: usize) -> Option<Vector3<f64>> {
        let gravity = self.behind[station].rotation.tr_mul(&self.gravity);
        gravity.try_normalize(0.0)
    }

    /// Where the tool is in the base frame, m.
    pub(crate) fn tool(&self, robot: &RobotModel) -> Vector3<f64> {
        let point = self.behind[robot.joints()].point(&robot.home().translation);
        self.behind[0].inverse().point(&point)
    }

    /// Moment (Nm) of all beyond station `station` about `point` (m), both in the station's zero-pose axes.
    pub(crate) fn moment(&self, station: usize, point: &Vector3<f64>) -> Vector3<f64> {
        let frame = &self.behind[station];
        let Carried { mass, moment } = self.carried[station];
        frame
            .rotation
            .tr_mul(&(moment - frame.point(point) * mass).cross(&self.gravity))
    }

    /// Torque about joint `joint` per kg m of first moment of body `body` along each zero-pose axis; zero if it does not carry it.
    pub(crate) fn torque_of_moment(
        &self,
        robot: &RobotModel,
        joint: usize,
        body: usize,
    ) -> Vector3<f64> {
        if body < joint || !robot.is_revolute(joint) {
            return Vector3::zeros();
        }
        // axis . (R e x g) = (R^T (g x axis)) . e
        self.body[body]
            .rotation
            .tr_mul(&self.gravity.cross(&self.axis(robot, joint)))
    }

    /// Torque about joint `joint` per kg at the payload's centre.
    pub(crate) fn torque_of_payload(&self, robot: &RobotModel, joint: usize) -> f64 {
        self.torque_of_weight(
            robot,
            joint,
            robot.joints() - 1,
            &Vector3::from(robot.description().payload_centre),
        )
    }

    /// Torque about joint `joint` per kg at the centre of body `body`; zero if it does not carry it or the file gives no centre.
    pub(crate) fn torque_of_mass(&self, robot: &RobotModel, joint: usize, body: usize) -> f64 {
        let centre = robot.description().joints[body]
            .centre
            .filter(|_| body >= joint);
        centre.map_or(0.0, |centre| {
            self.torque_of_weight(robot, joint, body, &Vector3::from(centre))
        })
    }

    /// Torque about a joint per kg at a point (m, zero pose) of a body.
    fn torque_of_weight(
        &self,
        robot: &RobotModel,
        joint: usize,
        body: usize,
        point: &Vector3<f64>,
    ) -> f64 {
        if !robot.is_revolute(joint) {
            return self.axis(robot, joint).dot(&self.gravity);
        }
        let arm = self.body[body].point(point) - self.behind[joint].point(robot.point(joint));
        self.axis(robot, joint).dot(&arm.cross(&self.gravity))
    }
}
