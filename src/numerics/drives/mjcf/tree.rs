//! Bodies of the tree at the reference pose, with what they weigh.

use super::{COMPOSED, Reader, Tree, TreeBody, TreeJoint, children};
use calib_dynamics::Inertial;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use roxmltree::Node;

impl<'a> Reader<'a> {
    /// A body, the world or a frame, with all that it carries.
    pub(super) fn body(
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

    pub(super) fn inertial(
        &mut self,
        node: Node<'a, 'a>,
        place: &Isometry3<f64>,
    ) -> Option<Inertial> {
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
}
