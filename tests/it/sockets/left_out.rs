//! What no fitted row was brought to: whole places held out, and splits that say which.

use super::dirty::{SETTINGS, cell};
use super::{fixture, touched, truth};
use crate::recorded::{Recorded, tried};
use calib::description::RobotDescription;
use calib::stage::Identify;
use calib::stage::split::{SplitBy, SplitReads};
use calib::table::{Prediction, PredictionRow, Recording, Robot, Split};
use calib::twin::touch::Fixture;

fn split(yaml: &str, recording: &Recording) -> Result<Split, String> {
    let options = serde_saphyr::options! { strict_booleans: true };
    let settings: SplitBy = serde_saphyr::from_str_with_options(yaml, options).unwrap();
    let recording = recording.clone();
    let made = tried(&settings, SplitReads { recording });
    made.map(|made| made.get())
        .map_err(|error| error.to_string())
}

/// Predictions of an identification by the rows that a split says.
fn predicted(robot: &RobotDescription, recording: Recording, yaml: &str) -> Vec<PredictionRow> {
    let recorded = Recorded {
        robot: Robot::from_description(robot),
        split: split(yaml, &recording).unwrap(),
        recording,
    };
    let stage: Identify = serde_saphyr::from_str(SETTINGS).unwrap();
    recorded.identify_by(&stage).unwrap().get::<Prediction>().0
}

#[test]
fn a_place_that_no_row_was_fitted_to_closes_as_well_as_the_others() {
    let robot = fixture::seven();
    let recording = touched(&robot, &truth(&robot, 6), &cell(30), 6);
    let rows = predicted(
        &robot,
        recording,
        "{by: named, column: socket, names: [b/*]}",
    );
    let mean = |rows: &[&PredictionRow], error: fn(&PredictionRow) -> Option<f64>| {
        let all: Vec<f64> = rows.iter().filter_map(|row| error(row)).collect();
        assert_eq!(all.len(), 60);
        all.iter().sum::<f64>() / 60.0
    };
    let (held, fitted): (Vec<_>, Vec<_>) = rows.iter().partition(|row| row.held_out);
    // The mean length of a normal error of 0.06 mm per axis.
    let noise = 0.06 * (8.0 / std::f64::consts::PI).sqrt();
    let out = mean(&held, |row| Some(row.error_mm));
    assert!(
        (0.9..1.35).contains(&(out / noise)),
        "{out:.4} mm held out, {noise:.4} mm of noise"
    );
    let ours = mean(&fitted, |row| Some(row.error_mm));
    assert!(
        (0.8..1.1).contains(&(ours / noise)),
        "{ours:.4} mm fitted, {noise:.4} mm of noise"
    );
}

#[test]
fn blocks_of_a_cross_validation_are_whole_places() {
    let robot = fixture::seven();
    let recording = touched(&robot, &truth(&robot, 8), &cell(30), 8);
    let rows = predicted(&robot, recording, "{by: order, sets: [{set: fit}]}");
    let mean = |error: fn(&PredictionRow) -> Option<f64>| {
        rows.iter().filter_map(error).sum::<f64>() / rows.len() as f64
    };
    let (ours, random, places) = (
        mean(|row| Some(row.error_mm)),
        mean(|row| row.fold_error_mm),
        mean(|row| row.block_error_mm),
    );
    // Of two places, one alone tells the arm worse, but never millimetres off as where its sockets stood at nominal.
    assert!(
        ours < random && random < places && places < 3.0 * ours,
        "{ours:.4}, {random:.4}, {places:.4} mm"
    );
}

#[test]
fn rows_are_counted_anew_in_every_socket() {
    let robot = fixture::seven();
    let uneven: Vec<Fixture> = cell(6)
        .into_iter()
        .enumerate()
        .map(|(k, socket)| Fixture {
            points: 5 + k,
            ..socket
        })
        .collect();
    let recording = touched(&robot, &truth(&robot, 6), &uneven, 6);
    let dealt = split("{by: every, n: 4, within: socket}", &recording).unwrap();
    let held: Vec<&str> = dealt
        .0
        .iter()
        .filter(|row| row.set == "validate")
        .map(|row| row.point_id.as_str())
        .collect();
    assert_eq!(
        held,
        ["a/0-0004", "a/1-0004", "b/0-0004", "b/1-0004", "b/1-0008"]
    );
}

#[test]
fn names_and_columns_that_are_not_there_are_refused() {
    let robot = fixture::seven();
    let recording = touched(&robot, &truth(&robot, 6), &cell(6), 6);
    for (yaml, expected) in [
        (
            "{by: named, column: socket, names: [c/*]}",
            "with.names[0]: no row has such a name; there are: a/0, a/1, b/0, b/1",
        ),
        (
            "{by: every, n: 4, within: sphere}",
            "with.within: the recording has no names of `sphere`; it has: socket",
        ),
    ] {
        assert_eq!(split(yaml, &recording).expect_err("refused"), expected);
    }
}
