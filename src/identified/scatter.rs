//! How an arm scatters about its identified model, by the tables of the stages that identified it.

use super::written::written;
use crate::compensate::Scatter;
use crate::error::Result;
use crate::pipeline::StageReport;
use crate::store::TableRef;
use crate::store::frame::Frame;
use crate::table::{Corrections, Observability, Prediction, Verdict};

/// The scatter by the stage whose model stands, and by the one that learned a correction on top of it.
pub(super) fn of(
    stage: &StageReport,
    learned: Option<&StageReport>,
    load: impl Fn(&TableRef) -> Result<Frame>,
) -> Result<Scatter> {
    let diagnosed: Option<Verdict> = written(stage, &load)?;
    let fitted: Option<Observability> = written(stage, &load)?;
    let prediction: Option<Prediction> = written(stage, &load)?;
    let corrections: Option<Corrections> =
        learned.map_or(Ok(None), |learned| written(learned, &load))?;
    let repeatability = diagnosed
        .and_then(|verdict| verdict.0.first().map(|row| row.repeatability_rad))
        .or_else(|| {
            fitted?
                .0
                .iter()
                .find(|row| row.quantity == "joint_repeatability_rad")
                .map(|row| row.value)
        });
    let mut unexplained = prediction.as_ref().map_or(0.0, Prediction::unexplained_mm);
    if let (Some(rms), Some(prediction)) = (
        corrections.as_ref().and_then(Corrections::rms_mm),
        &prediction,
    ) {
        // The errors of a correction's folds hold the noise, the parameters' uncertainty and what is left.
        let left = rms.powi(2) - prediction.mean_square_noise_mm2();
        unexplained = unexplained.min((left / 3.0).max(0.0).sqrt());
    }
    Ok(Scatter {
        unexplained: unexplained * 1e-3,
        repeatability: repeatability.unwrap_or(0.0),
    })
}
