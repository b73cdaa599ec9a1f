//! Changes at one moment: what `zero_shift`, `base_shift` and `tool_shift` have in common.

use super::{Basis, Form, Law, Measure, Motion, Place, Survey, Term, Variable, names};

/// Change points tried at first; the best is refined to every one.
const CHANGES: usize = 40;

/// What shows when something has moved.
pub(super) const MEASURE: Measure = Measure {
    rank: 3,
    advice: "return to a few anchor poses with different first joints every half hour",
};

/// A motion that steps at each of the change points, with how many are tried. A joint or a tool that steps when the payload changes follows
/// the payload; what stands before the arm may have been touched then.
pub(super) fn laws(motion: Motion, survey: &Survey) -> Vec<(Law, usize, f64)> {
    let times = survey
        .changes(CHANGES)
        .filter(|at| is_its_own(motion, *at, survey));
    times
        .map(|at| {
            (
                Law::new(Variable::Time, Basis::After { at }),
                survey.boundaries.len(),
                0.0,
            )
        })
        .collect()
}

/// The same at neighbouring change points.
pub(super) fn near(term: &Term, survey: &Survey) -> Vec<Term> {
    let Basis::After { at } = term.basis() else {
        return Vec::new();
    };
    let others = survey
        .changes_near(at)
        .iter()
        .copied()
        .filter(|other| *other != at && is_its_own(term.motion(), *other, survey));
    term.with_bases(others.map(|at| Basis::After { at }))
}

/// What may have moved, as far as these data show, when the payload changed for the only time: of a joint or a tool that follows the payload.
pub fn moved_with_the_payload(form: &Form, survey: &Survey) -> Option<(&'static str, Place)> {
    let term = form.term().filter(|term| {
        survey.payload_changes_once() && term.law().variables() == [Variable::Payload]
    })?;
    match term.motion() {
        Motion::Joint { joint } => Some((names::ZERO_SHIFT, Place::Joint(joint))),
        Motion::Tool { .. } => Some((names::TOOL_SHIFT, Place::Tool)),
        _ => None,
    }
}

/// Whether no change of the payload would do the same.
fn is_its_own(motion: Motion, at: f64, survey: &Survey) -> bool {
    matches!(motion, Motion::Base { .. }) || !survey.is_payload_change(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Unknown;
    use crate::robot::{Measurements, PointReadings, small_arm};
    use nalgebra::Vector3;

    const ROWS: usize = 60;

    /// What may have moved with the payload of a joint that follows it, and whether a zero that moves in the middle is proposed.
    fn moved_by(payload: impl Fn(usize) -> f64) -> (Option<(&'static str, Place)>, bool) {
        let robot = small_arm();
        let data = Measurements {
            joints: 2,
            q: (0..2 * ROWS).map(|k| (k as f64 * 0.7).sin()).collect(),
            points: PointReadings::new(vec![Vector3::zeros(); ROWS], 1e-5),
            payload: (0..ROWS).map(payload).collect(),
            time: Some((0..ROWS).map(|row| 10.0 * row as f64).collect()),
            ..Measurements::default()
        };
        let rows: Vec<usize> = (0..ROWS).collect();
        let (torque, compliance) = (vec![0.0; 2 * ROWS], vec![0.0; 2]);
        let survey = Survey::new(&robot, &data, &rows, &torque, &compliance);
        let joint = Motion::Joint { joint: 1 };
        let form = Form::from(Term::new(&Unknown, joint, Law::of(Variable::Payload)));
        let middle = |(law, ..): &(Law, usize, f64)| matches!(law.first.basis, Basis::After { at } if (at - 295.0).abs() <= 10.0);
        (
            moved_with_the_payload(&form, &survey),
            laws(joint, &survey).iter().any(middle),
        )
    }

    #[test]
    fn what_follows_a_payload_that_changes_once_may_have_moved_then_and_no_zero_is_proposed_in_its_stead()
     {
        let shift = Some((names::ZERO_SHIFT, Place::Joint(1)));
        assert_eq!(
            moved_by(|row| if row < ROWS / 2 { 0.0 } else { 5.0 }),
            (shift, false)
        );
        assert_eq!(
            moved_by(|row| if row % 10 < 5 { 0.0 } else { 5.0 }),
            (None, true)
        );
        // The lightest two of three payloads differ, too.
        assert_eq!(
            moved_by(|row| [0.0, 2.0, 5.0][3 * row / ROWS]),
            (None, true)
        );
    }
}
