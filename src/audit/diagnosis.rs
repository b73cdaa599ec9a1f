//! The diagnosis of a run: its manifest and the stage that diagnosed.

use crate::error::{Error, Result, nearest};
use crate::pipeline::{Manifest, StageReport, StageStatus, find_run};
use crate::shell::typed;
use crate::stage::{DeclaredStage, Diagnose};
use crate::store::Store;

/// Stages that diagnose positions.
pub const POSITIONS: [&str; 1] = [Diagnose::NAME];

/// A run by its name, and its stage that diagnoses, one of the kinds `uses`: `step` where it has several. Fails with what to type where
/// there is none.
pub fn diagnosis(
    store: &Store,
    run: &str,
    step: Option<&str>,
    uses: &[&str],
) -> Result<(Manifest, StageReport)> {
    let manifest = Manifest::of(store, &find_run(store, run)?)?;
    let place = format!("run {}", manifest.run_id);
    let own = manifest
        .stages
        .iter()
        .filter(|stage| uses.contains(&stage.uses.as_str()));
    let own: Vec<(&StageReport, &str)> = own.map(|stage| (stage, stage.id.as_str())).collect();
    let sets: String = manifest
        .overrides
        .iter()
        .map(|set| format!(" --set {}", typed(&format!("{}={}", set.target, set.value))))
        .collect();
    let again = format!("calib diagnose {}{sets}", typed(&manifest.pipeline.file));
    let Some((stage, id)) = the_stage(&place, &own, step)? else {
        let message = format!(
            "diagnosed nothing, its pipeline has no stage `diagnose`: put `- uses: diagnose` after the split of {}, then type\n  {again}",
            manifest.pipeline.file
        );
        return Err(Error::spec(place, message));
    };
    if !matches!(stage.status, StageStatus::Cached | StageStatus::Executed) {
        let step = if own.len() > 1 {
            format!(" --step {}", typed(id))
        } else {
            String::new()
        };
        return Err(Error::spec(
            place,
            format!("never came to its stage `{id}`; type\n  {again}{step}"),
        ));
    }
    let stage = stage.clone();
    Ok((manifest, stage))
}

/// The stage that is meant among several with their ids; nothing where there are none.
pub fn the_stage<'a, T: Copy>(
    place: &str,
    own: &[(T, &'a str)],
    step: Option<&str>,
) -> Result<Option<(T, &'a str)>> {
    let list = || own.iter().map(|(_, id)| *id).collect::<Vec<_>>().join(", ");
    match (own, step) {
        ([], _) => Ok(None),
        (_, Some(step)) => own
            .iter()
            .find(|(_, id)| *id == step)
            .copied()
            .map(Some)
            .ok_or_else(|| {
                let near = nearest(step, own.iter().map(|(_, id)| *id))
                    .map(|near| format!("did you mean `{near}`? "));
                Error::spec(
                    place,
                    format!(
                        "no stage `{step}` diagnoses; {}allowed: {}",
                        near.unwrap_or_default(),
                        list()
                    ),
                )
            }),
        ([only], None) => Ok(Some(*only)),
        _ => Err(Error::spec(
            place,
            format!("has several diagnoses; say which with --step: {}", list()),
        )),
    }
}
