//! How far out noise reaches: Student's t in three dimensions, fitted to the bulk of the rows (Lange, Little and Taylor, 1989).

use crate::criteria::screen::CHANCE;
/// Degrees of freedom that are tried; the last is nearly normal.
const FREEDOMS: [f64; 9] = [2.0, 2.5, 3.0, 4.0, 6.0, 10.0, 20.0, 50.0, 200.0];
/// Steps of expectation and maximisation: the scale settles long before.
const STEPS: usize = 30;
/// Logarithm of a length that nothing exceeds; steps of the tail's integral for every factor of e.
const OUTSIDE: f64 = 30.0;
const FINE: f64 = 40.0;

/// The distance (standard deviations) beyond which noise with the tails of these `distances` has a row of `rows` by chance at
/// most [`CHANCE`] times. Zero without distances.
pub(super) fn reach(distances: &[f64], rows: usize) -> f64 {
    let fits = FREEDOMS
        .iter()
        .map(|freedom| Tail::fitted(distances, *freedom));
    let best = fits.max_by(|a, b| a.likelihood.total_cmp(&b.likelihood));
    best.filter(|_| !distances.is_empty())
        .map_or(0.0, |tail| tail.quantile(*CHANCE / rows.max(1) as f64))
}

/// Lengths of vectors that follow Student's t.
struct Tail {
    freedom: f64,
    /// Standard deviation of the normal part, per axis.
    scale: f64,
    /// Logarithm, but for what is the same for all.
    likelihood: f64,
}

impl Tail {
    fn fitted(distances: &[f64], freedom: f64) -> Self {
        let count = distances.len() as f64;
        let mut square = distances.iter().map(|r| r * r).sum::<f64>() / (3.0 * count.max(1.0));
        for _ in 0..STEPS {
            let weighted = distances
                .iter()
                .map(|r| (freedom + 3.0) / (freedom + r * r / square) * r * r);
            square = (weighted.sum::<f64>() / (3.0 * count.max(1.0))).max(f64::MIN_POSITIVE);
        }
        let mut tail = Self {
            freedom,
            scale: square.sqrt(),
            likelihood: 0.0,
        };
        tail.likelihood = distances
            .iter()
            .map(|r| tail.density(r / tail.scale).ln() - tail.scale.ln())
            .sum();
        tail
    }

    /// Density of a length in units of the scale.
    fn density(&self, length: f64) -> f64 {
        let v = self.freedom;
        let gammas = libm::lgamma((v + 3.0) / 2.0)
            - libm::lgamma(v / 2.0)
            - 1.5 * (v * std::f64::consts::PI).ln();
        let shape = -(v + 3.0) / 2.0 * (length * length / v).ln_1p();
        4.0 * std::f64::consts::PI * length * length * (gammas + shape).exp()
    }

    /// The length that is exceeded with `probability`, in the unit of the distances.
    fn quantile(&self, probability: f64) -> f64 {
        // From far out inwards, on a logarithmic scale.
        let (mut at, mut beyond) = (OUTSIDE, 0.0);
        while beyond < probability && at > -OUTSIDE {
            let length = at.exp();
            beyond += self.density(length) * length / FINE;
            at -= 1.0 / FINE;
        }
        self.scale * at.exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    /// Lengths of normal vectors, or with `freedom` of vectors of Student's t.
    fn lengths(count: usize, freedom: Option<usize>, seed: u64) -> Vec<f64> {
        let mut dice = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = move || {
            let (a, b): (f64, f64) = (1.0 - dice.random::<f64>(), dice.random());
            (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
        };
        let mut square = move |of: usize| (0..of).map(|_| normal().powi(2)).sum::<f64>();
        let mut one = move || match freedom {
            None => square(3).sqrt(),
            Some(v) => (square(3) * v as f64 / square(v)).sqrt(),
        };
        (0..count).map(|_| one()).collect()
    }

    #[test]
    fn normal_noise_of_a_thousand_rows_reaches_five_standard_deviations() {
        // The chi-square distribution with 3 degrees of freedom exceeds 5.28 squared with 5e-6.
        let reach = reach(&lengths(1000, None, 1), 1000);
        assert!((4.9..6.5).contains(&reach), "{reach}");
    }

    #[test]
    fn heavy_tails_are_reached_by_their_own_rows_as_rarely_as_stated() {
        let out = |seed: &u64| {
            let all = lengths(150, Some(3), *seed);
            let bulk: Vec<f64> = all.iter().copied().filter(|r| *r < 20.0).collect();
            let reach = reach(&bulk, all.len());
            all.iter().any(|r| *r > reach)
        };
        let wrong = (0..400).filter(out).count();
        assert!(wrong <= 8, "{wrong} of 400");
    }
}
