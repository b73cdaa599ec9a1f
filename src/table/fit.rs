//! The course of a least-squares fit: convergence as data.

crate::table::rows! { "fit",
    /// Iterations, one a row; key (`step`, `iteration`). The last row of a step carries why it stopped.
    pub struct Fit of FitRow {
        step: String,
        iteration: i64,
        /// Half the weighted sum of squares, dimensionless.
        cost: f64,
        /// Unweighted residual over the rows of the fit, mm.
        rms_mm: f64,
        /// Largest component of the scaled gradient.
        gradient: f64,
        /// Norm of the scaled step.
        step_norm: f64,
        damping: f64,
        stop: Option<String>,
    }
}
