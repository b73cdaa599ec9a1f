//! Beetle swarm optimisation (BSO): particle swarm velocities, of which each beetle smells the two ends.
//!
//! Wang et al. (2020), Eqs. 36-40 as corrected. With the new velocity
//! `V <- w V + c1 rand1 (p_i - X) + c2 rand2 (p_g - X)`, antennae at `X +- V d/2` and
//! `xi = -delta V sign(f(X_r) - f(X_l))`, the beetle moves by `X <- X + lambda V + (1 - lambda) xi`; the inertia `w` falls
//! linearly (Eq. 38), `d` and `delta` as in Eq. 34. The paper gives no numbers for lambda, c1, c2 and w: see the default.
//!
//! Beetle antennae search (BAS): one beetle smells left and right of a random direction and steps to the better side.
//!
//! Wang et al. (2020), Eqs. 31-34 as corrected: `x_r = x + d b`, `x_l = x - d b`, `x <- x - delta b sign(f(x_r) - f(x_l))`,
//! `d <- 0.95 d + 0.01`, `delta <- 0.95 delta`. Antennae and beetle stay within the bounds.

use crate::estimate::swarm::{Method, Objective, Search};
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

/// Parameters of beetle antennae search; the default is the paper's.
#[derive(Debug, Clone, PartialEq)]
pub struct BeetleAntennae {
    /// First sensing length `d`, in units of the coordinates.
    pub(crate) antenna: f64,
    /// First step `delta`, in units of the coordinates.
    pub(crate) step: f64,
    /// Factor of both per iteration.
    pub(crate) decay: f64,
    /// What the antenna gains per iteration, so that it never vanishes.
    pub(crate) antenna_floor: f64,
}

impl Default for BeetleAntennae {
    fn default() -> Self {
        Self {
            antenna: 2.0,
            step: 0.5,
            decay: 0.95,
            antenna_floor: 0.01,
        }
    }
}

/// Where the beetle is.
pub struct Beetle {
    position: Vec<f64>,
    best: (f64, Vec<f64>),
    antenna: f64,
    step: f64,
}

impl Method for BeetleAntennae {
    type State = Beetle;

    fn first(&self) -> usize {
        1
    }

    fn further(&self) -> usize {
        3
    }

    fn start<O: Objective>(&self, search: &mut Search<O>) -> Beetle {
        let position = search.bounds.random(&mut search.rng);
        let value = search.visit(std::slice::from_ref(&position))[0];
        Beetle {
            best: (value, position.clone()),
            position,
            antenna: self.antenna,
            step: self.step,
        }
    }

    fn step<O: Objective>(&self, beetle: &mut Beetle, search: &mut Search<O>) {
        let direction = unit_vector(search);
        let smell_at = |sign: f64| {
            let mut x: Vec<f64> = beetle
                .position
                .iter()
                .zip(&direction)
                .map(|(x, b)| x + sign * beetle.antenna * b)
                .collect();
            search.bounds.clamp(&mut x);
            x
        };
        let antennae = [smell_at(1.0), smell_at(-1.0)];
        let values = search.probe(&antennae);
        let turn = sign(values[0], values[1]);
        for (x, b) in beetle.position.iter_mut().zip(&direction) {
            *x -= beetle.step * b * turn;
        }
        search.bounds.clamp(&mut beetle.position);
        let value = search.visit(std::slice::from_ref(&beetle.position))[0];
        if value < beetle.best.0 {
            beetle.best = (value, beetle.position.clone());
        }
        beetle.antenna = self.decay * beetle.antenna + self.antenna_floor;
        beetle.step *= self.decay;
    }

    fn elite(&self, beetle: &Beetle) -> Vec<(f64, Vec<f64>)> {
        vec![beetle.best.clone()]
    }
}

/// Eq. 31: components in -1..1, scaled to length one.
fn unit_vector<O: Objective>(search: &mut Search<O>) -> Vec<f64> {
    loop {
        let b: Vec<f64> = (0..search.bounds.dimensions())
            .map(|_| search.rng.random_range(-1.0..1.0))
            .collect();
        let length = b.iter().map(|x| x * x).sum::<f64>().sqrt();
        // A vector this short has no direction; with one coordinate or more it is drawn again at once.
        if length > 1e-9 {
            return b.into_iter().map(|x| x / length).collect();
        }
        if b.is_empty() {
            return b;
        }
    }
}

/// The sign of `right - left` with sign(0) = 0, also where both are infinite.
pub(super) fn sign(right: f64, left: f64) -> f64 {
    match right.partial_cmp(&left) {
        Some(std::cmp::Ordering::Greater) => 1.0,
        Some(std::cmp::Ordering::Less) => -1.0,
        _ => 0.0,
    }
}
