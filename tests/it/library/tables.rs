use calib::audit::QueryTables;
use calib::error::Result;
use calib::pipeline::{Manifest, find_run};
use calib::store::Store;
use calib::table::{Prediction, Table};
use std::path::Path;

/// The held-out points of a step with their errors in mm, the worst first.
pub fn worst_points(store: &Path, run: &str, step: &str) -> Result<Vec<(String, f64)>> {
    let store = Store::open(store)?;
    let run = find_run(&store, run)?; // HEAD, HEAD~1, a tag, or the id of a run
    let tables = QueryTables::of(&Manifest::of(&store, &run)?);
    let frame = store.load(&tables.find(&format!("{step}/prediction"))?.table)?; // held against its hash and its schema
    let Prediction(rows) = Prediction::from_frame(&frame)?;
    let held_out = rows.into_iter().filter(|row| row.held_out);
    let mut points: Vec<(String, f64)> = held_out.map(|row| (row.point_id, row.error_mm)).collect();
    points.sort_by(|a, b| b.1.total_cmp(&a.1));
    Ok(points)
}
