//! Real recordings: Panda arms whose ball lay in two printed sockets at several positions (platonics-delft/kinematics_calibration, MIT),
//! against the figures of an independent solver.

use super::{Named, fitted_with, places_of, priors};
use crate::answer::{read, root};
use crate::desk;
use crate::fixture;
use crate::fixture::robot_of;
use calib::description::RobotDescription;
use calib::estimate::{Model, scale};
use calib::robot::{Measurements, PointReadings, Readings};
use nalgebra::Vector3;
use std::collections::BTreeMap;

pub fn panda() -> RobotDescription {
    robot_of(&read(root("pipelines/sockets/robot.yaml")))
}

/// A folder's rows with the number of each in its own file; nothing, said, where the data are not at hand.
fn recording(folder: &str, without: &[&str]) -> Option<(Measurements, Vec<usize>)> {
    let root = desk::shared("data/mukca/data")?.join(folder);
    let entries = std::fs::read_dir(&root).unwrap();
    let mut positions: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    positions.sort();
    positions.retain(|position| !without.contains(&position.as_str()));
    let (mut q, mut names, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
    for (position, hole) in positions
        .iter()
        .flat_map(|position| [(position, 0), (position, 1)])
    {
        let text = read(root.join(position).join(format!("hole_{hole}.csv")));
        for (number, line) in text.lines().enumerate() {
            q.extend(
                line.split(',')
                    .map(|cell| cell.trim().parse::<f64>().unwrap()),
            );
            names.push(format!("{position}/{hole}"));
            numbers.push(number);
        }
    }
    let rows = names.len();
    let anchor = Some(Named::of(names.iter().map(String::as_str)));
    let data = Measurements {
        joints: 7,
        q,
        points: PointReadings::none(rows),
        payload: vec![0.0; rows],
        readings: vec![Readings {
            kind: "socket",
            width: 0,
            values: Vec::new(),
            sigma: vec![1e-4; rows],
            anchor,
        }],
        ..Measurements::default()
    };
    Some((data, numbers))
}

fn pairs(data: &Measurements) -> Vec<[String; 2]> {
    let names = &data.readings[0].anchor.as_ref().unwrap().names;
    names
        .iter()
        .filter_map(|name| name.strip_suffix("/0"))
        .map(|position| [format!("{position}/0"), format!("{position}/1")])
        .collect()
}

fn calibrate(
    data: &Measurements,
    rows: &[usize],
    effects: &[&str],
) -> (Model, calib::estimate::Fitted) {
    fitted_with(&panda(), data, rows, effects, &pairs(data), priors)
}

/// Mean distance, mm.
fn mean(distances: &[f64]) -> f64 {
    1e3 * distances.iter().sum::<f64>() / distances.len() as f64
}

/// Every fourth row of every file held out.
fn every_fourth(folder: &str, without: &[&str], effects: &[&str]) -> Option<f64> {
    let (data, numbers) = recording(folder, without)?;
    let (held, fit): (Vec<usize>, Vec<usize>) =
        (0..data.rows()).partition(|row| numbers[*row] % 4 == 3);
    let errors = calibrate(&data, &fit, effects).0.row_errors(&data);
    let held: Vec<f64> = held.iter().map(|row| errors[*row].length).collect();
    Some(mean(&held))
}

/// Every position in turn left out: each row against the place of the ball by the other rows of its socket.
fn by_position(folder: &str, without: &[&str], effects: &[&str]) -> Option<f64> {
    let (data, _) = recording(folder, without)?;
    let names: Vec<&str> = (0..data.rows())
        .map(|row| data.reading("socket", row).unwrap().anchor)
        .collect();
    let mut all = Vec::new();
    for [first, second] in pairs(&data) {
        let (held, fit): (Vec<usize>, Vec<usize>) =
            (0..data.rows()).partition(|row| names[*row] == first || names[*row] == second);
        let points = calibrate(&data, &fit, effects).0.predict(&data);
        for row in &held {
            let is_other = |other: &&usize| *other != row && names[**other] == names[*row];
            let others = held.iter().filter(is_other).map(|other| points[*other]);
            all.push((points[*row] - middle(&others.collect::<Vec<_>>())).norm());
        }
    }
    Some(mean(&all))
}

/// The geometric median, so that a slipped row moves it little (Weiszfeld).
fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    let mut at = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    for _ in 0..50 {
        let weight = |point: &Vector3<f64>| 1.0 / (point - at).norm().max(2e-4);
        let weights: f64 = points.iter().map(weight).sum();
        let sum: Vector3<f64> = points.iter().map(|point| point * weight(point)).sum();
        at = sum / weights;
    }
    at
}

const GEOMETRY: &[&str] = &["joint_offset", "link_geometry"];
const COMPLIANCE: &[&str] = &["joint_offset", "link_geometry", "joint_compliance"];
/// What an independent solver leaves, mean, mm: geometry, with compliance; the same with whole positions left out.
const REFERENCE: [(&str, &[&str], [f64; 4]); 4] = [
    ("panda_3", &[], [0.193, 0.152, 0.196, 0.162]),
    ("panda_2", &[], [0.347, 0.324, 0.366, 0.349]),
    ("panda_2", &["high"], [0.253, 0.226, 0.280, 0.260]),
    ("panda_7", &[], [0.314, 0.271, 0.448, 0.439]),
];
/// Of the reference, at most.
const SHARE: f64 = 1.05;

#[test]
fn held_out_rows_and_positions_close_as_an_independent_solver_closes_them() {
    let mut short = Vec::new();
    for (folder, without, figures) in REFERENCE {
        let effects = [GEOMETRY, COMPLIANCE, GEOMETRY, COMPLIANCE];
        for (k, (effects, expected)) in effects.into_iter().zip(figures).enumerate() {
            let judge = if k < 2 { every_fourth } else { by_position };
            let Some(mean) = judge(folder, without, effects) else {
                return;
            };
            if mean > SHARE * expected {
                short.push(format!(
                    "{folder} {without:?} {effects:?} {k}: {mean:.3} mm instead of {expected}"
                ));
            }
        }
    }
    assert!(short.is_empty(), "{}", short.join("\n"));
}

#[test]
fn the_scale_agrees_with_the_holes_of_the_tables() {
    type Holes = fn(&str) -> Vector3<f64>;
    for (arm, without, holes) in [
        ("panda_3", &[][..], hole as Holes),
        ("panda_2", &["high", "mid-high"], nearest_hole),
    ] {
        let Some((data, _)) = recording(arm, without) else {
            return;
        };
        let rows = fixture::all_rows(&data);
        for effects in [GEOMETRY, COMPLIANCE] {
            let (model, fitted) = calibrate(&data, &rows, effects);
            let scale = scale(&model, &data, &rows, fitted.covariance.as_ref());
            let sigma = scale.and_then(|scale| scale.sigma).unwrap();
            let found = against_holes(&model, holes);
            assert!(
                found.abs() < 2.0 * sigma,
                "{arm} {effects:?}: {found:+.2e} of the table, {sigma:.2e} stated"
            );
        }
    }
}

/// Holes of 25 mm in which the plates of panda_2 stood, forward and to the left of `front_right`; all sockets lie within 2 mm of such a
/// grid, and the second socket 50 mm to the right.
fn nearest_hole(name: &str) -> Vector3<f64> {
    let [forward, left] = match name.split('/').next().unwrap() {
        "back_left" => [-20.0, 22.0],
        "back_right" => [-20.0, -2.0],
        "front_center" => [-1.0, 10.0],
        "front_left" => [-1.0, 20.0],
        "front_right" => [0.0, 0.0],
        "mid_left" => [-10.0, 20.0],
        "mid_right" => [-10.0, 1.0],
        other => panic!("no hole of {other} is known"),
    };
    let second = if name.ends_with("/1") { 2.0 } else { 0.0 };
    Vector3::new(0.025 * forward, 0.025 * (left + second), 0.0)
}

/// Least squares alone makes the arm 7e-3 too small there; the reference with the volume term says +1.3e-3.
#[test]
fn without_a_length_the_volume_term_keeps_the_arm_from_shrinking() {
    let Some((data, _)) = recording("panda_3", &[]) else {
        return;
    };
    let rows: Vec<usize> = (0..data.rows()).collect();
    // 1 mm and 3 mrad of links.
    let wide = |name: &str| {
        let larger = if name.starts_with("link_geometry") {
            10.0 / 3.0
        } else {
            1.0
        };
        Some(super::priors(name)? * larger)
    };
    let (model, _) = fitted_with(&panda(), &data, &rows, GEOMETRY, &[], wide);
    let found = against_holes(&model, hole);
    assert!(found.abs() < 3e-3, "{found:+.2e}");
}

/// Holes of the table of panda_3, every 25 mm, as it was written down: front and back 150 mm apart, left and right 175 mm beside the middle
/// (`frontleft` 200), the second socket 50 mm to the right.
fn hole(name: &str) -> Vector3<f64> {
    let across = if name.starts_with("frontleft") {
        0.2
    } else {
        0.175
    };
    let side = if name.contains("left") {
        -1.0
    } else if name.contains("right") {
        1.0
    } else {
        0.0
    };
    let second = if name.ends_with("/1") { 0.05 } else { 0.0 };
    Vector3::new(
        if name.contains("front") { 0.15 } else { 0.0 },
        across * side + second,
        0.0,
    )
}

/// Relative difference of the distances between sockets from those between their holes in the table.
fn against_holes(model: &Model, hole: impl Fn(&str) -> Vector3<f64>) -> f64 {
    let places: BTreeMap<String, Vector3<f64>> = places_of(model);
    let pairs = places
        .iter()
        .flat_map(|a| places.iter().map(move |b| (a, b)))
        .filter(|(a, b)| a.0 < b.0);
    let (mut cross, mut square) = (0.0f64, 0.0f64);
    for ((a, p), (b, q)) in pairs {
        let (ours, table): (f64, f64) = ((p - q).norm(), (hole(a) - hole(b)).norm());
        assert!(
            (ours - table).abs() < 5e-3,
            "{a} and {b} are {ours:.4} m apart, their holes {table:.4} m"
        );
        (cross, square) = (cross + ours * table, square + table * table);
    }
    cross / square - 1.0
}
