//! What a sweep must leave: the actions of tagged runs and of fleets', of the last runs of every pipeline, and of what was done since.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::Result;
use crate::pipeline::Manifest;
use crate::store::Store;

/// Runs of one pipeline that were met so far, from the last one back.
#[derive(Default)]
struct Met {
    complete: usize,
    others: usize,
}

/// Ids of all actions that tagged runs and the `last` complete runs of every pipeline used, and as many other runs since. A manifest that
/// cannot be read stops a sweep: nobody knows what it keeps.
pub fn kept_actions(store: &Store, last: usize) -> Result<BTreeSet<String>> {
    let mut tagged: BTreeSet<String> = store.tags()?.into_values().collect();
    tagged.extend(store.runs_of_fleets()?);
    let mut seen: BTreeMap<String, Met> = BTreeMap::new();
    let mut keep = BTreeSet::new();
    for run in store.runs()?.into_iter().rev() {
        let manifest = Manifest::of(store, &run)?;
        let met = seen.entry(manifest.pipeline.name.clone()).or_default();
        // Failed and partial runs and those of other verbs keep their stages, but take no complete run's place.
        let place = if manifest.is_complete() {
            &mut met.complete
        } else {
            &mut met.others
        };
        *place += 1;
        let recent = *place <= last && (manifest.is_complete() || met.complete < last);
        if recent || tagged.contains(&run) {
            keep.extend(
                manifest
                    .stages
                    .iter()
                    .filter_map(|stage| Some(stage.action.as_ref()?.to_string())),
            );
        }
    }
    Ok(keep)
}
