//! Formats of rigid bodies that simulators read, each a template: every frame parallel to the base at the zero pose and on its joint's axis,
//! so that no angle is converted and a joint at 0 is the robot at 0. The measured point is `tool0`.

use super::body::{document, numbers, offset, origin, tool};
use super::friction::{ARMATURE, DAMPING, DRIVE, FRICTION, SPRINGS, gear, positive, spring};
use super::{CarriedTorques, Export, Format};
use crate::description::JointKind;
use crate::error::{Result, one_line};
use crate::spatial::Pose;
use minijinja::{Value, context};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

pub(super) const URDF: Format = Format {
    name: "urdf",
    help: "Unified robot description: joints at the corrected axes",
    comment: "<!--",
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION]),
    text: urdf,
};

/// As Gazebo and Drake read it: as URDF, but with limits only where they are known.
pub(super) const SDF: Format = Format {
    name: "sdf",
    help: "Gazebo's and Drake's model: joints at the corrected axes, the tool as a frame",
    comment: "<!--",
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION]),
    text: sdf,
};

pub(super) const MJCF: Format = Format {
    name: "mjcf",
    help: "MuJoCo model: bodies and joints at the corrected axes, the tool as a site",
    comment: "<!--",
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION, ARMATURE, DRIVE, SPRINGS[0], SPRINGS[1]]),
    text: mjcf,
};

/// A torque and a speed that no joint has: of a limit URDF demands both.
const UNKNOWN: &str = "1e9";
/// Mass, kg, and inertia, kg m2, that no body has less of: MuJoCo refuses moving bodies without.
const LEAST: [&str; 2] = ["0.001", "1e-6"];

fn urdf(export: &Export) -> Result<String> {
    let mut remarks = export.remarks_in(&URDF);
    let joints = &export.corrected.joints;
    if joints
        .iter()
        .any(|joint| joint.limits.is_some() || joint.kind == JointKind::Prismatic)
    {
        remarks.push(format!(
            "largest torques and speeds of the joints are not known: {UNKNOWN} stands for none, which URDF does not have"
        ));
    }
    document(&remarks, include_str!("urdf.xml"), arm(export))
}

fn sdf(export: &Export) -> Result<String> {
    let mut remarks = export.remarks_in(&SDF);
    if is_massless(export) {
        remarks.push(
            "links whose mass is not known have none here: SDFormat takes them as 1 kg".into(),
        );
    }
    document(&remarks, include_str!("sdf.xml"), arm(export))
}

fn mjcf(export: &Export) -> Result<String> {
    let mut remarks = export.remarks_in(&MJCF);
    if !export.corrected.couplings.is_empty() {
        remarks.push(
            "couplings of joints are not part of it: they stand in the original robot file".into(),
        );
    }
    if is_massless(export) {
        remarks.push(format!(
            "bodies whose mass is not known have {} kg",
            LEAST[0]
        ));
    }
    document(&remarks, include_str!("mjcf.xml"), arm(export))
}

/// Whether the mass of some body is not known.
fn is_massless(export: &Export) -> bool {
    (0..export.corrected.joints.len()).any(|joint| export.body(joint).is_none())
}

/// What the templates show of the arm: numbers as texts, what is not known missing.
fn arm(export: &Export) -> Value {
    let robot = &export.corrected;
    let (mut before, mut parent) = ([0.0; 3], "base_link".to_string());
    let mut joints = Vec::new();
    for (index, joint) in robot.joints.iter().enumerate() {
        let child = format!("link_{}", index + 1);
        let kind = match (joint.kind, joint.limits) {
            (JointKind::Prismatic, _) => "prismatic",
            (JointKind::Revolute, Some(_)) => "revolute",
            (JointKind::Revolute, None) => "continuous",
        };
        let torques = export.identified.torques.as_ref();
        let text = |value: Option<f64>| value.map(|value| numbers([value]));
        let found = |effect| text(torques.and_then(|torques| positive(torques, effect, index)));
        let spring = torques.and_then(|torques| spring(torques, index));
        let body = export.body(index).map(|body| {
            context! {
                remark => body.remark, placeholder => body.is_placeholder(), centre => numbers(body.centre),
                mass => numbers([body.mass]), inertia => body.inertia.map(|moment| numbers([moment])),
            }
        });
        joints.push(context! {
            name => one_line(&joint.name), kind, parent, child => child.clone(), body, axis => numbers(joint.axis),
            offset => offset(joint.point, before), limits => joint.limits.map(|limits| limits.map(|limit| numbers([limit]))),
            damping => found(DAMPING), friction => found(FRICTION), armature => found(ARMATURE),
            stiffness => text(spring.map(|[stiffness, _]| stiffness)), springref => text(spring.map(|[_, reference]| reference)),
            gear => text(torques.and_then(|torques| gear(torques, index))),
        });
        (before, parent) = (joint.point, child);
    }
    let tool = tool(robot.tool, &robot.tool_rotation);
    let (place, turn) = origin(&Pose::new(Matrix3::identity(), before.into()), &tool);
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(tool.rotation));
    context! {
        name => one_line(&robot.name), gravity => numbers(robot.gravity), joints, unknown => UNKNOWN,
        moments => ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"],
        least => context! { mass => LEAST[0], inertia => LEAST[1] },
        tool => context! { parent, offset => numbers(place), turn => numbers(turn), quaternion => numbers([q.w, q.i, q.j, q.k]) },
    }
}
