//! The artificial bee colony (ABC): Karaboga (2005), Karaboga and Basturk (2007).
//!
//! Employed bees try `v_s = x_s + phi (x_s - x_ks)` in one coordinate near their source, onlookers do so near sources drawn by
//! fitness `1 / (1 + f)` (`1 + |f|` below zero), and a source that `limit` trials did not better is left for a random one. All
//! bees of a phase fly at once, from the sources as they are when it begins.

use super::{Method, Objective, Search};
use rand::RngExt;

/// Parameters of the artificial bee colony; the default is that of Karaboga and Basturk.
#[derive(Debug, Clone, PartialEq)]
pub struct BeeColony {
    /// Sources of food, half of the colony: as many bees are employed as look on.
    pub(crate) sources: usize,
    /// Trials without gain after which a source is left, per coordinate and source.
    pub(crate) limit: f64,
}

impl Default for BeeColony {
    fn default() -> Self {
        Self {
            sources: 25,
            limit: 1.0,
        }
    }
}

/// The sources of food, with the trials that did not better each, and what was best ever.
pub struct Colony {
    sources: Vec<(f64, Vec<f64>)>,
    trials: Vec<usize>,
    best: Vec<(f64, Vec<f64>)>,
}

impl Method for BeeColony {
    type State = Colony;

    fn first(&self) -> usize {
        self.sources
    }

    /// Employed bees and onlookers; at most one scout a generation comes on top.
    fn further(&self) -> usize {
        2 * self.sources
    }

    fn start<O: Objective>(&self, search: &mut Search<O>) -> Colony {
        let positions: Vec<Vec<f64>> = (0..self.sources)
            .map(|_| search.bounds.random(&mut search.rng))
            .collect();
        let values = search.visit(&positions);
        let sources: Vec<(f64, Vec<f64>)> = values.into_iter().zip(positions).collect();
        Colony {
            trials: vec![0; self.sources],
            best: sources.clone(),
            sources,
        }
    }

    fn step<O: Objective>(&self, colony: &mut Colony, search: &mut Search<O>) {
        let employed: Vec<usize> = (0..self.sources).collect();
        colony.fly(&employed, search);
        let fitness: Vec<f64> = colony
            .sources
            .iter()
            .map(|source| fitness(source.0))
            .collect();
        let total: f64 = fitness.iter().sum();
        let onlookers: Vec<usize> = (0..self.sources)
            .map(|_| {
                let mut left = search.rng.random::<f64>() * total;
                let drawn = fitness.iter().position(|share| {
                    left -= share;
                    left < 0.0
                });
                drawn.unwrap_or(self.sources - 1)
            })
            .collect();
        colony.fly(&onlookers, search);
        let limit = self.limit * (self.sources * search.bounds.dimensions()) as f64;
        let tired = (0..self.sources)
            .max_by_key(|i| (colony.trials[*i], self.sources - i))
            .unwrap_or(0);
        if colony.trials[tired] as f64 > limit {
            let position = search.bounds.random(&mut search.rng);
            let value = search.visit(std::slice::from_ref(&position))[0];
            colony.sources[tired] = (value, position);
            colony.trials[tired] = 0;
        }
        search.mean =
            colony.sources.iter().map(|source| source.0).sum::<f64>() / self.sources as f64;
    }

    fn elite(&self, colony: &Colony) -> Vec<(f64, Vec<f64>)> {
        colony.best.clone()
    }
}

impl Colony {
    /// One bee beside each of `sources`; a source moves to what is better.
    fn fly<O: Objective>(&mut self, sources: &[usize], search: &mut Search<O>) {
        let candidates: Vec<Vec<f64>> = sources
            .iter()
            .map(|i| {
                let mut x = self.sources[*i].1.clone();
                let s = search.rng.random_range(0..x.len());
                let others = self.sources.len().max(2) - 1;
                let k = (i + 1 + search.rng.random_range(0..others)) % self.sources.len();
                x[s] += search.rng.random_range(-1.0..1.0) * (x[s] - self.sources[k].1[s]);
                search.bounds.clamp(&mut x);
                x
            })
            .collect();
        let values = search.visit(&candidates);
        for ((i, x), value) in sources.iter().zip(candidates).zip(values) {
            if value < self.best[*i].0 {
                self.best[*i] = (value, x.clone());
            }
            if value < self.sources[*i].0 {
                self.sources[*i] = (value, x);
                self.trials[*i] = 0;
            } else {
                self.trials[*i] += 1;
            }
        }
    }
}

fn fitness(value: f64) -> f64 {
    if value >= 0.0 {
        1.0 / (1.0 + value)
    } else {
        1.0 - value
    }
}
