//! The page of one diagnosis, of positions, torques or drives: `calib diagnose --html`. It is made of the tables that its stage read and
//! wrote, so that no report has to be in the pipeline, and any language can be asked for afterwards.

use super::DiagnosisSummary;
use crate::error::Result;
use crate::pipeline::StageReport;
use crate::report::{Page, PageLanguage, drive_page, torque_page};
use crate::stage::{DeclaredStage, DiagnoseDrives, DiagnoseTorques};
use crate::store::Store;
use crate::table::ports::{InputTable, Port, Reads};

/// The page of what a stage diagnosed, of which `summary` is the summary; `again` is the `--store` of the commands that it proposes. Fails
/// where a table has left the store.
pub(crate) fn diagnosis_page(
    summary: &DiagnosisSummary,
    stage: &StageReport,
    (store, again): (&Store, &str),
    language: PageLanguage,
) -> Result<Page> {
    match &*stage.uses {
        DiagnoseTorques::NAME => torque_page(&reads(stage, store)?, None, language, &[]),
        DiagnoseDrives::NAME => drive_page(&reads(stage, store)?, None, language),
        _ => summary.page(again, language),
    }
}

/// The tables of a report from those that the stage wrote, else read.
fn reads<R: Reads>(stage: &StageReport, store: &Store) -> Result<R> {
    let of_port = |port: &Port| -> Result<Vec<(String, InputTable)>> {
        let written = stage.outputs.iter().map(|one| (&one.kind, &one.table));
        let read = stage.inputs.iter().map(|one| (&one.port, &one.table));
        let found = written.chain(read).find(|(kind, _)| **kind == port.kind);
        let loaded = found.map(|(_, table)| store.load(table)).transpose()?;
        let named = loaded.map(|frame| (stage.id.clone(), InputTable::Frame(frame)));
        Ok(named.into_iter().collect())
    };
    R::take(R::ports().iter().map(of_port).collect::<Result<_>>()?)
}
