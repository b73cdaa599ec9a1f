//! `calib simulate prove`: conceals, has every recording diagnosed by a process that sees nothing else, and reveals.
//!
//! `calib simulate reveal`: checks the seal, opens the truths, and marks what a diagnosis said.

use super::super::surroundings::program;
use super::super::{emit, emit_json};
use super::{ConcealArguments, design};
use crate::error::{Error, Result, counted};
use crate::estimate::threads::in_order;
use crate::proof::{self, LEFT_OUT, RECORDINGS, SEAL, SEALED, Seal, board, write_scoreboard};
use crate::summary::scoreboard;
use crate::twin::reveal::board::Board;
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Prove a diagnosis: conceal effects, diagnose every recording blind, reveal the truth and mark.
///
/// Makes the recordings as `conceal` does, runs `calib diagnose PIPELINE --set case=DIR/recordings/CASE --json` for each in a
/// process of its own, keeps what it says in DIR/verdicts, and prints what `reveal` prints. Given again after an interruption
/// it goes on with what is not yet diagnosed. With --left-out every recording of one listed cause is diagnosed a second time with that
/// cause taken out of the list, and marked as physics that nobody listed.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate prove --out proof --seed 7 --cases 60 --nulls 0.2 --pairs 0.2 --open 0.1
  calib simulate prove --out gears --cases 30 --family gear_cyclic,gear_motor_cyclic --json > score.json
  calib simulate prove --out open --seed 7 --cases 60 --natural 0 --left-out
  calib simulate prove --out foreign --seed 7 --cases 60 --foreign 1 --faulty 0
  calib simulate prove --out further --seed 7 --cases 300 --families beyond
  calib simulate prove --out moving --seed 7 --cases 60 --dynamics --nulls 0.2 --pairs 0.2 --open 0.1
  calib simulate prove --out servos --seed 7 --cases 60 --drives --nulls 0.2 --pairs 0.2 --open 0.1")]
pub(super) struct ProveArguments {
    #[command(flatten)]
    conceal: ConcealArguments,
    /// The pipeline with a stage that diagnoses and a variable `case` [default: pipelines/case/pipeline.yaml; of torques
    /// pipelines/dynamics/pipeline.yaml, of drives pipelines/drives/pipeline.yaml]
    #[arg(long, value_name = "PIPELINE")]
    pipeline: Option<PathBuf>,
    /// Diagnoses every recording of one listed cause without that cause, too: `diagnose.without` of the pipeline is set
    #[arg(long, conflicts_with_all = ["dynamics", "drives"])]
    left_out: bool,
    /// Prints no progress
    #[arg(long, short)]
    quiet: bool,
}

const VERDICTS: &str = "verdicts";

impl ProveArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let (design, folder) = (design(&self.conceal)?, &self.conceal.out);
        let usual = match (design.dynamics, design.drives) {
            (true, _) => "pipelines/dynamics/pipeline.yaml",
            (_, true) => "pipelines/drives/pipeline.yaml",
            _ => "pipelines/case/pipeline.yaml",
        };
        let pipeline = self.pipeline.clone().unwrap_or_else(|| usual.into());
        if !pipeline.is_file() {
            let message = format!("no such file: {}", pipeline.display());
            return Err(Error::spec("--pipeline", message));
        }
        if folder.join(SEAL).is_file() {
            if !Seal::read(folder)?.is_of(&design) {
                let message = "holds a set made with other options; name a new folder, or give the same options";
                return Err(Error::spec(folder.display().to_string(), message));
            }
        } else {
            proof::vacant(folder)?;
            proof::conceal(folder, &design, self.conceal.threads())?;
        }
        // Before anything is diagnosed, and again before anything is revealed: a diagnosis must not have touched the truth.
        let sealed = Seal::check(folder)?;
        let names: Vec<String> = sealed.iter().filter_map(|name| case(name)).collect();
        let verdicts = folder.join(VERDICTS);
        let store =
            |error: std::io::Error| Error::store(verdicts.display().to_string(), error.to_string());
        std::fs::create_dir_all(&verdicts).map_err(store)?;
        let program = program().map_err(store)?;
        let blind = BlindDiagnosis {
            program: &program,
            pipeline: &pipeline,
            folder,
        };
        let diagnose = |number: usize| -> Result<()> {
            let name = &names[number];
            let tell = |line: &str| {
                if !self.quiet {
                    let _ = writeln!(std::io::stderr(), "{name}: {line}");
                }
            };
            tell(&blind.diagnose(name, &verdicts, None)?);
            let truth = folder.join(SEALED).join(format!("{name}.json"));
            let cause = self.left_out.then(|| proof::single_cause(&truth));
            if let Some(cause) = cause.transpose()?.flatten() {
                let verdicts = verdicts.join(LEFT_OUT);
                std::fs::create_dir_all(&verdicts).map_err(store)?;
                let verdict = blind.diagnose(name, &verdicts, Some(&cause))?;
                tell(&format!("without its cause: {verdict}"));
            }
            Ok(())
        };
        let diagnosed = in_order(self.conceal.threads(), names.len(), diagnose);
        diagnosed.into_iter().collect::<Result<()>>()?;
        let sealed = Seal::check(folder)?;
        let board = board(folder, &sealed, &verdicts)?;
        show(&board, sealed.len(), self.conceal.json)
    }
}

/// Prints a scoreboard after a seal of so many files held.
fn show(board: &Board, sealed: usize, json: bool) -> Result<()> {
    let document = board.document();
    if json {
        return emit_json(&document);
    }
    emit(&format!(
        "the seal holds: {}, all as they were\n{}",
        counted(sealed, "file"),
        scoreboard(&document, &board.details())
    ))
}

/// The case that a sealed truth is of.
fn case(name: &str) -> Option<String> {
    let path = Path::new(name);
    let stem = path.starts_with(SEALED).then(|| path.file_stem())??;
    Some(stem.to_string_lossy().into_owned())
}

/// Diagnoses by processes of their own, which see a recording and nothing else of its set.
struct BlindDiagnosis<'a> {
    program: &'a Path,
    pipeline: &'a Path,
    folder: &'a Path,
}

impl BlindDiagnosis<'_> {
    /// Has one recording diagnosed, without one cause if it is named, and keeps the verdict; gives a line about it. Fails where the process
    /// cannot be started.
    fn diagnose(&self, name: &str, verdicts: &Path, without: Option<&str>) -> Result<String> {
        let verdict = verdicts.join(format!("{name}.json"));
        if verdict.is_file() {
            return Ok("diagnosed before".into());
        }
        let fault =
            |error: std::io::Error| Error::store(verdict.display().to_string(), error.to_string());
        // A variable of a pipeline is relative to its file.
        let recording =
            std::path::absolute(self.folder.join(RECORDINGS).join(name)).map_err(fault)?;
        let tables = verdicts.join(name).with_extension("store");
        let mut command = Command::new(self.program);
        command.arg("diagnose").arg(self.pipeline);
        command.args(["--set", &format!("case={}", recording.display())]);
        if let Some(cause) = without {
            command.args(["--set", &format!("diagnose.without=[{cause}]")]);
        }
        command.args(["--json", "--quiet", "--jobs", "1", "--store"]);
        command.arg(&tables).stdin(Stdio::null());
        let done = command.output().map_err(fault)?;
        let _ = std::fs::remove_dir_all(&tables);
        if !done.status.success() {
            let why = String::from_utf8_lossy(&done.stderr);
            let why = why.lines().next().unwrap_or("the process failed");
            return Ok(format!("no verdict: {why}"));
        }
        // Renamed when whole: an interruption leaves no half verdict.
        let part = verdict.with_extension("part");
        let written = std::fs::write(&part, &done.stdout);
        let renamed = written.and_then(|()| std::fs::rename(&part, &verdict));
        renamed.map_err(fault)?;
        let answer: Option<serde_json::Value> = serde_json::from_slice(&done.stdout).ok();
        let stated = answer
            .as_ref()
            .and_then(|answer| answer.get("verdict")?.as_str());
        let message = stated.unwrap_or("a verdict that is no JSON");
        Ok(message.chars().filter(|c| !c.is_control()).collect())
    }
}

/// Open the sealed truths and mark diagnoses.
///
/// Every file of DIR is held against seal.json first; one changed byte and nothing is revealed. VDIR/CASE.json is what
/// `calib diagnose --json` printed for DIR/recordings/CASE. L is the squared displacement that geometry cannot absorb over the
/// noise's variance: from about 15 an effect is detectable, from 50 it should be named.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate reveal blind --verdicts blind/verdicts
  calib simulate reveal blind --verdicts blind/verdicts --out scoreboard.parquet --json > score.json")]
pub(super) struct RevealArguments {
    /// The folder that `conceal` made
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The folder of verdicts, CASE.json each
    #[arg(long, value_name = "VDIR")]
    verdicts: PathBuf,
    /// Writes one row per concealed effect as Parquet (table `scoreboard`)
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl RevealArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let sealed = Seal::check(&self.folder)?;
        let board = board(&self.folder, &sealed, &self.verdicts)?;
        if let Some(path) = &self.out {
            write_scoreboard(path, &board)?;
        }
        show(&board, sealed.len(), self.json)
    }
}
