//! The chain that moves: its joints, links and actuators.

use super::{ACTUATORS, MjcfJoint, Reader, Servo, Tree, TreeJoint, children};
use calib_dynamics::Inertial;
use calib_numerics::error::{Fault, did_you_mean, listed};
use nalgebra::Matrix3;
use roxmltree::Node;

impl<'a> Reader<'a> {
    /// The joints that move, from the base outwards.
    pub(super) fn chain(
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
    pub(super) fn closed_loops(&mut self, root: Node<'a, 'a>, tree: &Tree<'a>, chain: &[usize]) {
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
    pub(super) fn links(&mut self, tree: &Tree<'a>, chain: &[usize]) -> Vec<Inertial> {
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
                    Some(more) => link = link.joined(more),
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
    pub(super) fn joint(&mut self, root: Node<'a, 'a>, joint: &TreeJoint<'a>) -> MjcfJoint {
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
        let range = self.numbers(node, class, "range");
        let range = range.and_then(|range| match range[..] {
            [low, high] if low < high => Some([angular(self, low), angular(self, high)]),
            _ => None,
        });
        MjcfJoint {
            name: joint.name.clone(),
            range,
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
    pub(super) fn range(
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
    pub(super) fn servo(
        &mut self,
        root: Node<'a, 'a>,
        name: &str,
        most: Option<f64>,
    ) -> Option<Servo> {
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
