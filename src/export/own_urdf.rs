//! The URDF that a model was identified with: links, limits and frames as its author has them.

use super::Export;
use super::own_mjcf::is_mjcf;
use crate::error::{Error, Result};
use crate::raw::{self, ending};
use crate::spatial::Pose;
use crate::yaml;
use nalgebra::{Rotation3, Vector3};
use roxmltree::{Document, Node};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Direction and place within which the axes of the file are those of the model, rad and m.
const SAME: f64 = 1e-6;

/// The chain of the arm in its own file; frames at the zero pose in the base frame, m.
pub(super) struct OwnUrdf {
    /// Name of the file, without its folder.
    pub(crate) file: String,
    pub(crate) base: String,
    /// The last link of the chain, and where it is.
    pub(crate) tip: (String, Pose),
    /// The moving joints from the base on.
    pub(crate) joints: Vec<OwnJoint>,
    /// Links that are no part of the chain's moving ones, neither its ends.
    pub(crate) others: Vec<String>,
}

/// A moving joint and the link that it moves.
pub(super) struct OwnJoint {
    pub(crate) name: String,
    pub(crate) child: String,
    /// Frames of the link before it and of its own link.
    pub(crate) parent_frame: Pose,
    pub(crate) frame: Pose,
    /// Unit, base frame.
    pub(crate) axis: Vector3<f64>,
    /// As they are written.
    pub(crate) effort: Option<String>,
    pub(crate) velocity: Option<String>,
}

/// A joint as it stands in the file.
struct Written<'a> {
    name: &'a str,
    parent: &'a str,
    child: &'a str,
    moves: bool,
    origin: Pose,
    axis: Vector3<f64>,
    limit: Option<Node<'a, 'a>>,
}

impl OwnUrdf {
    /// The file behind a model; none where it has none. Fails where it cannot be read or is another arm's by now.
    pub(crate) fn of(export: &Export) -> Result<Option<Self>> {
        let sources = &export.identified.sources;
        let with_ending = |wanted: [&'static str; 2]| {
            let is = move |source: &&PathBuf| wanted.contains(&ending(source).as_str());
            sources.iter().filter(is)
        };
        let read = |path: &PathBuf| {
            raw::text(path).map_err(|error| Error::unreadable(path.display().to_string(), &error))
        };
        let mut found = None;
        for path in with_ending(["urdf", "xml"]) {
            let text = read(path)?;
            if !is_mjcf(&text) {
                found = found.or(Some((path, text)));
            }
        }
        let Some((path, text)) = found else {
            return Ok(None);
        };
        let label = path.display().to_string();
        let [mut base, mut tip] = [None, None];
        for file in with_ending(["yaml", "yml"]) {
            let tree = yaml::parse(&read(file)?).0;
            let end = |key: &str| tree.as_ref().and_then(|tree| tree.at(key)?.text());
            base = base.or(end("kinematics.urdf.base"));
            tip = tip.or(end("kinematics.urdf.tip"));
        }
        let document =
            Document::parse(&text).map_err(|error| Error::data(&label, error.to_string()))?;
        let ends = base.zip(tip);
        let found = ends.and_then(|(base, tip)| Self::read(&document, &base, &tip));
        let found = found.filter(|own| own.is_of(export));
        let Some(mut own) = found else {
            let message =
                "is not the description that the model was identified with: its joints are others";
            return Err(Error::data(&label, message));
        };
        own.file = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into();
        Ok(Some(own))
    }

    fn read(document: &Document, base: &str, tip: &str) -> Option<Self> {
        let mut written: BTreeMap<&str, Written> = BTreeMap::new();
        let nodes = document.root_element().children();
        for node in nodes.clone().filter(|node| node.has_tag_name("joint")) {
            let joint = joint(node)?;
            written.extend(joint.map(|joint| (joint.child, joint)));
        }
        let way = |link: &'_ str| -> Vec<&Written> {
            let first = written.get(link);
            let up = std::iter::successors(first, |joint| written.get(joint.parent));
            let mut way: Vec<&Written> = up.take(written.len()).collect();
            way.reverse();
            way
        };
        let place = |link: &str| {
            let origins = way(link).into_iter().map(|joint| joint.origin);
            origins.fold(Pose::identity(), |pose, origin| pose * origin)
        };
        let from = place(base).inverse();
        let before: BTreeSet<&str> = way(base).iter().map(|joint| joint.child).collect();
        let chain = way(tip);
        let moving = chain
            .iter()
            .filter(|joint| joint.moves && !before.contains(joint.child));
        let of = |joint: &&&Written| {
            let frame = from * place(joint.child);
            let limit = |name: &str| Some(joint.limit?.attribute(name)?.to_string());
            OwnJoint {
                name: joint.name.into(),
                child: joint.child.into(),
                parent_frame: from * place(joint.parent),
                frame,
                axis: frame.rotation * joint.axis,
                effort: limit("effort"),
                velocity: limit("velocity"),
            }
        };
        let joints: Vec<OwnJoint> = moving.map(|joint| of(&joint)).collect();
        let links = nodes.filter(|node| node.has_tag_name("link"));
        let names = links.filter_map(|node| node.attribute("name"));
        let kept = |name: &str| {
            name == base || name == tip || joints.iter().any(|joint| joint.child == name)
        };
        Some(Self {
            file: String::new(),
            base: base.into(),
            tip: (tip.into(), from * place(tip)),
            others: names.filter(|name| !kept(name)).map(String::from).collect(),
            joints,
        })
    }

    /// Whether its axes are those of the nominal arm.
    fn is_of(&self, export: &Export) -> bool {
        let joints = &export.identified.robot.joints;
        let pairs = self.joints.iter().zip(joints);
        self.joints.len() == joints.len()
            && pairs.into_iter().all(|(own, joint)| {
                let away = own.frame.translation - Vector3::from(joint.point);
                let apart = (away - own.axis * own.axis.dot(&away)).norm();
                (own.axis - Vector3::from(joint.axis)).norm() < SAME && apart < SAME
            })
    }

    /// Whether a link of it is called so.
    pub(crate) fn has_link(&self, name: &str) -> bool {
        let of_chain = self.joints.iter().any(|joint| joint.child == name);
        of_chain
            || name == self.base
            || name == self.tip.0
            || self.others.iter().any(|one| one == name)
    }
}

/// A joint with both ends; none (inside) of one without, none of one whose numbers are not readable.
fn joint<'a>(node: Node<'a, 'a>) -> Option<Option<Written<'a>>> {
    let child = |name: &str| node.children().find(|child| child.has_tag_name(name));
    let end = |name: &str| child(name).and_then(|end| end.attribute("link"));
    let [roll, pitch, yaw] = three(child("origin"), "rpy", [0.0; 3])?;
    let place = three(child("origin"), "xyz", [0.0; 3])?;
    let turn = Rotation3::from_euler_angles(roll, pitch, yaw);
    let axis = three(child("axis"), "xyz", [1.0, 0.0, 0.0])?;
    let axis = Vector3::from(axis).try_normalize(0.0)?;
    let ends = end("parent").zip(end("child"));
    let named = ends.zip(node.attribute("name"));
    Some(named.map(|((parent, link), name)| Written {
        name,
        parent,
        child: link,
        moves: node.attribute("type") != Some("fixed"),
        origin: Pose::new(turn.into_inner(), place.into()),
        axis,
        limit: child("limit"),
    }))
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
