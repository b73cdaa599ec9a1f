//! Pairs of variables whose product may explain what is left where neither does alone: looked for by the residual's own moments, without a fit.

use super::frame::ProjectedRows;
use super::groups::{FreeGroup, GroupColumns, motions};
use super::state::KnownCauses;
use super::variables::is_alike;
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
    for (motion, variables) in motions(place, survey, columns.memory) {
        let known =
            variables.iter().map(|(of, _)| *of).filter(|of| columns.is_factor(*of) && !is_another_joints_move(*of, place));
        let known: Vec<Variable> = known.collect();
        let known: Vec<(Variable, Vec<Vec<f64>>)> =
            known.into_iter().filter_map(|of| Some((of, columns.functions(of, *LOOKED_AT)?))).collect();
        let seen = SeenMotion::of(motion, &left, frame);
        let mut scores: Vec<([usize; 2], f64)> = Vec::new();
        for (a, (own, first)) in known.iter().enumerate() {
            let others = known.iter().enumerate().skip(a + 1).filter(|(_, (other, _))| !is_alike(*other, *own));
            scores.extend(others.map(|(b, (_, second))| ([a, b], seen.score(first, second))));
        }
        scores.sort_by(|a, b| b.1.total_cmp(&a.1));
        let tried = scores.len();
        // What lowers the squared residual by less cannot pay for its choice.
        let price = 2.0 * (tried.max(1) as f64).ln();
        let of = |[a, b]: [usize; 2]| [known[a].0, known[b].0];
        let mut picked: Vec<[Variable; 2]> = Vec::new();
        for pair in scores.iter().filter(|(_, score)| *score > price).map(|(pair, _)| of(*pair)) {
            // The best number of each memory is enough.
            let is_new = picked.iter().all(|other| !(is_alike(pair[0], other[0]) && is_alike(pair[1], other[1])));
            if picked.len() < *PICKED
                && is_new
                && let Some(group) = columns.product(motion, pair, tried)
            {
                picked.push(pair);
                out.push(group);
            }
        }
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
