//! URDF: the chain from a base link (on the way to the tip, or fixed to a link that is) to a tip link, as ROS defines it (<http://wiki.ros.org/urdf/XML>): m and rad, a joint's
//! `origin` from the parent link's frame, its `axis` in its own. What hangs rigidly on a moved link adds to that link's mass;
//! branches that move by themselves (a gripper) add as they are at their zero. Mimic, floating and planar joints are refused.

use super::kinematics::unit;
use super::{ChainBody, ChainJoint, FrameChain, RobotFileText, inertia};
use crate::description::JointKind;
use crate::error::{Error, Fault, Result, did_you_mean};
use crate::robot::Bound;
use crate::spatial::Pose;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::collections::{BTreeMap, BTreeSet};

struct UrdfJoint<'a> {
    node: Node<'a, 'a>,
    name: &'a str,
    parent: &'a str,
    child: &'a str,
    origin: Isometry3<f64>,
}

/// Where a chain begins, and what its joints are.
#[derive(Debug)]
pub struct UrdfOutline {
    /// The first link.
    pub base: String,
    /// Whether a joint is prismatic, from the base on.
    pub sliding: Vec<bool>,
    /// What a person should know of its bodies, a sentence each.
    pub notes: Vec<String>,
}

struct Reader<'a> {
    label: &'a str,
    document: &'a Document<'a>,
    faults: Vec<Fault>,
    notes: Vec<String>,
}

fn parse(file: RobotFileText<'_>) -> Result<Document<'_>> {
    Document::parse(file.text)
        .map_err(|e| Error::spec(file.label, format!("not readable as XML: {e}")))
}

/// Reads the chain from `base` to `tip`; fails with every fault found, each with its line.
pub(super) fn read(file: RobotFileText, base: &str, tip: &str) -> Result<FrameChain> {
    let document = parse(file)?;
    let mut reader = Reader {
        label: file.label,
        document: &document,
        faults: Vec::new(),
        notes: Vec::new(),
    };
    let chain = reader.chain(base, tip);
    match chain {
        Some(chain) if reader.faults.is_empty() => Ok(chain),
        _ => Err(Error::Spec(reader.faults)),
    }
}

/// The first link of the chain of a URDF that ends at `tip`, and which of its joints slide: the link `base_link` where it stands on the way,
/// else the one that nothing carries. Fails with every fault of the file.
pub fn outline(file: RobotFileText, tip: &str) -> Result<UrdfOutline> {
    let document = parse(file)?;
    let joints = document
        .root_element()
        .children()
        .filter(|node| node.has_tag_name("joint"));
    let end = |joint: &Node, name: &str| {
        element(*joint, name)
            .and_then(|node| node.attribute("link"))
            .map(String::from)
    };
    let parents: BTreeMap<String, String> = joints
        .filter_map(|joint| end(&joint, "child").zip(end(&joint, "parent")))
        .collect();
    let way = std::iter::successors(Some(tip.to_string()), |link| parents.get(link).cloned());
    // Joints that run in a circle are a fault of the chain.
    let way: Vec<String> = way.take(parents.len() + 1).collect();
    let base = way
        .iter()
        .find(|link| *link == "base_link" && *link != tip)
        .or(way.last())
        .cloned()
        .unwrap_or_default();
    let chain = read(file, &base, tip)?;
    let sliding = chain
        .joints
        .iter()
        .map(|joint| joint.kind == JointKind::Prismatic)
        .collect();
    Ok(UrdfOutline {
        base,
        sliding,
        notes: chain.notes,
    })
}

/// Where the link `base` stands in the frame of the link `base_link` of a URDF (m), if fixed joints join both: in the one a controller counts
/// poses, in the other ROS does (REP 199).
pub fn controller_base(file: RobotFileText, base_link: &str) -> Option<Pose> {
    let document = parse(file).ok()?;
    let mut reader = Reader {
        label: file.label,
        document: &document,
        faults: Vec::new(),
        notes: Vec::new(),
    };
    let root = document.root_element();
    let links = root.children().filter(|node| node.has_tag_name("link"));
    let links: BTreeMap<&str, Node> = links
        .filter_map(|node| Some((node.attribute("name")?, node)))
        .collect();
    let joints = reader.joints(root, &links)?;
    let up = |link: &'_ str| {
        let mut way = vec![(link.to_string(), Isometry3::identity())];
        while let Some((link, from)) = way.last().cloned()
            && let Some(joint) = joints.get(link.as_str())
            && joint.node.attribute("type") == Some("fixed")
            && way.len() <= joints.len()
        {
            way.push((joint.parent.to_string(), joint.origin * from));
        }
        way
    };
    if !links.contains_key("base") || base_link == "base" {
        return None;
    }
    let (ours, theirs) = (up(base_link), up("base"));
    let common = ours.iter().find_map(|(link, from)| {
        let (_, other) = theirs.iter().find(|(one, _)| one == link)?;
        Some(from.inverse() * other)
    })?;
    let turn = common.rotation.to_rotation_matrix().into_inner();
    Some(Pose::new(turn, common.translation.vector))
}

/// The first element of that name in another one.
fn element<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

impl<'a> Reader<'a> {
    fn fault(&mut self, node: Node, message: impl Into<String>) {
        let place = self.place(node);
        self.faults.push(Fault::new(place, message));
    }

    fn place(&self, node: Node) -> String {
        format!(
            "{}:{}",
            self.label,
            self.document.text_pos_at(node.range().start).row
        )
    }

    fn chain(&mut self, base: &str, tip: &str) -> Option<FrameChain> {
        let root = self.document.root_element();
        if root.tag_name().name() != "robot" {
            self.fault(
                root,
                format!(
                    "expected a URDF, whose root is <robot>, found <{}>",
                    root.tag_name().name()
                ),
            );
            return None;
        }
        if root.descendants().any(|node| {
            node.tag_name()
                .namespace()
                .is_some_and(|space| space.contains("xacro"))
        }) {
            self.fault(
                root,
                "is a xacro file; expand it first: `xacro arm.urdf.xacro > arm.urdf`",
            );
            return None;
        }
        let mut links: BTreeMap<&str, Node> = BTreeMap::new();
        for node in root.children().filter(|node| node.has_tag_name("link")) {
            let name = self.attribute(node, "name")?;
            if links.insert(name, node).is_some() {
                self.fault(node, format!("link `{name}` is there twice"));
            }
        }
        for name in [base].into_iter().chain((tip != base).then_some(tip)) {
            if !links.contains_key(name) {
                let hint = did_you_mean(name, links.keys().copied());
                let all = links.keys().copied().collect::<Vec<_>>().join(", ");
                self.fault(root, format!("no link `{name}`{hint} (links: {all})"));
            }
        }
        let joints = self.joints(root, &links)?;
        if !self.faults.is_empty() {
            return None;
        }
        let (start, path) = self.path(root, &joints, base, tip)?;
        Some(self.walk(&joints, &links, start, &path))
    }

    /// Every joint of the file, by the link it moves.
    fn joints(
        &mut self,
        root: Node<'a, 'a>,
        links: &BTreeMap<&'a str, Node>,
    ) -> Option<BTreeMap<&'a str, UrdfJoint<'a>>> {
        let mut joints = BTreeMap::new();
        let mut names = BTreeSet::new();
        for node in root.children().filter(|node| node.has_tag_name("joint")) {
            let name = self.attribute(node, "name")?;
            if !names.insert(name) {
                self.fault(node, format!("joint `{name}` is there twice"));
            }
            let parent = self
                .child(node, "parent")
                .and_then(|end| self.attribute(end, "link"))?;
            let child = self
                .child(node, "child")
                .and_then(|end| self.attribute(end, "link"))?;
            for end in [parent, child] {
                if !links.contains_key(end) {
                    let hint = did_you_mean(end, links.keys().copied());
                    self.fault(
                        node,
                        format!(
                            "joint `{name}` refers to link `{end}`, which does not exist{hint}"
                        ),
                    );
                }
            }
            let origin = self.origin(node);
            if joints
                .insert(
                    child,
                    UrdfJoint {
                        node,
                        name,
                        parent,
                        child,
                        origin,
                    },
                )
                .is_some()
            {
                self.fault(
                    node,
                    format!("joint `{name}`: link `{child}` has two parents; expected a tree"),
                );
            }
        }
        Some(joints)
    }

    /// The joints from base to tip, and the frame in the base's of the link from which the first of them goes: the base itself, or a link
    /// below which the base hangs by fixed joints, as `base` beside `base_link`.
    fn path(
        &mut self,
        root: Node,
        joints: &BTreeMap<&'a str, UrdfJoint<'a>>,
        base: &str,
        tip: &str,
    ) -> Option<(Isometry3<f64>, Vec<&'a str>)> {
        let (mut above, mut from) = (vec![base], vec![Isometry3::identity()]);
        let mut moves = None;
        while let Some(joint) = joints.get(above[above.len() - 1]) {
            if joint.node.attribute("type") != Some("fixed") {
                moves = Some(joint);
                break;
            }
            if above.len() > joints.len() {
                break;
            }
            from.push(joint.origin * from[from.len() - 1]);
            above.push(joint.parent);
        }
        let mut path = Vec::new();
        let mut link = tip;
        let meets = |link: &str| above.iter().position(|one| *one == link);
        while meets(link).is_none() {
            match joints.get(link) {
                Some(joint) if path.len() < joints.len() => {
                    path.push(joint.child);
                    link = joint.parent;
                }
                Some(_) => {
                    self.fault(
                        root,
                        format!("the joints from `{tip}` run in a circle; expected a tree"),
                    );
                    return None;
                }
                None => {
                    let moves = moves.map_or_else(String::new, |joint| {
                        format!(
                            "; up from `{base}` the joint `{}` moves, and a base hangs on the chain by fixed joints alone",
                            joint.name
                        )
                    });
                    self.fault(root, format!("no chain from `{base}` to `{tip}`: the way up from `{tip}` ends at `{link}`{moves}"));
                    return None;
                }
            }
        }
        path.reverse();
        Some((from[meets(link)?].inverse(), path))
    }

    fn walk(
        &mut self,
        joints: &BTreeMap<&'a str, UrdfJoint<'a>>,
        links: &BTreeMap<&'a str, Node<'a, 'a>>,
        start: Isometry3<f64>,
        path: &[&'a str],
    ) -> FrameChain {
        let mut frame = start;
        let mut chain = Vec::new();
        for link in path {
            let joint = &joints[link];
            frame *= joint.origin;
            if joint.node.attribute("type") == Some("fixed") {
                continue;
            }
            let Some(kind) = self.kind(joint) else {
                continue;
            };
            let axis = match element(joint.node, "axis") {
                None => Vector3::x(),
                Some(node) => Vector3::from(self.numbers(node, "xyz", [1.0, 0.0, 0.0], None)),
            };
            let axis = unit(axis).unwrap_or_else(|| {
                self.fault(
                    joint.node,
                    format!(
                        "joint `{}`: the axis has no direction, its length is zero",
                        joint.name
                    ),
                );
                Vector3::x()
            });
            let body = self.body(joints, links, path, joint.child, frame);
            chain.push(ChainJoint {
                name: Some(joint.name.into()),
                kind,
                axis: frame * axis,
                point: frame * Point3::origin(),
                limits: self.limits(joint),
                frame: Some(frame),
                body,
            });
        }
        FrameChain {
            joints: chain,
            tip: frame,
            notes: std::mem::take(&mut self.notes),
        }
    }

    fn kind(&mut self, joint: &UrdfJoint) -> Option<JointKind> {
        let name = joint.name;
        if let Some(mimic) = element(joint.node, "mimic") {
            self.fault(mimic, format!("joint `{name}` mimics another joint; expected a serial chain of independent joints"));
            return None;
        }
        match joint.node.attribute("type") {
            Some("revolute" | "continuous") => Some(JointKind::Revolute),
            Some("prismatic") => Some(JointKind::Prismatic),
            other => {
                let other = other.unwrap_or("");
                self.fault(
                    joint.node,
                    format!("joint `{name}` has the type `{other}` (allowed: revolute, continuous, prismatic, fixed)"),
                );
                None
            }
        }
    }

    fn limits(&mut self, joint: &UrdfJoint<'a>) -> Option<[f64; 2]> {
        let node = element(joint.node, "limit")?;
        if joint.node.attribute("type") == Some("continuous")
            || !node.has_attribute("lower") && !node.has_attribute("upper")
        {
            return None;
        }
        let bound = if joint.node.attribute("type") == Some("prismatic") {
            Bound::Length
        } else {
            Bound::Angle
        };
        let [lower] = self.numbers(node, "lower", [0.0], Some(bound));
        let [upper] = self.numbers(node, "upper", [0.0], Some(bound));
        if lower > upper {
            self.fault(
                node,
                format!(
                    "joint `{}`: expected lower <= upper, found {lower} and {upper}",
                    joint.name
                ),
            );
        }
        Some([lower, upper])
    }

    /// What moves with `link`: itself and every branch that the chain does not move on.
    fn body(
        &mut self,
        joints: &BTreeMap<&'a str, UrdfJoint<'a>>,
        links: &BTreeMap<&'a str, Node<'a, 'a>>,
        path: &[&'a str],
        link: &'a str,
        frame: Isometry3<f64>,
    ) -> Option<ChainBody> {
        let mut parts = Vec::new();
        // Every link has one parent and lies below `link`, so this ends.
        let mut open = vec![(link, frame)];
        while let Some((link, frame)) = open.pop() {
            if let Some(inertial) = element(links[link], "inertial") {
                parts.push(self.part(link, inertial, frame));
            }
            for joint in joints.values().filter(|joint| joint.parent == link) {
                let moves_on =
                    path.contains(&joint.child) && joint.node.attribute("type") != Some("fixed");
                if !moves_on {
                    open.push((joint.child, frame * joint.origin));
                }
            }
        }
        let mass: f64 = parts.iter().map(|part| part.mass).sum();
        if mass == 0.0 {
            return None;
        }
        let moment: Vector3<f64> = parts
            .iter()
            .map(|part| part.mass * part.centre.coords)
            .sum();
        let centre = Point3::from(moment / mass);
        let about = |part: &ChainBody| {
            Some(
                inertia::tensor(&part.inertia?)
                    + inertia::offset(part.mass, &(part.centre - centre)),
            )
        };
        let tensors: Option<Vec<_>> = parts.iter().map(about).collect();
        let inertia = tensors.map(|all| inertia::of_tensor(&all.iter().sum()));
        Some(ChainBody {
            mass,
            centre,
            inertia,
        })
    }

    /// The `<inertial>` of a link whose frame stands so at the zero pose.
    fn part(&mut self, link: &str, inertial: Node<'a, 'a>, frame: Isometry3<f64>) -> ChainBody {
        let place = frame * self.origin(inertial);
        let mass = match self.child(inertial, "mass") {
            Some(node) => self.numbers(node, "value", [f64::NAN], Some(Bound::Mass))[0],
            None => f64::NAN,
        };
        if mass < 0.0 {
            self.fault(
                inertial,
                format!("link `{link}`: expected a mass in kg, not less than 0, found {mass}"),
            );
        }
        let tensor = element(inertial, "inertia");
        let moments = tensor.map(|node| {
            let moments = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|name| {
                self.numbers(
                    node,
                    name,
                    [if name == "ixx" { f64::NAN } else { 0.0 }],
                    Some(Bound::Inertia),
                )[0]
            });
            if let Some(message) = inertia::impossible_inertia(&moments) {
                self.notes.push(format!(
                    "{}: link `{link}`: {message}{}",
                    self.place(node),
                    inertia::UNUSED
                ));
            }
            inertia::turned(&moments, &place.rotation.to_rotation_matrix())
        });
        ChainBody {
            mass,
            centre: place * Point3::origin(),
            inertia: moments,
        }
    }

    fn child(&mut self, node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
        let found = element(node, name);
        if found.is_none() {
            self.fault(
                node,
                format!("<{}> has no <{name}>", node.tag_name().name()),
            );
        }
        found
    }

    fn attribute(&mut self, node: Node<'a, 'a>, name: &str) -> Option<&'a str> {
        let found = node.attribute(name);
        if found.is_none() {
            self.fault(
                node,
                format!("<{}> has no attribute `{name}`", node.tag_name().name()),
            );
        }
        found
    }

    fn origin(&mut self, node: Node<'a, 'a>) -> Isometry3<f64> {
        let Some(origin) = element(node, "origin") else {
            return Isometry3::identity();
        };
        let [roll, pitch, yaw] = self.numbers(origin, "rpy", [0.0; 3], Some(Bound::Angle));
        let shift = Vector3::from(self.numbers(origin, "xyz", [0.0; 3], Some(Bound::Length)));
        Isometry3::from_parts(
            Translation3::from(shift),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        )
    }

    /// The numbers of an attribute, or `fallback` where the attribute is missing (NaN there: it may not be).
    fn numbers<const N: usize>(
        &mut self,
        node: Node<'a, 'a>,
        name: &str,
        fallback: [f64; N],
        bound: Option<Bound>,
    ) -> [f64; N] {
        let Some(text) = node.attribute(name) else {
            if fallback.iter().any(|x| x.is_nan()) {
                self.attribute(node, name);
            }
            return fallback;
        };
        let numbers: Option<Vec<f64>> = text
            .split_whitespace()
            .map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()))
            .collect();
        let beyond = numbers
            .iter()
            .flatten()
            .find_map(|number| bound?.fault(*number));
        if let Some(message) = beyond {
            self.fault(
                node,
                format!("<{} {name}>: {message}", node.tag_name().name()),
            );
        }
        numbers
            .and_then(|numbers| <[f64; N]>::try_from(numbers).ok())
            .unwrap_or_else(|| {
                let what = if N == 1 {
                    "a finite number".into()
                } else {
                    format!("{N} finite numbers")
                };
                self.fault(
                    node,
                    format!(
                        "<{} {name}>: expected {what}, found `{text}`",
                        node.tag_name().name()
                    ),
                );
                [f64::NAN; N]
            })
    }
}
