//! A run that is killed goes on where it stood, and ends with the tables of an undisturbed one.
//!
//! A disk that refuses: the run says what to do, keeps what is finished and goes on when it can.

use crate::answer::{has, root};
use crate::held_locks;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::LazyLock;
use std::time::Duration;

fn pipeline() -> PathBuf {
    root("tests/it/resume/pipeline.yaml")
}
fn calib(store: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calib"));
    command
        .arg("run")
        .arg(pipeline())
        .args(["--json", "--quiet", "--store"])
        .arg(store);
    command
}
fn run(command: &mut Command) -> Value {
    let output = command.output().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}
/// `stage.port` -> hash of the table's content.
fn hashes(result: &Value) -> BTreeMap<String, String> {
    let mut hashes = BTreeMap::new();
    for stage in result["stages"].as_array().unwrap() {
        for output in stage["outputs"].as_array().unwrap() {
            let name = format!(
                "{}.{}",
                stage["id"].as_str().unwrap(),
                output["port"].as_str().unwrap()
            );
            hashes.insert(name, output["table_hash"].as_str().unwrap().to_string());
        }
    }
    assert!(hashes.len() > 8, "{hashes:?}");
    hashes
}
/// Action records, the commit points.
fn actions(store: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for folder in std::fs::read_dir(store.join("actions"))
        .into_iter()
        .flatten()
        .flatten()
    {
        found.extend(
            std::fs::read_dir(folder.path())
                .unwrap()
                .map(|entry| entry.unwrap().path()),
        );
    }
    found.sort();
    found
}
fn executed(result: &Value) -> usize {
    result["stages"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|stage| stage["status"] == "executed")
        .count()
}

/// An undisturbed run, on two threads.
struct Undisturbed {
    stages: usize,
    hashes: BTreeMap<String, String>,
    /// In the order of the stages.
    actions: Vec<String>,
}

static UNDISTURBED: LazyLock<Undisturbed> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let result = run(calib(folder.path()).args(["--jobs", "2"]));
    let actions = held_locks::actions_of(folder.path(), result["run_id"].as_str().unwrap());
    Undisturbed {
        stages: executed(&result),
        hashes: hashes(&result),
        actions,
    }
});

#[test]
fn a_killed_run_resumes_and_ends_as_an_undisturbed_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(20);
    for round in 0..20 {
        let store = folder.path().join(format!("killed-{round}"));
        // No run comes past this stage while it is held, so that it is killed before its end on any machine.
        let barrier = random.random_range(1..UNDISTURBED.stages);
        let held = held_locks::action(&store, &UNDISTURBED.actions[barrier]);
        let mut seen = 0;
        // Twice in a row: what a killed run left, and what a killed resumption left.
        for _ in 0..2 {
            let mut child = calib(&store)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            let enough = random.random_range(1..=barrier);
            held_locks::until(&mut child, || actions(&store).len() >= enough);
            // Somewhere in the next stage, or at the barrier.
            std::thread::sleep(Duration::from_millis(random.random_range(0..60)));
            child.kill().unwrap();
            child.wait().unwrap();
            seen = enough.max(seen);
        }
        drop(held);
        let finished = actions(&store);
        assert!(
            (seen..=barrier).contains(&finished.len()),
            "round {round}: {} of {barrier}",
            finished.len()
        );
        let modified: Vec<_> = finished
            .iter()
            .map(|path| path.metadata().unwrap().modified().unwrap())
            .collect();
        let resumed = run(&mut calib(&store));
        assert_eq!(
            executed(&resumed),
            UNDISTURBED.stages - finished.len(),
            "round {round}: finished stages are not redone"
        );
        let after: Vec<_> = finished
            .iter()
            .map(|path| path.metadata().unwrap().modified().unwrap())
            .collect();
        assert_eq!(modified, after, "round {round}: records stand");
        assert_eq!(hashes(&resumed), UNDISTURBED.hashes, "round {round}");
        assert_eq!(executed(&run(&mut calib(&store))), 0);
        let left: Vec<_> = std::fs::read_dir(store.join("tmp"))
            .unwrap()
            .flatten()
            .collect();
        assert!(left.is_empty(), "round {round}: {left:?}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(
        hashes(&run(calib(folder.path()).args(["--jobs", "1"]))),
        UNDISTURBED.hashes
    );
}

#[test]
fn two_runs_at_once_share_their_work() {
    let folder = tempfile::tempdir().unwrap();
    let start = || {
        calib(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let results = [start(), start()].map(|child| {
        let output = child.wait_with_output().unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        serde_json::from_slice::<Value>(&output.stdout).unwrap()
    });
    let stages = results[0]["stages"].as_array().unwrap().len();
    assert_eq!(
        executed(&results[0]) + executed(&results[1]),
        stages,
        "every stage was executed once"
    );
    assert_eq!(hashes(&results[0]), hashes(&results[1]));
}

#[test]
fn the_manifest_of_a_killed_run_says_that_it_did_not_end() {
    let folder = tempfile::tempdir().unwrap();
    // Nobody comes past the first stage.
    let _held = held_locks::action(folder.path(), &UNDISTURBED.actions[0]);
    let mut child = calib(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let manifest = || {
        let runs = std::fs::read_dir(folder.path().join("runs"))
            .into_iter()
            .flatten()
            .flatten();
        runs.map(|entry| entry.path().join("manifest.json"))
            .find(|path| path.is_file())
    };
    held_locks::until(&mut child, || manifest().is_some());
    child.kill().unwrap();
    child.wait().unwrap();
    let manifest: Value =
        serde_json::from_slice(&std::fs::read(manifest().unwrap()).unwrap()).unwrap();
    assert_eq!(manifest["status"], "running");
    assert_eq!(manifest["seed"], 11);
}

#[test]
fn ctrl_c_says_that_the_same_command_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let held = held_locks::action(folder.path(), &UNDISTURBED.actions[1]);
    let mut child = calib(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    held_locks::until(&mut child, || !actions(folder.path()).is_empty());
    let process = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &process]).status();
    assert!(sent.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    has(&text(&output.stderr), "the same command goes on from there");
    drop(held);
    assert_eq!(hashes(&run(&mut calib(folder.path()))), UNDISTURBED.hashes);
}

#[test]
fn the_log_counts_the_stages_that_a_killed_run_finished() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path();
    let _held = held_locks::action(store, &UNDISTURBED.actions[3]);
    let mut child = calib(store)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let ended = || {
        let runs = std::fs::read_dir(store.join("runs"))
            .into_iter()
            .flatten()
            .flatten();
        let events =
            runs.filter_map(|run| std::fs::read_to_string(run.path().join("events.jsonl")).ok());
        events
            .map(|text| {
                text.lines()
                    .filter(|line| line.contains("\"ends\""))
                    .count()
            })
            .sum::<usize>()
    };
    held_locks::until(&mut child, || ended() == 3);
    child.kill().unwrap();
    child.wait().unwrap();
    let log = Command::new(env!("CARGO_BIN_EXE_calib"))
        .args(["log", "--store"])
        .arg(store)
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&log.stdout).into_owned();
    has(&printed, "running or killed, 3 run, 0 cached");
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Files may grow to so many blocks of 512 bytes; writing more fails as on a full disk.
#[cfg(unix)]
fn run_within(blocks: u32, store: &Path) -> Output {
    let script = format!(
        "trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" run \"$1\" --quiet --json --store \"$2\""
    );
    let mut shell = Command::new("sh");
    shell
        .args(["-c", &script, env!("CARGO_BIN_EXE_calib")])
        .arg(pipeline())
        .arg(store)
        .output()
        .unwrap()
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_said_so_and_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store");
    for blocks in [8, 32, 48] {
        let full = run_within(blocks, &store);
        assert_eq!(
            full.status.code(),
            Some(75),
            "{blocks} blocks: {}",
            text(&full.stderr)
        );
        let printed = text(&full.stderr);
        has(&printed, ["free some space there", "--store DIR"]);
        let failure: serde_json::Value = serde_json::from_slice(&full.stdout).unwrap();
        assert_eq!(
            (&failure["status"], &failure["exit_code"]),
            (&"failed".into(), &75.into())
        );
    }
    let after = Command::new(env!("CARGO_BIN_EXE_calib"))
        .arg("run")
        .arg(pipeline())
        .arg("--store")
        .arg(&store)
        .output()
        .unwrap();
    assert!(after.status.success(), "{}", text(&after.stderr));
    has(&text(&after.stderr), "robot     cached");
    let left: Vec<_> = std::fs::read_dir(store.join("tmp"))
        .unwrap()
        .flatten()
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// /sys takes no files from anybody.
#[cfg(target_os = "linux")]
#[test]
fn a_read_only_place_for_the_store_is_said_so() {
    let store = Path::new("/sys/calib-store");
    let refused = Command::new(env!("CARGO_BIN_EXE_calib"))
        .arg("run")
        .arg(pipeline())
        .arg("--store")
        .arg(store)
        .output()
        .unwrap();
    assert_eq!(refused.status.code(), Some(75));
    let printed = text(&refused.stderr);
    has(
        &printed,
        [
            "/sys/calib-store: cannot make the folder",
            "choose another with --store DIR",
        ],
    );
}
