//! Position error by step and set; held-out and training rows apart.

crate::table::rows! { "statistics",
    /// Statistics of the error length, one (step, set, held out) a row; key (`order`, `set`, `held_out`).
    ///
    /// A set of which a step used only some rows makes two rows: what was held out is never averaged with what was fitted.
    pub struct Statistics of StatisticsRow {
        /// Place of the step in the pipeline, from 0.
        order: i64,
        step: String,
        set: String,
        /// False: training rows, the error is flattered.
        held_out: bool,
        points: i64,
        /// Arithmetic mean of the error length.
        mean_mm: f64,
        /// Sample standard deviation of the error length (divisor points - 1); 0 for a single point.
        std_mm: f64,
        /// Root mean square of the error length (divisor points).
        rms_mm: f64,
        /// Linear between order statistics, like `p95_mm`.
        median_mm: f64,
        p95_mm: f64,
        max_mm: f64,
        /// Root mean square of the residual along one axis of the tracker's frame, its mean not removed.
        rms_x_mm: f64,
        rms_y_mm: f64,
        rms_z_mm: f64,
        /// Expected rms from the measurement noise alone: root mean square of `noise_mm`.
        noise_rms_mm: f64,
        /// What that rests on: `repeats`, `instrument` or `inferred`; null in tables of before.
        noise_basis: Option<String>,
        /// What rms to expect if the model were complete: the noise, with the parameters' own uncertainty added (held-out rows) or
        /// taken off (training rows); null where the step does not know it.
        expected_rms_mm: Option<f64>,
        /// Rows that the step's screen took for mistakes of the recording; all other figures include them.
        suspects: i64,
        /// The same figures without the suspects; null where there are none.
        mean_without_mm: Option<f64>,
        rms_without_mm: Option<f64>,
        max_without_mm: Option<f64>,
        /// Cross-validation of a step that was fitted to these rows: the error length of each under a fit without its fold, folds
        /// drawn at random by pose; null where the step made no folds.
        fold_mean_mm: Option<f64>,
        fold_rms_mm: Option<f64>,
        fold_max_mm: Option<f64>,
        /// The same with contiguous stretches of the recording as folds; of a target that was brought to places, each of these in turn.
        block_mean_mm: Option<f64>,
        block_rms_mm: Option<f64>,
        block_max_mm: Option<f64>,
        /// What `fold_rms_mm` to expect of a complete model of p parameters fitted to n values: noise x sqrt(1 + p / (n - p - 1)).
        fold_expected_mm: Option<f64>,
        /// Points with a remark of `prediction`: outside of where the model was measured, or uncertain. Null in tables of before.
        remarked: Option<i64>,
        /// Mean and largest error of these points; null where there are none.
        mean_remarked_mm: Option<f64>,
        max_remarked_mm: Option<f64>,
        /// The first of them, with the remark of one.
        remarked_points: Option<String>,
        /// A published or agreed figure of the same quantity, named by the pipeline.
        reference: Option<String>,
        reference_mean_mm: Option<f64>,
        reference_std_mm: Option<f64>,
        reference_max_mm: Option<f64>,
    }
}

use crate::error::counted;
use crate::observation::KINDS;
use crate::robot::NoiseBasis;

impl StatisticsRow {
    /// Which of its points are outside of what the model knows, with their errors; none where none is.
    pub fn doubts(&self) -> Option<String> {
        let (mean, max) = self.mean_remarked_mm.zip(self.max_remarked_mm)?;
        let points = self.remarked_points.as_deref().unwrap_or_default();
        let remarked = self.remarked.unwrap_or_default();
        Some(format!(
            "{remarked} of {} beyond what was fitted or uncertain by more than half of the correction: mean {mean:.4} mm, max {max:.4} mm there; {points}",
            counted(self.points as usize, "point")
        ))
    }

    /// Whether it is of rows in which the target was brought to places: blocks that are left out are places then.
    pub fn is_brought(&self) -> bool {
        let own = |word: &str| self.set.ends_with(&format!("({word})"));
        KINDS.iter().any(|kind| kind.is_brought() && own(kind.about().word))
    }

    /// Whether its figures of noise rest on nothing that was stated or measured again.
    pub fn is_inferred(&self) -> bool {
        self.noise_basis.as_deref() == Some(NoiseBasis::Inferred.name())
    }
}
