//! Particle swarm optimisation (PSO) with falling inertia: Kennedy and Eberhart (1995), Shi and Eberhart (1998).
//!
//! `V <- w V + c1 rand1 (p_i - X) + c2 rand2 (p_g - X)`, `X <- X + V`; `w` falls linearly, no speed exceeds a share of the bounds.

use super::{Method, Objective, Search};
use rand::RngExt;

/// Parameters of particle swarm optimisation; the default is that of Shi and Eberhart.
#[derive(Debug, Clone, PartialEq)]
pub struct ParticleSwarm {
    /// Members.
    pub particles: usize,
    /// Pull to the particle's own best position.
    pub c1: f64,
    /// Pull to the swarm's best position.
    pub c2: f64,
    /// Inertia at the start and at the end.
    pub inertia: [f64; 2],
    /// Fastest move per generation as a share of the width of the bounds.
    pub fastest: f64,
}

impl Default for ParticleSwarm {
    fn default() -> Self {
        Self {
            particles: 50,
            c1: 2.0,
            c2: 2.0,
            inertia: [0.9, 0.4],
            fastest: 0.2,
        }
    }
}

/// Where the particles are, how fast, and what they remember.
pub struct Particles {
    positions: Vec<Vec<f64>>,
    velocities: Vec<Vec<f64>>,
    best: Vec<(f64, Vec<f64>)>,
}

impl Method for ParticleSwarm {
    type State = Particles;

    fn first(&self) -> usize {
        self.particles
    }

    fn further(&self) -> usize {
        self.particles
    }

    fn start<O: Objective>(&self, search: &mut Search<O>) -> Particles {
        let bounds = search.bounds;
        let positions: Vec<Vec<f64>> = (0..self.particles)
            .map(|_| bounds.random(&mut search.rng))
            .collect();
        let mut speed =
            |s: usize| self.fastest * bounds.width(s) * search.rng.random_range(-1.0..1.0);
        let velocities = (0..self.particles)
            .map(|_| (0..bounds.dimensions()).map(&mut speed).collect())
            .collect();
        let values = search.visit(&positions);
        let best = values.into_iter().zip(positions.iter().cloned()).collect();
        Particles {
            positions,
            velocities,
            best,
        }
    }

    fn step<O: Objective>(&self, swarm: &mut Particles, search: &mut Search<O>) {
        let inertia = search.falling(self.inertia);
        let Particles {
            positions,
            velocities,
            best,
        } = swarm;
        for ((position, velocity), best) in positions.iter_mut().zip(velocities).zip(best.iter()) {
            for (s, v) in velocity.iter_mut().enumerate() {
                let individual = self.c1 * search.rng.random::<f64>() * (best.1[s] - position[s]);
                let group = self.c2 * search.rng.random::<f64>() * (search.best.1[s] - position[s]);
                let limit = self.fastest * search.bounds.width(s);
                *v = (inertia * *v + individual + group).clamp(-limit, limit);
                position[s] += *v;
            }
            search.bounds.clamp(position);
        }
        let values = search.visit(positions);
        super::remember(best, positions, &values);
    }

    fn elite(&self, swarm: &Particles) -> Vec<(f64, Vec<f64>)> {
        swarm.best.clone()
    }
}
