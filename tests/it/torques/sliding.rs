//! An arm whose first joint slides: a lift that carries a link which turns about y, by a formula.

use super::recordings::{moved, noise};
use crate::answer::{Answer, calib, put, read};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

const GRAVITY: f64 = 9.81;
/// kg, of the carriage and of the link; m, from the turning joint to the link's centre and to the tool.
const MASSES: [f64; 2] = [10.0, 6.0];
const CENTRE: f64 = 0.25;
const LENGTH: f64 = 0.5;
/// kg m2, of the link about its centre.
const INERTIA: f64 = 0.08;
/// N and N s/m; Nm and Nm s/rad.
const COULOMB: [f64; 2] = [40.0, 1.5];
const VISCOUS: [f64; 2] = [60.0, 2.0];

/// A URDF of the arm; the tool is a point.
const URDF: &str = r#"<robot name="lift">
<link name="world"/>
<link name="carriage"><inertial><origin xyz="0 0 0"/><mass value="10"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="arm"><inertial><origin xyz="0.25 0 0"/><mass value="6"/><inertia ixx="0.01" iyy="0.08" izz="0.08" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tool"/>
<joint name="lift" type="prismatic"><parent link="world"/><child link="carriage"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="900" velocity="2"/></joint>
<joint name="turn" type="revolute"><parent link="carriage"/><child link="arm"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="90" velocity="3"/></joint>
<joint name="flange" type="fixed"><parent link="arm"/><child link="tool"/><origin xyz="0.5 0 0"/></joint>
</robot>"#;
const FROM_URDF: &str = "calib_robot: 1\nname: lift\nunits: {length: mm, angle: deg}\nkinematics: {urdf: {base: world, tip: tool}}\n\
                         mass_tolerance: {mass: 0.02, centre: 2, inertia: 0.05}\n";

/// Height (mm), angle (deg), force (N) and torque (Nm) at 100 Hz of the arm that carries `payload` kg at its tool.
fn rows(payload: f64, seed: u64) -> String {
    let mut text = String::from("time_s,z_mm,q_deg,f_n,tau_nm");
    for k in 0..4000u64 {
        let time = k as f64 / 100.0;
        let [lift, turn] = [moved(time, seed).map(|x| 0.3 * x), moved(time, seed + 7)];
        let moment = MASSES[1] * CENTRE + payload * LENGTH;
        let about = INERTIA + MASSES[1] * CENTRE * CENTRE + payload * LENGTH * LENGTH;
        let (sine, cosine) = turn[0].sin_cos();
        let force = (MASSES[0] + MASSES[1] + payload) * (lift[2] + GRAVITY)
            - moment * (cosine * turn[2] - sine * turn[1] * turn[1]);
        let torque = about * turn[2] - moment * cosine * (lift[2] + GRAVITY);
        // m/s and rad/s over which friction turns.
        let turns = [0.002, 0.01];
        let dry =
            |joint: usize, v: f64| VISCOUS[joint] * v + COULOMB[joint] * (v / turns[joint]).tanh();
        write!(
            text,
            "\n{time:.3},{:.5},{:.6},{:.4},{:.5}",
            1e3 * lift[0],
            turn[0].to_degrees(),
            force + dry(0, lift[1]) + 0.8 * noise(2 * k + 1_000_000 * seed),
            torque + dry(1, turn[1]) + 0.05 * noise(2 * k + 1 + 1_000_000 * seed)
        )
        .unwrap();
    }
    text
}

fn diagnosed(folder: &Path, robot: &str, command: &str) -> Answer {
    put(folder, "lift.urdf", URDF);
    put(folder, "robot.yaml", FROM_URDF);
    put(folder, "recording.csv", rows(0.8, 3));
    let pipeline = format!(
        "calib: 1\nname: lift\nstages:\n- {{uses: robot, with: {{{robot}}}}}\n- uses: ingest_torques\n  with:\n    files:\n    - file: recording.csv\n\
         \x20     columns:\n        time: {{column: time_s, unit: s}}\n        q: {{columns: [z_mm, q_deg], unit: deg, linear_unit: mm}}\n\
         \x20       torque: {{columns: [f_n, tau_nm], unit: Nm, linear_unit: N}}\n- uses: diagnose_torques\n- uses: report_torques\n"
    );
    put(folder, "p.yaml", pipeline);
    calib(folder, command)
}

/// Value and unit of a number of the finding of a name at a place.
fn number(document: &Value, finding: [&str; 2], name: &str) -> (f64, String) {
    let findings = document["findings"].as_array().unwrap();
    let found = findings
        .iter()
        .find(|one| [&one["effect"], &one["where"]] == finding)
        .unwrap_or_else(|| panic!("{finding:?} is not among {findings:#?}"));
    let numbers = found["parameters"].as_array().unwrap();
    let one = numbers.iter().find(|one| one["name"] == name);
    let one = one.unwrap_or_else(|| panic!("{name} is not among {numbers:?}"));
    (
        one["value"].as_f64().unwrap(),
        one["unit"].as_str().unwrap().into(),
    )
}

#[test]
fn friction_of_a_sliding_joint_is_in_newtons_and_a_mass_that_it_lifts_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let robot = "file: robot.yaml, urdf: lift.urdf";
    let answer = diagnosed(folder.path(), robot, "diagnose p.yaml --json --quiet").ok();
    let document: Value = serde_json::from_str(&answer).unwrap();
    for (finding, name, truth, unit) in [
        (["coulomb_friction", "joint 1"], "coulomb", 40.0, "N"),
        (["viscous_friction", "joint 1"], "viscous", 60.0, "N s/m"),
        (["coulomb_friction", "joint 2"], "coulomb", 1.5, "Nm"),
        (["viscous_friction", "joint 2"], "viscous", 2.0, "Nm s/rad"),
        (["payload_error", "tool"], "mass", 0.8, "kg"),
    ] {
        let (value, found) = number(&document, finding, name);
        assert!(
            (value / truth - 1.0).abs() < 0.1 && found == unit,
            "{finding:?}: {value} {found}, truly {truth} {unit}"
        );
    }
    let findings = document["findings"].as_array().unwrap();
    assert_eq!(findings.len(), 5, "{findings:#?}");
    calib(folder.path(), "run p.yaml --quiet").ok();
    let select = "query HEAD 'select measured1_n, measured2_nm, dq1_mm_s from torque_course' --csv";
    assert!(calib(folder.path(), select).ok().lines().count() > 100);
    calib(folder.path(), "export HEAD --format dynamics --out d.json").ok();
    let exported: Value = serde_json::from_str(&read(folder.path().join("d.json"))).unwrap();
    assert_eq!(exported["joints"][0]["coulomb"]["unit"], "N");
    assert!(exported["joints"][0]["seen"]["position_m"].is_array());
}

#[test]
fn forces_of_a_sliding_joint_need_a_unit_of_forces() {
    let folder = tempfile::tempdir().unwrap();
    diagnosed(
        folder.path(),
        "file: robot.yaml, urdf: lift.urdf",
        "check p.yaml",
    );
    let text = read(folder.path().join("p.yaml"));
    put(&folder, "p.yaml", text.replace(", linear_unit: N}", "}"));
    let answer = calib(folder.path(), "run p.yaml --quiet");
    assert!(
        answer.code != Some(0)
            && answer
                .err
                .contains("joint 1 is prismatic; say `linear_unit` for `torque`"),
        "{}",
        answer.err
    );
}
