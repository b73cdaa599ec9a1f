//! Mass, centre and inertia of a link as formats of rigid bodies write them: identified where torques show them, else as declared.

use super::Export;
use crate::description::{JointDescription, JointKind};
use crate::dynamics::Inertial;
use crate::error::{Error, Result};
use crate::spatial::Pose;
use minijinja::{UndefinedBehavior, Value};
use nalgebra::{Matrix3, Rotation3, Vector3};
use quick_xml::escape::escape;

/// The remark on [`placeholder_inertia`].
const PLACEHOLDER: &str = "the inertia is a placeholder: it is neither declared nor identified";

/// The inertia of a ball of 0.1 m, kg m2.
fn placeholder_inertia(mass: f64) -> f64 {
    0.4 * mass * 0.01
}

/// A body in a frame at its joint's point, parallel to the base at the zero pose.
pub(super) struct LinkBody {
    /// kg.
    pub(crate) mass: f64,
    /// m, from the joint's point.
    pub(crate) centre: [f64; 3],
    /// kg m2 about the centre: xx, xy, xz, yy, yz, zz.
    pub(crate) inertia: [f64; 6],
    /// What is to be said of it.
    pub(crate) remark: Option<&'static str>,
}

impl LinkBody {
    /// Whether the inertia stands for one that is not known.
    pub(crate) fn is_placeholder(&self) -> bool {
        self.remark == Some(PLACEHOLDER)
    }
}

impl Export {
    /// The body that joint `index` (from 0) moves; none where it has no mass.
    pub(super) fn body(&self, index: usize) -> Option<LinkBody> {
        let torques = self.identified.torques.as_ref();
        let nearest = torques.and_then(|torques| torques.model.nearest_body(index));
        if let Some((body, is_identified)) = nearest {
            let last = index + 1 == self.corrected.joints.len();
            return Some(identified(&body, is_identified, last));
        }
        let joint = &self.corrected.joints[index];
        let (mass, centre) = joint.mass.filter(|mass| *mass > 0.0).zip(joint.centre)?;
        let declared = self.corrected.inertias.links.get(index).copied().flatten();
        let ball = placeholder_inertia(mass);
        let inertia = declared.unwrap_or([ball, 0.0, 0.0, ball, 0.0, ball]);
        let centre = std::array::from_fn(|axis| centre[axis] - joint.point[axis]);
        Some(LinkBody {
            mass,
            centre,
            inertia,
            remark: declared.is_none().then_some(PLACEHOLDER),
        })
    }
}

/// An identified body; `own`: it is no nearest one.
fn identified(body: &Inertial, is_identified: bool, last: bool) -> LinkBody {
    let remark = match (last, is_identified) {
        (true, true) => "as the torques show it, payload included",
        (false, true) => "as the torques show it",
        (true, false) => {
            "as the torques show it, payload included; its inertia is that of the nearest body"
        }
        (false, false) => "as the torques show it; its inertia is that of the nearest body",
    };
    let i = &body.inertia;
    let moments = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    LinkBody {
        mass: body.mass,
        centre: body.centre.into(),
        inertia: moments.map(|place| i[place]),
        remark: Some(remark),
    }
}

/// A joint's frame, whose axis is `nominal` in the base frame, on the corrected axis: turned from the one axis to the other, its origin at
/// the point nearest to where it was.
pub(super) fn moved(frame: &Pose, nominal: &Vector3<f64>, corrected: &JointDescription) -> Pose {
    let axis = Vector3::from(corrected.axis);
    // By the arc tangent: an arc cosine near 1 loses half of the digits.
    let normal = nominal.cross(&axis);
    let sine = normal.norm();
    let turn = if sine > 0.0 {
        Rotation3::new(normal * (sine.atan2(nominal.dot(&axis)) / sine))
    } else {
        Rotation3::identity()
    };
    let point = Vector3::from(corrected.point);
    let origin = match corrected.kind {
        JointKind::Revolute => point + axis * axis.dot(&(frame.translation - point)),
        JointKind::Prismatic => frame.translation,
    };
    Pose::new(turn.into_inner() * frame.rotation, origin)
}

/// Place and turn of a frame seen from another as URDF writes them: m, and roll, pitch and yaw, rad.
pub(super) fn origin(from: &Pose, to: &Pose) -> ([f64; 3], [f64; 3]) {
    let between = from.inverse() * *to;
    let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(between.rotation).euler_angles();
    (between.translation.into(), [roll, pitch, yaw])
}

/// The pose of a tool: its rotation by rows, and its point.
pub(super) fn tool(point: [f64; 3], rows: &[[f64; 3]; 3]) -> Pose {
    Pose::new(Matrix3::from_fn(|i, k| rows[i][k]), point.into())
}

/// A document of XML: the remarks as comments, then the template with its values. Names in attributes go through its filter `xml`.
pub(super) fn document(remarks: &[String], template: &str, values: Value) -> Result<String> {
    let mut environment = crate::text::environment();
    environment.set_undefined_behavior(UndefinedBehavior::SemiStrict);
    environment.add_filter("xml", |text: &str| escape(text).into_owned());
    let head = comments(remarks);
    let body = environment
        .render_str(template, values)
        .map_err(|error| Error::Bug(error.to_string()))?;
    Ok(format!("<?xml version=\"1.0\"?>\n{head}{body}"))
}

/// A comment a line.
pub(super) fn comments(remarks: &[String]) -> String {
    // Two hyphens would end a comment; of three, the first pass leaves two.
    let comment = |line: &String| {
        let line = line.replace("--", "- -").replace("--", "- -");
        format!("<!-- {line} -->\n")
    };
    remarks.iter().map(comment).collect()
}

/// Numbers with blanks between them, each the shortest text that reads as the same number.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    let texts = values.into_iter().map(|value| format!("{value:?}"));
    texts.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hyphens_of_a_name_end_no_comment() {
        for name in ["a--b", "---", "-----", "-", "<!-- -->"] {
            let text = document(&[name.to_string()], "<robot/>", Value::UNDEFINED).unwrap();
            let read = roxmltree::Document::parse(&text)
                .unwrap_or_else(|error| panic!("{error} in {text}"));
            assert_eq!(read.root_element().tag_name().name(), "robot");
        }
    }

    #[test]
    fn numbers_read_back_as_they_are() {
        let values = [0.1 + 0.2, -0.0, 1e-300, 1594.0];
        let read = numbers(values)
            .split(' ')
            .map(|number| number.parse::<f64>().unwrap().to_bits())
            .collect::<Vec<_>>();
        assert_eq!(read, values.map(f64::to_bits));
    }
}
