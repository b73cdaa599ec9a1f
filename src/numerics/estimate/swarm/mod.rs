//! Derivative-free minimisation within bounds by swarms: one state and one loop for all, a generation of each method in `steps`.
//!
//! [`Algorithm::minimise`] counts, records and stops. Random numbers are drawn on one thread and only evaluations are spread, so the
//! result is the same for any number of threads.
//!
//! Functions with known minima on which optimisers are compared.
//!
//! Michalewicz is Eq. 35 of Wang et al. (2020) with its sign, `-sum sin(x_i) sin(i x_i^2 / pi)^20` on `[0, pi]^n`; the others as in
//! Jamil and Yang (2013), minimum 0.

use crate::estimate::threads::in_order;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{E, PI};

mod steps;

use steps::{ELITE, Found, Swarm};

/// A function to be made small. Values that are no number count as infinitely bad.
pub trait Objective: Fn(&[f64]) -> f64 + Sync {}

impl<F: Fn(&[f64]) -> f64 + Sync> Objective for F {}

/// A box: every coordinate stays within `lower..=upper`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchBox {
    dimensions: usize,
    lower: f64,
    upper: f64,
}

impl SearchBox {
    /// The cube `lower..=upper` in `dimensions` dimensions. Panics where the ends are not finite or in the wrong order.
    pub fn cube(dimensions: usize, lower: f64, upper: f64) -> Self {
        let ends = [lower, upper];
        assert!(
            ends.iter().all(|end| end.is_finite()) && lower <= upper,
            "lower <= upper"
        );
        Self {
            dimensions,
            lower,
            upper,
        }
    }
    fn width(&self) -> f64 {
        self.upper - self.lower
    }
    fn clamp(&self, x: &mut [f64]) {
        for value in x {
            // Not `clamp`: that the bounds are in order is known, and it checks for every number.
            let above = if *value < self.lower {
                self.lower
            } else {
                *value
            };
            *value = if above > self.upper {
                self.upper
            } else {
                above
            };
        }
    }
    /// A point moved along a direction, within the box.
    fn moved(&self, x: &[f64], by: f64, direction: &[f64]) -> Vec<f64> {
        let mut moved: Vec<f64> = x.iter().zip(direction).map(|(x, d)| x + by * d).collect();
        self.clamp(&mut moved);
        moved
    }
    /// A point anywhere in the box.
    pub(super) fn random(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        (0..self.dimensions)
            .map(|_| self.lower + self.width() * rng.random::<f64>())
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
    /// Generation by generation.
    pub history: Vec<Generation>,
    /// How often the function was asked.
    pub evaluations: u64,
    /// Why it ended.
    pub stop: SearchStop,
}

/// A search under way, as a method sees it.
struct Search<'a, O: Objective> {
    objective: &'a O,
    bounds: &'a SearchBox,
    rng: ChaCha8Rng,
    jobs: usize,
    /// Number of the generation being made, from 1, and how many there may be.
    generation: usize,
    generations: usize,
    evaluations: u64,
    best: Found,
    mean: f64,
}

impl<O: Objective> Search<'_, O> {
    /// Values at `positions` that are only smelt at (antennae): counted, not remembered.
    fn probe(&mut self, positions: &[Vec<f64>]) -> Vec<f64> {
        self.evaluations += positions.len() as u64;
        let number = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        let objective = self.objective;
        let values = in_order(self.jobs, positions.len(), |p| objective(&positions[p]));
        values.into_iter().map(number).collect()
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

    /// Individuals of a `population`: a lone beetle has none with it, half of a colony's bees have a source each.
    fn size(self, population: usize) -> usize {
        match self {
            Self::Bas => 1,
            Self::Abc => population.div_ceil(2),
            Self::Bso | Self::Pso | Self::Ga => population,
        }
    }

    /// Evaluations of each generation after the first; a colony's scouts, at most one a generation, come on top.
    fn further(self, size: usize) -> usize {
        match self {
            Self::Bas | Self::Bso => 3 * size,
            Self::Pso => size,
            Self::Ga => size.saturating_sub(ELITE),
            Self::Abc => 2 * size,
        }
    }

    /// Generations of a `population` that fit into so many evaluations.
    pub fn generations(self, population: usize, evaluations: u64) -> usize {
        let size = self.size(population);
        let left = evaluations.saturating_sub(size as u64);
        (left / self.further(size).max(1) as u64) as usize
    }

    /// Evaluations that `generations` of a `population` take; a colony's scouts come on top.
    pub fn evaluations(self, population: usize, generations: usize) -> u64 {
        let size = self.size(population);
        (size + generations * self.further(size)) as u64
    }

    /// Minimises with a `population` (at least 4; a lone beetle has none) within `bounds`; `observe` is called once per generation with the
    /// best position so far.
    pub fn minimise<O: Objective>(
        self,
        population: usize,
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
            generation: 0,
            generations: budget.generations,
            evaluations: 0,
            best: (f64::INFINITY, Vec::new()),
            mean: f64::INFINITY,
        };
        let flies = matches!(self, Self::Bso | Self::Pso);
        let mut swarm = Swarm::start(self.size(population), flies, &mut search);
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
            match self {
                Self::Bas => swarm.antennae_search(&mut search),
                Self::Bso => swarm.beetle_swarm(&mut search),
                Self::Pso => swarm.particle_swarm(&mut search),
                Self::Ga => swarm.genetic(&mut search),
                Self::Abc => swarm.bee_colony(&mut search),
            }
        };
        let (value, position) = search.best;
        SwarmResult {
            position,
            value,
            history,
            evaluations: search.evaluations,
            stop,
        }
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
