//! Does a network help? Decided by cross-validation within the training rows, before anything else sees the result.
//!
//! Rows are judged by networks that did not see them. Folds are made of runs of neighbouring rows, since a recording's neighbours are
//! alike and a row must not be predicted from its twin.

use super::training::{Prepared, Recipe, Samples};
use crate::estimate::swarm::Generation;
use crate::estimate::threads::in_order;

/// Runs of neighbouring rows per fold.
const RUNS: usize = 4;
/// The mean gain must exceed so many of its standard errors: about one in forty useless networks would pass.
const CLEAR: f64 = 2.0;

/// What the cross-validation found.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The decay with the smallest error.
    pub decay: f64,
    /// Mean length of the residual over the rows before and after the correction, m.
    pub before: f64,
    pub after: f64,
    /// Standard error of the mean gain `before - after`, m.
    pub sigma: f64,
    /// The mean error with each decay tried, m.
    pub tried: Vec<(f64, f64)>,
}

impl Verdict {
    /// Whether the gain is clearly positive.
    pub fn helps(&self) -> bool {
        self.before - self.after > CLEAR * self.sigma
    }
}

/// Judges `recipe` on the samples with each of `decays` in `folds` folds.
///
/// Panics without decays, or with fewer than two folds or rows.
pub fn judge(
    samples: &Samples,
    recipe: &Recipe,
    decays: &[f64],
    folds: usize,
    mut observe: impl FnMut(usize, &Generation),
) -> Verdict {
    assert!(!decays.is_empty() && folds >= 2 && samples.rows() >= 2, "something to choose from");
    let rows = samples.rows();
    let fold_of: Vec<usize> = (0..rows).map(|row| row * folds * RUNS / rows % folds).collect();
    let mut after = vec![vec![0.0; rows]; decays.len()];
    for fold in 0..folds {
        let (inside, outside): (Vec<usize>, Vec<usize>) = (0..rows).partition(|row| fold_of[*row] != fold);
        let training = samples.pick(&inside);
        let recipes: Vec<Recipe> = decays
            .iter()
            .map(|decay| Recipe { decay: *decay, seed: recipe.seed ^ (fold as u64 + 1), ..recipe.clone() })
            .collect();
        let middle = Prepared::new(&training, &recipes[decays.len() / 2]);
        let (starts, _) = middle.swarm(|generation| observe(fold, generation));
        let trained = in_order(recipe.jobs, decays.len() * recipe.members, |task| {
            let (decay, m) = (task / recipe.members, task % recipe.members);
            Prepared::new(&training, &recipes[decay]).member(m, starts[m % starts.len()].clone()).0
        });
        let mut trained = trained.into_iter();
        for (recipe, after) in recipes.iter().zip(&mut after) {
            let members = trained.by_ref().take(recipe.members).collect();
            let correction = Prepared::new(&training, recipe).correction(members);
            for row in &outside {
                let delta = correction.at(&samples.sources[*row]).delta;
                let left = samples.residual[*row];
                after[*row] = length(std::array::from_fn(|k| left[k] - delta[k]));
            }
        }
    }
    let before: Vec<f64> = samples.residual.iter().map(|r| length(*r)).collect();
    let tried: Vec<(f64, f64)> = decays.iter().zip(&after).map(|(decay, after)| (*decay, mean(after))).collect();
    let best = (0..decays.len()).min_by(|a, b| tried[*a].1.total_cmp(&tried[*b].1)).expect("at least one decay");
    let gains: Vec<f64> = before.iter().zip(&after[best]).map(|(before, after)| before - after).collect();
    let gain = mean(&gains);
    let variance = gains.iter().map(|g| (g - gain) * (g - gain)).sum::<f64>() / (rows - 1) as f64;
    Verdict { decay: tried[best].0, before: mean(&before), after: tried[best].1, sigma: (variance / rows as f64).sqrt(), tried }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
