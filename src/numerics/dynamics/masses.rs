//! The links of an arm with the masses that its torques show, for those who ask what gravity does to it at rest.
//!
//! Base parameters stand for many arms of the same torques. A mass at a joint's point belongs to the link before as much as to the link
//! itself, so that any mass may be written to a link when the links before it give it back; gravity is the same. A link keeps the mass that
//! is declared for it, and its centre is where the torques need it.
//!
//! Whether inertial numbers are those of a body: mass above zero, and mass spread about its centre in every direction. That is the
//! condition that the pseudo-inertia be positive (Wensing, Kim, Slotine, RA-L 2018).

use super::arm::{
    DynamicArm, INERTIAL_NUMBERS, Inertial, add_body, inertia_matrix, numbers, steiner,
};
use super::model::TorqueModel;
use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector3};

/// A link as torques show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkFromTorques {
    /// kg; as declared where base parameters alone are identified.
    pub mass: f64,
    /// m, base frame at zero pose.
    pub centre: Point3<f64>,
    /// kg m^2 about the centre, base axes at zero pose: of the nearest body; `None` where base parameters alone are identified.
    pub inertia: Option<Matrix3<f64>>,
}

impl TorqueModel {
    /// The links (n) of the arm that the model was identified on, without the payload that it declares. `masses` (n, kg, above 0): what is
    /// declared of each link, or what it shall have where nothing is.
    pub fn links(&self, arm: &DynamicArm, masses: &[f64]) -> Vec<LinkFromTorques> {
        let n = self.joints();
        let point = |link: usize| arm.points[link].coords;
        let mut theta = self.inertials.clone();
        if let Some(payload) = &arm.payload {
            add_body(&mut theta, n - 1, -1.0, &numbers(payload, &point(n - 1)));
        }
        let mut links = Vec::with_capacity(n);
        for link in (0..n).rev() {
            let whole = self.is_whole(link) && theta[INERTIAL_NUMBERS * link] > 0.0;
            let (before, body) = theta.split_at_mut(INERTIAL_NUMBERS * link);
            if !whole {
                let moved = masses[link] - body[0];
                body[0] = masses[link];
                if let Some(first) = link.checked_sub(1) {
                    // A point mass at this joint, seen from the joint before.
                    let there = Inertial {
                        mass: moved,
                        centre: Point3::from(point(link)),
                        inertia: Matrix3::zeros(),
                    };
                    add_body(before, first, -1.0, &numbers(&there, &point(first)));
                }
            }
            let ten = &body[..INERTIAL_NUMBERS];
            let centre = Point3::from(point(link) + Vector3::new(ten[1], ten[2], ten[3]) / ten[0]);
            links.push(LinkFromTorques {
                mass: ten[0],
                centre,
                inertia: whole.then(|| nearest(ten).0.inertia),
            });
        }
        links.reverse();
        links
    }
}

/// Mass below which there is no centre, kg.
const LIGHTEST: f64 = 1e-9;
/// Least second moment (m2) that a nearest body is given, as a share of its mass.
const LEAST_SPREAD: f64 = 1e-4;
/// Step of a derivative, as a share of a number's standard deviation.
const STEP: f64 = 1e-3;

/// The spread of a link's mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyConsistency {
    /// From 0; the last carries the payload.
    pub link: usize,
    /// kg.
    pub mass: f64,
    /// Second moment of mass about the centre along the direction in which it is least, kg m^2; negative: no body has such numbers.
    pub spread: f64,
    /// One standard deviation of the spread; `None` where the covariance is not known.
    pub sigma: Option<f64>,
}

impl BodyConsistency {
    /// Whether a body with these numbers exists.
    pub fn is_consistent(&self) -> bool {
        self.mass > 0.0 && self.spread >= 0.0
    }
}

impl TorqueModel {
    /// The consistency of the links whose ten numbers are all identified.
    pub fn consistency(&self) -> Vec<BodyConsistency> {
        (0..self.joints())
            .filter(|link| self.is_whole(*link))
            .map(|link| self.consistency_of(link))
            .collect()
    }

    /// A link as a body, m from its joint's point; `None` where its numbers are no body's.
    pub fn body(&self, link: usize) -> Option<Inertial> {
        let whole = self.is_whole(link) && self.consistency_of(link).is_consistent();
        whole.then(|| body_of(self.ten(link)))
    }

    /// A link as the body nearest to its numbers, with their mass and centre, m from its joint's point, and whether it is theirs; `None`
    /// where they are not all identified or have no mass.
    pub fn nearest_body(&self, link: usize) -> Option<(Inertial, bool)> {
        let ten = self
            .is_whole(link)
            .then(|| self.ten(link))
            .filter(|ten| ten[0] > 0.0)?;
        Some(nearest(ten))
    }

    /// The ten numbers of a link.
    pub(crate) fn ten(&self, link: usize) -> &[f64] {
        &self.inertials[INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)]
    }

    /// Covariance of a link's ten numbers; `None` where it is not known.
    pub(crate) fn covariance_of(&self, link: usize) -> Option<DMatrix<f64>> {
        let whole = self.is_whole(link) && !self.covariance.is_empty();
        let width = (self.covariance.len() as f64).sqrt().round() as usize;
        let before = self.identified[..INERTIAL_NUMBERS * link].iter();
        let first = before.filter(|known| **known).count();
        let entry =
            |row: usize, column: usize| self.covariance[(first + row) * width + first + column];
        whole.then(|| DMatrix::from_fn(INERTIAL_NUMBERS, INERTIAL_NUMBERS, entry))
    }

    fn consistency_of(&self, link: usize) -> BodyConsistency {
        let ten = self.ten(link);
        let sigma = self.covariance_of(link).map(|covariance| {
            let slope = DVector::from_fn(INERTIAL_NUMBERS, |number, _| {
                let step = STEP * covariance[(number, number)].max(0.0).sqrt();
                let mut moved = ten.to_vec();
                moved[number] += step;
                match step > 0.0 {
                    true => (spread(&moved) - spread(ten)) / step,
                    false => 0.0,
                }
            });
            slope.dot(&(&covariance * &slope)).max(0.0).sqrt()
        });
        BodyConsistency {
            link,
            mass: ten[0],
            spread: spread(ten),
            sigma,
        }
    }
}

/// The body nearest to numbers with a mass, and whether it is theirs.
pub(super) fn nearest(ten: &[f64]) -> (Inertial, bool) {
    let body = body_of(ten);
    let moments = second_moments(&body).symmetric_eigen();
    if moments.eigenvalues.min() >= 0.0 {
        return (body, true);
    }
    let kept = moments.eigenvalues;
    let kept = Matrix3::from_diagonal(&kept.map(|moment| moment.max(LEAST_SPREAD * body.mass)));
    let spread = moments.eigenvectors * kept * moments.eigenvectors.transpose();
    (
        Inertial {
            inertia: Matrix3::identity() * spread.trace() - spread,
            ..body
        },
        false,
    )
}

/// Least second moment of mass about the centre.
fn spread(ten: &[f64]) -> f64 {
    second_moments(&body_of(ten)).symmetric_eigenvalues().min()
}

/// Second moments of mass about the centre.
fn second_moments(body: &Inertial) -> Matrix3<f64> {
    Matrix3::identity() * (0.5 * body.inertia.trace()) - body.inertia
}

/// Mass, centre from the joint's point and inertia about the centre.
fn body_of(ten: &[f64]) -> Inertial {
    let mass = match ten[0].abs() < LIGHTEST {
        true => LIGHTEST,
        false => ten[0],
    };
    let arm = Vector3::new(ten[1], ten[2], ten[3]) / mass;
    Inertial {
        mass,
        centre: Point3::from(arm),
        inertia: inertia_matrix(&ten[4..]) - steiner(mass, &arm),
    }
}

/// The ten numbers of a body whose centre is given from the joint's point.
pub fn inertial_numbers(body: &Inertial) -> [f64; INERTIAL_NUMBERS] {
    numbers(body, &Vector3::zeros())
}

#[cfg(test)]
mod tests {
    use super::super::arm::DeclaredInertials;
    use super::super::cases::arm;
    use super::super::model::JointRange;
    use super::super::newton_euler::at_rest;
    use super::*;

    fn model(inertials: Vec<f64>, identified: Vec<bool>) -> TorqueModel {
        TorqueModel {
            range: vec![JointRange::default(); inertials.len() / 10],
            inertials,
            identified,
            ..TorqueModel::default()
        }
    }

    /// Gravity's torques with the arm's own payload.
    fn gravity(arm: &DynamicArm, links: &[Inertial], position: &[f64]) -> Vec<f64> {
        at_rest(arm, &DeclaredInertials::of(arm, links).theta)(position)
    }

    #[test]
    fn links_of_base_parameters_keep_their_masses_and_have_the_gravity_of_the_arm() {
        let arm = arm();
        let bodies = arm.links.clone().expect("links");
        let mut theta = DeclaredInertials::of(&arm, &bodies).theta;
        // Base parameters: no link has a mass of its own, the links before carry what the masses did at their joints.
        for link in (1..4).rev() {
            let point = Inertial {
                mass: theta[10 * link],
                centre: arm.points[link],
                inertia: Matrix3::zeros(),
            };
            let ten = numbers(&point, &arm.points[link - 1].coords);
            add_body(&mut theta, link - 1, 1.0, &ten);
            theta[10 * link] = 0.0;
        }
        let links = model(theta, vec![false; 40]).links(&arm, &[15.0, 9.0, 7.0, 1.0]);
        assert_eq!(
            links.iter().map(|link| link.mass).collect::<Vec<_>>(),
            [15.0, 9.0, 7.0, 1.0]
        );
        let found = links.iter().map(|link| Inertial {
            mass: link.mass,
            centre: link.centre,
            inertia: Matrix3::zeros(),
        });
        let found: Vec<Inertial> = found.collect();
        for position in [[0.0; 4], [0.3, -0.7, 1.1, 0.4], [-1.0, 0.9, -0.5, 2.0]] {
            let [estimated, truth] =
                [&found, &bodies].map(|bodies| gravity(&arm, bodies, &position));
            let mut pairs = estimated.iter().zip(&truth);
            assert!(
                pairs.all(|(a, b)| (a - b).abs() < 1e-10),
                "{estimated:?} {truth:?}"
            );
        }
    }

    #[test]
    fn links_that_are_identified_whole_are_told_as_they_are_without_the_payload() {
        let arm = arm();
        let bodies = arm.links.clone().expect("links");
        let theta = DeclaredInertials::of(&arm, &bodies).theta;
        let links = model(theta, vec![true; 40]).links(&arm, &[1.0; 4]);
        for (link, body) in links.iter().zip(&bodies) {
            assert!(
                (link.mass - body.mass).abs() < 1e-12 && (link.centre - body.centre).norm() < 1e-12
            );
            assert!((link.inertia.expect("whole") - body.inertia).norm() < 1e-10);
        }
    }

    #[test]
    fn numbers_of_no_body_become_those_of_the_nearest_with_the_same_mass_and_centre() {
        // A rod along x of 3 kg whose moment about its own axis is negative.
        let (body, is_given) = nearest(&[
            3.0,
            0.3,
            0.0,
            0.0,
            -0.01,
            0.0,
            0.0,
            0.05 + 0.03,
            0.0,
            0.05 + 0.03,
        ]);
        assert!(
            (body.centre - Point3::new(0.1, 0.0, 0.0)).norm() < 1e-15
                && body.mass == 3.0
                && !is_given
        );
        let [xx, yy, zz] = [0, 1, 2].map(|k| body.inertia[(k, k)]);
        assert!(
            xx > 0.0 && xx + yy >= zz && xx + zz >= yy && yy + zz >= xx,
            "{}",
            body.inertia
        );
        let (right, is_given) = nearest(&[3.0, 0.3, 0.0, 0.0, 0.01, 0.0, 0.0, 0.08, 0.0, 0.08]);
        assert!(
            is_given
                && (right.inertia[(0, 0)] - 0.01).abs() < 1e-12
                && (right.inertia[(1, 1)] - 0.05).abs() < 1e-12
        );
    }

    #[test]
    fn a_ball_has_its_spread_and_a_hollow_impossible_body_none() {
        // A solid ball of 2 kg and 0.1 m: inertia 2/5 m r^2, second moment m r^2 / 5 along every direction.
        let ball = Inertial {
            mass: 2.0,
            centre: Point3::new(0.3, -0.1, 0.2),
            inertia: Matrix3::identity() * 0.008,
        };
        let mut ten = inertial_numbers(&ball).to_vec();
        assert!((spread(&ten) - 0.004).abs() < 1e-12);
        let body = body_of(&ten);
        assert!(
            (body.centre - ball.centre).norm() < 1e-12
                && (body.inertia - ball.inertia).norm() < 1e-12
        );
        // More about z than about x and y together: no mass is spread so.
        ten[9] += 0.02;
        assert!(spread(&ten) < 0.0);
    }
}
