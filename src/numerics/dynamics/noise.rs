//! Noise of filtered torques: of each joint an autoregressive course, by which rows are whitened before least squares.

use crate::criteria::torque::MEMORY;
use std::ops::Range;

/// How many rows before a row remembers, at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoiseMemory {
    /// What a rich model leaves: slow noise went with what is slow in that model.
    Short = 0,
    /// What a set leaves: slow noise is all there.
    Long = 1,
}

/// The noise of one joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct JointNoise {
    /// Nm, of the course.
    pub(crate) sigma: f64,
    /// Nm, of what is new in a row.
    pub(crate) innovation: f64,
    /// Share of the rows before, nearest first.
    pub(crate) memory: Vec<f64>,
}

impl JointNoise {
    /// White noise.
    pub(crate) fn white(sigma: f64) -> Self {
        Self {
            sigma,
            innovation: sigma,
            memory: Vec::new(),
        }
    }

    /// The noise of a residual over runs of rows, `spent` of whose freedoms a fit has taken: Yule and Walker's equations by Levinson, the order by
    /// Akaike's criterion.
    pub(crate) fn of(
        residual: &[f64],
        runs: &[Range<usize>],
        spent: f64,
        longest: NoiseMemory,
    ) -> Self {
        let longest = MEMORY[longest as usize];
        let rows: usize = runs.iter().map(Range::len).sum();
        let correlation: Vec<f64> = (0..=longest)
            .map(|lag| {
                let product = |run: &Range<usize>| {
                    let run = &residual[run.clone()];
                    run.iter()
                        .zip(run.get(lag..).unwrap_or_default())
                        .map(|(a, b)| a * b)
                        .sum::<f64>()
                };
                runs.iter().map(product).sum::<f64>() / rows.max(1) as f64
            })
            .collect();
        let freedom = rows as f64 / (rows as f64 - spent).max(1.0);
        let mut memory: Vec<f64> = Vec::new();
        let mut left = correlation[0].max(f64::MIN_POSITIVE);
        let mut best = (rows as f64 * left.ln(), left, memory.clone());
        for order in 1..=longest {
            let ahead: f64 = memory
                .iter()
                .enumerate()
                .map(|(lag, share)| share * correlation[order - 1 - lag])
                .sum();
            let reflection = (correlation[order] - ahead) / left;
            let turned: Vec<f64> = memory.iter().rev().copied().collect();
            memory
                .iter_mut()
                .zip(turned)
                .for_each(|(share, back)| *share -= reflection * back);
            memory.push(reflection);
            left *= 1.0 - reflection * reflection;
            let criterion = rows as f64 * left.max(f64::MIN_POSITIVE).ln() + 2.0 * order as f64;
            if criterion < best.0 {
                best = (criterion, left, memory.clone());
            }
        }
        Self {
            sigma: (correlation[0] * freedom).sqrt(),
            innovation: (best.1 * freedom).sqrt(),
            memory: best.2,
        }
    }

    /// How many rows in a row count as one for what is slow.
    pub(crate) fn autocorrelation(&self) -> f64 {
        let gain = 1.0 - self.memory.iter().sum::<f64>();
        (self.innovation / self.sigma / gain.max(1e-3)).powi(2)
    }

    /// What is new in each row of the runs, in standard deviations; the first rows of a run only serve as memory.
    pub(crate) fn whiten(&self, course: &[f64], runs: &[Range<usize>], out: &mut Vec<f64>) {
        let scale = 1.0 / self.innovation;
        for run in runs {
            let rows = &course[run.clone()];
            for now in self.memory.len()..rows.len() {
                let known: f64 = self
                    .memory
                    .iter()
                    .enumerate()
                    .map(|(back, share)| share * rows[now - 1 - back])
                    .sum();
                out.push((rows[now] - known) * scale);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn a_course_that_remembers_is_found_with_its_memory_and_whitened() {
        let mut dice = ChaCha8Rng::seed_from_u64(1);
        let mut now = 0.0;
        let course: Vec<f64> = (0..20_000)
            .map(|_| {
                now = 0.8 * now + (0..12).map(|_| dice.random::<f64>() - 0.5).sum::<f64>();
                now
            })
            .collect();
        let whole = 0..course.len();
        let runs = std::slice::from_ref(&whole);
        let noise = JointNoise::of(&course, runs, 0.0, NoiseMemory::Short);
        assert!(
            (noise.memory[0] - 0.8).abs() < 0.03 && (noise.innovation - 1.0).abs() < 0.02,
            "{noise:?}"
        );
        // (1 + 0.8) / (1 - 0.8).
        assert!(
            (noise.autocorrelation() / 9.0 - 1.0).abs() < 0.15,
            "{}",
            noise.autocorrelation()
        );
        let mut white = Vec::new();
        noise.whiten(&course, runs, &mut white);
        let lag = white.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / white.len() as f64;
        assert!(lag.abs() < 0.03, "{lag}");
    }

    #[test]
    fn slow_noise_in_quick_noise_is_seen_at_its_full_density_by_the_long_memory() {
        let mut dice = ChaCha8Rng::seed_from_u64(2);
        let mut normal = || (0..12).map(|_| dice.random::<f64>() - 0.5).sum::<f64>();
        // 25 rows a second: white, and with a quarter of its variance what lasts a fifth of a second.
        let keeps = libm::exp(-0.2_f64);
        let mut now = 0.0;
        let course: Vec<f64> = (0..100_000)
            .map(|_| {
                now = keeps * now + (1.0 - keeps * keeps).sqrt() * normal();
                0.5 * now + normal()
            })
            .collect();
        let runs = 0..course.len();
        let at_rest = |memory: NoiseMemory| {
            let noise = JointNoise::of(&course, std::slice::from_ref(&runs), 0.0, memory);
            let gain = 1.0 - noise.memory.iter().sum::<f64>();
            (noise.innovation / gain).powi(2)
        };
        // Spectral density of the sum at rest: 1 + (1 - k^2) / (1 - k)^2 / 4. Yule and Walker's equations of its correlations, solved apart, see
        // 0.797 of it with 4 rows and 0.989 with 12.
        let density = 1.0 + 0.25 * (1.0 - keeps * keeps) / (1.0 - keeps).powi(2);
        let [short, long] =
            [NoiseMemory::Short, NoiseMemory::Long].map(|memory| at_rest(memory) / density);
        assert!((short - 0.797).abs() < 0.05, "{short}");
        assert!((long - 0.989).abs() < 0.05, "{long}");
    }
}
