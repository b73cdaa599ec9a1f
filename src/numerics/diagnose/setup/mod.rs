//! Set-up errors come before physics: what engineers get wrong when they bring a robot file, joints and points together.
//!
//! Where the nominal robot is farther off than one that is set up rightly, or the identified one leaves it by more than manufacture
//! errs, each error of a closed list is taken out of the recording, base and tool are aligned anew, and what is left is compared. The
//! frames of base and tool are fitted, so that no convention of theirs can be wrong here.

mod compare;
mod counting;
mod mixture;
mod placement;
mod words;
mod wrong;

use super::round::FitState;
use super::types::{Diagnosis, Question};
use crate::criteria::setup::FEWEST;
use compare::AsStated;

/// Rows with whole points: nothing else says where the arm is without its geometry.
struct WholePoints {
    fit: Vec<usize>,
    validate: Vec<usize>,
}

impl WholePoints {
    fn of(question: &Question) -> Self {
        let whole = |rows: &[usize]| {
            rows.iter()
                .copied()
                .filter(|row| question.data.has_point(*row))
                .collect()
        };
        Self {
            fit: whole(question.fit),
            validate: whole(question.validate),
        }
    }

    /// The question of these rows; none where they are too few, or stand beside an outside simulation.
    fn question<'a>(&'a self, question: &Question<'a>) -> Option<Question<'a>> {
        let asked = self.fit.len() >= *FEWEST && !question.beside_simulation;
        asked.then_some(Question {
            fit: &self.fit,
            validate: &self.validate,
            ..*question
        })
    }
}

/// What is wrong with the set-up, if the nominal robot is far off its points; without findings where nothing of the list explains it.
pub fn wrong_setup(question: &Question) -> Option<Diagnosis> {
    let points = WholePoints::of(question);
    let question = &points.question(question)?;
    let stated = AsStated::of(question);
    if !stated.is_far_off() {
        let parted = if stated.is_in_parts() {
            stated.two_setups()
        } else {
            None
        };
        return parted.map(|found| words::two_setups(question, &found));
    }
    if let Some(found) = stated.explained() {
        return Some(words::explained(question, &stated, &found));
    }
    match stated.two_setups() {
        Some(found) => Some(words::two_setups(question, &found)),
        None => stated
            .is_no_robot()
            .then(|| words::unexplained(question, &stated)),
    }
}

/// What is wrong with the set-up, if the identified base model leaves the robot file by more than manufacture errs.
pub(crate) fn wrong_when_identified(question: &Question, now: &FitState) -> Option<Diagnosis> {
    let points = WholePoints::of(question);
    let question = &points.question(question)?;
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
