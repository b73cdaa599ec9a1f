//! Bad recordings of torques: each has a clear answer with file, line or place, and is not diagnosed.

use super::{diagnose, nothing, write};
use crate::answer::put;
use calib::twin::torque::TorqueCase;
use std::path::Path;

struct Sheet {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Sheet {
    fn read(text: &str) -> Self {
        let cells = |line: &str| line.split(',').map(String::from).collect::<Vec<String>>();
        let mut lines = text.lines();
        Self {
            header: cells(lines.next().unwrap()),
            rows: lines.map(cells).collect(),
        }
    }
    fn column(&self, name: &str) -> usize {
        self.header
            .iter()
            .position(|column| column == name)
            .unwrap_or_else(|| panic!("no column {name}"))
    }
    fn number(&self, row: usize, column: usize) -> f64 {
        self.rows[row][column].parse().unwrap()
    }
    fn change(&mut self, columns: &[String], of: impl Fn(f64) -> f64) {
        for name in columns {
            let column = self.column(name);
            for row in 0..self.rows.len() {
                self.rows[row][column] = format!("{:.6}", of(self.number(row, column)));
            }
        }
    }
    fn exchange(&mut self, one: &str, other: &str) {
        let (one, other) = (self.column(one), self.column(other));
        self.rows.iter_mut().for_each(|row| row.swap(one, other));
    }
    fn without(&mut self, names: &[String]) {
        for name in names {
            let column = self.column(name);
            self.header.remove(column);
            self.rows
                .iter_mut()
                .for_each(|row| drop(row.remove(column)));
        }
    }
    fn text(&self) -> String {
        let lines = std::iter::once(&self.header)
            .chain(&self.rows)
            .map(|cells| cells.join(","));
        lines.collect::<Vec<_>>().join("\n") + "\n"
    }
}

/// An arm: `compact6` with motor currents, `seven7r` with torque sensors.
fn case(robot: &str) -> (TorqueCase, Sheet) {
    let case = (0..20)
        .map(|number| TorqueCase::draw(&nothing(5), number))
        .find(|case| case.robot.name == robot)
        .unwrap();
    let sheet = Sheet::read(&case.recording()[1].1);
    (case, sheet)
}

fn columns(pattern: &str) -> Vec<String> {
    (1..=6)
        .map(|joint| pattern.replace("{j}", &joint.to_string()))
        .collect()
}

/// What calib says of a changed recording; the exit code too.
fn told(change: impl FnOnce(&mut Sheet), folder: &Path) -> (i32, String) {
    told_of("compact6", change, folder)
}

fn told_of(robot: &str, change: impl FnOnce(&mut Sheet), folder: &Path) -> (i32, String) {
    let (case, mut sheet) = case(robot);
    change(&mut sheet);
    write(
        folder,
        &[case.recording()[0].clone(), ("recording.csv", sheet.text())],
    );
    let output = diagnose(folder, &folder.join("store"), "");
    (output.code.unwrap(), output.err)
}

fn refused(change: impl FnOnce(&mut Sheet), words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let (code, told) = told(change, folder.path());
    assert!([2, 10].contains(&code), "exit code {code}: {told}");
    for word in words {
        assert!(told.contains(word), "no `{word}` in: {told}");
    }
}

#[test]
fn milliamperes_for_amperes_are_refused() {
    refused(
        |sheet| sheet.change(&columns("i{j}_a"), |current| 1e3 * current),
        &["unit"],
    );
}

#[test]
fn radians_for_degrees_are_refused() {
    refused(
        |sheet| sheet.change(&columns("q{j}_deg"), f64::to_radians),
        &["joint"],
    );
}

#[test]
fn exchanged_joints_are_refused() {
    refused(
        |sheet| sheet.exchange("i2_a", "i3_a"),
        &["joint 2", "joint 3", "exchanged"],
    );
}

#[test]
fn a_clock_that_jumps_or_goes_back_is_refused_at_its_line() {
    let later = |sheet: &mut Sheet, seconds: f64| {
        let column = sheet.column("time_s");
        for row in 120..sheet.rows.len() {
            sheet.rows[row][column] = format!("{:.3}", sheet.number(row, column) + seconds);
        }
    };
    refused(
        |sheet| later(sheet, 5.0),
        &["recording.csv:122", "the clock jumps by 5.0"],
    );
    refused(
        |sheet| later(sheet, -1.0),
        &["recording.csv:122", "the clock goes back"],
    );
}

#[test]
fn a_dead_channel_is_refused_with_its_joint() {
    refused(
        |sheet| sheet.change(&["i3_a".into()], |_| 0.25),
        &["current of joint 3", "0.25 in each of"],
    );
}

#[test]
fn missing_columns_are_named() {
    refused(
        |sheet| sheet.without(&columns("i{j}_a")),
        &["recording.csv", "neither torques nor motor currents"],
    );
    refused(
        |sheet| sheet.without(&["q3_deg".into()]),
        &["recording.csv", "q3_deg"],
    );
    refused(
        |sheet| sheet.without(&["time_s".into()]),
        &["recording.csv", "time_s"],
    );
}

#[test]
fn an_arm_that_hardly_moves_is_refused() {
    let still = |sheet: &mut Sheet| {
        let names = columns("q{j}_deg");
        let first: Vec<f64> = names
            .iter()
            .map(|name| sheet.number(0, sheet.column(name)))
            .collect();
        names.iter().zip(first).for_each(|(name, first)| {
            sheet.change(std::slice::from_ref(name), |q| first + 1e-3 * (q - first))
        });
    };
    refused(still, &["hardly moves"]);
}

#[test]
fn rows_that_cannot_be_read_are_counted_and_too_many_are_refused() {
    let spoiled = |every: usize| {
        move |sheet: &mut Sheet| {
            let column = sheet.column("q2_deg");
            sheet
                .rows
                .iter_mut()
                .step_by(every)
                .for_each(|row| row[column] = "lost".into());
        }
    };
    refused(
        spoiled(10),
        &[
            "recording.csv:2",
            "rows are rejected",
            "`lost` is not a number",
        ],
    );
    let folder = tempfile::tempdir().unwrap();
    let (code, said) = told(spoiled(400), folder.path());
    assert_eq!(code, 0, "{said}");
}

#[test]
fn a_row_that_is_missing_at_a_low_rate_is_bridged_and_no_row_is_told_twice() {
    // At 25 Hz every row of the clock is judged, one that is made up too.
    let folder = tempfile::tempdir().unwrap();
    let holed = |sheet: &mut Sheet| {
        let mut number = 0..;
        sheet.rows.retain(|_| {
            number
                .next()
                .is_some_and(|number: usize| number.is_multiple_of(2) && number != 196)
        });
    };
    let (code, said) = told(holed, folder.path());
    assert_eq!(code, 0, "{said}");
}

#[test]
fn files_of_one_name_in_two_folders_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let (case, sheet) = case("compact6");
    write(folder.path(), &[case.recording()[0].clone()]);
    let mut spoilt = Sheet {
        header: sheet.header.clone(),
        rows: sheet.rows.clone(),
    };
    let column = spoilt.column("q2_deg");
    spoilt.rows[7][column] = "lost".into();
    for (name, sheet) in [("one", &sheet), ("two", &spoilt), ("three", &spoilt)] {
        write(
            &folder.path().join(name),
            &[("recording.csv", sheet.text())],
        );
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/dynamics/pipeline.yaml");
    let text = std::fs::read_to_string(root).unwrap();
    let (before, block) = text
        .split_once("        - file: ${case}/recording.csv\n")
        .unwrap();
    let (columns, after) = block.split_once("\n\n").unwrap();
    let file = |name: &str| format!("        - file: {name}/recording.csv\n{columns}\n");
    let all = ["one", "two", "three"].map(file).concat();
    put(
        folder.path(),
        "p.yaml",
        format!("{}{all}\n{after}", before.replace("${case}/", "")),
    );
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_calib"))
        .args(["run", "p.yaml", "--until", "ingest_torques", "--quiet"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// One way to spoil a recording: whose, how, the code, and words of the answer.
type Spoiled = (
    &'static str,
    &'static str,
    fn(&mut Sheet),
    i32,
    &'static [&'static str],
);

fn each(pattern: &str, joints: usize) -> Vec<String> {
    (1..=joints)
        .map(|joint| pattern.replace("{j}", &joint.to_string()))
        .collect()
}

fn cut(sheet: &mut Sheet, name: &str, share: f64) {
    let column = sheet.column(name);
    let most = (0..sheet.rows.len())
        .map(|row| sheet.number(row, column).abs())
        .fold(0.0, f64::max);
    sheet.change(&[name.into()], |value| {
        value.clamp(-share * most, share * most)
    });
}

const SPOILED: [Spoiled; 14] = [
    (
        "seven7r",
        "Nmm for Nm",
        |sheet| sheet.change(&each("tau{j}_nm", 7), |x| 1e3 * x),
        10,
        &["torque", "a unit", "1,000"],
    ),
    (
        "seven7r",
        "kNm for Nm",
        |sheet| sheet.change(&each("tau{j}_nm", 7), |x| 1e-3 * x),
        10,
        &["torque", "a unit", "1,000"],
    ),
    (
        "compact6",
        "mA for A",
        |sheet| sheet.change(&each("i{j}_a", 6), |x| 1e3 * x),
        10,
        &["torque", "a unit", "1,000"],
    ),
    (
        "seven7r",
        "A for Nm",
        |sheet| sheet.change(&each("tau{j}_nm", 7), |x| x / 12.0),
        10,
        &["torque", "map them as `current`"],
    ),
    (
        "compact6",
        "Nm for A",
        |sheet| sheet.change(&each("i{j}_a", 6), |x| 12.0 * x),
        10,
        &["torque", "map them as `torque`"],
    ),
    (
        "compact6",
        "currents exchanged",
        |sheet| sheet.exchange("i2_a", "i3_a"),
        10,
        &["joint 2 and joint 3 look exchanged"],
    ),
    (
        "compact6",
        "angles exchanged",
        |sheet| sheet.exchange("q2_deg", "q3_deg"),
        10,
        &["the angles of joint 2 and joint 3 look exchanged"],
    ),
    (
        "compact6",
        "joints exchanged",
        |sheet| {
            sheet.exchange("q2_deg", "q3_deg");
            sheet.exchange("i2_a", "i3_a");
        },
        10,
        &["joint 2 and joint 3 look exchanged"],
    ),
    (
        "compact6",
        "another sign",
        |sheet| sheet.change(&["i2_a".into()], |x| -x),
        10,
        &["joint 2", "the other sign"],
    ),
    (
        "compact6",
        "radians declared as degrees",
        |sheet| sheet.change(&each("q{j}_deg", 6), f64::to_radians),
        10,
        &["radians"],
    ),
    (
        "compact6",
        "degrees declared as radians",
        |sheet| sheet.change(&each("q{j}_deg", 6), f64::to_degrees),
        10,
        &["q2_deg", "allowed: -1145.9"],
    ),
    (
        "compact6",
        "currents cut off",
        |sheet| cut(sheet, "i2_a", 0.5),
        10,
        &["joint 2", "the current is cut off"],
    ),
    (
        "compact6",
        "a dead current",
        |sheet| sheet.change(&["i5_a".into()], |_| 0.0),
        10,
        &["current of joint 5"],
    ),
    (
        "compact6",
        "dead angles",
        |sheet| sheet.change(&each("q{j}_deg", 6), |_| 12.0),
        10,
        &["hardly moves"],
    ),
];

#[test]
fn spoiled_recordings_are_refused_with_a_code_and_a_sentence() {
    let mut wrong = Vec::new();
    for (robot, what, change, code, words) in SPOILED {
        let folder = tempfile::tempdir().unwrap();
        let (found, said) = told_of(robot, change, folder.path());
        println!(
            "{what}: code {found}: {}",
            said.lines().next().unwrap_or_default()
        );
        if found != code || words.iter().any(|word| !said.contains(word)) {
            wrong.push(format!(
                "{what}: code {found}, wanted {code} and {words:?}: {said}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_clock_in_milliseconds_that_is_called_seconds_is_refused() {
    refused(
        |sheet| sheet.change(&["time_s".into()], |time| 1e3 * time),
        &["time", "Hz"],
    );
}
