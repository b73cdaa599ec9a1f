//! The plan: a pipeline whose YAML is sound, whose settings are typed and whose tables are wired.
//!
//! Which earlier table each input port is fed from: by kind, or as `reads` options.

use crate::error::{Error, Fault, Result, instead, listed, suggestion};
use crate::pipeline::overrides::Override;
use crate::pipeline::spec;
pub use crate::pipeline::spec::InputFile;
use crate::pipeline::spec::{PortSources, StageDraft};
use crate::raw;
use crate::stage::{Arity, ErasedStage, Port, StageEntry};
use crate::yaml::Trouble;
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
    pub(crate) id: String,
    pub(crate) entry: &'static StageEntry,
    /// With its settings.
    pub stage: Box<dyn ErasedStage>,
    /// Raw files that it reads.
    pub files: Vec<InputFile>,
    /// Where its tables come from.
    pub(crate) inputs: Vec<Input>,
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
        let text = raw::text(file);
        let text = text.map_err(|error| Error::spec(label, spec::unreadable_text(&error)))?;
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
            let (wired, mut troubles) = wire(&draft.stages, index, registry);
            troubles.extend(unknown(&draft.stages, index, &wired));
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
                Error::spec(option, format!("no stage `{id}`{}", instead(id, &ids)))
            })
    }
}

/// What the person asked for.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    pub(crate) only: Option<String>,
    /// This stage and those after it.
    pub(crate) from: Option<String>,
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

/// An output port of an earlier stage, both counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Origin {
    pub(crate) stage: usize,
    pub(crate) port: usize,
}

/// An input port with the tables that feed it, in pipeline order.
#[derive(Debug, Clone)]
pub struct Input {
    pub(crate) port: Port,
    /// Who writes it; several where every one is read.
    pub(crate) from: Vec<Origin>,
}

/// Wires one stage to the stages before it; all faults at once.
pub(super) fn wire(
    stages: &[StageDraft],
    index: usize,
    registry: &[StageEntry],
) -> (Vec<Input>, Vec<Trouble>) {
    let stage = &stages[index];
    let Some(entry) = stage.entry else {
        return (Vec::new(), Vec::new());
    };
    let ports = (entry.reads)();
    let mut troubles = Vec::new();
    for (name, wish) in &stage.reads {
        if !ports.iter().any(|port| port.name == name) {
            let names: Vec<&str> = ports.iter().map(|port| port.name).collect();
            let hint = suggestion(name, names.iter().copied());
            let message = format!(
                "stage `{}` has no input `{name}`{hint} Allowed: {}",
                entry.name,
                list(names)
            );
            troubles.push(
                Trouble::new(message)
                    .at(wish.mark)
                    .below(&format!("reads.{name}")),
            );
        }
    }
    let inputs = ports
        .into_iter()
        .map(|port| {
            let from = match stage.reads.get(port.name) {
                Some(wish) => wished(stages, index, port, wish, &mut troubles),
                None => by_kind(&stages[..index], port),
            };
            // A stage that is not known may write anything: its own fault is enough.
            let blind = stages[..index].iter().any(|stage| stage.entry.is_none());
            if from.is_empty() && port.arity == Arity::One && !blind && !stage.reads.contains_key(port.name) {
                let writers = registry.iter().filter(|entry| writes(entry, port.kind));
                troubles.push(
                    Trouble::new(format!(
                        "stage `{}` reads a `{}` table and no stage before it writes one; put one of these before it: {}",
                        stage.id,
                        port.kind,
                        list(writers.map(|entry| entry.name))
                    ))
                    .at(stage.mark),
                );
            }
            Input { port, from }
        })
        .collect();
    (inputs, troubles)
}

fn by_kind(earlier: &[StageDraft], port: Port) -> Vec<Origin> {
    let mut origins = Vec::new();
    for (stage, draft) in earlier.iter().enumerate() {
        let Some(entry) = draft.entry else { continue };
        let outputs = (entry.writes)();
        let matching = || {
            outputs
                .iter()
                .enumerate()
                .filter(|(_, output)| output.kind == port.kind)
        };
        match port.arity {
            Arity::Every => origins.extend(matching().map(|(port, _)| Origin { stage, port })),
            // Where several outputs are of one kind, the one that bears the kind's name is read.
            Arity::One | Arity::Optional => {
                let best = matching()
                    .find(|(_, output)| output.name == port.kind)
                    .or_else(|| matching().next_back());
                if let Some((port, _)) = best {
                    origins = vec![Origin { stage, port }];
                }
            }
        }
    }
    origins
}

fn wished(
    stages: &[StageDraft],
    index: usize,
    port: Port,
    wish: &PortSources,
    troubles: &mut Vec<Trouble>,
) -> Vec<Origin> {
    let mut origins = Vec::new();
    let place = format!("reads.{}", port.name);
    let mut fault = |message| troubles.push(Trouble::new(message).at(wish.mark).below(&place));
    for name in &wish.names {
        match find(stages, index, port, name) {
            Ok(origin) => origins.extend(origin),
            Err(message) => fault(message),
        }
    }
    if port.arity != Arity::Every && wish.names.len() != 1 {
        fault(format!(
            "input `{}` takes one table; found {} names",
            port.name,
            wish.names.len()
        ));
    }
    origins.sort_by_key(|origin| (origin.stage, origin.port));
    origins
}

/// The output that `stage` or `stage.port` names; nothing where the stage has a fault of its own.
fn find(
    stages: &[StageDraft],
    index: usize,
    port: Port,
    name: &str,
) -> Result<Option<Origin>, String> {
    let (id, output) = name
        .split_once('.')
        .map_or((name, None), |(id, output)| (id, Some(output)));
    let Some(stage) = stages.iter().position(|stage| stage.id == id) else {
        let ids = stages[..index].iter().map(|stage| stage.id.as_str());
        let hint = suggestion(id, ids.clone());
        return Err(format!("no stage `{id}`{hint} Allowed: {}", list(ids)));
    };
    if stage >= index {
        let stage_id = if stage == index {
            "is this stage itself"
        } else {
            "comes later"
        };
        return Err(format!(
            "`{id}` {stage_id}, which would be a cycle; a stage reads from stages before it"
        ));
    }
    let Some(entry) = stages[stage].entry else {
        return Ok(None);
    };
    let outputs = (entry.writes)();
    let fits = |candidate: &&Port| {
        candidate.kind == port.kind && output.is_none_or(|output| candidate.name == output)
    };
    let best = outputs
        .iter()
        .filter(fits)
        .find(|candidate| candidate.name == port.kind)
        .or_else(|| outputs.iter().rfind(fits));
    match best.and_then(|best| outputs.iter().position(|candidate| candidate == best)) {
        Some(port) => Ok(Some(Origin { stage, port })),
        None => {
            let written = outputs
                .iter()
                .map(|output| format!("{} ({})", output.name, output.kind));
            Err(format!(
                "`{name}` is no `{}` table; stage `{id}` writes: {}",
                port.kind,
                list(written)
            ))
        }
    }
}

fn writes(entry: &StageEntry, kind: &str) -> bool {
    (entry.writes)().iter().any(|port| port.kind == kind)
}
fn list<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let mut names = names.into_iter().peekable();
    match names.peek() {
        Some(_) => listed(names),
        None => "(none)".into(),
    }
}

/// The kind of the tables that deal rows to sets.
const KIND: &str = "split";

/// The names of sets in the settings of a stage that is wired to `inputs` which cannot be right.
pub(super) fn unknown(stages: &[StageDraft], index: usize, inputs: &[Input]) -> Vec<Trouble> {
    let stage = &stages[index];
    let Some(dealt) = dealt(&stages[..index], inputs) else {
        return Vec::new();
    };
    let names: Vec<&str> = dealt.iter().map(String::as_str).collect();
    let wrong = stage
        .sets
        .iter()
        .filter(|set| !names.contains(&set.name.as_str()));
    let troubles = wrong.map(|set| {
        let allowed = instead(&set.name, &names);
        let message = if set.given {
            format!("no set `{}` in the split{allowed}", set.name)
        } else {
            format!(
                "not given, which means `{}`: no set of the split{allowed}",
                set.name
            )
        };
        Trouble::new(message).at(set.mark).below(&set.place)
    });
    troubles.collect()
}

/// The sets of the split that a stage reads, of one that reads none those of all splits before it; none where only the data say them.
fn dealt(earlier: &[StageDraft], inputs: &[Input]) -> Option<Vec<String>> {
    let splits: Vec<usize> = match inputs.iter().find(|input| input.port.kind == KIND) {
        Some(input) => input.from.iter().map(|origin| origin.stage).collect(),
        None => (0..earlier.len())
            .filter(|stage| deals(&earlier[*stage]))
            .collect(),
    };
    // Without a split the wiring has its say, and a stage that is not known may be one.
    if splits.is_empty() || earlier.iter().any(|stage| stage.entry.is_none()) {
        return None;
    }
    let mut sets = Vec::new();
    for split in splits {
        sets.extend(earlier.get(split)?.stage.as_ref()?.sets_dealt()?);
    }
    sets.sort_unstable();
    sets.dedup();
    Some(sets)
}

fn deals(stage: &StageDraft) -> bool {
    stage
        .entry
        .is_some_and(|entry| (entry.writes)().iter().any(|port| port.kind == KIND))
}
