//! A two-axis level on the tool: read by `ingest`, it sharpens what a tracker says, and finds joint offsets without one.

use super::SIGMA;
use super::laws::{Truth, select};
use crate::desk::{Desk, table};
use crate::fixture::{self, misses, rms};
use crate::identify::normal;
use crate::ingest::robot;
use calib::estimate::{Fitted, Model, ParameterStatus};
use calib::robot::Measurements;
use calib::stage::ingest::{Ingest, IngestReads};
use calib::table::Recording;
use nalgebra::Vector3;
use serde_json::json;
use std::collections::BTreeMap;

/// rad
const SIGMA_TILT: f64 = 2e-5;

/// Rows of a level that stands upright: it works up to where its z axis is level.
fn upright(data: &Measurements) -> Vec<usize> {
    let up = |row: &usize| data.reading("orientation", *row).unwrap().values[8] > 0.3;
    (0..data.rows()).filter(up).collect()
}

/// The rows as a file with noise, as `ingest` reads it.
fn ingested(data: &Measurements, seed: usize) -> Recording {
    let joints: String = (1..=data.joints)
        .map(|joint| format!("q{joint},"))
        .collect();
    let mut text = format!("{joints}x,y,z,level_x,level_y\n");
    for row in 0..data.rows() {
        let noise = |k: usize| normal(1_000_003 * (seed + 1) + 8 * row + k);
        let tilt = data.reading("inclination", row).unwrap().values;
        let cells = data.q(row).iter().map(|q| q.to_degrees());
        let cells = cells.chain(
            (0..3).map(|axis| (data.points.position[row][axis] + SIGMA * noise(axis)) * 1e3),
        );
        let cells =
            cells.chain((0..2).map(|axis| (tilt[axis] + SIGMA_TILT * noise(3 + axis)) * 1e3));
        text.push_str(
            &cells
                .map(|cell| format!("{cell:.9}"))
                .collect::<Vec<_>>()
                .join(","),
        );
        text.push('\n');
    }
    let column = |name: &str, unit: &str| json!({"column": name, "unit": unit});
    let stage: Ingest = serde_json::from_value(json!({"files": [{"file": "a.csv", "columns": {
        "q": column("q{j}", "deg"), "x": column("x", "mm"), "y": column("y", "mm"), "z": column("z", "mm"),
        "tilt_x": column("level_x", "mrad"), "tilt_y": column("level_y", "mrad"), "sigma_tilt": {"value": 20.0e-3, "unit": "mrad"},
    }}]}))
    .unwrap();
    let tables = Desk::default()
        .with("a.csv", text)
        .run(
            &stage,
            IngestReads {
                robot: robot(&"r".repeat(data.joints), 1.0),
            },
        )
        .unwrap();
    table::<Recording>(&tables).remove(0)
}

/// Rms of what is stated and of what is so of predictions at rows `at`, m.
fn errors(model: &Model, fitted: &Fitted, at: &Measurements) -> [f64; 2] {
    let stated = fitted
        .covariance
        .as_ref()
        .unwrap()
        .of_predictions(model, at);
    [rms(stated), rms(misses(model, at))]
}

#[test]
fn a_level_beside_a_tracker_sharpens_the_estimate() {
    let truth = Truth::new(fixture::offset_wrist(), Vector3::zeros());
    let all = truth.rows(300);
    let rows = upright(&all);
    let fresh = select(&all, &rows[20..]);
    let mut sums = [[0.0; 2]; 2];
    for seed in 0..6 {
        let mut recording = ingested(&select(&all, &rows[..14]), seed);
        recording.position_sigma = Some(vec![[SIGMA; 3]; recording.rows()]);
        let both = recording.measurements();
        let points = Measurements {
            readings: Vec::new(),
            ..both.clone()
        };
        for (sum, data) in sums.iter_mut().zip([points, both]) {
            let (model, fitted) = truth.fit(&data, |_| true);
            let errors = errors(&model, &fitted, &fresh);
            sum.iter_mut()
                .zip(errors)
                .for_each(|(sum, error)| *sum += error / 6.0);
        }
    }
    let [[stated_alone, alone], [stated, with]] = sums;
    assert!(
        stated < 0.8 * stated_alone && with < 0.8 * alone,
        "{sums:?} m"
    );
    assert!(
        (0.6..1.6).contains(&(with / stated)),
        "off by {with:e} m, {stated:e} m stated"
    );
}

#[test]
fn a_level_alone_finds_the_offsets_of_joints_that_tilt_it() {
    let mut truth = Truth::new(fixture::seven(), Vector3::zeros());
    let is_offset = |name: &str| name.starts_with("joint_offset.");
    let specs = truth.model.stack.specs().to_vec();
    let others = specs
        .iter()
        .zip(&mut truth.model.x)
        .filter(|(spec, _)| !is_offset(&spec.name));
    others.for_each(|(_, value)| *value = 0.0);
    let so: BTreeMap<&str, f64> = specs
        .iter()
        .map(|spec| spec.name.as_str())
        .zip(truth.model.x.clone())
        .collect();
    let all = truth.rows(200);
    let recording = ingested(&select(&all, &upright(&all)), 1);
    let mut data = recording.measurements();
    data.points.position.fill(Vector3::zeros());
    data.points.sigma.fill(Vector3::repeat(f64::INFINITY));
    let (model, fitted) = truth.fit(&data, |name| {
        is_offset(name) || name.starts_with("tool_offset.r")
    });
    let free = model
        .stack
        .specs()
        .iter()
        .zip(&model.x)
        .zip(&fitted.statuses)
        .zip(&model.tolerances)
        .filter_map(|(((spec, value), fate), tolerance)| match fate {
            ParameterStatus::Free(sigma) if is_offset(&spec.name) && *sigma < 0.9 * tolerance => {
                Some((spec.name.as_str(), *value, *sigma))
            }
            _ => None,
        });
    let found: Vec<(&str, f64, f64)> = free.collect();
    // The first axis is vertical, and a turn of the last one is a turn of the level on the tool.
    let joints: Vec<&str> = found
        .iter()
        .map(|(name, ..)| name.trim_start_matches("joint_offset."))
        .collect();
    assert_eq!(joints, ["j2", "j3", "j4", "j5", "j6"]);
    for (name, value, sigma) in found {
        let pull = (value - so[name]) / sigma;
        assert!(
            pull.abs() < 4.0 && sigma < 2e-5,
            "{name}: {pull:.1} sigma off, sigma {sigma:e} rad"
        );
    }
}
