//! Noise that lasts from point to point, as of moving air or a tripod: first-order autoregressive beside white noise, in standard deviations
//! of each axis. Its innovations (Kalman, 1960) are white, so that causes which change slowly compete against it on equal terms.

use nalgebra::Vector3;

/// Noise of which a part wanders along the rows of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Memory {
    /// Correlation of the wandering part from one row of the recording to the next.
    pub lasts: f64,
    /// The wandering part's share of the variance.
    pub share: f64,
}

/// Tried values, from short to long.
const LASTS: [f64; 10] = [0.4, 0.55, 0.7, 0.8, 0.86, 0.9, 0.93, 0.96, 0.98, 0.99];
const SHARES: [f64; 10] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];

/// Residuals of so many standard deviations count as gross: they would hide what the others share.
const GROSS: f64 = 5.0;

impl Memory {
    /// White noise.
    pub const NONE: Self = Self { lasts: 0.0, share: 0.0 };

    /// All that are tried, white noise (`None`) first.
    pub fn all() -> impl Iterator<Item = Option<Self>> {
        let some = LASTS.into_iter().flat_map(|lasts| SHARES.into_iter().map(move |share| Self { lasts, share }));
        std::iter::once(None).chain(some.map(Some))
    }

    /// Brings gross residuals back to where they no longer hide what the others share.
    pub fn without_gross(residual: &mut [f64]) {
        let scale = (residual.iter().map(|value| value * value).sum::<f64>() / residual.len().max(1) as f64).sqrt();
        residual.iter_mut().for_each(|value| *value = value.clamp(-GROSS * scale, GROSS * scale));
    }

    /// -2 ln of the likelihood of whitened residuals, three a row, up to a constant and with their scale estimated.
    pub fn cost(self, residual: &[f64], rows: &[usize]) -> f64 {
        self.filter(rows).cost(residual)
    }

    /// Rows of the recording, ascending.
    pub fn filter(&self, rows: &[usize]) -> Innovations {
        let mut variance = self.share;
        let mut steps = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let decay = if i == 0 { 0.0 } else { self.lasts.powi((row - rows[i - 1]).min(i32::MAX as usize) as i32) };
            // The wandering part before the row was seen, then after.
            variance = self.share + decay * decay * (variance - self.share);
            let whole = variance + 1.0 - self.share;
            let gain = variance / whole;
            steps.push(FilterStep { decay, gain, whole });
            variance *= 1.0 - gain;
        }
        Innovations(steps)
    }
}

struct FilterStep {
    decay: f64,
    gain: f64,
    /// Variance of the innovation.
    whole: f64,
}

/// What each row says beyond the rows before it.
pub(crate) struct Innovations(Vec<FilterStep>);

impl Innovations {
    /// Takes a column, three numbers a row, to its innovations in standard deviations.
    pub fn apply(&self, column: &mut [f64]) {
        let mut wander = Vector3::<f64>::zeros();
        for (step, row) in self.0.iter().zip(column.chunks_exact_mut(3)) {
            wander *= step.decay;
            let new = Vector3::new(row[0], row[1], row[2]) - wander;
            wander += new * step.gain;
            row.copy_from_slice((new / step.whole.sqrt()).as_slice());
        }
    }

    fn cost(&self, column: &[f64]) -> f64 {
        let mut innovations = column.to_vec();
        self.apply(&mut innovations);
        let square: f64 = innovations.iter().map(|value| value * value).sum();
        let n = innovations.len() as f64;
        n * (square / n).ln() + 3.0 * self.0.iter().map(|step| step.whole.ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    /// Numbers of unit variance, three a row, of which `share` wanders.
    fn noise(rows: usize, lasts: f64, share: f64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut even = move || (12.0f64).sqrt() * (rng.random::<f64>() - 0.5);
        let mut now = [0.0; 3].map(|_: f64| even());
        let mut row = |_| {
            now = now.map(|value| lasts * value + (1.0 - lasts * lasts).sqrt() * even());
            now.map(|value| share.sqrt() * value + (1.0 - share).sqrt() * even())
        };
        (0..rows).flat_map(&mut row).collect()
    }

    #[test]
    fn innovations_of_wandering_noise_are_white_and_of_unit_size() {
        let mut column = noise(4000, 0.9, 0.7);
        let rows: Vec<usize> = (0..4000).collect();
        Memory { lasts: 0.9, share: 0.7 }.filter(&rows).apply(&mut column);
        let product = |lag: usize| column.iter().zip(&column[3 * lag..]).map(|(a, b)| a * b).sum::<f64>() / column.len() as f64;
        assert!((product(0) - 1.0).abs() < 0.05, "{}", product(0));
        for lag in [1, 2, 5] {
            assert!(product(lag).abs() < 0.04, "lag {lag}: {}", product(lag));
        }
    }

    #[test]
    fn rows_left_out_are_bridged_by_as_many_steps() {
        // Every third row only: what lasts 0.9 from row to row lasts 0.729 from one of these to the next.
        let rows: Vec<usize> = (0..400).map(|k| 3 * k).collect();
        let all = noise(1200, 0.9, 1.0);
        let mut column: Vec<f64> = rows.iter().flat_map(|row| all[3 * row..3 * row + 3].to_vec()).collect();
        let mut other = column.clone();
        Memory { lasts: 0.9, share: 1.0 }.filter(&rows).apply(&mut column);
        Memory { lasts: 0.729, share: 1.0 }.filter(&(0..400).collect::<Vec<_>>()).apply(&mut other);
        assert!(column.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn the_likeliest_memory_is_that_of_the_noise() {
        let rows: Vec<usize> = (0..80).collect();
        let likeliest = |noise: &[f64]| {
            let cost = |memory: &Option<Memory>| memory.unwrap_or(Memory::NONE).cost(noise, &rows);
            Memory::all().min_by(|a, b| cost(a).total_cmp(&cost(b))).flatten()
        };
        let found = likeliest(&noise(80, 0.9, 1.0)).expect("memory");
        assert!((0.8..=0.96).contains(&found.lasts) && found.share > 0.6, "{found:?}");
        let white = noise(80, 0.0, 0.0);
        let gain = Memory::NONE.cost(&white, &rows) - likeliest(&white).unwrap_or(Memory::NONE).cost(&white, &rows);
        assert!(gain < 8.0, "{gain}");
    }
}
