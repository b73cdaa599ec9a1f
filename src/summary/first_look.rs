//! What a fit of base and geometry says of a recording before anything is run in earnest: rows that are used and not, ranges, what is warned
//! of, what will be observable.

use super::run::filled;
use super::tables;
use crate::error::Result;
use crate::pipeline::Manifest;
use crate::store::Store;
use crate::table::{Parameters, Prediction, Recording, Rejected, Robot};
use crate::units::Unit;
use minijinja::context;
use minijinja::value::Serde;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Lines of a run up to its first fits. Fails where a table has left the store.
pub fn first_look(manifest: &Manifest, store: &Store) -> Result<String> {
    let robots = tables::<Robot>(manifest, store)?;
    let mut recordings = Vec::new();
    for recording in tables::<Recording>(manifest, store)? {
        let points: BTreeSet<&String> = recording.point_id.iter().collect();
        let ranges = match robots.first() {
            Some(robot) => ranges(&recording, robot)?,
            None => Vec::new(),
        };
        recordings
            .push(json!({ "rows": recording.rows(), "points": points.len(), "ranges": ranges }));
    }
    let rejected = tables::<Rejected>(manifest, store)?;
    let rejected: Vec<_> = rejected.into_iter().map(|table| table.0).collect();
    let predictions = tables::<Prediction>(manifest, store)?;
    let errors: Vec<_> = predictions.iter().flat_map(errors).collect();
    let parameters = tables::<Parameters>(manifest, store)?.pop();
    let mut warnings: Vec<[&str; 2]> = Vec::new();
    for stage in &manifest.stages {
        for line in &stage.warnings {
            if warnings.iter().all(|[_, known]| *known != line) {
                warnings.push([&stage.id, line]);
            }
        }
    }
    let about = context! {
        recordings => Serde(recordings), rejected => Serde(rejected), errors => Serde(errors), warnings => Serde(warnings),
        parameters => Serde(parameters.map(|table| table.0)),
    };
    Ok(filled(include_str!("text/first_look.txt"), about))
}

/// Smallest and largest position of each joint, in the robot file's counting, and the limits of joints beyond them.
fn ranges(recording: &Recording, robot: &Robot) -> Result<Vec<Value>> {
    let robot = robot.to_description()?;
    let joints = robot.joints.iter().enumerate().map(|(k, joint)| {
        let values = (0..recording.rows()).map(|row| recording.q(row)[k]);
        let (lower, upper) = values.fold((f64::MAX, f64::MIN), |(a, b), q| (a.min(q), b.max(q)));
        let unit = match recording.prismatic.get(k) {
            Some(true) => Unit::Millimetre,
            _ => Unit::Degree,
        };
        let shown = |ends: [f64; 2]| ends.map(|end| unit.from_si(end));
        let is_beyond = |[a, b]: &[f64; 2]| lower < a - 1e-6 || upper > b + 1e-6;
        json!({
            "name": joint.name, "unit": unit.symbol(), "travel": shown([lower, upper]),
            "beyond": joint.limits.filter(is_beyond).map(shown), "still": upper - lower < 1e-6,
        })
    });
    Ok(joints.collect())
}

/// Step, mean and largest error, mm, and points, in the order in which the steps first come.
fn errors(prediction: &Prediction) -> Vec<(&str, f64, f64, usize)> {
    let mut steps: Vec<(&str, Vec<f64>)> = Vec::new();
    for row in &prediction.0 {
        match steps.iter_mut().find(|(step, _)| *step == row.step) {
            Some((_, errors)) => errors.push(row.error_mm),
            None => steps.push((&row.step, vec![row.error_mm])),
        }
    }
    let one = |(step, errors): (_, Vec<f64>)| {
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let largest = errors.iter().copied().fold(0.0, f64::max);
        (step, mean, largest, errors.len())
    };
    steps.into_iter().map(one).collect()
}
