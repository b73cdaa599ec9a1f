//! Pairs of variables whose product may explain what is left where neither does alone: looked for by the residual's own moments, without a fit.

use super::frame::ProjectedRows;
use super::groups::{FreeGroup, GroupColumns, alike, motions};
use super::state::KnownCauses;
use crate::criteria::open_world::{LOOKED_AT, PICKED, STRUCTURED};
use crate::effect::{Motion, Place, Survey, Variable};

/// Products that the residual beside some states points at, the best of every motion of a place.
pub(super) fn pairs(
    place: Place,
    states: &[&KnownCauses],
    frame: &ProjectedRows,
    columns: &mut GroupColumns,
    survey: &Survey,
) -> Vec<FreeGroup> {
    let mean_square = |left: &[f64]| left.iter().map(|value| value * value).sum::<f64>() / left.len().max(1) as f64;
    let left: Vec<Vec<f64>> =
        states.iter().map(|state| state.leaves(frame)).filter(|left| mean_square(left) > *STRUCTURED).collect();
    if left.is_empty() {
        return Vec::new();
    }
    let mut out = Vec::new();
    for (motion, variables) in motions(place, survey) {
        let known = variables.iter().map(|(of, _)| *of).filter(|of| alike(*of) == 1 && !is_another_joints_move(*of, place));
        let known: Vec<(Variable, Vec<Vec<f64>>)> =
            known.filter_map(|of| Some((of, columns.functions(of, *LOOKED_AT)?))).collect();
        let seen = SeenMotion::of(motion, &left, frame);
        let mut scores: Vec<([usize; 2], f64)> = Vec::new();
        for (a, (_, first)) in known.iter().enumerate() {
            let others = known.iter().enumerate().skip(a + 1);
            scores.extend(others.map(|(b, (_, second))| ([a, b], seen.score(first, second))));
        }
        scores.sort_by(|a, b| b.1.total_cmp(&a.1));
        let tried = scores.len();
        // What lowers the squared residual by less cannot pay for its choice.
        let price = 2.0 * (tried.max(1) as f64).ln();
        let of = |([a, b], _): &([usize; 2], f64)| columns.product(motion, [known[*a].0, known[*b].0], tried);
        out.extend(scores.iter().filter(|(_, score)| *score > price).filter_map(of).take(*PICKED));
    }
    out
}

/// Whether a variable is the last move of a joint that is not the place's own: too many for pairs without a factor that shows.
fn is_another_joints_move(of: Variable, place: Place) -> bool {
    matches!(of, Variable::Move { joint } if place != Place::Joint(joint))
}

/// What a motion along each of its directions has to do with what is left, row by row.
struct SeenMotion {
    /// The squared length of the direction and, for each state, its product with what is left.
    directions: Vec<(Vec<f64>, Vec<Vec<f64>>)>,
}

impl SeenMotion {
    fn of(motion: Motion, left: &[Vec<f64>], frame: &ProjectedRows) -> Self {
        let problem = &frame.view.problem;
        let by_row = |direction: &[f64], other: &[f64]| -> Vec<f64> {
            let of_row = |i: usize| problem.readings_of(i).map(|line| direction[line] * other[line]).sum();
            (0..problem.rows.len()).map(of_row).collect()
        };
        let directions = frame.directions(motion);
        let of = |d: &Vec<f64>| (by_row(d, d), left.iter().map(|left| by_row(d, left)).collect());
        Self { directions: directions.iter().map(of).collect() }
    }

    /// By how much the products of functions would lower the squared residual beyond what noise gives them, in the state where they do most.
    fn score(&self, first: &[Vec<f64>], second: &[Vec<f64>]) -> f64 {
        let states = self.directions.first().map_or(0, |(_, along)| along.len());
        let mut falls = vec![0.0; states];
        for (a, b) in first.iter().flat_map(|a| second.iter().map(move |b| (a, b))) {
            let both: Vec<f64> = a.iter().zip(b).map(|(a, b)| a * b).collect();
            for (square, along) in &self.directions {
                let size: f64 = both.iter().zip(square).map(|(both, square)| both * both * square).sum();
                for (fall, along) in falls.iter_mut().zip(along) {
                    let product: f64 = both.iter().zip(along).map(|(both, along)| both * along).sum();
                    *fall += product * product / size.max(f64::MIN_POSITIVE) - 1.0;
                }
            }
        }
        falls.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}
