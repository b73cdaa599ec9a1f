//! `calib check`: reads and wires a pipeline, reads its robot file and the headers of its data, and prints its graph, or every fault at once.

use super::emit;
use crate::error::Result;
use crate::init::marked;
use crate::pipeline::{Override, Plan, look};
use crate::stage::STAGES;
use crate::summary::graph;
use clap::Args;
use std::path::PathBuf;

/// Check a pipeline: print the graph of its stages and tables, or every fault with its line.
///
/// The robot file is read, and the headers of the data files: columns that are mapped and not there are named. Exit code 2 for faults of
/// the YAML or of the robot file, 10 for those of the data files alone. Lines that `calib init` marked CHECK (look at it) or REPLACE (put
/// your own there) are listed behind the graph; they are no faults, and a run does not wait for them.
#[derive(Args)]
#[command(after_help = "Examples:
  calib check pipelines/ur10/pipeline.yaml
  calib check pipelines/case/pipeline.yaml --set case=recordings/robot-7")]
pub(super) struct CheckArguments {
    /// The pipeline's YAML file
    #[arg(value_name = "PIPELINE")]
    pipeline: PathBuf,
    /// Overrides a variable, the seed, or a setting of a stage; may be given several times
    #[arg(long, value_name = "TARGET=VALUE", value_parser = Override::parse)]
    set: Vec<Override>,
}

pub(super) fn main(arguments: &CheckArguments) -> Result<()> {
    let plan = Plan::load(&arguments.pipeline, &arguments.set, STAGES)?;
    let files = plan.stages.iter().filter(|stage| stage.entry.name == "robot").flat_map(|stage| &stage.files);
    let described = files.map(|file| file.path.as_path()).chain(std::iter::once(arguments.pipeline.as_path()));
    let marks: String = described.map(marked).collect();
    match look(&plan) {
        Ok(warnings) => {
            let warnings: String = warnings.iter().map(|line| format!("\nwarning: {line}\n")).collect();
            emit(&(graph(&plan) + &warnings + &marks))
        }
        Err(error) => {
            emit(marks.trim_start_matches('\n'))?;
            Err(error)
        }
    }
}
