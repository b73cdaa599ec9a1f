//! `calib check`: whether a pipeline can run: what is still to fill in and to look at, every fault at once, and with `--data` what a first fit says.

use super::execution_arguments::{CommandTask, ExecutionArguments};
use super::{emit, emit_lines};
use crate::error::{Error, Result, counted};
use crate::init::{MarkedLines, marked};
use crate::pipeline::{Plan, Purpose, Selection, look};
use crate::progress::Verbosity;
use crate::stage::{DeclaredStage, Identify};
use crate::summary::{first_look, graph, labelled};
use clap::Args;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Check whether a pipeline can run: what is left to fill in, what to look at, and every fault with its line.
///
/// The robot file is read, and the headers of the data files: columns that are mapped and not there are named. Exit code 2 for faults of
/// the YAML or of the robot file, 10 for those of the data files alone. Lines that `calib init` marked REPLACE (put your value there) or
/// CHECK (look at it) come first; they are no faults, and a run does not wait for them. `--data` reads the recording and fits base and
/// geometry to it: rows without partner, ranges, warnings of a wrong set-up, what will be observable.
#[derive(Args)]
#[command(after_help = "Examples:
  calib check pipelines/ur10/pipeline.yaml
  calib check pipelines/sr210d/pipeline.yaml --details
  calib check pipelines/case/pipeline.yaml --set case=recordings/robot-7 --data")]
pub(super) struct CheckArguments {
    /// The pipeline's YAML file
    #[arg(value_name = "PIPELINE")]
    pipeline: PathBuf,
    #[command(flatten)]
    means: ExecutionArguments,
    /// Reads the recording and fits base and geometry to it; what is computed is kept in the store, for the run
    #[arg(long)]
    data: bool,
    /// Prints the graph of stages and tables, too
    #[arg(long)]
    details: bool,
}

pub(super) fn main(arguments: &CheckArguments, command_line: &[OsString]) -> Result<()> {
    let plan = match arguments.means.plan(&arguments.pipeline) {
        Ok(plan) => plan,
        Err(error) => {
            emit_lines(&left(&[&arguments.pipeline]).1)?;
            return Err(error);
        }
    };
    let files = plan
        .stages
        .iter()
        .filter(|stage| stage.entry.name == "robot")
        .flat_map(|stage| &stage.files);
    let described: Vec<&Path> = files
        .map(|file| file.path.as_path())
        .chain([arguments.pipeline.as_path()])
        .collect();
    let (to_fill, marks) = left(&described);
    let seen = look(&plan);
    let mut text = marks;
    if let Ok(warnings) = &seen {
        text.extend(warnings.iter().map(|line| labelled("warning", line)));
    }
    emit_lines(&text)?;
    seen?;
    if arguments.details {
        emit(&graph(&plan))?;
    }
    let stages = counted(plan.stages.len(), "stage");
    emit_lines(&match to_fill {
        0 if arguments.means.overrides() || !arguments.means.store_again().is_empty() => {
            labelled("ready", &format!("{stages} can run"))
        }
        0 => labelled(
            "ready",
            &format!(
                "{stages} can run: calib run {}",
                arguments.pipeline.display()
            ),
        ),
        1 => labelled(
            "not yet",
            &format!("a line is left to fill in; {stages} are wired"),
        ),
        lines => labelled(
            "not yet",
            &format!("{lines} lines are left to fill in; {stages} are wired"),
        ),
    })?;
    if arguments.data {
        fitted(arguments, plan, command_line)
    } else {
        Ok(())
    }
}

/// How many lines are left to fill in, and all that are marked.
fn left(paths: &[&Path]) -> (usize, String) {
    let marks = marked(paths);
    let to_fill = marks
        .iter()
        .find(|kind| kind.label == "replace")
        .map_or(0, |kind| kind.lines.len());
    let one = |MarkedLines { label, what, lines }: &MarkedLines| {
        let head = labelled(label, &format!("{}: {what}", counted(lines.len(), "line")));
        lines.iter().fold(head, |text, (file, number, line)| {
            text + &labelled("", &format!("{file}:{number}: {line}"))
        })
    };
    (to_fill, marks.iter().map(one).collect())
}

/// Runs up to the last fit of base and geometry before anything else is computed, and says what is seen.
fn fitted(arguments: &CheckArguments, plan: Plan, command_line: &[OsString]) -> Result<()> {
    let fits = plan
        .stages
        .iter()
        .enumerate()
        .filter(|(_, stage)| stage.entry.name == Identify::NAME)
        .map(|(at, _)| at);
    let fits: Vec<usize> = fits.collect();
    if fits.is_empty() {
        let file = arguments.pipeline.display().to_string();
        return Err(Error::spec(
            file,
            "has no stage `identify`, and --data fits base and geometry; leave --data out",
        ));
    }
    let plan = plan.needed_for_all(&fits);
    let store = arguments.means.store()?;
    let task = CommandTask {
        purpose: Purpose::Diagnose,
        selection: Selection::default(),
        shown: Verbosity::Silent,
    };
    let outcome = arguments.means.run(&plan, &store, task, command_line)?;
    emit_lines(&first_look(&outcome.manifest, &store)?)
}
