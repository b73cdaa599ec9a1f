//! What a model leaves of the rows, against their noise.

use super::types::Question;
use super::words::Ground;
use crate::criteria::noise::{MAX_CHI_SQUARE, MAX_CHI_SQUARE_OF_STRUCTURE};
use crate::criteria::search::SIGNIFICANT;
use crate::criteria::words::FAR_OFF;
use crate::effect::PlacementBuffers;
use crate::estimate::{Model, Screening, noise, tail};
use crate::observation::{
    Dimension, KINDS, MeasurementKind, Residual, dimension, kinds, only_contacts,
};
use crate::robot::{Measurements, NoiseBasis};
use rayon::prelude::*;

/// Sizes of what is left: lengths (m), or angles (rad) where no row to fit measured a length.
pub(crate) struct Misfit {
    pub(crate) dimension: Dimension,
    /// Size of what is left of every row, where it measured something of the dimension.
    pub(crate) sizes: Vec<Option<f64>>,
    /// Held-out rows that belong; where there are none, those that were fitted.
    pub(crate) rows: Vec<usize>,
    pub(crate) held_out: bool,
    /// Length of the noise of `rows`, and of the instrument's alone, rms.
    pub(crate) noise_floor: f64,
    pub(crate) instrument: f64,
    /// Rms size of what is left at fitted rows, and reduced chi-square there.
    pub(crate) leftover_rms: f64,
    pub(crate) chi_square: f64,
    /// Reduced chi-square at fitted rows against the stated or recorded uncertainty alone.
    pub(crate) beyond_stated: f64,
    /// Rows of the figures, suspects among them but those that bear another row's name: held-out ones, else those that were fitted.
    pub(crate) figures: Vec<usize>,
    /// Rms size of what is left at `rows`.
    left_here: f64,
    /// Rms size of what is left at held-out rows that belong, where it is more than what was fitted and the noise allow.
    pub(crate) not_carried: Option<f64>,
    /// Sum of squared residuals of `rows`, in standard deviations, and their number.
    pub(crate) square: f64,
    pub(crate) values: usize,
}

/// What is left of all that a row measured.
struct RowMisfit {
    size: Option<f64>,
    /// Squared and summed, in standard deviations of all noise and of the instrument's alone.
    whitened: f64,
    stated: f64,
    values: usize,
}

/// What a model leaves of every row.
fn left(model: &Model, data: &Measurements, dimension: Dimension) -> Vec<RowMisfit> {
    let kinds = kinds(data);
    let one = |scratch: &mut PlacementBuffers, row: usize| {
        let placed = model
            .stack
            .place(&model.robot, data, row, &model.x, scratch);
        let mut left = RowMisfit {
            size: None,
            whitened: 0.0,
            stated: 0.0,
            values: 0,
        };
        let residual =
            |kind: &&'static dyn MeasurementKind| Residual::of(*kind, data, row, &placed);
        for residual in kinds.iter().filter_map(residual) {
            if residual.dimension() == dimension {
                left.size.get_or_insert(residual.error.norm());
            }
            left.whitened += residual.whitened(data, 0.0).norm_squared();
            left.stated += residual.kind.stated(data, row, &residual.error);
            left.values += residual.axes;
        }
        left
    };
    (0..data.rows())
        .into_par_iter()
        .map_init(|| model.stack.scratch(&model.robot), one)
        .collect()
}

fn rms(values: impl Iterator<Item = Option<f64>>) -> f64 {
    let (sum, count) = values.flatten().fold((0.0, 0usize), |(sum, count), value| {
        (sum + value.powi(2), count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}

impl Misfit {
    /// The misfit of a model, of which so many parameters were estimated.
    pub(crate) fn of(
        question: &Question,
        data: &Measurements,
        screening: &Screening,
        model: &Model,
        parameters: usize,
    ) -> Self {
        let dimension = dimension(data, question.fit);
        let left = left(model, data, dimension);
        let aside = screening.suspects.iter().filter(|suspect| !suspect.used());
        let aside: Vec<usize> = aside.map(|suspect| suspect.row).collect();
        let mut judges = question.validate.to_vec();
        judges.retain(|row| !aside.contains(row));
        let mut figures = question.validate.to_vec();
        let elsewhere = |row: usize| {
            let mut all = screening.suspects.iter();
            all.any(|suspect| suspect.row == row && suspect.bears_another_name())
        };
        figures.retain(|row| !elsewhere(*row));
        let held_out = !judges.is_empty();
        let kept = &screening.kept;
        let size = |rows: &[usize]| rms(rows.iter().map(|row| left[*row].size));
        let whitened = |rows: &[usize]| -> f64 { rows.iter().map(|row| left[*row].whitened).sum() };
        let values = |rows: &[usize]| -> usize { rows.iter().map(|row| left[*row].values).sum() };
        let freedom = values(kept).saturating_sub(parameters).max(1) as f64;
        // Rows that were not fitted also see the errors of what was.
        let inflation = 1.0 + parameters as f64 / freedom;
        let ratio = whitened(&judges) / (inflation * values(&judges).max(1) as f64);
        // Few points are that far off by chance.
        let chance = tail(ratio, values(&judges) as f64, freedom);
        let not_carried = held_out && ratio > *MAX_CHI_SQUARE && chance < *SIGNIFICANT;
        let not_carried = not_carried.then(|| size(&judges));
        let rows = if held_out { judges } else { kept.clone() };
        let stated: f64 = kept.iter().map(|row| left[*row].stated).sum();
        let instrument = |row: &usize| {
            let mut kinds = KINDS
                .iter()
                .filter(|kind| kind.about().dimension == dimension);
            kinds.find_map(|kind| kind.instrument(data, *row))
        };
        Self {
            square: whitened(&rows),
            values: values(&rows),
            dimension,
            held_out,
            noise_floor: rms(rows.iter().map(|row| noise(data, *row, dimension))),
            instrument: rms(rows.iter().map(instrument)),
            leftover_rms: size(kept),
            chi_square: whitened(kept) / freedom,
            beyond_stated: stated / freedom,
            figures: match held_out {
                true => figures,
                false => rows.clone(),
            },
            left_here: size(&rows),
            not_carried,
            rows,
            sizes: left.iter().map(|row| row.size).collect(),
        }
    }

    /// Whether the residuals of `rows` exceed those of the fitted rows by more than an inexact curve explains.
    pub(crate) fn is_far_off(&self) -> bool {
        self.square / self.values.max(1) as f64 > *FAR_OFF * self.chi_square.max(1.0)
    }

    /// Sum of squared residuals of another model at `rows`, in standard deviations.
    pub(crate) fn square_of(&self, model: &Model, data: &Measurements) -> f64 {
        let left = left(model, data, self.dimension);
        self.rows.iter().map(|row| left[*row].whitened).sum()
    }

    /// The noise, of which an inferred one is at least the instrument's and no more than what is left.
    pub(crate) fn noise(&self, basis: NoiseBasis) -> f64 {
        match basis {
            NoiseBasis::Inferred => self.noise_floor.min(self.left_here.max(self.instrument)),
            NoiseBasis::Repeats | NoiseBasis::Instrument => self.noise_floor,
        }
    }

    /// What a verdict on it rests on; `nameless` where something was found that has no name.
    pub(crate) fn ground(
        &self,
        data: &Measurements,
        basis: NoiseBasis,
        repeats: usize,
        nameless: bool,
    ) -> Ground {
        Ground {
            dimension: self.dimension,
            agrees: self.chi_square <= *MAX_CHI_SQUARE_OF_STRUCTURE,
            not_carried: self.not_carried,
            nameless,
            partly_nameless: false,
            basis,
            repeats,
            noise: self.noise(basis),
            instrument: (data.noise_basis != NoiseBasis::Inferred).then_some(self.instrument),
            left: self.leftover_rms,
            in_motion: data.in_motion(&self.rows),
            contacts_only: only_contacts(data, &self.rows),
        }
    }
}
