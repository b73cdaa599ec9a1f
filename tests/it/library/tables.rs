use calib::api::CalibRun;
use calib::error::Result;
use calib::store::Store;
use calib::table::{Prediction, Table};
use std::path::Path;

/// The held-out points of a step with their errors in mm, the worst first.
pub fn worst_points(store: &Path, run: &str, step: &str) -> Result<Vec<(String, f64)>> {
    let run = CalibRun::open(Store::open(store)?, run)?; // HEAD, HEAD~1, a tag, or the id of a run
    let Prediction(mut rows) = Prediction::from_frame(&run.table(&format!("{step}/prediction"))?)?;
    rows.retain(|row| row.held_out);
    rows.sort_by(|a, b| b.error_mm.total_cmp(&a.error_mm));
    Ok(rows
        .into_iter()
        .map(|row| (row.point_id, row.error_mm))
        .collect())
}
