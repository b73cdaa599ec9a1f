//! Recordings of the twin whose physics is concealed, diagnosed blind through the real command and marked.

use crate::answer::read;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn simulate(verb: &str, out: &Path, more: &[&str]) -> Output {
    let pipeline = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/pipelines/dynamics/pipeline.yaml"
    );
    let mut command = Command::new(env!("CARGO_BIN_EXE_calib"));
    command
        .args(["simulate", verb, "--dynamics", "--out"])
        .arg(out)
        .args(more);
    if verb == "prove" {
        command.args(["--pipeline", pipeline, "--quiet", "--json"]);
    }
    let done = command.output().unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    done
}

/// Half of the effects in forms that are not the estimator's. More of them: `calib simulate prove --dynamics --cases 300`.
#[test]
fn concealed_torques_are_found_and_nulls_stay_empty() {
    let folder = tempfile::tempdir().unwrap();
    let done = simulate(
        "prove",
        &folder.path().join("set"),
        &["--seed", "11", "--cases", "4", "--nulls", "0.25"],
    );
    let board: Value = serde_json::from_slice(&done.stdout).unwrap();
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
            &[
                "--cases",
                "3",
                "--seconds",
                "16",
                "--rate",
                "20",
                "--open",
                "0.4",
                "--jobs",
                jobs,
            ],
        );
        read(out.join("seal.json"))
    });
    // The hash of every file is in it.
    assert_eq!(seals[0], seals[1]);
    assert_eq!(seals[0].matches("recording.csv").count(), 3);
}

#[test]
fn options_of_points_are_refused_of_torques() {
    let done = Command::new(env!("CARGO_BIN_EXE_calib"))
        .args([
            "simulate",
            "conceal",
            "--dynamics",
            "--out",
            "never",
            "--layout",
            "path",
        ])
        .output()
        .unwrap();
    assert_eq!(done.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&done.stderr).contains("--layout"),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
}
