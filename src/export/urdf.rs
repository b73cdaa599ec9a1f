//! URDF: every joint frame parallel to the base at the zero pose and on its axis, so that no angle is converted.

use super::body::{self, Xml, empty, numbers, offset};
use super::friction::{DAMPING, FRICTION, positive};
use super::{CarriedTorques, Export, Format};
use crate::description::JointKind;
use crate::error::{Result, one_line};
use nalgebra::{Matrix3, Rotation3};
use std::io;

pub(super) const URDF: Format = Format {
    name: "urdf",
    help: "Unified robot description: joints at the corrected axes",
    comment: "<!--",
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION]),
    text,
};

/// A torque and a speed that no joint has: of a limit URDF demands both.
const UNKNOWN: &str = "1e9";

fn text(export: &Export) -> Result<String> {
    let mut remarks = export.remarks_in(&URDF);
    if export
        .corrected
        .joints
        .iter()
        .any(|joint| joint.limits.is_some() || joint.kind == JointKind::Prismatic)
    {
        remarks.push(format!(
            "largest torques and speeds of the joints are not known: {UNKNOWN} stands for none, which URDF does not have"
        ));
    }
    body::document(&remarks, |xml| {
        let name = one_line(&export.corrected.name);
        xml.create_element("robot")
            .with_attribute(("name", name.as_str()))
            .write_inner_content(|xml| robot(xml, export))?;
        Ok(())
    })
}

fn robot(xml: &mut Xml, export: &Export) -> io::Result<()> {
    let robot = &export.corrected;
    empty(xml, "link", &[("name", "base_link")])?;
    let mut before = [0.0; 3];
    let mut parent = "base_link".to_string();
    for (index, one) in robot.joints.iter().enumerate() {
        let child = format!("link_{}", index + 1);
        link(xml, export, index, &child)?;
        joint(xml, export, index, before, [&parent, &child])?;
        (before, parent) = (one.point, child);
    }
    let r = &robot.tool_rotation;
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_fn(|i, k| r[i][k]));
    let (roll, pitch, yaw) = rotation.euler_angles();
    empty(xml, "link", &[("name", "tool0")])?;
    let tool = xml
        .create_element("joint")
        .with_attributes([("name", "tool"), ("type", "fixed")]);
    tool.write_inner_content(|xml| {
        between(xml, &parent, "tool0")?;
        empty(
            xml,
            "origin",
            &[
                ("xyz", &offset(robot.tool, before)),
                ("rpy", &numbers([roll, pitch, yaw])),
            ],
        )
    })?;
    Ok(())
}

/// A link with its mass where it is known.
fn link(xml: &mut Xml, export: &Export, index: usize, name: &str) -> io::Result<()> {
    let Some(body) = export.body(index) else {
        return empty(xml, "link", &[("name", name)]);
    };
    xml.create_element("link")
        .with_attribute(("name", name))
        .write_inner_content(|xml| {
            body.remark
                .map_or(Ok(()), |remark| body::comment(xml, remark))?;
            xml.create_element("inertial").write_inner_content(|xml| {
                empty(xml, "origin", &[("xyz", &numbers(body.centre))])?;
                empty(xml, "mass", &[("value", &numbers([body.mass]))])?;
                let moments = body.inertia.map(|moment| {
                    if moment == 0.0 {
                        "0".to_string()
                    } else {
                        numbers([moment])
                    }
                });
                let names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
                let moments: Vec<(&str, &str)> = names
                    .into_iter()
                    .zip(moments.iter().map(String::as_str))
                    .collect();
                empty(xml, "inertia", &moments)
            })?;
            Ok(())
        })?;
    Ok(())
}

/// A joint whose frame lies on its axis, seen from that of the joint before, at `before`.
fn joint(
    xml: &mut Xml,
    export: &Export,
    index: usize,
    before: [f64; 3],
    [parent, child]: [&str; 2],
) -> io::Result<()> {
    let joint = &export.corrected.joints[index];
    let kind = match (joint.kind, joint.limits) {
        (JointKind::Prismatic, _) => "prismatic",
        (JointKind::Revolute, Some(_)) => "revolute",
        (JointKind::Revolute, None) => "continuous",
    };
    let limits = match (joint.limits, joint.kind) {
        (Some(limits), _) => Some(limits.map(|limit| numbers([limit]))),
        (None, JointKind::Prismatic) => Some(["-1e3".to_string(), "1e3".to_string()]),
        (None, JointKind::Revolute) => None,
    };
    let name = one_line(&joint.name);
    let element = xml
        .create_element("joint")
        .with_attributes([("name", name.as_str()), ("type", kind)]);
    element.write_inner_content(|xml| {
        between(xml, parent, child)?;
        empty(
            xml,
            "origin",
            &[("xyz", &offset(joint.point, before)), ("rpy", "0 0 0")],
        )?;
        empty(xml, "axis", &[("xyz", &numbers(joint.axis))])?;
        match &limits {
            Some([lower, upper]) => empty(
                xml,
                "limit",
                &[
                    ("lower", lower),
                    ("upper", upper),
                    ("effort", UNKNOWN),
                    ("velocity", UNKNOWN),
                ],
            ),
            None => Ok(()),
        }?;
        dynamics(xml, export, index)
    })?;
    Ok(())
}

/// Friction that torques show; nothing is said of what was not found.
fn dynamics(xml: &mut Xml, export: &Export, index: usize) -> io::Result<()> {
    let torques = export.identified.torques.as_ref();
    let number = |(name, effect)| Some((name, numbers([positive(torques?, effect, index)?])));
    let found: Vec<(&str, String)> = [("damping", DAMPING), ("friction", FRICTION)]
        .into_iter()
        .filter_map(number)
        .collect();
    if found.is_empty() {
        return Ok(());
    }
    let found: Vec<(&str, &str)> = found
        .iter()
        .map(|(name, value)| (*name, value.as_str()))
        .collect();
    empty(xml, "dynamics", &found)
}

/// Which links a joint connects.
fn between(xml: &mut Xml, parent: &str, child: &str) -> io::Result<()> {
    empty(xml, "parent", &[("link", parent)])?;
    empty(xml, "child", &[("link", child)])
}
