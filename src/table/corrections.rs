//! The rivals of a learned correction, as cross-validation within the training rows judged them.

crate::table::rows! { "corrections",
    /// One rival a row; key (`step`, `rival`).
    pub struct Corrections of CorrectionsRow {
        step: String,
        /// `none`, `ridge`, `gaussian_process`, `curves`, or `mlp_` or `mlp_joints_` and where the training starts.
        rival: String,
        /// Whether this one was kept.
        chosen: bool,
        /// Why, or why not, in words.
        reason: String,
        /// Mean error of the training rows without a correction.
        before_mm: f64,
        /// Error of the training rows, each under a correction that did not see it; null where the rival could not be tried.
        mean_mm: Option<f64>,
        rms_mm: Option<f64>,
        max_mm: Option<f64>,
        /// Mean gain over no correction, and its standard error.
        gain_mm: Option<f64>,
        gain_sigma_mm: Option<f64>,
        /// Numbers learnt, and evaluations of a loss, of one fit.
        numbers: i64,
        evaluations: i64,
        /// Hidden neurons and weight decay of networks.
        hidden: Option<i64>,
        decay: Option<f64>,
    }
}

impl Corrections {
    /// Root mean square error (mm) of the training rows under the rival that was kept, each row unseen; none where it could not be tried.
    pub fn rms_mm(&self) -> Option<f64> {
        self.0.iter().find(|row| row.chosen)?.rms_mm
    }
}
