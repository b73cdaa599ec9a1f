//! The step that stands for a run, by what its stages wrote: what its closing line speaks of, and what is compensated and exported.

use super::written::written;
use crate::error::Result;
use crate::pipeline::{Manifest, StageReport};
use crate::stage::{DeclaredStage, Diagnose};
use crate::store::{Store, TableRef};
use crate::table::{
    Corrected, Findings, Parameters, Prediction, Standing, Step, Table, Unseen, Verdict,
    VerdictRow, standing,
};

/// What the last diagnosis of a run says of a wrong set-up; none where it is right. Fails where a table has left the store.
pub fn wrong_setup_of(manifest: &Manifest, store: &Store) -> Result<Option<String>> {
    Ok(diagnosed(manifest, store)?.and_then(|(verdict, findings)| verdict.wrong_setup(&findings)))
}

/// What commands and files of a model must be told to lack, where the last diagnosis of its run left something unexplained.
pub(super) fn unexplained_of(manifest: &Manifest, store: &Store) -> Result<Option<String>> {
    let left = diagnosed(manifest, store)?
        .and_then(|(verdict, _)| verdict.0.into_iter().find(VerdictRow::is_unexplained));
    Ok(left.map(|row| {
        let statement = row
            .statement
            .map(|statement| format!(": {statement}"))
            .unwrap_or_default();
        format!(
            "the verdict is `unexplained`, and what no cause explains is not corrected{statement}"
        )
    }))
}

/// Verdict and findings of the last diagnosis.
fn diagnosed(manifest: &Manifest, store: &Store) -> Result<Option<(Verdict, Findings)>> {
    let mut diagnosed = manifest
        .stages
        .iter()
        .filter(|stage| stage.uses == Diagnose::NAME && !stage.outputs.is_empty());
    let Some(stage) = diagnosed.next_back() else {
        return Ok(None);
    };
    let load = |table: &TableRef| store.load(table);
    let (verdict, findings): (Option<Verdict>, Option<Findings>) =
        (written(stage, load)?, written(stage, load)?);
    Ok(verdict.zip(findings))
}

/// The step that stands for a run; none where nothing predicts, the last diagnosis speaks of an outside simulation, or the set-up is
/// wrong. Fails where a table has left the store.
pub fn standing_of(manifest: &Manifest, store: &Store) -> Result<Option<Standing>> {
    let output = |stage: &StageReport, kind: &str| -> Option<TableRef> {
        stage
            .outputs
            .iter()
            .find(|output| output.kind == kind)
            .map(|output| output.table.clone())
    };
    let steps = manifest
        .stages
        .iter()
        .filter_map(|stage| Some((stage, output(stage, Prediction::KIND)?)));
    let diagnosed = steps
        .clone()
        .rfind(|(stage, _)| stage.uses == Diagnose::NAME);
    if let Some(table) = diagnosed
        .as_ref()
        .and_then(|(stage, _)| output(stage, Parameters::KIND))
        && Parameters::from_frame(&store.load(&table)?)?.corrected() == Corrected::OutsideSimulation
    {
        return Ok(None);
    }
    if wrong_setup_of(manifest, store)?.is_some() {
        return Ok(None);
    }
    let step = |(stage, prediction): (&StageReport, TableRef)| -> Result<Step> {
        let unseen = Unseen::of_frame(&store.load(&prediction)?)?;
        Ok(Step {
            id: stage.id.clone(),
            own: output(stage, Parameters::KIND).is_some(),
            unseen,
        })
    };
    let steps = steps.map(step).collect::<Result<Vec<Step>>>()?;
    Ok(standing(
        &steps,
        diagnosed.map(|(stage, _)| stage.id.as_str()),
    ))
}
