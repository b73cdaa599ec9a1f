//! The five optimisers by name, with the parameters of their papers.

use super::{
    BeeColony, BeetleAntennae, BeetleSwarm, Budget, Generation, Genetic, Method, Objective,
    ParticleSwarm, SearchBox, SwarmResult, minimise,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
