//! An include for the arm's own description: corrected origins of its joints, in its own frames, and nothing else; meshes, limits and
//! inertials stay where they are.

use super::body::{self, moved, numbers, origin, tool};
use super::{CarriedTorques, Export, Format};
use crate::error::{Error, Result, one_line};
use crate::raw::{self, ending};
use crate::spatial::Pose;
use crate::yaml;
use minijinja::context;
use nalgebra::{Rotation3, Vector3};
use roxmltree::{Document, Node};
use std::collections::BTreeMap;

pub(super) const XACRO: Format = Format {
    name: "xacro",
    help: "An include with the corrected origins of the joints of the arm's own URDF",
    comment: "<!--",
    carries: CarriedTorques::Nothing,
    text,
};

/// A joint of the arm's description.
struct OwnJoint<'a> {
    name: &'a str,
    parent: &'a str,
    child: &'a str,
    origin: Pose,
    axis: Vector3<f64>,
}

fn text(export: &Export) -> Result<String> {
    let place = |wanted: &[&str]| {
        export
            .identified
            .sources
            .iter()
            .find(|source| wanted.contains(&ending(source).as_str()))
    };
    let own = place(&["urdf", "xml"]).ok_or_else(|| {
        let message = "no URDF stands behind this model; allowed: a robot file with `kinematics: {urdf: ...}`, or --format urdf, which writes a whole arm";
        Error::data(&export.identified.origin, message)
    })?;
    let label = own.display().to_string();
    let read = |path: &std::path::Path| {
        raw::text(path).map_err(|error| Error::unreadable(path.display().to_string(), &error))
    };
    let urdf = read(own)?;
    let mut base = None;
    for file in export
        .identified
        .sources
        .iter()
        .filter(|source| ["yaml", "yml"].contains(&ending(source).as_str()))
    {
        base = base.or(yaml::parse(&read(file)?)
            .0
            .and_then(|tree| tree.at("kinematics.urdf.base")?.text()));
    }
    let document =
        Document::parse(&urdf).map_err(|error| Error::data(&label, error.to_string()))?;
    let origins =
        origins(export, &document, base.as_deref().unwrap_or("base_link")).ok_or_else(|| {
            Error::data(
                &label,
                "is not the description that the model was identified with: its joints are others",
            )
        })?;
    let mut remarks = export.remarks_in(&XACRO);
    remarks.push(format!(
        "in {}: include this file, and in each joint below have",
        own.file_name().unwrap_or_default().to_string_lossy()
    ));
    remarks.push("<xacro:calib_origin joint=\"NAME\"/> in the place of its <origin .../>".into());
    remarks.push(origins.tool.clone());
    let quoted =
        |[place, turn]: &[[f64; 3]; 2]| format!("('{}', '{}')", numbers(*place), numbers(*turn));
    let all: Vec<String> = origins
        .joints
        .iter()
        .map(|(name, origin)| format!("('{name}', {})", quoted(origin)))
        .collect();
    // xacro ends an expression at the first brace.
    let origins = format!("${{dict([{}])}}", all.join(", "));
    body::document(&remarks, include_str!("xacro.xml"), context! { origins })
}

struct Origins {
    /// Name of each moving joint, place and turn.
    joints: Vec<(String, [[f64; 3]; 2])>,
    /// The remark on the tool.
    tool: String,
}

/// Three numbers of an attribute; `otherwise` where it is not there.
fn three(node: Option<Node>, name: &str, otherwise: [f64; 3]) -> Option<[f64; 3]> {
    let Some(text) = node.and_then(|node| node.attribute(name)) else {
        return Some(otherwise);
    };
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(|word| word.parse().ok())
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// The corrected origins of the moving joints; none where the description has not the model's joints.
fn origins(export: &Export, document: &Document, base: &str) -> Option<Origins> {
    let mut urdf_joints: BTreeMap<&str, OwnJoint> = BTreeMap::new();
    for node in document
        .root_element()
        .children()
        .filter(|node| node.has_tag_name("joint"))
    {
        let child = |name: &str| node.children().find(|child| child.has_tag_name(name));
        let end = |name: &str| child(name).and_then(|end| end.attribute("link"));
        let [roll, pitch, yaw] = three(child("origin"), "rpy", [0.0; 3])?;
        let place = three(child("origin"), "xyz", [0.0; 3])?;
        let origin = Pose::new(
            Rotation3::from_euler_angles(roll, pitch, yaw).into_inner(),
            place.into(),
        );
        let axis =
            Vector3::from(three(child("axis"), "xyz", [1.0, 0.0, 0.0])?).try_normalize(0.0)?;
        let (Some(parent), Some(child), Some(name)) =
            (end("parent"), end("child"), node.attribute("name"))
        else {
            continue;
        };
        urdf_joints.insert(
            child,
            OwnJoint {
                name,
                parent,
                child,
                origin,
                axis,
            },
        );
    }
    let robot = &export.corrected;
    // From the last joint back to the base.
    let last = urdf_joints.values().find(|joint| {
        robot
            .joints
            .last()
            .is_some_and(|last| last.name == joint.name)
    })?;
    let mut path: Vec<&OwnJoint> = std::iter::successors(Some(last), |joint| {
        urdf_joints
            .get(joint.parent)
            .filter(|_| joint.parent != base)
    })
    .take(urdf_joints.len())
    .collect();
    path.reverse();
    let (mut nominal, mut corrected) = (Pose::identity(), Pose::identity());
    let mut joints = Vec::new();
    for joint in path {
        nominal = nominal * joint.origin;
        let Some(at) = robot.joints.iter().position(|one| one.name == joint.name) else {
            corrected = corrected * joint.origin;
            continue;
        };
        let placed = moved(
            &nominal,
            &(nominal.rotation * joint.axis),
            &robot.joints[at],
        );
        let (place, turn) = origin(&corrected, &placed);
        // Names stand in an expression between quotes.
        let plain = joint
            .name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "_-./ ".contains(c));
        joints.push((plain.then(|| joint.name.to_string())?, [place, turn]));
        corrected = placed;
    }
    let (place, turn) = origin(&corrected, &tool(robot.tool, &robot.tool_rotation));
    let tool = format!(
        "not carried: the measured point, {:.4} mm from the frame of {}: there it stands at {} m, turned by {} rad",
        1e3 * Vector3::from(place).norm(),
        one_line(last.child),
        numbers(place),
        numbers(turn)
    );
    (joints.len() == robot.joints.len()).then_some(Origins { joints, tool })
}
