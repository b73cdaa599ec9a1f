//! A fleet killed three times ends as an undisturbed one, and nothing recorded is computed again.
//!
//! A fleet's diagnosis has the same tables whoever computes it: one worker, two processes of which one is killed, tasks of a cluster.

use super::causes::twins;
use super::{Line, fleet, output, run, tables, write};
use crate::held_locks::{self, Held};
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

/// The records of a fleet.
pub fn records(store: &Path, name: &str) -> Vec<PathBuf> {
    let folder = store.join("fleets").join(name).join("records");
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        found.extend(
            std::fs::read_dir(entry.path())
                .into_iter()
                .flatten()
                .flatten()
                .map(|entry| entry.path()),
        );
    }
    found.sort();
    found
}

/// The claims on the last `count` robots that are recorded in a store where nothing was disturbed, taken in another store.
pub fn hold(undisturbed: &Path, store: &Path, name: &str, count: usize) -> Vec<Held> {
    let keys = records(undisturbed, name)
        .into_iter()
        .rev()
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned());
    let held: Vec<Held> = keys
        .take(count)
        .map(|key| held_locks::robot(store, name, &key))
        .collect();
    assert_eq!(held.len(), count);
    held
}

#[test]
fn a_fleet_killed_three_times_ends_as_an_undisturbed_one() {
    const ROBOTS: usize = 16;
    let line = Line::new(ROBOTS);
    std::fs::remove_file(line.recording("c0004").join("tracker.csv")).unwrap();
    let undisturbed = line.folder.path().join("undisturbed");
    run(&line.file, &undisturbed, 10);

    // Robots that nobody can take: no fleet is complete before it is killed, on however busy a machine.
    let held = hold(&undisturbed, &line.store, "line", 4);
    let mut stood: Vec<(PathBuf, std::time::SystemTime)> = Vec::new();
    for kill in 1..=3 {
        let mut child = fleet("run", &line.file, &line.store)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        held_locks::until(&mut child, || {
            records(&line.store, "line").len() >= kill * ROBOTS / 5
        });
        std::thread::sleep(Duration::from_millis(7 * kill as u64));
        child.kill().unwrap();
        child.wait().unwrap();
        // What stood before stands untouched.
        for (path, modified) in &stood {
            assert_eq!(path.metadata().unwrap().modified().unwrap(), *modified);
        }
        stood = records(&line.store, "line")
            .into_iter()
            .map(|path| (path.clone(), path.metadata().unwrap().modified().unwrap()))
            .collect();
        assert!(
            (kill * ROBOTS / 5..=ROBOTS - held.len()).contains(&stood.len()),
            "{} records",
            stood.len()
        );
    }
    drop(held);
    let answer = line.run(10);
    assert_eq!(
        answer["computed"].as_u64(),
        Some((ROBOTS - stood.len()) as u64)
    );
    for (path, modified) in &stood {
        assert_eq!(path.metadata().unwrap().modified().unwrap(), *modified);
    }
    assert_eq!(tables(&line.store, "line"), tables(&undisturbed, "line"));
    assert_eq!(line.run(10)["computed"].as_u64(), Some(0));
}

#[test]
fn two_runs_at_once_share_the_robots() {
    let line = Line::new(8);
    let start = || {
        let mut run = fleet("run", &line.file, &line.store);
        run.args(["--json", "--quiet", "-j", "1"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let computed = [start(), start()].map(|child| {
        let output = child.wait_with_output().unwrap();
        assert!(
            output.status.success(),
            "{}: {}",
            output.status,
            String::from_utf8_lossy(&output.stderr)
        );
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        answer["computed"].as_u64().unwrap()
    });
    assert_eq!(computed[0] + computed[1], 8, "{computed:?}");
}

/// An `sbatch` that runs the tasks of an array one after the other.
const SBATCH: &str = "#!/bin/sh\njob=$(mktemp)\ncat > \"$job\"\n\
    last=$(sed -n 's/^#SBATCH --array=0-\\([0-9]*\\).*/\\1/p' \"$job\")\n\
    for task in $(seq 0 \"$last\"); do\n  SLURM_ARRAY_JOB_ID=7 SLURM_ARRAY_TASK_ID=$task sh \"$job\" >&2 || exit 1\ndone\n\
    rm \"$job\"\necho 7\n";

#[test]
fn one_worker_two_processes_after_a_kill_and_tasks_of_a_cluster_give_equal_tables() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let gap = |robot: usize| match robot {
        3 => "[]".into(),
        _ => "[{backlash: {joint: 3, gap_arcsec: 12}}]".to_string(),
    };
    let file = twins(folder, "line", gap);
    let diagnose = |store: &Path, more: &[&str]| {
        let mut command = fleet("diagnose", &file, store);
        command.args(["--json", "--quiet", "-j", "1"]).args(more);
        command
    };
    let one = folder.join("one");
    let (result, printed) = output(&mut diagnose(&one, &[]));
    assert!(result.status.success(), "{printed}");
    let document: serde_json::Value = serde_json::from_slice(&result.stdout).unwrap();
    assert_eq!(document["findings"][0]["cell"], "backlash@joint 3");

    let two = folder.join("two");
    let start = || {
        let mut command = diagnose(&two, &[]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    };
    let mut killed = start();
    held_locks::until(&mut killed, || records(&two, "line").len() >= 3);
    killed.kill().unwrap();
    killed.wait().unwrap();
    let times = |paths: &[std::path::PathBuf]| -> Vec<_> {
        let time = |path: &std::path::PathBuf| path.metadata().unwrap().modified().unwrap();
        paths.iter().map(time).collect()
    };
    let stood = records(&two, "line");
    let before = times(&stood);
    for child in [start(), start()] {
        let result = child.wait_with_output().unwrap();
        assert!(result.status.success());
    }
    assert_eq!(times(&stood), before, "a robot was computed again");

    let cluster = folder.join("cluster");
    let sbatch = write(folder.join("bin/sbatch"), SBATCH);
    std::fs::set_permissions(&sbatch, Permissions::from_mode(0o755)).unwrap();
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", folder.join("bin").display());
    let (result, printed) = output(diagnose(&cluster, &["--engine", "slurm"]).env("PATH", path));
    assert!(result.status.success(), "{printed}");

    let undisturbed = tables(&one, "line");
    assert_eq!(undisturbed.len(), 3, "{undisturbed:?}");
    assert_eq!(tables(&two, "line"), undisturbed);
    assert_eq!(tables(&cluster, "line"), undisturbed);
}
