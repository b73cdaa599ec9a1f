//! calib as a library: the examples in the documentation of `src/lib.rs`, which are these files, do what they say.

mod diagnose;
mod identify;
mod tables;

use crate::answer::{calib, has, read, root};
use crate::fixture::{self, robot_of};
use crate::identify::{model, normal};
use crate::readme::example;
use calib::api::{Poses, Recording, Robot, Sigma};
use calib::effect::{Effect, EffectContext, EffectStack, Form, Load, arm_effect};
use calib::estimate::Model;
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::spatial::{Pose, Twist};
use nalgebra::Vector3;
use serde_json::json;

/// m, per axis.
const NOISE: f64 = 10e-6;

fn base() -> Pose {
    Pose::exp(&Twist::new(3.0, -1.5, 0.4, 0.02, -0.05, 2.2))
}

fn rows(robot: &RobotModel, count: usize) -> Measurements {
    Measurements {
        joints: robot.joints(),
        q: fixture::poses(robot.description(), count),
        points: PointReadings::new(vec![Vector3::zeros(); count], NOISE),
        payload: vec![0.0; count],
        ..Measurements::default()
    }
}

#[test]
fn an_arm_is_identified_from_arrays() {
    let text = example("calib_robot:");
    let robot = RobotModel::new(robot_of(&text));
    let mut data = rows(&robot, 60);
    let mut truth = model(&robot, base(), &["joint_offset"]);
    let third = truth
        .stack
        .specs()
        .iter()
        .position(|spec| spec.name == "joint_offset.j3")
        .unwrap();
    truth.x[third] = 1.5e-3;
    data.points.position = truth.predict(&data);
    let noisy = |(row, point): (usize, &Vector3<f64>)| {
        [0, 1, 2].map(|axis: usize| 1e3 * (point[axis] + NOISE * normal(3 * row + axis)))
    };
    let points: Vec<[f64; 3]> = data.points.position.iter().enumerate().map(noisy).collect();
    let found = identify::parameters(&text, data.q, points).unwrap();
    let zero = found
        .iter()
        .find(|one| one.name == "joint_offset.j3")
        .unwrap();
    let sigma = zero.sigma.unwrap();
    assert!(
        (zero.value - 1.5e-3).abs() < 4.0 * sigma && sigma < 1e-3,
        "{} +- {sigma}",
        zero.value
    );
    // Nothing is held; what no point shows stands by its tolerance, the zero of the first joint among it.
    assert!(found.iter().all(|one| one.status == "free"));
    let by_tolerance = |one: &&_| {
        let one: &calib::table::ParameterRow = one;
        one.determined.as_deref() == Some("by tolerance")
    };
    let mut open = found.iter().filter(by_tolerance);
    assert!(open.any(|one| one.name == "joint_offset.j1"));
}

#[test]
fn missing_physics_is_named_from_arrays() {
    let robot = RobotModel::new(fixture::spherical());
    let mut data = rows(&robot, 160);
    let gear = json!({"gear_cyclic": {
        "motion": {"joint": {"joint": 2}},
        "law": {"of": {"angle": {"joint": 2}}, "basis": {"wave": {"order": 5, "overtone": false}}},
    }});
    let gear: Box<dyn Effect> = Box::new(serde_json::from_value::<Form>(gear).unwrap());
    let context = EffectContext {
        base: base(),
        load: Load::GravityTorque,
    };
    let effects = vec![arm_effect("joint_offset", &context).unwrap(), gear];
    let mut truth = Model::nominal(robot.clone(), EffectStack::new(&robot, base(), effects));
    let sine = truth.x.len() - 2;
    truth.x[sine] = 1e-4;
    data.points.position = truth.predict(&data);
    let noisy = |(k, point): (usize, &Vector3<f64>)| {
        let noise = Vector3::new(normal(3 * k), normal(3 * k + 1), normal(3 * k + 2)) * NOISE;
        <[f64; 3]>::from((point + noise) * 1e3)
    };
    let recording = Recording {
        points_mm: data.points.position.iter().enumerate().map(noisy).collect(),
        poses: Poses {
            joints_rad: data.q.clone(),
            ..Poses::default()
        },
        sigma: Sigma::Mm(vec![NOISE * 1e3]),
        ..Recording::default()
    };
    let robot = Robot {
        description: robot.description().clone(),
        notes: Vec::new(),
    };
    let found = diagnose::missing_physics(&robot, &recording).unwrap();
    let answer = found.summary.document("");
    let finding = &answer["findings"][0];
    assert_eq!(
        (
            &answer["verdict"],
            &finding["effect"],
            &finding["where"],
            answer["findings"].as_array().map(Vec::len)
        ),
        (
            &json!("explained"),
            &json!("gear_cyclic"),
            &json!("joint 3"),
            Some(1)
        ),
        "{answer}"
    );
    let statement = finding["statement"].as_str().unwrap_or_default();
    has(statement, "5 times a turn by 20.8 arcsec");
}

#[test]
fn the_tables_of_a_run_are_read_as_rust_values() {
    let store = tempfile::tempdir().unwrap();
    let pipeline = root("tests/it/resume/pipeline.yaml");
    let store_name = store.path().display();
    calib(
        ".",
        &format!("run {} --quiet --store {store_name}", pipeline.display()),
    )
    .ok();
    let worst = |step| tables::worst_points(store.path(), "HEAD", step).unwrap();
    let (nominal, geometry) = (worst("nominal"), worst("geometry"));
    assert_eq!((nominal.len(), geometry.len()), (20, 20));
    assert!(geometry.windows(2).all(|pair| pair[0].1 >= pair[1].1));
    assert!(
        geometry[0].1 < 0.2 && nominal[0].1 > 2.0 * geometry[0].1,
        "{} after {}",
        geometry[0].1,
        nominal[0].1
    );
    assert!(tables::worst_points(store.path(), "HEAD", "network").is_err());
}

#[test]
fn the_documentation_shows_these_files() {
    let text = read(root("src/lib.rs"));
    for name in ["identify", "diagnose", "tables"] {
        assert!(
            text.contains(&format!(
                "#![doc = include_str!(\"../tests/it/library/{name}.rs\")]"
            )),
            "{name}"
        );
    }
}
