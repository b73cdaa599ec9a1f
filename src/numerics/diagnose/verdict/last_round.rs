//! What the last round looked at, and what stands of what it found.

use crate::diagnose::finding_groups::FindingKey;
use crate::diagnose::judge::JudgedCauses;
use crate::diagnose::open_world::NameOdds;
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::types::Located;
use crate::effect::Survey;
use crate::estimate::ErrorScale;
use std::collections::BTreeMap;

/// The last round, judged.
pub(crate) struct LastRound<'a, 'b> {
    pub pool: &'b CachedHypotheses<'a>,
    pub survey: &'b Survey<'a>,
    pub judged: JudgedCauses,
    /// The odds of every finding that it is none of the list.
    pub odds: BTreeMap<FindingKey, NameOdds>,
    /// What errors of rows are compared and told in.
    pub scale: ErrorScale,
    /// Names of causes that are not to be given.
    pub without: &'b [String],
    /// The gate's probability at the start and at the end.
    pub first: f64,
    pub last: f64,
    /// Where the residual of the base model sits.
    pub located: Located,
}

impl LastRound<'_, '_> {
    /// The causes as a set of the pool, which is ascending.
    pub fn set(&self) -> Vec<usize> {
        let mut set = self.judged.set.clone();
        set.sort_unstable();
        set
    }

    /// Whether a name is not to be given.
    pub fn excludes(&self, effect: &str) -> bool {
        self.without.iter().any(|name| name == effect)
    }

    /// What the best hypothesis beside the chosen ones would be.
    pub fn best(&self) -> Option<String> {
        let (_, best) = *self.pool.given(&self.set()).falls.first()?;
        let form = &self.pool.hypotheses[best].form;
        Some(format!("most like {} at {}", form.name(), form.place()))
    }
}
