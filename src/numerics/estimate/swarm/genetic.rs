//! A genetic algorithm (GA) on real numbers: tournaments, simulated binary crossover (Deb and Agrawal 1995), polynomial mutation
//! (Deb and Goyal 1996) and elitism.

use super::{Method, Objective, Search};
use rand::RngExt;
use rand::rngs::ChaCha8Rng;

/// Parameters of the genetic algorithm; the default is usual for real numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Genetic {
    /// Members.
    pub(crate) individuals: usize,
    /// The best so many live on unchanged.
    pub(crate) elite: usize,
    /// Individuals in a tournament for parenthood.
    pub(crate) tournament: usize,
    /// Share of the pairs that cross.
    pub(crate) crossover: f64,
    /// Distribution index of the crossover: larger keeps children nearer to their parents.
    pub(crate) crossover_index: f64,
    /// Expected number of coordinates of a child that mutate.
    pub(crate) mutations: f64,
    /// Distribution index of the mutation.
    pub(crate) mutation_index: f64,
}

impl Default for Genetic {
    fn default() -> Self {
        Self {
            individuals: 50,
            elite: 2,
            tournament: 2,
            crossover: 0.9,
            crossover_index: 15.0,
            mutations: 1.0,
            mutation_index: 20.0,
        }
    }
}

/// The generation that lives, best first.
pub struct Population(Vec<(f64, Vec<f64>)>);

impl Method for Genetic {
    type State = Population;

    fn first(&self) -> usize {
        self.individuals
    }

    fn further(&self) -> usize {
        self.individuals.saturating_sub(self.elite)
    }

    fn start<O: Objective>(&self, search: &mut Search<O>) -> Population {
        let positions: Vec<Vec<f64>> = (0..self.individuals)
            .map(|_| search.bounds.random(&mut search.rng))
            .collect();
        let values = search.visit(&positions);
        Population(ranked(values.into_iter().zip(positions).collect()))
    }

    fn step<O: Objective>(&self, population: &mut Population, search: &mut Search<O>) {
        let mut children = Vec::with_capacity(self.further() + 1);
        while children.len() < self.further() {
            let mut pair = [0, 1].map(|_| population.0[self.parent(&mut search.rng)].1.clone());
            self.cross(&mut pair, search);
            for mut child in pair {
                self.mutate(&mut child, search);
                search.bounds.clamp(&mut child);
                children.push(child);
            }
        }
        children.truncate(self.further());
        let values = search.visit(&children);
        population.0.truncate(self.elite);
        population.0.extend(values.into_iter().zip(children));
        population.0 = ranked(std::mem::take(&mut population.0));
    }

    fn elite(&self, population: &Population) -> Vec<(f64, Vec<f64>)> {
        population.0.clone()
    }
}

impl Genetic {
    /// The winner of a tournament: positions are best first, so the smallest number wins.
    fn parent(&self, rng: &mut ChaCha8Rng) -> usize {
        (0..self.tournament.max(1))
            .map(|_| rng.random_range(0..self.individuals))
            .min()
            .unwrap_or(0)
    }

    /// Spreads two children about the middle of their parents as a one-point crossover of binary numbers would.
    fn cross<O: Objective>(&self, [a, b]: &mut [Vec<f64>; 2], search: &mut Search<O>) {
        if search.rng.random::<f64>() >= self.crossover {
            return;
        }
        for (a, b) in a.iter_mut().zip(b) {
            // Each coordinate crosses with one half, else the children inherit it as it is.
            if search.rng.random::<bool>() {
                continue;
            }
            let u: f64 = search.rng.random();
            let power = 1.0 / (self.crossover_index + 1.0);
            let spread = if u <= 0.5 {
                (2.0 * u).powf(power)
            } else {
                (0.5 / (1.0 - u)).powf(power)
            };
            let (middle, half) = (0.5 * (*a + *b), 0.5 * spread * (*b - *a));
            (*a, *b) = (middle - half, middle + half);
        }
    }

    fn mutate<O: Objective>(&self, child: &mut [f64], search: &mut Search<O>) {
        let rate = self.mutations / child.len() as f64;
        for (s, x) in child.iter_mut().enumerate() {
            if search.rng.random::<f64>() >= rate {
                continue;
            }
            let u: f64 = search.rng.random();
            let power = 1.0 / (self.mutation_index + 1.0);
            let shift = if u < 0.5 {
                (2.0 * u).powf(power) - 1.0
            } else {
                1.0 - (2.0 * (1.0 - u)).powf(power)
            };
            *x += shift * search.bounds.width(s);
        }
    }
}

fn ranked(mut population: Vec<(f64, Vec<f64>)>) -> Vec<(f64, Vec<f64>)> {
    population.sort_by(|a, b| a.0.total_cmp(&b.0));
    population
}
