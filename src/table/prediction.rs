//! Where a model puts every measured point, and what is left.

crate::table::rows! { "prediction",
    /// Points, one a row; key `sequence`. Residual = measured - predicted, tracker frame.
    pub struct Prediction of PredictionRow {
        sequence: i64,
        point_id: String,
        set: String,
        /// The step whose model this is, e.g. `nominal`, `geometry`.
        step: String,
        /// True where neither this step nor an earlier one was fitted to this row.
        held_out: bool,
        x_mm: f64,
        y_mm: f64,
        z_mm: f64,
        dx_mm: f64,
        dy_mm: f64,
        dz_mm: f64,
        /// Length of the residual.
        error_mm: f64,
        /// One-sigma length of the measurement noise that the row is weighted by (root of the summed variances).
        noise_mm: f64,
    }
}
