//! What the data of a fit could see: rank, singular values, condition, observability indices O1-O5.

use super::{Fit, FitRow, Observability, ObservabilityRow};
use crate::estimate::{Fitted, Repeated};

/// The quantity of a step whose cross-validation was dropped.
pub const UNFOLDED: &str = "unfolded";

/// What stands beside a fit in its table.
#[derive(Debug, Clone, Copy, Default)]
pub struct FitContext {
    /// Rank of the geometry, found and by theory, where all of it was asked for.
    pub geometry: Option<(usize, usize)>,
    /// Standard deviation of the joints that rows are weighted by, rad.
    pub repeatability: Option<f64>,
    /// Folds of the cross-validation, where there was one.
    pub folds: Option<usize>,
    /// Poses that were too few, or too many, for the cross-validation that was asked for.
    pub unfolded: Option<usize>,
    /// Parameters of the model whose covariance is an earlier step's.
    pub earlier: usize,
}

impl Observability {
    /// What a fit could see.
    pub fn of(step: &str, fitted: &Fitted, context: &FitContext) -> Self {
        let FitContext {
            geometry,
            repeatability,
            folds,
            unfolded,
            earlier,
        } = *context;
        let mut rows = Vec::new();
        let mut push = |quantity: &str, index: usize, value: f64, meaning: &str| {
            // A null space exactly zero has no logarithm, no ratio: such figures are left out, not stored as infinite.
            if value.is_finite() {
                rows.push(ObservabilityRow {
                    step: step.into(),
                    quantity: quantity.into(),
                    index: index as i64,
                    value,
                    meaning: meaning.into(),
                });
            }
        };
        push(
            "free",
            0,
            fitted.singular.len() as f64,
            "parameters estimated",
        );
        push(
            "candidates",
            0,
            fitted.singular_all.len() as f64,
            "parameters asked for",
        );
        if earlier > 0 {
            push(
                "earlier",
                0,
                earlier as f64,
                "parameters of the model that an earlier step estimated",
            );
        }
        if let Some((rank, expected)) = geometry {
            push(
                "rank",
                0,
                rank as f64,
                "geometric parameters that the data see",
            );
            push(
                "rank_expected",
                0,
                expected as f64,
                "4 per revolute joint + 2 per prismatic joint + 3 of the measured point",
            );
        }
        let rank = fitted.singular.len();
        if rank > 0 && rank < fitted.singular_all.len() {
            let gap = fitted.singular_all[rank - 1] / fitted.singular_all[rank];
            push(
                "gap",
                0,
                gap,
                "ratio of the last free singular value to the next one",
            );
        }
        push(
            "unmodelled_mm",
            0,
            fitted.excess_sigma * 1e3,
            "standard deviation per axis of the fitted rows beyond the instrument's noise",
        );
        if let Some(sigma) = fitted.excess_sigma_angle {
            push(
                "unmodelled_turn_rad",
                0,
                sigma,
                "standard deviation about each axis of the fitted orientations beyond their stated noise",
            );
        }
        if let Some(sigma) = repeatability {
            push(
                "joint_repeatability_rad",
                0,
                sigma,
                "standard deviation of every revolute joint that rows are weighted by",
            );
        }
        if let Some(repeated) = &fitted.repeated {
            of_repeats(repeated, &mut |quantity, value, meaning| {
                push(quantity, 0, value, meaning)
            });
        }
        if fitted.clusters > 0 {
            push(
                "clusters",
                0,
                fitted.clusters as f64,
                "poses whose rows the covariance takes as one: sigma allows for what they share",
            );
        }
        if let Some(folds) = folds {
            push(
                "folds",
                0,
                folds as f64,
                "parts of the poses without each of which the fit was repeated",
            );
        }
        if let Some(poses) = unfolded {
            push(
                UNFOLDED,
                0,
                poses as f64,
                "poses: not enough, or too many, for the folds that were asked for, so that nothing was cross-validated",
            );
        }
        push(
            "downweighted",
            0,
            fitted.downweighted.len() as f64,
            "fitted rows with reduced weight (Huber)",
        );
        for (name, value, meaning) in &fitted.indices {
            push(name, 0, *value, meaning);
        }
        for (k, value) in fitted.singular.iter().enumerate() {
            push(
                "singular_value",
                k + 1,
                *value,
                "of the whitened Jacobian, columns scaled to unit prior sigma",
            );
        }
        Self(rows)
    }
}

/// What poses say that were measured more than once: quantity, value, meaning.
fn of_repeats(repeated: &Repeated, push: &mut dyn FnMut(&str, f64, &str)) {
    push(
        "repeated_poses",
        repeated.poses as f64,
        "fitted poses measured more than once",
    );
    let floor = if repeated.revisited {
        "standard deviation per axis of rows about their pose's mean: no model can do better"
    } else {
        "standard deviation per axis of rows about their pose's mean, the arm at rest: without the joints' repeatability"
    };
    push("repeat_noise_mm", repeated.noise * 1e3, floor);
    push(
        "repeat_freedom",
        repeated.freedom as f64,
        "degrees of freedom of repeat_noise_mm",
    );
    if let Some((ratio, chance)) = repeated.lack_of_fit {
        push(
            "lack_of_fit_F",
            ratio,
            "mean square of the residual between poses over that within: 1 for a complete model",
        );
        push(
            "lack_of_fit_p",
            chance,
            "chance of a larger F under a complete model",
        );
    }
}

impl Fit {
    /// The course of a fit; the reason to stop stands in the last row.
    pub fn of(step: &str, fitted: &Fitted) -> Self {
        let last = fitted.course.len().saturating_sub(1);
        let row = |(iteration, at): (usize, &crate::estimate::Iteration)| FitRow {
            step: step.into(),
            iteration: iteration as i64,
            cost: at.cost,
            rms_mm: at.rms * 1e3,
            gradient: at.gradient,
            step_norm: at.step_norm,
            damping: at.damping,
            stop: (iteration == last).then(|| fitted.stop.name().to_string()),
        };
        Self(fitted.course.iter().enumerate().map(row).collect())
    }
}
