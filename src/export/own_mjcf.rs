//! The MJCF that a pipeline names as the arm's: a copy of it with what was identified of the torques of its joints.

use super::friction::{ARMATURE, DAMPING, FRICTION, digits, positive};
use super::rigid::MJCF;
use super::{CarriedTorques, Export, Format};
use crate::dynamics::FittedNumber;
use crate::error::{Error, Result, listed, one_line};
use crate::raw::{self, ending};
use roxmltree::{Document, Node};

/// What a copy holds: bodies and drives stay those of the file. Where its joints have their zeros, and in which sense they turn, is not known here,
/// so that it holds no spring.
const COPY: Format = Format {
    carries: CarriedTorques::Causes(&[DAMPING, FRICTION, ARMATURE]),
    ..MJCF
};

/// A file of the arm for MuJoCo.
pub(super) struct OwnMjcf {
    label: String,
    /// Without its folder.
    file: String,
    text: String,
}

/// Whether a text is a model for MuJoCo.
pub(super) fn is_mjcf(text: &str) -> bool {
    Document::parse(text).is_ok_and(|document| document.root_element().has_tag_name("mujoco"))
}

impl OwnMjcf {
    /// The file behind a model; none where its pipeline names none. Fails where it cannot be read.
    pub(crate) fn of(export: &Export) -> Result<Option<Self>> {
        for path in &export.identified.sources {
            if !["xml", "mjcf"].contains(&ending(path).as_str()) {
                continue;
            }
            let label = path.display().to_string();
            let text = raw::text(path).map_err(|error| Error::unreadable(&label, &error))?;
            if is_mjcf(&text) {
                let file = path.file_name().unwrap_or_default().to_string_lossy();
                let file = file.into_owned();
                return Ok(Some(Self { label, file, text }));
            }
        }
        Ok(None)
    }

    /// The copy, with remarks at its begin. Fails where its joints are not those of the arm.
    pub(crate) fn with_torques(&self, export: &Export) -> Result<String> {
        let document = Document::parse(&self.text)
            .map_err(|error| Error::data(&self.label, error.to_string()))?;
        let joints = self.joints(&document, export)?;
        let mut remarks = export.remarks_in(&COPY);
        remarks.push(format!(
            "a copy of {}: bodies, drives and what was not found of a joint are as there; identified masses are not carried",
            one_line(&self.file)
        ));
        let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
        for (index, node) in joints.into_iter().enumerate() {
            for (name, number) in found(export, index) {
                edits.push(edit(&node, name, &digits(number)));
            }
        }
        // From the end, so that places before stay where they are; what is put in at one place keeps its order.
        edits.sort_by_key(|(range, _)| range.start);
        let mut text = self.text.clone();
        for (range, value) in edits.into_iter().rev() {
            text.replace_range(range, &value);
        }
        let begin = match text.starts_with("<?xml") {
            true => text.find("?>").map_or(0, |end| end + 2),
            false => 0,
        };
        let comments = super::body::comments(&remarks);
        Ok(format!(
            "<?xml version=\"1.0\"?>\n{comments}{}",
            text[begin..].trim_start()
        ))
    }

    /// The elements of the arm's joints: by their names, or all that move, in their order, where it has none of the names.
    fn joints<'a>(&self, document: &'a Document, export: &Export) -> Result<Vec<Node<'a, 'a>>> {
        let world = document.descendants();
        let world = world.filter(|node| node.has_tag_name("worldbody"));
        let all = world.flat_map(|world| world.descendants());
        let moves = |node: &Node| {
            node.has_tag_name("joint")
                && node
                    .attribute("type")
                    .is_none_or(|kind| ["hinge", "slide"].contains(&kind))
        };
        let all: Vec<Node> = all.filter(moves).collect();
        let names = export
            .corrected
            .joints
            .iter()
            .map(|joint| joint.name.as_str());
        let of_name = |name: &str| {
            let mut all = all.iter();
            all.find(|node| node.attribute("name") == Some(name))
                .copied()
        };
        let named: Vec<Option<Node>> = names.clone().map(of_name).collect();
        if named.iter().all(Option::is_none) && all.len() == named.len() {
            return Ok(all);
        }
        let missing = names.zip(&named).filter(|(_, node)| node.is_none());
        let missing: Vec<String> = missing.map(|(name, _)| format!("`{name}`")).collect();
        if missing.is_empty() {
            return Ok(named.into_iter().flatten().collect());
        }
        let here = all.iter().filter_map(|node| node.attribute("name"));
        let here: Vec<&str> = here.collect();
        let message = format!(
            "has no joint {}; allowed: the names of the robot file's joints, or as many joints as it has; there are {}",
            listed(&missing),
            here.join(", ")
        );
        Err(Error::data(&self.label, message))
    }
}

/// Attributes of a joint (from 0) that were found.
fn found(export: &Export, joint: usize) -> Vec<(&'static str, FittedNumber)> {
    let Some(torques) = &export.identified.torques else {
        return Vec::new();
    };
    let of = |(name, effect)| Some((name, positive(torques, effect, joint)?));
    let attributes = [
        ("damping", DAMPING),
        ("frictionloss", FRICTION),
        ("armature", ARMATURE),
    ];
    attributes.into_iter().filter_map(of).collect()
}

/// Where an attribute of an element is written, and what.
fn edit(node: &Node, name: &str, value: &str) -> (std::ops::Range<usize>, String) {
    match node.attribute_node(name) {
        Some(attribute) => (attribute.range_value(), value.into()),
        None => {
            let end = node.range().start + 1 + node.tag_name().name().len();
            (end..end, format!(" {name}=\"{value}\""))
        }
    }
}
