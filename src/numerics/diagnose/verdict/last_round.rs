//! What the last round looked at, and what it found.

use crate::diagnose::round::{FitState, RoundView};
use crate::diagnose::table::Answer;
use crate::effect::Survey;
use crate::estimate::ErrorScale;

/// The last round.
pub(crate) struct LastRound<'a, 'b> {
    pub(crate) view: &'b RoundView<'a>,
    pub(crate) survey: &'b Survey<'a>,
    /// The whole model with all causes.
    pub(crate) state: FitState,
    pub(crate) answer: Answer,
    /// What errors of rows are compared and told in.
    pub(crate) scale: ErrorScale,
    /// Names of causes that are not to be given.
    pub(crate) without: &'b [String],
}

impl LastRound<'_, '_> {
    /// Whether a name is not to be given.
    pub(crate) fn excludes(&self, effect: &str) -> bool {
        self.without.iter().any(|name| name == effect)
    }
}
