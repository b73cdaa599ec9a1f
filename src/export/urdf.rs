//! URDF: every joint frame parallel to the base at the zero pose and on its axis, so that no angle is converted.

use super::model::{PLACEHOLDER, placeholder_inertia};
use super::xml::{self, Xml, empty, numbers, offset};
use super::{Export, Format};
use crate::description::{JointDescription, JointKind, RobotDescription};
use crate::error::{Result, one_line};
use nalgebra::{Matrix3, Rotation3};
use std::io;

pub(super) struct Urdf;

impl Format for Urdf {
    fn name(&self) -> &'static str {
        "urdf"
    }

    fn help(&self) -> &'static str {
        "Unified robot description: joints at the corrected axes"
    }

    fn text(&self, export: &Export) -> Result<String> {
        xml::document(&export.remarks(), |xml| {
            let name = one_line(&export.corrected.name);
            xml.create_element("robot")
                .with_attribute(("name", name.as_str()))
                .write_inner_content(|xml| robot(xml, &export.corrected))?;
            Ok(())
        })
    }
}

fn robot(xml: &mut Xml, robot: &RobotDescription) -> io::Result<()> {
    empty(xml, "link", &[("name", "base_link")])?;
    let mut before = [0.0; 3];
    let mut parent = "base_link".to_string();
    for (index, one) in robot.joints.iter().enumerate() {
        let child = format!("link_{}", index + 1);
        link(xml, one, &child)?;
        joint(xml, one, before, [&parent, &child])?;
        (before, parent) = (one.point, child);
    }
    let r = &robot.tool_rotation;
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_fn(|i, k| r[i][k]));
    let (roll, pitch, yaw) = rotation.euler_angles();
    empty(xml, "link", &[("name", "tool0")])?;
    let tool = xml.create_element("joint").with_attributes([("name", "tool"), ("type", "fixed")]);
    tool.write_inner_content(|xml| {
        between(xml, &parent, "tool0")?;
        empty(xml, "origin", &[("xyz", &offset(robot.tool, before)), ("rpy", &numbers([roll, pitch, yaw]))])
    })?;
    Ok(())
}

/// A link with its mass where it is known.
fn link(xml: &mut Xml, joint: &JointDescription, name: &str) -> io::Result<()> {
    let (Some(mass), Some(centre)) = (joint.mass.filter(|mass| *mass > 0.0), joint.centre) else {
        return empty(xml, "link", &[("name", name)]);
    };
    let inertia = numbers([placeholder_inertia(mass)]);
    let inertia = inertia.as_str();
    xml.create_element("link").with_attribute(("name", name)).write_inner_content(|xml| {
        xml::comment(xml, PLACEHOLDER)?;
        xml.create_element("inertial").write_inner_content(|xml| {
            empty(xml, "origin", &[("xyz", &offset(centre, joint.point))])?;
            empty(xml, "mass", &[("value", &numbers([mass]))])?;
            let moments = [("ixx", inertia), ("ixy", "0"), ("ixz", "0"), ("iyy", inertia), ("iyz", "0"), ("izz", inertia)];
            empty(xml, "inertia", &moments)
        })?;
        Ok(())
    })?;
    Ok(())
}

/// A joint whose frame lies on its axis, seen from that of the joint before, at `before`.
fn joint(xml: &mut Xml, joint: &JointDescription, before: [f64; 3], [parent, child]: [&str; 2]) -> io::Result<()> {
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
    let element = xml.create_element("joint").with_attributes([("name", name.as_str()), ("type", kind)]);
    element.write_inner_content(|xml| {
        between(xml, parent, child)?;
        empty(xml, "origin", &[("xyz", &offset(joint.point, before)), ("rpy", "0 0 0")])?;
        empty(xml, "axis", &[("xyz", &numbers(joint.axis))])?;
        match &limits {
            Some([lower, upper]) => {
                empty(xml, "limit", &[("lower", lower), ("upper", upper), ("effort", "0"), ("velocity", "0")])
            }
            None => Ok(()),
        }
    })?;
    Ok(())
}

/// Which links a joint connects.
fn between(xml: &mut Xml, parent: &str, child: &str) -> io::Result<()> {
    empty(xml, "parent", &[("link", parent)])?;
    empty(xml, "child", &[("link", child)])
}
