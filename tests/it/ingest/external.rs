//! Axes beside the arm's own: a track that moves while the robot file has none is refused, one that stands is not.

use super::{refusal, robot, rr, take};
use crate::answer::{has, starts_with};
use crate::desk::Desk;

const YAML: &str = "
files:
  - file: a.csv
    columns:
      q: {column: \"q{j}\", unit: deg}
      x: {column: x, unit: mm}
      y: {column: y, unit: mm}
      z: {column: z, unit: mm}
";

fn desk(header: &str, axis: impl Fn(usize) -> String) -> Desk {
    let rows = (0..12).map(|row| format!("{},{},{},1,2,3\n", 5 * row, 7 * row, axis(row)));
    Desk::default().with(
        "a.csv",
        format!("q1,q2,{header},x,y,z\n{}", rows.collect::<String>()),
    )
}

#[test]
fn an_axis_that_moves_and_that_the_robot_file_does_not_have_is_refused() {
    for (header, name) in [("eax_a", "eax_a"), ("E1", "E1"), ("track_mm", "track_mm")] {
        let printed = refusal(&desk(header, |row| format!("{}", 100 * row)), YAML, rr());
        let sentence = format!(
            "a.csv: column `{name}` is an external axis, in addition to the robot's 2 joints, and moves from 0 to 1100"
        );
        starts_with(&printed, &sentence);
    }
    for (header, value) in [("eax_a", "9E9"), ("E1", "0.004"), ("rail", "")] {
        take(&desk(header, |_| value.into()), YAML, rr())
            .unwrap_or_else(|error| panic!("{header}: {error}"));
    }
    // What is called otherwise is none of calib's business.
    take(&desk("speed", |row| format!("{row}")), YAML, rr()).unwrap();
    // An axis that is mapped is the robot's.
    let mapped = YAML.replace(
        "{column: \"q{j}\", unit: deg}",
        "{columns: [eax_a, q1, q2], unit: deg, linear_unit: mm}",
    );
    take(
        &desk("eax_a", |row| format!("{}", 100 * row)),
        &mapped,
        robot("prr", 1.0),
    )
    .unwrap();
}

#[test]
fn joints_beyond_the_limits_are_a_hint_of_their_counting() {
    let text: String = (0..12)
        .map(|row| format!("{},{},1,2,3\n", 120 + 5 * row, 7 * row))
        .collect();
    let desk = Desk::default().with("a.csv", format!("q1,q2,x,y,z\n{text}"));
    take(&desk, YAML, robot("rr", 0.5)).unwrap();
    let warnings = desk.warnings.lock().unwrap().join("\n");
    has(
        &warnings,
        [
            "12 rows with a joint beyond the robot's limits, used all the same",
            "`sign`, `zero`, `coupled` of `q`",
        ],
    );
}
