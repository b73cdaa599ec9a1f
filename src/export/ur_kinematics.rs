//! The file `kinematics_params_file` of Universal Robots' ROS drivers and descriptions: the origin of each joint in the frame of the one
//! before, whose z is the joint's axis. Frames stay as near as axes allow to those of the model's meshes.

use super::body::{moved, origin, tool};
use super::{CarriedGeometry, CarriedTorques, Export, Format};
use crate::description::RobotDescription;
use crate::error::{Error, Result};
use crate::robot::LIBRARY;
use crate::spatial::Pose;
use nalgebra::{Matrix3, Vector3};

pub(super) const UR_KINEMATICS: Format = Format {
    name: "ur_kinematics",
    help: "Universal Robots' kinematics_params_file, for their ROS drivers and ur_description",
    comment: "#",
    geometry: CarriedGeometry::Rigid,
    carries: CarriedTorques::Nothing,
    text,
};

/// Links as the file calls them, each moved by the joint of its number.
const LINKS: [&str; 6] = [
    "shoulder",
    "upper_arm",
    "forearm",
    "wrist_1",
    "wrist_2",
    "wrist_3",
];
/// How near nominal axes must come to those of an arm of the maker: rad and m.
const NEAR: [f64; 2] = [2e-3, 5e-3];

/// The nominal frames of the six links, the last at the flange, of the arm that this one is; and the frame that they are seen from.
fn nominal(robot: &RobotDescription) -> Option<(Pose, [Pose; 6])> {
    // The controller's base, and ROS' base_link, which is turned by half a turn.
    let half = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
    let bases = [Pose::identity(), Pose::new(half, Vector3::zeros())];
    let makers = LIBRARY
        .iter()
        .filter(|arm| arm.name.starts_with("ur"))
        .filter_map(|arm| arm.read().ok());
    makers
        .flat_map(|arm| bases.map(|base| (base, frames(&arm.robot).map(|frame| base * frame))))
        .find(|(_, frames)| {
            robot.joints.len() == LINKS.len()
                && robot.joints.iter().zip(frames).all(|(joint, frame)| {
                    let axis = Vector3::from(joint.axis);
                    let away = frame.translation - Vector3::from(joint.point);
                    let apart = (away - axis * axis.dot(&away)).norm();
                    (axis - frame.rotation.column(2)).norm() < NEAR[0] && apart < NEAR[1]
                })
        })
}

/// Frames of the maker's arm: z along the joint, x along the base's, the origin where the next link begins.
fn frames(robot: &RobotDescription) -> [Pose; 6] {
    std::array::from_fn(|index| {
        let joint = &robot.joints[index];
        let (z, point) = (Vector3::from(joint.axis), Vector3::from(joint.point));
        let next = robot.joints.get(index + 1);
        let next = Vector3::from(next.map_or(robot.tool, |next| next.point));
        let x = Vector3::x();
        let turn = Matrix3::from_columns(&[x, z.cross(&x), z]);
        Pose::new(turn, point + z * z.dot(&(next - point)))
    })
}

fn text(export: &Export) -> Result<String> {
    let (robot, corrected) = (&export.identified.robot, &export.corrected);
    let (base, nominal) = nominal(robot).ok_or_else(|| {
        let message = "is no arm of Universal Robots by its axes (UR3e, UR5, UR5e, UR10, UR10e, UR16e, UR20, in the controller's base or in \
                       base_link); allowed for other arms: --format urdf, xacro";
        Error::data(&robot.name, message)
    })?;
    export.refuse_worse()?;
    let mut out: String = export.head(&UR_KINEMATICS);
    let (mut before, mut links) = (base, String::new());
    for (index, (link, frame)) in LINKS.iter().zip(&nominal).enumerate() {
        let axis = frame.rotation.column(2).into();
        let placed = moved(frame, &axis, &corrected.joints[index]);
        let ([x, y, z], [roll, pitch, yaw]) = origin(&before, &placed);
        links.push_str(&format!(
            "  {link}:\n    x: {x:?}\n    y: {y:?}\n    z: {z:?}\n    roll: {roll:?}\n    pitch: {pitch:?}\n    yaw: {yaw:?}\n"
        ));
        before = placed;
    }
    let ([x, y, z], [roll, pitch, yaw]) =
        origin(&before, &tool(corrected.tool, &corrected.tool_rotation));
    out.push_str(&format!(
        "# not carried: the tool, {:.4} mm from tool0; in tool0 it stands at {x:?} {y:?} {z:?} m, turned by {roll:?} {pitch:?} {yaw:?} rad\n",
        1e3 * x.hypot(y).hypot(z)
    ));
    out.push_str("# the driver compares `hash` with the controller's own calibration and says that they differ: they do\n");
    let hash = u64::from_str_radix(&export.mark(UR_KINEMATICS.name).model, 16).unwrap_or_default();
    Ok(out + &format!("kinematics:\n{links}  hash: calib_{hash}\n"))
}
