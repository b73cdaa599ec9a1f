//! Physical consistency on demand: the fitted numbers moved to the nearest ones at which every link is a body, and what that costs.

use super::enforce::nearest_bodies;
use super::newton_euler::INERTIAL_NUMBERS;
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::types::EnforcedBodies;
use nalgebra::{DMatrix, DVector};

/// Share of the largest eigenvalue below which one is none.
const NOTHING: f64 = 1e-13;

/// Coefficients at which all links are bodies, nearest in the metric of their covariance; `None` where they are already, or where no masses
/// are declared: base parameters are those of many arms.
pub(super) fn with_bodies(
    problem: &TorqueProblem,
    set: &[usize],
    sweep: &SweptColumns,
    solution: &[(usize, f64)],
) -> Option<(Vec<(usize, f64)>, EnforcedBodies)> {
    problem.scene.declared.as_ref()?;
    let pivots: Vec<usize> = solution.iter().map(|(column, _)| *column).collect();
    let covariance =
        DMatrix::from_row_slice(pivots.len(), pivots.len(), &sweep.covariance(&pivots));
    let mut shares = DMatrix::zeros(INERTIAL_NUMBERS * problem.joints(), pivots.len());
    for link in 0..problem.joints() {
        for (column, ten) in problem.inertial_changes(set, link) {
            let Some(pivot) = pivots.iter().position(|one| *one == column) else {
                continue;
            };
            let mut own = shares.view_mut((INERTIAL_NUMBERS * link, pivot), (INERTIAL_NUMBERS, 1));
            own.iter_mut()
                .zip(ten)
                .for_each(|(sum, share)| *sum += share);
        }
    }
    let theta = problem.inertials(set, solution);
    let with = &covariance * shares.transpose();
    let own = &shares * &with;
    let found = nearest_bodies(&theta, &own)?;
    let moved = DVector::from_iterator(
        theta.len(),
        found.theta.iter().zip(&theta).map(|(new, old)| new - old),
    );
    let change = with * solved(&own, &moved);
    let solution = solution
        .iter()
        .zip(change.iter())
        .map(|((column, value), change)| (*column, value + change))
        .collect();
    Some((
        solution,
        EnforcedBodies {
            links: found.links,
            cost: found.cost,
        },
    ))
}

/// What a matrix of numbers in many units takes to a vector; directions that it does not have are left out.
fn solved(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let scale = matrix
        .diagonal()
        .map(|own| if own > 0.0 { 1.0 / own.sqrt() } else { 0.0 });
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
    use super::super::{BodyConsistency, TorqueQuestion, diagnose};

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
        let wrong: Vec<usize> = free
            .model
            .consistency()
            .iter()
            .filter(|body| !body.is_consistent())
            .map(|body| body.link)
            .collect();
        assert!(wrong.contains(&2) && free.enforced.is_none(), "{wrong:?}");
        assert!(
            held.model
                .consistency()
                .iter()
                .all(BodyConsistency::is_consistent),
            "{:?}",
            held.model.consistency()
        );
        let enforced = held.enforced.expect("something was moved");
        assert_eq!(enforced.links, wrong);
        assert!(enforced.cost > 1.0, "{}", enforced.cost);
        assert!(held.after.nrmse_mean > free.after.nrmse_mean);
        assert!(
            held.remarks
                .iter()
                .any(|line| line.starts_with("no body has the numbers of link ")
                    && line.contains("at the price of"))
        );
        // An arm of bodies is left as it is.
        let plain = diagnose(
            &arm(),
            &record(&arm(), 0.0, &|_| 0.0),
            &TorqueQuestion {
                enforce_bodies: true,
                ..TorqueQuestion::default()
            },
            &mut |_| (),
        );
        assert!(plain.expect("a diagnosis").enforced.is_none());
    }
}
