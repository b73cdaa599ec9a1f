//! MJCF: a serial chain out of a MuJoCo model (<https://mujoco.readthedocs.io/en/stable/XMLreference.html>). Some joints move, all others
//! are held at their reference; what hangs on held joints adds to the link that carries it.
//!
//! Read are bodies, frames, inertials, hinge and slide joints, defaults with classes, includes, and the actuators `position`, `velocity`,
//! `motor` and `general` of the joints that move. What is not read and would change the motion is refused by its element and line.

mod attributes;
mod joints;
mod tree;

use calib_dynamics::{DynamicArm, Inertial, InertialTolerance};
use calib_numerics::error::{Error, Fault, Result};
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::collections::BTreeMap;

/// A file that was read: what it is called, and its text.
#[derive(Debug, Clone, Copy)]
pub struct MjcfText<'a> {
    /// For messages.
    pub label: &'a str,
    /// Its content.
    pub text: &'a str,
}

/// What an actuator of MJCF does with the error: `kp (command - angle) - kd speed`, in Nm (N) at the joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    /// Nm/rad.
    pub kp: f64,
    /// Nm s/rad, on the measured speed.
    pub kd: f64,
    /// Nm, symmetric; infinite where none is stated.
    pub limit: f64,
}

/// A joint that moves.
#[derive(Debug, Clone, PartialEq)]
pub struct MjcfJoint {
    /// As the file names it.
    pub name: String,
    /// The position at which bodies stand as the file draws them, rad or m.
    pub reference: f64,
    /// From .. to, rad or m; `None` where the file states no range.
    pub range: Option<[f64; 2]>,
    /// Nm s/rad.
    pub damping: f64,
    /// kg m^2.
    pub armature: f64,
    /// Nm, dry friction.
    pub friction: f64,
    /// Nm/rad.
    pub stiffness: f64,
    /// rad: where that spring is at rest.
    pub spring_reference: f64,
    /// What its actuators make of a commanded angle; `None` where the file has no position actuator of it.
    pub servo: Option<Servo>,
}

/// A serial chain of an MJCF.
#[derive(Debug, Clone, PartialEq)]
pub struct MjcfArm {
    /// Axes, points and bodies, in the world frame, at the reference of all joints.
    pub arm: DynamicArm,
    /// The joints, in the order of the chain.
    pub joints: Vec<MjcfJoint>,
    /// What a person should know, a sentence each.
    pub notes: Vec<String>,
}

/// Elements of a body that are made of others when the model is compiled.
const COMPOSED: [&str; 4] = ["composite", "flexcomp", "replicate", "attach"];
/// Actuators that are read.
const ACTUATORS: [&str; 4] = ["position", "velocity", "motor", "general"];

/// Reads the chain of `joints`, from the base outwards; all hinge and slide joints where none is named. `includes` are the files that
/// `<include file=..>` names. Fails with every fault found, each with its line.
pub fn read(file: MjcfText, includes: &[MjcfText], joints: &[String]) -> Result<MjcfArm> {
    let whole = expanded(file, includes, 0)?;
    let document = Document::parse(&whole)
        .map_err(|error| Error::spec(file.label, format!("not readable as XML: {error}")))?;
    let mut reader = Reader {
        label: file.label,
        document: &document,
        exact: whole == file.text,
        faults: Vec::new(),
        notes: Vec::new(),
        classes: BTreeMap::new(),
        degrees: true,
        euler: "xyz".into(),
    };
    let arm = reader.arm(joints);
    match arm {
        Some(arm) if reader.faults.is_empty() => Ok(arm),
        _ => Err(Error::Spec(reader.faults)),
    }
}

/// Files that a text includes, by their names.
pub fn included(text: &str) -> Vec<String> {
    let Ok(document) = Document::parse(text) else {
        return Vec::new();
    };
    let nodes = document.descendants().filter(|n| n.has_tag_name("include"));
    nodes
        .filter_map(|n| n.attribute("file").map(String::from))
        .collect()
}

/// The text with its includes put in.
fn expanded(file: MjcfText, includes: &[MjcfText], depth: usize) -> Result<String> {
    let fail = |message: String| Error::spec(file.label, message);
    let document = Document::parse(file.text)
        .map_err(|error| fail(format!("not readable as XML: {error}")))?;
    if depth > 8 {
        return Err(fail("includes files in a circle".into()));
    }
    let (mut text, mut from) = (String::new(), 0);
    for node in document.descendants().filter(|n| n.has_tag_name("include")) {
        let name = node.attribute("file").unwrap_or_default();
        let base = |path: &str| path.rsplit(['/', '\\']).next().unwrap_or(path).to_string();
        let found = includes
            .iter()
            .find(|other| other.label == name || base(other.label) == base(name));
        let Some(found) = found else {
            let line = document.text_pos_at(node.range().start).row;
            let place = format!("{}:{line}", file.label);
            let message = format!(
                "<include file=\"{name}\"> needs that file; name it in `includes: [{name}]`"
            );
            return Err(Error::spec(place, message));
        };
        let inner = expanded(*found, includes, depth + 1)?;
        let document = Document::parse(&inner)
            .map_err(|error| Error::spec(found.label, format!("not readable as XML: {error}")))?;
        let children = document.root_element().children();
        text += &file.text[from..node.range().start];
        children.for_each(|child| text += &inner[child.range()]);
        from = node.range().end;
    }
    Ok(text + &file.text[from..])
}

/// A class of defaults.
#[derive(Debug, Default)]
struct Class {
    parent: Option<String>,
    /// Element -> attribute -> value.
    values: BTreeMap<String, BTreeMap<String, String>>,
}

/// A joint of the tree, with its place at the reference pose.
struct TreeJoint<'a> {
    node: Node<'a, 'a>,
    name: String,
    class: String,
    slides: bool,
    axis: Vector3<f64>,
    point: Point3<f64>,
    /// Joints between the world and it, by their numbers, outermost last.
    above: Vec<usize>,
}

/// A body of the tree at the reference pose.
struct TreeBody {
    name: String,
    inertial: Option<Inertial>,
    /// Joints that carry it.
    above: Vec<usize>,
    place: Isometry3<f64>,
    /// Where it is declared.
    line: String,
}

#[derive(Default)]
struct Tree<'a> {
    joints: Vec<TreeJoint<'a>>,
    bodies: Vec<TreeBody>,
    /// Name, place, joints that carry it.
    sites: Vec<(String, Point3<f64>, Vec<usize>)>,
}

struct Reader<'a> {
    label: &'a str,
    document: &'a Document<'a>,
    /// Whether lines are those of the file itself.
    exact: bool,
    faults: Vec<Fault>,
    notes: Vec<String>,
    classes: BTreeMap<String, Class>,
    degrees: bool,
    euler: String,
}
impl<'a> Reader<'a> {
    fn place(&self, node: Node) -> String {
        if !self.exact {
            return format!("{}: <{}>", self.label, node.tag_name().name());
        }
        let line = self.document.text_pos_at(node.range().start).row;
        format!("{}:{line}", self.label)
    }

    fn fault(&mut self, node: Node, message: impl Into<String>) {
        let place = self.place(node);
        self.faults.push(Fault::new(place, message));
    }

    fn arm(&mut self, wanted: &[String]) -> Option<MjcfArm> {
        let root = self.document.root_element();
        if root.tag_name().name() != "mujoco" {
            let found = root.tag_name().name();
            self.fault(
                root,
                format!("expected an MJCF, whose root is <mujoco>, found <{found}>"),
            );
            return None;
        }
        self.compiler(root);
        for node in children(root, "default") {
            self.class(node, None);
        }
        let gravity = self.gravity(root);
        let mut tree = Tree::default();
        for world in children(root, "worldbody") {
            self.body(world, Isometry3::identity(), "main", &[], &mut tree);
        }
        let chain = self.chain(root, &tree, wanted)?;
        self.closed_loops(root, &tree, &chain);
        let links = self.links(&tree, &chain);
        let joints: Vec<MjcfJoint> = chain
            .iter()
            .map(|joint| self.joint(root, &tree.joints[*joint]))
            .collect();
        let last = chain.last().copied()?;
        let carried = tree
            .sites
            .iter()
            .filter(|(_, _, above)| above.contains(&last));
        let tool = carried
            .clone()
            .find(|(name, ..)| name == "tool")
            .or(carried.clone().next_back())
            .map(|(_, at, _)| *at);
        let end = tree
            .bodies
            .iter()
            .rev()
            .find(|body| body.above.last() == Some(&last));
        let tool = tool.or_else(|| end.map(|body| body.place.translation.vector.into()));
        let moving = |joint: &usize| &tree.joints[*joint];
        Some(MjcfArm {
            arm: DynamicArm {
                axes: chain.iter().map(|joint| moving(joint).axis).collect(),
                points: chain.iter().map(|joint| moving(joint).point).collect(),
                prismatic: chain.iter().map(|joint| moving(joint).slides).collect(),
                tool: tool.unwrap_or_default(),
                links: Some(links),
                payload: None,
                gravity,
                ratio: vec![1.0; chain.len()],
                coupled: Vec::new(),
                tolerance: InertialTolerance {
                    mass_relative: 0.05,
                    centre: 5e-3,
                    inertia_relative: 0.2,
                },
            },
            joints,
            notes: std::mem::take(&mut self.notes),
        })
    }
}

fn children<'a>(node: Node<'a, 'a>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children()
        .filter(move |child| child.has_tag_name(name))
}

fn rotation(x: Vector3<f64>, y: Vector3<f64>) -> UnitQuaternion<f64> {
    let z = x.cross(&y);
    let matrix = Matrix3::from_columns(&[x, y, z]);
    UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(matrix))
}
