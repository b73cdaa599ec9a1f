//! Whether poses that a fit has not seen are predicted as well as their noise allows.
//!
//! Of a model that holds the physics, F = sum of squared errors of folds over the sum of their noise variances is 1 + p / (s n - p) for n
//! numbers, p parameters and a share s of the rows in each fit. What is above that is physics that the model does not have, however
//! well the fitted rows are followed. Noise that was itself taken from the residual can tell nothing of the kind.

use crate::robot::{Measurements, NoiseBasis};

/// Share of the rows in the fit of each of five folds.
const FITTED: f64 = 0.8;
/// An excess of so many standard errors is no accident.
const CLEARLY: f64 = 4.0;
/// Fewer rows have no standard error worth the name.
const FEWEST: usize = 30;

/// Errors of folds against the noise.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Adequacy {
    /// Standard errors by which the squared errors are above what the noise allows.
    excess: f64,
    /// Squared error beyond the noise, in variances of the noise: -2 ln of the likelihood that is left to explain.
    left: f64,
    /// Rms length (m) of the errors, and what the noise allows.
    lengths: [f64; 2],
}

impl Adequacy {
    /// Of the errors (m) of folds at `rows`, with so many parameters estimated; `None` where the noise is not known apart from them.
    pub fn of(
        errors: &[f64],
        data: &Measurements,
        rows: &[usize],
        parameters: usize,
        basis: (NoiseBasis, usize),
    ) -> Option<Self> {
        let (basis, repeats) = basis;
        // What a statement leaves out of the joints' scatter is known from repeats alone.
        let learnt = match basis {
            NoiseBasis::Repeats => 2.0 / repeats.max(1) as f64,
            NoiseBasis::Instrument => 0.0,
            NoiseBasis::Inferred => return None,
        };
        let (count, parameters) = (rows.len() as f64, parameters as f64);
        let room = FITTED * 3.0 * count - parameters;
        if rows.len() < FEWEST || room <= parameters || errors.len() != rows.len() {
            return None;
        }
        let allowed = 1.0 + parameters / room;
        let squares: Vec<f64> = errors.iter().zip(rows).map(|(error, row)| (error / data.noise(*row)).powi(2)).collect();
        let mean = squares.iter().sum::<f64>() / count;
        let variance = squares.iter().map(|square| (square - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let error = (variance / count + allowed * allowed * learnt).sqrt();
        let rms = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
        let excess = (mean - allowed) / error;
        excess.is_finite().then(|| Self {
            excess,
            left: (3.0 * count * (mean - allowed)).max(0.0),
            lengths: [rms, rms * (allowed / mean).sqrt()],
        })
    }

    /// Rms length (m) of the errors, and what the noise allows, where they are clearly more.
    pub fn lacking(&self) -> Option<[f64; 2]> {
        (self.excess > CLEARLY).then_some(self.lengths)
    }

    /// What is left to explain, in -2 ln of likelihood; 0 where it may be an accident.
    pub fn left(&self) -> f64 {
        if self.excess > CLEARLY { self.left } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn data(rows: usize) -> Measurements {
        Measurements {
            joints: 1,
            q: vec![0.0; rows],
            position: vec![Vector3::zeros(); rows],
            sigma: vec![Vector3::repeat(1e-5); rows],
            payload: vec![0.0; rows],
            ..Measurements::default()
        }
    }

    #[test]
    fn errors_of_the_size_of_the_noise_leave_nothing_and_larger_ones_what_is_above() {
        let (rows, data): (Vec<usize>, _) = ((0..200).collect(), data(200));
        let of = |scale: f64, basis| {
            let noise = 1e-5 * 3f64.sqrt();
            let errors: Vec<f64> = (0..200).map(|k| scale * noise * (0.5 + (k % 11) as f64 / 10.0)).collect();
            Adequacy::of(&errors, &data, &rows, 40, (basis, 0))
        };
        assert_eq!(of(1.0, NoiseBasis::Instrument).map(|it| (it.lacking(), it.left())), Some((None, 0.0)));
        let loud = of(1.6, NoiseBasis::Instrument).expect("enough rows");
        let [found, allowed] = loud.lacking().expect("far above the noise");
        assert!(found > 1.3 * allowed && loud.left() > 500.0, "{loud:?}");
        assert_eq!(of(1.6, NoiseBasis::Inferred), None);
    }
}
