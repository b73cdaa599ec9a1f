//! Derivative-free minimisation within bounds by swarms: one file per method, one loop for all.
//!
//! A [`Method`] says how its first generation starts and how it goes on; [`minimise`] counts, records and stops. Random numbers
//! are drawn on one thread and only evaluations are spread, so the result is the same for any number of threads.
//!
//! The five optimisers by name, with the parameters of their papers.
//!
//! Functions with known minima on which optimisers are compared.
//!
//! Michalewicz is Eq. 35 of Wang et al. (2020) with its sign, `-sum sin(x_i) sin(i x_i^2 / pi)^20` on `[0, pi]^n`; the others as in
//! Jamil and Yang (2013), minimum 0.

pub use crate::estimate::swarm::bee_colony::BeeColony;
pub use crate::estimate::swarm::beetle_swarm::{BeetleAntennae, BeetleSwarm};
pub use crate::estimate::swarm::genetic::Genetic;
pub use crate::estimate::swarm::particle_swarm::ParticleSwarm;
use crate::estimate::threads::in_order;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{E, PI};

mod bee_colony;
mod beetle_swarm;
mod genetic;
mod particle_swarm;

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

/// An optimiser with the parameters of its paper.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Algorithm {
    /// Beetle antennae search.
    Bas,
    /// Beetle swarm optimisation.
    Bso,
    /// Particle swarm optimisation.
    Pso,
    /// Genetic algorithm.
    Ga,
    /// Artificial bee colony.
    Abc,
}

/// Runs the body with `$method` bound to the optimiser of a population.
macro_rules! with {
    ($algorithm:expr, $population:expr, |$method:ident| $body:expr) => {
        match $algorithm {
            Algorithm::Bas => {
                let $method = BeetleAntennae::default();
                $body
            }
            Algorithm::Bso => {
                let $method = BeetleSwarm {
                    beetles: $population,
                    ..BeetleSwarm::default()
                };
                $body
            }
            Algorithm::Pso => {
                let $method = ParticleSwarm {
                    particles: $population,
                    ..ParticleSwarm::default()
                };
                $body
            }
            Algorithm::Ga => {
                let $method = Genetic {
                    individuals: $population,
                    ..Genetic::default()
                };
                $body
            }
            Algorithm::Abc => {
                let $method = BeeColony {
                    sources: $population.div_ceil(2),
                    ..BeeColony::default()
                };
                $body
            }
        }
    };
}

impl Algorithm {
    /// All of them, as tables list them.
    pub const ALL: [Self; 5] = [Self::Bas, Self::Bso, Self::Pso, Self::Ga, Self::Abc];

    /// As tables hold it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bas => "bas",
            Self::Bso => "bso",
            Self::Pso => "pso",
            Self::Ga => "ga",
            Self::Abc => "abc",
        }
    }

    /// Generations of a `population` that fit into so many evaluations.
    pub fn generations(self, population: usize, evaluations: u64) -> usize {
        with!(self, population, |method| {
            let left = evaluations.saturating_sub(method.first() as u64);
            (left / method.further().max(1) as u64) as usize
        })
    }

    /// Evaluations that `generations` of a `population` take; a colony's scouts come on top.
    pub fn evaluations(self, population: usize, generations: usize) -> u64 {
        with!(
            self,
            population,
            |method| (method.first() + generations * method.further()) as u64
        )
    }

    /// Minimises with a `population` (at least 4; a lone beetle has none); see [`minimise`].
    pub fn minimise<O: Objective>(
        self,
        population: usize,
        objective: &O,
        bounds: &SearchBox,
        budget: &Budget,
        observe: impl FnMut(&Generation, &[f64]),
    ) -> SwarmResult {
        with!(self, population, |method| minimise(
            &method, objective, bounds, budget, observe
        ))
    }
}

/// A function to be minimised in any number of dimensions.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Landscape {
    /// Flat with narrow valleys; the paper's. In 2, 5 or 10 dimensions.
    Michalewicz,
    /// A bowl with a lattice of minima.
    Rastrigin,
    /// A bent valley.
    Rosenbrock,
    /// A plateau of small minima around a funnel.
    Ackley,
}

impl Landscape {
    /// As tables hold it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Michalewicz => "michalewicz",
            Self::Rastrigin => "rastrigin",
            Self::Rosenbrock => "rosenbrock",
            Self::Ackley => "ackley",
        }
    }

    /// Its value at a point of any dimension.
    pub fn value(self, x: &[f64]) -> f64 {
        let n = x.len() as f64;
        match self {
            Self::Michalewicz => -x
                .iter()
                .zip(1..)
                .map(|(x, i)| x.sin() * (f64::from(i) * x * x / PI).sin().powi(20))
                .sum::<f64>(),
            Self::Rastrigin => x
                .iter()
                .map(|x| x * x - 10.0 * (2.0 * PI * x).cos() + 10.0)
                .sum(),
            Self::Rosenbrock => x
                .windows(2)
                .map(|x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2))
                .sum(),
            Self::Ackley => {
                let squares: f64 = x.iter().map(|x| x * x).sum::<f64>() / n;
                let cosines: f64 = x.iter().map(|x| (2.0 * PI * x).cos()).sum::<f64>() / n;
                20.0 - 20.0 * (-0.2 * squares.sqrt()).exp() + E - cosines.exp()
            }
        }
    }

    /// The box that is searched.
    pub(crate) fn bounds(self, dimensions: usize) -> SearchBox {
        let (lower, upper) = match self {
            Self::Michalewicz => (0.0, PI),
            Self::Rastrigin => (-5.12, 5.12),
            Self::Rosenbrock => (-2.048, 2.048),
            Self::Ackley => (-32.768, 32.768),
        };
        SearchBox::cube(dimensions, lower, upper)
    }

    /// One search for its minimum; `population` as of [`Algorithm::minimise`].
    pub fn search(
        self,
        dimensions: usize,
        method: Algorithm,
        population: usize,
        budget: &Budget,
    ) -> SwarmResult {
        method.minimise(
            population,
            &|x: &[f64]| self.value(x),
            &self.bounds(dimensions),
            budget,
            |_, _| {},
        )
    }

    /// The smallest value, where it is known.
    pub fn minimum(self, dimensions: usize) -> Option<f64> {
        match (self, dimensions) {
            (Self::Michalewicz, 2) => Some(-1.801_303_41),
            (Self::Michalewicz, 5) => Some(-4.687_658_18),
            (Self::Michalewicz, 10) => Some(-9.660_151_72),
            (Self::Michalewicz, _) => None,
            (Self::Rosenbrock, 0 | 1) => None,
            _ => Some(0.0),
        }
    }
}
