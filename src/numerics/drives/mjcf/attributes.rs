//! Numbers of elements: attributes with defaults by class, units of the compiler, poses.

use super::{ACTUATORS, Reader, children, rotation};
use calib_numerics::error::Result;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::Node;

impl<'a> Reader<'a> {
    pub(super) fn compiler(&mut self, root: Node<'a, 'a>) {
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
    pub(super) fn class(&mut self, node: Node<'a, 'a>, parent: Option<&str>) {
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
    pub(super) fn value(&self, node: Node<'a, 'a>, class: &str, attribute: &str) -> Option<String> {
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
    pub(super) fn numbers(
        &mut self,
        node: Node<'a, 'a>,
        class: &str,
        attribute: &str,
    ) -> Option<Vec<f64>> {
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

    pub(super) fn number(
        &mut self,
        node: Node<'a, 'a>,
        class: &str,
        attribute: &str,
    ) -> Option<f64> {
        self.numbers(node, class, attribute)?.first().copied()
    }

    /// Three numbers; the default where they are not there.
    pub(super) fn three(
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

    pub(super) fn gravity(&mut self, root: Node<'a, 'a>) -> Vector3<f64> {
        let earth = Vector3::new(0.0, 0.0, -9.81);
        let option = children(root, "option").last();
        option.map_or(earth, |node| self.three(node, "", "gravity", earth))
    }

    pub(super) fn angle(&self, value: f64) -> f64 {
        if self.degrees {
            value.to_radians()
        } else {
            value
        }
    }

    /// Where an element stands in the frame that it is written in.
    pub(super) fn pose(&mut self, node: Node<'a, 'a>) -> Isometry3<f64> {
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
}
