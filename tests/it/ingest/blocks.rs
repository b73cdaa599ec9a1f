//! Files of many blocks: whatever is odd in them, and on whichever number of threads, each row is what it is in a short file.

use super::{TWO, Taken, rr, take};
use crate::answer::has;
use crate::desk::Desk;
use rayon::ThreadPoolBuilder;

/// Enough for several blocks.
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

fn on(threads: usize, read: impl FnOnce() -> Taken + Send) -> Taken {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
        .install(read)
}

#[test]
fn oddities_at_any_place_of_a_long_file_are_those_of_a_short_one() {
    let (text, rows) = text();
    let yaml = TWO.replace(
        "  - file: a.csv\n",
        "  - file: a.csv\n    delimiter: \";\"\n    decimal: comma\n    comment: \"#\"\n",
    );
    for threads in [1, 2, 3] {
        let desk = Desk::default().with("a.csv", text.as_str());
        let taken = on(threads, || take(&desk, &yaml, rr()).unwrap());
        let used: Vec<(i64, &str)> = (1..)
            .zip(&rows)
            .filter(|(_, row)| row.2.is_none())
            .map(|(number, row)| (number, row.1.as_str()))
            .collect();
        let found: Vec<(i64, &str)> = taken
            .recording
            .sequence
            .iter()
            .copied()
            .zip(taken.recording.point_id.iter().map(String::as_str))
            .collect();
        assert!(
            found == used,
            "{threads}: {:?}",
            found.iter().zip(&used).find(|(found, used)| found != used)
        );
        for (sequence, point) in taken
            .recording
            .sequence
            .iter()
            .zip(&taken.recording.position)
        {
            assert_eq!(
                *point,
                [(*sequence as f64 + 0.25) * 1e-3, 200.0 * 1e-3, 3.0 * 1e-3]
            );
        }
        let refused: Vec<(i64, &str)> = rows
            .iter()
            .filter_map(|row| Some((row.0, row.2?)))
            .collect();
        let found: Vec<(i64, &str)> = taken
            .rejected
            .0
            .iter()
            .map(|row| (row.line, row.reason.as_str()))
            .collect();
        assert!(
            found == refused,
            "{threads}: {:?}",
            found
                .iter()
                .zip(&refused)
                .find(|(found, refused)| found != refused)
        );
        let shown = |reason: &str| {
            taken
                .rejected
                .0
                .iter()
                .find(|row| row.reason == reason)
                .map(|row| row.text.as_str())
        };
        assert_eq!(shown("short_row"), Some("P222;1,5;-2,5"));
        assert_eq!(
            taken.intake.0[0].lines,
            text.matches('\n').count() as i64 + 1
        );
    }
}

#[test]
fn numbers_of_rows_ascend_over_the_borders_of_blocks() {
    let mut text = "id,s,q1,q2,x,y,z\n".to_string();
    let numbers: Vec<usize> = (1..=ROWS)
        .map(|n| if n % 5000 == 0 { n - 2 } else { n })
        .collect();
    numbers
        .iter()
        .for_each(|n| text.push_str(&format!("P{n:<20},{n},1.5,-2.5,{n}.25,200,3\n")));
    let yaml = TWO.replace("      q:", "      sequence: {column: s}\n      q:");
    for threads in [1, 3] {
        let desk = Desk::default().with("a.csv", text.as_str());
        let taken = on(threads, || take(&desk, &yaml, rr()).unwrap());
        let refused: Vec<(i64, &str)> = taken
            .rejected
            .0
            .iter()
            .map(|row| (row.line, row.reason.as_str()))
            .collect();
        let lines = (1..=ROWS as i64 / 5000).map(|k| (5000 * k + 1, "out_of_order"));
        assert_eq!(refused, lines.collect::<Vec<_>>());
        assert_eq!(taken.recording.rows(), ROWS - 4);
    }
}

#[test]
fn what_is_wrong_with_a_late_row_is_an_error_of_its_line() {
    let (text, _) = text();
    let yaml = TWO.replace(
        "  - file: a.csv\n",
        "  - file: a.csv\n    delimiter: \";\"\n    decimal: comma\n    comment: \"#\"\n",
    );
    let lines = text.matches('\n').count() + 2;
    for threads in [1, 2] {
        let desk = Desk::default().with(
            "a.csv",
            format!("{text}\r\n\"never closed;1;2;3;4;5\r\nP;1;2;3;4;5\r\n"),
        );
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let said = pool.install(|| take(&desk, &yaml, rr()).err().unwrap().to_string());
        has(
            &said,
            [&*format!("a.csv:{lines}"), "a quoted field is not closed"],
        );
    }
}
