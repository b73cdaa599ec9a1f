//! A step that is worse than one before it at points predicted by fits without them is withdrawn wherever a run is spoken of or used.

use super::{PIPELINE, ROBOT};
use crate::answer::{fed, has, put, read};
use serde_json::Value;

const POOR: &str = "  - {id: poor, uses: identify, with: {effects: [base_frame], on: [fit]}}
  - uses: validate
  - uses: report
";

#[test]
fn a_worse_last_step_is_withdrawn_by_run_report_compensate_and_export() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "robot.yaml", ROBOT);
    put(here, "pipeline.yaml", format!("{PIPELINE}{POOR}"));
    let message_of = |arguments: &str, input: &str| -> (String, String) {
        let answer = fed(here, arguments, input).code(0);
        (answer.out, answer.err)
    };
    let used = "`poor` is withdrawn and `identify` used instead";
    let (out, err) = message_of("run pipeline.yaml --details", "");
    has(&out, "\nwarning   poor withdrawn, identify used: ");
    has(
        &out,
        [
            " at 60 points unseen by either fit\n",
            "  poor (withdrawn)  validate",
        ],
    );
    has(&err, &format!("{used}: "));
    let document = fed(here, "run pipeline.yaml --json --quiet", "").json();
    let standing = &document["standing"];
    assert_eq!([&standing["step"], &standing["model"]], ["identify"; 2]);
    let gone = &standing["withdrawn"][0];
    assert_eq!([&gone["step"], &gone["than"]], ["poor", "identify"]);
    assert_eq!(gone["points"], 60);
    // The figures are those of the statistics.
    let rms = |step: &str| {
        let rows = document["statistics"].as_array().unwrap();
        let is = |row: &&Value| row["step"] == step && row["held_out"] == false;
        let row = rows.iter().find(is).unwrap();
        row["fold_rms_mm"].as_f64().unwrap()
    };
    for (figure, step) in [("rms_mm", "poor"), ("than_rms_mm", "identify")] {
        assert!(
            (gone[figure].as_f64().unwrap() - rms(step)).abs() < 1e-9,
            "{gone}"
        );
    }
    let documents = document["documents"].as_array().unwrap();
    let document_of = |ending: &str| {
        let mut files = documents.iter().filter_map(Value::as_str);
        read(here.join(files.find(|file| file.ends_with(ending)).unwrap()))
    };
    let report: Value = serde_json::from_str(&document_of("report.json")).unwrap();
    let withdrawn = &report["withdrawn"][0]["step"];
    assert_eq!([&report["standing"], withdrawn], ["identify", "poor"]);
    let mut parameters = report["parameters"].as_array().unwrap().iter();
    assert!(parameters.any(|row| row["name"] == "joint_offset.j2"));
    let page = document_of("report.html");
    has(&page, ["poor</span> <span>(withdrawn)</span>", used]);
    for model in ["pipeline.yaml", "HEAD"] {
        let targets = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,5,40,0\n";
        let (taken, err) = message_of(&format!("compensate {model} --quiet"), targets);
        has(&err, &format!("warning: {used}"));
        let asked = format!("compensate {model} --quiet --step identify");
        assert_eq!(message_of(&asked, targets), (taken, String::new()));
        let (out, err) = message_of(&format!("export {model} --format json"), "");
        has(&out, "stage identify\"");
        has(&err, "warning: `poor` is withdrawn");
    }
}
