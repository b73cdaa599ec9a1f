//! `init` writes what `check` accepts and `run` runs, and overwrites nothing; completions and manual pages are made.

mod foreign;
mod layouts;
mod lists;
mod torques;

use crate::answer::{calib, has, put, read};
use std::fmt::Write;

#[test]
fn what_init_writes_is_understood_and_never_overwrites() {
    let folder = tempfile::tempdir().unwrap();
    let mut controller = String::from("Controller log\n\nPoint;A1;A2;A3;A4;A5;A6;load;remark\n");
    let mut tracker = String::from("name,X,Y,Z\n");
    for k in 0..40 {
        let q: Vec<String> = (0..6)
            .map(|j| format!("{:.2}", 50.0 * f64::from(k * 7 + j).sin()).replace('.', ","))
            .collect();
        writeln!(controller, "P{k};{};10,0;ok", q.join(";")).unwrap();
        writeln!(tracker, "P{k},{}.5,-200,900", 1500 + k).unwrap();
    }
    put(folder.path(), "controller.csv", controller);
    put(folder.path(), "tracker.csv", tracker);
    let unread = calib(folder.path(), "init .").code(0);
    has(
        &unread.err,
        [
            "not looked at in .: controller.csv, tracker.csv; delete ./robot.yaml and ./pipeline.yaml",
        ],
    );
    std::fs::remove_file(folder.path().join("pipeline.yaml")).unwrap();
    std::fs::remove_file(folder.path().join("robot.yaml")).unwrap();
    let arguments = "init . --data controller.csv tracker.csv";
    let output = calib(folder.path(), arguments);
    let printed = output.out.clone();
    assert!(output.code == Some(0), "{}", output.err);
    has(&printed, ["6 joints (A1 to A6)", "not used: remark"]);
    let pipeline = read(folder.path().join("pipeline.yaml"));
    for part in [
        "file: \"controller.csv\"",
        "delimiter: \";\"",
        "decimal: comma",
        "skip: 2",
        "q: {column: \"A{j}\", unit: deg}",
        "join: {by: id}",
    ] {
        assert!(pipeline.contains(part), "{part} in\n{pipeline}");
    }
    calib(folder.path(), "check pipeline.yaml").code(0);
    calib(folder.path(), "run pipeline.yaml --until split --quiet").code(0);
    let again = calib(folder.path(), arguments).code(2);
    assert!(again.err.contains("is already there"));
    let seven = calib(
        folder.path(),
        "init other --data controller.csv --robot seven",
    );
    assert!(seven.err.contains("seven has 7 joints, the recording 6"));
}

#[test]
fn a_foreign_table_is_understood_as_it_stands_and_what_is_left_to_do_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let mut table = String::from(
        "Messpunkt;Achse1 [\u{b0}];Achse2 [\u{b0}];Achse3 [\u{b0}];Achse4 [\u{b0}];Achse5 [\u{b0}];Achse6 [\u{b0}];X_soll [mm];Y_soll [mm];Z_soll [mm];X_ist [mm];Y_ist [mm];Z_ist [mm];Bemerkung\r\n",
    );
    for k in 0..12 {
        let q: Vec<String> = (0..6)
            .map(|j| format!("{:.4}", 70.0 * f64::from(k * 5 + j).sin()).replace('.', ","))
            .collect();
        write!(
            table,
            "P{k:03};{};1000,5;{k},0;900,0;1000,7;{k},1;900,2;ok\r\n",
            q.join(";")
        )
        .unwrap();
    }
    put(folder.path(), "messung.csv", table);
    calib(folder.path(), "init . --data messung.csv").code(0);
    let pipeline = read(folder.path().join("pipeline.yaml"));
    for part in [
        "point_id: {column: \"Messpunkt\"}",
        "q: {column: \"Achse{j} [\u{b0}]\", unit: deg}\n",
        "x: {column: \"X_ist [mm]\", unit: mm}\n",
        "z: {column: \"Z_ist [mm]\", unit: mm}\n",
        "not used: \"X_soll [mm]\"",
    ] {
        assert!(pipeline.contains(part), "{part} in\n{pipeline}");
    }
    let check = calib(folder.path(), "check pipeline.yaml").code(0);
    let printed = check.out.clone();
    has(&printed, ["replace   5 lines: ", "          robot.yaml:"]);
    let identified = pipeline
        .replace("# limits:", "limits:")
        .replace("# identity:", "identity:");
    put(folder.path(), "pipeline.yaml", identified);
    calib(folder.path(), "check pipeline.yaml").code(0);

    put(folder.path(), "bare.csv", "a;b;c;d\n1;2;3;4\n");
    let output = calib(folder.path(), "init bare --data bare.csv");
    let printed = output.out.clone();
    has(
        &printed,
        "name columns of joints and the measured point where it says REPLACE",
    );
    let check = calib(folder.path(), "check bare/pipeline.yaml");
    assert!(check.out.contains("replace   9 lines: "));
}

#[test]
fn every_kind_of_robot_that_init_writes_is_read() {
    for kind in ["spherical6", "offset6", "seven", "dh6"] {
        let folder = tempfile::tempdir().unwrap();
        calib(folder.path(), &format!("init --robot {kind}")).code(0);
        let text = read(folder.path().join("robot.yaml"));
        let file = calib::robot::import::RobotFileText {
            label: "robot.yaml",
            text: &text,
        };
        calib::robot::import::read_calib(file, None)
            .unwrap_or_else(|error| panic!("{kind}: {error}"));
    }
}

#[test]
fn shells_and_readers_of_manuals_are_served() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let output = calib(folder.path(), &format!("completions {shell}"));
        assert!(output.out.contains("compensate"), "{shell}");
    }
    let page = calib(folder.path(), "man compensate");
    assert!(page.out.contains(".TH calib-compensate"));
    calib(folder.path(), "man compensat").code(2);
}

#[test]
fn an_arm_that_is_not_known_is_answered_by_the_nearest_of_the_library() {
    let folder = tempfile::tempdir().unwrap();
    let answer = calib(folder.path(), "init cell --robot kr10_r1101").code(2);
    has(
        &answer.err,
        [
            "--robot: no arm `kr10_r1101`; did you mean `kr10_r1100`?",
            "arms that `calib robots` lists",
        ],
    );
    let strange = calib(folder.path(), "init cell --robot zzzzzzzzz").code(2);
    has(&strange.err, "no arm `zzzzzzzzz`; allowed: spherical6");
}

#[test]
fn clocks_that_do_not_overlap_are_joined_by_the_offset_that_pairs_all_rows() {
    let folder = tempfile::tempdir().unwrap();
    let (mut controller, mut tracker) = (
        String::from("time,J1,J2,J3,J4,J5,J6\n"),
        String::from("time,X,Y,Z\n"),
    );
    for k in 0..30 {
        let q: Vec<String> = (0..6)
            .map(|j| format!("{:.3}", 50.0 * f64::from(k * 7 + j).sin()))
            .collect();
        let (minute, second) = (k / 3, 20 * (k % 3));
        let stamp = |hour, more| format!("2026-10-05T{hour:02}:{minute:02}:{second:02}{more}");
        writeln!(controller, "{},{}", stamp(8, ".000Z"), q.join(",")).unwrap();
        writeln!(
            tracker,
            "{},{}.5,-200,{}",
            stamp(10, ".700"),
            1500 + k,
            900 + k * k
        )
        .unwrap();
    }
    put(folder.path(), "controller.csv", controller);
    put(folder.path(), "tracker.csv", tracker);
    calib(folder.path(), "init . --data controller.csv tracker.csv").code(0);
    has(
        &read(folder.path().join("pipeline.yaml")),
        [
            "join: {by: time, tolerance_s: 2, offset_s: 7200.700}",
            "CHECK: the clocks are 7200.7 s apart in all rows (2 h and 0.7 s: UTC against local time)",
        ],
    );
    calib(folder.path(), "run pipeline.yaml --until split --quiet").code(0);
}
