//! A fleet's diagnosis has the same tables whoever computes it: one worker, two processes of which one is killed, tasks of a cluster.

use super::causes::twins;
use super::killed::records;
use super::{fleet, output, tables, write};
use crate::held_locks;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Stdio;

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
