//! How an arm scatters about its identified model, by the tables of the stages that identified it.

use crate::compensate::Scatter;
use crate::error::Result;
use crate::table::{Corrections, Observability, Prediction, TablesByKind, Verdict, of_kind};

/// The scatter by the stage whose model stands, and by the one that learned a correction on top of it.
pub(super) fn of(stage: &TablesByKind, learned: Option<&TablesByKind>) -> Result<Scatter> {
    let diagnosed: Option<Verdict> = of_kind(stage)?;
    let fitted: Option<Observability> = of_kind(stage)?;
    let prediction: Option<Prediction> = of_kind(stage)?;
    let corrections: Option<Corrections> = learned.map_or(Ok(None), of_kind)?;
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
