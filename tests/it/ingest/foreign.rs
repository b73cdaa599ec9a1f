//! Files as other programs write them: differences from a target, headers inside comments, texts that are not UTF-8.

use super::{TWO, refusal, rr, settings, take};
use crate::answer::starts_with;
use crate::desk::Desk;
use calib::stage::Stage;

const DIFFERENCES: &str = r#"
files:
  - file: a.csv
    columns:
      q: {column: "q{j}", unit: deg}
      x: {column: xt, minus: xd, unit: mm}
      y: {column: yt, plus: yd, unit: mm}
      z: {column: zt, minus: zd, unit: mm, difference_unit: um}
"#;

#[test]
fn a_point_is_its_target_and_the_difference_from_it() {
    let text = "q1,q2,xt,yt,zt,xd,yd,zd\n1,2,1000,200,300,0.5,0.25,1500\n1,2,1000,200,300,,1,1\n1,2,1000,200,300,ten,1,1\n1,2,1000,200,300,4e5,1,1\n3,4,1,2,3,0,0,0\n5,6,1,2,3,0,0,0\n7,8,1,2,3,0,0,0\n";
    let taken = take(&Desk::default().with("a.csv", text), DIFFERENCES, rr()).unwrap();
    for (found, expected) in taken.recording.position[0]
        .iter()
        .zip([0.9995, 0.20025, 0.2985])
    {
        assert!((found - expected).abs() < 1e-15, "{found} for {expected}");
    }
    let details: Vec<&str> = taken
        .rejected
        .0
        .iter()
        .map(|row| row.detail.as_str())
        .collect();
    assert_eq!(
        details,
        [
            "xd is blank",
            "xd: `ten` is not a number",
            "xt - xd: `1000` - `4e5`; allowed: -200000 to 200000 mm"
        ]
    );
    let missing = Desk::default().with("a.csv", "q1,q2,xt,yt,zt,xdd,yd,zd\n");
    let message = refusal(&missing, DIFFERENCES, rr());
    starts_with(
        &message,
        "a.csv:1: no column `xd`, mapped to `x`; did you mean `xdd`?",
    );
}

#[test]
fn a_difference_goes_with_a_column_of_lengths() {
    let faults = |from: &str, to: &str| {
        let found = settings(&DIFFERENCES.replace(from, to)).check();
        found
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert_eq!(faults("nothing", ""), "");
    let both = faults("minus: xd", "minus: xd, plus: xd");
    assert_eq!(
        both,
        "files[0].columns.x: `minus` and `plus` at once; say one of them"
    );
    let constant = faults("{column: xt, minus: xd", "{value: 1, minus: xd");
    assert_eq!(
        constant,
        "files[0].columns.x: `minus` needs `column`: the target that the difference is taken from"
    );
    let unit = faults("difference_unit: um", "difference_unit: deg");
    assert_eq!(
        unit,
        "files[0].columns.z.difference_unit: `deg` is the unit of another quantity; allowed: mm, um, m, in"
    );
    let alone = faults("{column: zt, minus: zd, unit", "{column: zt, unit");
    assert_eq!(
        alone,
        "files[0].columns.z.difference_unit: there is no `minus` or `plus`"
    );
    let time = faults(
        "      x:",
        "      time: {column: t, minus: u, unit: s}\n      x:",
    );
    assert_eq!(
        time,
        "files[0].columns.time: `minus` and `plus` are for lengths, e.g. x, y, z"
    );
}

#[test]
fn a_header_inside_a_comment_names_the_columns() {
    let yaml = TWO.replace(
        "  - file: a.csv\n",
        "  - file: a.csv\n    delimiter: whitespace\n    comment: \"//\"\n    header_in_comment: true\n    skip: 1\n",
    );
    let text =
        "// made by a program\n// id q1 q2   x y z\nA 1 2 3 4 5\n// a comment\nB 2 3 4 5 6\n";
    let taken = take(&Desk::default().with("a.csv", text), &yaml, rr()).unwrap();
    assert_eq!(taken.recording.point_id, ["A", "B"]);
    assert!(taken.rejected.0.is_empty());
    let bare = Desk::default().with(
        "a.csv",
        "// made by a program\nid q1 q2 x y z\nA 1 2 3 4 5\n",
    );
    let message = refusal(&bare, &yaml, rr());
    assert_eq!(
        message,
        "a.csv:2: the header does not begin with `//`; allowed: so, or `header_in_comment: false`"
    );
    let faults = settings(&yaml.replace("    comment: \"//\"\n", "")).check();
    assert_eq!(
        faults[0].to_string(),
        "files[0].header_in_comment: say how a comment begins, e.g. `comment: \"//\"`"
    );
}

#[test]
fn texts_that_are_not_utf_8_are_windows_1252() {
    let yaml = TWO
        .replace("column: x,", "column: \"x [\u{b5}m]\",")
        .replace("column: id", "column: \"Pr\u{fc}fung\"");
    let mut file = b"Pr\xfcfung,q1,q2,x [\xb5m],y,z\nM\xfcller \x80,1,2,3,4,5\n".to_vec();
    let taken = take(&Desk::default().with("a.csv", file.clone()), &yaml, rr()).unwrap();
    assert_eq!(taken.recording.point_id, ["M\u{fc}ller \u{20ac}"]);
    file.extend(b"no\x81ne,1,2,3,4,5\n");
    let taken = take(&Desk::default().with("a.csv", file), &yaml, rr()).unwrap();
    let rejected = &taken.rejected.0[0];
    assert_eq!(
        (rejected.reason.as_str(), rejected.detail.as_str()),
        (
            "not_text",
            "point_id is neither UTF-8 nor Windows-1252 text"
        )
    );
}
