//! `calib simulate`: recordings of a robot whose truth is known.
//!
//! `calib simulate record`: a pipeline's twin as the files that a user has.

use crate::cli::surroundings::{cores, open_store, surroundings};
use crate::cli::{emit, emit_json};
use crate::error::{Error, Result, counted};
use crate::pipeline::{CompletedRun, Override, Plan, Purpose, RunOptions, Selection, run};
use crate::progress::{Progress, Verbosity};
use crate::proof::{recorded, vacant};
use crate::stage::{DeclaredStage, STAGES, Simulate};
use crate::store::Store;
use crate::table::{Recording, Robot, Table, Truth};
use clap::{Args, Subcommand};
use serde_json::json;
use std::ffi::OsString;
use std::path::PathBuf;

mod conceal;
mod prove;

/// Make recordings of a simulated robot: with stated or hidden effects; and mark what a diagnosis made of them.
#[derive(Args)]
pub(super) struct SimulateArguments {
    #[command(subcommand)]
    verb: SimulateVerb,
}

#[derive(Subcommand)]
enum SimulateVerb {
    Record(RecordArguments),
    Conceal(conceal::ConcealArguments),
    Reveal(prove::RevealArguments),
    Prove(prove::ProveArguments),
}

impl SimulateArguments {
    pub fn run(&self, command_line: &[OsString]) -> Result<()> {
        match &self.verb {
            SimulateVerb::Record(verb) => verb.run(command_line),
            SimulateVerb::Conceal(verb) => verb.run(),
            SimulateVerb::Reveal(verb) => verb.run(),
            SimulateVerb::Prove(verb) => verb.run(),
        }
    }
}

/// Record an experiment on a robot with stated effects.
///
/// Runs the stage `simulate` of a pipeline and what it needs, and writes what a user of that robot would have: robot.json,
/// controller.csv and tracker.csv, or of a ball at fixtures a file of joints under the name of each; and next to them truth.csv with every
/// true number. Joints and points keep 9 decimals, joints at fixtures 12.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate record pipelines/sr210d/pipeline.yaml --out sr210d
  calib simulate record twin.yaml --out monday --set seed=7 --set simulate.remainder=none")]
pub(crate) struct RecordArguments {
    /// The pipeline's YAML file, with a stage `simulate`
    #[arg(value_name = "PIPELINE")]
    pipeline: PathBuf,
    /// The folder to make; it must not exist, or be empty
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// Overrides a variable, the seed, or a setting of a stage; may be given several times
    #[arg(long, value_name = "TARGET=VALUE", value_parser = Override::parse)]
    set: Vec<Override>,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Prints no progress
    #[arg(long, short)]
    quiet: bool,
}

impl RecordArguments {
    pub fn run(&self, command_line: &[OsString]) -> Result<()> {
        let place = self.pipeline.display().to_string();
        let plan = Plan::load(&self.pipeline, &self.set, STAGES)?;
        let stage = plan
            .stages
            .iter()
            .position(|stage| stage.entry.name == Simulate::NAME);
        let Some(stage) = stage else {
            return Err(Error::spec(place, "has no stage `simulate`"));
        };
        vacant(&self.out)?;
        let plan = plan.needed_for(stage);
        let moves = plan
            .stages
            .last()
            .is_some_and(|stage| stage.stage.settings().get("motion").is_some());
        let store = open_store(self.store.as_deref())?;
        let verbosity = if self.quiet {
            Verbosity::Quiet
        } else {
            Verbosity::Normal
        };
        let progress = Progress::new(verbosity, plan.width_of_ids());
        let options = RunOptions {
            selection: Selection::default(),
            jobs: cores(),
            purpose: Purpose::Simulate,
        };
        let result = run(
            &plan,
            &store,
            &options,
            &surroundings(command_line),
            &progress,
        );
        progress.finish();
        let outcome = result?;
        let robot = table::<Robot>(&outcome, &store)?.to_description()?;
        let (recording, truth): (Recording, Truth) =
            (table(&outcome, &store)?, table(&outcome, &store)?);
        let rows = recording.rows();
        let files = recorded(&robot, recording, &truth, moves)
            .map_err(|fault| Error::spec(&place, fault))?;
        let fault =
            |error: std::io::Error| Error::store(self.out.display().to_string(), error.to_string());
        std::fs::create_dir_all(&self.out).map_err(fault)?;
        for (name, text) in files {
            let file = self.out.join(name);
            file.parent()
                .map_or(Ok(()), std::fs::create_dir_all)
                .map_err(fault)?;
            std::fs::write(file, text).map_err(fault)?;
        }
        if self.json {
            return emit_json(
                &json!({ "folder": self.out.to_string_lossy(), "points": rows, "true_numbers": truth.0.len() }),
            );
        }
        emit(&format!(
            "{}, {}: {}\n",
            counted(rows, "point"),
            counted(truth.0.len(), "true number"),
            self.out.display()
        ))
    }
}

fn table<T: Table>(outcome: &CompletedRun, store: &Store) -> Result<T> {
    let last = outcome.manifest.tables(T::KIND).last();
    let output =
        last.ok_or_else(|| Error::Bug(format!("a simulation without a table {}", T::KIND)))?;
    T::from_frame(&store.load(&output.table)?)
}
