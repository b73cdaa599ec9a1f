//! Times as clocks write them.

use super::{refusal, rr, take};
use crate::answer::has;
use crate::desk::Desk;

const CLOCK: &str = r#"
files:
  - file: a.csv
    delimiter: ";"
    columns:
      time: {column: at, unit: clock}
      q: {column: "q{j}", unit: deg}
      x: {column: x, unit: mm}
      y: {column: y, unit: mm}
      z: {column: z, unit: mm}
"#;

fn rows(times: &[&str]) -> Desk {
    let text: String = times
        .iter()
        .enumerate()
        .map(|(k, time)| format!("{time};{k};20;100;200;{k}\n"))
        .collect();
    Desk::default().with("a.csv", format!("at;q1;q2;x;y;z\n{text}"))
}

#[test]
fn times_of_day_go_on_after_midnight_and_dates_are_seconds() {
    let times = |cells: &[&str]| {
        take(&rows(cells), CLOCK, rr())
            .unwrap()
            .recording
            .time
            .unwrap()
    };
    assert_eq!(
        times(&["'23:59:58", "23:59:59,5", "00:00:01"]),
        [86_398.0, 86_399.5, 86_401.0]
    );
    let dated = times(&[
        "2026-11-22T08:15:03",
        "2026-11-22 08:15:04.25",
        "2026-11-22T09:15:05+01:00",
    ]);
    assert_eq!([dated[1] - dated[0], dated[2] - dated[0]], [1.25, 2.0]);
}

#[test]
fn what_is_no_clock_time_is_a_rejected_row_and_a_clock_without_its_unit_says_how_to_read_it() {
    let taken = take(&rows(&["08:15:03", "8 o'clock", "08:15:05"]), CLOCK, rr()).unwrap();
    let [gone] = taken.rejected.0.as_slice() else {
        panic!("{:?}", taken.rejected)
    };
    assert_eq!((gone.line, gone.reason.as_str()), (3, "not_a_number"));
    has(
        &gone.detail,
        ["`8 o'clock` is no clock time", "08:15:03.25"],
    );
    let seconds = CLOCK.replace("unit: clock", "unit: s");
    let printed = refusal(&rows(&["08:15:03", "08:15:04", "08:15:05"]), &seconds, rr());
    has(
        &printed,
        "`08:15:03` is a clock time, not a number; `unit: clock` reads such times",
    );
}
