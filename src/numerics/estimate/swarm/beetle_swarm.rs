//! Beetle swarm optimisation (BSO): particle swarm velocities, of which each beetle smells the two ends.
//!
//! Wang et al. (2020), Eqs. 36-40 as corrected. With the new velocity
//! `V <- w V + c1 rand1 (p_i - X) + c2 rand2 (p_g - X)`, antennae at `X +- V d/2` and
//! `xi = -delta V sign(f(X_r) - f(X_l))`, the beetle moves by `X <- X + lambda V + (1 - lambda) xi`; the inertia `w` falls
//! linearly (Eq. 38), `d` and `delta` as in Eq. 34. The paper gives no numbers for lambda, c1, c2 and w: see the default.

use super::beetle_antennae::sign;
use super::{Method, Objective, Search};
use rand::RngExt;

/// Parameters of beetle swarm optimisation.
#[derive(Debug, Clone, PartialEq)]
pub struct BeetleSwarm {
    /// Members.
    pub beetles: usize,
    /// Share of the swarm's velocity in a move; the rest follows the antennae.
    pub lambda: f64,
    /// Pull to the beetle's own best position.
    pub c1: f64,
    /// Pull to the swarm's best position.
    pub c2: f64,
    /// Inertia at the start and at the end.
    pub inertia: [f64; 2],
    /// First antenna `d`, in velocities.
    pub antenna: f64,
    /// First step `delta`, in velocities.
    pub step: f64,
    /// Factor of both per generation.
    pub decay: f64,
    /// What the antenna gains per generation.
    pub antenna_floor: f64,
    /// Fastest move per generation as a share of the width of the bounds.
    pub fastest: f64,
}

impl Default for BeetleSwarm {
    fn default() -> Self {
        Self {
            beetles: 50,
            lambda: 0.6,
            c1: 2.0,
            c2: 2.0,
            inertia: [0.9, 0.4],
            antenna: 2.0,
            step: 0.5,
            decay: 0.95,
            antenna_floor: 0.01,
            fastest: 0.2,
        }
    }
}

/// Where the beetles are and what they remember.
pub struct Swarm {
    positions: Vec<Vec<f64>>,
    velocities: Vec<Vec<f64>>,
    best: Vec<(f64, Vec<f64>)>,
    antenna: f64,
    step: f64,
}

impl Method for BeetleSwarm {
    type State = Swarm;

    fn first(&self) -> usize {
        self.beetles
    }

    fn further(&self) -> usize {
        3 * self.beetles
    }

    fn start<O: Objective>(&self, search: &mut Search<O>) -> Swarm {
        let bounds = search.bounds;
        let positions: Vec<Vec<f64>> = (0..self.beetles)
            .map(|_| bounds.random(&mut search.rng))
            .collect();
        let mut speed =
            |s: usize| self.fastest * bounds.width(s) * search.rng.random_range(-1.0..1.0);
        let velocities = (0..self.beetles)
            .map(|_| (0..bounds.dimensions()).map(&mut speed).collect())
            .collect();
        let values = search.visit(&positions);
        let best = values.into_iter().zip(positions.iter().cloned()).collect();
        Swarm {
            positions,
            velocities,
            best,
            antenna: self.antenna,
            step: self.step,
        }
    }

    fn step<O: Objective>(&self, swarm: &mut Swarm, search: &mut Search<O>) {
        let inertia = search.falling(self.inertia);
        let limits: Vec<f64> = (0..search.bounds.dimensions())
            .map(|s| self.fastest * search.bounds.width(s))
            .collect();
        for ((velocity, position), best) in swarm
            .velocities
            .iter_mut()
            .zip(&swarm.positions)
            .zip(&swarm.best)
        {
            let goals = best.1.iter().zip(&search.best.1);
            for (((v, x), (best, group)), limit) in
                velocity.iter_mut().zip(position).zip(goals).zip(&limits)
            {
                let individual = self.c1 * search.rng.random::<f64>() * (best - x);
                let group = self.c2 * search.rng.random::<f64>() * (group - x);
                *v = (inertia * *v + individual + group).clamp(-limit, *limit);
            }
        }
        let half = swarm.antenna / 2.0;
        let mut antennae = Vec::with_capacity(2 * self.beetles);
        for (position, velocity) in swarm.positions.iter().zip(&swarm.velocities) {
            for side in [half, -half] {
                let mut end: Vec<f64> = position
                    .iter()
                    .zip(velocity)
                    .map(|(x, v)| x + side * v)
                    .collect();
                search.bounds.clamp(&mut end);
                antennae.push(end);
            }
        }
        let smells = search.probe(&antennae);
        for (i, position) in swarm.positions.iter_mut().enumerate() {
            let turn = -swarm.step * sign(smells[2 * i], smells[2 * i + 1]);
            for (x, v) in position.iter_mut().zip(&swarm.velocities[i]) {
                *x += self.lambda * v + (1.0 - self.lambda) * turn * v;
            }
            search.bounds.clamp(position);
        }
        let values = search.visit(&swarm.positions);
        super::remember(&mut swarm.best, &swarm.positions, &values);
        swarm.antenna = self.decay * swarm.antenna + self.antenna_floor;
        swarm.step *= self.decay;
    }

    fn elite(&self, swarm: &Swarm) -> Vec<(f64, Vec<f64>)> {
        swarm.best.clone()
    }
}
