//! The step that stands for a run, by what its stages wrote: what its closing line speaks of, and what is compensated and exported.

use crate::error::Result;
use crate::pipeline::{Manifest, StageReport};
use crate::stage::{Diagnose, Stage};
use crate::store::{Store, TableRef};
use crate::table::{Corrected, Parameters, Prediction, Standing, Step, Table, Unseen, standing};

/// The step that stands for a run; none where nothing predicts, or the last diagnosis speaks of an outside simulation. Fails where a
/// table has left the store.
pub fn standing_of(manifest: &Manifest, store: &Store) -> Result<Option<Standing>> {
    let of = |stage: &StageReport, kind: &str| -> Option<TableRef> {
        stage.outputs.iter().find(|output| output.kind == kind).map(|output| output.table.clone())
    };
    let steps = manifest.stages.iter().filter_map(|stage| Some((stage, of(stage, Prediction::KIND)?)));
    let diagnosed = steps.clone().rfind(|(stage, _)| stage.uses == Diagnose::NAME);
    if let Some(table) = diagnosed.as_ref().and_then(|(stage, _)| of(stage, Parameters::KIND))
        && Parameters::from_frame(&store.load(&table)?)?.corrected() == Corrected::OutsideSimulation
    {
        return Ok(None);
    }
    let step = |(stage, prediction): (&StageReport, TableRef)| -> Result<Step> {
        let unseen = Unseen::of_frame(&store.load(&prediction)?)?;
        Ok(Step { id: stage.id.clone(), own: of(stage, Parameters::KIND).is_some(), unseen })
    };
    let steps = steps.map(step).collect::<Result<Vec<Step>>>()?;
    Ok(standing(&steps, diagnosed.map(|(stage, _)| stage.id.as_str())))
}
