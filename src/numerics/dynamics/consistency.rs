//! Whether inertial numbers are those of a body: mass above zero, and mass spread about its centre in every direction. That is the
//! condition that the pseudo-inertia be positive (Wensing, Kim, Slotine, RA-L 2018).

use super::arm::Inertial;
use super::arm::numbers;
use super::arm::{INERTIAL_NUMBERS, inertia_matrix};
use super::model::TorqueModel;
use nalgebra::{DMatrix, Matrix3, Point3, Vector3};

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
        let first = self.identified[..INERTIAL_NUMBERS * link]
            .iter()
            .filter(|known| **known)
            .count();
        let entry =
            |row: usize, column: usize| self.covariance[(first + row) * width + first + column];
        whole.then(|| DMatrix::from_fn(INERTIAL_NUMBERS, INERTIAL_NUMBERS, entry))
    }

    fn consistency_of(&self, link: usize) -> BodyConsistency {
        let ten = self.ten(link);
        let slope = |covariance: &DMatrix<f64>| {
            let by = |number: usize| {
                let step = STEP * covariance[(number, number)].max(0.0).sqrt();
                let mut moved = ten.to_vec();
                moved[number] += step;
                if step > 0.0 {
                    (spread(&moved) - spread(ten)) / step
                } else {
                    0.0
                }
            };
            nalgebra::DVector::from_fn(INERTIAL_NUMBERS, |number, _| by(number))
        };
        let sigma = self.covariance_of(link).map(|covariance| {
            let slope = slope(&covariance);
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
    let moments =
        (Matrix3::identity() * (0.5 * body.inertia.trace()) - body.inertia).symmetric_eigen();
    if moments.eigenvalues.min() >= 0.0 {
        return (body, true);
    }
    let kept = Matrix3::from_diagonal(
        &moments
            .eigenvalues
            .map(|moment| moment.max(LEAST_SPREAD * body.mass)),
    );
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
    let about = body_of(ten).inertia;
    let moments = Matrix3::identity() * (0.5 * about.trace()) - about;
    moments.symmetric_eigenvalues().min()
}

/// Mass, centre from the joint's point and inertia about the centre.
fn body_of(ten: &[f64]) -> Inertial {
    let mass = if ten[0].abs() < LIGHTEST {
        LIGHTEST
    } else {
        ten[0]
    };
    let arm = Vector3::new(ten[1], ten[2], ten[3]) / mass;
    let about_point = inertia_matrix(&ten[4..]);
    let steiner = (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * mass;
    Inertial {
        mass,
        centre: Point3::from(arm),
        inertia: about_point - steiner,
    }
}

/// The ten numbers of a body whose centre is given from the joint's point.
pub fn inertial_numbers(body: &Inertial) -> [f64; INERTIAL_NUMBERS] {
    numbers(body, &Vector3::zeros())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_no_body_become_those_of_the_nearest_with_the_same_mass_and_centre() {
        // A rod along x of 3 kg whose moment about its own axis is negative.
        let (body, own) = nearest(&[
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
            (body.centre - Point3::new(0.1, 0.0, 0.0)).norm() < 1e-15 && body.mass == 3.0 && !own
        );
        let [xx, yy, zz] = [0, 1, 2].map(|k| body.inertia[(k, k)]);
        assert!(
            xx > 0.0 && xx + yy >= zz && xx + zz >= yy && yy + zz >= xx,
            "{}",
            body.inertia
        );
        let (right, own) = nearest(&[3.0, 0.3, 0.0, 0.0, 0.01, 0.0, 0.0, 0.08, 0.0, 0.08]);
        assert!(
            own && (right.inertia[(0, 0)] - 0.01).abs() < 1e-12
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
