//! What a model leaves of the rows, against their noise.

use super::types::Question;
use super::verdict_statement::Ground;
use crate::estimate::{Screening, Weight};
use crate::robot::{Measurements, NoiseBasis};
use nalgebra::Vector3;

/// Sizes of what is left.
pub(crate) struct Misfit {
    /// Held-out rows that belong; where there are none, those that were fitted.
    pub rows: Vec<usize>,
    pub held_out: bool,
    /// Length of the noise of `rows`, and of the instrument's alone, rms, m.
    pub noise_floor: f64,
    pub instrument: f64,
    /// Rms length of what is left at fitted rows, m, and reduced chi-square there.
    pub leftover_rms: f64,
    pub chi_square: f64,
    /// Reduced chi-square at fitted rows against the stated or recorded uncertainty alone.
    pub beyond_stated: f64,
    /// Rows of the figures, suspects among them: held-out ones, else those that were fitted.
    pub figures: Vec<usize>,
    /// Rms length of what is left at `rows`, m.
    left_here: f64,
    /// Rms length of what is left at held-out rows that belong, m, where it is more than what was fitted and the noise allow.
    pub not_carried: Option<f64>,
}

/// A residual this much larger than the noise, in mean square, does not agree with it: where it has structure it is not explained ...
pub(crate) const LOUD: f64 = 1.25;
/// ... and this much larger it is not whatever it looks like.
pub(crate) const TOO_LOUD: f64 = 2.5;

impl Misfit {
    /// Of a model that predicts these points, with so many parameters estimated.
    pub fn of(
        question: &Question,
        data: &Measurements,
        screening: &Screening,
        predicted: &[Vector3<f64>],
        parameters: usize,
    ) -> Self {
        let aside: Vec<usize> = screening.suspects.iter().filter(|s| !s.used()).map(|s| s.row).collect();
        let judges: Vec<usize> = question.validate.iter().copied().filter(|row| !aside.contains(row)).collect();
        let held_out = !judges.is_empty();
        let kept = &screening.kept;
        let rms = |rows: &[usize], length: &dyn Fn(usize) -> f64| {
            (rows.iter().map(|row| length(*row).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
        };
        let whitened = |rows: &[usize]| -> f64 {
            rows.iter()
                .map(|row| Weight::of(data, *row, 0.0).apply(&(data.position[*row] - predicted[*row])).norm_squared())
                .sum()
        };
        let freedom = (3 * kept.len()).saturating_sub(parameters).max(1) as f64;
        // Points that were not fitted also see the errors of what was.
        let inflation = 1.0 + parameters as f64 / freedom;
        let left = |row: usize| (data.position[row] - predicted[row]).norm();
        let not_carried = held_out && whitened(&judges) > TOO_LOUD * inflation * 3.0 * judges.len() as f64;
        let not_carried = not_carried.then(|| rms(&judges, &left));
        let rows = if held_out { judges } else { kept.clone() };
        let stated: f64 =
            kept.iter().map(|row| (data.position[*row] - predicted[*row]).component_div(&data.sigma[*row]).norm_squared()).sum();
        Self {
            held_out,
            noise_floor: rms(&rows, &|row| data.noise(row)),
            instrument: rms(&rows, &|row| data.sigma[row].norm()),
            leftover_rms: rms(kept, &left),
            chi_square: whitened(kept) / freedom,
            beyond_stated: stated / freedom,
            figures: if held_out { question.validate.to_vec() } else { rows.clone() },
            left_here: rms(&rows, &left),
            not_carried,
            rows,
        }
    }

    /// The noise, of which an inferred one is at least the instrument's and no more than what is left.
    pub fn noise(&self, basis: NoiseBasis) -> f64 {
        match basis {
            NoiseBasis::Inferred => self.noise_floor.min(self.left_here.max(self.instrument)),
            NoiseBasis::Repeats | NoiseBasis::Instrument => self.noise_floor,
        }
    }

    /// What a verdict on it rests on; `nameless` where something was found that has no name.
    pub fn ground(&self, data: &Measurements, basis: NoiseBasis, repeats: usize, nameless: bool) -> Ground {
        Ground {
            agrees: self.chi_square <= LOUD,
            not_carried: self.not_carried,
            nameless,
            basis,
            repeats,
            noise: self.noise(basis),
            instrument: (data.noise_basis != NoiseBasis::Inferred).then_some(self.instrument),
            left: self.leftover_rms,
            in_motion: data.in_motion(&self.rows),
        }
    }
}
