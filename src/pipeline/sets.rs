//! Sets that a stage names and no split deals rows to, as far as the settings alone say it.

use super::spec::StageDraft;
use super::wiring::Input;
use crate::error::instead;
use crate::yaml::Trouble;

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
