//! URDF: every joint frame parallel to the base at the zero pose and on its axis, so that no angle is converted.

use super::{Export, one_line};
use crate::robot::description::{JointKind, RobotDescription};
use nalgebra::{Matrix3, Rotation3};

pub(super) fn text(export: &Export) -> String {
    let robot = &export.corrected;
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    for line in export.remarks() {
        // Two hyphens would end the comment.
        out.push_str(&format!("<!-- {} -->\n", line.replace("--", "- -")));
    }
    out.push_str(&format!("<robot name=\"{}\">\n  <link name=\"base_link\"/>\n", escaped(&robot.name)));
    let mut before = [0.0; 3];
    for (index, joint) in robot.joints.iter().enumerate() {
        let parent = if index == 0 { "base_link".into() } else { format!("link_{index}") };
        let child = format!("link_{}", index + 1);
        let origin: Vec<String> = joint.point.iter().zip(before).map(|(now, then)| number(now - then)).collect();
        let axis: Vec<String> = joint.axis.iter().map(|value| number(*value)).collect();
        let kind = match (joint.kind, joint.limits) {
            (JointKind::Prismatic, _) => "prismatic",
            (JointKind::Revolute, Some(_)) => "revolute",
            (JointKind::Revolute, None) => "continuous",
        };
        out.push_str(&link(robot, index, &child));
        out.push_str(&format!(
            "  <joint name=\"{}\" type=\"{kind}\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    <origin xyz=\"{}\" rpy=\"0 0 0\"/>\n    <axis xyz=\"{}\"/>\n",
            escaped(&joint.name),
            origin.join(" "),
            axis.join(" ")
        ));
        if let Some([lower, upper]) = joint.limits {
            out.push_str(&format!(
                "    <limit lower=\"{}\" upper=\"{}\" effort=\"0\" velocity=\"0\"/>\n",
                number(lower),
                number(upper)
            ));
        } else if joint.kind == JointKind::Prismatic {
            out.push_str("    <limit lower=\"-1e3\" upper=\"1e3\" effort=\"0\" velocity=\"0\"/>\n");
        }
        out.push_str("  </joint>\n");
        before = joint.point;
    }
    let last = format!("link_{}", robot.joints.len());
    let origin: Vec<String> = robot.tool.iter().zip(before).map(|(now, then)| number(now - then)).collect();
    let r = &robot.tool_rotation;
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_fn(|i, k| r[i][k]));
    let (roll, pitch, yaw) = rotation.euler_angles();
    let rpy = [roll, pitch, yaw].map(number).join(" ");
    out.push_str(&format!(
        "  <link name=\"tool0\"/>\n  <joint name=\"tool\" type=\"fixed\">\n    <parent link=\"{last}\"/>\n    <child link=\"tool0\"/>\n    <origin xyz=\"{}\" rpy=\"{rpy}\"/>\n  </joint>\n</robot>\n",
        origin.join(" ")
    ));
    out
}

/// A link with its mass where it is known; its inertia is not, and stands as that of a ball of 0.1 m.
fn link(robot: &RobotDescription, index: usize, name: &str) -> String {
    let joint = &robot.joints[index];
    let (Some(mass), Some(centre)) = (joint.mass.filter(|mass| *mass > 0.0), joint.centre) else {
        return format!("  <link name=\"{name}\"/>\n");
    };
    let origin: Vec<String> = centre.iter().zip(joint.point).map(|(centre, point)| number(centre - point)).collect();
    let inertia = number(0.4 * mass * 0.01);
    format!(
        "  <link name=\"{name}\">\n    <!-- the inertia is a placeholder: recordings at rest do not show it -->\n    <inertial>\n      <origin xyz=\"{}\"/>\n      <mass value=\"{}\"/>\n      <inertia ixx=\"{inertia}\" ixy=\"0\" ixz=\"0\" iyy=\"{inertia}\" iyz=\"0\" izz=\"{inertia}\"/>\n    </inertial>\n  </link>\n",
        origin.join(" "),
        number(mass)
    )
}

/// The shortest text that reads as the same number.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in one_line(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            other => out.push(other),
        }
    }
    out
}
