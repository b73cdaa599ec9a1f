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

/// Friction at all joints and nothing else concealed, motor currents.
pub(super) fn arm() -> TorqueCase {
    let fits = |case: &TorqueCase| {
        case.robot.name == "compact6"
            && case
                .plain_friction()
                .iter()
                .all(|[v, c]| v.and(*c).is_some())
    };
    cases(60).into_iter().find(fits).unwrap()
}

/// The first arm of six joints without any friction.
fn frictionless() -> TorqueCase {
    let bare = |case: &TorqueCase| {
        case.robot.name == "compact6"
            && case
                .plain_friction()
                .iter()
                .all(|[v, c]| v.or(*c).is_none())
    };
    cases(60).into_iter().find(bare).unwrap()
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

fn text(answer: Answer) -> String {
    answer.ok()
}

fn exported(format: &str) -> String {
    text(calib(
        &format!("export HEAD --quiet --format {format}"),
        &solved().path("store"),
    ))
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

/// Mass and its moment about the last joint's point of the last link and what it carries.
fn true_last(case: &TorqueCase) -> (f64, [f64; 3]) {
    let (link, payload) = case.last_bodies();
    let point = case.robot.joints[case.robot.joints.len() - 1].point;
    let bodies = std::iter::once(link).chain(payload);
    bodies.fold((0.0, [0.0; 3]), |(mass, moment), body| {
        (
            mass + body.mass,
            std::array::from_fn(|axis| {
                moment[axis] + body.mass * (body.centre[axis] - point[axis])
            }),
        )
    })
}

#[test]
fn a_urdf_of_torques_holds_the_friction_and_the_masses_of_the_twin() {
    let text = exported("urdf");
    let file = roxmltree::Document::parse(&text).unwrap();
    let all: Vec<_> = file
        .descendants()
        .filter(|node| node.has_tag_name("dynamics"))
        .collect();
    let truth = solved().case.plain_friction();
    assert_eq!(all.len(), truth.len());
    for (joint, (dynamics, [viscous, coulomb])) in all.iter().zip(truth).enumerate() {
        near(
            number(dynamics, "damping"),
            viscous.unwrap(),
            share(joint),
            &format!("viscous friction of joint {}", joint + 1),
        );
        near(
            number(dynamics, "friction"),
            coulomb.unwrap(),
            share(joint),
            &format!("Coulomb friction of joint {}", joint + 1),
        );
    }
    let last = file
        .descendants()
        .find(|node| node.attribute("name") == Some("link_6"))
        .unwrap();
    let mass = last
        .descendants()
        .find(|node| node.has_tag_name("mass"))
        .unwrap();
    let (truth, _) = true_last(&solved().case);
    near(
        number(&mass, "value"),
        truth,
        0.03,
        "mass of the last link with its payload",
    );
}

#[test]
fn an_mjcf_of_torques_holds_friction_and_drives() {
    let text = exported("mjcf");
    let file = roxmltree::Document::parse(&text).unwrap();
    let truth = solved().case.plain_friction();
    let joints: Vec<_> = file
        .descendants()
        .filter(|node| node.has_tag_name("joint"))
        .collect();
    assert_eq!(joints.len(), truth.len());
    for (joint, (element, [viscous, coulomb])) in joints.iter().zip(truth).enumerate() {
        near(
            number(element, "damping"),
            viscous.unwrap(),
            share(joint),
            &format!("viscous friction of joint {}", joint + 1),
        );
        near(
            number(element, "frictionloss"),
            coulomb.unwrap(),
            share(joint),
            &format!("Coulomb friction of joint {}", joint + 1),
        );
    }
    let gears: Vec<f64> = file
        .descendants()
        .filter(|node| node.has_tag_name("motor"))
        .map(|motor| number(&motor, "gear"))
        .collect();
    let declared = solved()
        .case
        .robot
        .joints
        .iter()
        .map(|joint| joint.reduction_ratio.zip(joint.motor_constant).unwrap());
    for (gear, (ratio, constant)) in gears.iter().zip(declared) {
        near(*gear, ratio * constant, 1e-12, "Nm per ampere");
    }
    assert_eq!(gears.len(), joints.len());
}

#[test]
fn files_say_nothing_of_friction_that_was_not_found() {
    // Friction at two joints alone: none at the others is found, and 0 would be a statement that nobody made.
    let plain = arm().plain_friction();
    let [viscous, coulomb] = [1, 2].map(|joint| plain[joint].map(|size| size.unwrap()));
    let case = frictionless()
        .with_drag(1, viscous[1])
        .with_drag(2, coulomb[1]);
    let solved = solve(case);
    let found: Value = serde_json::from_str(&text(calib(
        "export HEAD --quiet --format dynamics",
        &solved.path("store"),
    )))
    .unwrap();
    for (format, element, names) in [
        ("urdf", "dynamics", ["damping", "friction"]),
        ("mjcf", "joint", ["damping", "frictionloss"]),
    ] {
        let text = text(calib(
            &format!("export HEAD --quiet --format {format}"),
            &solved.path("store"),
        ));
        let file = roxmltree::Document::parse(&text).unwrap();
        for (index, joint) in found["joints"].as_array().unwrap().iter().enumerate() {
            let name = joint["name"].as_str().unwrap();
            let ours = file
                .descendants()
                .find(|node| node.has_tag_name("joint") && node.attribute("name") == Some(name));
            let ours = ours.unwrap();
            let ours = if element == "joint" {
                Some(ours)
            } else {
                ours.children().find(|node| node.has_tag_name(element))
            };
            for (attribute, number) in names.iter().zip([&joint["viscous"], &joint["coulomb"]]) {
                let written = ours.and_then(|node| node.attribute(*attribute));
                assert_eq!(
                    written.is_some(),
                    !number.is_null(),
                    "{format}: {attribute} of joint {}",
                    index + 1
                );
                assert_ne!(
                    written,
                    Some("0"),
                    "{format}: {attribute} of joint {}",
                    index + 1
                );
            }
        }
        let sliding = found["joints"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|joint| !joint["coulomb"].is_null())
            .count();
        assert!(
            (2..6).contains(&sliding),
            "Coulomb friction at {sliding} joints"
        );
    }
}

#[test]
fn what_a_format_does_not_hold_of_torques_is_said_with_its_size() {
    let all: Value = serde_json::from_str(&exported("dynamics")).unwrap();
    let causes = all["causes"].as_array().unwrap();
    let stribeck = causes
        .iter()
        .find(|cause| cause["effect"] == "stribeck_friction")
        .unwrap();
    assert_eq!(stribeck["where"], "joint 2");
    assert!(stribeck["numbers"]["stribeck"]["sigma"].as_f64().unwrap() > 0.0);
    for format in ["urdf", "mjcf"] {
        let text = exported(format);
        has(&text, "not carried: stribeck_friction at joint 2, ");
    }
    let refused = calib("export HEAD --format dh", &solved().path("store"));
    let printed = refused.err.clone();
    assert_eq!(refused.code, Some(2), "{printed}");
    has(&printed, "allowed: urdf, json, mjcf, sdf, dynamics");
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
    for (row, state) in rows
        .state
        .iter()
        .enumerate()
        .filter(|(row, _)| rows.trajectory[*row] == stretch)
    {
        let degrees = |values: &[f64]| {
            values
                .iter()
                .map(|value| format!(",{:.7}", value.to_degrees()))
                .collect::<String>()
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
        let printed = text(calib(
            &format!("compensate HEAD {} --torque --quiet", file.display()),
            &solved.path("store"),
        ));
        let ours: Vec<usize> = (0..rows.time.len())
            .filter(|row| rows.trajectory[*row] == stretch)
            .collect();
        let drives = fresh
            .robot
            .joints
            .iter()
            .map(|joint| joint.reduction_ratio.zip(joint.motor_constant).unwrap());
        for (joint, (ratio, constant)) in drives.enumerate() {
            let found = column(&printed, &format!("tau{}_nm", joint + 1));
            assert_eq!(found.len(), ours.len());
            let error = rms(ours
                .iter()
                .zip(&found)
                .map(|(row, found)| rows.torque[n * row + joint] - found));
            let nominal = rms(ours
                .iter()
                .map(|row| rows.torque[n * row + joint] - rigid[*row][joint]));
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
        let output = calib(
            &format!("compensate HEAD {} --torque", file.display()),
            &solved.path("store"),
        );
        let printed = output.err.clone();
        assert!([Some(2), Some(10)].contains(&output.code), "{printed}");
        words
            .iter()
            .for_each(|word| assert!(printed.contains(word), "no `{word}` in: {printed}"));
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
    let output = calib(
        &format!("compensate HEAD {}", file.display()),
        &solved.path("store"),
    );
    assert!(output.err.contains("--torque"), "{output:?}");
}
