//! Recordings of the twin whose physics is concealed, diagnosed blind through the real command and marked.

use crate::answer::{Answer, calib, has, read, root};
use serde_json::Value;
use std::path::Path;

fn simulate(verb: &str, out: &Path, more: &str) -> Answer {
    let pipeline = match verb {
        "prove" => format!(
            "--pipeline {} --quiet --json",
            root("pipelines/dynamics/pipeline.yaml").display()
        ),
        _ => String::new(),
    };
    let out = out.display();
    let words = format!("simulate {verb} --dynamics --out {out} {more} {pipeline}");
    calib(".", &words).code(0)
}

/// Half of the effects in forms that are not the estimator's. More of them: `calib simulate prove --dynamics --cases 300`.
#[test]
fn concealed_torques_are_found_and_nulls_stay_empty() {
    let folder = tempfile::tempdir().unwrap();
    let done = simulate(
        "prove",
        &folder.path().join("set"),
        "--seed 11 --cases 4 --nulls 0.25",
    );
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
fn a_seed_gives_the_same_recordings_of_torques_on_one_and_two_threads() {
    let folder = tempfile::tempdir().unwrap();
    let seals = ["1", "2"].map(|jobs| {
        let out = folder.path().join(jobs);
        simulate(
            "conceal",
            &out,
            &format!("--cases 3 --seconds 16 --rate 20 --open 0.4 --jobs {jobs}"),
        );
        read(out.join("seal.json"))
    });
    // The hash of every file is in it.
    assert_eq!(seals[0], seals[1]);
    assert_eq!(seals[0].matches("recording.csv").count(), 3);
}

#[test]
fn options_of_points_are_refused_of_torques() {
    let refused = calib(".", "simulate conceal --dynamics --out never --layout path").code(2);
    has(&refused.err, "--layout");
}
