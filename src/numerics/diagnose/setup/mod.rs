//! Set-up errors come before physics: what engineers get wrong when they bring a robot file, joints and points together.
//!
//! Where the nominal robot is farther off than one that is set up rightly, or the identified one leaves it by more than manufacture
//! errs, each error of a closed list is taken out of the recording, base and tool are aligned anew, and what is left is compared. The
//! frames of base and tool are fitted, so that no convention of theirs can be wrong here.

mod compare;
mod counting;
mod mixture;
mod order;
mod placement;
mod words;
mod wrong;

use super::round::FitState;
use super::types::{Diagnosis, Question};
use crate::criteria::setup::FEWEST;
use compare::AsStated;

/// Rows to fit and to validate with whole points: nothing else says where the arm is without its geometry. None where they are too few, or
/// were recorded together with an outside simulation.
fn whole_points(question: &Question) -> Option<[Vec<usize>; 2]> {
    let whole = [question.fit, question.validate].map(|rows| {
        let rows = rows.iter().copied();
        rows.filter(|row| question.data.has_point(*row))
            .collect::<Vec<_>>()
    });
    (whole[0].len() >= *FEWEST && !question.beside_simulation).then_some(whole)
}

/// What is wrong with the set-up, if the nominal robot is far off its points; without findings where nothing of the list explains it.
pub fn wrong_setup(question: &Question) -> Option<Diagnosis> {
    let [fit, validate] = &whole_points(question)?;
    let question = &Question {
        fit,
        validate,
        ..*question
    };
    let stated = AsStated::of(question);
    let two_setups = || {
        let found = stated.two_setups()?;
        Some(words::two_setups(question, &found))
    };
    if !stated.is_far_off() {
        return stated.is_in_parts().then(two_setups).flatten();
    }
    if let Some(found) = stated.explained() {
        return Some(words::explained(question, &stated, &found));
    }
    let unexplained = || words::unexplained(question, &stated);
    two_setups().or_else(|| stated.is_no_robot().then(unexplained))
}

/// What is wrong with the set-up, if the identified base model leaves the robot file by more than manufacture errs.
pub(crate) fn wrong_when_identified(question: &Question, now: &FitState) -> Option<Diagnosis> {
    let [fit, validate] = &whole_points(question)?;
    let question = &Question {
        fit,
        validate,
        ..*question
    };
    let stated = AsStated::of(question);
    let beyond = compare::beyond(now, question.robot, stated.reach);
    if beyond.is_empty() {
        return None;
    }
    Some(match stated.explained() {
        Some(found) => words::explained(question, &stated, &found),
        None => words::implausible(question, &beyond),
    })
}
