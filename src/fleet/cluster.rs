//! Job files for clusters: arrays of tasks that each call `calib fleet exec`, which is all that a cluster ever runs.

use super::ledger::{Ledger, RunNote};
use crate::error::{Error, Fault, Result};
use crate::shell::quoted;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Slurm's default `MaxArraySize` is 1001: larger arrays are refused.
const ARRAY: usize = 1000;

/// What a cluster is asked for.
#[derive(Debug, Clone)]
pub(crate) struct ClusterOptions {
    /// The `calib` that the nodes run.
    pub(crate) program: PathBuf,
    /// Absolute, on storage that all nodes share.
    pub(crate) store: PathBuf,
    /// The partition of the cluster; its default if none.
    pub(crate) partition: Option<String>,
    pub(crate) max_parallel: Option<u32>,
    /// E.g. `2G`.
    pub(crate) memory: Option<String>,
    /// E.g. `00:30:00`.
    pub(crate) time: Option<String>,
    /// More options of sbatch, each a word.
    pub(crate) more: Vec<String>,
}

impl ClusterOptions {
    /// Everything that goes into a directive is a plain word: sbatch has no quoting that all its versions share.
    fn check(&self) -> Result<()> {
        let plain = |text: &str| {
            !text.is_empty()
                && text
                    .chars()
                    .all(|c| c.is_ascii_alphanumeric() || "_./-+=,:@".contains(c))
        };
        let store = self.store.to_string_lossy().into_owned();
        let words = [
            ("--partition", &self.partition),
            ("--mem", &self.memory),
            ("--time", &self.time),
        ];
        let words = words
            .into_iter()
            .filter_map(|(option, word)| Some((option, word.as_ref()?.clone())));
        let more = self.more.iter().map(|word| ("--sbatch-arg", word.clone()));
        let faults: Vec<Fault> = words
            .chain(more)
            .chain([("--store", store)])
            .filter(|(_, word)| !plain(word))
            .map(|(option, word)| {
                Fault::new(
                    option,
                    format!(
                        "{word:?}: allowed in a job file are letters, digits and _ . / - + = , : @"
                    ),
                )
            })
            .collect();
        Error::if_spec(faults)
    }
}

/// Where the tasks of a run say what they did.
pub(crate) fn logs(store: &Path, fleet: &str) -> PathBuf {
    store.join("fleets").join(fleet).join("logs")
}

/// The scripts of a run for `sbatch`, one an array.
pub(crate) fn slurm(note: &RunNote, options: &ClusterOptions) -> Result<Vec<String>> {
    options.check()?;
    let count = note.tasks.len();
    let scripts = (0..count).step_by(ARRAY).map(|first| {
        let tasks = ARRAY.min(count - first);
        let parallel = options.max_parallel.map(|most| format!("%{most}")).unwrap_or_default();
        let mut text = format!(
            "#!/bin/sh\n#SBATCH --job-name=calib-{}\n#SBATCH --array=0-{}{parallel}\n#SBATCH --ntasks=1\n#SBATCH --cpus-per-task=1\n\
             #SBATCH --requeue\n#SBATCH --open-mode=append\n#SBATCH --output={}/%A_%a.out\n",
            note.fleet,
            tasks - 1,
            logs(&options.store, &note.fleet).display()
        );
        for (option, word) in [("partition", &options.partition), ("mem", &options.memory), ("time", &options.time)] {
            if let Some(word) = word {
                text.push_str(&format!("#SBATCH --{option}={word}\n"));
            }
        }
        for word in &options.more {
            text.push_str(&format!("#SBATCH {word}\n"));
        }
        text.push_str(&format!(
            "exec {} fleet exec --store {} --fleet {} --run {} --task \"$((SLURM_ARRAY_TASK_ID + {first}))\"\n",
            quoted(&options.program.to_string_lossy()),
            quoted(&options.store.to_string_lossy()),
            quoted(&note.fleet),
            quoted(&note.run)
        ));
        text
    });
    Ok(scripts.collect())
}

/// An Indexed Job for Kubernetes. Experimental: rendered, never run here.
pub(crate) fn kubernetes(
    note: &RunNote,
    options: &ClusterOptions,
    image: &str,
    claim: &str,
) -> String {
    let yaml = crate::yaml::quoted;
    let name: String = format!("calib-{}-{}", note.fleet, note.run)
        .to_lowercase()
        .replace('_', "-")
        .chars()
        .take(63)
        .collect();
    let limit = options
        .memory
        .as_ref()
        .map(|memory| format!("            limits: {{memory: {}}}\n", yaml(memory)))
        .unwrap_or_default();
    format!(
        "# Experimental. Memory is in Kubernetes' own spelling, e.g. 2Gi.\n\
         apiVersion: batch/v1\nkind: Job\nmetadata:\n  name: {}\nspec:\n  completionMode: Indexed\n  completions: {}\n  parallelism: {}\n  \
         backoffLimitPerIndex: 3\n  template:\n    spec:\n      restartPolicy: Never\n      containers:\n        - name: calib\n          \
         image: {}\n          args: [fleet, exec, --store, {}, --fleet, {}, --run, {}, --task, $(JOB_COMPLETION_INDEX)]\n          \
         resources:\n            requests: {{cpu: \"1\"}}\n{limit}          volumeMounts:\n            - {{name: store, mountPath: {}}}\n      \
         volumes:\n        - name: store\n          persistentVolumeClaim: {{claimName: {}}}\n",
        yaml(&name),
        note.tasks.len(),
        options.max_parallel.unwrap_or(10),
        yaml(image),
        yaml(&options.store.to_string_lossy()),
        yaml(&note.fleet),
        yaml(&note.run),
        yaml(&options.store.to_string_lossy()),
        yaml(claim)
    )
}

/// Between two looks at the store.
const LOOK: Duration = Duration::from_secs(1);
/// Looks from one question to the scheduler to the next: it serves others too.
const LOOKS: u32 = 10;

/// Submits the arrays of a run and notes their ids. Fails where sbatch does.
pub(crate) fn submit(ledger: &Ledger, note: &mut RunNote, options: &ClusterOptions) -> Result<()> {
    let scripts = slurm(note, options)?;
    ledger.put_run(note)?;
    let folder = logs(&options.store, &note.fleet);
    std::fs::create_dir_all(&folder)
        .map_err(|error| Error::store(folder.display().to_string(), error.to_string()))?;
    for script in scripts {
        let answer = output_of("sbatch", &["--parsable"], Some(&script))?;
        // `id` or `id;cluster`.
        note.jobs.push(
            answer
                .trim()
                .split(';')
                .next()
                .unwrap_or_default()
                .to_string(),
        );
        ledger.put_run(note)?;
    }
    Ok(())
}

/// How a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Waited {
    /// Every robot is recorded.
    Complete,
    /// The scheduler has nothing left of the run, and robots are missing.
    Gone,
    /// Somebody asked for it.
    Stopped,
}

/// Waits until `missing` says 0. The scheduler is only asked whether it still has the jobs.
pub(crate) fn wait(
    jobs: &[String],
    mut missing: impl FnMut() -> Result<usize>,
    stop: &dyn Fn() -> bool,
) -> Result<Waited> {
    let (mut looks, mut empty) = (0, 0);
    loop {
        if missing()? == 0 {
            return Ok(Waited::Complete);
        }
        if stop() {
            return Ok(Waited::Stopped);
        }
        std::thread::sleep(LOOK);
        looks += 1;
        if looks % LOOKS == 0 {
            // A job that is long over is unknown to squeue, which then complains.
            let queued = output_of("squeue", &["--noheader", "--jobs", &jobs.join(",")], None)
                .unwrap_or_default();
            empty = if queued.trim().is_empty() {
                empty + 1
            } else {
                0
            };
            // Twice, so that records of the last task have time to show on shared storage.
            if empty >= 2 {
                return Ok(if missing()? == 0 {
                    Waited::Complete
                } else {
                    Waited::Gone
                });
            }
        }
    }
}

/// Takes the jobs of a run from the scheduler.
pub(crate) fn cancel(jobs: &[String]) -> Result<()> {
    let words: Vec<&str> = jobs.iter().map(String::as_str).collect();
    if words.is_empty() {
        Ok(())
    } else {
        output_of("scancel", &words, None).map(drop)
    }
}

/// Runs a program of Slurm, without a shell, and gives what it printed.
fn output_of(program: &str, words: &[&str], input: Option<&str>) -> Result<String> {
    let fault = |message: String| Error::store(program, message);
    let mut child = Command::new(program)
        .args(words)
        .stdin(if input.is_some() {
            Stdio::piped()
        } else {
            Stdio::null()
        })
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| {
            fault(format!(
                "cannot be started: {error}; is Slurm installed on this machine?"
            ))
        })?;
    if let (Some(input), Some(mut pipe)) = (input, child.stdin.take()) {
        pipe.write_all(input.as_bytes())
            .map_err(|error| fault(error.to_string()))?;
    }
    let output = child
        .wait_with_output()
        .map_err(|error| fault(error.to_string()))?;
    if !output.status.success() {
        return Err(fault(
            String::from_utf8_lossy(&output.stderr).trim().to_string(),
        ));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
