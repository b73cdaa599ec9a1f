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
    assert!(
        document["findings"][0]["evidence"]["effect_rms_mrad"]
            .as_f64()
            .unwrap()
            > 2.0
    );
    let said = of_the_example("diagnose");
    let lines = [
        "mrad rms, rolled out",
        "instrument 0.",
        "joint 2 Coulomb friction",
    ];
    assert!(
        lines.iter().all(|line| said.out.contains(line)),
        "{}",
        said.out
    );
    assert!(!said.out.contains("arcsec"), "{}", said.out);
    let page_folder = tempfile::tempdir().unwrap();
    let file = page_folder.path().join("drives.html");
    let written = of_the_example(&format!("diagnose --quiet --html {}", file.display()));
    assert_eq!(written.code, Some(0), "{}", written.err);
    let page = read(&file);
    assert_eq!(
        page.matches("<svg").count(),
        6,
        "two joints: the angle, and the error over time and speed"
    );
    assert!(page.contains("commanded") && page.contains("(lift)"));
    let file = page_folder.path().join("antriebe.html");
    let file = file.display();
    let written = of_the_example(&format!("diagnose --quiet --html {file} --language de"));
    assert_eq!(
        (written.code, &*written.err),
        (Some(0), ""),
        "all is German"
    );
}

#[test]
fn drives_are_exported_to_mujoco_isaac_and_json_with_what_was_found() {
    let mjcf = of_the_example("export --quiet --format mjcf").out;
    let document = roxmltree::Document::parse(&mjcf).unwrap();
    let of_joint = |tag: &str, key: &str| -> f64 {
        let mut nodes = document.descendants().filter(|node| node.has_tag_name(tag));
        let node = nodes
            .find(|node| node.attribute("name") == Some("lift"))
            .unwrap();
        node.attribute(key).unwrap().parse().unwrap()
    };
    let (friction, delay) = (
        of_joint("joint", "frictionloss"),
        of_joint("general", "delay"),
    );
    assert!(
        (friction - 0.29).abs() < 0.02 && (delay - 0.015).abs() < 0.001,
        "{friction} {delay}"
    );
    assert!(
        mjcf.contains("mrad rms before") && !mjcf.contains("not carried"),
        "{mjcf}"
    );
    let control = of_the_example("export --quiet --format mjcf_control").out;
    assert!(
        control.starts_with("# calib export: format mjcf_control")
            && control.contains("NAMES = [\"pan\", \"lift\", \"elbow\"]")
            && control.contains("\"torque_limit\": [4.0, 4.0, 4.0]")
            && !control.contains("{{"),
        "{control}"
    );
    let isaac = of_the_example("export --quiet --format isaac").out;
    assert!(
        isaac.contains("\"lift\":\n") && isaac.contains("min_delay: 3  # of 15.0"),
        "{isaac}"
    );
    let json = of_the_example("export --quiet --format json").json();
    let kp = &json["simulation"]["joint 2"]["kp"];
    assert_eq!(
        (&kp["believed"], &kp["unit"]),
        (&json!(26.0), &json!("Nm/rad"))
    );
    let refused = of_the_example("export --quiet --format urdf");
    assert!(
        refused
            .err
            .contains("allowed: mjcf, mjcf_control, isaac, json"),
        "{}",
        refused.err
    );
    let torques = root("pipelines/dynamics/pipeline.yaml");
    let refused = calib(".", &format!("export --format isaac {}", torques.display()));
    assert!(
        refused.err.contains("holds drives alone"),
        "{}",
        refused.err
    );
}

#[test]
fn friction_that_warms_up_and_turned_gravity_are_named_beside_each_other_and_nothing_else() {
    let Some(document) = practice("p11") else {
        return;
    };
    let expected = [
        ("warmup_friction", "joint 1"),
        ("gravity_direction", "base"),
    ];
    let expected = expected.map(|(effect, place)| (effect.to_string(), place.to_string()));
    assert_eq!(named(&document), expected);
    let left = document["after"]["validate_rms_mrad"].as_f64().unwrap();
    let noise = document["noise_mrad"].as_f64().unwrap();
    assert!(left < 1.05 * noise, "{left} of {noise}");
}

/// An arm of one joint with its drive and 2 s of a recording.
pub(crate) struct Folder {
    pub(crate) robot: String,
    pub(crate) drives: Value,
    pub(crate) recording: String,
}

pub(crate) fn folder() -> Folder {
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
    fn written(&self) -> TempDir {
        let case = tempfile::tempdir().unwrap();
        put(case.path(), "robot.xml", &self.robot);
        put(case.path(), "drives.json", self.drives.to_string());
        put(case.path(), "recording.csv", &self.recording);
        case
    }

    /// What is said of it.
    fn refused(&self) -> String {
        let case = self.written();
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

#[test]
fn an_actuator_that_is_not_read_and_lists_of_other_lengths_are_refused_with_their_line() {
    let mut actuator = folder();
    actuator.robot = actuator.robot.replace(
        "</mujoco>",
        "<actuator><muscle name=\"m\" joint=\"j1\"/></actuator></mujoco>",
    );
    let said = actuator.refused();
    assert!(
        said.contains("<muscle>") && said.contains("position, velocity, motor, general"),
        "{said}"
    );
    let mut looped = folder();
    looped.robot = looped.robot.replace(
        "</mujoco>",
        "<equality><connect body1=\"link\" anchor=\"0 0 0\"/></equality></mujoco>",
    );
    assert!(looped.refused().contains("<connect> closes a loop"));
}

#[test]
fn couplings_and_servos_that_are_not_read_are_refused_by_element_attribute_and_line() {
    let with = |element: &str| {
        let mut folder = folder();
        folder.robot = folder
            .robot
            .replace("</mujoco>", &format!("{element}</mujoco>"));
        folder.refused()
    };
    let cases: [(&str, &[&str]); 6] = [
        (
            "<equality><joint joint1=\"j1\" joint2=\"j1\"/></equality>",
            &["robot.xml:3", "couples joints of the chain"],
        ),
        (
            "<tendon><fixed><joint joint=\"j1\" coef=\"1\"/></fixed></tendon>",
            &[
                "robot.xml:3",
                "a tendon on a joint of the chain is not read",
            ],
        ),
        (
            "<actuator><general joint=\"j1\" dyntype=\"integrator\" gainprm=\"9\"/></actuator>",
            &["robot.xml:3", "dyntype=\"integrator\"", "allowed: none"],
        ),
        (
            "<actuator><position joint=\"j1\" kp=\"9\" timeconst=\"0.1\"/></actuator>",
            &[
                "robot.xml:3",
                "timeconst of an actuator of joint `j1`",
                "allowed: 0",
            ],
        ),
        (
            "<actuator><general joint=\"j1\" gainprm=\"9\" biastype=\"affine\" biasprm=\"0 -4 0\"/></actuator>",
            &["robot.xml:3", "gainprm=\"kp\" biasprm=\"0 -kp -kv\""],
        ),
        (
            "<actuator><cylinder joint=\"j1\"/></actuator>",
            &[
                "robot.xml:3",
                "<cylinder>",
                "allowed: position, velocity, motor, general",
            ],
        ),
    ];
    for (element, texts) in cases {
        let said = with(element);
        let all = texts.iter().all(|text| said.contains(text));
        assert!(all, "expected {texts:?} in: {said}");
    }
    let mut massless = folder();
    massless.robot = massless.robot.replace("mass=\"0.5\" ", "");
    assert!(massless.refused().contains("<inertial> without `mass`"));
}

#[test]
fn rows_and_joints_of_other_lengths_and_rates_that_are_none_are_refused_with_their_place() {
    let mut short = folder();
    short.recording = short
        .recording
        .replace("\n0.50,1,fit,", "\n0.50,1,fit\n0.505,1,fit,");
    let said = short.refused();
    assert!(said.contains("recording.csv:52"), "{said}");
    let mut wide = folder();
    let columns = |line: &str| match line.starts_with("time_s") {
        true => format!("{line},cmd2_rad,q2_rad\n"),
        false => format!("{line},0.1,0.1\n"),
    };
    wide.recording = wide.recording.lines().map(columns).collect();
    let said = wide.refused();
    assert!(
        said.contains("a column of joint 2") && said.contains("names 1 joints"),
        "{said}"
    );
    for rate in [0.0, -100.0] {
        let mut none = folder();
        none.drives["command_rate_hz"] = rate.into();
        let said = none.refused();
        assert!(
            said.contains("drives.json: command_rate_hz") && said.contains("allowed: above 0"),
            "{said}"
        );
    }
    let mut few = folder();
    few.recording = few
        .recording
        .lines()
        .take(12)
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(few.refused().contains("expected at least 20"));
}

#[test]
fn a_joint_that_is_neither_commanded_nor_moved_is_told() {
    let mut folder = folder();
    folder.robot = folder.robot.replace(
        "</body></worldbody>",
        "<body name=\"hand\" pos=\"0.2 0 0\"><joint name=\"j2\" axis=\"0 1 0\" armature=\"0.01\"/>\
         <inertial pos=\"0.05 0 0\" mass=\"0.1\" diaginertia=\"1e-4 1e-4 1e-4\"/></body></body></worldbody>",
    );
    let mut second = folder.drives["joints"][0].clone();
    second["joint"] = "j2".into();
    folder.drives["joints"].as_array_mut().unwrap().push(second);
    let columns = |line: &str| match line.starts_with("time_s") {
        true => format!("{line},cmd2_rad,q2_rad\n"),
        false => format!("{line},0.1,0.1\n"),
    };
    folder.recording = folder.recording.lines().map(columns).collect();
    let case = folder.written();
    let store = tempfile::tempdir().unwrap();
    let pipeline = root("pipelines/drives/pipeline.yaml");
    let (case, store, pipeline) = (
        case.path().display(),
        store.path().display(),
        pipeline.display(),
    );
    let answer = calib(
        ".",
        &format!("diagnose --set case={case} --store {store} {pipeline}"),
    );
    assert_eq!(answer.code, Some(0), "{}", answer.both());
    let said = answer.both();
    assert!(
        said.contains("joint 2 rests") && said.contains("left out of `joints`"),
        "{said}"
    );
}

/// The folder with commands and angles in two files, each a list a row, on a clock of microseconds; `rows` of the commands are left out.
fn in_lists(folder: &Folder, short: bool) -> TempDir {
    let case = tempfile::tempdir().unwrap();
    let (mut control, mut state) = (
        "timestamp,positions\n".to_string(),
        "timestamp,positions\n".to_string(),
    );
    for (row, line) in folder.recording.lines().skip(1).enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let micros = 10_000 * row;
        control += &format!("{micros},\"[{}, 0.5]\"\n", cells[3]);
        match short && row == 7 {
            true => state += &format!("{micros},\"[]\"\n"),
            false => state += &format!("{micros},\"[{}, 0.5]\"\n", cells[4]),
        }
    }
    put(case.path(), "control.csv", control);
    put(case.path(), "state_motor.csv", state);
    put(case.path(), "robot.xml", &folder.robot);
    put(case.path(), "drives.json", folder.drives.to_string());
    put(
        case.path(),
        "pipeline.yaml",
        "calib: 1\nname: lists\nseed: 1\nstages:\n  - uses: diagnose_drives\n    with:\n      robot: robot.xml\n      drives: drives.json\n      \
         recording: state_motor.csv\n      commands: control.csv\n      columns: {time: timestamp, time_unit: us, command: positions, angle: positions}\n",
    );
    case
}

#[test]
fn commands_and_angles_come_as_lists_in_two_files_too() {
    let plain = folder();
    let diagnosed =
        |case: &Path| calib(case, "diagnose --quiet --json pipeline.yaml --store store");
    let case = in_lists(&plain, false);
    let lists = diagnosed(case.path());
    assert_eq!(lists.code, Some(0), "{}", lists.err);
    let one = plain.written();
    let store = tempfile::tempdir().unwrap();
    let columns = diagnose(one.path(), store.path()).json();
    let rms = |document: &Value| document["before"]["fit_rms_mrad"].as_f64().unwrap();
    let (lists, columns) = (rms(&lists.json()), rms(&columns));
    // Rounding of the clock decides whether the row at 0.4 s belongs to the rest at the beginning.
    assert!((lists / columns - 1.0).abs() < 3e-3, "{lists} {columns}");
    let short = diagnosed(in_lists(&plain, true).path());
    assert!(
        short.err.contains("state_motor.csv:9") && short.err.contains("at least 1 joints"),
        "{}",
        short.err
    );
}

/// Diagnosis of recordings a/motor.csv, b/motor.csv, whose commands are in files of their own, by lines below `with`.
fn of_several(lines: &str) -> Answer {
    let case = in_lists(&folder(), false);
    for name in ["a", "b"] {
        std::fs::create_dir(case.path().join(name)).unwrap();
        for (from, to) in [
            ("state_motor.csv", "motor.csv"),
            ("control.csv", "sent.csv"),
        ] {
            std::fs::copy(case.path().join(from), case.path().join(name).join(to)).unwrap();
        }
    }
    put(
        case.path(),
        "pipeline.yaml",
        format!(
            "calib: 1\nname: several\nseed: 1\nstages:\n  - uses: diagnose_drives\n    with:\n      robot: robot.xml\n      drives: drives.json\n\
             {lines}      columns: {{time: timestamp, time_unit: us, command: positions, angle: positions}}\n"
        ),
    );
    calib(
        case.path(),
        "diagnose --quiet --json pipeline.yaml --store store",
    )
}

#[test]
fn several_recordings_are_fitted_together_and_one_may_judge() {
    let two = of_several(
        "      recording: [{file: a/motor.csv, commands: a/sent.csv}, {file: b/motor.csv, commands: b/sent.csv}]\n",
    );
    assert_eq!(two.code, Some(0), "{}", two.err);
    assert_eq!(two.json()["rows"], json!(400), "{}", two.out);
    let pattern =
        of_several("      recording: [{file: \"*/motor.csv\", commands: \"*/sent.csv\"}]\n");
    assert_eq!(pattern.code, Some(0), "{}", pattern.err);
    assert_eq!(pattern.json()["before"], two.json()["before"]);
    let judged = of_several(
        "      recording: [{file: a/motor.csv, commands: a/sent.csv}, {file: b/motor.csv, commands: b/sent.csv, usage: validate}]\n",
    );
    let document = judged.json();
    assert_eq!(document["rows"], json!(200));
    let rms = |key: &str| document["before"][key].as_f64().unwrap();
    assert!(
        (rms("fit_rms_mrad") - rms("validate_rms_mrad")).abs() < 1e-9,
        "the same rows: {document}"
    );
    let apart = of_several("      recording: [a/motor.csv]\n      commands: a/sent.csv\n");
    assert!(
        apart.err.contains("name the commands of each"),
        "{}",
        apart.err
    );
    let none = of_several("      recording: \"*/nothing.csv\"\n");
    assert!(none.err.contains("no file matches"), "{}", none.err);
}

#[test]
fn windows_of_a_trajectory_are_fitted_and_held_out_in_turn() {
    let whole = of_several("      recording: a/motor.csv\n      commands: a/sent.csv\n");
    let halves = of_several(
        "      recording: a/motor.csv\n      commands: a/sent.csv\n      hold_out: {windows: 0.5}\n",
    );
    assert_eq!(halves.code, Some(0), "{}", halves.err);
    let document = halves.json();
    assert_eq!(document["rows"], json!(100));
    // The simulation runs through the windows that judge: both halves together are the whole.
    let square = |key: &str| document["before"][key].as_f64().unwrap().powi(2);
    let both = 0.5 * (square("fit_rms_mrad") + square("validate_rms_mrad"));
    let one = whole.json()["before"]["fit_rms_mrad"].as_f64().unwrap();
    assert!((both.sqrt() / one - 1.0).abs() < 1e-6, "{both} {one}");
    let wrong = of_several(
        "      recording: a/motor.csv\n      commands: a/sent.csv\n      hold_out: {windows: 0}\n",
    );
    assert!(
        wrong.err.contains("hold_out.windows") && wrong.err.contains("allowed: above 0"),
        "{}",
        wrong.err
    );
}

#[test]
fn init_writes_the_pipeline_of_commands_and_angles() {
    let plain = folder();
    let case = in_lists(&plain, false);
    std::fs::remove_file(case.path().join("pipeline.yaml")).unwrap();
    std::fs::remove_file(case.path().join("drives.json")).unwrap();
    let answer = calib(case.path(), "init arm --data . --mjcf robot.xml");
    assert_eq!(answer.code, Some(0), "{}", answer.both());
    let drives: Value = serde_json::from_str(&read(case.path().join("arm/drives.json"))).unwrap();
    assert_eq!(drives["command_rate_hz"], json!(100.0));
    assert_eq!(drives["joints"][0]["joint"], json!("j1"));
    let pipeline = read(case.path().join("arm/pipeline.yaml"));
    for line in [
        "time_unit: us",
        "commands: ",
        "state_motor.csv",
        "state kp of each joint",
    ] {
        assert!(pipeline.contains(line), "expected `{line}` in {pipeline}");
    }
    // What it could not know is asked for.
    let check = calib(case.path(), "diagnose arm/pipeline.yaml --store store");
    assert!(check.err.contains("joints[0].kp"), "{}", check.err);
    let nothing = calib(case.path(), "init other --data robot.xml --mjcf robot.xml");
    assert!(nothing.err.contains("allowed: one CSV"), "{}", nothing.err);
}

#[test]
fn a_text_of_a_german_spreadsheet_is_read_and_pauses_of_its_stamps_part_trajectories() {
    let plain = folder();
    let case = tempfile::tempdir().unwrap();
    put(case.path(), "robot.xml", &plain.robot);
    let mut text = "Zeit [s];Fahrt;soll_j1 [rad];ist_j1 [rad];Akku [V]\n".to_string();
    for (row, line) in plain.recording.lines().skip(1).enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let later = if row < 120 { 0.0 } else { 4.0 };
        let time = cells[0].parse::<f64>().unwrap() + later;
        text += &format!("{time:.2};7;{};{};24.1\n", cells[3], cells[4]).replace('.', ",");
    }
    put(case.path(), "fahrt.csv", text);
    let answer = calib(case.path(), "init arm --data fahrt.csv --mjcf robot.xml");
    assert_eq!(answer.code, Some(0), "{}", answer.both());
    for said in ["trajectories by Fahrt", "not used: Akku [V]", "100 Hz"] {
        assert!(answer.both().contains(said), "{said}: {}", answer.both());
    }
    let pipeline = read(case.path().join("arm/pipeline.yaml"));
    for line in [
        "delimiter: \";\"",
        "decimal: comma",
        "trajectory: \"Fahrt\"",
        "command: \"soll_j{j} [rad]\"",
        "angle: \"ist_j{j} [rad]\"",
    ] {
        assert!(pipeline.contains(line), "expected `{line}` in {pipeline}");
    }
    let drives = json!({ "command_rate_hz": 100.0, "joints": plain.drives["joints"] });
    put(case.path().join("arm"), "drives.json", drives.to_string());
    let found = calib(case.path(), "diagnose arm/pipeline.yaml --store store");
    assert_eq!(found.code, Some(0), "{}", found.both());
    let pause = "1 pause of more than 0.5 s in the stamps; a trajectory begins anew after each";
    assert!(found.err.contains(pause), "{}", found.err);
    let pointed = pipeline.replace("        decimal: comma\n", "");
    put(case.path().join("arm"), "pointed.yaml", pointed);
    let refused = calib(case.path(), "diagnose arm/pointed.yaml --store store");
    assert!(
        refused.err.contains("`text: {decimal: comma}`"),
        "{}",
        refused.err
    );
}

#[test]
fn init_finds_commands_and_angles_of_real_recordings() {
    let Some(data) = shared("data") else {
        return;
    };
    let desk = tempfile::tempdir().unwrap();
    let init = |name: &str, recording: &str, mjcf: &str| {
        let (recording, mjcf) = (data.join(recording), data.join(mjcf));
        let (recording, mjcf) = (recording.display(), mjcf.display());
        let answer = calib(
            desk.path(),
            &format!("init {name} --data {recording} --mjcf {mjcf}"),
        );
        assert_eq!(answer.code, Some(0), "{}", answer.both());
        let text = |file: &str| read(desk.path().join(name).join(file));
        let drives: Value = serde_json::from_str(&text("drives.json")).unwrap();
        (text("pipeline.yaml"), drives)
    };
    let (pipeline, drives) = init("desk", "so101_sage/multisine", "so101_sage/so101.xml");
    assert!(
        pipeline.contains("time_unit: us") && pipeline.contains("angle: \"positions\""),
        "{pipeline}"
    );
    assert_eq!(drives["joints"].as_array().unwrap().len(), 6);
    let step = drives["joints"][1]["encoder_rad"].as_f64().unwrap();
    assert!((step - 1.534e-3).abs() < 1e-4, "{step}");
    assert!(drives["joints"][1]["kp"].as_f64().unwrap() > 1.0);
    let (pipeline, drives) = init("legs", "go2_chirp/recording.csv", "go2_chirp/go2.xml");
    assert!(
        pipeline.contains("command: \"cmd_{name}\"") || pipeline.contains("cmd_{name}"),
        "{pipeline}"
    );
    assert_eq!(drives["command_rate_hz"], json!(200.0));
}
