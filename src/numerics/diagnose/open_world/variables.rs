//! Variables of a free form that have a number of their own, and what is asked of the memory of joints.

use crate::criteria::open_world::{FADING, LIMITS, SKETCH};
use crate::effect::{Survey, Variable};
use nalgebra::Vector3;

/// Directions of the tool's position that are tried: axes, diagonals of faces and of the cube.
const ARROWS: [[i8; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [-1, 1, 1],
];

/// What is asked of the travel of joints that are not a place's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AskedMemory {
    /// Their last moves: of those that show, what else they leave behind.
    LastMoves,
    /// All that it may leave behind: where what is left is more than noise.
    All,
}

/// How many variables like this one are tried, one choice together.
pub(super) fn alike(of: Variable) -> usize {
    match of {
        Variable::Position { .. } | Variable::Sighted { .. } => ARROWS.len(),
        Variable::Stretch { .. } => LIMITS.len(),
        Variable::Recent { .. } => FADING.len(),
        _ => 1,
    }
}

/// Whether two variables are the same but for a number of their own.
pub(super) fn is_alike(one: Variable, other: Variable) -> bool {
    match (one, other) {
        (Variable::Stretch { joint: a, .. }, Variable::Stretch { joint: b, .. })
        | (Variable::Recent { joint: a, .. }, Variable::Recent { joint: b, .. }) => a == b,
        (Variable::Position { .. }, Variable::Position { .. }) | (Variable::Sighted { .. }, Variable::Sighted { .. }) => true,
        _ => one == other,
    }
}

/// Directions of the tool's position.
pub(super) fn arrows() -> impl Iterator<Item = [f64; 3]> {
    ARROWS.iter().map(|arrow| Vector3::from(*arrow).map(f64::from).normalize().into())
}

/// What a joint's travel may leave behind.
pub(super) fn moved(joint: usize, survey: &Survey) -> impl Iterator<Item = Variable> {
    let sticks = LIMITS.map(|share| Variable::Stretch { joint, limit: share * survey.travel(joint) });
    let fades = FADING.map(|time| Variable::Recent { joint, time });
    let clocked = survey.data.has_clock();
    sticks.into_iter().chain(fades.into_iter().filter(move |_| clocked)).chain([Variable::Move { joint }])
}

/// What the travel of the other joints leaves behind.
pub(super) fn others(joint: usize, survey: &Survey, memory: AskedMemory) -> impl Iterator<Item = (Variable, usize)> {
    let of = move |joint: usize| {
        let all = moved(joint, survey).filter(move |of| memory == AskedMemory::All || matches!(of, Variable::Move { .. }));
        all.map(|of| (of, *SKETCH))
    };
    (0..survey.joints()).filter(move |other| *other != joint).flat_map(of)
}
