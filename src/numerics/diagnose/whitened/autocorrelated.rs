//! Noise that correlation from point to point, as of moving air or a tripod: first-order autoregressive beside white noise, in standard deviations
//! of each axis. Its innovations (Kalman, 1960) are white, so that causes which change slowly compete against it on equal terms.

use crate::criteria::noise::GROSS;
use crate::linear::mean_square;

/// Noise of which a part is correlated along the rows of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AutocorrelatedNoise {
    /// Correlation of that part from one row of the recording to the next.
    pub(crate) correlation: f64,
    /// Its share of the variance.
    pub(crate) share: f64,
}

/// Tried values, from short to long.
const AR1_COEFFICIENTS: [f64; 10] = [0.4, 0.55, 0.7, 0.8, 0.86, 0.9, 0.93, 0.96, 0.98, 0.99];
const SHARES: [f64; 10] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];

impl AutocorrelatedNoise {
    /// White noise.
    pub(crate) const NONE: Self = Self {
        correlation: 0.0,
        share: 0.0,
    };

    /// All that are tried, white noise (`None`) first.
    pub(crate) fn all() -> impl Iterator<Item = Option<Self>> {
        let some = AR1_COEFFICIENTS.into_iter().flat_map(|correlation| {
            SHARES
                .into_iter()
                .map(move |share| Self { correlation, share })
        });
        std::iter::once(None).chain(some.map(Some))
    }

    /// Brings gross residuals back to where they no longer hide what the others share.
    pub(crate) fn without_gross(residual: &mut [f64]) {
        let most = *GROSS * mean_square(residual).sqrt();
        let values = residual.iter_mut();
        values.for_each(|value| *value = value.clamp(-most, most));
    }

    /// The share times the autocorrelation time.
    pub(crate) fn length(self) -> f64 {
        self.share * (1.0 + self.correlation) / (1.0 - self.correlation)
    }

    /// The filter of columns with `width` numbers for each of these rows of the recording, ascending.
    pub(crate) fn filter(&self, rows: &[usize], width: usize) -> Innovations {
        let mut variance = self.share;
        let mut steps = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let decay = if i == 0 {
                0.0
            } else {
                self.correlation
                    .powi((row - rows[i - 1]).min(i32::MAX as usize) as i32)
            };
            // The correlated part before the row was seen, then after.
            variance = self.share + decay * decay * (variance - self.share);
            let whole = variance + 1.0 - self.share;
            let gain = variance / whole;
            steps.push(FilterStep { decay, gain, whole });
            variance *= 1.0 - gain;
        }
        Innovations { steps, width }
    }
}

struct FilterStep {
    decay: f64,
    gain: f64,
    /// Variance of the innovation.
    whole: f64,
}

/// What each row says beyond the rows before it.
pub(crate) struct Innovations {
    steps: Vec<FilterStep>,
    /// Numbers of a row.
    width: usize,
}

impl Innovations {
    /// Takes a column to its innovations in standard deviations.
    pub(crate) fn apply(&self, column: &mut [f64]) {
        let mut drift = vec![0.0; self.width];
        for (step, row) in self.steps.iter().zip(column.chunks_exact_mut(self.width)) {
            let sigma = step.whole.sqrt();
            for (drift, value) in drift.iter_mut().zip(row) {
                *drift *= step.decay;
                let new = *value - *drift;
                *drift += new * step.gain;
                *value = new / sigma;
            }
        }
    }

    /// ln of the determinant of the readings' covariance.
    pub(crate) fn determinant(&self) -> f64 {
        self.width as f64 * self.steps.iter().map(|step| step.whole.ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    /// Numbers of unit variance, three a row, of which `share` is correlated.
    fn noise(rows: usize, correlation: f64, share: f64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut even = move || (12.0f64).sqrt() * (rng.random::<f64>() - 0.5);
        let mut now = [0.0; 3].map(|_: f64| even());
        let mut row = |_| {
            now = now.map(|value| {
                correlation * value + (1.0 - correlation * correlation).sqrt() * even()
            });
            now.map(|value| share.sqrt() * value + (1.0 - share).sqrt() * even())
        };
        (0..rows).flat_map(&mut row).collect()
    }

    #[test]
    fn innovations_of_correlated_noise_are_white_and_of_unit_size() {
        let mut column = noise(4000, 0.9, 0.7);
        let rows: Vec<usize> = (0..4000).collect();
        AutocorrelatedNoise {
            correlation: 0.9,
            share: 0.7,
        }
        .filter(&rows, 3)
        .apply(&mut column);
        let product = |lag: usize| {
            column
                .iter()
                .zip(&column[3 * lag..])
                .map(|(a, b)| a * b)
                .sum::<f64>()
                / column.len() as f64
        };
        assert!((product(0) - 1.0).abs() < 0.05, "{}", product(0));
        for lag in [1, 2, 5] {
            assert!(product(lag).abs() < 0.04, "lag {lag}: {}", product(lag));
        }
    }

    #[test]
    fn rows_left_out_are_bridged_by_as_many_steps() {
        // Every third row only: what correlation 0.9 from row to row correlation 0.729 from one of these to the next.
        let rows: Vec<usize> = (0..400).map(|k| 3 * k).collect();
        let all = noise(1200, 0.9, 1.0);
        let mut column: Vec<f64> = rows
            .iter()
            .flat_map(|row| all[3 * row..3 * row + 3].to_vec())
            .collect();
        let mut other = column.clone();
        AutocorrelatedNoise {
            correlation: 0.9,
            share: 1.0,
        }
        .filter(&rows, 3)
        .apply(&mut column);
        AutocorrelatedNoise {
            correlation: 0.729,
            share: 1.0,
        }
        .filter(&(0..400).collect::<Vec<_>>(), 3)
        .apply(&mut other);
        assert!(
            column
                .iter()
                .zip(&other)
                .all(|(a, b)| (a - b).abs() < 1e-12)
        );
    }

    #[test]
    fn innovations_have_the_likelihood_of_the_noise() {
        let rows: Vec<usize> = (0..80).collect();
        let cost = |model: AutocorrelatedNoise, noise: &[f64]| {
            let (mut column, innovations) = (noise.to_vec(), model.filter(&rows, 3));
            innovations.apply(&mut column);
            column.iter().map(|value| value * value).sum::<f64>() + innovations.determinant()
        };
        let likeliest = |noise: &[f64]| {
            let all =
                AutocorrelatedNoise::all().map(|noise| noise.unwrap_or(AutocorrelatedNoise::NONE));
            all.min_by(|a, b| cost(*a, noise).total_cmp(&cost(*b, noise)))
                .expect("some")
        };
        let found = likeliest(&noise(80, 0.9, 1.0));
        assert!(
            (0.8..=0.96).contains(&found.correlation) && found.share > 0.6,
            "{found:?}"
        );
        let white = noise(80, 0.0, 0.0);
        let gain = cost(AutocorrelatedNoise::NONE, &white) - cost(likeliest(&white), &white);
        assert!(gain < 8.0, "{gain}");
    }
}
