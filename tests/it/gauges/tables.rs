//! Targets, orientations and distances as tables: identified, stored and read back.

use super::{Cell, THREE};
use crate::answer::has;
use crate::fixture;
use crate::recorded::{Recorded, settings};
use calib::effect::Load;
use calib::robot::{Measurements, Named, RobotModel};
use calib::spatial::Pose;
use calib::table::{Parameters, Prediction, Recording, Table};
use nalgebra::{Matrix3, Vector3};
use serde_json::json;
use std::collections::BTreeMap;

/// The cell as tables: the robot, a recording of it, and rows that are all to be fitted.
fn tables(cell: &Cell, data: &Measurements) -> Recorded {
    let rows = data.rows();
    let measured = |row: usize| {
        [0, 1, 2].map(|k| {
            if data.points.sigma[row][k].is_finite() {
                data.points.position[row][k]
            } else {
                f64::NAN
            }
        })
    };
    let vector = |rotation: &[f64]| -> [f64; 3] {
        Pose::new(Matrix3::from_column_slice(rotation), Vector3::zeros())
            .rotation_vector()
            .into()
    };
    let names = |named: &Named| {
        (0..rows)
            .map(|row| Some(named.name(row).to_string()))
            .collect()
    };
    let recording = Recording {
        joints: data.joints,
        prismatic: vec![false; data.joints],
        sequence: (0..rows as i64).collect(),
        point_id: (0..rows).map(|row| format!("P{row}")).collect(),
        usage: vec![None; rows],
        q: data.q.clone(),
        position: (0..rows).map(measured).collect(),
        target: data.target.as_ref().map(names),
        readings: readings(data, vector),
        names: data
            .readings
            .iter()
            .filter_map(|all| Some(("anchor", names(all.anchor.as_ref()?))))
            .collect(),
        ..Recording::default()
    };
    let recording = Recording::from_frame(&recording.to_frame().unwrap()).unwrap();
    Recorded::fitted(&cell.description, recording)
}

/// What is beside points, by setting.
fn readings(
    data: &Measurements,
    vector: impl Fn(&[f64]) -> [f64; 3],
) -> BTreeMap<&'static str, Vec<f64>> {
    let mut out = BTreeMap::new();
    for all in &data.readings {
        let (name, sigma, values) = match all.kind {
            "orientation" => (
                "orientation",
                "sigma_orientation",
                all.values.chunks(9).flat_map(&vector).collect(),
            ),
            "distance" => ("distance", "sigma_distance", all.values.clone()),
            other => panic!("{other}"),
        };
        out.extend([(name, values), (sigma, all.sigma.clone())]);
    }
    out
}

#[test]
fn a_model_read_back_from_its_table_measures_what_was_measured() {
    let cell = Cell::new(fixture::offset_wrist(), &THREE, 9);
    let mut data = cell.rows(40, 0);
    cell.disturb(&mut data);
    cell.turn(&mut data);
    cell.reach(
        &mut data,
        &[
            ("N", Vector3::new(4.0, 1.0, 0.3)),
            ("S", Vector3::new(1.0, -3.0, 0.2)),
        ],
        3e-5,
    );
    for row in 90..120 {
        data.points.sigma[row] = Vector3::repeat(f64::INFINITY);
        data.points.position[row] = Vector3::zeros();
    }
    let recorded = tables(&cell, &data);
    let made = recorded.identify(json!({"targets": {"A": [119.0, 1.0, 30.0]}, "screen": false}));
    let parameters: Parameters = made.get();
    let placed = |name: &str| {
        parameters
            .0
            .iter()
            .find(|row| row.name == name)
            .map_or(f64::NAN, |row| row.value)
    };
    // The tool frame lies along the base at the zero pose.
    let [x, y] = ["tool_offset.B.x", "tool_offset.C.y"].map(placed);
    assert!(
        (x + 60.0).abs() < 1.5 && (y + 80.0).abs() < 1.5,
        "{x} mm, {y} mm"
    );
    assert!(
        (placed("anchor.N.x") - 4000.0).abs() < 0.5,
        "{} mm",
        placed("anchor.N.x")
    );
    let model = parameters
        .model(
            RobotModel::new(cell.description.clone()),
            &[],
            Load::GravityTorque,
        )
        .unwrap();
    let ours = recorded.recording.measurements();
    let errors = model.row_errors(&ours);
    let prediction: Prediction = made.get();
    for (row, error) in prediction.0.iter().zip(&errors) {
        assert!(
            (row.error_mm - error.length * 1e3).abs() < 1e-6,
            "{}: {} and {}",
            row.point_id,
            row.error_mm,
            error.length * 1e3
        );
        assert!((row.turn_rad.unwrap() - error.angle.unwrap()).abs() < 1e-9);
        assert_eq!(
            row.measured.as_deref(),
            (row.sequence >= 90).then_some("rotation distance")
        );
    }
    for rank in ["rank", "rank_expected"] {
        assert_eq!(made.quantity(rank), Some(24.0 + 18.0 + 6.0));
    }
}

#[test]
fn a_target_that_the_recording_does_not_have_is_named_with_those_it_has() {
    let cell = Cell::new(fixture::offset_wrist(), &THREE, 9);
    let stage = settings(json!({"targets": {"D": [1.0, 2.0, 3.0]}}));
    let error = tables(&cell, &cell.rows(20, 0))
        .identify_by(&stage)
        .err()
        .unwrap();
    assert_eq!(error.exit_code(), 2);
    has(
        &error.to_string(),
        "with.targets.D: the recording has no such target; it has: A, B, C",
    );
}
