//! The bodies nearest to inertial numbers that no body has: nearest in the metric of their covariance, over all links at once.
//!
//! A link's ten numbers are those of a body where its pseudo-inertia, the second moments of mass about the joint's point with the first
//! moments and the mass as their border (4 x 4), is positive (Wensing, Kim, Slotine, RA-L 2018). Least squares under that condition is a
//! projection onto a product of cones, found by alternating directions (ADMM): a step in the metric, a step onto the cones.

use super::arm::{INERTIAL_NUMBERS, inertia_matrix, unit_number};
use super::findings::FittedSet;
use super::types::EnforcedBodies;
use nalgebra::{DMatrix, DVector, Matrix4};
use std::f64::consts::SQRT_2;

/// Steps, at most.
const STEPS: usize = 20_000;
/// Change of the scaled pseudo-inertias between two steps at which it ends.
const SETTLED: f64 = 1e-10;
/// Least eigenvalue of a scaled pseudo-inertia, of its trace: a body, and not just its limit.
const LEAST: f64 = 1e-6;
/// Share of the trace below which an eigenvalue is rounded.
const ROUNDED: f64 = 1e-12;
/// Steps between two looks at the weight of the two directions.
const LOOK: usize = 50;
/// m: a link's extent where its numbers say none.
const EXTENT: f64 = 0.1;

/// The nearest numbers (10 n) that are bodies', by the covariance of all (row-major, 10 n x 10 n), and what was moved: the squared distance in
/// that metric is what the whitened squared residual, tolerances included, rises by. `None` where they are bodies' already.
fn nearest_bodies(theta: &[f64], covariance: &DMatrix<f64>) -> Option<(Vec<f64>, EnforcedBodies)> {
    let bodies = || theta.chunks_exact(INERTIAL_NUMBERS);
    let maps: Vec<ConeMap> = bodies().map(ConeMap::of).collect();
    let is_none = |link: &usize| !maps[*link].is_body(&theta[INERTIAL_NUMBERS * link..]);
    let links: Vec<usize> = (0..maps.len()).filter(is_none).collect();
    if links.is_empty() {
        return None;
    }
    let width = theta.len();
    let mut to = DMatrix::zeros(width, width);
    for (link, map) in maps.iter().enumerate() {
        let first = INERTIAL_NUMBERS * link;
        to.view_mut((first, first), (INERTIAL_NUMBERS, INERTIAL_NUMBERS))
            .copy_from(&map.matrix);
    }
    let start = &to * DVector::from_column_slice(theta);
    let metric = &to * covariance * to.transpose();
    let found = projected(&start, &metric, &maps);
    let theta = to.lu().solve(&found)?.as_slice().to_vec();
    let eigen = metric.symmetric_eigen();
    let least = 1e-14 * eigen.eigenvalues.max();
    let along = eigen.eigenvectors.transpose() * (&found - &start);
    let seen = along.iter().zip(eigen.eigenvalues.iter());
    let seen = seen.filter(|(_, size)| **size > least);
    let cost = seen.map(|(value, size)| value * value / size).sum();
    Some((theta, EnforcedBodies { links, cost }))
}

/// The point of the cones nearest to `start` by the inverse of `metric`.
fn projected(start: &DVector<f64>, metric: &DMatrix<f64>, maps: &[ConeMap]) -> DVector<f64> {
    let width = start.len();
    // Eigenvectors once: a change of weight costs nothing then.
    let eigen = metric.clone().symmetric_eigen();
    let sizes = eigen.eigenvalues.map(|size| size.max(0.0));
    let mut weight = width as f64 / sizes.sum().max(f64::MIN_POSITIVE);
    let (mut on, mut pull) = (start.clone(), DVector::zeros(width));
    for step in 0..STEPS {
        let along = eigen.eigenvectors.transpose() * (&on - &pull - start);
        let shares = DVector::from_fn(width, |k, _| {
            sizes[k] / (sizes[k] + 1.0 / weight) * along[k]
        });
        let free = start + &eigen.eigenvectors * shares;
        let before = std::mem::replace(&mut on, &free + &pull);
        let bodies = on.as_mut_slice().chunks_exact_mut(INERTIAL_NUMBERS);
        maps.iter()
            .zip(bodies)
            .for_each(|(map, ten)| map.onto_cone(ten));
        pull += &free - &on;
        let (apart, moved) = ((&free - &on).norm(), (&on - &before).norm());
        if apart.max(moved) < SETTLED * (1.0 + start.norm()) {
            break;
        }
        if step % LOOK == LOOK - 1 && (apart > 10.0 * moved || moved > 10.0 * apart) {
            let factor = if apart > moved { 2.0 } else { 0.5 };
            weight *= factor;
            pull /= factor;
        }
    }
    on
}

/// A link's ten numbers as a scaled pseudo-inertia: ten entries, those off the diagonal times the root of 2, so that their length is that of
/// the matrix.
struct ConeMap {
    matrix: DMatrix<f64>,
    /// Least eigenvalue that is allowed.
    least: f64,
}

/// Where the ten entries stand.
const ENTRIES: [(usize, usize); 10] = [
    (0, 0),
    (0, 1),
    (0, 2),
    (0, 3),
    (1, 1),
    (1, 2),
    (1, 3),
    (2, 2),
    (2, 3),
    (3, 3),
];

impl ConeMap {
    /// The pseudo-inertia of a link, scaled by its extent, so that masses and second moments have one size.
    fn of(ten: &[f64]) -> Self {
        let second = 0.5 * (ten[4] + ten[7] + ten[9]);
        let extent = if ten[0] > 0.0 && second > 0.0 {
            (second / ten[0]).sqrt()
        } else {
            EXTENT
        };
        let mut matrix = DMatrix::zeros(INERTIAL_NUMBERS, INERTIAL_NUMBERS);
        for number in 0..INERTIAL_NUMBERS {
            let unit = pseudo_inertia(&unit_number(number), extent);
            matrix.column_mut(number).copy_from_slice(&entries(&unit));
        }
        Self {
            matrix,
            least: LEAST * (ten[0].abs() + second.abs() / (extent * extent)),
        }
    }

    fn is_body(&self, ten: &[f64]) -> bool {
        let scaled = &self.matrix * DVector::from_column_slice(&ten[..INERTIAL_NUMBERS]);
        let matrix = of_entries(scaled.as_slice());
        matrix.symmetric_eigenvalues().min() >= -ROUNDED * matrix.trace()
    }

    /// The nearest of the cone.
    fn onto_cone(&self, ten: &mut [f64]) {
        let eigen = of_entries(ten).symmetric_eigen();
        if eigen.eigenvalues.min() >= self.least {
            return;
        }
        let kept = Matrix4::from_diagonal(&eigen.eigenvalues.map(|size| size.max(self.least)));
        ten.copy_from_slice(&entries(
            &(eigen.eigenvectors * kept * eigen.eigenvectors.transpose()),
        ));
    }
}

/// Second and first moments and mass of ten numbers, lengths in `extent`.
fn pseudo_inertia(ten: &[f64; INERTIAL_NUMBERS], extent: f64) -> Matrix4<f64> {
    let inertia = inertia_matrix(&ten[4..]);
    let half = 0.5 * inertia.trace();
    Matrix4::from_fn(|row, column| match (row.min(column), row.max(column)) {
        (3, 3) => ten[0],
        (axis, 3) => ten[1 + axis] / extent,
        (a, b) => (if a == b { half } else { 0.0 } - inertia[(a, b)]) / (extent * extent),
    })
}

fn entries(matrix: &Matrix4<f64>) -> [f64; INERTIAL_NUMBERS] {
    ENTRIES.map(|(row, column)| matrix[(row, column)] * if row == column { 1.0 } else { SQRT_2 })
}

fn of_entries(ten: &[f64]) -> Matrix4<f64> {
    let mut matrix = Matrix4::zeros();
    for ((row, column), value) in ENTRIES.into_iter().zip(ten) {
        let value = if row == column {
            *value
        } else {
            value / SQRT_2
        };
        (matrix[(row, column)], matrix[(column, row)]) = (value, value);
    }
    matrix
}

// Physical consistency on demand: the fitted numbers moved to the nearest ones at which every link is a body, and what that costs.

/// Share of the largest eigenvalue below which one is none.
const NOTHING: f64 = 1e-13;

/// Coefficients at which all links are bodies, nearest in the metric of their covariance; `None` where they are already, or where no masses
/// are declared: base parameters are those of many arms.
pub(super) fn with_bodies(fit: &FittedSet) -> Option<(Vec<(usize, f64)>, EnforcedBodies)> {
    let (problem, set, solution) = (fit.choice.problem, fit.set, &fit.solution);
    problem.scene.declared.as_ref()?;
    let (pivots, values): (Vec<usize>, Vec<f64>) = solution.iter().copied().unzip();
    let covariance = fit.sweep.covariance(&pivots);
    let covariance = DMatrix::from_row_slice(pivots.len(), pivots.len(), &covariance);
    let mut shares = DMatrix::zeros(INERTIAL_NUMBERS * problem.joints(), pivots.len());
    for link in 0..problem.joints() {
        for (column, ten) in problem.inertial_changes(set, link) {
            let Some(pivot) = pivots.iter().position(|one| *one == column) else {
                continue;
            };
            let first = INERTIAL_NUMBERS * link;
            let mut block = shares.view_mut((first, pivot), (INERTIAL_NUMBERS, 1));
            block
                .iter_mut()
                .zip(ten)
                .for_each(|(sum, share)| *sum += share);
        }
    }
    let theta = problem.inertials(set, solution);
    let with = &covariance * shares.transpose();
    let variance = &shares * &with;
    let (bodies, enforced) = nearest_bodies(&theta, &variance)?;
    let moved = DVector::from(bodies) - DVector::from(theta);
    let change = with * solved(&variance, &moved);
    let moved = DVector::from(values) + change;
    Some((
        pivots.into_iter().zip(moved.iter().copied()).collect(),
        enforced,
    ))
}

/// What a matrix of numbers in many units takes to a vector; directions that it does not have are left out.
fn solved(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let scale = matrix
        .diagonal()
        .map(|entry| if entry > 0.0 { 1.0 / entry.sqrt() } else { 0.0 });
    let scaled = DMatrix::from_fn(right.len(), right.len(), |a, b| {
        scale[a] * matrix[(a, b)] * scale[b]
    });
    let eigen = scaled.symmetric_eigen();
    let least = NOTHING * eigen.eigenvalues.max();
    let along = eigen.eigenvectors.transpose() * right.component_mul(&scale);
    let along = along.zip_map(&eigen.eigenvalues, |value, size| {
        if size > least { value / size } else { 0.0 }
    });
    (eigen.eigenvectors * along).component_mul(&scale)
}

#[cfg(test)]
mod tests {
    use super::super::cases::{arm, record};
    use super::super::{TorqueDiagnosis, TorqueQuestion, diagnose};
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    /// Two links: a rod whose moment about its own axis is negative, and a ball.
    fn theta() -> Vec<f64> {
        let rod = [3.0, 0.3, 0.0, 0.0, -0.02, 0.0, 0.0, 0.08, 0.0, 0.08];
        let ball = [
            2.0,
            0.2,
            -0.1,
            0.3,
            0.02 + 0.208,
            0.04,
            -0.12,
            0.02 + 0.28,
            0.06,
            0.02 + 0.108,
        ];
        rod.into_iter().chain(ball).collect()
    }

    /// A covariance of numbers that have much to do with each other.
    fn covariance() -> DMatrix<f64> {
        let mut dice = ChaCha8Rng::seed_from_u64(7);
        let sizes: Vec<f64> = (0..20)
            .map(|number| if number % 10 < 4 { 0.02 } else { 0.004 })
            .collect();
        let mix = DMatrix::from_fn(20, 20, |row, column| {
            sizes[row] * (f64::from(u8::from(row == column)) + 0.3 * (dice.random::<f64>() - 0.5))
        });
        &mix * mix.transpose()
    }

    fn distance(theta: &[f64], other: &[f64], covariance: &DMatrix<f64>) -> f64 {
        let moved = DVector::from_column_slice(other) - DVector::from_column_slice(theta);
        moved.dot(
            &covariance
                .clone()
                .cholesky()
                .expect("positive")
                .solve(&moved),
        )
    }

    #[test]
    fn numbers_of_no_body_become_those_of_bodies_and_no_other_bodies_are_nearer() {
        let (theta, covariance) = (theta(), covariance());
        let (found, enforced) = nearest_bodies(&theta, &covariance).expect("one is none");
        assert_eq!(enforced.links, [0]);
        let is_body = |all: &[f64]| {
            let mut links = all.chunks_exact(10);
            links.all(|ten| ConeMap::of(ten).is_body(ten))
        };
        assert!(!is_body(&theta) && is_body(&found));
        let cost = distance(&theta, &found, &covariance);
        let stated = enforced.cost;
        assert!((stated - cost).abs() < 1e-6 * cost, "{stated} {cost}");
        // On the way from it to any body the distance rises.
        let mut dice = ChaCha8Rng::seed_from_u64(8);
        let mut tried = 0;
        while tried < 2000 {
            let variances = covariance.diagonal();
            let values = found.iter().zip(variances.iter());
            let other = values.map(|(value, variance)| {
                value + variance.sqrt() * 3.0 * (dice.random::<f64>() - 0.5)
            });
            let other: Vec<f64> = other.collect();
            if !is_body(&other) {
                continue;
            }
            tried += 1;
            let step = found.iter().zip(&other);
            let step: Vec<f64> = step.map(|(a, b)| a + 1e-3 * (b - a)).collect();
            // Up to what is kept off the limit.
            assert!(distance(&theta, &step, &covariance) > cost * (1.0 - 1e-5));
        }
        // Numbers that are correlated with those of the rod move, too.
        let mut ball = found[10..].iter().zip(&theta[10..]);
        assert!(ball.any(|(a, b)| (a - b).abs() > 1e-6));
    }

    #[test]
    fn bodies_stay_as_they_are() {
        let covariance = covariance().view((10, 10), (10, 10)).into_owned();
        assert_eq!(nearest_bodies(&theta()[10..], &covariance), None);
    }

    #[test]
    fn links_of_no_body_become_bodies_where_that_is_asked_and_it_is_said_what_it_costs() {
        // More inertia about its axis than across it on both sides: no rod.
        let mut real = arm();
        if let Some(links) = &mut real.links {
            links[2].inertia[(0, 0)] = 0.8;
        }
        let recording = record(&real, 0.0, &|_| 0.0);
        let mut loose = arm();
        loose.tolerance.inertia_relative = 40.0;
        let asked = |enforce_bodies: bool| {
            let question = TorqueQuestion {
                enforce_bodies,
                ..TorqueQuestion::default()
            };
            diagnose(&loose, &recording, &question, &mut |_| ()).expect("a diagnosis")
        };
        let (free, held) = (asked(false), asked(true));
        let none = |diagnosis: &TorqueDiagnosis| -> Vec<usize> {
            let mut links = diagnosis.model.consistency();
            links.retain(|body| !body.is_consistent());
            links.iter().map(|body| body.link).collect()
        };
        let wrong = none(&free);
        assert!(wrong.contains(&2) && free.enforced.is_none(), "{wrong:?}");
        assert_eq!(none(&held), Vec::<usize>::new());
        let enforced = held.enforced.expect("something was moved");
        assert_eq!(enforced.links, wrong);
        assert!(enforced.cost > 1.0, "{}", enforced.cost);
        assert!(held.after.nrmse_mean > free.after.nrmse_mean);
        let remarks = held.remarks.join("\n");
        assert!(
            remarks.contains("no body has the numbers of link "),
            "{remarks}"
        );
        assert!(remarks.contains("at the price of"), "{remarks}");
        // An arm of bodies is left as it is.
        let question = TorqueQuestion {
            enforce_bodies: true,
            ..TorqueQuestion::default()
        };
        let recording = record(&arm(), 0.0, &|_| 0.0);
        let plain = diagnose(&arm(), &recording, &question, &mut |_| ());
        assert!(plain.expect("a diagnosis").enforced.is_none());
    }
}
