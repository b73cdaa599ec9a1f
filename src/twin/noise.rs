//! Seeded randomness: one stream a purpose, so that a change of one does not move the others.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// What randomness is for; each has its own stream of the seed.
#[derive(Debug, Clone, Copy)]
pub enum Purpose {
    Poses = 1,
    Tracker = 2,
    Current = 3,
    Repeatability = 4,
    Clock = 5,
}

/// A stream of random numbers.
pub struct Noise(ChaCha8Rng);

impl Noise {
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
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.0.random::<f64>()).cos()
    }
}
