//! Derivative-free minimisation within bounds by swarms: one file per method, one loop for all.
//!
//! A [`Method`] says how its first generation starts and how it goes on; [`minimise`] counts, records and stops. Random numbers
//! are drawn on one thread and only evaluations are spread, so the result is the same for any number of threads.

mod algorithm;
mod bee_colony;
mod beetle_antennae;
mod beetle_swarm;
mod genetic;
mod landscape;
mod particle_swarm;

pub use algorithm::Algorithm;
pub use bee_colony::BeeColony;
pub use beetle_antennae::BeetleAntennae;
pub use beetle_swarm::BeetleSwarm;
pub use genetic::Genetic;
pub use landscape::Landscape;
pub use particle_swarm::ParticleSwarm;

use crate::estimate::threads::in_order;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// A function to be made small. Values that are no number count as infinitely bad.
pub trait Objective: Sync {
    /// Memory that one thread reuses between evaluations.
    type Scratch;
    /// Buffers, one a thread.
    fn scratch(&self) -> Self::Scratch;
    /// What is minimised, at a point within the bounds.
    fn value(&self, x: &[f64], scratch: &mut Self::Scratch) -> f64;
}

impl<F: Fn(&[f64]) -> f64 + Sync> Objective for F {
    type Scratch = ();
    fn scratch(&self) {}
    fn value(&self, x: &[f64], _: &mut ()) -> f64 {
        self(x)
    }
}

/// A box: every coordinate stays within `lower..=upper`.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchBox {
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl SearchBox {
    /// The box between two corners. Panics where they differ in length, are not finite or are in the wrong order.
    pub(crate) fn new(lower: Vec<f64>, upper: Vec<f64>) -> Self {
        assert_eq!(lower.len(), upper.len(), "corners of one box");
        assert!(
            lower
                .iter()
                .zip(&upper)
                .all(|(l, u)| l.is_finite() && u.is_finite() && l <= u),
            "lower <= upper"
        );
        Self { lower, upper }
    }
    /// The cube `lower..=upper` in `dimensions` dimensions.
    pub fn cube(dimensions: usize, lower: f64, upper: f64) -> Self {
        Self::new(vec![lower; dimensions], vec![upper; dimensions])
    }
    /// How many numbers are searched.
    pub(crate) fn dimensions(&self) -> usize {
        self.lower.len()
    }
    fn width(&self, s: usize) -> f64 {
        self.upper[s] - self.lower[s]
    }
    fn clamp(&self, x: &mut [f64]) {
        for ((value, lower), upper) in x.iter_mut().zip(&self.lower).zip(&self.upper) {
            // Not `clamp`: that the bounds are in order is known, and it checks for every number.
            let above = if *value < *lower { *lower } else { *value };
            *value = if above > *upper { *upper } else { above };
        }
    }
    /// A point anywhere in the box.
    pub(super) fn random(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        (0..self.dimensions())
            .map(|s| self.lower[s] + self.width(s) * rng.random::<f64>())
            .collect()
    }
}

/// How long to search, and with what.
#[derive(Debug, Clone)]
pub struct Budget {
    /// At most.
    pub generations: usize,
    /// No generation is begun once so many evaluations are spent.
    pub evaluations: Option<u64>,
    /// The search ends where the best value is at or below this.
    pub target: Option<f64>,
    /// The same seed gives the same search.
    pub seed: u64,
    /// Threads that evaluate; the result does not depend on it.
    pub jobs: usize,
}

/// One generation of the history; generation 0 is the start.
#[derive(Debug, Clone, PartialEq)]
pub struct Generation {
    /// From 0.
    pub index: usize,
    /// Best value so far.
    pub best: f64,
    /// Mean value of this generation's positions.
    pub mean: f64,
    /// Evaluations so far, antennae included.
    pub evaluations: u64,
}

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchStop {
    /// The limit of generations.
    Generations,
    /// The limit of evaluations.
    Evaluations,
    /// The wanted value was reached.
    Target,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct SwarmResult {
    /// The best point.
    pub position: Vec<f64>,
    /// The value there.
    pub value: f64,
    /// The best position of each individual with its value, best first.
    pub elite: Vec<(f64, Vec<f64>)>,
    /// Generation by generation.
    pub history: Vec<Generation>,
    /// How often the function was asked.
    pub evaluations: u64,
    /// Why it ended.
    pub stop: SearchStop,
}

/// A swarm optimiser: plain parameters, with the state of a search apart from them.
pub trait Method {
    /// What it keeps from generation to generation.
    type State;
    /// Evaluations of the first generation.
    fn first(&self) -> usize;
    /// Evaluations of each further generation.
    fn further(&self) -> usize;
    /// The first generation, visited.
    fn start<O: Objective>(&self, search: &mut Search<O>) -> Self::State;
    /// One generation further.
    fn step<O: Objective>(&self, state: &mut Self::State, search: &mut Search<O>);
    /// The best position of each individual so far with its value, in any order.
    fn elite(&self, state: &Self::State) -> Vec<(f64, Vec<f64>)>;
}

/// A search under way, as a method sees it.
pub struct Search<'a, O: Objective> {
    objective: &'a O,
    bounds: &'a SearchBox,
    rng: ChaCha8Rng,
    jobs: usize,
    /// Buffers of the one thread that evaluates where there are no others.
    scratch: O::Scratch,
    /// Number of the generation being made, from 1, and how many there may be.
    generation: usize,
    generations: usize,
    evaluations: u64,
    best: (f64, Vec<f64>),
    mean: f64,
}

impl<O: Objective> Search<'_, O> {
    /// Values at `positions` that are only smelt at (antennae): counted, not remembered.
    fn probe(&mut self, positions: &[Vec<f64>]) -> Vec<f64> {
        self.evaluations += positions.len() as u64;
        let number = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        if self.jobs <= 1 {
            let (objective, scratch) = (self.objective, &mut self.scratch);
            return positions
                .iter()
                .map(|x| number(objective.value(x, scratch)))
                .collect();
        }
        // A chunk is all that a thread evaluates, so that scratch memory is made once per chunk.
        let size = positions.len().div_ceil(self.jobs).max(1);
        let chunks: Vec<&[Vec<f64>]> = positions.chunks(size).collect();
        let values = in_order(self.jobs, chunks.len(), |c| {
            let mut scratch = self.objective.scratch();
            chunks[c]
                .iter()
                .map(|x| self.objective.value(x, &mut scratch))
                .collect::<Vec<f64>>()
        });
        values.into_iter().flatten().map(number).collect()
    }
    /// Values at the positions of a generation; the best ever is remembered.
    fn visit(&mut self, positions: &[Vec<f64>]) -> Vec<f64> {
        let values = self.probe(positions);
        for (value, x) in values.iter().zip(positions) {
            if *value < self.best.0 || self.best.1.is_empty() {
                self.best = (*value, x.clone());
            }
        }
        self.mean = values.iter().sum::<f64>() / values.len() as f64;
        values
    }
    /// What falls linearly from `most` in the first generation to `least` in the last (Eq. 38).
    fn falling(&self, [most, least]: [f64; 2]) -> f64 {
        most - (most - least) * self.generation as f64 / self.generations as f64
    }
}

/// Keeps what each individual found better than before.
fn remember(best: &mut [(f64, Vec<f64>)], positions: &[Vec<f64>], values: &[f64]) {
    for ((best, position), value) in best.iter_mut().zip(positions).zip(values) {
        if *value < best.0 {
            *best = (*value, position.clone());
        }
    }
}

/// Minimises `objective` within `bounds`; `observe` is called once per generation with the best position so far.
pub fn minimise<M: Method, O: Objective>(
    method: &M,
    objective: &O,
    bounds: &SearchBox,
    budget: &Budget,
    mut observe: impl FnMut(&Generation, &[f64]),
) -> SwarmResult {
    let mut search = Search {
        objective,
        bounds,
        rng: ChaCha8Rng::seed_from_u64(budget.seed),
        jobs: budget.jobs,
        scratch: objective.scratch(),
        generation: 0,
        generations: budget.generations,
        evaluations: 0,
        best: (f64::INFINITY, Vec::new()),
        mean: f64::INFINITY,
    };
    let mut state = method.start(&mut search);
    let mut history = Vec::with_capacity(budget.generations + 1);
    let stop = loop {
        let generation = Generation {
            index: search.generation,
            best: search.best.0,
            mean: search.mean,
            evaluations: search.evaluations,
        };
        observe(&generation, &search.best.1);
        history.push(generation);
        if budget.target.is_some_and(|target| search.best.0 <= target) {
            break SearchStop::Target;
        }
        if search.generation >= budget.generations {
            break SearchStop::Generations;
        }
        if budget
            .evaluations
            .is_some_and(|most| search.evaluations >= most)
        {
            break SearchStop::Evaluations;
        }
        search.generation += 1;
        method.step(&mut state, &mut search);
    };
    let mut elite = method.elite(&state);
    elite.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (value, position) = search.best;
    SwarmResult {
        position,
        value,
        elite,
        history,
        evaluations: search.evaluations,
        stop,
    }
}
