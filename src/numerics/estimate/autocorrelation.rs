//! Rows of a moving arm that say the same: noise that lasts from row to row is not as many observations as there are rows.
//!
//! The integrated autocorrelation time 1 + 2 sum r_k of whitened residuals (Sokal, 1997), summed until five times itself, or until
//! what is left is chance.

/// Beyond so many autocorrelation times the sum is noise.
const WINDOW: f64 = 5.0;
/// Beyond this share of the rows nothing can be said.
const FARTHEST: usize = 20;
/// A correlation within so many standard deviations of chance is none.
const CHANCE: f64 = 3.0;

/// How many rows in a row count as one, from `each` numbers a row in the order of recording; at least 1.
pub fn autocorrelation_time(residual: &[f64], each: usize) -> f64 {
    let rows = residual.len() / each.max(1);
    let square: f64 = residual.iter().map(|value| value * value).sum();
    if rows < FARTHEST || square == 0.0 {
        return 1.0;
    }
    let chance = CHANCE / (residual.len() as f64).sqrt();
    let mut time = 1.0;
    for lag in 1..=rows / FARTHEST {
        let product: f64 = residual
            .iter()
            .zip(&residual[lag * each..])
            .map(|(a, b)| a * b)
            .sum();
        let correlation = product / square;
        if correlation < chance || lag as f64 > WINDOW * time {
            break;
        }
        time += 2.0 * correlation;
    }
    time
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    /// Noise of which `share` lasts from row to row.
    fn lasting(share: f64) -> Vec<f64> {
        let mut dice = ChaCha8Rng::seed_from_u64(5);
        let mut now = [0.0; 3];
        let fresh = (1.0 - share * share).sqrt();
        let row = |_| {
            now = now.map(|value| share * value + fresh * (dice.random::<f64>() - 0.5));
            now
        };
        (0..4000).flat_map(row).collect()
    }

    #[test]
    fn lasting_noise_counts_for_as_many_rows_as_theory_says() {
        // 1 + 2 sum share^k = (1 + share) / (1 - share).
        for (share, expected) in [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)] {
            let found = autocorrelation_time(&lasting(share), 3);
            assert!((found / expected - 1.0).abs() < 0.25, "{share}: {found}");
        }
    }
}
