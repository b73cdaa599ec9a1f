//! The library of arms: reach as published, axes as public models have them, and a run of each from `init --robot`.

use crate::answer::{calib, put};
use crate::fixture::spread;
use calib::robot::{LIBRARY, RobotModel};
use calib::spatial::Pose;
use calib::table::{Prediction, from_parquet};
use nalgebra::Vector3;
use serde_json::Value;
use std::fmt::Write;

fn reference() -> Value {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/reference/library/poses.json"
    );
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// mm between a public model and the file, where they are known to differ: shifts of meshes, angles of three decimals.
fn allowed(arm: &str) -> f64 {
    match arm {
        "iiwa14" => 0.9,
        "m1013" => 0.4,
        "gen3_7" => 0.01,
        _ => 0.001,
    }
}

#[test]
fn arms_of_the_library_stand_where_public_models_put_them() {
    let reference = reference();
    let mut compared = 0;
    for arm in LIBRARY {
        let robot = RobotModel::new(
            arm.read()
                .unwrap_or_else(|error| panic!("{}: {error}", arm.name))
                .robot,
        );
        let known = &reference[arm.name];
        assert!(
            known["reach_mm"].is_number(),
            "{}: tests/reference/library.py has to be run",
            arm.name
        );
        for pose in known["poses"].as_array().into_iter().flatten() {
            let numbers = |key: &str| {
                pose[key]
                    .as_array()
                    .unwrap()
                    .iter()
                    .map(|x| x.as_f64().unwrap())
                    .collect()
            };
            let (q, there): (Vec<f64>, Vec<f64>) = (numbers("q_rad"), numbers("point_mm"));
            let here = robot.forward(&q).translation * 1e3;
            let apart = (here - Vector3::from_row_slice(&there)).norm();
            assert!(apart <= allowed(arm.name), "{}: {apart} mm", arm.name);
            compared += 1;
        }
        assert!(
            known
                .get("largest_mm")
                .and_then(Value::as_f64)
                .is_none_or(|largest| largest <= allowed(arm.name)),
            "{}",
            arm.name
        );
    }
    assert!(compared >= 4 * 30, "{compared} poses");
}

/// Makers of cobots call a working radius what is smaller than the arm's own lengths.
const RADIUS: [&str; 9] = [
    "ur3e", "ur5", "ur5e", "ur10", "ur10e", "ur16e", "ur20", "panda", "tm12",
];

#[test]
fn lengths_reach_as_far_as_makers_publish() {
    for (name, known) in reference().as_object().unwrap() {
        let [here, published] =
            ["reach_mm", "published_mm"].map(|key| known[key].as_f64().unwrap());
        let off = (here - published) / published;
        assert!(
            if RADIUS.contains(&name.as_str()) {
                (-0.002..0.16).contains(&off)
            } else {
                off.abs() < 0.0015
            },
            "{name}: {here} for {published} mm"
        );
    }
}

/// On the flange, m.
pub(super) const REFLECTOR: Vector3<f64> = Vector3::new(0.06, 0.04, 0.05);

/// Where the tracker stands.
pub(super) fn tracker() -> Pose {
    Pose::from_rotation_vector(Vector3::new(0.02, -0.01, 0.7), Vector3::new(-2.5, 1.2, 0.4))
}

/// Where the joints really are: zeros are off by a milliradian or so.
pub(super) fn real(q: &[f64]) -> Vec<f64> {
    q.iter()
        .enumerate()
        .map(|(j, q)| q + if j % 2 == 0 { 0.0010 } else { -0.0015 })
        .collect()
}

/// A robot file of the library with the reflector's place on the flange, which a person fills in.
pub(super) fn on_flange(text: &str, arm: &str, robot: &RobotModel) -> String {
    let lines = text.lines().map(|line| match line.starts_with("tool: ") {
        true if text.contains("  screws:") => {
            let point = robot.home().point(&REFLECTOR) * 1e3;
            format!(
                "tool: {{point: [{:.1}, {:.1}, {:.1}]}}",
                point.x, point.y, point.z
            )
        }
        true if arm == "panda" => "tool: {point: [60, 40, 157]}".into(),
        true => "tool: {point: [60, 40, 50]}".into(),
        false => line.to_string(),
    });
    lines.collect::<Vec<String>>().join("\n")
}

/// Points of an arm with zeros that are a little off, seen from a tracker, in the counting of its controller.
pub(super) fn recording(robot: &RobotModel, coupled: &[calib::robot::CountedCoupling]) -> String {
    let joints = robot.joints();
    let mut text = String::from("point");
    (1..=joints).for_each(|j| write!(text, ",A{j}").unwrap());
    text.push_str(",x,y,z\n");
    for k in 0..160 {
        let range = |j: usize| {
            robot.description().joints[j]
                .limits
                .map_or([-2.0, 2.0], |limits| limits.map(|end| end.clamp(-2.6, 2.6)))
        };
        let q: Vec<f64> = (0..joints)
            .map(|j| range(j)[0] + spread(k, j) * (range(j)[1] - range(j)[0]))
            .collect();
        let point = tracker().point(&robot.forward(&real(&q)).point(&REFLECTOR));
        let mut shown = q.clone();
        for coupling in coupled.iter().rev() {
            shown[coupling.joint] += coupling.ratio * q[coupling.by];
        }
        write!(text, "P{k}").unwrap();
        shown
            .iter()
            .for_each(|q| write!(text, ",{:.5}", q.to_degrees()).unwrap());
        writeln!(
            text,
            ",{:.4},{:.4},{:.4}",
            1e3 * point.x,
            1e3 * point.y,
            1e3 * point.z
        )
        .unwrap();
    }
    text
}

#[test]
fn every_arm_of_the_library_goes_from_init_to_a_run() {
    for arm in LIBRARY {
        let read = arm.read().unwrap();
        let robot = RobotModel::new(read.robot.clone());
        let folder = tempfile::tempdir().unwrap();
        put(
            folder.path(),
            "measured.csv",
            recording(&robot, &read.about.coupled),
        );
        let run = |arguments: &str| calib(folder.path(), arguments).code(0).both();
        run(&format!(
            "init cell --data measured.csv --robot {}",
            arm.name
        ));
        let file = folder.path().join("cell/robot.yaml");
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, on_flange(&text, arm.name, &robot)).unwrap();
        run("check cell/pipeline.yaml");
        run("run cell/pipeline.yaml --until geometry --quiet");
        let name = "geometry.prediction.parquet";
        let bytes = std::fs::read(folder.path().join(".calib/tables/cell").join(name)).unwrap();
        let prediction: Prediction = from_parquet(name, bytes).unwrap().table;
        let rows = prediction
            .0
            .iter()
            .filter(|row| row.step == "geometry")
            .map(|row| row.error_mm)
            .collect::<Vec<f64>>();
        let mean = rows.iter().sum::<f64>() / rows.len() as f64;
        assert!(
            rows.len() == 160 && mean < 0.002,
            "{}: {} points, mean {mean} mm",
            arm.name,
            rows.len()
        );
    }
}
