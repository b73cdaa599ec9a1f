//! Changes at one moment: what `zero_shift`, `base_shift` and `tool_shift` have in common.

use super::{Basis, Cause, Hypothesis, Law, Measure, Motion, Survey, Term, Variable};

/// Change points tried at first; the best is refined to every one.
const CHANGES: usize = 40;

/// What shows when something has moved.
pub(super) const MEASURE: Measure =
    Measure { rank: 3, advice: "return to a few anchor poses with different first joints every half hour" };

/// Motions at each of the change points. A joint or a tool that steps when the payload changes follows the
/// payload; what stands before the arm may have been touched then.
pub(super) fn propose(cause: &'static dyn Cause, motions: &[Motion], survey: &Survey) -> Vec<Hypothesis> {
    let law = |at| Law::new(Variable::Time, Basis::After { at });
    let terms = survey.changes(CHANGES).flat_map(|at| motions.iter().map(move |motion| Term::new(cause, *motion, law(at))));
    let all = terms.filter(|term| is_its_own(term, survey));
    all.map(|term| Hypothesis::new(term, survey.boundaries.len())).collect()
}

/// The same at neighbouring change points.
pub(super) fn near(term: &Term, survey: &Survey) -> Vec<Term> {
    let Basis::After { at } = term.basis() else { return Vec::new() };
    let others = survey.changes_near(at).iter().copied().filter(|other| *other != at).map(|at| Basis::After { at });
    term.with_bases(others).into_iter().filter(|term| is_its_own(term, survey)).collect()
}

/// Whether no change of the payload would do the same.
fn is_its_own(term: &Term, survey: &Survey) -> bool {
    let by_payload = |at| !matches!(term.motion(), Motion::Base { .. }) && survey.is_payload_change(at);
    !matches!(term.basis(), Basis::After { at } if by_payload(at))
}
