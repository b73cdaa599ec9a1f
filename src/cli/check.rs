//! `calib check`: reads and wires a pipeline, reads its robot file and the headers of its data, and prints its graph, or every fault at once.

use super::emit;
use crate::error::{Result, counted};
use crate::pipeline::{Override, Plan, look};
use crate::raw;
use crate::stage::STAGES;
use clap::Args;
use std::path::{Path, PathBuf};

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
    let marks: String = described.flat_map(|path| MARKS.map(|mark| marked(path, mark))).collect();
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

/// What `calib init` writes behind lines to look at, and what is to be done there.
const MARKS: [(&str, &str); 2] =
    [("REPLACE", "put your own there and delete the mark"), ("CHECK", "look whether it is so and delete the mark")];

/// A warning where lines are left that `calib init` marked, with the lines. A line that is a comment all over sets nothing.
fn marked(path: &Path, (mark, what): (&str, &str)) -> String {
    let text = raw::text(path).unwrap_or_default();
    let has_mark = |line: &str| line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').any(|word| word == mark);
    let counts = |line: &str| !line.trim_start().starts_with('#') && has_mark(line);
    let lines: Vec<(usize, &str)> = (1..).zip(text.lines()).filter(|(_, line)| counts(line)).collect();
    if lines.is_empty() {
        return String::new();
    }
    let many = if lines.len() == 1 { "a line is".into() } else { format!("{} lines are", lines.len()) };
    let mut out = format!("\nwarning: {}: {many} still marked {mark}; {what}\n", path.display());
    lines.iter().for_each(|(number, line)| out.push_str(&format!("  {number}: {}\n", line.trim())));
    out
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
