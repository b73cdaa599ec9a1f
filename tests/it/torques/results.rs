//! What a diagnosis of torques is good for: files for simulators and torques that are fed forward, held against the twin's truth.

use super::write;
use crate::answer::{self, Answer, has, root};
use calib::twin::conceal::design::Design;
use calib::twin::folder::File;
use calib::twin::torque::{TorqueCase, TorqueRows};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A diagnosed case.
pub(super) struct Solved {
    pub folder: tempfile::TempDir,
    pub case: TorqueCase,
}

impl Solved {
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// An arm with motors, friction, a payload that is not declared and Stribeck friction at joint 2, diagnosed once.
pub(super) fn solved() -> &'static Solved {
    static SOLVED: OnceLock<Solved> = OnceLock::new();
    SOLVED.get_or_init(|| {
        let case = arm().carrying(1.5, [0.02, 0.0, 0.01]);
        let size = 0.8 * case.plain_friction()[1][1].unwrap();
        solve(case.with_stribeck(1, size, 0.08))
    })
}

/// Diagnoses a case.
pub(super) fn solve(case: TorqueCase) -> Solved {
    let files = case.recording();
    solve_files(case, &files)
}

/// Diagnoses files of a case.
pub(super) fn solve_files(case: TorqueCase, files: &[File]) -> Solved {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("case"), files);
    let pipeline = root("pipelines/dynamics/pipeline.yaml")
        .display()
        .to_string();
    let set = format!("case={}", folder.path().join("case").display());
    calib(
        &format!("run --quiet --set {set} {pipeline}"),
        &folder.path().join("store"),
    )
    .code(0);
    Solved { folder, case }
}

/// Friction and nothing else concealed.
fn design() -> Design {
    Design {
        seed: 21,
        cases: 60,
        nulls: 1.0,
        other_forms: 0.0,
        seconds: 48.0,
        rate: 100.0,
        ..Design::default()
    }
}

/// The first arm of six joints of whose viscous and Coulomb friction something holds at all of them.
fn first(holds: fn(&[Option<f64>; 2]) -> bool) -> TorqueCase {
    let fits = |case: &TorqueCase| {
        case.robot.name == "compact6" && case.plain_friction().iter().all(holds)
    };
    cases(60).into_iter().find(fits).unwrap()
}

/// Friction at all joints and nothing else concealed, motor currents.
pub(super) fn arm() -> TorqueCase {
    first(|[v, c]| v.and(*c).is_some())
}

/// Arms of all kinds.
pub(super) fn cases(count: usize) -> Vec<TorqueCase> {
    (0..count)
        .map(|number| TorqueCase::draw(&design(), number))
        .collect()
}

pub(super) fn calib(words: &str, store: &Path) -> Answer {
    answer::calib(".", &format!("{words} --store {}", store.display()))
}

fn exported(solved: &Solved, format: &str) -> String {
    let words = format!("export HEAD --quiet --format {format}");
    calib(&words, &solved.path("store")).ok()
}

fn number(element: &roxmltree::Node, name: &str) -> f64 {
    element
        .attribute(name)
        .unwrap_or_else(|| panic!("no {name}"))
        .parse()
        .unwrap()
}

/// How near friction is asked for: at joint 2 Stribeck friction, which no attribute holds, shares it with viscous and Coulomb friction; that of
/// joint 6 is of the size of its noise.
fn share(joint: usize) -> f64 {
    [0.08, 0.2, 0.08, 0.08, 0.08, 0.3][joint]
}

fn near(found: f64, truth: f64, share: f64, what: &str) {
    assert!(
        (found - truth).abs() <= share * truth.abs(),
        "{what}: {found}, truly {truth}"
    );
}

/// Mass of the last link and what it carries.
fn true_last_mass(case: &TorqueCase) -> f64 {
    let (link, payload) = case.last_bodies();
    link.mass + payload.map_or(0.0, |payload| payload.mass)
}

/// Ratio and torque constant of each joint.
fn drives(case: &TorqueCase) -> Vec<(f64, f64)> {
    let joints = case.robot.joints.iter();
    joints
        .map(|joint| joint.reduction_ratio.zip(joint.motor_constant).unwrap())
        .collect()
}

/// Elements of a name hold the friction of the twin in two attributes, joint after joint.
fn friction_is_that_of_the_twin(file: &roxmltree::Document, name: &str, attributes: [&str; 2]) {
    let truth = solved().case.plain_friction();
    let elements = file.descendants().filter(|node| node.has_tag_name(name));
    let elements: Vec<_> = elements.collect();
    assert_eq!(elements.len(), truth.len());
    for (joint, (element, sizes)) in elements.iter().zip(truth).enumerate() {
        for (attribute, size) in attributes.iter().zip(sizes) {
            let what = format!("{attribute} of joint {}", joint + 1);
            near(
                number(element, attribute),
                size.unwrap(),
                share(joint),
                &what,
            );
        }
    }
}

#[test]
fn a_urdf_of_torques_holds_the_friction_and_the_masses_of_the_twin() {
    let text = exported(solved(), "urdf");
    let file = roxmltree::Document::parse(&text).unwrap();
    friction_is_that_of_the_twin(&file, "dynamics", ["damping", "friction"]);
    let mut nodes = file.descendants();
    let last = nodes.find(|node| node.attribute("name") == Some("link_6"));
    let mut nodes = last.unwrap().descendants();
    let mass = nodes.find(|node| node.has_tag_name("mass")).unwrap();
    near(
        number(&mass, "value"),
        true_last_mass(&solved().case),
        0.03,
        "mass of the last link with its payload",
    );
}

#[test]
fn an_mjcf_of_torques_holds_friction_and_drives() {
    let text = exported(solved(), "mjcf");
    let file = roxmltree::Document::parse(&text).unwrap();
    friction_is_that_of_the_twin(&file, "joint", ["damping", "frictionloss"]);
    let motors = file.descendants().filter(|node| node.has_tag_name("motor"));
    let gears: Vec<f64> = motors.map(|motor| number(&motor, "gear")).collect();
    let declared = drives(&solved().case);
    assert_eq!(gears.len(), declared.len());
    for (gear, (ratio, constant)) in gears.iter().zip(declared) {
        near(*gear, ratio * constant, 1e-12, "Nm per ampere");
    }
}

#[test]
fn an_mjcf_of_ones_own_gets_friction_and_keeps_all_else() {
    let case = arm();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().join("case");
    write(&here, &case.recording());
    let joint = |number: usize| {
        let more = ["", " damping=\"0.5\" frictionloss=\"9\""][number % 2];
        format!("<body><joint name=\"J{number}\" axis=\"0 1 0\"{more}/><geom size=\"0.05\"/>")
    };
    let bodies: String = (1..=6).map(joint).collect();
    let own = format!(
        "<mujoco model=\"mine\">\n<!-- mine -->\n<worldbody>{bodies}{}</worldbody>\n<actuator><motor joint=\"J1\"/></actuator>\n</mujoco>\n",
        "</body>".repeat(6)
    );
    write(&here, &[("mine.xml", own.clone())]);
    let text = answer::read(root("pipelines/dynamics/pipeline.yaml"));
    let named = text.replace("robot.json\"", "robot.json\", mjcf: \"${case}/mine.xml\"");
    assert_ne!(text, named);
    write(folder.path(), &[("p.yaml", named)]);
    let set = format!("case={}", here.display());
    let pipeline = folder.path().join("p.yaml");
    let words = format!("run --quiet --set {set} {}", pipeline.display());
    calib(&words, &folder.path().join("store")).code(0);
    let solved = Solved { folder, case };
    let text = exported(&solved, "mjcf");
    let file = roxmltree::Document::parse(&text).unwrap();
    has(&text, "a copy of mine.xml");
    has(&text, "<!-- mine -->");
    let of = |name: &'static str| {
        file.descendants()
            .filter(move |node| node.has_tag_name(name))
    };
    assert_eq!((of("geom").count(), of("motor").count()), (6, 1));
    for (element, truth) in of("joint").zip(solved.case.plain_friction()) {
        for (attribute, size) in ["damping", "frictionloss"].iter().zip(truth) {
            let written = element.attribute(*attribute).unwrap();
            near(number(&element, attribute), size.unwrap(), 0.3, attribute);
            let digits = written.chars().filter(char::is_ascii_digit).count();
            assert!(digits < 7, "more digits than its sigma tells: {written}");
        }
    }
    let other = own.replace("\"J3\"", "\"K3\"");
    write(&solved.path("case"), &[("mine.xml", other)]);
    let refused = calib("export HEAD --format mjcf", &solved.path("store"));
    assert_ne!(refused.code, Some(0));
    has(&refused.err, "mine.xml");
    has(&refused.err, "has no joint `J3`");
}

#[test]
fn files_say_nothing_of_friction_that_was_not_found() {
    // Friction at two joints alone: none at the others is found, and 0 would be a statement that nobody made.
    let plain = arm().plain_friction();
    let [viscous, coulomb] = [1, 2].map(|joint| plain[joint].map(|size| size.unwrap()));
    let frictionless = first(|[v, c]| v.or(*c).is_none());
    let solved = solve(
        frictionless
            .with_drag(1, viscous[1])
            .with_drag(2, coulomb[1]),
    );
    let found: Value = serde_json::from_str(&exported(&solved, "dynamics")).unwrap();
    for (format, element, names) in [
        ("urdf", "dynamics", ["damping", "friction"]),
        ("mjcf", "joint", ["damping", "frictionloss"]),
    ] {
        let text = exported(&solved, format);
        let file = roxmltree::Document::parse(&text).unwrap();
        for (index, joint) in found["joints"].as_array().unwrap().iter().enumerate() {
            let name = joint["name"].as_str().unwrap();
            let ours = file
                .descendants()
                .find(|node| node.has_tag_name("joint") && node.attribute("name") == Some(name));
            let mut ours = ours.unwrap().descendants();
            let ours = ours.find(|node| node.has_tag_name(element));
            for (attribute, number) in names.iter().zip([&joint["viscous"], &joint["coulomb"]]) {
                let written = ours.and_then(|node| node.attribute(*attribute));
                let what = format!("{format}: {attribute} of joint {}", index + 1);
                assert_eq!(written.is_some(), !number.is_null(), "{what}");
                assert_ne!(written, Some("0"), "{what}");
            }
        }
    }
    let joints = found["joints"].as_array().unwrap().iter();
    let sliding = joints.filter(|joint| !joint["coulomb"].is_null()).count();
    assert!(
        (2..6).contains(&sliding),
        "Coulomb friction at {sliding} joints"
    );
}

#[test]
fn what_a_format_does_not_hold_of_torques_is_said_with_its_size() {
    let all: Value = serde_json::from_str(&exported(solved(), "dynamics")).unwrap();
    let mut causes = all["causes"].as_array().unwrap().iter();
    let stribeck = causes
        .find(|cause| cause["effect"] == "stribeck_friction")
        .unwrap();
    assert_eq!(stribeck["where"], "joint 2");
    assert!(stribeck["numbers"]["stribeck"]["sigma"].as_f64().unwrap() > 0.0);
    for format in ["urdf", "mjcf"] {
        let text = exported(solved(), format);
        has(&text, "not carried: stribeck_friction at joint 2, ");
    }
    let refused = calib("export HEAD --format dh", &solved().path("store")).code(2);
    has(&refused.err, "allowed: urdf, json, mjcf, sdf, dynamics");
}

/// Rows of a stretch.
pub(super) fn rows_of(rows: &TorqueRows, stretch: usize) -> Vec<usize> {
    let is_of = |row: &usize| rows.trajectory[*row] == stretch;
    (0..rows.time.len()).filter(is_of).collect()
}

/// A motion as its user has it, of one stretch of rows.
pub(super) fn motion(rows: &TorqueRows, stretch: usize, derivatives: bool) -> String {
    let n = rows.state[0].q.len();
    let names = |name: &str| {
        (1..=n)
            .map(|joint| format!(",{}", name.replace("{j}", &joint.to_string())))
            .collect::<String>()
    };
    let mut text = format!("time_s{}", names("q{j}_deg"));
    if derivatives {
        text += &(names("dq{j}_deg_s") + &names("ddq{j}_deg_s2"));
    }
    for row in rows_of(rows, stretch) {
        let state = &rows.state[row];
        let degrees = |values: &[f64]| -> String {
            let values = values.iter().map(|value| value.to_degrees());
            values.map(|value| format!(",{value:.7}")).collect()
        };
        text += &format!("\n{:.4}{}", rows.time[row], degrees(&state.q));
        if derivatives {
            text += &(degrees(&state.v) + &degrees(&state.a));
        }
    }
    text + "\n"
}

/// Columns of a file by name.
pub(super) fn column(text: &str, name: &str) -> Vec<f64> {
    let mut lines = text.lines();
    let place = lines
        .next()
        .unwrap()
        .split(',')
        .position(|column| column == name)
        .unwrap_or_else(|| panic!("no {name}"));
    lines
        .map(|line| line.split(',').nth(place).unwrap().parse().unwrap())
        .collect()
}

pub(super) fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = errors.map(|error| error * error).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn torques_fed_forward_are_those_of_the_twin_on_fresh_motions() {
    let solved = solved();
    let fresh = solved.case.clone().on_other_paths(977, 40.0);
    let rows = fresh.true_rows();
    let rigid: Vec<Vec<f64>> = fresh
        .rigid()
        .into_iter()
        .map(|(_, torque)| torque)
        .collect();
    let n = fresh.robot.joints.len();
    for (stretch, derivatives) in [(1, false), (1, true), (2, true)] {
        let file = solved.path(&format!("motion_{stretch}_{derivatives}.csv"));
        std::fs::write(&file, motion(&rows, stretch, derivatives)).unwrap();
        let words = format!("compensate HEAD {} --torque --quiet", file.display());
        let printed = calib(&words, &solved.path("store")).ok();
        let ours = rows_of(&rows, stretch);
        for (joint, (ratio, constant)) in drives(&fresh).into_iter().enumerate() {
            let found = column(&printed, &format!("tau{}_nm", joint + 1));
            assert_eq!(found.len(), ours.len());
            let truth = |row: &usize| rows.torque[n * row + joint];
            let pairs = ours.iter().zip(&found);
            let error = rms(pairs.map(|(row, found)| truth(row) - found));
            let nominal = rms(ours.iter().map(|row| truth(row) - rigid[*row][joint]));
            let noise = fresh.white_noise()[joint];
            println!(
                "stretch {stretch}, joint {}: {error:.4} Nm, rigid {nominal:.4} Nm, noise {noise:.4} Nm",
                joint + 1
            );
            assert!(
                error < noise,
                "joint {}: {error} Nm, noise {noise} Nm",
                joint + 1
            );
            assert!(
                nominal > 3.0 * error,
                "joint {}: {error} Nm, of the rigid arm {nominal} Nm",
                joint + 1
            );
            let factor = ratio * constant;
            let currents = column(&printed, &format!("i{}_a", joint + 1));
            assert!(
                found
                    .iter()
                    .zip(currents)
                    .all(|(torque, current)| (torque - factor * current).abs() < 1e-3 * factor)
            );
        }
    }
}

#[test]
fn a_motion_that_cannot_be_fed_forward_is_refused_at_its_line() {
    let solved = solved();
    let whole = motion(
        &solved.case.clone().on_other_paths(977, 40.0).true_rows(),
        1,
        false,
    );
    let file = solved.path("bad.csv");
    let changed = |change: &dyn Fn(&mut Vec<String>), words: &[&str]| {
        let mut lines: Vec<String> = whole.lines().map(String::from).collect();
        change(&mut lines);
        std::fs::write(&file, lines.join("\n")).unwrap();
        let asked = format!("compensate HEAD {} --torque", file.display());
        let output = calib(&asked, &solved.path("store"));
        assert!([Some(2), Some(10)].contains(&output.code), "{output:?}");
        words.iter().for_each(|word| has(&output.err, word));
    };
    changed(
        &|lines| lines[0] = lines[0].replace("q3_deg", "angle3"),
        &["unknown column `angle3`", "allowed: time_s"],
    );
    changed(
        &|lines| lines.swap(40, 41),
        &["bad.csv:42", "the time does not increase"],
    );
    changed(
        &|lines| _ = lines.remove(40),
        &["bad.csv:41", "the clock is uneven"],
    );
    changed(
        &|lines| lines[7] = lines[7].replacen(',', ",x", 1),
        &["bad.csv:8", "is not a number"],
    );
    changed(&|lines| lines.truncate(5), &["at least 10"]);
    // Without --torque there is nothing to correct.
    let asked = format!("compensate HEAD {}", file.display());
    has(&calib(&asked, &solved.path("store")).err, "--torque");
}
