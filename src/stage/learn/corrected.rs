//! The predictions of a step with a learnt correction on top.

use crate::error::Result;
use crate::stage::Context;
use crate::table::{Network, Prediction, Recording};

/// Every prediction with the correction; rows that were trained on are no longer held out.
pub(super) fn corrected(
    prediction: &Prediction,
    network: &Network,
    recording: &Recording,
    sources: &[Vec<f64>],
    trained: &[usize],
    context: &Context,
) -> Result<Prediction> {
    // Read back from its table, so that whoever applies the table later gets these very numbers.
    let correction = network.correction(&recording.prismatic)?;
    let mut rows = prediction.0.clone();
    let (mut fading, mut outside) = (0, 0);
    for (row, sources) in rows.iter_mut().zip(sources) {
        row.step = context.id.into();
        let Some(correction) = &correction else {
            continue;
        };
        let applied = correction.at(sources);
        outside += usize::from(applied.share == 0.0);
        fading += usize::from(applied.share > 0.0 && applied.share < 1.0);
        let [x, y, z] = applied.delta.map(|value| value * 1e3);
        (row.x_mm, row.y_mm, row.z_mm) = (row.x_mm + x, row.y_mm + y, row.z_mm + z);
        (row.dx_mm, row.dy_mm, row.dz_mm) = (row.dx_mm - x, row.dy_mm - y, row.dz_mm - z);
        row.error_mm =
            (row.dx_mm * row.dx_mm + row.dy_mm * row.dy_mm + row.dz_mm * row.dz_mm).sqrt();
        // Cross-validation was of the model without a correction, whichever rows the correction learned from.
        (row.fold_error_mm, row.block_error_mm) = (None, None);
    }
    for row in trained {
        rows[*row].held_out = false;
    }
    if fading + outside > 0 {
        context.note(format!(
            "{} of {} rows lie outside the region (joints, payload) that the correction saw: it fades out on {fading} and is silent on {outside}",
            fading + outside,
            rows.len()
        ));
    }
    Ok(Prediction(rows))
}
