//! Commands and responses through the real command: practice recordings beside the repository, and bad input.

use crate::answer::{Answer, calib, put, read, root};
use crate::desk::shared;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

fn diagnose(case: &Path, store: &Path) -> Answer {
    let pipeline = root("pipelines/drives/pipeline.yaml");
    let (case, store, pipeline) = (case.display(), store.display(), pipeline.display());
    calib(
        ".",
        &format!("diagnose --quiet --json --set case={case} --store {store} {pipeline}"),
    )
}

/// A practice case and its diagnosis; `None` where recordings are missing.
fn practice(case: &str) -> Option<Value> {
    let folder: PathBuf = shared("practice_drives")?.join(case);
    let store = tempfile::tempdir().unwrap();
    let answer = diagnose(&folder, store.path());
    assert_eq!(answer.code, Some(0), "{case}: {}", answer.err);
    Some(answer.json())
}

fn named(document: &Value) -> Vec<(String, String)> {
    let findings = document["findings"].as_array().unwrap().iter();
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_string();
    findings
        .map(|finding| (text(finding, "effect"), text(finding, "where")))
        .collect()
}

#[test]
fn of_an_arm_whose_masses_are_off_within_their_tolerance_nothing_is_named() {
    let Some(document) = practice("p03") else {
        return;
    };
    assert_eq!(document["findings"], json!([]));
    let left = document["after"]["validate_rms_mrad"].as_f64().unwrap();
    let noise = document["noise_mrad"].as_f64().unwrap();
    assert!(left < 1.05 * noise, "{left} of {noise}");
}

#[test]
fn friction_that_grows_with_the_load_is_named_at_its_joint() {
    let Some(document) = practice("p09") else {
        return;
    };
    let expected = ("load_friction".to_string(), "joint 3".to_string());
    assert_eq!(named(&document), [expected]);
}

/// The store in which the example is diagnosed, and its pipeline.
fn example() -> &'static (TempDir, String) {
    static DONE: OnceLock<(TempDir, String)> = OnceLock::new();
    DONE.get_or_init(|| {
        let store = tempfile::tempdir().unwrap();
        let pipeline = root("pipelines/drives/pipeline.yaml");
        (store, pipeline.display().to_string())
    })
}

/// What a verb says of the example.
fn of_the_example(verb: &str) -> Answer {
    let (store, pipeline) = example();
    let store = store.path().display();
    calib(".", &format!("{verb} --store {store} {pipeline}"))
}

#[test]
fn the_example_is_diagnosed_as_cloned_and_its_concealed_causes_are_named() {
    let truth = root("pipelines/drives/example/truth.json");
    let document = of_the_example("diagnose --quiet --json").json();
    let truth: Value = serde_json::from_str(&read(truth)).unwrap();
    let concealed = truth["effects"].as_array().unwrap().iter();
    let mut concealed: Vec<(String, String)> = concealed
        .map(|effect| ["effect", "where"].map(|key| effect[key].as_str().unwrap().to_string()))
        .map(|[effect, place]| (effect, place))
        .collect();
    let mut found = named(&document);
    concealed.sort();
    found.sort();
    assert_eq!(found, concealed);
    let rms = |when: &str| document[when]["validate_rms_mrad"].as_f64().unwrap();
    assert!(rms("before") > 5.0 && rms("after") < 0.7, "{document}");
}

/// An arm of one joint with its drive and 2 s of a recording.
struct Folder {
    robot: String,
    drives: Value,
    recording: String,
}

fn folder() -> Folder {
    let robot = r#"<mujoco><compiler angle="radian"/><worldbody><body name="link">
        <joint name="j1" axis="0 1 0" damping="0.1" armature="0.01"/><inertial pos="0.1 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/>
        </body></worldbody></mujoco>"#;
    let joint = json!({ "joint": "j1", "kp": 20.0, "kd": 0.5, "kd_on": "speed", "torque_limit_nm": 5.0, "encoder_rad": 1e-3, "noise_rad": 1e-4 });
    let rows = (0..200).map(|row| {
        let angle = 0.4 * (0.05 * f64::from(row)).sin();
        format!(
            "{:.2},1,fit,{angle:.5},{:.5}\n",
            0.01 * f64::from(row),
            0.9 * angle
        )
    });
    Folder {
        robot: robot.into(),
        drives: json!({ "command_rate_hz": 100.0, "joints": [joint] }),
        recording: "time_s,traj,use,cmd1_rad,q1_rad\n".to_string() + &rows.collect::<String>(),
    }
}

impl Folder {
    /// What is said of it.
    fn refused(&self) -> String {
        let case = tempfile::tempdir().unwrap();
        put(case.path(), "robot.xml", &self.robot);
        put(case.path(), "drives.json", self.drives.to_string());
        put(case.path(), "recording.csv", &self.recording);
        let store = tempfile::tempdir().unwrap();
        let answer = diagnose(case.path(), store.path());
        assert_ne!(answer.code, Some(0), "{}", answer.out);
        answer.both()
    }
}

#[test]
fn bad_input_of_drives_is_refused_with_its_place_and_what_is_allowed() {
    let says = |folder: &Folder, texts: &[&str]| {
        let said = folder.refused();
        for text in texts {
            assert!(said.contains(text), "expected `{text}` in: {said}");
        }
    };
    let mut bare = folder();
    bare.robot = bare.robot.replace(
        "<inertial pos=\"0.1 0 0\" mass=\"0.5\" diaginertia=\"0.001 0.001 0.001\"/>",
        "",
    );
    says(&bare, &["robot.xml", "body `link` has no <inertial>"]);
    let mut other = folder();
    other.drives["joints"][0]["joint"] = "shoulder".into();
    says(
        &other,
        &["no hinge or slide joint `shoulder`", "joints: j1"],
    );
    let mut looped = folder();
    looped.robot = looped.robot.replace(
        "</worldbody>",
        "</worldbody><equality><weld body1=\"link\"/></equality>",
    );
    says(&looped, &["<weld> closes a loop"]);
    let mut gainless = folder();
    gainless.drives["joints"][0]["kp"] = Value::Null;
    says(&gainless, &["joints[0].kp", "no position actuator"]);
    let mut columns = folder();
    columns.recording = columns.recording.replace("q1_rad", "pos1");
    says(&columns, &["no column `q1_rad`", "columns: time_s"]);
    let mut blank = folder();
    blank.recording = blank.recording.replace("0.50,1,fit,", "0.50,1,fit,x");
    says(&blank, &["recording.csv:52", "expected a finite number"]);
    let mut rate = folder();
    rate.drives["command_rate_hz"] = 50.0.into();
    says(&rate, &["command_rate_hz"]);
    let mut backwards = folder();
    backwards.recording = backwards.recording.replace("\n0.50,", "\n0.48,");
    says(&backwards, &["row 51", "does not come after"]);
    let mut still = folder();
    let lines = still
        .recording
        .lines()
        .map(|line| match line.rsplit_once(',') {
            Some((rest, last)) if last != "q1_rad" => format!("{rest},0.1\n"),
            _ => format!("{line}\n"),
        });
    still.recording = lines.collect();
    says(&still, &["joint 1 never moves"]);
}
