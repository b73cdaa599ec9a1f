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

/// Joints and points by the clocks of two files, a row every 20 s, of which those of the points are so many seconds later.
fn by_time(later: f64, rows: usize, stated: &str) -> (Desk, String) {
    let clock = |seconds: f64| {
        let (hour, left) = ((seconds / 3600.0).floor(), seconds % 3600.0);
        format!(
            "2026-10-05T{:02}:{:02}:{:06.3}",
            hour,
            (left / 60.0).floor(),
            left % 60.0
        )
    };
    let start = 8.0 * 3600.0;
    let arm: String = (0..30)
        .map(|k| format!("{}Z,{k},20\n", clock(start + 20.0 * f64::from(k))))
        .collect();
    let points: String = (0..rows)
        .map(|k| format!("{},100,200,{k}\n", clock(start + 20.0 * k as f64 + later)))
        .collect();
    let desk = Desk::default()
        .with("arm.csv", format!("at,q1,q2\n{arm}"))
        .with("points.csv", format!("at,x,y,z\n{points}"));
    let yaml = format!(
        r#"
files:
  - file: arm.csv
    columns: {{time: {{column: at, unit: clock}}, q: {{column: "q{{j}}", unit: deg}}}}
  - file: points.csv
    columns:
      time: {{column: at, unit: clock}}
      x: {{column: x, unit: mm}}
      y: {{column: y, unit: mm}}
      z: {{column: z, unit: mm}}
join: {{by: time, tolerance_s: 5{stated}}}
"#
    );
    (desk, yaml)
}

#[test]
fn a_constant_offset_between_clocks_is_stated_as_the_yaml_that_joins_the_rows() {
    let (desk, yaml) = by_time(7201.2, 30, "");
    has(
        &refusal(&desk, &yaml, rr()),
        "no partner in points.csv; the clocks are 7201.2 s apart in all rows (2 h and 1.2 s: UTC against local time): \
         `join: {by: time, tolerance_s: 5, offset_s: 7201.2}`",
    );
    let (desk, yaml) = by_time(7201.2, 30, ", offset_s: 7201.2");
    assert_eq!(take(&desk, &yaml, rr()).unwrap().recording.rows(), 30);
    // An offset that is stated with the wrong sign.
    let (desk, yaml) = by_time(7201.2, 30, ", offset_s: -7201.2");
    has(&refusal(&desk, &yaml, rr()), "offset_s: 7201.2}`");
    // A grid of which rows are missing pairs at several offsets.
    let (desk, yaml) = by_time(3600.0, 12, "");
    has(
        &refusal(&desk, &yaml, rr()),
        "the nearest rows are 3020 s apart",
    );
}

#[test]
fn date_stamps_as_german_and_american_programs_write_them_are_read() {
    let times = |cells: &[&str]| {
        let taken = take(&rows(cells), CLOCK, rr()).unwrap();
        taken.recording.time.unwrap()
    };
    let german = times(&[
        "20.11.2026 08:12:09",
        "20.11.2026 08:12:10,5",
        "21.11.2026 08:12:09",
    ]);
    assert_eq!(
        [german[1] - german[0], german[2] - german[0]],
        [1.5, 86_400.0]
    );
    let american = times(&[
        "11/20/2026 8:12:09 AM",
        "11/20/2026 8:12:09 PM",
        "11/21/2026 12:00:00 AM",
    ]);
    assert_eq!(american[0], german[0]);
    assert_eq!(american[1] - american[0], 43_200.0);
    assert_eq!(
        american[2],
        15.0f64.mul_add(3600.0, german[0]) + 47.0 * 60.0 + 51.0
    );
    let day_first = refusal(&rows(&["20/11/2026 08:12:09"; 3]), CLOCK, rr());
    has(&day_first, "11/22/2026 8:15:03 AM, the month first");
}
