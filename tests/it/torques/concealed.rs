//! Recordings of the twin whose physics is concealed, diagnosed blind through the real command and marked.

use crate::answer::{calib, has, root};
use serde_json::Value;

/// Half of the effects in forms that are not the estimator's. More of them: `calib simulate prove --dynamics --cases 300`.
#[test]
fn concealed_torques_are_found_and_nulls_stay_empty() {
    let folder = tempfile::tempdir().unwrap();
    let pipeline = root("pipelines/dynamics/pipeline.yaml");
    let (out, pipeline) = (folder.path().join("set"), pipeline.display());
    let words = format!(
        "simulate prove --dynamics --out {} --seed 11 --cases 4 --nulls 0.25 --pipeline {pipeline} --quiet --json",
        out.display()
    );
    let done = calib(".", &words).code(0);
    let board: Value = done.json();
    assert_eq!(
        (&board["recordings"], &board["without_verdict"]),
        (&4.into(), &serde_json::json!([]))
    );
    let alarms = &board["shares"][0]["share"];
    assert_eq!(
        (alarms["count"].as_u64(), alarms["of"].as_u64()),
        (Some(0), Some(1)),
        "false alarms: {board:#}"
    );
    let place = &board["places"]["all"]["place"];
    assert!(
        place["of"].as_u64() >= Some(2) && place["count"] == place["of"],
        "places: {board:#}"
    );
}

#[test]
fn options_of_points_are_refused_of_torques() {
    let refused = calib(".", "simulate conceal --dynamics --out never --layout path").code(2);
    has(&refused.err, "--layout");
}
