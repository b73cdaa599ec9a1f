//! Folds of the rows to fit, and the fit of the whole model, judge what a search found: it saw a linear picture of these rows. Rows
//! that are held out for validation take no part.

mod alternatives;
mod comparison;
mod exchange;
mod fold_errors;
mod withdraw;

pub(crate) use alternatives::Alternatives;
pub(crate) use comparison::ModelComparison;
pub(crate) use fold_errors::{FoldErrors, FoldGain};

use super::round::FitState;

/// What stands of the causes that were found.
pub(crate) struct JudgedCauses {
    pub state: FitState,
    /// The causes' positions in the pool, in their order.
    pub set: Vec<usize>,
    pub gains: Vec<FoldGain>,
    /// What was found and taken back, a sentence each.
    pub withdrawn: Vec<String>,
}

/// Exchanges causes that do not carry over to other poses, and takes back those that cannot stand; `set` holds the causes' positions in
/// the pool, in their order.
pub(crate) fn judge(state: FitState, mut set: Vec<usize>, comparison: &ModelComparison) -> JudgedCauses {
    let (state, mut gains) = exchange::exchange(state, &mut set, comparison);
    let (state, withdrawn) = withdraw::withdraw(state, &mut set, &mut gains, comparison);
    JudgedCauses { state, set, gains, withdrawn }
}
