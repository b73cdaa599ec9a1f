//! Files and settings that are refused as a whole: the message names the place and what is allowed.

use super::{HEAD, TWO, faults_of, good, refusal, robot, rows, rr, take};
use crate::answer::{ends_with, has, starts_with};
use crate::desk::Desk;

fn with(file: &str, yaml: &str) -> String {
    refusal(&Desk::default().with("a.csv", file), yaml, rr())
}

#[test]
fn a_missing_column_is_named_with_those_that_are_there() {
    let desk = Desk::default().with("a.csv", "id,q1,q2,x,y_m,depth\nP,1,2,3,4,5\n");
    let yaml = TWO
        .replace("column: y,", "column: y_mm,")
        .replace("column: z,", "column: height,");
    let expected = "a.csv:1: no column `y_mm`, mapped to `y`; did you mean `y_m`?\n\
                    a.csv:1: no column `height`, mapped to `z`; found: id, q1, q2, x, y_m, depth";
    assert_eq!(refusal(&desk, &yaml, rr()), expected);
}

#[test]
fn text_behind_a_closing_quote_refuses_its_row() {
    let text = "id,q1,q2,x,y,z\nA,1,2,3,4,5\nB,\"1\"0,2,3,4,5\nC,\"1\",2,3,4,5\n\"D\"x,1,2,3,4,5\n";
    let yaml = format!("{TWO}max_rejected_fraction: 0.9\n");
    let taken = take(&Desk::default().with("a.csv", text), &yaml, rr()).unwrap();
    assert_eq!(taken.recording.point_id, ["A", "C"]);
    let refused = taken
        .rejected
        .0
        .iter()
        .map(|row| (row.line, row.reason.as_str()));
    assert_eq!(
        refused.collect::<Vec<_>>(),
        [(3, "damaged"), (5, "damaged")]
    );
    let detail = &taken.rejected.0[0].detail;
    starts_with(
        detail,
        "column 2: text behind the closing `\"` of a field; allowed:",
    );
    let desk = Desk::default().with("a.csv", format!("\"id\"x,q1,q2,x,y,z\n{}", good(3)));
    let header = take(&desk, TWO, rr()).err().unwrap().to_string();
    starts_with(&header, "a.csv:1: column 1: text behind");
}

#[test]
fn a_file_that_is_none_says_what_it_is() {
    let open = format!("{HEAD}P1,1,2,3,4,5\n\"P2,1,2,3,4,5\nP3,1,2,3,4,5\n");
    let endless = format!("{HEAD}P1,1,2,3,4,{}", "5".repeat(1 << 21));
    for (file, expected) in [
        (
            "",
            "a.csv: is empty; allowed: a header and at least one data row",
        ),
        (
            HEAD,
            "a.csv: has a header but no data row; allowed: at least one",
        ),
        (
            "\n\n",
            "a.csv: has no header: 2 lines, all empty, comments or skipped",
        ),
        (&open, "a.csv:3: a quoted field is not closed"),
        (
            &endless,
            "a.csv:2: a row of more than 1 MiB; allowed: rows ending in LF or CRLF, every quote closed",
        ),
    ] {
        assert_eq!(with(file, TWO), expected);
    }
}

#[test]
fn a_file_whose_lines_end_in_cr_alone_says_how_to_convert_it() {
    let expected = "a.csv: the lines end in CR alone; allowed: LF or CRLF. Save it again with such line ends, or convert it: \
                    `tr '\\r' '\\n' < a.csv > converted.csv`";
    assert_eq!(
        with(
            &format!("{HEAD}P1,1,2,3,4,5\nP2,1,2,3,4,6\n").replace('\n', "\r"),
            TWO
        ),
        expected
    );
    // A CRLF that was cut is none.
    assert_eq!(
        with("id,q1,q2,x,y,z\r", TWO),
        "a.csv: has a header but no data row; allowed: at least one"
    );
}

#[test]
fn a_column_of_two_measured_quantities_or_joints_is_a_fault() {
    let target = TWO
        .replace("column: x", "column: xt, minus: xd")
        .replace("column: y", "column: yt, minus: xd");
    for (yaml, place, found) in [
        (
            TWO.replace("column: y", "column: \" x\""),
            "y.column",
            "column ` x` is mapped to `x` and `y`",
        ),
        (
            TWO.replace("column: \"q{j}\"", "columns: [q1, q1]"),
            "q.columns[1]",
            "column `q1` is mapped to joint 1 of `q` and joint 2 of `q`",
        ),
        (
            target.clone(),
            "y.minus",
            "column `xd` is mapped to `x` and `y`",
        ),
    ] {
        let expected = format!("files[0].columns.{place}: {found}; allowed: a column for each");
        assert_eq!(faults_of(&yaml), [expected]);
    }
    // A target is also the simulated point; one uncertainty is that of all axes.
    let more = "      sim_x: {column: xt, unit: mm}\n      sim_y: {column: yt, unit: mm}\n      sim_z: {column: zt, unit: mm}\n      \
                sigma_x: {column: s, unit: mm}\n      sigma_y: {column: s, unit: mm}\n      sigma_z: {column: s, unit: mm}\n";
    let target = target.replace("column: yt, minus: xd", "column: yt, minus: yd");
    assert_eq!(faults_of(&format!("{target}{more}")), Vec::<String>::new());
}

#[test]
fn a_header_of_another_shape_gets_a_hint() {
    let semicolons = with("id;q1;q2;x;y;z\n", TWO);
    ends_with(
        &semicolons,
        "found: id;q1;q2;x;y;z (one column; `delimiter: \";\"`?)",
    );
    assert!(with("1,2,3,4,5,6\n", TWO).ends_with("(all numbers; `header: false`?)"));
    let twice = with("id,q1,q2,x,y,z,x\n", TWO);
    starts_with(
        &twice,
        "a.csv:1: column `x`, mapped to `x`, stands twice in the header (4 and 7); name it by number",
    );
}

#[test]
fn another_number_of_joints_is_an_error_of_the_file() {
    let desk = || rows(&good(3));
    let listed = TWO.replace("column: \"q{j}\"", "columns: [q1, q2]");
    for (kinds, yaml, expected) in [
        (
            "rrr",
            TWO,
            "`q` has 2 of its columns; the robot has 3 joints\na.csv:1: no column `q3`",
        ),
        (
            "r",
            TWO,
            "column `q2`, by the pattern of `q`: the robot has 1 joint only",
        ),
        (
            "rrr",
            &listed,
            "`q` lists 2 columns; the robot has 3 joints",
        ),
        ("pr", TWO, "joint 1 is prismatic; say `linear_unit` for `q`"),
    ] {
        let message = refusal(&desk(), yaml, robot(kinds, 1.0));
        starts_with(&message, &format!("a.csv:1: {expected}"));
    }
}

#[test]
fn an_unannounced_decimal_comma_is_an_error_that_says_so() {
    let yaml = TWO.replace(
        "  - file: a.csv\n",
        "  - file: a.csv\n    delimiter: \";\"\n",
    );
    let file = "id;q1;q2;x;y;z\nP1;0,365;1;2;3;4\nP2;1;2,5;2;3;4\n";
    let expected = "a.csv:2: no row is left; allowed: up to 50 % (`max_rejected_fraction`); reasons: 2 not_a_number \
                    (line 2: q1: `0,365` has a decimal comma; allowed: `decimal: comma` in the settings)";
    assert_eq!(with(file, &yaml), expected);
    let announced = yaml.replace("delimiter", "decimal: comma\n    delimiter");
    let points = with("id;q1;q2;x;y;z\nP1;0.365;1;2;3;4\n", &announced);
    has(
        &points,
        "q1: `0.365` has a decimal point; allowed: `decimal: point` in the settings",
    );
}

#[test]
fn degrees_declared_as_rad_are_an_error_that_says_so() {
    let text: String = (1..=10)
        .map(|row| format!("P{row},{},20,1,2,3\n", 15 * row))
        .collect();
    let message = refusal(&rows(&text), &TWO.replace("deg", "rad"), rr());
    let expected = "a.csv:2: `q` is declared in rad, but 10 of 10 rows hold a joint beyond one and a half turns, \
                    here joint 1 at 15.0000 rad; allowed: up to 9.42 rad; if the file holds degrees, say `unit: deg`";
    assert_eq!(message, expected);
    let small: String = (1..=10)
        .map(|row| format!("P{row},0.{row},5,1,2,3\n"))
        .collect();
    let message = refusal(&rows(&small), &TWO.replace("deg", "rad"), rr());
    starts_with(
        &message,
        "a.csv:2: 10 of 10 rows are beyond the robot's joint limits, here joint 2 (`J2`) at 286.4789 deg, above",
    );
    ends_with(&message, "say `unit: deg`");
    let desk = rows(
        &(1..=10)
            .map(|row| format!("P{row},{row}e-1,1.5,1,2,3\n"))
            .collect::<String>(),
    );
    take(&desk, TWO, rr()).unwrap();
    let warning = "a.csv: no joint is ever beyond 1.50 deg; if the file holds rad, say `unit: rad`";
    assert_eq!(desk.warnings.lock().unwrap().as_slice(), [warning]);
}

#[test]
fn too_few_usable_rows_are_an_error_with_the_reasons() {
    let text = format!(
        "{}B1,,2,3,4,5\nB2,,2,3,4,5\nB3,1,2\ng1,1,2,3,4,5\n",
        good(3)
    );
    let expected = "a.csv:5: 5 of 7 rows are rejected; allowed: up to 50 % (`max_rejected_fraction`); reasons: 2 blank (line 5: q1 is blank); \
                    2 duplicate_id (line 2: point ids that occur more than once; \
                    `duplicates: first` or `last` uses one row of each); 1 short_row (line 7: 3 fields; allowed: 6)";
    assert_eq!(refusal(&rows(&text), TWO, rr()), expected);
    take(
        &rows(&text),
        &format!("{TWO}max_rejected_fraction: 0.8\n"),
        rr(),
    )
    .unwrap();
}

#[test]
fn faulty_settings_are_named_all_at_once_with_what_is_allowed() {
    let yaml = r#"
max_rejected_fraction: 2
files:
  - file: a.csv
    delimiter: ab
    header: false
    columns:
      q: {column: qj, unit: degrees}
      x: {column: 0, unit: inch}
      y: {column: 2, unit: deg}
      z: {unit: mm}
      sigma_x: {column: 3}
"#;
    let found = faults_of(yaml);
    assert_eq!(
        found,
        [
            "max_rejected_fraction: allowed: above 0 and up to 1",
            "files[0].delimiter: delimiter `ab`; allowed: one ASCII character, `tab` or `whitespace`",
            "files[0].columns.x: columns count from 1",
            "files[0].columns.x.unit: unknown unit `inch`; allowed: mm, um, m, in",
            "files[0].columns.y.unit: `deg` is the unit of another quantity; allowed: mm, um, m, in",
            "files[0].columns.z: say `column` or `value`, one of them",
            "files[0].columns.sigma_x.unit: no unit; allowed: mm, um, m, in",
            "files[0].columns.q.column: `qj` has neither {j} for the joint's number nor {name}; e.g. `q{j}_deg`, or list them in `columns`",
            "files[0].columns.q.unit: unknown unit `degrees`; allowed: rad, deg, mrad, arcsec",
            "files[0].columns: map all of sigma_x, sigma_y, sigma_z, or none",
        ]
    );
}

#[test]
fn files_that_do_not_fit_together_are_faults_of_the_settings() {
    let file = |columns: &str| format!("  - {{file: a.csv, columns: {{{columns}}}}}\n");
    let (id, time) = ("point_id: {column: id}, ", "time: {column: t, unit: s}, ");
    let q = "q: {column: \"q{j}\", unit: deg}";
    let xyz = "x: {column: x, unit: mm}, y: {column: y, unit: mm}, z: {column: z, unit: mm}";
    let faults = |first: &str, second: &str, tail: &str| {
        let yaml = format!(
            "files:\n{}{}{tail}",
            file(first),
            if second.is_empty() {
                String::new()
            } else {
                file(second)
            }
        );
        faults_of(&yaml)
    };
    let without = "join: several files; say how they belong together: {by: id}, {by: time, tolerance_s: 0.5}, {by: order} or {by: append}";
    let lacks = "files[0].columns: not mapped: x, y, z";
    let no_joints = "files[1].columns: not mapped: q";
    let unnamed = "files[1].columns.point_id: not mapped; the files are joined by point_id";
    let twice = "files[1].columns.time: mapped in two files; map it in one";
    let keep =
        "duplicates: `keep` cannot be combined with a join by id; allowed: reject, first, last";
    let (of_id, of_both) = (
        format!("{id}{q}"),
        [q, xyz].map(|more| format!("{id}{time}{more}")),
    );
    let of_time = [q, xyz].map(|more| format!("{time}{more}"));
    for (first, second, tail, expected) in [
        (q, xyz, "", &[without][..]),
        (q, "", "", &[lacks]),
        (q, xyz, "join: {by: append}", &[lacks, no_joints]),
        (
            q,
            "",
            "join: {by: order}",
            &["join: joins two files or more, not 1"],
        ),
        (&of_id, xyz, "join: {by: id}", &[unnamed]),
        (
            &of_both[0],
            &of_both[1],
            "join: {by: id}\nduplicates: keep",
            &[twice, keep],
        ),
        (
            &of_time[0],
            &of_time[1],
            "join: {by: time, tolerance_s: -1}",
            &["join.tolerance_s: allowed: 0 and above"],
        ),
    ] {
        assert_eq!(faults(first, second, tail), expected);
    }
}

#[test]
fn the_hint_of_a_unit_names_the_setting_and_the_unit_that_fit_the_number() {
    let rail = |unit: &str, at: [&str; 3]| {
        let text: String = at
            .iter()
            .map(|rail| format!("P{rail},{rail},20,1,2,3\n"))
            .collect();
        let settings = format!("unit: deg, linear_unit: {unit}");
        let yaml = TWO.replace("unit: deg", &settings);
        refusal(&rows(&text), &yaml, robot("pr", 1.0))
    };
    has(
        &rail("m", ["288.2", "2206.3", "2945.0"]),
        "; if the file holds millimetres, say `linear_unit: mm`",
    );
    has(
        &rail("mm", ["288200.1", "2206300.2", "2945000.3"]),
        "; if the file holds micrometres, say `linear_unit: um`",
    );
    // Within what any rail has, and beyond this one's.
    let beyond = rail("m", ["28.2", "106.3", "145.0"]);
    has(
        &beyond,
        "; if the file holds millimetres, say `linear_unit: mm`",
    );
    assert!(!beyond.contains("unit: deg"), "{beyond}");
    let far = "P1,1,20,900,900,900\nP2,2,20,800,900,900\n";
    let metres = TWO.replace("unit: mm", "unit: m");
    has(
        &refusal(&rows(far), &metres, rr()),
        "; if the file holds millimetres, say `unit: mm`",
    );
}
