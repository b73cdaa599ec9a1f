//! Seeded randomness: one stream a purpose, so that a change of one does not move the others.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// What randomness is for; each has its own stream of the seed.
#[derive(Debug, Clone, Copy)]
pub enum Purpose {
    /// Which poses are measured.
    Poses = 1,
    /// Noise of the tracker's points.
    Tracker = 2,
    /// Noise of motor currents.
    Current = 3,
    /// Scatter of joints from move to move.
    Repeatability = 4,
    /// The pace of measurement.
    Clock = 5,
    /// What is concealed, and how.
    Design = 6,
    /// Gross errors of the recording.
    Faults = 7,
}

/// A stream of random numbers.
pub struct Noise(ChaCha8Rng);

impl Noise {
    /// Numbers of one purpose: other purposes do not shift them.
    pub fn new(seed: u64, purpose: Purpose) -> Noise {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(purpose as u64);
        Noise(generator)
    }

    /// Uniform in [lower, upper).
    pub fn uniform(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.0.random::<f64>()
    }

    /// Standard normal (Box and Muller's cosine half).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.0.random::<f64>()).cos()
    }

    /// One of `0..count`; 0 where there is none.
    pub(crate) fn index(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    /// Fisher and Yates.
    pub(crate) fn shuffle<T>(&mut self, all: &mut [T]) {
        for last in (1..all.len()).rev() {
            all.swap(last, self.index(last + 1));
        }
    }

    /// +1 or -1.
    pub(crate) fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// A phase in whole degrees.
    pub(crate) fn phase(&mut self) -> f64 {
        self.uniform(-180.0, 180.0).round()
    }

    /// A size between two bounds above 0, evenly on a logarithmic scale.
    pub(crate) fn size(&mut self, lower: f64, upper: f64) -> f64 {
        (self.uniform(lower.ln(), upper.ln())).exp()
    }

    /// A vector of a length between two bounds, in any direction.
    pub(crate) fn vector(&mut self, lower: f64, upper: f64) -> [f64; 3] {
        let arrow = [self.normal(), self.normal(), self.normal()];
        let length = arrow.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-12);
        let wanted = self.uniform(lower, upper);
        arrow.map(|x| x * wanted / length)
    }
}
