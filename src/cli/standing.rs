//! The step that stands for a run, by what its stages wrote: what its closing line speaks of, and what is compensated and exported.

use crate::error::Result;
use crate::stage::{Diagnose, Stage};
use crate::store::{Store, TableRef};
use crate::table::{HeldOut, Parameters, Standing, Step, Table, standing};

/// A stage that predicts.
pub(super) struct Candidate<'a> {
    pub id: &'a str,
    pub uses: &'a str,
    pub parameters: Option<&'a TableRef>,
    pub prediction: &'a TableRef,
}

/// The step that stands for a run with these stages, in its order; none where nothing predicts, or the last diagnosis speaks of an
/// outside simulation. Fails where a table has left the store.
pub(super) fn stands(candidates: &[Candidate], store: &Store) -> Result<Option<Standing>> {
    let diagnosed = candidates.iter().rfind(|stage| stage.uses == Diagnose::NAME);
    if let Some(table) = diagnosed.and_then(|stage| stage.parameters)
        && Parameters::from_frame(&store.load(table)?)?.is_beside()
    {
        return Ok(None);
    }
    let step = |stage: &Candidate| -> Result<Step> {
        let held_out = HeldOut::of_frame(&store.load(stage.prediction)?)?;
        Ok(Step { id: stage.id.into(), own: stage.parameters.is_some(), held_out })
    };
    let steps = candidates.iter().map(step).collect::<Result<Vec<Step>>>()?;
    Ok(standing(&steps, diagnosed.map(|stage| stage.id)))
}
