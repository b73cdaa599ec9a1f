//! A diagnosis of either kind: of positions or of torques.

use super::screen::{self, NextStep};
use super::short_finding::ShortFinding;
use super::{DiagnosisSummary, TorqueSummary, labelled};
use crate::error::{Error, Result};
use crate::pipeline::StageReport;
use crate::stage::{DiagnoseTorques, Stage};
use crate::store::Store;
use serde_json::Value;

/// What a stage that diagnoses wrote.
pub enum Diagnosed {
    /// By `diagnose`.
    Positions(Box<DiagnosisSummary>),
    /// By `diagnose_torques`.
    Torques(Box<TorqueSummary>),
}

impl Diagnosed {
    /// What the stage of a run wrote. Fails where a table has left the store.
    pub fn read(run: &str, stage: &StageReport, store: &Store) -> Result<Self> {
        if stage.uses == DiagnoseTorques::NAME {
            return TorqueSummary::read(run, stage, store)
                .map(|told| Self::Torques(Box::new(told)));
        }
        DiagnosisSummary::read(run, stage, store).map(|told| Self::Positions(Box::new(told)))
    }

    /// Whether the files do not belong together as they are read.
    pub fn is_wrong_setup(&self) -> bool {
        match self {
            Self::Positions(told) => told.is_wrong_setup(),
            Self::Torques(told) => told.is_wrong_setup(),
        }
    }

    /// The proposed formula of a finding as a file that declares it; of torques there is none.
    pub fn effect_file(&self, finding: Option<i64>) -> Result<String> {
        match self {
            Self::Positions(told) => told.effect_file(finding),
            Self::Torques(_) => Err(Error::spec(
                "--export-effect",
                "findings on torques have no formula of their own",
            )),
        }
    }

    /// The diagnosis as one document; `store` is the `--store` of the commands that it proposes.
    pub fn document(&self, store: &str) -> Value {
        match self {
            Self::Positions(told) => told.document(store),
            Self::Torques(told) => told.document(),
        }
    }

    /// The diagnosis as one HTML file; of torques it is in the report.
    pub fn page(&self, store: &str) -> Result<String> {
        match self {
            Self::Positions(told) => told.page(store),
            Self::Torques(_) => Err(Error::spec(
                "--html",
                "of torques the page is the pipeline's report: put `- uses: report` last",
            )),
        }
    }

    /// All of it, for a person.
    pub fn text(&self, store: &str) -> String {
        match self {
            Self::Positions(told) => told.text(store),
            Self::Torques(told) => told.text(),
        }
    }

    /// The verdict and a line a finding.
    pub fn short(&self, store: &str, columns: Option<usize>) -> String {
        let width = screen::width(columns);
        match self {
            Self::Positions(told) => told.short(store, width),
            Self::Torques(told) => told.short(store, width),
        }
    }

    /// The same in ten lines, with the largest findings alone.
    pub(super) fn in_short(&self, width: usize, store: &str) -> String {
        let head = match self {
            Self::Positions(told) => told.head(),
            Self::Torques(told) => told.head(),
        };
        let next = self
            .next_step(store)
            .map_or_else(String::new, |step| step.text(width));
        head + &screen::found(self.found(), width) + &labelled("verdict", &self.verdict()) + &next
    }

    /// The verdict in at most twelve words.
    pub fn verdict(&self) -> String {
        match self {
            Self::Positions(told) => told.verdict(),
            Self::Torques(told) => told.verdict(),
        }
    }

    /// The findings in a few words each.
    pub(super) fn found(&self) -> Vec<ShortFinding> {
        match self {
            Self::Positions(told) => told.found(),
            Self::Torques(told) => told.found(),
        }
    }

    /// What to do next, where the diagnosis says so.
    pub(super) fn next_step(&self, store: &str) -> Option<NextStep> {
        match self {
            Self::Positions(told) => told.next_step(store),
            Self::Torques(_) => Some(TorqueSummary::next_step("HEAD", store)),
        }
    }
}
