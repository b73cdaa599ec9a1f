//! What a diagnosis says where the recording is poor: without a clock no seconds, of few rows nothing.

use super::{CASE, calib, case_with, concealed, diagnosis, position, refused, rewritten, table_of};
use crate::answer::{self, has, put, read, starts_with};
use calib::table::{Curves, Findings};
use serde_json::Value;

#[test]
fn without_a_clock_nothing_is_said_in_seconds() {
    let folder = concealed("zero_shift", "923", "120");
    let here = folder.path();
    case_with(here, &[]);
    let timed = diagnosis(here);
    assert_eq!(timed["clock"], "s");
    assert!(
        timed["findings"][0]["statement"]
            .as_str()
            .unwrap()
            .contains(" s ("),
        "{timed:#}"
    );
    let findings: Findings = table_of(here, "diagnose.findings.parquet");
    let forms: Value = serde_json::from_str(&findings.0[0].forms).unwrap();
    let step = forms[0]["zero_shift"]["law"]["basis"]["after"]["at"]
        .as_f64()
        .unwrap();
    let mut times: Vec<f64> = Vec::new();
    let mut column = None;
    rewritten(here, "controller.csv", |row, cells| {
        let at = *column.get_or_insert_with(|| position(cells, "time_s"));
        let cell = cells.remove(at);
        if row > 0 {
            times.push(cell.parse().unwrap());
        }
    });
    let rows = diagnosis(here);
    assert_eq!(rows["clock"], "row");
    let first = times.iter().position(|time| *time > step).unwrap() + 1;
    let statement = rows["findings"][0]["statement"].as_str().unwrap();
    has(statement, &format!(" from row {first} ("));
    let unseen = rows["not_observable"].as_array().unwrap();
    assert!(
        unseen
            .iter()
            .any(|line| line == "time: none was recorded; the order of the rows is used instead"),
        "{unseen:?}"
    );
    let goes_with = rows["located"]["variables"].as_array().unwrap();
    assert!(
        goes_with.iter().any(|by| by["name"] == "row")
            && goes_with.iter().all(|by| by["name"] != "time"),
        "{goes_with:?}"
    );
    calib(&format!("run p.yaml --quiet {CASE}"), here);
    let curves: Curves = table_of(here, "report.curves.parquet");
    let ours: Vec<_> = curves.0.iter().filter(|point| point.rank == 1).collect();
    assert!(!ours.is_empty());
    for point in ours {
        let named = (point.over.as_str(), point.x_unit.as_str());
        assert_eq!(named, ("place in the recording", "row"));
        assert!(point.x >= 1.0 && point.x.fract() == 0.0, "{}", point.x);
    }
    put(here, "t.csv", "x_mm,y_mm,z_mm\n600,0,700\n");
    has(
        &refused("compensate HEAD t.csv --time 100", here),
        "--time: the recording of the model has no clock",
    );
}

#[test]
fn a_diagnosis_that_cannot_make_up_for_missing_masses_does_not_stand_for_the_run() {
    let folder = concealed("joint_compliance", "12", "120");
    let here = folder.path();
    let file = here.join("sealed/recordings/c0001/robot.json");
    let mut robot: Value = serde_json::from_str(&read(&file)).unwrap();
    let fields = robot.as_object_mut().unwrap();
    assert!(fields.remove("mass").is_some() && fields.remove("com").is_some());
    std::fs::write(&file, robot.to_string()).unwrap();
    case_with(here, &[]);
    let run = answer::calib(here, &format!("run p.yaml --quiet --json {CASE}")).json();
    let rms = |step: &Value| {
        let mut rows = run["statistics"].as_array().unwrap().iter();
        let row = rows.find(|row| row["step"] == *step && row["held_out"] == true);
        row.unwrap()["rms_mm"].as_f64().unwrap()
    };
    // The payload alone winds up the joints of `joint`, which is all that the file lets one know.
    let standing = &run["standing"]["step"];
    assert!(
        rms(standing) <= 1.03 * rms(&"joint".into()),
        "{standing}: {} mm, joint {} mm",
        rms(standing),
        rms(&"joint".into())
    );
    let printed = answer::calib(here, "compensate HEAD --quiet p.yaml").err;
    assert_eq!(
        printed.contains("warning: `diagnose` is withdrawn"),
        *standing != "diagnose",
        "{printed}"
    );
}

#[test]
fn of_few_rows_nothing_is_asked_and_the_report_is_written_all_the_same() {
    let folder = concealed("zero_shift", "923", "60");
    let here = folder.path();
    let (mut column, mut kept) = (None, 0);
    rewritten(here, "controller.csv", |_, cells| {
        let at = *column.get_or_insert_with(|| position(cells, "use"));
        if cells[at] == "fit" {
            kept += 1;
            if kept > 12 {
                cells[at] = "validate".into();
            }
        }
    });
    case_with(here, &[]);
    calib(&format!("run p.yaml --quiet {CASE}"), here);
    let answer = diagnosis(here);
    assert_eq!(
        (&answer["verdict"], &answer["findings"]),
        (&"not_asked".into(), &serde_json::json!([]))
    );
    assert_eq!(answer["leftover"]["p_value"], Value::Null);
    assert_eq!(
        answer["not_observable"][0],
        "what the simulation lacks: 12 rows were fitted, at least 15 are needed to separate it from geometry"
    );
    let text = calib("diagnose HEAD --details", here);
    starts_with(
        &text,
        "not asked (noise basis: instrument)\ntoo few rows were fitted",
    );
}
