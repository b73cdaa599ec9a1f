//! What the numbers of a finding cannot be is no name of it: `unknown` stands at its place, and the statement says why.

use super::{rms, simulated, wanted};
use crate::answer::{has, starts_with};
use calib::effect::{Form, Survey};
use calib::robot::{Measurements, PointReadings, RobotModel};
use nalgebra::Vector3;
use serde_json::{Value, json};

/// A recording of a loaded arm over 1000 s.
fn recorded(robot: &RobotModel) -> Measurements {
    let rows = 100;
    let angle = |k: usize| 1.2 * (k as f64 * 0.618_033_988_749_895).rem_euclid(1.0) - 0.6;
    Measurements {
        joints: robot.joints(),
        q: (0..rows * robot.joints()).map(angle).collect(),
        points: PointReadings::new(vec![Vector3::new(1.0, 0.2, 0.7); rows], 2e-5),
        payload: vec![10.0; rows],
        time: Some(
            (0..rows)
                .map(|row| 1000.0 * row as f64 / (rows - 1) as f64)
                .collect(),
        ),
        ..Measurements::default()
    }
}

/// Why a form with these numbers (and two standard errors of `error`) cannot be its cause, in that recording under these loads.
fn why(form: Value, numbers: &[f64], error: f64, torque: f64) -> Option<String> {
    let robot = RobotModel::new(crate::fixture::offset_wrist());
    let data = recorded(&robot);
    let rows: Vec<usize> = (0..100).collect();
    let torques = vec![torque; 100 * robot.joints()];
    let compliance = vec![1e-6; robot.joints()];
    let survey = Survey::new(&robot, &data, &rows, &torques, &compliance);
    let form: Form = serde_json::from_value(form).unwrap();
    form.impossible(numbers, &|_| error, &survey)
}

fn law(motion: Value, title: Value, basis: Value) -> Value {
    json!({ "motion": motion, "law": { "of": title, "basis": basis } })
}

#[test]
fn a_bend_lies_within_the_loads_that_were_recorded() {
    let bent = |shape: &str, at: f64| json!({ "joint_hardening": { "joint": 1, "law": { shape: { "at_nm": at } } } });
    for shape in ["knee", "soft_zone", "saturating"] {
        // The model's loads reach 5 Nm, and those of the robot file more.
        assert_eq!(why(bent(shape, 4.9), &[1e-6, 1e-6], 0.0, 5.0), None);
        let printed = why(bent(shape, 14.0), &[1e-6, 1e-6], 0.0, 5.0).unwrap();
        assert_eq!(
            printed,
            "its bend at 14 Nm lies beyond the largest recorded load of 5.0 Nm"
        );
        // A load that only a model makes is not recorded.
        assert!(why(bent(shape, 9e5), &[1e-6, 1e-6], 0.0, 1e6).is_some());
    }
    let pushed = |friction: f64| {
        json!({ "backlash": law(
        json!({ "joint": { "joint": 1 } }), json!({ "push": { "joint": 1, "friction_nm": friction } }), json!("sign")) })
    };
    assert_eq!(why(pushed(4.0), &[1e-5], 0.0, 5.0), None);
    assert!(
        why(pushed(-6.0), &[1e-5], 0.0, 5.0)
            .is_some_and(|printed| printed.contains("threshold of 6.0 Nm"))
    );
    assert_eq!(
        why(pushed(4.0), &[-1e-5], 4e-6, 5.0).as_deref(),
        Some("its gap is negative")
    );
}

#[test]
fn a_time_constant_is_less_than_ten_recordings() {
    let growing = |constant: f64| {
        json!({ "thermal_growth": law(
        json!({ "links": { "first": 1, "last": 1 } }), json!("time"), json!({ "settling": { "start": 0.0, "constant": constant } })) })
    };
    assert_eq!(why(growing(5000.0), &[3e-4], 0.0, 5.0), None);
    let printed = why(growing(10_000.0), &[3e-4], 0.0, 5.0).unwrap();
    assert_eq!(
        printed,
        "its time constant of 10000 s is ten times as long as the recording (1000 s)"
    );
}

#[test]
fn nothing_grows_by_more_than_its_material_and_nothing_lags_by_less_than_nothing() {
    let linear = json!({ "linear": { "zero": 20.0, "per": 1.0 } });
    let link = json!({ "thermal_growth": law(json!({ "links": { "first": 1, "last": 1 } }), json!("temperature"), linear.clone()) });
    assert_eq!(why(link.clone(), &[24e-6], 1e-6, 5.0), None);
    let printed = why(link.clone(), &[85e-6], 1e-6, 5.0).unwrap();
    assert_eq!(
        printed,
        "85 um/m for each kelvin is more than the 70 of any material of links"
    );
    assert_eq!(
        why(link, &[-12e-6], 1e-6, 5.0).as_deref(),
        Some("links do not shrink as they warm up")
    );
    let mut air = json!({ "tracker_refraction": law(json!({ "instrument": { "of": "range" } }), json!("temperature"), linear) });
    air["tracker_refraction"]["law"]["times"] =
        json!({ "of": "range", "basis": { "linear": { "zero": 0.0, "per": 1.0 } } });
    assert_eq!(why(air.clone(), &[-1.2e-6], 1e-7, 5.0), None);
    assert!(
        why(air, &[-76e-6], 1e-6, 5.0).is_some_and(
            |printed| printed.starts_with("76 um/m for each kelvin is more than the 5")
        )
    );
    let lag = |by: &str| json!({ "joint_log_lag": { "each": false, "by": by } });
    assert_eq!(why(lag("move"), &[1e-3], 1e-4, 5.0), None);
    assert!(
        why(lag("move"), &[-1e-3], 1e-4, 5.0).is_some()
            && why(lag("synchronous"), &[-1e-3], 1e-4, 5.0).is_some()
    );
    // Which of two clocks is early is nobody's law.
    assert_eq!(why(lag("clock"), &[-1e-3], 1e-4, 5.0), None);
}

#[test]
fn joints_that_lag_by_less_than_nothing_have_no_name_and_the_model_is_the_same() {
    let answer = simulated("{joint_log_lag: {share: -0.002}}", 3, 120);
    let finding = &answer["findings"][0];
    assert_eq!(
        (&finding["effect"], &finding["where"]),
        (&"unknown".into(), &"recording".into()),
        "{answer:#}"
    );
    let statement = finding["statement"].as_str().unwrap();
    starts_with(statement, "something unknown acts at recording");
    has(statement, "joint_log_lag");
    let rivals = finding["rivals"].as_array().unwrap();
    assert!(
        rivals
            .iter()
            .all(|rival| rival["effect"] != "joint_log_lag"),
        "{answer:#}"
    );
    // What has no name still reproduces the error.
    assert!(
        rms(&answer, "after") < 0.5 * rms(&answer, "before") && answer["verdict"] == "unexplained",
        "{answer:#}"
    );
    let same = simulated("{joint_log_lag: {share: 0.002}}", 3, 120);
    assert!(
        wanted(&same["findings"]).contains(&("joint_log_lag".into(), "recording".into())),
        "{same:#}"
    );
}
