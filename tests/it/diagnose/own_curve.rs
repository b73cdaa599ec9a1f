//! What a joint errs by over its own angle: transmission or encoder, by the same name everywhere.

use crate::answer::{calib, has, root};
use crate::desk::shared;
use serde_json::Value;

#[test]
fn a_curve_over_a_joints_own_angle_is_an_error_of_its_transmission_or_encoder_everywhere() {
    let Some(cases) = shared("practice") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let pipeline = root("pipelines/case/pipeline.yaml");
    let case = format!("case={}", cases.join("p09_unlisted").display());
    let diagnose = |more: &[&str]| {
        let words = [
            "diagnose",
            pipeline.to_str().expect("UTF-8"),
            "--set",
            &case,
            "-q",
        ];
        calib(&folder, [&words[..], more].concat().as_slice())
    };
    let answer: Value = diagnose(&["--json"]).json();
    let first = &answer["findings"][0];
    assert_eq!(
        (&first["effect"], &first["where"]),
        (&"joint_table".into(), &"joint 2".into())
    );
    has(
        first["statement"].as_str().expect("a statement"),
        ["the transmission or encoder of joint 2 errs over its angle by a curve that is no wave"],
    );
    assert!(
        first["forms"]
            .as_array()
            .is_some_and(|forms| !forms.is_empty()),
        "no formula: {answer:#}"
    );
    has(&diagnose(&[]).ok(), ["gear or encoder of joint 2 errs"]);
    has(
        &diagnose(&["--details"]).ok(),
        ["joint_table", "transmission or encoder"],
    );
    let page = folder.path().join("page.html");
    diagnose(&["--html", page.to_str().expect("UTF-8")]).ok();
    has(
        &crate::answer::read(&page),
        ["joint table at joint 2", "joint table</span>"],
    );
}
