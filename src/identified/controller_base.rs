//! Whether the base in which the maker's controller counts poses is that of the robot file.

use super::IdentifiedModel;
use crate::description::RobotDescription;
use crate::program::Language;
use crate::raw::{self, ending};
use crate::robot::import::{RobotFileText, controller_base};
use crate::robot::{LIBRARY, RobotModel};
use crate::spatial::Pose;
use crate::yaml;
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;

/// Bases that are nearer to each other are the same, rad and m.
const SAME: [f64; 2] = [1e-5, 1e-5];
/// How near nominal axes must come to those of an arm of the library: rad and m.
const NEAR: [f64; 2] = [2e-3, 5e-3];

impl IdentifiedModel {
    /// Why poses of a program in that language stand in another base than the robot file's; none where nothing says so.
    pub(crate) fn base_differs(&self, language: Language) -> Option<String> {
        self.base_beside().or_else(|| match language {
            Language::UrScript => half_turned(&self.robot),
            Language::Fanuc => lower_than_the_world(&self.robot),
            Language::Krl | Language::Rapid => None,
        })
    }

    /// Of a URDF that has a link `base` beside the one where the robot file begins.
    fn base_beside(&self) -> Option<String> {
        let with_ending = |wanted: [&'static str; 2]| {
            let is = move |path: &&PathBuf| wanted.contains(&ending(path).as_str());
            self.sources.iter().filter(is)
        };
        let path = with_ending(["urdf", "xml"]).next()?;
        let mut files = with_ending(["yaml", "yml"]).filter_map(|file| raw::text(file).ok());
        let ours = files.find_map(|text| {
            let tree = yaml::parse(&text).0?;
            tree.at("kinematics.urdf.base")?.text()
        })?;
        let (label, text) = (path.display().to_string(), raw::text(path).ok()?);
        let file = RobotFileText {
            label: &label,
            text: &text,
        };
        let base = controller_base(file, &ours)?;
        let (turn, shift) = (base.rotation_vector(), base.translation);
        if turn.norm() < SAME[0] && shift.norm() < SAME[1] {
            return None;
        }
        let [x, y, z] = <[f64; 3]>::from(shift * 1e3).map(|mm| format!("{mm:.1}"));
        let [a, b, c] = <[f64; 3]>::from(turn).map(|rad| format!("{:.1}", rad.to_degrees()));
        Some(format!(
            "the pose stands in the controller's base, which is the link `base` of {}; the robot file begins at `{ours}`, where `base` stands at {x}, {y}, \
             {z} mm, turned by the rotation vector {a}, {b}, {c} deg: state `kinematics: {{urdf: {{base: base, ..}}}}` in the robot file and run again",
            path.file_name().unwrap_or_default().to_string_lossy()
        ))
    }
}

/// An arm of Universal Robots as ROS has it: its `base_link` is turned by half a turn against the controller's base.
fn half_turned(robot: &RobotDescription) -> Option<String> {
    let half = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
    let half = Pose::new(half, Vector3::zeros());
    let arms = LIBRARY.iter().filter(|arm| arm.name.starts_with("ur"));
    let is = |theirs: &RobotDescription, base: &Pose| {
        robot.joints.len() == theirs.joints.len()
            && robot
                .joints
                .iter()
                .zip(&theirs.joints)
                .all(|(ours, theirs)| {
                    let axis = Vector3::from(ours.axis);
                    let away = base.point(&Vector3::from(theirs.point)) - Vector3::from(ours.point);
                    let apart = (away - axis * axis.dot(&away)).norm();
                    (axis - base.rotation * Vector3::from(theirs.axis)).norm() < NEAR[0]
                        && apart < NEAR[1]
                })
    };
    let arms: Vec<RobotDescription> = arms
        .filter_map(|arm| Some(arm.read().ok()?.robot))
        .collect();
    let as_it_is = arms.iter().any(|arm| is(arm, &Pose::identity()));
    (!as_it_is && arms.iter().any(|arm| is(arm, &half))).then(|| {
        "the pose stands in the controller's base, and the robot file's is turned by 180 deg about z against it, as `base_link` of ROS is: describe \
         the arm in the controller's base (of a URDF `base: base`) and run again"
            .into()
    })
}

/// FANUC's world is where axis 1 is at the height of axis 2; files that begin at the arm's foot are lower.
fn lower_than_the_world(robot: &RobotDescription) -> Option<String> {
    let model = RobotModel::new(robot.clone());
    if model.joints() < 2 || !model.is_revolute(0) || !model.is_revolute(1) {
        return None;
    }
    let height = model
        .axis(0)
        .dot(&Vector3::from(robot.joints[1].point))
        .abs();
    let crossed = model.axis(0).dot(model.axis(1)).abs() < 0.1;
    (crossed && height > NEAR[1]).then(|| {
        format!(
            "the pose stands in the controller's world, which is at the height of axis 2; the robot file's base is {:.1} mm away from there along axis 1: \
             describe the arm from the height of axis 2 (of a URDF of ROS-Industrial `base: base`) and run again",
            height * 1e3
        )
    })
}
