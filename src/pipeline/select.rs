//! Which stages of a plan a run may execute, and which it must even if they are cached.

use super::plan::Plan;
use crate::error::{Error, Result};
use std::ops::RangeInclusive;

/// What the person asked for.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// This stage alone.
    pub only: Option<String>,
    /// This stage and those after it.
    pub from: Option<String>,
    /// Up to this stage.
    pub until: Option<String>,
    /// Run again though cached: all selected stages, or those named.
    pub force: Option<Vec<String>>,
}

/// The same with the plan's numbers.
#[derive(Debug, Clone)]
pub(super) struct Selected {
    pub stages: RangeInclusive<usize>,
    forced: Vec<usize>,
}

impl Selection {
    pub(super) fn of(&self, plan: &Plan) -> Result<Selected> {
        let last = plan.stages.len().saturating_sub(1);
        let place = |id: &Option<String>, option: &str| {
            id.as_deref().map(|id| plan.find(id, option)).transpose()
        };
        let stages = match place(&self.only, "--only")? {
            Some(only) => only..=only,
            None => {
                place(&self.from, "--from")?.unwrap_or(0)
                    ..=place(&self.until, "--until")?.unwrap_or(last)
            }
        };
        if stages.is_empty() {
            return Err(Error::spec(
                "--from, --until",
                "the stage of --until comes before that of --from",
            ));
        }
        let forced = match &self.force {
            None => Vec::new(),
            Some(ids) if ids.is_empty() => stages.clone().collect(),
            Some(ids) => ids
                .iter()
                .map(|id| plan.find(id, "--force"))
                .collect::<Result<_>>()?,
        };
        if let Some(outside) = forced.iter().find(|index| !stages.contains(index)) {
            let id = &plan.stages[*outside].id;
            return Err(Error::spec(
                "--force",
                format!("stage `{id}` is not among those that --only, --from and --until leave"),
            ));
        }
        Ok(Selected { stages, forced })
    }
}

impl Selected {
    pub fn forces(&self, index: usize) -> bool {
        self.forced.contains(&index)
    }
}
