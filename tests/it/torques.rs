//! Torques of moving arms through the real command: practice recordings, recordings of the twin, bad input.

mod changes;
mod concealed;
mod excite;
mod feed_forward;
mod friction;
mod hostile;
mod masses;
mod nulls;
mod own_laws;
mod play;
mod recordings;
mod results;
mod rigid;
mod servo;
mod sliding;

use crate::answer::{Answer, calib, put, read, root};
use crate::bags::ARM;
use crate::desk::shared;
use calib::dynamics::{DynamicArm, INERTIAL_NUMBERS, InverseDynamics, MotionRow};
use calib::twin::conceal::design::Design;
use calib::twin::folder::File;
use calib::twin::torque::{Body, TorqueCase};
use rigid::{bare, ten};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// An effect and where it sits.
type Named = (String, String);

/// Recordings without an effect.
fn nothing(seed: u64) -> Design {
    Design {
        seed,
        cases: 20,
        nulls: 1.0,
        other_forms: 0.0,
        seconds: 32.0,
        rate: 50.0,
        ..Design::default()
    }
}

fn named(entry: &Value) -> Named {
    let text = |key: &str| entry[key].as_str().unwrap().to_string();
    (text("effect"), text("where"))
}

fn all_named(entries: &Value) -> Vec<Named> {
    entries.as_array().unwrap().iter().map(named).collect()
}

/// `calib diagnose` of a folder, with a store beside it.
fn diagnose(case: &Path, store: &Path, more: &str) -> Answer {
    let pipeline = root("pipelines/dynamics/pipeline.yaml");
    let (case, store, pipeline) = (case.display(), store.display(), pipeline.display());
    calib(
        ".",
        &format!("diagnose --quiet --set case={case} --store {store} {more} {pipeline}"),
    )
}

/// The document of a diagnosis that succeeds.
fn document(case: &Path, store: &Path) -> Value {
    serde_json::from_str(&diagnose(case, store, "--json").ok()).unwrap()
}

#[test]
fn torques_of_a_real_arm_are_predicted_on_rows_that_no_cause_was_fitted_to() {
    let Some(bags) = shared("data/ur10_bags") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let bag = bags.join("ur10_exciting_trajectory.db3");
    let columns = |what: &str| ARM.map(|joint| format!("{joint}.{what}"));
    let columns = serde_json::json!({
        "time": {"column": "stamp", "unit": "s"},
        "q": {"columns": columns("position"), "unit": "rad"},
        "velocity": {"columns": columns("velocity"), "unit": "rad/s"},
        // Motor currents; without constants their unit is that of the masses.
        "torque": {"columns": columns("effort"), "unit": "Nm"},
    });
    let pipeline = serde_json::json!({"calib": 1, "name": "bag", "stages": [
        {"uses": "robot", "with": {"file": root("pipelines/ur10/robot.yaml")}},
        {"uses": "ingest_torques", "with": {"files": [{"file": bag, "topic": "/joint_states", "columns": columns}]}},
        {"uses": "diagnose_torques", "with": {"hold_out": {"last": 0.4}, "cutoff_hz": 6}},
    ]});
    put(&folder, "pipeline.yaml", pipeline.to_string());
    let found: Value =
        serde_json::from_str(&calib(folder.path(), "diagnose pipeline.yaml --json --quiet").ok())
            .unwrap();
    let error = found["after"]["validate_nrmse"].as_f64().unwrap();
    assert!(
        error <= 0.105,
        "{error} of the torques' rms about their mean"
    );
}

/// What of a diagnosis is missed, and what is named beside.
struct Marks {
    missed: Vec<String>,
    also: Vec<Named>,
}

fn mark(want: &Value, answer: &Value) -> Marks {
    let all = all_named(&answer["findings"]);
    let mut marks = Marks {
        missed: Vec::new(),
        also: all.clone(),
    };
    for entry in want["effects"].as_array().unwrap() {
        let text = |value: &Value| value.as_str().unwrap().to_string();
        let accepted = entry["accept"].as_array().unwrap().iter();
        let accepted = accepted.map(|pair| (text(&pair[0]), text(&pair[1])));
        let accepted: Vec<Named> = accepted.collect();
        // One name may stand for two effects that the data cannot separate.
        let hit = all.iter().any(|one| accepted.contains(one));
        marks.also.retain(|one| !accepted.contains(one));
        if !hit && entry["optional"].as_bool() != Some(true) {
            marks.missed.push(format!(
                "{} at {} (L {:.0})",
                accepted[0].0,
                accepted[0].1,
                entry["L"].as_f64().unwrap_or(0.0)
            ));
        }
    }
    marks
}

fn write(folder: &Path, files: &[File]) {
    std::fs::create_dir_all(folder).unwrap();
    files
        .iter()
        .for_each(|(name, text)| put(folder, name, text));
}

fn json(path: PathBuf) -> Value {
    serde_json::from_str(&read(path)).unwrap()
}

#[test]
fn the_practice_recordings_of_torques_are_solved() {
    let Some(folder) = shared("practice_dynamics") else {
        return;
    };
    let store = tempfile::tempdir().unwrap();
    let mut wrong = Vec::new();
    let mut cases: Vec<PathBuf> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    cases.sort();
    for case in cases.iter().filter(|case| case.join("want.json").is_file()) {
        let answer = document(case, store.path());
        let want = json(case.join("want.json"));
        let marks = mark(&want, &answer);
        if !(marks.missed.is_empty() && marks.also.is_empty()) {
            wrong.push(format!(
                "{}: missed {:?}, named beside {:?}",
                case.display(),
                marks.missed,
                marks.also
            ));
        }
        // A push begins within 0.3 s of when it did.
        let effects = want["effects"].as_array().unwrap().iter();
        for began in effects.filter_map(|entry| entry["window"][0].as_f64()) {
            let findings = answer["findings"].as_array().unwrap().iter();
            let contacts = findings.filter(|finding| finding["effect"] == "contact");
            let numbers = contacts.flat_map(|finding| finding["parameters"].as_array().unwrap());
            let starts = numbers.filter(|number| number["name"] == "start");
            let near = |start: f64| (start - began).abs() < 0.3;
            assert!(
                starts
                    .filter_map(|number| number["value"].as_f64())
                    .any(near),
                "{}: no contact starts near {began} s",
                case.display()
            );
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_example_of_torques_is_solved_and_reported() {
    let store = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let example = root.join("pipelines/dynamics/example");
    let answer = document(&example, store.path());
    let found = all_named(&answer["findings"]);
    let mut wanted = all_named(&json(example.join("truth.json"))["effects"]);
    wanted.retain(|one| !found.contains(one));
    assert_eq!(wanted, Vec::<Named>::new(), "hidden and not found");
    let (store, pipeline) = (
        store.path().display(),
        root.join("pipelines/dynamics/pipeline.yaml"),
    );
    calib(
        ".",
        &format!("run --quiet --store {store} {}", pipeline.display()),
    )
    .ok();
    let folder = tempfile::tempdir().unwrap();
    let page = |name: &str, more: &str| {
        let (file, pipeline) = (folder.path().join(name), pipeline.display());
        let file = file.display();
        let answer = calib(
            ".",
            &format!("diagnose --quiet --store {store} {pipeline} --html {file}{more}"),
        );
        assert_eq!((answer.code, &*answer.err), (Some(0), ""), "{name}");
        std::fs::read_to_string(file.to_string()).unwrap()
    };
    let english = page("torques.html", "");
    // Six joints over time, two of them over speed and load, and friction where it was found.
    assert!(english.matches("<svg").count() >= 16, "{english}");
    assert!(english.len() < 2_500_000, "{} bytes", english.len());
    // All of it: what stays English is warned of.
    let german = page("momente.html", " --language de");
    assert!(
        german.contains("Gelenk 2 hat eine Trockenreibung von 14,"),
        "{german}"
    );
}

/// Two mathematics that share nothing: sums over the bodies beyond each joint, and the estimator's recursion.
#[test]
fn torques_of_the_twin_are_those_of_the_estimators_inverse_dynamics() {
    let design = Design {
        seconds: 16.0,
        rate: 20.0,
        ..nothing(3)
    };
    for number in 0..6 {
        let case = TorqueCase::draw(&design, number);
        let (arm, theta) = declared(&case);
        let mut dynamics = InverseDynamics::new(&arm);
        let gravity = arm.gravity;
        for (state, torque) in case.rigid() {
            let mut torque_of_joint = vec![0.0; torque.len()];
            let motion = MotionRow {
                position: &state.q,
                velocity: &state.v,
                acceleration: &state.a,
            };
            dynamics.torque(motion, &gravity, &theta, &mut torque_of_joint);
            let largest = torque.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
            for (one, other) in torque_of_joint.iter().zip(&torque) {
                assert!(
                    (one - other).abs() < 1e-9 * largest,
                    "{} Nm and {} Nm",
                    one,
                    other
                );
            }
        }
    }
}

/// The arm of a case, and the ten numbers of each link about its joint's point, payload on the last, by the parallel-axis rule.
fn declared(case: &TorqueCase) -> (DynamicArm, Vec<f64>) {
    let robot = &case.robot;
    let last = robot.joints.len() - 1;
    let mut theta = vec![0.0; INERTIAL_NUMBERS * robot.joints.len()];
    let mut add = |link: usize, mass: f64, centre: [f64; 3], inertia: [f64; 6]| {
        let body = Body {
            mass,
            centre,
            inertia,
        };
        let ten = ten(&body, robot.joints[link].point);
        let sums = theta[INERTIAL_NUMBERS * link..].iter_mut().zip(ten);
        sums.for_each(|(sum, value)| *sum += value);
    };
    for (link, (joint, moments)) in robot.joints.iter().zip(&robot.inertias.links).enumerate() {
        let (mass, centre) = (joint.mass.unwrap(), joint.centre.unwrap());
        add(link, mass, centre, moments.unwrap());
    }
    let inertia = robot.inertias.payload.unwrap();
    add(last, robot.payload_mass, robot.payload_centre, inertia);
    let axes: Vec<[f64; 3]> = robot.joints.iter().map(|joint| joint.axis).collect();
    let points: Vec<[f64; 3]> = robot.joints.iter().map(|joint| joint.point).collect();
    let arm = DynamicArm {
        tool: robot.tool.into(),
        ..bare(&axes, &points, robot.gravity)
    };
    (arm, theta)
}
