//! SDFormat, as Gazebo and Drake read it: every joint's frame parallel to the base at the zero pose and on its axis, as in URDF, but with
//! limits only where they are known.

use super::body::{self, Xml, empty, numbers, offset, origin, tool};
use super::friction::{DAMPING, FRICTION, positive};
use super::{CarriedTorques, Export, Format};
use crate::description::JointKind;
use crate::error::{Result, one_line};
use crate::spatial::Pose;
use nalgebra::Matrix3;
use std::io;

pub(super) const SDF: Format = Format {
    name: "sdf",
    help: "Gazebo's and Drake's model: joints at the corrected axes, the tool as a frame",
    comment: "<!--",
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION]),
    text,
};

fn text(export: &Export) -> Result<String> {
    let mut remarks = export.remarks_in(&SDF);
    if (0..export.corrected.joints.len()).any(|joint| export.body(joint).is_none()) {
        remarks.push(
            "links whose mass is not known have none here: SDFormat takes them as 1 kg".into(),
        );
    }
    let name = one_line(&export.corrected.name);
    body::document(&remarks, |xml| {
        xml.create_element("sdf")
            .with_attribute(("version", "1.9"))
            .write_inner_content(|xml| {
                let model = xml
                    .create_element("model")
                    .with_attributes([("name", name.as_str()), ("canonical_link", "base_link")]);
                model
                    .write_inner_content(|xml| robot(xml, export))
                    .map(drop)
            })?;
        Ok(())
    })
}

/// An element with a text.
fn leaf(xml: &mut Xml, name: &str, text: &str) -> io::Result<()> {
    xml.create_element(name)
        .write_text_content(quick_xml::events::BytesText::new(text))
        .map(drop)
}

fn robot(xml: &mut Xml, export: &Export) -> io::Result<()> {
    let robot = &export.corrected;
    empty(xml, "link", &[("name", "base_link")])?;
    let fixed = xml
        .create_element("joint")
        .with_attributes([("name", "to_world"), ("type", "fixed")]);
    fixed.write_inner_content(|xml| {
        leaf(xml, "parent", "world").and_then(|()| leaf(xml, "child", "base_link"))
    })?;
    let (mut before, mut parent) = ([0.0; 3], "base_link".to_string());
    for (index, one) in robot.joints.iter().enumerate() {
        let (child, name) = (format!("link_{}", index + 1), one_line(&one.name));
        link(xml, export, index, [&child, &name])?;
        let kind = match (one.kind, one.limits) {
            (JointKind::Prismatic, _) => "prismatic",
            (JointKind::Revolute, Some(_)) => "revolute",
            (JointKind::Revolute, None) => "continuous",
        };
        let joint = xml
            .create_element("joint")
            .with_attributes([("name", name.as_str()), ("type", kind)]);
        joint.write_inner_content(|xml| {
            leaf(xml, "parent", &parent)?;
            leaf(xml, "child", &child)?;
            let place = format!("{} 0 0 0", offset(one.point, before));
            let pose = xml
                .create_element("pose")
                .with_attribute(("relative_to", parent.as_str()));
            pose.write_text_content(quick_xml::events::BytesText::new(&place))?;
            xml.create_element("axis")
                .write_inner_content(|xml| axis(xml, export, index))
                .map(drop)
        })?;
        (before, parent) = (one.point, child);
    }
    let last = Pose::new(Matrix3::identity(), before.into());
    let (place, turn) = origin(&last, &tool(robot.tool, &robot.tool_rotation));
    let frame = xml
        .create_element("frame")
        .with_attributes([("name", "tool0"), ("attached_to", parent.as_str())]);
    frame.write_inner_content(|xml| {
        leaf(
            xml,
            "pose",
            &format!("{} {}", numbers(place), numbers(turn)),
        )
    })?;
    Ok(())
}

fn link(xml: &mut Xml, export: &Export, index: usize, [name, joint]: [&str; 2]) -> io::Result<()> {
    let link = xml.create_element("link").with_attribute(("name", name));
    link.write_inner_content(|xml| {
        empty(xml, "pose", &[("relative_to", joint)])?;
        let Some(body) = export.body(index) else {
            return Ok(());
        };
        body.remark
            .map_or(Ok(()), |remark| body::comment(xml, remark))?;
        xml.create_element("inertial").write_inner_content(|xml| {
            leaf(xml, "pose", &format!("{} 0 0 0", numbers(body.centre)))?;
            leaf(xml, "mass", &numbers([body.mass]))?;
            xml.create_element("inertia").write_inner_content(|xml| {
                let names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
                names
                    .iter()
                    .zip(body.inertia)
                    .try_for_each(|(name, moment)| leaf(xml, name, &numbers([moment])))
            })?;
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(())
}

fn axis(xml: &mut Xml, export: &Export, index: usize) -> io::Result<()> {
    let joint = &export.corrected.joints[index];
    leaf(xml, "xyz", &numbers(joint.axis))?;
    if let Some([lower, upper]) = joint.limits {
        let limit = xml.create_element("limit");
        limit.write_inner_content(|xml| {
            leaf(xml, "lower", &numbers([lower]))
                .and_then(|()| leaf(xml, "upper", &numbers([upper])))
        })?;
    }
    let Some(torques) = &export.identified.torques else {
        return Ok(());
    };
    let known = [("damping", DAMPING), ("friction", FRICTION)];
    let known: Vec<_> = known
        .into_iter()
        .filter_map(|(name, effect)| Some((name, positive(torques, effect, index)?)))
        .collect();
    if !known.is_empty() {
        let dynamics = xml.create_element("dynamics");
        dynamics.write_inner_content(|xml| {
            known
                .iter()
                .try_for_each(|(name, value)| leaf(xml, name, &numbers([*value])))
        })?;
    }
    Ok(())
}
