//! Position error by step and set; held-out and training rows apart.

crate::table::rows! { "statistics",
    /// Statistics of the error length, one (step, set) a row; key (`order`, `set`).
    pub struct Statistics of StatisticsRow {
        /// Place of the step in the pipeline, from 0.
        order: i64,
        step: String,
        set: String,
        /// False: training rows, the error is flattered.
        held_out: bool,
        points: i64,
        mean_mm: f64,
        std_mm: f64,
        rms_mm: f64,
        median_mm: f64,
        p95_mm: f64,
        max_mm: f64,
        rms_x_mm: f64,
        rms_y_mm: f64,
        rms_z_mm: f64,
        /// Expected rms from the measurement noise alone.
        noise_rms_mm: f64,
    }
}
