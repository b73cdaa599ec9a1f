//! The plan: a pipeline whose YAML is sound, whose settings are typed and whose tables are wired.
//!
//! Which stages of a plan a run may execute, and which it must even if they are cached.

use super::overrides::Override;
pub use super::spec::InputFile;
pub use super::wiring::Input;
use super::{spec, wiring};
use crate::error::{Error, Fault, Result};
use crate::raw;
use crate::stage::{ErasedStage, Port, StageEntry};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// A pipeline that can be run.
pub struct Plan {
    /// The YAML file as it was named.
    pub(crate) file: PathBuf,
    /// The YAML as it was read.
    pub(crate) text: String,
    /// Part of the paths of its tables.
    pub(crate) name: String,
    /// Every random number comes from it.
    pub(crate) seed: u64,
    /// In the order of the YAML; every stage comes after those it reads.
    pub stages: Vec<PlannedStage>,
    /// The YAML with variables and overrides filled in.
    pub(crate) resolved: serde_json::Value,
    /// Given on the command line.
    pub(crate) overrides: Vec<Override>,
}

/// A stage that is checked and wired.
pub struct PlannedStage {
    /// In the pipeline.
    pub(crate) id: String,
    /// Its kind.
    pub(crate) entry: &'static StageEntry,
    /// With its settings.
    pub stage: Box<dyn ErasedStage>,
    /// Raw files that it reads.
    pub files: Vec<InputFile>,
    /// Where its tables come from.
    pub(crate) inputs: Vec<Input>,
    /// Tables that it writes.
    pub(crate) outputs: Vec<Port>,
}

impl Plan {
    /// Letters of the longest id of a stage.
    pub(crate) fn width_of_ids(&self) -> usize {
        let ids = self.stages.iter().map(|stage| stage.id.len());
        ids.max().unwrap_or(0)
    }

    /// Reads a pipeline; fails with every fault at once.
    pub fn load(
        file: &Path,
        overrides: &[Override],
        stages: &'static [StageEntry],
    ) -> Result<Self> {
        let label = file.display().to_string();
        let text = raw::bytes(file).map_err(|error| {
            Error::spec(
                &label,
                if error.kind() == std::io::ErrorKind::NotFound {
                    "no such file".into()
                } else {
                    error.to_string()
                },
            )
        })?;
        let text = String::from_utf8(text)
            .map_err(|_| Error::spec(&label, "not a text file: expected YAML in UTF-8"))?;
        Self::parse(file, text, overrides, stages)
    }

    /// The same for a text that is already read.
    pub fn parse(
        file: &Path,
        text: String,
        overrides: &[Override],
        registry: &'static [StageEntry],
    ) -> Result<Self> {
        let label = file.display().to_string();
        let mut draft = spec::read(file, &text, overrides, registry);
        let mut inputs = Vec::new();
        for index in 0..draft.stages.len() {
            let (wired, mut troubles) = wiring::wire(&draft.stages, index, registry);
            troubles.extend(wiring::unknown(&draft.stages, index, &wired));
            inputs.push(wired);
            draft.troubles.extend(
                troubles
                    .into_iter()
                    .map(|trouble| trouble.below(&format!("stages[{index}]"))),
            );
        }
        let mut faults = draft.all_faults(&label);
        let mut stages = Vec::new();
        for (stage, inputs) in draft.stages.into_iter().zip(inputs) {
            if let (Some(entry), Some(body)) = (stage.entry, stage.stage) {
                let outputs = (entry.writes)();
                stages.push(PlannedStage {
                    id: stage.id,
                    entry,
                    stage: body,
                    files: stage.files,
                    inputs,
                    outputs,
                });
            } else if faults.is_empty() {
                faults.push(Fault::new(
                    &label,
                    format!("stage `{}` could not be read", stage.id),
                ));
            }
        }
        if !faults.is_empty() {
            return Err(Error::Spec(faults));
        }
        Ok(Self {
            file: file.into(),
            text,
            name: draft.name,
            seed: draft.seed,
            stages,
            resolved: draft.resolved,
            overrides: overrides.to_vec(),
        })
    }

    /// The plan of a stage and those that it reads from, directly or not.
    pub(crate) fn needed_for(self, stage: usize) -> Self {
        self.needed_for_all(&[stage])
    }

    /// The plan of some stages and those that they read from, directly or not.
    pub(crate) fn needed_for_all(mut self, stages: &[usize]) -> Self {
        let mut needed = vec![false; self.stages.len()];
        stages.iter().for_each(|stage| needed[*stage] = true);
        for at in (0..self.stages.len()).rev() {
            if needed[at] {
                let origins: Vec<usize> = self.stages[at]
                    .inputs
                    .iter()
                    .flat_map(|input| &input.from)
                    .map(|o| o.stage)
                    .collect();
                origins.into_iter().for_each(|origin| needed[origin] = true);
            }
        }
        let place: Vec<usize> = needed
            .iter()
            .scan(0, |next, needed| {
                Some(std::mem::replace(next, *next + usize::from(*needed)))
            })
            .collect();
        let mut at = 0;
        self.stages.retain(|_| {
            at += 1;
            needed[at - 1]
        });
        let origins = self
            .stages
            .iter_mut()
            .flat_map(|stage| &mut stage.inputs)
            .flat_map(|input| &mut input.from);
        origins.for_each(|origin| origin.stage = place[origin.stage]);
        self
    }

    /// The place of a stage, or what is allowed.
    pub(crate) fn find(&self, id: &str, option: &str) -> Result<usize> {
        self.stages
            .iter()
            .position(|stage| stage.id == id)
            .ok_or_else(|| {
                let ids: Vec<&str> = self.stages.iter().map(|stage| stage.id.as_str()).collect();
                let hint = crate::error::nearest(id, ids.iter().copied())
                    .map(|near| format!("; did you mean `{near}`?"));
                let message = format!(
                    "no stage `{id}`{} Allowed: {}",
                    hint.unwrap_or_else(|| ".".into()),
                    ids.join(", ")
                );
                Error::spec(option, message)
            })
    }
}

/// What the person asked for.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// This stage alone.
    pub(crate) only: Option<String>,
    /// This stage and those after it.
    pub(crate) from: Option<String>,
    /// Up to this stage.
    pub(crate) until: Option<String>,
    /// Run again though cached: all selected stages, or those named.
    pub(crate) force: Option<Vec<String>>,
}

/// The same with the plan's numbers.
#[derive(Debug, Clone)]
pub(super) struct Selected {
    pub(crate) stages: RangeInclusive<usize>,
    forced: Vec<usize>,
}

impl Selection {
    pub(super) fn of(&self, plan: &Plan) -> Result<Selected> {
        let last = plan.stages.len().saturating_sub(1);
        let place = |id: &Option<String>, option: &str| {
            id.as_deref().map(|id| plan.find(id, option)).transpose()
        };
        let stages = match place(&self.only, "--only")? {
            Some(only) => only..=only,
            None => {
                place(&self.from, "--from")?.unwrap_or(0)
                    ..=place(&self.until, "--until")?.unwrap_or(last)
            }
        };
        if stages.is_empty() {
            return Err(Error::spec(
                "--from, --until",
                "the stage of --until comes before that of --from",
            ));
        }
        let forced = match &self.force {
            None => Vec::new(),
            Some(ids) if ids.is_empty() => stages.clone().collect(),
            Some(ids) => ids
                .iter()
                .map(|id| plan.find(id, "--force"))
                .collect::<Result<_>>()?,
        };
        if let Some(outside) = forced.iter().find(|index| !stages.contains(index)) {
            let id = &plan.stages[*outside].id;
            return Err(Error::spec(
                "--force",
                format!("stage `{id}` is not among those that --only, --from and --until leave"),
            ));
        }
        Ok(Selected { stages, forced })
    }
}

impl Selected {
    pub(crate) fn forces(&self, index: usize) -> bool {
        self.forced.contains(&index)
    }
}
