//! Formats of rigid bodies that simulators read, each a template: every frame parallel to the base at the zero pose and on its joint's axis,
//! so that no angle is converted and a joint at 0 is the robot at 0. The measured point is `tool0`, but of
//! a URDF that is written after the arm's own, whose frames and names it has.

use super::body::{LinkBody, document, moved, numbers, origin, tool};
use super::friction::{
    ARMATURE, DAMPING, DRIVE, FRICTION, SPRINGS, digits, gear, positive, spring,
};
use super::own_mjcf::OwnMjcf;
use super::own_urdf::{OwnJoint, OwnUrdf};
use super::{CarriedGeometry, CarriedTorques, Export, Format};
use crate::description::{JointDescription, JointKind};
use crate::error::{Result, one_line};
use crate::spatial::Pose;
use minijinja::{Value, context};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

pub(super) const URDF: Format = Format {
    name: "urdf",
    help: "Unified robot description: joints at the corrected axes",
    comment: "<!--",
    geometry: CarriedGeometry::Rigid,
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION]),
    text: urdf,
};

/// As Gazebo and Drake read it: as URDF, but with limits only where they are known.
pub(super) const SDF: Format = Format {
    name: "sdf",
    help: "Gazebo's and Drake's model: joints at the corrected axes, the tool as a frame",
    comment: "<!--",
    geometry: CarriedGeometry::Rigid,
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION]),
    text: sdf,
};

pub(super) const MJCF: Format = Format {
    name: "mjcf",
    help: "MuJoCo model: bodies and joints at the corrected axes, the tool as a site",
    comment: "<!--",
    geometry: CarriedGeometry::Rigid,
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION, ARMATURE, DRIVE, SPRINGS[0], SPRINGS[1]]),
    text: mjcf,
};

/// A torque and a speed that no joint has: of a limit URDF demands both.
const UNKNOWN: &str = "1e9";
/// Mass, kg, and inertia, kg m2, that no body has less of: MuJoCo refuses moving bodies without.
const LEAST: [&str; 2] = ["0.001", "1e-6"];

/// With the links, limits and frames of the URDF behind the model, where there is one.
fn urdf(export: &Export) -> Result<String> {
    let own = OwnUrdf::of(export)?;
    let mut remarks = export.remarks_in(&URDF);
    let joints = &export.corrected.joints;
    let is_limited = |(index, joint): (usize, &JointDescription)| {
        let own = own.as_ref().map(|own| &own.joints[index]);
        let known = own.is_some_and(|own| own.effort.is_some() && own.velocity.is_some());
        !known && (joint.limits.is_some() || joint.kind == JointKind::Prismatic)
    };
    if joints.iter().enumerate().any(is_limited) {
        remarks.push(format!(
            "largest torques and speeds of the joints are not known: {UNKNOWN} stands for none, which URDF does not have"
        ));
    }
    if is_massless(export) {
        remarks.push(
            "links whose mass is not known have no inertial: programs take them as massless, PyBullet as 1 kg each".into(),
        );
    }
    match &own {
        Some(own) => {
            let (file, tip) = (one_line(&own.file), one_line(&own.tip.0));
            remarks.push(format!(
                "links, limits and frames as in {file}; {tip} is the flange as there, {} the point that was measured",
                measured_name(own)
            ));
            if !own.others.is_empty() {
                let others: Vec<String> = own.others.iter().map(|one| one_line(one)).collect();
                remarks.push(format!(
                    "not carried: meshes, and links of {file} beside the chain: {}",
                    others.join(", ")
                ));
            }
        }
        None => remarks.push("tool0 is the point that was measured, not the flange".into()),
    }
    document(
        &remarks,
        include_str!("urdf.xml"),
        arm(export, own.as_ref()),
    )
}

/// What the link of the measured point is called beside those of a file.
fn measured_name(own: &OwnUrdf) -> String {
    let mut name = "measured_point".to_string();
    while own.has_link(&name) {
        name.push('_');
    }
    name
}

fn sdf(export: &Export) -> Result<String> {
    let mut remarks = export.remarks_in(&SDF);
    if is_massless(export) {
        remarks.push(
            "links whose mass is not known have none here: SDFormat takes them as 1 kg".into(),
        );
    }
    document(&remarks, include_str!("sdf.xml"), arm(export, None))
}

/// A copy of the arm's own MJCF where the pipeline names one and torques alone were identified.
fn mjcf(export: &Export) -> Result<String> {
    let own = OwnMjcf::of(export)?;
    if let Some(own) = own.filter(|_| export.identified.is_of_torques_alone()) {
        return own.with_torques(export);
    }
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
    remarks.extend(shortfalls(export));
    document(&remarks, include_str!("mjcf.xml"), arm(export, None))
}

/// Whether the mass of some body is not known.
fn is_massless(export: &Export) -> bool {
    (0..export.corrected.joints.len()).any(|joint| export.body(joint).is_none())
}

/// What the templates show of the arm: numbers as texts, what is not known missing. Frames are parallel to the base at the zero pose, or those
/// of the arm's own file, as near as the corrected axes let them be.
fn arm(export: &Export, own: Option<&OwnUrdf>) -> Value {
    let robot = &export.corrected;
    let base = own.map_or("base_link", |own| own.base.as_str());
    let (mut before, mut parent) = (Pose::identity(), base.to_string());
    let mut joints = Vec::new();
    for (index, joint) in robot.joints.iter().enumerate() {
        let theirs = own.map(|own| &own.joints[index]);
        let parallel = Pose::new(Matrix3::identity(), joint.point.into());
        let frame = theirs.map_or(parallel, |own| moved(&own.frame, &own.axis, joint));
        let child = theirs.map_or_else(|| format!("link_{}", index + 1), |own| own.child.clone());
        let kind = match (joint.kind, joint.limits) {
            (JointKind::Prismatic, _) => "prismatic",
            (JointKind::Revolute, Some(_)) => "revolute",
            (JointKind::Revolute, None) => "continuous",
        };
        let torques = export.identified.torques.as_ref();
        let found = |effect| {
            torques
                .and_then(|torques| positive(torques, effect, index))
                .map(digits)
        };
        let spring = torques.and_then(|torques| spring(torques, index));
        let body = export.body(index).map(|body| {
            // Its numbers are in a frame at the joint's point that is parallel to the base.
            let (_, turn) = origin(&frame, &parallel);
            let centre = parallel.point(&Vector3::from(body.centre));
            let centre = if theirs.is_some() { frame.inverse().point(&centre).into() } else { body.centre };
            context! {
                remark => body.remark, placeholder => body.is_placeholder(), centre => numbers(centre),
                turn => theirs.map(|_| numbers(turn)),
                mass => numbers([body.mass]), inertia => body.inertia.map(|moment| numbers([moment])),
            }
        });
        let (place, turn) = origin(&before, &frame);
        let axis = frame.rotation.transpose() * Vector3::from(joint.axis);
        let limit = |of: fn(&OwnJoint) -> &Option<String>| theirs.and_then(|own| of(own).clone());
        joints.push(context! {
            name => one_line(theirs.map_or(&joint.name, |own| &own.name)), kind, parent, child => child.clone(), body,
            axis => match theirs {
                Some(_) => numbers([axis.x, axis.y, axis.z]),
                None => numbers(joint.axis),
            },
            offset => numbers(place), turn => theirs.map(|_| numbers(turn)),
            limits => joint.limits.map(|limits| limits.map(|limit| numbers([limit]))),
            effort => limit(|own| &own.effort), velocity => limit(|own| &own.velocity),
            damping => found(DAMPING), friction => found(FRICTION), armature => found(ARMATURE),
            stiffness => spring.map(|[stiffness, _]| digits(stiffness)), springref => spring.map(|[_, reference]| digits(reference)),
            gear => torques.and_then(|torques| gear(torques, index)),
        });
        (before, parent) = (frame, child);
    }
    let tool = tool(robot.tool, &robot.tool_rotation);
    let (place, turn) = origin(&before, &tool);
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(tool.rotation));
    let frames = frames(own, &parent, &before, &tool);
    context! {
        name => one_line(&robot.name), base, gravity => numbers(robot.gravity), joints, frames, unknown => UNKNOWN,
        dry => dry(),
        moments => ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"],
        least => context! { mass => LEAST[0], inertia => LEAST[1] },
        tool => context! { parent, offset => numbers(place), turn => numbers(turn), quaternion => numbers([q.w, q.i, q.j, q.k]) },
    }
}

/// Links behind the last joint's: the flange of the arm's own file, and the measured point.
fn frames(own: Option<&OwnUrdf>, parent: &str, before: &Pose, tool: &Pose) -> Vec<Value> {
    let frame = |joint: &str, parent: &str, name: &str, from: &Pose, to: &Pose| {
        let (place, turn) = origin(from, to);
        context! { joint, parent, name, offset => numbers(place), turn => numbers(turn) }
    };
    let (Some(own), Some(last)) = (own, own.and_then(|own| own.joints.last())) else {
        return vec![frame("tool", parent, "tool0", before, tool)];
    };
    let (tip, at) = &own.tip;
    let flange = *before * (last.frame.inverse() * *at);
    let measured = measured_name(own);
    if tip == parent {
        return vec![frame(
            "measured_point_joint",
            parent,
            &measured,
            before,
            tool,
        )];
    }
    vec![
        frame("flange_joint", parent, tip, before, &flange),
        frame("measured_point_joint", tip, &measured, &flange, tool),
    ]
}

/// Seconds of the time constant, and impedance, with which MuJoCo's dry friction is whole: its own (0.02 and 0.9) let light joints creep at
/// a tenth of it. The time constant is two of the file's steps, the least that it takes.
const DRY: [f64; 2] = [0.004, 0.9999];
/// rad/s or m/s: where dry friction is whole only above this speed, a remark says so.
const SLOW: f64 = 0.01;

fn dry() -> Value {
    let [time, impedance] = DRY;
    context! { reference => numbers([time, 1.0]), impedance => numbers([impedance, impedance, 0.001, 0.5, 2.0]), step => numbers([time / 2.0]) }
}

/// Above which speed MuJoCo gives a joint's dry friction whole, where that is no crawl: friction * (1 - d) / (d b I), b = 2 / (d time constant).
fn shortfalls(export: &Export) -> Vec<String> {
    let Some(torques) = &export.identified.torques else {
        return Vec::new();
    };
    let [time, impedance] = DRY;
    let line = |(index, joint): (usize, &JointDescription)| {
        let friction = positive(torques, FRICTION, index)?.value;
        let own = export.body(index).map(|body| about_axis(&body, joint));
        let least: f64 = LEAST[1].parse().unwrap_or_default();
        let inertia = own.unwrap_or(least).max(least)
            + positive(torques, ARMATURE, index).map_or(0.0, |found| found.value);
        let speed = friction * (1.0 - impedance) * time / (2.0 * inertia);
        (speed > SLOW).then(|| {
            format!(
                "{FRICTION} at joint {}: its inertia is so small ({inertia:.1e}) that MuJoCo gives {friction:.3} whole from {speed:.3} rad/s (m/s) on, \
                 below that the share that the speed is of it",
                index + 1
            )
        })
    };
    export
        .corrected
        .joints
        .iter()
        .enumerate()
        .filter_map(line)
        .collect()
}

/// What a body has against its joint: kg m2 about its axis, or kg along it.
fn about_axis(body: &LinkBody, joint: &JointDescription) -> f64 {
    let axis = Vector3::from(joint.axis);
    if joint.kind == JointKind::Prismatic {
        return body.mass;
    }
    let [xx, xy, xz, yy, yz, zz] = body.inertia;
    let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let arm = axis.cross(&Vector3::from(body.centre)).norm_squared();
    axis.dot(&(inertia * axis)) + body.mass * arm
}
