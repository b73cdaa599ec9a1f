//! The course of a network's training.

crate::table::rows! { "training",
    /// Generations or epochs, one a row; key (`step`, `phase`, `member`, `generation`).
    pub struct Training of TrainingRow {
        step: String,
        /// `swarm` or `gradient`.
        phase: String,
        /// The network from 1; 0 for the swarm, which serves all.
        member: i64,
        generation: i64,
        /// Best objective so far (mean squared error of the scaled training residuals plus decay).
        best: f64,
        /// rms of the position error on the training rows after correction, mm.
        train_rms_mm: f64,
        /// The same on rows kept back from training within the training set, mm.
        check_rms_mm: Option<f64>,
        evaluations: i64,
    }
}
