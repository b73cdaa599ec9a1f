//! What a run would do, without doing it.

use super::plan::Plan;
use super::reason;
use super::run_state::{KeyState, RunState};
use super::select::Selection;
use crate::error::Result;
use crate::store::{Lookup, Store};
use serde::Serialize;

/// What would become of a stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case", tag = "status")]
pub enum Prospect {
    /// Its tables are there.
    Cached,
    /// It would run.
    Run {
        /// Why.
        reason: String,
    },
    /// Not known before another stage has run.
    Pending {
        /// Ids of stages.
        on: String,
    },
    /// Outside of `--only`, `--from`, `--until`, and not cached.
    NotSelected,
}

/// What a run would do with a stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Forecast {
    /// In the pipeline.
    pub id: String,
    /// Its kind.
    pub uses: String,
    /// Whether it would run.
    #[serde(flatten)]
    pub prospect: Prospect,
}

/// What a run would do, stage by stage. Fails where files cannot be read.
pub fn preview(plan: &Plan, store: &Store, selection: &Selection) -> Result<Vec<Forecast>> {
    let selected = selection.of(plan)?;
    let mut state = RunState::new(plan);
    let mut forecasts = Vec::new();
    for (index, stage) in plan.stages.iter().enumerate() {
        let inside = selected.stages.contains(&index);
        let prospect = match state.key(index)? {
            KeyState::Pending(on) if inside => Prospect::Pending {
                on: plan.stages[on].id.clone(),
            },
            KeyState::Pending(_) => Prospect::NotSelected,
            KeyState::Known(key) => match store.action(&key)? {
                Lookup::Done(record) if !selected.forces(index) => {
                    state.tables[index] = Some(record.tables);
                    Prospect::Cached
                }
                _ if !inside => Prospect::NotSelected,
                found => Prospect::Run {
                    reason: reason::why(store, plan, &key, &found, selected.forces(index))?,
                },
            },
        };
        forecasts.push(Forecast {
            id: stage.id.clone(),
            uses: stage.entry.name.into(),
            prospect,
        });
    }
    Ok(forecasts)
}
