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
use std::path::PathBuf;

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
    let sources = &export.identified.sources;
    let with_ending = |wanted: [&'static str; 2]| {
        let is = move |source: &&PathBuf| wanted.contains(&ending(source).as_str());
        sources.iter().filter(is)
    };
    let description = with_ending(["urdf", "xml"]).next().ok_or_else(|| {
        let message = "no URDF stands behind this model; allowed: a robot file with `kinematics: {urdf: ...}`, or --format urdf, which writes a whole arm";
        Error::data(&export.identified.origin, message)
    })?;
    let label = description.display().to_string();
    let read = |path: &PathBuf| {
        raw::text(path).map_err(|error| Error::unreadable(path.display().to_string(), &error))
    };
    let urdf = read(description)?;
    let mut base = None;
    for file in with_ending(["yaml", "yml"]) {
        let tree = yaml::parse(&read(file)?).0;
        base = base.or(tree.and_then(|tree| tree.at("kinematics.urdf.base")?.text()));
    }
    let document =
        Document::parse(&urdf).map_err(|error| Error::data(&label, error.to_string()))?;
    let origins = origins(export, &document, base.as_deref().unwrap_or("base_link"));
    let origins = origins.ok_or_else(|| {
        let message =
            "is not the description that the model was identified with: its joints are others";
        Error::data(&label, message)
    })?;
    let mut remarks = export.remarks_in(&XACRO);
    remarks.push(format!(
        "in {}: include this file, and in each joint below have",
        description
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
    ));
    remarks.push("<xacro:calib_origin joint=\"NAME\"/> in the place of its <origin .../>".into());
    remarks.push(origins.tool.clone());
    let quoted =
        |[place, turn]: &[[f64; 3]; 2]| format!("('{}', '{}')", numbers(*place), numbers(*turn));
    let joints = origins.joints.iter();
    let all = joints.map(|(name, origin)| format!("('{name}', {})", quoted(origin)));
    let all: Vec<String> = all.collect();
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
    let numbers = text.split_whitespace().map(|word| word.parse().ok());
    let numbers: Option<Vec<f64>> = numbers.collect();
    numbers?.try_into().ok()
}

/// The corrected origins of the moving joints; none where the description has not the model's joints.
fn origins(export: &Export, document: &Document, base: &str) -> Option<Origins> {
    let mut urdf_joints: BTreeMap<&str, OwnJoint> = BTreeMap::new();
    let nodes = document.root_element().children();
    for node in nodes.filter(|node| node.has_tag_name("joint")) {
        let child = |name: &str| node.children().find(|child| child.has_tag_name(name));
        let end = |name: &str| child(name).and_then(|end| end.attribute("link"));
        let [roll, pitch, yaw] = three(child("origin"), "rpy", [0.0; 3])?;
        let place = three(child("origin"), "xyz", [0.0; 3])?;
        let turn = Rotation3::from_euler_angles(roll, pitch, yaw);
        let axis = three(child("axis"), "xyz", [1.0, 0.0, 0.0])?;
        let axis = Vector3::from(axis).try_normalize(0.0)?;
        let (Some(parent), Some(child), Some(name)) =
            (end("parent"), end("child"), node.attribute("name"))
        else {
            continue;
        };
        let joint = OwnJoint {
            name,
            parent,
            child,
            origin: Pose::new(turn.into_inner(), place.into()),
            axis,
        };
        urdf_joints.insert(child, joint);
    }
    let robot = &export.corrected;
    // From the last joint back to the base.
    let name = robot.joints.last().map(|last| last.name.as_str());
    let last = urdf_joints
        .values()
        .find(|joint| name == Some(joint.name))?;
    let path = std::iter::successors(Some(last), |joint| {
        let before = urdf_joints.get(joint.parent);
        before.filter(|_| joint.parent != base)
    });
    let mut path: Vec<&OwnJoint> = path.take(urdf_joints.len()).collect();
    path.reverse();
    let (mut nominal, mut corrected) = (Pose::identity(), Pose::identity());
    let mut joints = Vec::new();
    for joint in path {
        nominal = nominal * joint.origin;
        let Some(at) = robot.joints.iter().position(|one| one.name == joint.name) else {
            corrected = corrected * joint.origin;
            continue;
        };
        let axis = nominal.rotation * joint.axis;
        let placed = moved(&nominal, &axis, &robot.joints[at]);
        let (place, turn) = origin(&corrected, &placed);
        // Names stand in an expression between quotes.
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./ ".contains(c);
        let plain = joint.name.chars().all(is_plain);
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
