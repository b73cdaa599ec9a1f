//! One generation of each method, from a swarm that is the same for all.
//!
//! **Beetle antennae search (BAS)**: one beetle smells left and right of a random direction and steps to the better side. Wang et al.
//! (2020), Eqs. 31-34 as corrected: `x_r = x + d b`, `x_l = x - d b`, `x <- x - delta b sign(f(x_r) - f(x_l))`, `d <- 0.95 d + 0.01`,
//! `delta <- 0.95 delta`. Antennae and beetle stay within the bounds.
//!
//! **Particle swarm optimisation (PSO)**: Kennedy and Eberhart (1995), inertia that falls as Shi and Eberhart (1998) have it:
//! `V <- w V + c1 rand1 (p_i - X) + c2 rand2 (p_g - X)`, `X <- X + V`; no speed exceeds a share of the bounds.
//!
//! **Beetle swarm optimisation (BSO)**: those velocities, of which each beetle smells the two ends. Wang et al. (2020), Eqs. 36-40 as
//! corrected: antennae at `X +- V d/2`, `xi = -delta V sign(f(X_r) - f(X_l))`, `X <- X + lambda V + (1 - lambda) xi`; `w` as in Eq. 38, `d` and
//! `delta` as in Eq. 34. The paper gives no numbers for lambda, c1, c2 and w.
//!
//! **A genetic algorithm (GA)** on real numbers: tournaments, simulated binary crossover (Deb and Agrawal 1995), polynomial mutation
//! (Deb and Goyal 1996) and elitism.
//!
//! **The artificial bee colony (ABC)**: Karaboga (2005), Karaboga and Basturk (2007). Employed bees try `v_s = x_s + phi (x_s - x_ks)` in one
//! coordinate near their source, onlookers do so near sources drawn by fitness `1 / (1 + f)` (`1 + |f|` below zero), and a source that
//! `limit` trials did not better is left for a random one. All bees of a phase fly at once, from the sources as they are when it begins.

use super::{Objective, Search};
use rand::RngExt;
use rand::rngs::ChaCha8Rng;

/// First antenna `d` and step `delta` (of BAS in units of the coordinates, of BSO in velocities), the factor of both per generation, and what the
/// antenna gains per generation, so that it never vanishes.
const ANTENNA: f64 = 2.0;
const STEP: f64 = 0.5;
const DECAY: f64 = 0.95;
const ANTENNA_FLOOR: f64 = 0.01;
/// Pull to the individual's best position and to the swarm's; inertia at the start and at the end; fastest move per generation as a share of the
/// width of the bounds.
const PULL: [f64; 2] = [2.0, 2.0];
const INERTIA: [f64; 2] = [0.9, 0.4];
const FASTEST: f64 = 0.2;
/// Share of the swarm's velocity in a beetle's move; the antennae make the rest.
const LAMBDA: f64 = 0.6;
/// The best so many of a population live on unchanged.
pub(super) const ELITE: usize = 2;
/// Individuals in a tournament for parenthood; share of the pairs that cross; distribution indices of crossover and mutation, of which larger
/// ones keep children nearer to their parents; expected number of coordinates of a child that mutate.
const TOURNAMENT: usize = 2;
const CROSSOVER: f64 = 0.9;
const CROSSOVER_INDEX: f64 = 15.0;
const MUTATION_INDEX: f64 = 20.0;
const MUTATIONS: f64 = 1.0;
/// Trials without gain after which a source is left, per coordinate and source.
const LIMIT: f64 = 1.0;

/// A value and where it was found.
pub(super) type Found = (f64, Vec<f64>);

/// The individuals: where each is, how fast, and what it remembers.
pub(super) struct Swarm {
    positions: Vec<Vec<f64>>,
    values: Vec<f64>,
    /// The best position of each so far; of a genetic algorithm the generation that lives, best first.
    pub(super) best: Vec<Found>,
    velocities: Vec<Vec<f64>>,
    antenna: f64,
    step: f64,
    /// Trials that did not better each source.
    trials: Vec<usize>,
}

impl Swarm {
    /// The first generation, anywhere in the bounds.
    pub(super) fn start<O: Objective>(size: usize, flies: bool, search: &mut Search<O>) -> Self {
        let bounds = search.bounds;
        let positions: Vec<Vec<f64>> = (0..size).map(|_| bounds.random(&mut search.rng)).collect();
        let mut speed = |_| FASTEST * bounds.width() * search.rng.random_range(-1.0..1.0);
        let velocities = (0..if flies { size } else { 0 })
            .map(|_| (0..bounds.dimensions).map(&mut speed).collect())
            .collect();
        let values = search.visit(&positions);
        Self {
            best: values
                .iter()
                .copied()
                .zip(positions.iter().cloned())
                .collect(),
            positions,
            values,
            velocities,
            antenna: ANTENNA,
            step: STEP,
            trials: vec![0; size],
        }
    }

    /// Visits where the individuals are now; each remembers what is better than before.
    fn visit<O: Objective>(&mut self, search: &mut Search<O>) {
        self.values = search.visit(&self.positions);
        let now = self.values.iter().zip(&self.positions);
        for (best, (value, position)) in self.best.iter_mut().zip(now) {
            if *value < best.0 {
                *best = (*value, position.clone());
            }
        }
    }

    fn shrink_antennae(&mut self) {
        self.antenna = DECAY * self.antenna + ANTENNA_FLOOR;
        self.step *= DECAY;
    }

    pub(super) fn antennae_search<O: Objective>(&mut self, search: &mut Search<O>) {
        let direction = unit_vector(search);
        let position = &mut self.positions[0];
        let sides = [self.antenna, -self.antenna];
        let smells =
            search.probe(&sides.map(|side| search.bounds.moved(position, side, &direction)));
        let turn = -self.step * sign(smells[0], smells[1]);
        *position = search.bounds.moved(position, turn, &direction);
        self.visit(search);
        self.shrink_antennae();
    }

    /// New velocities, drawn individual by individual.
    fn accelerate<O: Objective>(&mut self, search: &mut Search<O>) {
        let inertia = search.falling(INERTIA);
        let members = self.velocities.iter_mut().zip(&self.positions);
        for ((velocity, position), (_, best)) in members.zip(&self.best) {
            for (s, v) in velocity.iter_mut().enumerate() {
                let pulls = [best[s], search.best.1[s]];
                let [individual, group] =
                    [0, 1].map(|k| PULL[k] * search.rng.random::<f64>() * (pulls[k] - position[s]));
                let limit = FASTEST * search.bounds.width();
                *v = (inertia * *v + individual + group).clamp(-limit, limit);
            }
        }
    }

    pub(super) fn particle_swarm<O: Objective>(&mut self, search: &mut Search<O>) {
        self.accelerate(search);
        for (position, velocity) in self.positions.iter_mut().zip(&self.velocities) {
            *position = search.bounds.moved(position, 1.0, velocity);
        }
        self.visit(search);
    }

    pub(super) fn beetle_swarm<O: Objective>(&mut self, search: &mut Search<O>) {
        self.accelerate(search);
        let half = self.antenna / 2.0;
        let bounds = search.bounds;
        let ends = self.positions.iter().zip(&self.velocities);
        let ends = ends.flat_map(|(x, v)| [half, -half].map(|side| bounds.moved(x, side, v)));
        let smells = search.probe(&ends.collect::<Vec<_>>());
        for (i, position) in self.positions.iter_mut().enumerate() {
            let turn = -self.step * sign(smells[2 * i], smells[2 * i + 1]);
            for (x, v) in position.iter_mut().zip(&self.velocities[i]) {
                *x += LAMBDA * v + (1.0 - LAMBDA) * turn * v;
            }
            bounds.clamp(position);
        }
        self.visit(search);
        self.shrink_antennae();
    }

    pub(super) fn genetic<O: Objective>(&mut self, search: &mut Search<O>) {
        let population = &mut self.best;
        let size = population.len();
        ranked(population);
        let count = size.saturating_sub(ELITE);
        let mut children = Vec::with_capacity(count + 1);
        while children.len() < count {
            let mut pair = [0, 1].map(|_| population[parent(size, &mut search.rng)].1.clone());
            cross(&mut pair, &mut search.rng);
            for mut child in pair {
                mutate(&mut child, search);
                search.bounds.clamp(&mut child);
                children.push(child);
            }
        }
        children.truncate(count);
        let values = search.visit(&children);
        population.truncate(ELITE);
        population.extend(values.into_iter().zip(children));
        ranked(population);
    }

    pub(super) fn bee_colony<O: Objective>(&mut self, search: &mut Search<O>) {
        let count = self.values.len();
        self.fly(&(0..count).collect::<Vec<_>>(), search);
        let fitness = |value: &f64| match *value >= 0.0 {
            true => 1.0 / (1.0 + value),
            false => 1.0 - value,
        };
        let fitness: Vec<f64> = self.values.iter().map(fitness).collect();
        let total: f64 = fitness.iter().sum();
        let onlookers: Vec<usize> = (0..count)
            .map(|_| {
                let mut left = search.rng.random::<f64>() * total;
                let drawn = fitness.iter().position(|share| {
                    left -= share;
                    left < 0.0
                });
                drawn.unwrap_or(count - 1)
            })
            .collect();
        self.fly(&onlookers, search);
        let limit = LIMIT * (count * search.bounds.dimensions) as f64;
        let tired = (0..count)
            .max_by_key(|i| (self.trials[*i], count - i))
            .unwrap_or(0);
        if self.trials[tired] as f64 > limit {
            let position = search.bounds.random(&mut search.rng);
            self.values[tired] = search.visit(std::slice::from_ref(&position))[0];
            self.positions[tired] = position;
            self.trials[tired] = 0;
        }
        search.mean = self.values.iter().sum::<f64>() / count as f64;
    }

    /// One bee near each of `sources`; a source moves to what is better.
    fn fly<O: Objective>(&mut self, sources: &[usize], search: &mut Search<O>) {
        let count = self.values.len();
        let mut candidates = Vec::with_capacity(sources.len());
        for i in sources {
            let mut x = self.positions[*i].clone();
            let s = search.rng.random_range(0..x.len());
            let k = (i + 1 + search.rng.random_range(0..count.max(2) - 1)) % count;
            x[s] += search.rng.random_range(-1.0..1.0) * (x[s] - self.positions[k][s]);
            search.bounds.clamp(&mut x);
            candidates.push(x);
        }
        let values = search.visit(&candidates);
        for ((i, x), value) in sources.iter().zip(candidates).zip(values) {
            if value < self.best[*i].0 {
                self.best[*i] = (value, x.clone());
            }
            if value < self.values[*i] {
                (self.values[*i], self.positions[*i]) = (value, x);
                self.trials[*i] = 0;
            } else {
                self.trials[*i] += 1;
            }
        }
    }
}

/// Eq. 31: components in -1..1, scaled to length one.
fn unit_vector<O: Objective>(search: &mut Search<O>) -> Vec<f64> {
    loop {
        let b: Vec<f64> = (0..search.bounds.dimensions)
            .map(|_| search.rng.random_range(-1.0..1.0))
            .collect();
        let length = b.iter().map(|x| x * x).sum::<f64>().sqrt();
        // A vector this short has no direction; with one coordinate or more it is drawn again at once.
        if length > 1e-9 || b.is_empty() {
            return b.into_iter().map(|x| x / length).collect();
        }
    }
}

/// The sign of `right - left` with sign(0) = 0, also where both are infinite.
fn sign(right: f64, left: f64) -> f64 {
    match right.partial_cmp(&left) {
        Some(std::cmp::Ordering::Greater) => 1.0,
        Some(std::cmp::Ordering::Less) => -1.0,
        _ => 0.0,
    }
}

/// The winner of a tournament: positions are best first, so the smallest number wins.
fn parent(size: usize, rng: &mut ChaCha8Rng) -> usize {
    let drawn = (0..TOURNAMENT).map(|_| rng.random_range(0..size));
    drawn.min().unwrap_or(0)
}

/// Spreads two children about the middle of their parents as a one-point crossover of binary numbers would.
fn cross([a, b]: &mut [Vec<f64>; 2], rng: &mut ChaCha8Rng) {
    if rng.random::<f64>() >= CROSSOVER {
        return;
    }
    for (a, b) in a.iter_mut().zip(b) {
        // Each coordinate crosses with one half, else the children inherit it as it is.
        if rng.random::<bool>() {
            continue;
        }
        let u: f64 = rng.random();
        let ratio = if u <= 0.5 { 2.0 * u } else { 0.5 / (1.0 - u) };
        let spread = ratio.powf(1.0 / (CROSSOVER_INDEX + 1.0));
        let (middle, half) = (0.5 * (*a + *b), 0.5 * spread * (*b - *a));
        (*a, *b) = (middle - half, middle + half);
    }
}

fn mutate<O: Objective>(child: &mut [f64], search: &mut Search<O>) {
    let rate = MUTATIONS / child.len() as f64;
    for x in child.iter_mut() {
        if search.rng.random::<f64>() >= rate {
            continue;
        }
        let u: f64 = search.rng.random();
        let power = 1.0 / (MUTATION_INDEX + 1.0);
        let shift = if u < 0.5 {
            (2.0 * u).powf(power) - 1.0
        } else {
            1.0 - (2.0 * (1.0 - u)).powf(power)
        };
        *x += shift * search.bounds.width();
    }
}

/// Best first.
fn ranked(found: &mut [Found]) {
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
}
