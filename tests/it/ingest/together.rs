//! Duplicates, joins, shapes of files, and long files.

use super::{HEAD, TWO, good, refusal, robot, rows, rr, settings, take};
use crate::answer::{has, starts_with};
use crate::desk::{Desk, table};
use calib::stage::ingest::IngestReads;
use calib::table::{Recording, Rejected};

/// `FILE:LINE REASON: DETAIL` of each.
fn refused(rejected: &Rejected) -> Vec<String> {
    let rows = rejected.0.iter();
    rows.map(|row| format!("{}:{} {}: {}", row.file, row.line, row.reason, row.detail))
        .collect()
}

#[test]
fn joints_beyond_the_limits_are_counted_rejected_or_ignored() {
    let text = format!("{}B,190,20,1,2,3\n", good(3));
    let desk = rows(&text);
    assert_eq!(take(&desk, TWO, rr()).unwrap().recording.rows(), 4);
    let warning = "a.csv: 1 row with a joint beyond the robot's limits, used all the same; first line 5, joint 1 (`J1`) at \
                   190.0000 deg, above its upper limit of 180.0000 deg";
    assert_eq!(desk.warnings.lock().unwrap().as_slice(), [warning]);
    let rejecting = take(&rows(&text), &format!("{TWO}limits: reject\n"), rr()).unwrap();
    let detail = "joint 1 at 190.0000 deg; allowed: -180.0000 to 180.0000 deg";
    assert_eq!(
        refused(&rejecting.rejected),
        [format!("a.csv:5 out_of_range: {detail}")]
    );
    let desk = rows(&text);
    assert_eq!(
        take(&desk, &format!("{TWO}limits: ignore\n"), rr())
            .unwrap()
            .recording
            .rows(),
        4
    );
    assert!(desk.warnings.lock().unwrap().is_empty());
}

#[test]
fn a_prismatic_joint_beyond_its_limits_is_told_in_millimetres() {
    let desk = rows(&format!("{}B,4000,20,1,2,3\n", good(3)));
    take(
        &desk,
        &TWO.replace("unit: deg", "unit: deg, linear_unit: mm"),
        robot("pr", 1.0),
    )
    .unwrap();
    let warnings = desk.warnings.lock().unwrap();
    assert!(
        warnings[0]
            .ends_with("joint 1 (`J1`) at 4000.0000 mm, above its upper limit of 3000.0000 mm"),
        "{warnings:?}"
    );
}

#[test]
fn ids_without_a_partner_are_shown_with_an_example_of_each_file() {
    let yaml = by_id();
    let message_of = |ids: [&str; 2]| {
        let points = format!("k,x,y,z\n{},1,1,1\n{},2,2,2\n", ids[0], ids[1]);
        refusal(&pair("k,q1\nP1,1\nP2,2\n", &points), &yaml, robot("r", 2.0))
    };
    let other = message_of(["XP1", "XP2"]);
    let expected = "2 unmatched (no partner in run/b_tracker.csv, e.g. `P1` here and `XP1` there: ids must be the same in both files)";
    has(&other, expected);
    let lower = message_of(["q7", "p2"]);
    let expected =
        "e.g. `P2` here and `p2` there: ids that differ in upper and lower case are different ids";
    has(&lower, expected);
}

#[test]
fn of_duplicated_ids_none_the_first_the_last_or_all_are_used() {
    let text = "A,1,2,3,4,1\nB,1,2,3,4,2\nA,1,2,,4,3\nA,1,2,3,4,4\nC,1,2,3,4,5\nD,1,2,3,4,6\n";
    let blank = "a.csv:4 blank: x is blank".to_string();
    let twin = |line, other| twin(line, 'A', other);
    for (word, sequence, lines) in [
        (
            "reject",
            &[2, 5, 6][..],
            vec![twin(2, 5), blank.clone(), twin(5, 2)],
        ),
        ("first", &[1, 2, 5, 6], vec![blank.clone(), twin(5, 2)]),
        ("last", &[2, 4, 5, 6], vec![twin(2, 5), blank.clone()]),
        ("keep", &[1, 2, 4, 5, 6], vec![blank]),
    ] {
        of_duplicates(text, word, sequence, &lines);
    }
}

fn of_duplicates(text: &str, word: &str, sequence: &[i64], lines: &[String]) {
    let taken = take(&rows(text), &format!("{TWO}duplicates: {word}\n"), rr()).unwrap();
    assert_eq!(taken.recording.sequence, sequence, "{word}");
    assert_eq!(refused(&taken.rejected), lines, "{word}");
}

fn twin(line: i64, id: char, other: i64) -> String {
    format!("a.csv:{line} duplicate_id: point id `{id}` also stands on line {other}")
}

const PAIR: &str = r#"
files:
  - file: run/z_arm.csv
    columns:
      KEY: {column: kLEFT}
      q: {column: "q{j}", unit: rad}
      payload: {value: 5000, unit: kg}
  - file: run/b_tracker.csv
    columns:
      KEY: {column: kRIGHT}
      usage: {column: use, optional: true}
      x: {column: x, unit: m}
      y: {column: y, unit: m}
      z: {column: z, unit: m}
"#;

fn by_id() -> String {
    let pair = PAIR.replace("KEY", "point_id");
    pair.replace("LEFT", "").replace("RIGHT", "") + "join: {by: id}\n"
}

/// The points of the second file named, joined by order.
fn by_order() -> String {
    let pair = PAIR.replace("      KEY: {column: kLEFT}\n", "");
    pair.replace("KEY", "point_id").replace("RIGHT", "") + "join: {by: order}\n"
}

fn pair(arm: &str, tracker: &str) -> Desk {
    Desk::default()
        .with("run/z_arm.csv", arm)
        .with("run/b_tracker.csv", tracker)
}

#[test]
fn rows_join_by_id_in_the_order_of_the_first_file() {
    let desk = pair(
        "k,q1\nC,3\nA,1\nlost,4\nA2,\nB,2\n",
        "k,use,x,y,z\nA,fit,1,1,1\nB,,2,2,2\nC,validate,3,3,3\nA2,fit,4,4,4\nmore,fit,5,5,5\n",
    );
    let yaml = by_id();
    let taken = take(&desk, &yaml, robot("r", 2.0)).unwrap();
    let recording = &taken.recording;
    assert_eq!(
        (recording.point_id.as_slice(), recording.sequence.as_slice()),
        (&["C", "A", "B"].map(String::from)[..], &[1, 2, 5][..])
    );
    assert_eq!(recording.position, [[3.0; 3], [1.0; 3], [2.0; 3]]);
    assert_eq!(
        recording.usage,
        [Some("validate".into()), Some("fit".into()), None]
    );
    assert_eq!(recording.payload.as_deref(), Some(&[5000.0; 3][..]));
    assert_eq!(
        refused(&taken.rejected),
        [
            "b_tracker.csv:5 unmatched: no usable row of z_arm.csv has the point id `A2`",
            "b_tracker.csv:6 unmatched: no usable row of z_arm.csv has the point id `more`",
            "z_arm.csv:4 unmatched: no usable row of b_tracker.csv has the point id `lost`",
            "z_arm.csv:5 blank: q1 is blank"
        ]
    );
}

#[test]
fn a_simulation_joins_as_a_third_file_by_id_by_time_and_by_order() {
    let third = PAIR.to_string()
        + r#"  - file: sim/model.csv
    columns:
      KEY: {column: kTHIRD}
      sim_x: {column: x, unit: m}
      sim_y: {column: y, unit: m}
      sim_z: {column: z, unit: m}
"#;
    let desk =
        |arm: &str, tracker: &str, model: &str| pair(arm, tracker).with("sim/model.csv", model);
    let by = |key: &str, join: &str| {
        let named = third.replace("KEY", key).replace("THIRD", "");
        named.replace("LEFT", "").replace("RIGHT", "") + join
    };
    let arm = "k,q1\nC,3\nA,1\nB,2\nD,1\n";
    let tracker = "k,x,y,z\nA,1,1,1\nB,2,2,2\nC,3,3,3\n";
    let ids = desk(arm, tracker, "k,x,y,z\nC,3,3,4\nA,1,1,2\nD,5,5,5\n");
    let taken = take(&ids, &by("point_id", "join: {by: id}\n"), robot("r", 2.0)).unwrap();
    assert_eq!(taken.recording.position, [[3.0; 3], [1.0; 3]]);
    assert_eq!(
        taken.recording.simulated,
        Some(vec![[3.0, 3.0, 4.0], [1.0, 1.0, 2.0]])
    );
    assert_eq!(
        refused(&taken.rejected),
        [
            "b_tracker.csv:3 unmatched: no usable row of z_arm.csv (joined to all files) has the point id `B`",
            "model.csv:4 unmatched: no usable row of z_arm.csv (joined to all files) has the point id `D`",
            "z_arm.csv:4 unmatched: no usable row of model.csv has the point id `B`",
            "z_arm.csv:5 unmatched: no usable row of b_tracker.csv has the point id `D`"
        ]
    );
    let sound = |row: &calib::table::IntakeRow| row.read == row.accepted + row.rejected;
    assert!(
        taken.intake.0.iter().all(sound) && taken.intake.0.len() == 3,
        "{:?}",
        taken.intake.0
    );
    // The tracker's clock is 1.5 s ahead, the simulation has the controller's.
    let clocks = desk(
        "k,q1\n10,1\n20,2\n",
        "k,x,y,z\n11.5,1,1,1\n21.5,2,2,2\n",
        "k,x,y,z\n20,2,2,3\n10,1,1,2\n",
    );
    let seconds = by(
        "time",
        "join: {by: time, tolerance_s: 0.1, offset_s: 1.5}\n",
    );
    let seconds = ["k"; 3].iter().fold(seconds, |text, _| {
        text.replacen("time: {column: k}", "time: {column: k, unit: s}", 1)
    });
    let taken = take(&clocks, &seconds, robot("r", 2.0)).unwrap();
    assert_eq!(taken.recording.position, [[1.0; 3], [2.0; 3]]);
    assert_eq!(
        taken.recording.simulated,
        Some(vec![[1.0, 1.0, 2.0], [2.0, 2.0, 3.0]])
    );
    let order: String = by("KEY", "join: {by: order}\n")
        .lines()
        .filter(|l| !l.contains("KEY"))
        .map(|l| format!("{l}\n"))
        .collect();
    let rows = desk(
        "k,q1\na,1\nb,\nc,2\n",
        "k,x,y,z\n,1,1,1\n,2,2,2\n,3,3,3\n",
        "k,x,y,z\n,1,1,2\n,2,2,3\n,3,3,4\n",
    );
    let taken = take(&rows, &order, robot("r", 2.0)).unwrap();
    assert_eq!(taken.recording.position, [[1.0; 3], [3.0; 3]]);
    assert_eq!(
        taken.recording.simulated,
        Some(vec![[1.0, 1.0, 2.0], [3.0, 3.0, 4.0]])
    );
}

#[test]
fn rows_join_by_time_within_the_tolerance_and_across_clocks() {
    let desk = pair(
        "k,q1\n10,1\n20,2\n30,3\n40,1\n",
        "k,x,y,z\n31500,3,3,3\n11400,1,1,1\n21600,2,2,2\n46000,4,4,4\n",
    );
    let yaml = PAIR
        .replace("KEY", "time")
        .replace("kLEFT", "k, unit: s")
        .replace("kRIGHT", "k, unit: ms");
    let yaml = yaml + "join: {by: time, tolerance_s: 0.2, offset_s: 1.5}\n";
    let taken = take(&desk, &yaml, robot("r", 2.0)).unwrap();
    assert_eq!(taken.recording.position, [[1.0; 3], [2.0; 3], [3.0; 3]]);
    assert_eq!(
        taken.recording.time.as_deref(),
        Some(&[10.0, 20.0, 30.0][..])
    );
    assert_eq!(
        refused(&taken.rejected),
        [
            "b_tracker.csv:5 unmatched: z_arm.csv has no row within 0.2 s of 46 s",
            "z_arm.csv:5 unmatched: b_tracker.csv has no row within 0.2 s of 40 s"
        ]
    );
}

#[test]
fn rows_join_by_order_and_a_bad_row_takes_its_partner_along() {
    let points = "k,x,y,z\nA,1,1,1\nB,2,2,2\nC,3,3,3\nD,4,4,4\n,,,\n";
    let desk = pair("q1\n1\nbad\n3\n4\n", points);
    let taken = take(&desk, &by_order(), robot("r", 2.0)).unwrap();
    assert_eq!(taken.recording.point_id, ["A", "C", "D"]);
    assert_eq!(taken.recording.position, [[1.0; 3], [3.0; 3], [4.0; 3]]);
    assert_eq!(
        refused(&taken.rejected),
        [
            "b_tracker.csv:3 unmatched: data row 2 of z_arm.csv is missing or rejected",
            "b_tracker.csv:6 blank: the whole row is blank",
            "z_arm.csv:3 not_a_number: q1: `bad` is not a number"
        ]
    );
}

#[test]
fn files_of_unequal_length_are_not_joined_by_order() {
    let desk = pair("q1\n1\n2\n3\n4\n", "k,x,y,z\nA,1,1,1\nB,2,2,2\nC,3,3,3\n");
    let message = refusal(&desk, &by_order(), robot("r", 2.0));
    let expected = "run/b_tracker.csv: 3 data rows, run/z_arm.csv has 4: rows cannot be joined by order; allowed: as many rows in each \
                    file, or `join: {by: id}` or `{by: time, tolerance_s: ...}`";
    assert_eq!(message, expected);
}

#[test]
fn of_rows_that_are_copies_of_each_other_one_is_used() {
    let text = "A,1,2,3,4,1\nB,1,2,3,4,2\nA,1.0, 2,3,4,1\nC,1,2,3,4,5\nC,1,2,3,4,6\nC,1,2,3,4,5\nD,1,2,3,4,5\nE,1,2,3,4,5\nF,1,2,3,4,5\n";
    let copy = |line: i64, other: i64| {
        format!("a.csv:{line} duplicate_row: a copy of line {other}: the same id, the same values")
    };
    let twin = |line, other| twin(line, 'C', other);
    let all = vec![copy(4, 2), twin(5, 7), twin(6, 5), twin(7, 5)];
    for (word, sequence, lines) in [
        ("reject", &[1, 2, 7, 8, 9][..], all),
        (
            "first",
            &[1, 2, 4, 7, 8, 9],
            vec![copy(4, 2), twin(6, 5), copy(7, 5)],
        ),
        ("keep", &[1, 2, 3, 4, 5, 6, 7, 8, 9], vec![]),
    ] {
        of_duplicates(text, word, sequence, &lines);
    }
}

#[test]
fn a_cut_file_is_blamed_for_the_partners_that_it_lacks() {
    let arm: String = (0..5).map(|k| format!("P{k},{}\n", k % 3)).collect();
    let points: String = (0..20).map(|k| format!("P{k},1,{k},1\n")).collect();
    let yaml = by_id();
    let desk = pair(&format!("k,q1\n{arm}"), &format!("k,x,y,z\n{points}"));
    let message = refusal(&desk, &yaml, robot("r", 2.0));
    let expected = "run/z_arm.csv: has partners for 5 of the 20 rows of run/b_tracker.csv, 15 of which are rejected; allowed: up to 50 % \
                    (`max_rejected_fraction`); reasons: 15 unmatched (no partner in run/z_arm.csv)";
    assert_eq!(message, expected);
}

#[test]
fn ids_of_files_that_continue_each_other_count_within_their_file() {
    let part = TWO.replace("files:\n", "");
    let yaml = format!(
        "files:{}{}join: {{by: append}}\nmax_rejected_fraction: 0.9\n",
        part,
        part.replace("a.csv", "b/a.csv")
    );
    let desk = Desk::default()
        .with("a.csv", format!("{HEAD}{}", good(3)))
        .with(
            "b/a.csv",
            format!(
                "{HEAD}N,1,2,3,4,5\ng2,1,2,3,4,5\n{}M,1,2,3,4,5\nM,1,2,3,4,6\n",
                good(1)
            ),
        );
    let taken = take(&desk, &yaml, rr()).unwrap();
    assert_eq!(taken.recording.sequence, [1, 2, 3, 4, 5]);
    assert_eq!(taken.recording.point_id, ["g1", "g2", "g3", "N", "g2"]);
    assert_eq!(
        refused(&taken.rejected),
        [
            "a.csv (2):4 duplicate_row: a copy of line 2 of a.csv: the same id, the same values",
            "a.csv (2):5 duplicate_id: point id `M` also stands on line 6",
            "a.csv (2):6 duplicate_id: point id `M` also stands on line 5"
        ]
    );
}

#[test]
fn junk_units_comments_and_columns_by_number_are_as_the_settings_say() {
    let text = "\u{feff}Report of today;;\r\n\r\nno\tx\ty\tz\tq\ttemp\r\n-\tin\tum\tm\tmm\tK\r\n! a remark\r\n7\t1\t2000\t3\t1500\t300.15\r\n9\t1\t2\t3\t20\t\r\n8\t1\t2\t3\t20\t\r\n";
    let yaml = r#"
files:
  - file: a.txt
    delimiter: tab
    skip: 1
    skip_below_header: 1
    comment: "!"
    columns:
      sequence: {column: no}
      x: {column: 2, unit: in}
      y: {column: y, unit: um}
      z: {column: z, unit: m}
      q: {columns: [5], linear_unit: mm}
      temperature: {column: temp, unit: K, optional: true}
"#;
    let taken = take(&Desk::default().with("a.txt", text), yaml, robot("p", 1.0)).unwrap();
    let recording = &taken.recording;
    assert_eq!(
        (
            recording.sequence.as_slice(),
            recording.point_id[0].as_str()
        ),
        (&[7, 9][..], "row 1")
    );
    assert_eq!(
        (recording.position[0], recording.q(0)),
        ([0.0254, 0.002, 3.0], &[1.5][..])
    );
    let temperature = recording.temperature.as_ref().unwrap();
    assert!((temperature[0] - 27.0).abs() < 1e-12 && temperature[1].is_nan());
    assert_eq!(
        refused(&taken.rejected),
        ["a.txt:8 out_of_order: sequence 8 does not follow 9"]
    );
}

#[test]
fn a_file_without_header_is_read_by_numbers() {
    let yaml = TWO
        .replace(
            "columns:\n",
            "header: false\n    delimiter: whitespace\n    columns:\n",
        )
        .replace("column: id", "column: 1");
    let yaml = yaml.replace("column: \"q{j}\"", "columns: [2, 3]");
    let yaml = yaml
        .replace("column: x", "column: 4")
        .replace("column: y", "column: 5")
        .replace("column: z", "column: 6");
    let taken = take(
        &Desk::default().with("a.csv", "  \"P 1\" 1 2  3 4 5\nP2 1 2 3\t4 5\n"),
        &yaml,
        rr(),
    )
    .unwrap();
    assert_eq!(taken.recording.point_id, ["P 1", "P2"]);
}

#[test]
fn a_parquet_file_gives_what_its_text_gives() {
    use arrow::array::{ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
    use std::sync::Arc;
    let column = |values: Vec<Option<f64>>| Arc::new(Float64Array::from(values)) as ArrayRef;
    let batch = RecordBatch::try_from_iter([
        (
            "id",
            Arc::new(StringArray::from(vec!["A, 1", "B", "C"])) as ArrayRef,
        ),
        ("q1", Arc::new(Int64Array::from(vec![1, 2, 3])) as ArrayRef),
        ("q2", column(vec![Some(0.1 + 0.2), Some(-1e-7), Some(12.0)])),
        (
            "x",
            column(vec![Some(1_234.567_890_123_456_7), None, Some(f64::NAN)]),
        ),
        ("y", column(vec![Some(2.0); 3])),
        ("z", column(vec![Some(3.0); 3])),
    ])
    .unwrap();
    let mut file = Vec::new();
    let mut writer = parquet::arrow::ArrowWriter::try_new(&mut file, batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    let yaml = TWO.to_string() + "max_rejected_fraction: 0.9\n";
    let binary = take(&Desk::default().with("a.csv", file.clone()), &yaml, rr()).unwrap();
    let text =
        "\"A, 1\",1,0.30000000000000004,1234.5678901234567,2,3\nB,2,-1e-7,,2,3\nC,3,12,NaN,2,3\n";
    let text = take(&rows(text), &yaml, rr()).unwrap();
    assert_eq!(binary.recording, text.recording);
    assert_eq!(
        refused(&binary.rejected),
        [
            "a.csv:2 blank: x is blank",
            "a.csv:3 not_a_number: x: `NaN` is not a finite number"
        ]
    );
    assert_eq!(binary.rejected.0[0].text, "B,2,-1e-7,,2.0,3.0");
    let mapped = yaml.replace("column: z", "column: depth");
    let message = super::refusal(&Desk::default().with("a.csv", file), &mapped, rr());
    assert_eq!(
        message,
        "a.csv: no column `depth`, mapped to `z`; found: id, q1, q2, x, y, z"
    );
    let message = super::refusal(
        &Desk::default().with("a.csv", "PAR1 and nothing else"),
        TWO,
        rr(),
    );
    starts_with(&message, "a.csv: is a Parquet file that cannot be read: ");
}

#[test]
fn what_the_schema_refuses_is_refused_row_by_row() {
    let schema: serde_json::Value =
        serde_json::from_str(include_str!("../../../schemas/recording.json")).unwrap();
    let fields = [
        ("x_mm", "x"),
        ("y_mm", "y"),
        ("z_mm", "z"),
        ("sigma_x_mm", "sx"),
        ("sigma_y_mm", "sy"),
        ("sigma_z_mm", "sz"),
        ("payload_kg", "load"),
        ("temp_c", "temp"),
        ("q{j}_rad", "q1"),
        ("q{j}_mm", "q2"),
        ("i{j}_a", "i1"),
        ("dir{j}", "d1"),
    ];
    let names: Vec<&str> = fields
        .iter()
        .map(|field| field.1)
        .chain(["i2", "d2"])
        .collect();
    let mut text = format!("{}\n", names.join(","));
    let mut wanted = Vec::new();
    for (index, (column, name)) in fields.iter().enumerate() {
        let field = schema["fields"]
            .as_array()
            .unwrap()
            .iter()
            .find(|field| field["name"] == *column)
            .unwrap();
        for (limit, beyond) in [("min", -1.0), ("max", 1.0)] {
            let limit = field["constraints"][limit]
                .as_f64()
                .unwrap_or_else(|| panic!("{column} has a {limit}"));
            for value in [limit, limit + beyond] {
                let mut cells = vec!["1".to_string(); names.len()];
                cells[index] = format!("{value}");
                text += &format!("{}\n", cells.join(","));
            }
            wanted.push(format!("{name}: `{}`", limit + beyond));
        }
    }
    let yaml = r#"
limits: ignore
files:
  - file: a.csv
    columns:
      x: {column: x, unit: mm}
      y: {column: y, unit: mm}
      z: {column: z, unit: mm}
      sigma_x: {column: sx, unit: mm}
      sigma_y: {column: sy, unit: mm}
      sigma_z: {column: sz, unit: mm}
      payload: {column: load, unit: kg}
      temperature: {column: temp, unit: C}
      q: {columns: [q1, q2], unit: rad, linear_unit: mm}
      current: {column: "i{j}", unit: A}
      direction: {column: "d{j}"}
"#;
    let taken = take(&Desk::default().with("a.csv", text), yaml, robot("rp", 1.0)).unwrap();
    let found: Vec<&str> = taken
        .rejected
        .0
        .iter()
        .map(|row| row.detail.split(';').next().unwrap())
        .collect();
    assert_eq!(found, wanted);
    assert!(
        taken
            .rejected
            .0
            .iter()
            .all(|row| row.reason == "out_of_range")
    );
}

#[test]
fn a_long_file_streams_in_chunks_and_equal_content_gives_equal_tables() {
    let count = 300_000u64;
    let mut text = String::from(HEAD);
    for row in 0..count {
        let id = if row % 1000 == 999 { row - 1 } else { row };
        text += &format!(
            "P{id},{},{},{}.25,-20.5,{}\n",
            row % 170,
            row % 90,
            row % 3000,
            1 + row % 7
        );
    }
    let run = |folder: &str| {
        let desk = Desk::default().with(&format!("{folder}/a.csv"), text.clone());
        desk.run(
            &settings(&TWO.replace("a.csv", &format!("{folder}/a.csv"))),
            IngestReads { robot: rr() },
        )
        .unwrap()
    };
    let tables = run("here");
    assert_eq!(tables, run("there"));
    let chunks = table::<Recording>(&tables);
    let rejected: usize = table::<Rejected>(&tables)
        .iter()
        .map(|chunk| chunk.0.len())
        .sum();
    assert_eq!(rejected, 600);
    assert_eq!(chunks.iter().map(Recording::rows).sum::<usize>(), 299_400);
    assert!(chunks.iter().all(|chunk| chunk.rows() <= 65_536) && chunks.len() == 5);
    assert!(
        chunks
            .windows(2)
            .all(|pair| pair[0].sequence.last() < pair[1].sequence.first())
    );
}
