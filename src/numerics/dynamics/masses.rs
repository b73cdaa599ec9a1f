//! The links of an arm with the masses that its torques show, for those who ask what gravity does to it at rest.
//!
//! Base parameters stand for many arms of the same torques. A mass at a joint's point belongs to the link before as much as to the link
//! itself, so that any mass may be written to a link when the links before it give it back; gravity is the same. A link keeps the mass that
//! is declared for it, and its centre is where the torques need it.

use super::arm::INERTIAL_NUMBERS;
use super::arm::numbers;
use super::arm::{DynamicArm, Inertial};
use super::consistency::nearest;
use super::model::TorqueModel;
use nalgebra::{Matrix3, Point3, Vector3};

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
            let own = numbers(payload, &point(n - 1));
            theta[INERTIAL_NUMBERS * (n - 1)..]
                .iter_mut()
                .zip(own)
                .for_each(|(sum, value)| *sum -= value);
        }
        let mut links = Vec::with_capacity(n);
        for link in (0..n).rev() {
            let whole = self.is_whole(link) && theta[INERTIAL_NUMBERS * link] > 0.0;
            let (before, own) = theta.split_at_mut(INERTIAL_NUMBERS * link);
            if !whole {
                let moved = masses[link] - own[0];
                own[0] = masses[link];
                if let Some(first) = link.checked_sub(1) {
                    // A point mass at this joint, seen from the joint before.
                    let there = Inertial {
                        mass: moved,
                        centre: Point3::from(point(link)),
                        inertia: Matrix3::zeros(),
                    };
                    let ten = numbers(&there, &point(first));
                    before[INERTIAL_NUMBERS * first..]
                        .iter_mut()
                        .zip(ten)
                        .for_each(|(sum, value)| *sum -= value);
                }
            }
            let ten = &own[..INERTIAL_NUMBERS];
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

#[cfg(test)]
mod tests {
    use super::super::arm::DeclaredInertials;
    use super::super::cases::arm;
    use super::super::model::JointRange;
    use super::super::newton_euler::{InverseDynamics, MotionRow};
    use super::*;

    fn model(inertials: Vec<f64>, identified: Vec<bool>) -> TorqueModel {
        let seen = JointRange {
            position: [-1.0, 1.0],
            speed: 1.0,
            acceleration: 1.0,
            load: 1.0,
            misfit: 0.0,
            usual: 0.0,
            sign_width: 0.01,
        };
        TorqueModel {
            range: vec![seen; inertials.len() / 10],
            inertials,
            identified,
            terms: Vec::new(),
            covariance: Vec::new(),
            sign_width: 0.01,
            friction_lead: 0.0,
            latency: 0.0,
            cutoff: 10.0,
            temperature: None,
        }
    }

    /// Gravity's torques with the arm's own payload.
    fn gravity(arm: &DynamicArm, links: &[Inertial], position: &[f64]) -> Vec<f64> {
        let theta = DeclaredInertials::of(arm, links).theta;
        let (still, mut torque) = (vec![0.0; position.len()], vec![0.0; position.len()]);
        let motion = MotionRow {
            position,
            velocity: &still,
            acceleration: &still,
        };
        InverseDynamics::new(arm).torque(motion, &arm.gravity, &theta, &mut torque);
        torque
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
            theta[10 * link - 10..10 * link]
                .iter_mut()
                .zip(ten)
                .for_each(|(sum, value)| *sum += value);
            theta[10 * link] = 0.0;
        }
        let links = model(theta, vec![false; 40]).links(&arm, &[15.0, 9.0, 7.0, 1.0]);
        assert_eq!(
            links.iter().map(|link| link.mass).collect::<Vec<_>>(),
            [15.0, 9.0, 7.0, 1.0]
        );
        let found: Vec<Inertial> = links
            .iter()
            .map(|link| Inertial {
                mass: link.mass,
                centre: link.centre,
                inertia: Matrix3::zeros(),
            })
            .collect();
        for position in [[0.0; 4], [0.3, -0.7, 1.1, 0.4], [-1.0, 0.9, -0.5, 2.0]] {
            let (own, truth) = (
                gravity(&arm, &found, &position),
                gravity(&arm, &bodies, &position),
            );
            assert!(
                own.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 1e-10),
                "{own:?} {truth:?}"
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
}
