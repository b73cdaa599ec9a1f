//! The Slurm engine: submits arrays, looks at the store until every robot is recorded, and submits the missing again.

use super::cluster::{ClusterOptions, logs, slurm};
use super::ledger::{Ledger, RunNote};
use crate::error::{Error, Result};
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

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
