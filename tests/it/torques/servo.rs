//! A real servo with a pendulum of known mass, by its duty: its encoder counts 4096 a turn, and its controller turns these counts into duty.

use crate::answer::{calib, put, read};
use crate::desk::shared;
use serde_json::{Value, json};
use std::fmt::Write;

/// Duty at full.
const FULL: f64 = 885.0;

/// The recordings one after the other, each its own trajectory, the last quarter held out.
fn recording(files: &[std::path::PathBuf]) -> String {
    let mut text = String::from("trajectory,use,time_s,q_rad,dq_rad_s,duty,supply_v");
    for (number, file) in files.iter().enumerate() {
        let whole: Value = serde_json::from_str(&read(file)).unwrap();
        let entries = whole["entries"].as_array().unwrap();
        let of = |entry: &Value, name: &str| entry[name].as_f64().unwrap();
        let start = of(&entries[0], "timestamp");
        let usage = if 4 * number >= 3 * files.len() {
            "validate"
        } else {
            "fit"
        };
        for entry in entries {
            // Two's complement of 16 bits.
            let load = of(entry, "load");
            let load = if load >= 32768.0 {
                load - 65536.0
            } else {
                load
            };
            let row = [
                of(entry, "timestamp") - start,
                of(entry, "position"),
                of(entry, "speed"),
                load / FULL,
                of(entry, "input_volts"),
            ];
            write!(text, "\n{},{usage}", number + 1).unwrap();
            row.iter()
                .for_each(|value| write!(text, ",{value}").unwrap());
        }
    }
    text
}

#[test]
fn counts_of_a_servos_encoder_do_not_double_its_friction() {
    let Some(folder) = shared("data/xl330_bam") else {
        return;
    };
    let files = std::fs::read_dir(folder).unwrap();
    let files = files.map(|file| file.unwrap().path());
    let is_json = |path: &std::path::PathBuf| path.extension().is_some_and(|end| end == "json");
    let mut files: Vec<_> = files.filter(is_json).collect();
    files.sort();
    let out = tempfile::tempdir().unwrap();
    put(&out, "recording.csv", recording(&files));
    let robot = json!({
        "name": "xl330", "axes": [[0, 1, 0]], "points": [[0, 0, 0]], "tool": [0, 0, -100], "mass": [0.49], "com": [[0, 0, -100]],
        "inertia": [[0.0012, 0, 0, 0.0018, 0, 0.0012]], "ratio": [288.35], "kt": [1], "payload": 0, "payload_com": [0, 0, 0],
        "payload_inertia": [0, 0, 0, 0, 0, 0], "gravity": [0, 0, -9.81], "coupling": [],
        "inertia_tolerance": {"mass_rel": 0.01, "com_mm": 2, "inertia_rel": 0.1},
    });
    put(&out, "robot.json", robot.to_string());
    let pipeline = "calib: 1\nname: servo\nstages:\n- {uses: robot, with: {file: robot.json, format: case}}\n- uses: ingest_torques\n  with:\n    files:\n\
         \x20   - file: recording.csv\n      columns:\n        time: {column: time_s, unit: s}\n        trajectory: {column: trajectory}\n\
         \x20       usage: {column: use}\n        q: {columns: [q_rad], unit: rad}\n        velocity: {columns: [dq_rad_s], unit: rad/s}\n\
         \x20       torque: {duty: [duty], supply: {column: supply_v}, kt_over_r: 0.083}\n- uses: diagnose_torques\n";
    for cutoff in [None, Some(4), Some(6), Some(8), Some(12)] {
        let settings = cutoff.map(|hz| format!("  with: {{cutoff_hz: {hz}}}\n"));
        put(
            &out,
            "p.yaml",
            pipeline.to_string() + &settings.unwrap_or_default(),
        );
        let answer = calib(out.path(), "diagnose p.yaml --json --quiet").ok();
        let document: Value = serde_json::from_str(&answer).unwrap();
        let findings = document["findings"].as_array().unwrap();
        for one in findings {
            let name = one["effect"].as_str().unwrap();
            assert!(
                ["viscous_friction", "load_friction"].contains(&name),
                "{cutoff:?}: {findings:#?}"
            );
        }
        let of_name = |name: &str| findings.iter().find(|one| one["effect"] == name);
        let number = |name: &str, parameter: &str| {
            let all = of_name(name)?["parameters"].as_array()?;
            let number = all.iter().find(|one| one["name"] == parameter);
            number?["value"].as_f64()
        };
        let viscous = number("viscous_friction", "viscous");
        // Plain least squares: 0.034 to 0.038 Nm s/rad at cut-offs from 3 to 20 Hz.
        assert!(
            viscous.is_some_and(|viscous| (0.029..0.043).contains(&viscous)),
            "{cutoff:?}: {viscous:?} Nm s/rad"
        );
        // The same: 15 to 34 % without Coulomb friction in the model, by how fast its sign turns; where the servo drives, 16 to 23 %.
        let share = number("load_friction", "share");
        assert!(
            share.is_some_and(|share| (0.15..0.34).contains(&share)),
            "{cutoff:?}: {share:?}"
        );
    }
}
