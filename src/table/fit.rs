//! The course of a least-squares fit: convergence as data.

crate::table::rows! { "fit",
    /// Iterations, one a row; key (`step`, `iteration`). The last row of a step carries why it stopped.
    pub struct Fit of FitRow {
        step: String,
        iteration: i64,
        /// Sum of Huber's losses of the whitened residuals, dimensionless. Rounds with a new noise level start afresh.
        cost: f64,
        /// Root mean square of the residual length over the fitted rows, mm.
        rms_mm: f64,
        /// Largest cosine between a column of the Jacobian and the residual: 0 at the minimum.
        gradient: f64,
        /// How far the step moved the whitened predictions, in sigmas.
        step_norm: f64,
        damping: f64,
        stop: Option<String>,
    }
}

use crate::estimate::Fitted;

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
