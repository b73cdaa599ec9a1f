//! Which motion to record for torques: an exciting one for a robot file, as a file and as a statement of what it will tell. And which commands to
//! send to drives.

mod drives;

pub use drives::{CommandsProposal, DriveCommandRequest, exciting_commands};

use crate::description::JointDescription;
use crate::dynamics::{ExciteRequest, ExcitingMotion, excite};
use crate::error::{Error, Fault, Result};
use crate::identified::robot_file;
use crate::stage::{dynamic_arm, must_be_bodies, must_turn};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What is asked; angles in deg. A list of one number holds for all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRequest {
    /// The robot file.
    pub robot: PathBuf,
    /// The URDF that it refers to.
    pub urdf: Option<PathBuf>,
    /// s.
    pub seconds: f64,
    /// Rows a second.
    pub rate: f64,
    /// Sines of a joint.
    pub harmonics: usize,
    /// Joint ranges instead of the robot file's.
    pub limits: Option<Vec<[f64; 2]>>,
    /// Part of each joint's travel left free at either end, percent.
    pub margin: f64,
    /// deg/s.
    pub speed: Vec<f64>,
    /// deg/s2.
    pub acceleration: Vec<f64>,
    /// Nm of a row.
    pub noise: Vec<f64>,
    /// Generations of the search.
    pub generations: usize,
    /// The same seed gives the same motion.
    pub seed: u64,
    /// Worker threads.
    pub jobs: usize,
}

/// A motion for a robot.
pub struct MotionProposal {
    /// Its name.
    pub(crate) robot: String,
    /// What was asked, SI.
    pub(crate) request: ExciteRequest,
    /// The motion, and what it tells.
    pub motion: ExcitingMotion,
    joints: usize,
}

/// Searches a motion. Fails with the robot file's faults, or those of the request.
pub fn exciting_motion(asked: &MotionRequest) -> Result<MotionProposal> {
    let robot = robot_file(&asked.robot, asked.urdf.as_deref())?;
    must_be_bodies(&robot)?;
    must_turn(&robot, "exciting motions")?;
    let (arm, _) = dynamic_arm(&robot)?;
    let n = robot.joints.len();
    let mut faults = Vec::new();
    let mut list =
        |option: &str, values: &[f64], unit: f64| one_a_joint(option, values, unit, n, &mut faults);
    let degrees = 1f64.to_radians();
    let (speed, acceleration) = (
        list("--speed", &asked.speed, degrees),
        list("--acceleration", &asked.acceleration, degrees),
    );
    let noise = list("--noise", &asked.noise, 1.0);
    let range = match &asked.limits {
        Some(limits) if limits.len() != n => {
            faults.push(Fault::new(
                "--limits",
                format!("has {} ranges, the robot {n} joints", limits.len()),
            ));
            Vec::new()
        }
        Some(limits) => limits
            .iter()
            .map(|range| range.map(f64::to_radians))
            .collect(),
        None => declared(&asked.robot, &robot.joints, &mut faults),
    };
    if !faults.is_empty() {
        return Err(Error::Spec(faults));
    }
    let inside = |[least, most]: [f64; 2]| {
        let left = 0.01 * asked.margin * (most - least);
        [least + left, most - left]
    };
    let request = ExciteRequest {
        seconds: asked.seconds,
        rate: asked.rate,
        harmonics: asked.harmonics,
        range: range.into_iter().map(inside).collect(),
        speed,
        acceleration,
        noise,
        generations: asked.generations,
        seed: asked.seed,
        jobs: asked.jobs,
    };
    let motion = excite(&arm, &request).map_err(as_options)?;
    Ok(MotionProposal {
        robot: robot.name,
        request,
        motion,
        joints: n,
    })
}

/// Numbers of an option in another unit, one a joint where there is one for all.
fn one_a_joint(
    option: &str,
    values: &[f64],
    unit: f64,
    n: usize,
    faults: &mut Vec<Fault>,
) -> Vec<f64> {
    match values {
        [one] => vec![one * unit; n],
        all if all.len() == n => all.iter().map(|value| value * unit).collect(),
        all => {
            faults.push(Fault::new(
                option,
                format!("has {} numbers; give one, or {n}: one a joint", all.len()),
            ));
            Vec::new()
        }
    }
}

/// Faults of a request at the options of the command.
fn as_options(error: Error) -> Error {
    let option = |fault: Fault| Fault::new(format!("--{}", fault.place), fault.message);
    match error {
        Error::Spec(faults) => Error::Spec(faults.into_iter().map(option).collect()),
        other => other,
    }
}

/// Ranges of the robot file, rad.
fn declared(file: &Path, joints: &[JointDescription], faults: &mut Vec<Fault>) -> Vec<[f64; 2]> {
    let missing: Vec<String> = (1..)
        .zip(joints)
        .filter(|(_, joint)| joint.limits.is_none())
        .map(|(number, _): (usize, _)| number.to_string())
        .collect();
    if !missing.is_empty() {
        let message = format!(
            "joint {} has no range: give --limits MIN:MAX,.. in deg",
            missing.join(", ")
        );
        faults.push(Fault::new(file.display().to_string(), message));
    }
    joints.iter().filter_map(|joint| joint.limits).collect()
}

impl MotionProposal {
    /// The motion as delimited text in even steps: time_s, q1_deg .., dq1_deg_s .., ddq1_deg_s2 ...
    pub fn csv(&self) -> String {
        let n = self.joints;
        let names = |name: &str| {
            (1..=n)
                .map(|joint| format!(",{}", name.replace("{j}", &joint.to_string())))
                .collect::<String>()
        };
        let mut text = format!(
            "time_s{}{}{}\n",
            names("q{j}_deg"),
            names("dq{j}_deg_s"),
            names("ddq{j}_deg_s2")
        );
        for (row, time) in self.motion.time.iter().enumerate() {
            let _ = write!(text, "{time:.6}");
            for list in [
                &self.motion.position,
                &self.motion.velocity,
                &self.motion.acceleration,
            ] {
                list[n * row..n * (row + 1)].iter().for_each(|value| {
                    let _ = write!(text, ",{:.7}", value.to_degrees());
                });
            }
            text.push('\n');
        }
        text
    }

    fn base(&self) -> usize {
        self.motion.parameters.len() - 2 * self.joints
    }

    /// What the motion will tell, for a person.
    pub fn text(&self) -> String {
        let motion = &self.motion;
        let mut text = format!(
            "{}: {:.1} s at {:.0} Hz, {} base parameters of {} inertial numbers, friction of {} joints\n",
            self.robot,
            self.request.seconds,
            self.request.rate,
            self.base(),
            motion.inertials,
            self.joints
        );
        let _ = writeln!(
            text,
            "condition number {:.0}; of random motions within the same limits {:.0}",
            motion.condition[0], motion.condition[1]
        );
        let _ = writeln!(
            text,
            "expected sigmas are {:.2} times smaller than those of random motions (geometric mean over parameters)",
            motion.gain
        );
        text.push_str("                               expected sigma   of random motions\n");
        for one in &motion.parameters {
            let _ = writeln!(
                text,
                "{:<30} {:>14.4e}      {:>14.4e} {}",
                one.name, one.sigma, one.random, one.unit
            );
        }
        for line in &motion.unseen {
            let _ = writeln!(text, "will not determine: {line}");
        }
        text
    }

    /// The same as one JSON document, with the motion.
    pub(crate) fn document(&self) -> Value {
        let motion = &self.motion;
        let parameters = motion.parameters.iter().map(|one| {
            json!({ "name": one.name, "unit": one.unit, "sigma": one.sigma, "random_sigma": one.random, "inflation": one.inflation })
        });
        let rows = |list: &[f64]| {
            list.chunks_exact(self.joints)
                .map(|row| json!(row))
                .collect::<Vec<Value>>()
        };
        json!({
            "robot": self.robot, "seconds": self.request.seconds, "rate_hz": self.request.rate, "seed": self.request.seed,
            "noise_nm": self.request.noise, "inertial_numbers": motion.inertials, "base_parameters": self.base(),
            "condition": motion.condition[0], "random_condition": motion.condition[1], "gain": motion.gain,
            "parameters": parameters.collect::<Vec<_>>(), "will_not_determine": motion.unseen,
            "time_s": motion.time, "q_rad": rows(&motion.position), "dq_rad_s": rows(&motion.velocity),
            "ddq_rad_s2": rows(&motion.acceleration),
        })
    }
}
