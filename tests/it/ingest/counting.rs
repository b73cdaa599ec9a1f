//! Controllers that count joints in their own way: other signs, other zeros, and angles that hold a part of another one.

use super::{TWO, faults_of, refusal, rows, rr, settings, take};
use crate::answer::has;
use calib::stage::Stage;

fn with(q: &str) -> String {
    TWO.replace("unit: deg}", &format!("unit: deg, {q}}}"))
}

#[test]
fn joints_arrive_as_the_robot_file_counts_them() {
    let desk = rows("P1,30,-60,1000,200,3\nP2,100,20,4,5,6\n");
    let taken = |q: &str| take(&desk, &with(q), rr()).unwrap().recording;
    let degrees = |q: &str| {
        taken(q)
            .q
            .iter()
            .map(|q| (q.to_degrees() * 1e9).round() / 1e9)
            .collect::<Vec<f64>>()
    };
    assert_eq!(degrees("sign: [1, -1]"), [30.0, 60.0, 100.0, -20.0]);
    assert_eq!(degrees("zero: [0, -90]"), [30.0, 30.0, 100.0, 110.0]);
    assert_eq!(
        degrees("sign: [1, -1], zero: [10, -90]"),
        [20.0, -30.0, 90.0, -110.0]
    );
    // The second joint is reported less the first.
    assert_eq!(
        degrees("coupled: [{joint: 2, by: 1, ratio: -1}]"),
        [30.0, -30.0, 100.0, 120.0]
    );
}

#[test]
fn ways_of_counting_that_no_robot_has_are_faults() {
    let faults = |q: &str| {
        settings(&with(q))
            .check()
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert_eq!(
        faults("sign: [1, 2]"),
        "files[0].columns.q.sign[1]: allowed: 1 and -1"
    );
    let coupled = faults("coupled: [{joint: 0, by: 1, ratio: 1}, {joint: 2, by: 2, ratio: 1}]");
    assert_eq!(
        coupled,
        "files[0].columns.q.coupled[0]: joints count from 1\nfiles[0].columns.q.coupled[1]: a joint cannot hold itself; expected two \
         different joints"
    );
    let current = TWO.replace(
        "      x:",
        "      current: {column: \"i{j}\", unit: A, zero: [1, 2]}\n      x:",
    );
    let printed = faults_of(&current).join("\n");
    assert_eq!(
        printed,
        "files[0].columns.current: `zero` and `coupled` are for positions; say them at `q`"
    );
    let desk = rows("P1,30,-60,1000,200,3\n");
    let printed = refusal(&desk, &with("sign: [1, 1, -1]"), rr());
    has(&printed, "`q.sign` lists 3 numbers; the robot has 2 joints");
    let printed = refusal(&desk, &with("coupled: [{joint: 3, by: 2, ratio: 1}]"), rr());
    has(
        &printed,
        "`q.coupled` names a joint beyond the last; the robot has 2 joints",
    );
}
