//! Fourier series of joints that begin and end at rest, brought to the limits of each joint.

use std::f64::consts::TAU;

/// s in which the arm starts and stops.
const RAMP: f64 = 1.0;
/// s: a period is not longer.
const PERIOD: f64 = 10.0;
/// Share of a limit that is used.
const USED: f64 = 0.98;

/// What a joint may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct JointLimits {
    /// rad.
    pub(crate) range: [f64; 2],
    /// rad/s.
    pub(crate) speed: f64,
    /// rad/s^2.
    pub(crate) acceleration: f64,
}

/// Sines and cosines of a clock, times the start and stop, with their derivatives: `[row][2 harmonic + (sine or cosine)]`.
pub(super) struct SeriesBasis {
    pub(crate) time: Vec<f64>,
    terms: usize,
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
}

/// Middle (rad) and coefficients of each joint.
pub(super) struct JointSeries(Vec<(f64, Vec<f64>)>);

/// Row-major (rows x n).
pub(super) struct SeriesMotion {
    pub(crate) time: Vec<f64>,
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
}

impl SeriesBasis {
    /// Over `seconds` with `rate` rows a second.
    pub(crate) fn new(seconds: f64, rate: f64, harmonics: usize) -> Self {
        let slowest = TAU * (seconds / PERIOD).ceil() / seconds;
        let time: Vec<f64> = (0..=(seconds * rate).round() as usize)
            .map(|row| row as f64 / rate)
            .collect();
        let (mut position, mut velocity, mut acceleration) = (Vec::new(), Vec::new(), Vec::new());
        for time in &time {
            let [gate, rise, bend] = gate(*time, seconds);
            for harmonic in 1..=harmonics {
                let rate = slowest * harmonic as f64;
                let (sine, cosine) = (rate * time).sin_cos();
                for (value, first) in [(sine, rate * cosine), (cosine, -rate * sine)] {
                    position.push(gate * value);
                    velocity.push(gate * first + rise * value);
                    acceleration.push(2.0 * rise * first + (bend - gate * rate * rate) * value);
                }
            }
        }
        Self {
            time,
            terms: 2 * harmonics,
            position,
            velocity,
            acceleration,
        }
    }

    /// So many rows, evenly spread, the first and the last apart.
    pub(crate) fn spread(&self, count: usize) -> Vec<usize> {
        let count = count.min(self.time.len() - 2).max(1);
        (0..count)
            .map(|one| 1 + (one * (self.time.len() - 2)) / count)
            .collect()
    }

    fn sum(&self, basis: &[f64], row: usize, coefficients: &[f64]) -> f64 {
        basis[self.terms * row..self.terms * (row + 1)]
            .iter()
            .zip(coefficients)
            .map(|(a, b)| a * b)
            .sum()
    }

    /// Positions, velocities and accelerations (3 n) of a row.
    pub(crate) fn row_into(&self, series: &JointSeries, row: usize, motion: &mut [f64]) {
        let n = series.0.len();
        for (joint, (middle, coefficients)) in series.0.iter().enumerate() {
            motion[joint] = middle + self.sum(&self.position, row, coefficients);
            motion[n + joint] = self.sum(&self.velocity, row, coefficients);
            motion[2 * n + joint] = self.sum(&self.acceleration, row, coefficients);
        }
    }

    /// All rows.
    pub(crate) fn motion(&self, series: &JointSeries) -> SeriesMotion {
        let n = series.0.len();
        let mut all = SeriesMotion {
            time: self.time.clone(),
            position: Vec::new(),
            velocity: Vec::new(),
            acceleration: Vec::new(),
        };
        let mut motion = vec![0.0; 3 * n];
        for row in 0..self.time.len() {
            self.row_into(series, row, &mut motion);
            all.position.extend(&motion[..n]);
            all.velocity.extend(&motion[n..2 * n]);
            all.acceleration.extend(&motion[2 * n..]);
        }
        all
    }
}

/// The series of numbers from -1 to 1 (of each joint a place in its range, then coefficients), each joint brought to the limit that it
/// meets first on the rows of a clock.
pub(super) fn scaled(basis: &SeriesBasis, x: &[f64], limits: &[JointLimits]) -> JointSeries {
    let width = 1 + basis.terms;
    let of_course = |(course, limit): (&[f64], &JointLimits)| {
        // Equal speeds of all harmonics are likelier than equal amplitudes.
        let raw: Vec<f64> = course[1..]
            .iter()
            .enumerate()
            .map(|(term, value)| value / (1 + term / 2) as f64)
            .collect();
        let (mut least, mut greatest, mut fastest, mut hardest) =
            (0.0_f64, 0.0_f64, 1e-12_f64, 1e-12_f64);
        for row in 0..basis.time.len() {
            let position = basis.sum(&basis.position, row, &raw);
            (least, greatest) = (least.min(position), greatest.max(position));
            fastest = fastest.max(basis.sum(&basis.velocity, row, &raw).abs());
            hardest = hardest.max(basis.sum(&basis.acceleration, row, &raw).abs());
        }
        let wide = limit.range[1] - limit.range[0];
        let room = wide / (greatest - least).max(1e-12);
        let scale = USED
            * room
                .min(limit.speed / fastest)
                .min(limit.acceleration / hardest);
        let (lowest, highest) = (
            limit.range[0] - scale * least,
            limit.range[1] - scale * greatest,
        );
        let margin = 0.5 * (1.0 - USED) * (highest - lowest);
        let middle = lowest + margin + 0.5 * (course[0] + 1.0) * (highest - lowest - 2.0 * margin);
        (middle, raw.iter().map(|value| scale * value).collect())
    };
    JointSeries(x.chunks_exact(width).zip(limits).map(of_course).collect())
}

/// 0 at both ends, 1 between, with its derivatives.
fn gate(time: f64, seconds: f64) -> [f64; 3] {
    let (near, sign) = if time < 0.5 * seconds {
        (time, 1.0)
    } else {
        (seconds - time, -1.0)
    };
    let x = (near / RAMP).clamp(0.0, 1.0);
    let rise = 30.0 * x * x * (x * (x - 2.0) + 1.0) / RAMP;
    let bend = 60.0 * x * (x * (2.0 * x - 3.0) + 1.0) / (RAMP * RAMP);
    [x * x * x * (10.0 + x * (6.0 * x - 15.0)), sign * rise, bend]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_holds_its_limits_meets_one_and_starts_and_stops_at_rest() {
        let limits = JointLimits {
            range: [-0.5, 1.5],
            speed: 0.8,
            acceleration: 2.0,
        };
        let x: Vec<f64> = (0..11).map(|k| (1.7 * f64::from(k)).sin()).collect();
        let basis = SeriesBasis::new(20.0, 100.0, 5);
        let motion = basis.motion(&scaled(&basis, &x, &[limits]));
        let most = |values: &[f64]| values.iter().map(|value| value.abs()).fold(0.0, f64::max);
        let (speed, acceleration) = (most(&motion.velocity), most(&motion.acceleration));
        assert!(motion.position.iter().all(|q| (-0.5..=1.5).contains(q)));
        assert!(speed <= 0.8 && acceleration <= 2.0);
        assert!(
            speed > 0.97 * 0.8 || acceleration > 0.97 * 2.0,
            "{speed} {acceleration}"
        );
        for end in [0, motion.time.len() - 1] {
            assert!(motion.velocity[end].abs() < 1e-9 && motion.acceleration[end].abs() < 1e-9);
        }
        // Derivatives are those of the positions.
        for row in 100..1900 {
            let differences = (motion.position[row + 1] - motion.position[row - 1]) * 50.0;
            assert!((motion.velocity[row] - differences).abs() < 1e-3);
        }
    }
}
