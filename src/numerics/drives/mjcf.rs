//! MJCF: a serial chain out of a MuJoCo model (<https://mujoco.readthedocs.io/en/stable/XMLreference.html>). Some joints move, all others
//! are held at their reference; what hangs on held joints adds to the link that carries it.
//!
//! Read are bodies, frames, inertials, hinge and slide joints, defaults with classes, includes, and the actuators `position`, `velocity`,
//! `motor` and `general` of the joints that move. What is not read and would change the motion is refused by its element and line.

use calib_dynamics::{DynamicArm, Inertial, InertialTolerance};
use calib_numerics::error::{Error, Fault, Result, did_you_mean, listed};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
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

    fn compiler(&mut self, root: Node<'a, 'a>) {
        for node in children(root, "compiler") {
            match node.attribute("angle") {
                None | Some("degree") => {}
                Some("radian") => self.degrees = false,
                Some(other) => self.fault(
                    node,
                    format!("angle=\"{other}\"; allowed: degree and radian"),
                ),
            }
            if let Some(order) = node.attribute("eulerseq") {
                self.euler = order.into();
            }
            for (name, neutral) in [
                ("coordinate", "local"),
                ("balanceinertia", "false"),
                ("inertiafromgeom", "auto"),
                ("settotalmass", "-1"),
                ("boundmass", "0"),
                ("boundinertia", "0"),
            ] {
                let value = node.attribute(name).unwrap_or(neutral);
                let never = name == "inertiafromgeom" && value == "false";
                if value != neutral && !never {
                    self.fault(
                        node,
                        format!(
                            "{name}=\"{value}\" changes the inertials when it is compiled, which is not read; let MuJoCo write the compiled \
                             model (mj_saveLastXML) and name that file"
                        ),
                    );
                }
            }
        }
    }

    /// Defaults of a class and of those within it.
    fn class(&mut self, node: Node<'a, 'a>, parent: Option<&str>) {
        let name = node
            .attribute("class")
            .unwrap_or(if parent.is_none() { "main" } else { "" });
        if name.is_empty() {
            self.fault(
                node,
                "a <default> within another one needs a name: class=\"..\"",
            );
        }
        let class = self.classes.entry(name.to_string()).or_default();
        class.parent = parent.map(String::from);
        let named: Vec<_> = node
            .children()
            .filter(|child| child.is_element() && !child.has_tag_name("default"))
            .collect();
        for child in named {
            let values = class
                .values
                .entry(child.tag_name().name().into())
                .or_default();
            for attribute in child.attributes() {
                values.insert(attribute.name().into(), attribute.value().into());
            }
        }
        // A class of its own at the top has the defaults of `main`, too.
        if parent.is_none() && name != "main" {
            class.parent = Some("main".into());
        }
        for child in children(node, "default") {
            self.class(child, Some(name));
        }
    }

    /// An attribute of an element: its own, else that of its class.
    fn value(&self, node: Node<'a, 'a>, class: &str, attribute: &str) -> Option<String> {
        if let Some(value) = node.attribute(attribute) {
            return Some(value.into());
        }
        let element = node.tag_name().name();
        let mut name = node.attribute("class").unwrap_or(class).to_string();
        for _ in 0..32 {
            let class = self.classes.get(&name)?;
            let tags = [element, "general"];
            let tags = &tags[..if ACTUATORS.contains(&element) { 2 } else { 1 }];
            let found = tags
                .iter()
                .find_map(|tag| class.values.get(*tag)?.get(attribute));
            if let Some(found) = found {
                return Some(found.clone());
            }
            name = class.parent.clone()?;
        }
        None
    }

    /// Numbers of an attribute; none where it is not there.
    fn numbers(&mut self, node: Node<'a, 'a>, class: &str, attribute: &str) -> Option<Vec<f64>> {
        let text = self.value(node, class, attribute)?;
        let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        match numbers {
            Ok(numbers) if numbers.iter().all(|number| number.is_finite()) => Some(numbers),
            _ => {
                let element = node.tag_name().name();
                self.fault(
                    node,
                    format!("<{element} {attribute}=\"{text}\">: expected finite numbers"),
                );
                None
            }
        }
    }

    fn number(&mut self, node: Node<'a, 'a>, class: &str, attribute: &str) -> Option<f64> {
        self.numbers(node, class, attribute)?.first().copied()
    }

    /// Three numbers; the default where they are not there.
    fn three(
        &mut self,
        node: Node<'a, 'a>,
        class: &str,
        attribute: &str,
        default: Vector3<f64>,
    ) -> Vector3<f64> {
        match self.numbers(node, class, attribute).as_deref() {
            None => default,
            Some([x, y, z]) => Vector3::new(*x, *y, *z),
            Some(other) => {
                let found = other.len();
                self.fault(
                    node,
                    format!("{attribute}: expected 3 numbers, found {found}"),
                );
                default
            }
        }
    }

    fn gravity(&mut self, root: Node<'a, 'a>) -> Vector3<f64> {
        let earth = Vector3::new(0.0, 0.0, -9.81);
        let option = children(root, "option").last();
        option.map_or(earth, |node| self.three(node, "", "gravity", earth))
    }

    fn angle(&self, value: f64) -> f64 {
        if self.degrees {
            value.to_radians()
        } else {
            value
        }
    }

    /// Where an element stands in the frame that it is written in.
    fn pose(&mut self, node: Node<'a, 'a>) -> Isometry3<f64> {
        let at = self.three(node, "", "pos", Vector3::zeros());
        let mut turn = UnitQuaternion::identity();
        if let Some(q) = self.numbers(node, "", "quat") {
            match q[..] {
                [w, x, y, z] if w != 0.0 || x != 0.0 || y != 0.0 || z != 0.0 => {
                    turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
                }
                _ => self.fault(node, "quat: expected 4 numbers, not all 0"),
            }
        } else if let Some(a) = self.numbers(node, "", "axisangle") {
            match a[..] {
                [x, y, z, angle] if Vector3::new(x, y, z).norm() > 0.0 => {
                    let axis = Unit::new_normalize(Vector3::new(x, y, z));
                    turn = UnitQuaternion::from_axis_angle(&axis, self.angle(angle));
                }
                _ => self.fault(node, "axisangle: expected an axis and an angle"),
            }
        } else if let Some(e) = self.numbers(node, "", "euler") {
            if e.len() != 3 || self.euler.len() != 3 {
                self.fault(node, "euler: expected 3 angles");
            }
            for (axis, angle) in self.euler.clone().chars().zip(e) {
                let unit = match axis.to_ascii_lowercase() {
                    'x' => Vector3::x_axis(),
                    'y' => Vector3::y_axis(),
                    _ => Vector3::z_axis(),
                };
                let step = UnitQuaternion::from_axis_angle(&unit, self.angle(angle));
                turn = match axis.is_lowercase() {
                    true => turn * step,
                    false => step * turn,
                };
            }
        } else if let Some(xy) = self.numbers(node, "", "xyaxes") {
            match xy[..] {
                [a, b, c, d, e, f] => {
                    let x = Vector3::new(a, b, c).normalize();
                    let y = Vector3::new(d, e, f);
                    let y = (y - x * x.dot(&y)).normalize();
                    turn = rotation(x, y);
                }
                _ => self.fault(node, "xyaxes: expected 6 numbers"),
            }
        } else if let Some(z) = self.numbers(node, "", "zaxis") {
            match z[..] {
                [x, y, z] => {
                    let to = Vector3::new(x, y, z);
                    turn =
                        UnitQuaternion::rotation_between(&Vector3::z(), &to).unwrap_or_else(|| {
                            UnitQuaternion::from_axis_angle(
                                &Vector3::x_axis(),
                                std::f64::consts::PI,
                            )
                        });
                }
                _ => self.fault(node, "zaxis: expected 3 numbers"),
            }
        }
        Isometry3::from_parts(Translation3::from(at), turn)
    }

    /// A body, the world or a frame, with all that it carries.
    fn body(
        &mut self,
        node: Node<'a, 'a>,
        place: Isometry3<f64>,
        class: &str,
        above: &[usize],
        tree: &mut Tree<'a>,
    ) {
        let class = node.attribute("childclass").unwrap_or(class).to_string();
        let mut above = above.to_vec();
        let is_body = node.has_tag_name("body");
        for child in node.children().filter(|_| is_body) {
            let name = || child.attribute("name").unwrap_or_default().to_string();
            let kind = match child.tag_name().name() {
                "freejoint" => "free".to_string(),
                "joint" => self
                    .value(child, &class, "type")
                    .unwrap_or_else(|| "hinge".into()),
                _ => continue,
            };
            let axis = self.three(child, &class, "axis", Vector3::z());
            let at = self.three(child, &class, "pos", Vector3::zeros());
            if !["free", "ball", "hinge", "slide"].contains(&&*kind) {
                self.fault(
                    child,
                    format!("joint type \"{kind}\"; allowed: hinge, slide"),
                );
            }
            if axis.norm() == 0.0 {
                self.fault(child, "axis: expected a vector that is not 0");
            }
            // Of free and ball joints the body stays as it is drawn.
            if kind == "hinge" || kind == "slide" {
                tree.joints.push(TreeJoint {
                    node: child,
                    name: name(),
                    class: class.clone(),
                    slides: kind == "slide",
                    axis: place.rotation * axis.normalize(),
                    point: place * Point3::from(at),
                    above: above.clone(),
                });
                above.push(tree.joints.len() - 1);
            } else {
                self.notes
                    .push(format!("joint {} ({kind}) is held as drawn", name()));
            }
        }
        if is_body {
            let mut own = children(node, "inertial");
            let inertial = own
                .next()
                .and_then(|inertial| self.inertial(inertial, &place));
            tree.bodies.push(TreeBody {
                name: node.attribute("name").unwrap_or("?").to_string(),
                inertial,
                above: above.clone(),
                place,
                line: self.place(node),
            });
        }
        for child in node.children().filter(Node::is_element) {
            let tag = child.tag_name().name();
            match tag {
                "body" | "frame" => {
                    let place = place * self.pose(child);
                    self.body(child, place, &class, &above, tree);
                }
                "site" => {
                    let at = place * Point3::from(self.pose(child).translation.vector);
                    let name = child.attribute("name").unwrap_or_default();
                    tree.sites.push((name.into(), at, above.clone()));
                }
                _ if COMPOSED.contains(&tag) => self.fault(
                    child,
                    format!(
                        "<{tag}> is made of others when the model is compiled, which is not read; let MuJoCo write the compiled model \
                         (mj_saveLastXML) and name that file"
                    ),
                ),
                _ => {}
            }
        }
    }

    fn inertial(&mut self, node: Node<'a, 'a>, place: &Isometry3<f64>) -> Option<Inertial> {
        let Some(mass) = self.number(node, "", "mass") else {
            self.fault(node, "<inertial> without `mass`");
            return None;
        };
        let pose = place * self.pose(node);
        let full = self.numbers(node, "", "fullinertia");
        let diagonal = self.numbers(node, "", "diaginertia");
        let own = match (full.as_deref(), diagonal.as_deref()) {
            (Some([xx, yy, zz, xy, xz, yz]), _) => {
                Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz)
            }
            (None, Some([xx, yy, zz])) => Matrix3::from_diagonal(&Vector3::new(*xx, *yy, *zz)),
            (None, None) => Matrix3::zeros(),
            _ => {
                self.fault(
                    node,
                    "<inertial>: expected 6 numbers of fullinertia or 3 of diaginertia",
                );
                return None;
            }
        };
        if mass < 0.0 {
            self.fault(node, format!("mass=\"{mass}\"; allowed: 0 and above"));
        }
        let turn = pose.rotation.to_rotation_matrix().into_inner();
        Some(Inertial {
            mass,
            centre: pose.translation.vector.into(),
            inertia: turn * own * turn.transpose(),
        })
    }

    /// The joints that move, from the base outwards.
    fn chain(
        &mut self,
        root: Node<'a, 'a>,
        tree: &Tree<'a>,
        wanted: &[String],
    ) -> Option<Vec<usize>> {
        let all: Vec<&str> = tree.joints.iter().map(|joint| &*joint.name).collect();
        let mut chain = Vec::new();
        for name in wanted {
            match all.iter().position(|other| other == name) {
                Some(joint) => chain.push(joint),
                None => {
                    let hint = did_you_mean(name, all.iter().copied());
                    self.fault(
                        root,
                        format!(
                            "no hinge or slide joint `{name}`{hint} (joints: {})",
                            listed(&all)
                        ),
                    );
                }
            }
        }
        if wanted.is_empty() {
            chain = (0..tree.joints.len()).collect();
        }
        if chain.is_empty() && self.faults.is_empty() {
            self.fault(root, "has no hinge or slide joint");
        }
        for pair in chain.windows(2) {
            let [before, after] = [&tree.joints[pair[0]], &tree.joints[pair[1]]];
            if !after.above.contains(&pair[0]) {
                let (one, other) = (&before.name, &after.name);
                self.fault(
                    after.node,
                    format!(
                        "joint `{other}` is not carried by joint `{one}`: one serial chain is simulated; name its joints from the base \
                         outwards, `joints: [..]`, the others are held (joints: {})",
                        listed(&all)
                    ),
                );
            }
        }
        (self.faults.is_empty()).then_some(chain)
    }

    /// Faults of elements that close a loop or couple joints of the chain.
    fn closed_loops(&mut self, root: Node<'a, 'a>, tree: &Tree<'a>, chain: &[usize]) {
        let moves = |name: Option<&str>| {
            chain
                .iter()
                .any(|joint| name == Some(&*tree.joints[*joint].name))
        };
        for node in children(root, "equality").flat_map(|node| node.children()) {
            let tag = node.tag_name().name();
            let off = node.attribute("active") == Some("false");
            match tag {
                "connect" | "weld" if !off => self.fault(
                    node,
                    format!("<{tag}> closes a loop; a serial chain without loops is simulated: take it out, or set active=\"false\""),
                ),
                "joint" if !off && (moves(node.attribute("joint1")) || moves(node.attribute("joint2"))) => self.fault(
                    node,
                    "<joint> of <equality> couples joints of the chain, which is not read; allowed: joints that move by themselves",
                ),
                _ => {}
            }
        }
        for node in children(root, "tendon").flat_map(|node| node.descendants()) {
            if node.has_tag_name("joint") && moves(node.attribute("joint")) {
                self.fault(node, "a tendon on a joint of the chain is not read");
            }
        }
    }

    /// What each joint carries up to the next, as one body.
    fn links(&mut self, tree: &Tree<'a>, chain: &[usize]) -> Vec<Inertial> {
        let mut links = Vec::new();
        for (at, joint) in chain.iter().enumerate() {
            let next = chain.get(at + 1);
            let own = tree.bodies.iter().filter(|body| {
                body.above.contains(joint) && next.is_none_or(|next| !body.above.contains(next))
            });
            let mut link = Inertial {
                mass: 0.0,
                centre: tree.joints[*joint].point,
                inertia: Matrix3::zeros(),
            };
            for body in own {
                match &body.inertial {
                    Some(more) => link = joined(&link, more),
                    None => self.faults.push(Fault::new(
                        &*body.line,
                        format!(
                            "body `{}` has no <inertial>, and inertials from geoms are not computed; let MuJoCo write the compiled model \
                             (mj_saveLastXML) and name that file",
                            body.name
                        ),
                    )),
                }
            }
            links.push(link);
        }
        links
    }

    /// A joint of the chain with its actuators.
    fn joint(&mut self, root: Node<'a, 'a>, joint: &TreeJoint<'a>) -> MjcfJoint {
        let (node, class) = (joint.node, &*joint.class);
        let angular = |reader: &Self, value: f64| match joint.slides {
            true => value,
            false => reader.angle(value),
        };
        if let Some(pair) = self.value(node, class, "springdamper")
            && pair.split_whitespace().any(|number| number != "0")
        {
            self.fault(
                node,
                "springdamper is made of masses when the model is compiled; allowed: stiffness and damping",
            );
        }
        for name in ["damping", "stiffness"] {
            let more = self.numbers(node, class, name).unwrap_or_default();
            if more.iter().skip(1).any(|number| *number != 0.0) {
                self.fault(
                    node,
                    format!("{name}: one number is read, found a polynomial"),
                );
            }
        }
        let mut of = |name: &str| self.number(node, class, name).unwrap_or_default();
        let [damping, armature, friction, stiffness] =
            ["damping", "armature", "frictionloss", "stiffness"].map(&mut of);
        let [reference, spring] = ["ref", "springref"].map(&mut of);
        for (name, value) in [
            ("damping", damping),
            ("armature", armature),
            ("frictionloss", friction),
        ] {
            if value < 0.0 {
                self.fault(node, format!("{name}=\"{value}\"; allowed: 0 and above"));
            }
        }
        let most = self.range(node, class, "actuatorfrcrange", "actuatorfrclimited");
        MjcfJoint {
            name: joint.name.clone(),
            reference: angular(self, reference),
            damping,
            armature,
            friction,
            stiffness,
            spring_reference: angular(self, spring),
            servo: self.servo(root, &joint.name, most),
        }
    }

    /// The larger end of a range that is in force.
    fn range(
        &mut self,
        node: Node<'a, 'a>,
        class: &str,
        range: &str,
        limited: &str,
    ) -> Option<f64> {
        let off = self.value(node, class, limited).as_deref() == Some("false");
        let range = self.numbers(node, class, range).filter(|_| !off)?;
        match range[..] {
            [low, high] if low < high => {
                if (low + high).abs() > 1e-9 * high.abs() {
                    let element = node.tag_name().name();
                    self.fault(node, format!("<{element}>: a range of forces that is not symmetric ({low} to {high}) is not read"));
                }
                Some(high)
            }
            _ => None,
        }
    }

    /// What the actuators of a joint do together.
    fn servo(&mut self, root: Node<'a, 'a>, name: &str, most: Option<f64>) -> Option<Servo> {
        let all = children(root, "actuator").flat_map(|node| node.children());
        let own: Vec<Node> = all
            .filter(|node| node.is_element())
            .filter(|node| {
                [node.attribute("joint"), node.attribute("jointinparent")].contains(&Some(name))
            })
            .collect();
        let mut sum: Option<Servo> = None;
        for node in own {
            let tag = node.tag_name().name();
            if !ACTUATORS.contains(&tag) {
                self.fault(
                    node,
                    format!(
                        "an actuator <{tag}> of joint `{name}` is not read; allowed: {}",
                        listed(ACTUATORS)
                    ),
                );
                continue;
            }
            let get = |reader: &mut Self, attribute: &str| reader.number(node, "main", attribute);
            let text = |reader: &Self, attribute: &str| reader.value(node, "main", attribute);
            let gear = get(self, "gear").unwrap_or(1.0);
            for (attribute, neutral) in [("dyntype", "none"), ("gaintype", "fixed")] {
                let value = text(self, attribute).unwrap_or_else(|| neutral.into());
                if value != neutral {
                    self.fault(node, format!("{attribute}=\"{value}\" of joint `{name}` is not read; allowed: {neutral}"));
                }
            }
            for attribute in ["timeconst", "dampratio", "delay"] {
                if get(self, attribute).is_some_and(|value| value != 0.0) {
                    self.fault(node, format!("{attribute} of an actuator of joint `{name}` is not read; allowed: 0, with the gain and damping stated (kp, kv)"));
                }
            }
            let (kp, kd) = match tag {
                "position" => (
                    get(self, "kp").unwrap_or(1.0),
                    get(self, "kv").unwrap_or(0.0),
                ),
                "velocity" => (0.0, get(self, "kv").unwrap_or(1.0)),
                "general" => {
                    let gain = get(self, "gainprm").unwrap_or(1.0);
                    let bias = self.numbers(node, "main", "biasprm").unwrap_or_default();
                    let bias = |k: usize| bias.get(k).copied().unwrap_or_default();
                    match text(self, "biastype").as_deref().unwrap_or("none") {
                        "none" => (0.0, 0.0),
                        "affine"
                            if bias(0) == 0.0 && (gain + bias(1)).abs() <= 1e-9 * gain.abs() =>
                        {
                            (gain, -bias(2))
                        }
                        "affine" => {
                            self.fault(node, format!("<general> of joint `{name}`: expected a position servo, gainprm=\"kp\" biasprm=\"0 -kp -kv\""));
                            continue;
                        }
                        other => {
                            self.fault(node, format!("biastype=\"{other}\" of joint `{name}` is not read; allowed: none, affine"));
                            continue;
                        }
                    }
                }
                _ => (0.0, 0.0),
            };
            let limit = self.range(node, "main", "forcerange", "forcelimited");
            let limit = limit.map_or(f64::INFINITY, |force| force * gear.abs());
            let limit = limit.min(most.unwrap_or(f64::INFINITY));
            if tag == "position" && gear != 1.0 {
                self.fault(
                    node,
                    format!(
                        "gear of a position actuator of joint `{name}` is not read; allowed: 1"
                    ),
                );
            }
            let before = sum.unwrap_or(Servo {
                kp: 0.0,
                kd: 0.0,
                limit: f64::INFINITY,
            });
            sum = Some(Servo {
                kp: before.kp + kp,
                kd: before.kd + kd,
                limit: before.limit.min(limit),
            });
        }
        sum.filter(|servo| servo.kp > 0.0)
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

/// Two bodies as one.
pub(crate) fn joined(a: &Inertial, b: &Inertial) -> Inertial {
    let mass = a.mass + b.mass;
    if mass <= 0.0 {
        return *a;
    }
    let centre: Point3<f64> = ((a.centre.coords * a.mass + b.centre.coords * b.mass) / mass).into();
    let about = |body: &Inertial| {
        let arm = body.centre - centre;
        body.inertia
            + (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * body.mass
    };
    Inertial {
        mass,
        centre,
        inertia: about(a) + about(b),
    }
}
