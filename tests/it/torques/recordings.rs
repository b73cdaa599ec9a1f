//! Arms whose torques a formula gives: what one recording carries that others do not, in numbers that the data see; and recordings that are
//! written as motors and loggers write them.

use super::masses::table;
use super::{document, write};
use crate::answer::{Answer, calib, put, root};
use calib::table::{TorqueChangeRow, TorqueChangeTable};
use serde_json::json;
use std::fmt::Write;
use std::path::Path;

const GRAVITY: f64 = 9.81;

/// A whole number's share of 1, without a pattern.
fn chance(seed: u64) -> f64 {
    let mut x = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (seed >> 31);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

pub(super) fn noise(seed: u64) -> f64 {
    (0..12).map(|k| chance(seed * 12 + k)).sum::<f64>() - 6.0
}

/// Angle, velocity and acceleration of a joint, rad and s.
pub(super) fn moved(time: f64, seed: u64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for k in 1..6u64 {
        let size = 0.1 + 0.4 * chance(seed * 100 + k);
        let (pace, phase) = (
            0.628 * k as f64,
            std::f64::consts::TAU * chance(seed * 100 + k + 50),
        );
        let (sine, cosine) = (pace * time + phase).sin_cos();
        sum[0] += size * sine;
        sum[1] += size * pace * cosine;
        sum[2] -= size * pace * pace * sine;
    }
    sum
}

/// Two joints about y whose links point along x, of 300 and 200 mm; the second may be missing. A mass sits on the first, m from its joint.
#[derive(Clone, Copy)]
struct Planar {
    joints: usize,
    added: [f64; 2],
    seed: u64,
}

const LENGTHS: [f64; 2] = [0.3, 0.2];
const MASSES: [f64; 2] = [1.0, 0.6];
const INERTIAS: [f64; 2] = [0.004, 0.002];

impl Planar {
    fn new(joints: usize, seed: u64) -> Self {
        Self {
            joints,
            added: [0.0; 2],
            seed,
        }
    }

    /// Rows at 100 Hz: time, then angle (rad), velocity and torque (Nm) of each joint.
    fn rows(&self) -> Vec<[f64; 7]> {
        let row = |k: u64| {
            let time = k as f64 / 100.0;
            let [one, two] = [0, 1].map(|joint| moved(time, self.seed + 7 * joint));
            let two = if self.joints == 2 { two } else { [0.0; 3] };
            let [l, _] = LENGTHS;
            let [c1, c2] = [0.5 * LENGTHS[0], 0.5 * LENGTHS[1]];
            let [m1, m2] = [MASSES[0], if self.joints == 2 { MASSES[1] } else { 0.0 }];
            let [i1, i2] = [
                INERTIAS[0],
                if self.joints == 2 { INERTIAS[1] } else { 0.0 },
            ];
            let [added, far] = self.added;
            let (sine, cosine) = two[0].sin_cos();
            let h = m2 * l * c2;
            let first = i1 + m1 * c1 * c1 + added * far * far;
            let second = i2 + m2 * c2 * c2;
            let down = |angle: f64| -GRAVITY * angle.cos();
            let about_two = m2 * c2 * down(one[0] + two[0]);
            let about_one = (m1 * c1 + added * far + m2 * l) * down(one[0]) + about_two;
            let coupled = second + h * cosine;
            let torque_one = (first + second + m2 * l * l + 2.0 * h * cosine) * one[2]
                + coupled * two[2]
                - h * sine * (2.0 * one[1] + two[1]) * two[1]
                + about_one;
            let torque_two =
                coupled * one[2] + second * two[2] + h * sine * one[1] * one[1] + about_two;
            let friction = |v: f64| 0.05 * v + 0.03 * (v / 0.02).tanh();
            let noisy = |joint: u64| 0.005 * noise(self.seed * 1_000_000 + 2 * k + joint);
            [
                time,
                one[0],
                one[1],
                torque_one + friction(one[1]) + noisy(0),
                two[0],
                two[1],
                torque_two + friction(two[1]) + noisy(1),
            ]
        };
        (0..3000).map(row).collect()
    }

    fn robot(&self) -> String {
        let n = self.joints;
        let x = |all: [f64; 2]| {
            json!(
                all[..n]
                    .iter()
                    .map(|x| [1e3 * x, 0.0, 0.0])
                    .collect::<Vec<_>>()
            )
        };
        let inertia = |i: f64| [0.0005, 0.0, 0.0, i, 0.0, i];
        let tool = 1e3 * LENGTHS[..n].iter().sum::<f64>();
        json!({
            "name": "planar", "axes": vec![[0, 1, 0]; n], "points": x([0.0, LENGTHS[0]]), "tool": [tool, 0, 0],
            "mass": MASSES[..n], "com": x([0.5 * LENGTHS[0], LENGTHS[0] + 0.5 * LENGTHS[1]]),
            "inertia": INERTIAS[..n].iter().map(|i| inertia(*i)).collect::<Vec<_>>(),
            "ratio": vec![100; n], "kt": vec![0.1; n], "payload": 0, "payload_com": [0, 0, 0], "payload_inertia": [0, 0, 0, 0, 0, 0],
            "gravity": [0, 0, -GRAVITY], "coupling": [], "inertia_tolerance": {"mass_rel": 0.02, "com_mm": 4.0, "inertia_rel": 0.05},
        })
        .to_string()
    }

    fn write(&self, folder: &Path) {
        let mut text = String::from("time_s");
        for joint in 1..=self.joints {
            write!(text, ",q{joint}_deg,tau{joint}_nm").unwrap();
        }
        for row in self.rows() {
            write!(text, "\n{:.3}", row[0]).unwrap();
            for joint in 0..self.joints {
                let (angle, torque) = (row[1 + 3 * joint], row[3 + 3 * joint]);
                write!(text, ",{:.6},{torque:.6}", angle.to_degrees()).unwrap();
            }
        }
        write(
            folder,
            &[("robot.json", self.robot()), ("recording.csv", text)],
        );
    }
}

/// Runs a pair, and what the terminal and the table say.
fn pair(before: Planar, after: Planar) -> (String, Vec<TorqueChangeRow>) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    before.write(&at("before"));
    after.write(&at("after"));
    let pipeline = root("pipelines/dynamics_pair/pipeline.yaml");
    let command = format!(
        "run {} --store {} --set before={} --set after={}",
        pipeline.display(),
        at("store").display(),
        at("before").display(),
        at("after").display()
    );
    let answer = calib(".", &command);
    let out = answer.ok();
    let TorqueChangeTable(rows) = table(&at("store"), "compare_torques/changes");
    (out, rows)
}

fn named<'r>(rows: &'r [TorqueChangeRow], name: &str) -> &'r TorqueChangeRow {
    rows.iter()
        .find(|row| row.name == name && row.rank.is_some())
        .unwrap_or_else(|| panic!("{name} is not among {rows:?}"))
}

fn near(row: &TorqueChangeRow, truth: f64, share: f64) {
    assert!(
        (row.change - truth).abs() < f64::max(4.0 * row.sigma, share * truth)
            && row.sigma < share * truth,
        "{}: {} +- {} {}, truly {truth}",
        row.name,
        row.change,
        row.sigma,
        row.unit
    );
}

#[test]
fn a_mass_that_one_joint_does_not_see_is_told_as_its_moment_and_as_the_point_that_has_it() {
    let before = Planar::new(1, 1);
    let after = Planar {
        added: [0.105, 0.25],
        seed: 2,
        ..before
    };
    let (out, rows) = pair(before, after);
    assert!(
        rows.iter()
            .all(|row| row.name != "payload.mass" && row.sigma < 1e3),
        "{rows:?}"
    );
    near(named(&rows, "payload.moment_j1"), 0.105 * 0.25, 0.05);
    near(named(&rows, "payload.point_mass"), 0.105, 0.15);
    near(named(&rows, "payload.point_distance"), 0.25, 0.15);
    let said = out.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in ["g m about joint 1", "mm out", "the mass itself is not seen"] {
        assert!(said.contains(part), "{part} in\n{out}");
    }
}

#[test]
fn a_mass_on_a_link_before_the_last_is_found_there_and_the_terminal_says_what_changed() {
    let before = Planar::new(2, 11);
    let after = Planar {
        added: [0.205, 0.2],
        seed: 12,
        ..before
    };
    let (out, rows) = pair(before, after);
    let found: Vec<&TorqueChangeRow> = rows.iter().filter(|row| row.rank.is_some()).collect();
    assert!(
        found
            .iter()
            .all(|row| row.effect == "added_mass" && row.place == "link 1"),
        "{found:?}"
    );
    near(named(&rows, "added_mass.l1.moment"), 0.205 * 0.2, 0.1);
    assert!(
        out.contains("changed") && out.contains("link 1 carries"),
        "{out}"
    );
}

#[test]
fn of_three_recordings_the_one_that_differs_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let plain = Planar::new(1, 21);
    let other = Planar { seed: 22, ..plain };
    let loaded = Planar {
        added: [0.1, 0.2],
        seed: 23,
        ..plain
    };
    let mut stages =
        vec![json!({"uses": "robot", "with": {"file": "loaded/robot.json", "format": "case"}})];
    for (name, case) in [("loaded", loaded), ("plain", plain), ("other", other)] {
        case.write(&folder.path().join(name));
        let columns = json!({
            "time": {"column": "time_s", "unit": "s"}, "q": {"column": "q{j}_deg", "unit": "deg"},
            "torque": {"column": "tau{j}_nm", "unit": "Nm"},
        });
        let file = format!("{name}/recording.csv");
        stages.push(json!({"uses": "ingest_torques", "id": name, "with": {"files": [{"file": file, "columns": columns}]}}));
        stages.push(json!({"uses": "diagnose_torques", "id": format!("of_{name}")}));
    }
    stages.push(json!({"uses": "compare_torques"}));
    put(
        &folder,
        "p.yaml",
        json!({"calib": 1, "name": "three", "stages": stages}).to_string(),
    );
    let out = calib(folder.path(), "run p.yaml").ok();
    for part in [
        "2 of 3 recordings agree: plain, other",
        "loaded against plain: 1 change",
        "the last link carries",
    ] {
        assert!(out.contains(part), "{part} in\n{out}");
    }
    let one = calib(
        folder.path(),
        "run p.yaml --set stages.7.reads.earlier_parameters=of_plain",
    );
    assert_ne!(one.code, Some(0));
}

/// One joint's recording as a file without a header: duty, supply (tenths of a volt), angle, velocity.
fn driven(folder: &Path, torque: &str) -> Answer {
    let (case, per_volt, per_speed) = (Planar::new(1, 31), 0.5, 0.04);
    let mut text = String::new();
    for row in case.rows() {
        let supply = 7.4 + 0.2 * (0.3 * row[0]).sin();
        let duty = (row[3] + per_speed * row[2]) / per_volt / supply;
        writeln!(
            text,
            "{:.6},{:.3},{:.6},{:.6}",
            885.0 * duty,
            10.0 * supply,
            2048.0 + 4096.0 * row[1] / std::f64::consts::TAU,
            row[2]
        )
        .unwrap();
    }
    write(folder, &[("robot.json", case.robot()), ("log.txt", text)]);
    let pipeline = format!(
        "calib: 1\nname: driven\nstages:\n\
         - {{uses: robot, with: {{file: robot.json, format: case}}}}\n\
         - uses: ingest_torques\n  with:\n    files:\n    - file: log.txt\n      header: false\n      columns:\n\
         \x20       time: {{rate: 100}}\n        q: {{columns: [3], counts_per_turn: 4096, zero: [2048]}}\n        velocity: {{columns: [4], unit: rad/s}}\n\
         \x20       torque: {torque}\n- uses: diagnose_torques\n"
    );
    put(folder, "p.yaml", pipeline);
    calib(folder, "run p.yaml --quiet")
}

/// Time, s, and torque, Nm, of the rows that were read.
fn motion(folder: &Path) -> Vec<[f64; 2]> {
    let command = "query HEAD 'select time_s, tau1_nm from motion' --csv";
    let out = calib(folder, command).ok();
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        [cells[0], cells[1]]
    };
    out.lines().skip(1).map(row).collect()
}

const MOTOR: &str = "{duty: [1], full_duty: 885, supply: {column: 2, scale: 0.1}, kt_over_r: 0.5, kt2_over_r: 0.04}";

#[test]
fn the_duty_of_a_motor_of_known_constants_is_its_torque_in_a_file_without_header_and_clock() {
    let folder = tempfile::tempdir().unwrap();
    driven(folder.path(), MOTOR).ok();
    let rows = Planar::new(1, 31).rows();
    let motion = motion(folder.path());
    assert_eq!(motion.len(), rows.len());
    for (k, row) in rows.iter().enumerate().step_by(97) {
        let [time, torque] = motion[k];
        assert!(
            (time - row[0]).abs() < 1e-9 && (torque - row[3]).abs() < 1e-3,
            "row {k}: {time} s, {torque} Nm, truly {} s, {} Nm",
            row[0],
            row[3]
        );
    }
}

#[test]
fn motors_and_clocks_that_cannot_be_are_refused_with_their_place_and_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, parts) in [
        (
            "supply: {column: 2, scale: 0.1}",
            "supply: 0",
            ["torque.supply", "allowed: above 0 V"],
        ),
        (
            "full_duty: 885",
            "full_duty: 0",
            ["torque.full_duty", "allowed: above 0"],
        ),
        (
            "full_duty: 885",
            "full_duty: 1",
            ["column 1", "allowed: -1 to 1"],
        ),
        (
            "kt_over_r: 0.5, ",
            "",
            ["torque.kt_over_r", "Nm at the joint per volt"],
        ),
        (
            "duty: [1]",
            "duty: [9]",
            ["column 9", "the file has 4 columns"],
        ),
        (
            "duty: [1]",
            "voltage: [1], duty: [1]",
            ["torque", "one of them"],
        ),
    ] {
        let answer = driven(folder.path(), &MOTOR.replace(from, to));
        assert_ne!(answer.code, Some(0), "{to}");
        for part in parts {
            assert!(
                answer.err.contains(part),
                "{to}: no `{part}` in\n{}",
                answer.err
            );
        }
    }
    let pipeline = crate::answer::read(folder.path().join("p.yaml"));
    for (from, to, place) in [
        ("rate: 100", "rate: 0", "time.rate"),
        ("turn: 4096", "turn: 0", "q.counts_per_turn"),
    ] {
        put(&folder, "p.yaml", pipeline.replace(from, to));
        let answer = calib(folder.path(), "run p.yaml --quiet");
        assert!(
            answer.err.contains(place) && answer.err.contains("allowed: above 0"),
            "{}",
            answer.err
        );
    }
}

#[test]
fn objects_of_json_in_a_list_or_a_line_each_are_rows() {
    let folder = tempfile::tempdir().unwrap();
    let case = Planar::new(1, 41);
    let rows: Vec<String> = (case.rows().iter())
        .map(|row| {
            json!({"timestamp": row[0], "state": {"position": [row[1]]}, "torque": row[3]})
                .to_string()
        })
        .collect();
    let whole = format!("{{\"mass\": 0.5, \"entries\": [{}]}}", rows.join(",\n"));
    for (name, text) in [("whole.json", whole), ("lines.jsonl", rows.join("\n"))] {
        write(folder.path(), &[("robot.json", case.robot())]);
        put(&folder, name, text);
        let pipeline = format!(
            "calib: 1\nname: json\nstages:\n- {{uses: robot, with: {{file: robot.json, format: case}}}}\n\
             - uses: ingest_torques\n  with:\n    files:\n    - file: {name}\n      columns:\n\
             \x20       time: {{column: timestamp, unit: s}}\n        q: {{columns: [\"state.position[1]\"], unit: rad}}\n\
             \x20       torque: {{columns: [torque], unit: Nm}}\n"
        );
        put(&folder, "p.yaml", pipeline);
        calib(folder.path(), "run p.yaml --quiet").ok();
        assert_eq!(motion(folder.path()).len(), rows.len(), "{name}");
    }
    let broken = rows[..200].join("\n") + "\n{\"timestamp\": 2.0,\n";
    put(&folder, "lines.jsonl", broken);
    let answer = calib(folder.path(), "run p.yaml --quiet");
    assert!(
        answer.err.contains("lines.jsonl:201") && answer.err.contains("JSON"),
        "{}",
        answer.err
    );
}

#[test]
fn a_torque_that_acts_a_little_later_than_its_row_makes_no_other_friction() {
    let folder = tempfile::tempdir().unwrap();
    let case = Planar::new(1, 51);
    let rows = case.rows();
    let mut text = String::from("time_s,q1_deg,tau1_nm");
    for pair in rows.windows(2) {
        // Half a period, 5 ms, as that of a command that is held until the next row.
        let torque = 0.5 * (pair[0][3] + pair[1][3]);
        let angle = pair[0][1].to_degrees();
        write!(text, "\n{:.3},{angle:.6},{torque:.6}", pair[0][0]).unwrap();
    }
    let at = folder.path().join("case");
    write(
        &at,
        &[("robot.json", case.robot()), ("recording.csv", text)],
    );
    let found = document(&at, &folder.path().join("store"));
    let findings = found["findings"].as_array().unwrap();
    assert_eq!(findings.len(), 2, "{findings:#?}");
    // As [`Planar`] has them.
    for (name, truth) in [("viscous_friction", 0.05), ("coulomb_friction", 0.03)] {
        let one = findings.iter().find(|one| one["effect"] == name);
        let value = one.and_then(|one| one["parameters"][0]["value"].as_f64());
        assert!(
            value.is_some_and(|value| (value / truth - 1.0).abs() < 0.03),
            "{name}: {value:?}, truly {truth}"
        );
    }
}

#[test]
fn a_name_that_is_left_out_leaves_a_finding_without_a_name_at_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("case");
    Planar::new(1, 61).write(&at);
    let store = folder.path().join("store");
    let without = "--json --set diagnose_torques.without=[coulomb_friction]";
    let answer = super::diagnose(&at, &store, without).ok();
    let found: serde_json::Value = serde_json::from_str(&answer).unwrap();
    let findings = found["findings"].as_array().unwrap();
    let mut names: Vec<_> = (findings.iter())
        .map(|one| {
            (
                one["effect"].as_str().unwrap(),
                one["where"].as_str().unwrap(),
            )
        })
        .collect();
    names.sort_unstable();
    assert_eq!(
        names,
        [("unknown", "joint 1"), ("viscous_friction", "joint 1")]
    );
    let whole = document(&at, &store);
    let [left, right] =
        [&found, &whole].map(|one| one["after"]["validate_nrmse"].as_f64().unwrap());
    assert!(
        (left - right).abs() < 1e-12,
        "what explains the torques stays: {left}, {right}"
    );
}
