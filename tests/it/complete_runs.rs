//! HEAD is the last complete run; runs of other commands are listed as such, addressed by id, and displace no kept run.

use crate::answer::{calib, fed, has, read};
use crate::compensate::cell;
use serde_json::Value;
use std::path::Path;

fn message_of(here: &Path, arguments: &str) -> (Option<i32>, String) {
    let output = fed(
        here,
        arguments,
        "A1_deg,A2_deg,A3_deg,A4_deg,A5_deg,A6_deg\n10,20,-30,5,40,0\n",
    );
    (output.code, output.out + &output.err)
}
fn done(here: &Path, arguments: &str) -> String {
    let (code, printed) = message_of(here, arguments);
    assert_eq!(code, Some(0), "{arguments:?}: {printed}");
    printed
}
fn json(here: &Path, arguments: &str) -> Value {
    serde_json::from_str(&done(here, &format!("{arguments} --json"))).unwrap()
}
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["robot.yaml", "pipeline.yaml"] {
        std::fs::copy(cell().join(name), folder.path().join(name)).unwrap();
    }
    folder
}
/// What every run of the log is, the last first.
fn kinds(here: &Path) -> Vec<String> {
    let runs = json(here, "log");
    runs.as_array()
        .unwrap()
        .iter()
        .map(|run| run["what"].as_str().unwrap().to_string())
        .collect()
}

#[test]
fn what_other_verbs_run_is_not_head_and_is_listed_as_what_it_is() {
    let folder = folder();
    let here = folder.path();
    let (code, text) = message_of(here, "explain identify");
    assert_eq!(
        (code, text.contains("has no runs")),
        (Some(2), true),
        "{text}"
    );
    done(here, "compensate pipeline.yaml --quiet");
    let (code, text) = message_of(here, "explain identify");
    assert_eq!(code, Some(2));
    let only = json(here, "log")[0]["run"].as_str().unwrap().to_string();
    has(&text, ["no complete run of `calib run`", &only]);
    for seed in ["seed=1", "seed=2"] {
        done(here, &format!("run pipeline.yaml --quiet --set {seed}"));
    }
    let runs = ["HEAD~1", "HEAD"].map(|name| {
        json(here, &format!("show {name}"))["run_id"]
            .as_str()
            .unwrap()
            .to_string()
    });
    done(here, "compensate pipeline.yaml --quiet --set seed=5");
    done(
        here,
        "export pipeline.yaml --format urdf --quiet --set seed=6",
    );
    done(here, "run pipeline.yaml --quiet --until split --set seed=7");
    assert_eq!(
        message_of(
            here,
            "run pipeline.yaml --quiet --set 'identify.on=[fit, none]'"
        )
        .0,
        Some(10)
    );
    assert_eq!(
        message_of(
            here,
            "compensate pipeline.yaml --quiet --set 'identify.on=[fit, none]'"
        )
        .0,
        Some(10)
    );
    assert_eq!(
        kinds(here).join(" "),
        "compensate failed partial export compensate run run compensate"
    );
    for (name, run) in ["HEAD~1", "HEAD"].iter().zip(&runs) {
        assert_eq!(json(here, &format!("show {name}"))["run_id"], run.as_str());
    }
    assert!(done(here, "tag HEAD released").contains(&runs[1]));
    assert!(done(here, "lineage HEAD/identify/parameters").contains(&runs[1]));
    let exported = |name: &str| done(here, &format!("export {name} --format json --quiet"));
    assert_eq!(exported("latest"), exported(&runs[1]));
    let (code, text) = message_of(here, "show HEAD~2");
    assert_eq!(
        (
            code,
            text.contains("the store has 2 complete runs of `calib run`")
        ),
        (Some(2), true),
        "{text}"
    );
    // What was run between two complete runs is no part of how they differ.
    done(here, "run pipeline.yaml --quiet --set seed=8");
    assert_eq!(json(here, "explain simulate")["before"], runs[1].as_str());
    assert_eq!(json(here, "show HEAD~1")["run_id"], runs[1].as_str());
    // By its id every run is reached.
    let log = json(here, "log");
    let partial = log
        .as_array()
        .unwrap()
        .iter()
        .find(|run| run["what"] == "partial")
        .unwrap()["run"]
        .as_str()
        .unwrap()
        .to_string();
    assert_eq!(json(here, &format!("show {partial}"))["seed"], 7);
    let text = done(here, "log");
    let line = text
        .lines()
        .find(|line| line.starts_with(&runs[1]))
        .unwrap();
    assert!(
        line.contains("  run         small  done")
            && line.ends_with("[released]")
            && text.lines().next().unwrap().ends_with("[HEAD]"),
        "{text}"
    );
    assert!(
        text.lines()
            .any(|line| line.contains("  failed      small  failed")),
        "{text}"
    );
}

#[test]
fn a_manifest_that_names_no_purpose_is_of_a_run_of_its_own() {
    let folder = folder();
    let here = folder.path();
    done(here, "run pipeline.yaml --quiet");
    let run = json(here, "show HEAD")["run_id"]
        .as_str()
        .unwrap()
        .to_string();
    let path = here.join(".calib/runs").join(&run).join("manifest.json");
    let text = read(&path);
    let body =
        text.split(",\n  \"sealed\"")
            .next()
            .unwrap()
            .replacen("  \"purpose\": \"run\",\n", "", 1);
    assert!(!body.contains("\"purpose\""));
    std::fs::write(
        &path,
        format!(
            "{body},\n  \"sealed\": \"{}\"\n}}\n",
            blake3::hash(body.as_bytes()).to_hex()
        ),
    )
    .unwrap();
    assert_eq!(
        (json(here, "show HEAD")["run_id"].as_str(), kinds(here)),
        (Some(run.as_str()), vec!["run".to_string()])
    );
}

#[test]
fn a_sweep_keeps_the_last_complete_runs_whatever_else_was_run_since() {
    let folder = folder();
    let here = folder.path();
    done(here, "run pipeline.yaml --quiet --set seed=1");
    for seed in ["seed=5", "seed=6", "seed=7"] {
        done(
            here,
            &format!("compensate pipeline.yaml --quiet --set {seed}"),
        );
    }
    done(here, "gc --keep-runs 1 --grace-hours 0");
    let executed = |seed: &str| {
        let stages = json(
            here,
            &format!("run pipeline.yaml --quiet --dry-run --set {seed}"),
        )["stages"]
            .clone();
        stages
            .as_array()
            .unwrap()
            .iter()
            .filter(|stage| stage["status"] != "cached")
            .count()
    };
    let forecast = json(here, "run pipeline.yaml --quiet --dry-run --set seed=1");
    assert_eq!(executed("seed=1"), 0, "the complete run: {forecast}");
    assert_eq!(executed("seed=7"), 0, "the last of the others");
    assert!(
        executed("seed=5") > 0,
        "of the others as many are kept as of complete ones"
    );
}

#[test]
fn a_run_that_does_nothing_logs_one_line_a_stage() {
    let folder = folder();
    let here = folder.path();
    done(here, "run pipeline.yaml");
    let output = calib(here, "run pipeline.yaml");
    let log = output.err;
    let stages: Vec<&str> = log
        .lines()
        .map(|line| line.split_whitespace().next().unwrap_or_default())
        .collect();
    assert_eq!(stages.join(" "), "robot simulate split identify", "{log}");
    assert!(log.lines().all(|line| line.ends_with("  cached")), "{log}");
    let run = json(here, "log")[0]["run"].as_str().unwrap().to_string();
    let events = read(here.join(".calib/runs").join(run).join("events.jsonl"));
    assert_eq!(events.lines().count(), 4, "{events}");
}
