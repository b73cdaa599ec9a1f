//! Bad recordings of torques: each has a clear answer with file, line or place, and is not diagnosed.

use super::{diagnose, nothing, write};
use crate::answer::{calib, put, read, root};
use calib::twin::torque::TorqueCase;
use serde_json::Value;

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
    /// The numbers of a column of each joint, or of one.
    fn change(&mut self, pattern: &str, changed: impl Fn(f64) -> f64) {
        for column in self.columns(pattern) {
            for row in 0..self.rows.len() {
                self.rows[row][column] = format!("{:.6}", changed(self.number(row, column)));
            }
        }
    }
    fn columns(&self, pattern: &str) -> Vec<usize> {
        let names = (0..10).map(|joint| pattern.replace("{j}", &joint.to_string()));
        let is_one = |name: &String| names.clone().any(|one| one == *name);
        let columns = self.header.iter().enumerate();
        columns
            .filter(|(_, name)| is_one(name))
            .map(|(column, _)| column)
            .collect()
    }
    fn exchange(&mut self, one: &str, other: &str) {
        let (one, other) = (self.column(one), self.column(other));
        self.rows.iter_mut().for_each(|row| row.swap(one, other));
    }
    fn without(&mut self, pattern: &str) {
        for column in self.columns(pattern).into_iter().rev() {
            self.header.remove(column);
            self.rows
                .iter_mut()
                .for_each(|row| drop(row.remove(column)));
        }
    }
    /// The clock from line 122 on is later.
    fn later(&mut self, seconds: f64) {
        let column = self.column("time_s");
        for row in 120..self.rows.len() {
            self.rows[row][column] = format!("{:.3}", self.number(row, column) + seconds);
        }
    }
    fn cut(&mut self, name: &str, share: f64) {
        let column = self.column(name);
        let sizes = (0..self.rows.len()).map(|row| self.number(row, column).abs());
        let most = share * sizes.fold(0.0, f64::max);
        self.change(name, |value| value.clamp(-most, most));
    }
    fn lose(&mut self, every: usize) {
        let column = self.column("q2_deg");
        let rows = self.rows.iter_mut().step_by(every);
        rows.for_each(|row| row[column] = "lost".into());
    }
    /// Every joint moves by a thousandth of what it did.
    fn calm(&mut self) {
        for column in self.columns("q{j}_deg") {
            let (name, first) = (self.header[column].clone(), self.number(0, column));
            self.change(&name, |q| first + 1e-3 * (q - first));
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

/// What calib says of a changed recording; the exit code too.
fn message_of(robot: &str, change: impl FnOnce(&mut Sheet)) -> (i32, String) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (case, mut sheet) = case(robot);
    change(&mut sheet);
    write(
        folder,
        &[case.recording()[0].clone(), ("recording.csv", sheet.text())],
    );
    let output = diagnose(folder, &folder.join("store"), "");
    (output.code.unwrap(), output.err)
}

/// Whose recording, how it is spoiled, and what the answer says.
type Spoiled = (&'static str, fn(&mut Sheet), &'static str);

const SPOILED: [Spoiled; 22] = [
    // Units.
    (
        "seven7r",
        |s| s.change("tau{j}_nm", |x| 1e3 * x),
        "torque|a unit|1,000",
    ),
    (
        "seven7r",
        |s| s.change("tau{j}_nm", |x| 1e-3 * x),
        "torque|a unit|1,000",
    ),
    (
        "compact6",
        |s| s.change("i{j}_a", |x| 1e3 * x),
        "torque|a unit|1,000",
    ),
    (
        "seven7r",
        |s| s.change("tau{j}_nm", |x| x / 12.0),
        "torque|map them as `current`",
    ),
    (
        "compact6",
        |s| s.change("i{j}_a", |x| 12.0 * x),
        "torque|map them as `torque`",
    ),
    (
        "compact6",
        |s| s.change("q{j}_deg", f64::to_radians),
        "joint|radians",
    ),
    (
        "compact6",
        |s| s.change("q{j}_deg", f64::to_degrees),
        "q2_deg|allowed: -1145.9",
    ),
    (
        "compact6",
        |s| s.change("time_s", |time| 1e3 * time),
        "time|Hz",
    ),
    // Columns that are others'.
    (
        "compact6",
        |s| s.exchange("i2_a", "i3_a"),
        "joint 2 and joint 3 look exchanged",
    ),
    (
        "compact6",
        |s| s.exchange("q2_deg", "q3_deg"),
        "the angles of joint 2 and joint 3 look exchanged",
    ),
    (
        "compact6",
        |s| {
            s.exchange("q2_deg", "q3_deg");
            s.exchange("i2_a", "i3_a");
        },
        "joint 2 and joint 3 look exchanged",
    ),
    (
        "compact6",
        |s| s.change("i2_a", |x| -x),
        "joint 2|the other sign",
    ),
    // Clocks.
    (
        "compact6",
        |s| s.later(5.0),
        "recording.csv:122|the clock jumps by 5.0",
    ),
    (
        "compact6",
        |s| s.later(-1.0),
        "recording.csv:122|the clock goes back",
    ),
    // What shows nothing.
    (
        "compact6",
        |s| s.cut("i2_a", 0.5),
        "joint 2|the current is cut off",
    ),
    (
        "compact6",
        |s| s.change("i3_a", |_| 0.25),
        "current of joint 3|0.25 in each of",
    ),
    (
        "compact6",
        |s| s.change("q{j}_deg", |_| 12.0),
        "hardly moves",
    ),
    ("compact6", Sheet::calm, "hardly moves"),
    (
        "compact6",
        |s| s.lose(10),
        "recording.csv:2|rows are rejected|`lost` is not a number",
    ),
    // What is not there.
    (
        "compact6",
        |s| s.without("i{j}_a"),
        "recording.csv|neither torques nor motor currents",
    ),
    ("compact6", |s| s.without("q3_deg"), "recording.csv|q3_deg"),
    ("compact6", |s| s.without("time_s"), "recording.csv|time_s"),
];

#[test]
fn spoiled_recordings_are_refused_with_a_code_and_a_sentence() {
    let mut wrong = Vec::new();
    for (robot, change, words) in SPOILED {
        let (code, printed) = message_of(robot, change);
        if code != 10 || !words.split('|').all(|word| printed.contains(word)) {
            wrong.push(format!("code {code}, wanted {words}: {printed}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_few_rows_that_cannot_be_read_are_left_out() {
    let (code, printed) = message_of("compact6", |s| s.lose(400));
    assert_eq!(code, 0, "{printed}");
}

#[test]
fn a_row_that_is_missing_at_a_low_rate_is_bridged_and_no_row_is_told_twice() {
    // At 25 Hz every row of the clock is judged, one that is made up too.
    let holed = |sheet: &mut Sheet| {
        let mut number = 0..;
        sheet.rows.retain(|_| {
            number
                .next()
                .is_some_and(|number: usize| number.is_multiple_of(2) && number != 196)
        });
    };
    let (code, printed) = message_of("compact6", holed);
    assert_eq!(code, 0, "{printed}");
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
    let text = read(root("pipelines/dynamics/pipeline.yaml"));
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
    calib(folder.path(), "run p.yaml --until ingest_torques --quiet").ok();
}

/// What is found in a recording, and what is said of it.
fn answered(robot: &str, change: impl FnOnce(&mut Sheet), more: &str) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (case, mut sheet) = case(robot);
    change(&mut sheet);
    write(
        folder,
        &[case.recording()[0].clone(), ("recording.csv", sheet.text())],
    );
    let (text, store) = (
        read(root("pipelines/dynamics/pipeline.yaml")),
        folder.join("store"),
    );
    put(
        folder,
        "pipeline.yaml",
        text.replace("- uses: diagnose_torques", more),
    );
    let answer = calib(
        ".",
        &format!(
            "diagnose --json --set case={} --store {} {}",
            folder.display(),
            store.display(),
            folder.join("pipeline.yaml").display()
        ),
    );
    assert_eq!(answer.code, Some(0), "{}", answer.err);
    (serde_json::from_str(&answer.out).unwrap(), answer.err)
}

#[test]
fn joints_that_are_logged_within_one_turn_are_read_as_going_on_and_that_is_said() {
    let usual = "- uses: diagnose_torques";
    // Joint 2 passes 0: it is logged as 359 deg and 1 deg.
    let wrapped = |sheet: &mut Sheet| {
        let (name, middle) = ("q2_deg", sheet.number(0, sheet.column("q2_deg")));
        sheet.change(name, |q| q - middle);
        sheet.change(name, |q| q.rem_euclid(360.0));
        sheet.change(name, |q| q + middle);
    };
    let [(straight, _), (read, said)] = [
        answered("compact6", |_| (), usual),
        answered("compact6", wrapped, usual),
    ];
    assert!(
        said.contains("joint 2") && said.contains("logged within one turn"),
        "{said}"
    );
    assert_eq!(read["findings"], straight["findings"], "{read}");
}
