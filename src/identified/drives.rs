//! What a run found of an arm's drives: the simulation that exports are made of.

use super::standing::output;
use crate::error::{Error, Result};
use crate::pipeline::{Manifest, Plan, StageReport};
use crate::store::Store;
use crate::table::{
    DriveSimulation, DriveVerdict, DriveVerdictRow, FindingNumberRow, FindingNumbers, FindingRow,
    Findings, Parameters, Table, TorqueParameters, of_kind,
};

/// A simulation of drives with what a diagnosis found.
pub(crate) struct IdentifiedDrives {
    /// Its numbers, as it is and with the findings.
    pub(crate) simulation: DriveSimulation,
    /// The errors that it has.
    pub(crate) verdict: DriveVerdictRow,
    /// What was found, strongest first.
    pub(crate) findings: Vec<FindingRow>,
    /// Numbers of the findings.
    pub(crate) numbers: Vec<FindingNumberRow>,
    /// Where it comes from, e.g. `run 01J..., stage diagnose_drives`.
    pub(crate) origin: String,
}

/// The stages of a plan that diagnose drives; none where the plan identifies positions or torques, whose model it is then.
pub(crate) fn drive_steps_of(plan: &Plan) -> Vec<usize> {
    let stages = 0..plan.stages.len();
    let writes = |at: usize, kind: &str| super::writes(plan, at, kind);
    let others = [Parameters::KIND, TorqueParameters::KIND];
    if stages
        .clone()
        .any(|at| others.iter().any(|kind| writes(at, kind)))
    {
        return Vec::new();
    }
    stages
        .filter(|at| writes(*at, DriveSimulation::KIND))
        .collect()
}

impl IdentifiedDrives {
    /// That of the stage `step` of a run, else of its last that diagnosed drives; none where none did, or where the run identified positions
    /// or torques.
    pub(crate) fn of_run(
        store: &Store,
        manifest: &Manifest,
        step: Option<&str>,
    ) -> Result<Option<Self>> {
        let others = [Parameters::KIND, TorqueParameters::KIND];
        if others
            .iter()
            .any(|kind| manifest.tables(kind).next().is_some())
        {
            return Ok(None);
        }
        let is_it = |stage: &&StageReport| output(stage, DriveSimulation::KIND).is_some();
        let drives: Vec<&StageReport> = manifest.stages.iter().filter(is_it).collect();
        if drives.is_empty() {
            return Ok(None);
        }
        let of_step = |stage: &&&StageReport| step.is_none_or(|step| stage.id == step);
        let Some(stage) = drives.iter().rfind(of_step) else {
            let ids: Vec<&str> = drives.iter().map(|stage| stage.id.as_str()).collect();
            let message = format!(
                "no stage of that name diagnosed drives; those that did: {}",
                ids.join(", ")
            );
            return Err(Error::spec("--step", message));
        };
        let load = |kind: &str| {
            output(stage, kind)
                .map(|table| store.load(table))
                .transpose()
        };
        let verdict: DriveVerdict = of_kind(&load)?.unwrap_or_default();
        let verdict = verdict.0.into_iter().next();
        Ok(Some(Self {
            simulation: of_kind(&load)?.unwrap_or_default(),
            verdict: verdict.ok_or_else(|| Error::Bug("a diagnosis without a verdict".into()))?,
            findings: of_kind::<Findings>(&load)?.unwrap_or_default().0,
            numbers: of_kind::<FindingNumbers>(&load)?.unwrap_or_default().0,
            origin: format!("run {}, stage {}", manifest.run_id, stage.id),
        }))
    }
}
