//! The arm whose torques are simulated, from the robot table, and a recorded motion with its torques at the joints.

use crate::Chunks;
use crate::description::{InertiaMoments, JointDescription, JointKind, RobotDescription};
use crate::dynamics::{DynamicArm, Inertial, InertialTolerance, TorqueRecording, TorqueSource};
use crate::error::{Error, Result};
use crate::table::ArmMotion;
use calib_numerics::robot::import::impossible_inertia;
use nalgebra::{Matrix3, Point3, Vector3};

/// How far masses may be off where the robot file does not say it: those of CAD models and of data sheets.
const ASSUMED: InertialTolerance = InertialTolerance {
    mass_relative: 0.05,
    centre: 0.01,
    inertia_relative: 0.2,
};

fn slides(joint: &JointDescription) -> bool {
    joint.kind == JointKind::Prismatic
}

/// Fails with a joint that slides, where `what` is of joints that turn alone.
pub fn must_turn(robot: &RobotDescription, what: &str) -> Result<()> {
    match robot.joints.iter().position(slides) {
        None => Ok(()),
        Some(joint) => {
            let joint = joint + 1;
            let message = format!("joint {joint} slides; {what} are of revolute joints alone");
            Err(Error::data("table robot", message))
        }
    }
}

/// The arm, and what a person should know of what the robot file leaves open.
pub fn dynamic_arm(robot: &RobotDescription) -> Result<(DynamicArm, Vec<String>)> {
    let mut notes = Vec::new();
    let declared = |(index, joint): (usize, &JointDescription)| {
        let moments = robot.inertias.links.get(index).copied().flatten();
        match (joint.mass, joint.centre, moments) {
            (Some(mass), Some(centre), Some(moments)) => Ok(inertial(mass, centre, &moments)),
            (mass, centre, moments) => {
                let lacks = [
                    mass.is_none().then_some("no mass"),
                    centre.is_none().then_some("no centre of mass"),
                    moments.is_none().then_some("no moments of inertia"),
                ];
                let lacks: Vec<&str> = lacks.into_iter().flatten().collect();
                Err(format!("link {} has {}", index + 1, lacks.join(", ")))
            }
        }
    };
    let joints = || robot.joints.iter();
    let all: Result<Vec<_>, String> = joints().enumerate().map(declared).collect();
    let links = match all {
        Ok(links) => Some(links),
        Err(lacks) => {
            notes.push(format!(
                "{lacks} in the robot file: masses are identified, and a wrong one, of a payload too, cannot be a finding"
            ));
            None
        }
    };
    let tolerance = match robot.inertias.tolerance {
        Some(stated) => InertialTolerance {
            mass_relative: stated.mass,
            centre: stated.centre,
            inertia_relative: stated.inertia,
        },
        None => {
            if links.is_some() {
                notes.push(format!(
                    "the robot file does not say how far its masses may be off: assumed, one sigma, are masses {} %, centres {} mm, \
                     inertias {} %",
                    100.0 * ASSUMED.mass_relative,
                    1e3 * ASSUMED.centre,
                    100.0 * ASSUMED.inertia_relative
                ));
            }
            ASSUMED
        }
    };
    let payload = (robot.payload_mass > 0.0).then(|| {
        let moments = robot.inertias.payload.unwrap_or_default();
        inertial(robot.payload_mass, robot.payload_centre, &moments)
    });
    let arm = DynamicArm {
        axes: joints().map(|joint| Vector3::from(joint.axis)).collect(),
        points: joints().map(|joint| Point3::from(joint.point)).collect(),
        prismatic: joints().map(slides).collect(),
        tool: Point3::from(robot.tool),
        links,
        payload,
        gravity: Vector3::from(robot.gravity),
        ratio: joints()
            .map(|joint| joint.reduction_ratio.unwrap_or(1.0))
            .collect(),
        coupled: robot
            .couplings
            .iter()
            .map(|coupling| (coupling.moved, coupling.by))
            .collect(),
        tolerance,
    };
    Ok((arm, notes))
}

/// Fails where no body has the declared moments of inertia of a link: the torques of such an arm are no arm's.
pub fn must_be_bodies(robot: &RobotDescription) -> Result<()> {
    let links = (1..)
        .zip(&robot.inertias.links)
        .map(|(link, moments): (usize, _)| (format!("link {link}"), moments));
    for (body, moments) in links.chain([("the payload".to_string(), &robot.inertias.payload)]) {
        if let Some(message) = moments.as_ref().and_then(impossible_inertia) {
            let message = format!(
                "{body}: {message}; correct it in the robot file: torques depend on it, positions do not"
            );
            return Err(Error::data("table robot", message));
        }
    }
    Ok(())
}

fn inertial(mass: f64, centre: [f64; 3], [xx, xy, xz, yy, yz, zz]: &InertiaMoments) -> Inertial {
    let inertia = Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz);
    Inertial {
        mass,
        centre: Point3::from(centre),
        inertia,
    }
}

/// Nm at the joint (N of one that slides) per ampere of its motor, joint by joint. Fails with the joints whose numbers are missing.
pub fn torque_per_ampere(robot: &RobotDescription) -> Result<Vec<f64>> {
    let factor = |joint: &JointDescription| Some(joint.reduction_ratio? * joint.motor_constant?);
    let all: Vec<Option<f64>> = robot.joints.iter().map(factor).collect();
    let missing = (1..=all.len()).filter(|joint| all[joint - 1].is_none());
    let missing: Vec<String> = missing.map(|joint| joint.to_string()).collect();
    if missing.is_empty() {
        return Ok(all.into_iter().flatten().collect());
    }
    let message = format!(
        "the recording holds motor currents, and joint {} has no reduction ratio or no motor constant (Nm/A) in the robot file: \
         state both at each joint, e.g. `reduction_ratio: 100` and `motor_constant: 0.12`",
        missing.join(", ")
    );
    Err(Error::data("table robot", message))
}

/// Which rows judge and choose nothing; a row is identified by its number in the recording, from 0.
pub(super) type HeldOut<'a> = dyn Fn(&ArmMotion, usize, usize) -> bool + 'a;

/// Torques of a motion that is read chunk by chunk.
pub(super) struct RecordedTorques<'a> {
    motion: &'a Chunks<ArmMotion>,
    joints: usize,
    /// Nm per A of each joint, where motor currents were recorded.
    factor: Option<Vec<f64>>,
    /// Whether a row of a chunk is held out, by the number of the chunk's first row and its own in the chunk; without it none is.
    held_out: Option<Box<HeldOut<'a>>>,
}

impl<'a> RecordedTorques<'a> {
    /// The torques of a motion. Fails where it has neither torques nor currents, or the robot file does not say what an ampere is.
    pub fn of(motion: &'a Chunks<ArmMotion>, robot: &RobotDescription) -> Result<Self> {
        let mut seen = None;
        motion.each(|chunk| {
            let signals = (chunk.torque.is_some(), chunk.current.is_some());
            seen.get_or_insert((chunk.joints, signals));
            Ok(())
        })?;
        let (joints, signals) = seen.unwrap_or_default();
        let factor = match signals {
            (true, _) => None,
            (false, true) => Some(torque_per_ampere(robot)?),
            (false, false) => {
                let message = "has neither torques nor currents";
                return Err(Error::data("table motion", message));
            }
        };
        Ok(Self {
            motion,
            joints,
            factor,
            held_out: None,
        })
    }

    /// The same with rows that judge in the end.
    pub fn holding_out(self, held_out: Box<HeldOut<'a>>) -> Self {
        Self {
            held_out: Some(held_out),
            ..self
        }
    }

    /// Whether torques are motor currents times a constant.
    pub fn is_current(&self) -> bool {
        self.factor.is_some()
    }

    fn block(&self, mut motion: ArmMotion, first: usize) -> TorqueRecording {
        let rows = motion.rows();
        let held_out = match &self.held_out {
            Some(held_out) => (0..rows).map(|row| held_out(&motion, first, row)).collect(),
            None => vec![false; rows],
        };
        let torque = match (&self.factor, motion.current.take()) {
            (Some(factor), Some(current)) => {
                let factors = factor.iter().cycle();
                current.iter().zip(factors).map(|(i, k)| i * k).collect()
            }
            _ => motion.torque.take().unwrap_or_default(),
        };
        let trajectory = motion.trajectory.iter();
        let trajectory = trajectory.map(|number| u32::try_from(*number).unwrap_or(u32::MAX));
        TorqueRecording {
            joints: motion.joints,
            time: motion.time,
            position: motion.q,
            velocity: motion.velocity,
            simulated: motion.simulated,
            torque,
            temperature: motion.temperature,
            trajectory: trajectory.collect(),
            held_out,
            from_current: self.is_current(),
        }
    }
}

impl TorqueSource for RecordedTorques<'_> {
    fn joints(&self) -> usize {
        self.joints
    }

    fn rows(&self) -> usize {
        self.motion.rows()
    }

    fn blocks(&self, take: &mut dyn FnMut(&TorqueRecording) -> Result<()>) -> Result<()> {
        let mut first = 0;
        self.motion.each(|chunk| {
            let rows = chunk.rows();
            take(&self.block(chunk, first))?;
            first += rows;
            Ok(())
        })
    }
}
