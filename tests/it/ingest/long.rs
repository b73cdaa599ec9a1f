//! Long files: whatever is odd in them, each row is what it is in a short file.

use super::{TWO, rr, take};
use crate::answer::has;
use crate::desk::Desk;

const ROWS: usize = 20_000;

/// What every so many rows of a file is odd, and why it is refused, if it is.
const ODD: [(&str, Option<&str>); 9] = [
    ("\"P\r\n{n}\";1,5;-2,5;{n},25;200;3", None),
    (
        "\"P;{n} \"\"left\"\"\";1,5;-2,5;{n},25;200;3\r\n\r\n# \"no row",
        None,
    ),
    ("5\" pipe {n};1,5;-2,5;{n},25;200;3", None),
    ("P{n};1,5;abc;{n},25;200;3", Some("not_a_number")),
    ("\"P\r\n{n}\";1,5;-2,5;;200;3", Some("blank")),
    (";;;;;", Some("blank")),
    ("P{n};1,5;-2,5", Some("short_row")),
    ("P\0{n};1,5;\0;{n},25;200;3", Some("not_a_number")),
    ("P{n};1,5;-2,5;0;0;0", Some("lost_beam")),
];

/// Its line, its id and why it is refused.
type Row = (i64, String, Option<&'static str>);

/// The text of a file, and its rows.
fn text() -> (String, Vec<Row>) {
    let (mut text, mut rows) = ("\u{feff}id;q1;q2;x;y;z\r\n".to_string(), Vec::new());
    for n in 1..=ROWS {
        let line = text.matches('\n').count() as i64 + 1;
        let (pattern, reason) = match n % 37 {
            0 => ODD[n / 37 % ODD.len()],
            _ => ("P{n};1,5;-2,5;{n},25;200;3", None),
        };
        let row = pattern.replace("{n}", &n.to_string());
        let id = row.split(';').next().unwrap_or_default().to_string();
        let id = match pattern {
            p if p.starts_with("\"P\r\n") => format!("P\n{n}"),
            p if p.starts_with("\"P;") => format!("P;{n} \"left\""),
            _ => id,
        };
        text.push_str(&row);
        text.push_str(if n < ROWS { "\r\n" } else { "" });
        rows.push((line, id, reason));
    }
    (text, rows)
}

#[test]
fn oddities_at_any_place_of_a_long_file_are_those_of_a_short_one() {
    let (text, rows) = text();
    let yaml = TWO.replace(
        "  - file: a.csv\n",
        "  - file: a.csv\n    delimiter: \";\"\n    decimal: comma\n    comment: \"#\"\n",
    );
    let taken = take(&Desk::default().with("a.csv", text.as_str()), &yaml, rr()).unwrap();
    let recording = &taken.recording;
    let used = (1..).zip(&rows).filter(|(_, row)| row.2.is_none());
    let used: Vec<(i64, &str)> = used.map(|(number, row)| (number, row.1.as_str())).collect();
    let ids = recording.point_id.iter().map(String::as_str);
    let found: Vec<(i64, &str)> = recording.sequence.iter().copied().zip(ids).collect();
    assert!(
        found == used,
        "{:?}",
        found.iter().zip(&used).find(|(found, used)| found != used)
    );
    for (sequence, point) in recording.sequence.iter().zip(&recording.position) {
        let x = (*sequence as f64 + 0.25) * 1e-3;
        assert_eq!(*point, [x, 200.0 * 1e-3, 3.0 * 1e-3]);
    }
    let refused: Vec<(i64, &str)> = rows
        .iter()
        .filter_map(|row| Some((row.0, row.2?)))
        .collect();
    let rejected = &taken.rejected.0;
    let found: Vec<(i64, &str)> = rejected
        .iter()
        .map(|row| (row.line, row.reason.as_str()))
        .collect();
    assert!(
        found == refused,
        "{:?}",
        found.iter().zip(&refused).find(|(a, b)| a != b)
    );
    let short = rejected.iter().find(|row| row.reason == "short_row");
    assert_eq!(short.unwrap().text, "P222;1,5;-2,5");
    let lines = text.matches('\n').count() as i64 + 1;
    assert_eq!(taken.intake.0[0].lines, lines);

    let open = format!("{text}\r\n\"never closed;1;2;3;4;5\r\nP;1;2;3;4;5\r\n");
    let refused = take(&Desk::default().with("a.csv", open), &yaml, rr()).err();
    let place = format!("a.csv:{}", lines + 1);
    has(
        &refused.unwrap().to_string(),
        [&*place, "a quoted field is not closed"],
    );
}
