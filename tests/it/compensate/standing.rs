//! A step that is worse than one before it at points predicted by fits without them is withdrawn wherever a run is spoken of or used.

use super::{PIPELINE, ROBOT};
use crate::answer::{fed, has, put};
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
        let output = fed(here, arguments, input);
        let (code, out, err) = output.parts();
        assert!(code == Some(0), "{arguments:?}: {err}");
        (out, err)
    };
    let (out, err) = message_of("run pipeline.yaml --details", "");
    has(&out, "\nwarning   poor withdrawn, identify used: ");
    has(&out, " at 60 points unseen by either fit\n");
    has(&out, "  poor (withdrawn)  validate");
    has(&err, "`poor` is withdrawn and `identify` used instead: ");
    let document: Value =
        serde_json::from_str(&message_of("run pipeline.yaml --json --quiet", "").0).unwrap();
    assert_eq!(
        (
            &document["standing"]["step"],
            &document["standing"]["model"]
        ),
        (&"identify".into(), &"identify".into())
    );
    let gone = &document["standing"]["withdrawn"][0];
    assert_eq!(
        (&gone["step"], &gone["than"], &gone["points"]),
        (&"poor".into(), &"identify".into(), &60.into())
    );
    // The figures are those of the statistics.
    let rms = |step: &str| {
        let rows = document["statistics"].as_array().unwrap();
        let row = rows
            .iter()
            .find(|row| row["step"] == step && row["held_out"] == false)
            .unwrap();
        row["fold_rms_mm"].as_f64().unwrap()
    };
    for (figure, step) in [("rms_mm", "poor"), ("than_rms_mm", "identify")] {
        assert!(
            (gone[figure].as_f64().unwrap() - rms(step)).abs() < 1e-9,
            "{gone}"
        );
    }
    let documents = document["documents"].as_array().unwrap();
    let read = |ending: &str| {
        let file = documents
            .iter()
            .filter_map(Value::as_str)
            .find(|file| file.ends_with(ending))
            .unwrap();
        std::fs::read_to_string(here.join(file)).unwrap()
    };
    let report: Value = serde_json::from_str(&read("report.json")).unwrap();
    assert_eq!(
        (&report["standing"], &report["withdrawn"][0]["step"]),
        (&"identify".into(), &"poor".into())
    );
    assert!(
        report["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .any(|row| row["name"] == "joint_offset.j2")
    );
    let page = read("report.html");
    assert!(
        page.contains("poor</span> <span>(withdrawn)</span>")
            && page.contains("`poor` is withdrawn and `identify` used instead"),
        "the page is silent"
    );
    for model in ["pipeline.yaml", "HEAD"] {
        let targets = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,5,40,0\n";
        let (taken, err) = message_of(&format!("compensate {model} --quiet"), targets);
        has(
            &err,
            "warning: `poor` is withdrawn and `identify` used instead",
        );
        let (asked, err) = message_of(
            &format!("compensate {model} --quiet --step identify"),
            targets,
        );
        assert_eq!((taken, err.as_str()), (asked, ""));
        let (out, err) = message_of(&format!("export {model} --format json"), "");
        assert!(
            out.contains("stage identify\"") && err.contains("warning: `poor` is withdrawn"),
            "{err}"
        );
    }
}
