//! A pipeline as it was understood: its stages, what they read and write.

use crate::error::counted;
use crate::pipeline::Plan;

/// Stages with their tables and files, as `calib check` prints them.
pub fn graph(plan: &Plan) -> String {
    let mut text = format!(
        "pipeline {}, seed {}, {}\n",
        plan.name,
        plan.seed,
        counted(plan.stages.len(), "stage")
    );
    for stage in &plan.stages {
        let uses = if stage.id == stage.entry.name {
            String::new()
        } else {
            format!(" (uses {})", stage.entry.name)
        };
        text.push_str(&format!("\n{}{uses}: {}\n", stage.id, stage.entry.summary));
        let width = stage
            .inputs
            .iter()
            .map(|input| input.port.name.len())
            .max()
            .unwrap_or(0);
        for input in &stage.inputs {
            let from = input.from.iter().map(|origin| {
                let writer = &plan.stages[origin.stage];
                format!("{}.{}", writer.id, writer.outputs[origin.port].name)
            });
            let from: Vec<String> = from.collect();
            let from = if from.is_empty() {
                "(none)".into()
            } else {
                from.join(", ")
            };
            text.push_str(&format!(
                "  reads   {:width$}  <- {from}\n",
                input.port.name
            ));
        }
        for file in &stage.files {
            text.push_str(&format!(
                "  file    {} = {}\n",
                file.place,
                file.path.display()
            ));
        }
        let outputs: Vec<String> = stage
            .outputs
            .iter()
            .map(|port| {
                if port.name == port.kind {
                    port.name.into()
                } else {
                    format!("{} ({})", port.name, port.kind)
                }
            })
            .collect();
        text.push_str(&format!("  writes  {}\n", outputs.join(", ")));
    }
    text
}
