//! What a plan computes, as one hash: stages, settings, wiring and the content of the files; no paths, no dates.

use super::plan::Plan;
use super::run_state::RunState;
use super::services::label;
use crate::error::Result;
use crate::store::key::canonical;
use serde_json::json;

impl Plan {
    /// The hash of everything that the plan's tables depend on, as 64 hex digits. Reads every input file; fails where one cannot
    /// be read.
    pub fn identity(&self) -> Result<String> {
        let mut state = RunState::new(self);
        let mut stages = Vec::new();
        for stage in &self.stages {
            let mut files = Vec::new();
            for file in &stage.files {
                files.push(json!([
                    file.place,
                    label(&file.path),
                    state.hash(&file.path)?
                ]));
            }
            let origins = stage.inputs.iter().map(|input| {
                let from: Vec<_> = input
                    .from
                    .iter()
                    .map(|origin| (origin.stage, origin.port))
                    .collect();
                (input.port.name, from)
            });
            stages.push(json!({
                "id": stage.id, "stage": stage.entry.name, "implementation": stage.entry.implementation,
                "settings": stage.stage.settings(), "files": files, "reads": origins.collect::<Vec<_>>(),
            }));
        }
        let whole = json!({ "seed": self.seed, "stages": stages });
        Ok(blake3::hash(canonical(&whole).as_bytes())
            .to_hex()
            .to_string())
    }
}
