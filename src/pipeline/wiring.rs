//! Which earlier table each input port is fed from: by kind, or as `reads` options.
//!
//! Sets that a stage names and no split deals rows to, as far as the settings alone say it.

use super::spec::{PortSources, StageDraft};
use crate::error::{instead, nearest};
use crate::stage::{Arity, Port, StageEntry};
use crate::yaml::Trouble;

/// An output port of an earlier stage, both counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Origin {
    /// Position in the plan.
    pub(crate) stage: usize,
    /// Position among its outputs.
    pub(crate) port: usize,
}

/// An input port with the tables that feed it, in pipeline order.
#[derive(Debug, Clone)]
pub struct Input {
    /// What is read.
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
            let hint = nearest(name, names.iter().copied())
                .map(|near| format!("; did you mean `{near}`?"));
            let hint = hint.unwrap_or_else(|| ".".into());
            let message = format!(
                "stage `{}` has no input `{name}`{hint} Allowed: {}",
                entry.name,
                list(&names)
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
                let writers: Vec<&str> =
                    registry.iter().filter(|entry| writes(entry, port.kind)).map(|entry| entry.name).collect();
                troubles.push(
                    Trouble::new(format!(
                        "stage `{}` reads a `{}` table and no stage before it writes one; put one of these before it: {}",
                        stage.id,
                        port.kind,
                        list(&writers)
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
    for name in &wish.names {
        match find(stages, index, port, name) {
            Ok(Some(origin)) => origins.push(origin),
            Ok(None) => {}
            Err(message) => troubles.push(
                Trouble::new(message)
                    .at(wish.mark)
                    .below(&format!("reads.{}", port.name)),
            ),
        }
    }
    if port.arity != Arity::Every && wish.names.len() != 1 {
        let message = format!(
            "input `{}` takes one table; found {} names",
            port.name,
            wish.names.len()
        );
        troubles.push(
            Trouble::new(message)
                .at(wish.mark)
                .below(&format!("reads.{}", port.name)),
        );
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
        let hint = nearest(id, ids.clone())
            .map(|near| format!("; did you mean `{near}`?"))
            .unwrap_or_else(|| ".".into());
        return Err(format!(
            "no stage `{id}`{hint} Allowed: {}",
            list(&ids.collect::<Vec<_>>())
        ));
    };
    if stage >= index {
        let own = if stage == index {
            "is this stage itself"
        } else {
            "comes later"
        };
        return Err(format!(
            "`{id}` {own}, which would be a cycle; a stage reads from stages before it"
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
            let written: Vec<String> = outputs
                .iter()
                .map(|output| format!("{} ({})", output.name, output.kind))
                .collect();
            let written: Vec<&str> = written.iter().map(String::as_str).collect();
            Err(format!(
                "`{name}` is no `{}` table; stage `{id}` writes: {}",
                port.kind,
                list(&written)
            ))
        }
    }
}

fn writes(entry: &StageEntry, kind: &str) -> bool {
    (entry.writes)().iter().any(|port| port.kind == kind)
}
fn list(names: &[&str]) -> String {
    if names.is_empty() {
        "(none)".into()
    } else {
        names.join(", ")
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
