//! Mass, centre and inertia of a link as formats of rigid bodies write them: identified where torques show them, else as declared.

use super::Export;
use super::model::{PLACEHOLDER, placeholder_inertia};
use nalgebra::{Matrix3, Vector3};

/// Of the mass times the square of the distance (m2): the least second moment that a body is given.
const LEAST_SPREAD: f64 = 1e-4;

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
        let whole = self.identified.torques.as_ref().filter(|torques| torques.model.is_whole(index));
        if let Some(ten) = whole.map(|torques| torques.model.ten(index)).filter(|ten| ten[0] > 0.0) {
            return Some(identified(ten, index + 1 == self.corrected.joints.len()));
        }
        let joint = &self.corrected.joints[index];
        let (mass, centre) = joint.mass.filter(|mass| *mass > 0.0).zip(joint.centre)?;
        let declared = self.corrected.inertias.links.get(index).copied().flatten();
        let ball = placeholder_inertia(mass);
        let inertia = declared.unwrap_or([ball, 0.0, 0.0, ball, 0.0, ball]);
        let centre = std::array::from_fn(|axis| centre[axis] - joint.point[axis]);
        Some(LinkBody { mass, centre, inertia, remark: declared.is_none().then_some(PLACEHOLDER) })
    }
}

/// The body of ten identified numbers; where no body has its inertia, the nearest that has.
fn identified(ten: &[f64], last: bool) -> LinkBody {
    let mass = ten[0];
    let centre = Vector3::new(ten[1], ten[2], ten[3]) / mass;
    let about_point = Matrix3::new(ten[4], ten[5], ten[6], ten[5], ten[7], ten[8], ten[6], ten[8], ten[9]);
    let about = about_point - (Matrix3::identity() * centre.norm_squared() - centre * centre.transpose()) * mass;
    // Second moments of mass about the centre: those of a body are positive along every direction.
    let moments = (Matrix3::identity() * (0.5 * about.trace()) - about).symmetric_eigen();
    let least = LEAST_SPREAD * mass;
    let consistent = moments.eigenvalues.min() >= 0.0;
    let about = match consistent {
        true => about,
        false => {
            let kept = Matrix3::from_diagonal(&moments.eigenvalues.map(|moment| moment.max(least)));
            let spread = moments.eigenvectors * kept * moments.eigenvectors.transpose();
            Matrix3::identity() * spread.trace() - spread
        }
    };
    let remark = match (last, consistent) {
        (true, true) => "as the torques show it, payload included",
        (false, true) => "as the torques show it",
        (true, false) => "as the torques show it, payload included; its inertia is that of the nearest body",
        (false, false) => "as the torques show it; its inertia is that of the nearest body",
    };
    let inertia = [about[(0, 0)], about[(0, 1)], about[(0, 2)], about[(1, 1)], about[(1, 2)], about[(2, 2)]];
    LinkBody { mass, centre: centre.into(), inertia, remark: Some(remark) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_no_body_become_those_of_the_nearest_with_the_same_mass_and_centre() {
        // A rod along x of 3 kg whose moment about its own axis is negative.
        let ten = [3.0, 0.3, 0.0, 0.0, -0.01, 0.0, 0.0, 0.05 + 0.03, 0.0, 0.05 + 0.03];
        let body = identified(&ten, false);
        assert_eq!((body.mass, body.centre), (3.0, [0.1, 0.0, 0.0]));
        assert!(body.remark.is_some_and(|remark| remark.contains("nearest")));
        let [xx, _, _, yy, _, zz] = body.inertia;
        assert!(xx > 0.0 && xx + yy >= zz && xx + zz >= yy && yy + zz >= xx, "{:?}", body.inertia);
        let right = identified(&[3.0, 0.3, 0.0, 0.0, 0.01, 0.0, 0.0, 0.08, 0.0, 0.08], true);
        assert!((right.inertia[0] - 0.01).abs() < 1e-12 && (right.inertia[3] - 0.05).abs() < 1e-12);
    }
}
