//! A diagnosis: causes, rivals and cells, and the model with what was found.

use super::{Model, Options, Recording, Robot};
use crate::error::Result;
use crate::pipeline::StageTables;
use crate::summary::DiagnosisSummary;

/// What a diagnosis gave.
pub struct Diagnosis {
    /// Verdict, findings and what to measure next, as text, as JSON and as a page.
    pub summary: DiagnosisSummary,
    /// The arm with all that was found; none where the set-up is wrong.
    pub model: Option<Model>,
    /// Tables of the stage, notes and warnings.
    pub given: StageTables,
}

/// Where robot and recording differ and which causes explain it, by the stage `diagnose`.
pub fn diagnose(robot: &Robot, recording: &Recording, options: &Options) -> Result<Diagnosis> {
    let given = options.run("diagnose", robot, recording)?;
    let tables = |kind: &str| Ok(given.kind(kind).cloned());
    // Commands that are proposed speak of a run: the last one of whoever types them.
    let summary = DiagnosisSummary::of_tables("HEAD", "diagnose", &tables)?;
    let rows = recording.points_mm.len() as u64;
    let summary = summary.with_subject(&robot.description.name, rows);
    let model = match summary.is_wrong_setup() {
        true => None,
        false => Some(Model::of_stage(robot, recording, &given)?),
    };
    Ok(Diagnosis {
        summary,
        model,
        given,
    })
}
