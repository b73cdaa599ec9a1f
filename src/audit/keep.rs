//! What a sweep must leave: the actions of tagged runs and of fleets', of the last runs of every pipeline, and of runs that did not end.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::Result;
use crate::pipeline::{Manifest, RunStatus};
use crate::store::Store;

/// Ids of all actions that tagged runs and the `last` runs of every pipeline used. A manifest that cannot be read stops a sweep:
/// nobody knows what it keeps.
pub fn kept_actions(store: &Store, last: usize) -> Result<BTreeSet<String>> {
    let mut tagged: BTreeSet<String> = store.tags()?.into_values().collect();
    tagged.extend(store.runs_of_fleets()?);
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let mut keep = BTreeSet::new();
    for run in store.runs()?.into_iter().rev() {
        let manifest = Manifest::of(store, &run)?;
        let count = seen.entry(manifest.pipeline.name.clone()).or_default();
        let recent = *count < last;
        // A run that failed keeps its finished stages, but takes nobody's place.
        *count += usize::from(manifest.status == RunStatus::Done);
        if recent || tagged.contains(&run) {
            keep.extend(manifest.stages.iter().filter_map(|stage| Some(stage.action.as_ref()?.to_string())));
        }
    }
    Ok(keep)
}
