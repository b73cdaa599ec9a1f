//! Mass, centre and inertia of a link as formats of rigid bodies write them: identified where torques show them, else as declared.

use super::Export;
use super::model::{PLACEHOLDER, placeholder_inertia};
use crate::dynamics::Inertial;

/// A body in a frame at its joint's point, parallel to the base at the zero pose.
pub(super) struct LinkBody {
    /// kg.
    pub mass: f64,
    /// m, from the joint's point.
    pub centre: [f64; 3],
    /// kg m2 about the centre: xx, xy, xz, yy, yz, zz.
    pub inertia: [f64; 6],
    /// What is to be said of it.
    pub remark: Option<&'static str>,
}

impl LinkBody {
    /// Whether the inertia stands for one that is not known.
    pub fn is_placeholder(&self) -> bool {
        self.remark == Some(PLACEHOLDER)
    }
}

impl Export {
    /// The body that joint `index` (from 0) moves; none where it has no mass.
    pub(super) fn body(&self, index: usize) -> Option<LinkBody> {
        if let Some((body, own)) = self
            .identified
            .torques
            .as_ref()
            .and_then(|torques| torques.model.nearest_body(index))
        {
            return Some(identified(
                &body,
                own,
                index + 1 == self.corrected.joints.len(),
            ));
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
fn identified(body: &Inertial, own: bool, last: bool) -> LinkBody {
    let remark = match (last, own) {
        (true, true) => "as the torques show it, payload included",
        (false, true) => "as the torques show it",
        (true, false) => {
            "as the torques show it, payload included; its inertia is that of the nearest body"
        }
        (false, false) => "as the torques show it; its inertia is that of the nearest body",
    };
    let i = &body.inertia;
    let inertia = [
        i[(0, 0)],
        i[(0, 1)],
        i[(0, 2)],
        i[(1, 1)],
        i[(1, 2)],
        i[(2, 2)],
    ];
    LinkBody {
        mass: body.mass,
        centre: body.centre.into(),
        inertia,
        remark: Some(remark),
    }
}
