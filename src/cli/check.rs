//! `calib check`: reads and wires a pipeline and prints its graph, or every fault at once.

use super::emit;
use crate::error::{Result, counted};
use crate::pipeline::{Override, Plan};
use crate::raw;
use crate::stage::STAGES;
use clap::Args;
use std::path::{Path, PathBuf};

/// Check a pipeline: print the graph of its stages and tables, or every fault with its line.
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
    let marks: String = described.filter_map(marked).collect();
    emit(&(graph(&plan) + &marks))
}

/// A warning where lines are left that `calib init` marked for the user to fill in.
fn marked(path: &Path) -> Option<String> {
    let text = raw::text(path).ok()?;
    let lines = text.lines().filter(|line| line.split_once('#').is_some_and(|(_, comment)| comment.contains("REPLACE"))).count();
    let line = if lines == 1 { "a line is" } else { "lines are" };
    let path = path.display();
    (lines > 0)
        .then(|| format!("\nwarning: {path}: {lines} {line} still marked REPLACE; put your own there and delete the mark\n"))
}

fn graph(plan: &Plan) -> String {
    let mut text = format!("pipeline {}, seed {}, {}\n", plan.name, plan.seed, counted(plan.stages.len(), "stage"));
    for stage in &plan.stages {
        let uses = if stage.id == stage.entry.name { String::new() } else { format!(" (uses {})", stage.entry.name) };
        text.push_str(&format!("\n{}{uses}: {}\n", stage.id, stage.entry.summary));
        let width = stage.inputs.iter().map(|input| input.port.name.len()).max().unwrap_or(0);
        for input in &stage.inputs {
            let from = input.from.iter().map(|origin| {
                let writer = &plan.stages[origin.stage];
                format!("{}.{}", writer.id, writer.outputs[origin.port].name)
            });
            let from: Vec<String> = from.collect();
            let from = if from.is_empty() { "(none)".into() } else { from.join(", ") };
            text.push_str(&format!("  reads   {:width$}  <- {from}\n", input.port.name));
        }
        for file in &stage.files {
            text.push_str(&format!("  file    {} = {}\n", file.place, file.path.display()));
        }
        let outputs: Vec<String> = stage
            .outputs
            .iter()
            .map(|port| if port.name == port.kind { port.name.into() } else { format!("{} ({})", port.name, port.kind) })
            .collect();
        text.push_str(&format!("  writes  {}\n", outputs.join(", ")));
    }
    text
}
