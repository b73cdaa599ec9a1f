//! Sheets of workbooks are read as text tables are.

use super::{TWO, refusal, rr, settings, take};
use crate::answer::starts_with;
use crate::desk::Desk;
use crate::workbook::{archive, with_texts, workbook};
use calib::stage::Stage;

const DATA: &str = "Recording of cell 7\n\nid|q1|q2|x|y|z|at\n|deg|deg|mm|mm|mm\nP1|180|-90|1000|-2000.5|3|@45943.541\n\nP2|10|20|4|five|6|@45943.5421\nP3|10|20|1e-7|5|6|:0.25\n";
const TITLED: &str = "  - file: a.csv\n    skip: 2\n    skip_below_header: 1\n";

fn titled() -> String {
    TWO.replace("  - file: a.csv\n", TITLED)
}

fn book(sheets: &[(&str, &str)]) -> Desk {
    Desk::default().with("a.csv", workbook(sheets))
}

#[test]
fn a_sheet_is_read_below_its_title_with_its_units_and_blank_rows() {
    let taken = take(
        &book(&[("Notes", "by hand"), ("Data", DATA)]),
        &titled(),
        rr(),
    )
    .unwrap();
    let recording = &taken.recording;
    assert_eq!(recording.point_id, ["P1", "P3"]);
    assert_eq!(
        recording.q(0),
        [std::f64::consts::PI, -std::f64::consts::FRAC_PI_2]
    );
    assert_eq!(recording.position[0], [1.0, -2.0005, 0.003]);
    assert_eq!(recording.position[1][0], 1e-10);
    let rejected = &taken.rejected.0[0];
    assert_eq!(
        (rejected.file.as_str(), rejected.line),
        ("a.csv sheet `Data`", 7)
    );
    assert_eq!(rejected.detail, "y: `five` is not a number");
    assert_eq!(taken.intake.0[0].read, 3);
}

#[test]
fn dates_and_times_of_day_in_cells_are_clock_times() {
    let timed = titled().replace(
        "      q:",
        "      time: {column: at, unit: clock}\n      q:",
    );
    let data = DATA.replace("five", "5").replace(":0.25", "@45943.75");
    let taken = take(&book(&[("Data", &data)]), &timed, rr()).unwrap();
    // 2025-10-13 is day 20,374 after 1970-01-01 (45943 less 25569, the number of 1970-01-01 in a workbook).
    let expected = [20374.541, 20374.5421, 20374.75].map(|days: f64| days * 86_400.0);
    let times = taken.recording.time.unwrap();
    for (time, expected) in times.iter().zip(expected) {
        assert!((time - expected).abs() < 1e-5, "{time} for {expected}");
    }
    let of_day = DATA
        .replace("five", "5")
        .replace("@45943.5421", ":0.2")
        .replace("@45943.541", ":0.125");
    let taken = take(&book(&[("Data", &of_day)]), &timed, rr()).unwrap();
    let times = taken.recording.time.unwrap();
    assert_eq!(times, [10_800.0, 17_280.0, 21_600.0]);
}

#[test]
fn of_several_sheets_with_numbers_one_is_named() {
    let sheets = [
        ("One", DATA),
        ("Two", &DATA.replace("five", "5")),
        ("_spare", DATA),
    ];
    let message = refusal(&book(&sheets), &titled(), rr());
    let several =
        "a.csv: has numbers in several sheets; say which, `sheet: NAME`; allowed: `One`, `Two`";
    assert_eq!(message, several);
    let two = titled().replace("  - file: a.csv\n", "  - file: a.csv\n    sheet: Two\n");
    let taken = take(&book(&sheets), &two, rr()).unwrap();
    assert_eq!(taken.recording.rows(), 3);
    let message = refusal(&book(&sheets), &two.replace("Two", "Three"), rr());
    let absent = "a.csv: has no sheet `Three`; allowed: `One`, `Two`, `_spare`";
    assert_eq!(message, absent);
    let none = refusal(&book(&[("Notes", "a|b|c\n1|2")]), TWO, rr());
    let unread = "a.csv: has no sheet with rows of numbers; its sheets: `Notes`";
    assert_eq!(none, unread);
    let text = Desk::default().with("a.csv", "id,q1,q2,x,y,z\nP1,1,2,3,4,5\n");
    let message = refusal(&text, &two, rr());
    starts_with(&message, "a.csv: is no workbook, and has no sheet `Two`");
    assert_eq!(settings(&two).check(), []);
}

#[test]
fn texts_in_cells_keep_quotes_and_lose_line_ends_and_numbers_have_the_stated_mark() {
    let data = "id|q1|q2|x|y|z\nthe \"A\" of\rB|1.5|2,5|3|4|5\n";
    let comma = TWO.replace("  - file: a.csv\n", "  - file: a.csv\n    decimal: comma\n");
    let taken = take(
        &book(&[("Data", &format!("{data}B|1|2|3|4|5\n"))]),
        &comma,
        rr(),
    )
    .unwrap();
    assert_eq!(taken.recording.point_id[0], "the \"A\" of B");
    assert_eq!(
        taken.recording.q(0),
        [1.5f64.to_radians(), 2.5f64.to_radians()]
    );
}

#[test]
fn what_is_no_workbook_is_refused_in_words() {
    let refused = |content: Vec<u8>| refusal(&Desk::default().with("a.csv", content), TWO, rr());
    let older = [0xd0, 0xcf, 0x11, 0xe0, 0xa1, 0xb1, 0x1a, 0xe1].to_vec();
    for (content, what) in [
        (
            [older, vec![0; 600]].concat(),
            "a workbook of the older kind (.xls), or has a password",
        ),
        (
            archive(&[("content.xml", b"<office/>")]),
            "an archive or a workbook of another kind",
        ),
    ] {
        let expected =
            format!("a.csv: is {what}; allowed: .xlsx, .xlsm, or the sheet saved as CSV");
        assert_eq!(refused(content), expected);
    }
    let whole = workbook(&[("Data", DATA)]);
    for cut in (8..whole.len()).step_by(97) {
        assert!(
            refused(whole[..cut].to_vec()).starts_with("a.csv: is a"),
            "{cut}"
        );
    }
    for at in (4..whole.len()).step_by(13) {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x41;
        // Whatever a wrong byte makes of it: no panic, and no more than a refusal.
        let _ = take(&Desk::default().with("a.csv", flipped), &titled(), rr());
    }
}

#[test]
fn a_workbook_that_unpacks_to_too_much_is_refused_before_it_is_decoded() {
    let refused = |content: Vec<u8>| refusal(&Desk::default().with("a.csv", content), TWO, rr());
    let body = "<worksheet><sheetData/></worksheet>".to_string();
    let long = format!("<sst>{}</sst>", " ".repeat(70 << 20));
    let many = r#"<sst uniqueCount="900000000000"></sst>"#;
    for (texts, expected) in [
        (
            long.as_str(),
            "is too large at `xl/sharedStrings.xml`; allowed: up to 512 MB unpacked",
        ),
        (
            many,
            "is damaged: `xl/sharedStrings.xml` says that it has more texts",
        ),
    ] {
        let body = std::slice::from_ref(&body);
        let message = refused(with_texts(&[("Data", "")], body, texts));
        starts_with(&message, &format!("a.csv: {expected}"));
    }
    let far = r#"<worksheet><sheetData><row r="1048577"><c r="A1048577"><v>1</v></c><c r="B1048577"><v>1</v></c><c r="C1048577"><v>1</v></c></row></sheetData></worksheet>"#;
    assert!(
        refused(with_texts(&[("Data", "")], &[far.into()], "<sst></sst>")).starts_with("a.csv: ")
    );
}
