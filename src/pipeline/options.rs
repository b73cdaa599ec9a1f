//! How a plan is run, and what for.

use super::select::Selection;
use serde::{Deserialize, Serialize};

/// What a run was made for. The manifests of older versions do not say; theirs count as runs of their own.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// `calib run`: for the sake of all its tables.
    #[default]
    Run,
    /// For what the verb needs of the pipeline, which may be a part.
    Compensate,
    /// `calib diagnose`.
    Diagnose,
    /// `calib export`.
    Export,
    /// `calib simulate`.
    Simulate,
    /// One robot of a fleet.
    Fleet,
}

/// How to run a plan.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// Which stages.
    pub selection: Selection,
    /// Worker threads; no result depends on it.
    pub jobs: usize,
    /// For the log.
    pub purpose: Purpose,
}
