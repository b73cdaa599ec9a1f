//! The calibration problem: weighted residuals of some rows under some free parameters.

use super::factor::{RowSums, StackedRows, SummedRows, TriangularFactor, axpy};
use super::model::Model;
use crate::effect::PlacedRow;
use crate::observation::{
    Dimension, ExcessSigma, KINDS, MeasurementKind, Residual, RowView, Sensitivity, kinds,
};
use crate::robot::Measurements;
use crate::statistics::MEDIAN_CHI2;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Rows of the recording that one thread takes at once where they are factored: fixed, so that sums do not depend on the number of threads.
const SPAN: usize = 1024;
/// So many parts at most, whose sums are held at once, where only sums of products are taken.
const PARTS: usize = 64;
/// Rows whose derivatives are held at once: three lines or so each of some fifty columns stay in the processor's cache.
const CHUNK: usize = 256;

/// What is fitted to what: residual rows (measured - predicted) / sigma with Huber's weights.
pub(crate) struct Problem<'a> {
    pub(crate) data: &'a Measurements,
    /// Rows of the recording to fit.
    pub(crate) rows: &'a [usize],
    /// Standard deviations added to the instrument's: what the model does not explain.
    pub(crate) excess: ExcessSigma,
}

/// The state of a problem at some parameters.
pub(crate) struct Evaluation {
    /// Measured - predicted, in the order of the problem's rows; of a row in the order of kinds.
    pub(crate) residuals: Vec<Residual>,
    /// Sum of Huber's losses, of the priors' and of known lengths', dimensionless.
    pub(crate) cost: f64,
    /// Sum over contacts of the logarithm of the volume that joint noise is spread over, and its derivatives by the
    /// parameters.
    pub(crate) volume: f64,
    pub(crate) pull: Vec<f64>,
    /// Root mean square of the residual length of points, or of another length where no point was measured, m.
    pub(crate) rms: f64,
    pub(crate) factor: TriangularFactor,
}

impl Evaluation {
    /// What is minimised: the cost less the volume, minus the logarithm of the likelihood but for constants.
    pub(crate) fn objective(&self) -> f64 {
        self.cost - self.volume
    }
}

/// Residuals of some rows, and what their derivatives sum to.
struct Linearised<S> {
    residuals: Vec<Residual>,
    /// Sum of Huber's losses.
    cost: f64,
    volume: f64,
    pull: Vec<f64>,
    sum: S,
}

impl<S> Linearised<S> {
    fn with(self, cost: f64, factor: TriangularFactor) -> Evaluation {
        Evaluation {
            rms: rms(&self.residuals),
            residuals: self.residuals,
            cost,
            volume: self.volume,
            pull: self.pull,
            factor,
        }
    }
}

impl<'a> Problem<'a> {
    pub(crate) fn new(data: &'a Measurements, rows: &'a [usize], excess: ExcessSigma) -> Self {
        Self { data, rows, excess }
    }

    /// Length in standard deviations and number of axes of every residual.
    pub(crate) fn errors(&self, residuals: &[Residual]) -> Vec<(f64, usize)> {
        let length = |residual: &Residual| {
            residual
                .whitened(self.data, self.excess.of(residual.dimension()))
                .norm()
        };
        residuals
            .iter()
            .map(|residual| (length(residual), residual.axes))
            .collect()
    }

    /// The problem at the model's parameters, linearised in the `free` ones, with what is known of them beforehand. That scales all columns
    /// alike, so that sums of products, which take a fraction of the time, are exact enough; what they do not tell from rounding is factored.
    pub(crate) fn evaluate(&self, model: &Model, free: &[usize]) -> Evaluation {
        let part = self.rows.len().div_ceil(PARTS).next_multiple_of(CHUNK);
        let mut data = self.linearised::<SummedRows>(model, free, part);
        let cost = data.cost + model.add_priors(free, &mut data.sum);
        for (j, pull) in data.pull.iter().enumerate() {
            data.sum[(free.len(), j)] += pull;
        }
        match TriangularFactor::of_products(&data.sum) {
            Some(factor) => data.with(cost, factor),
            None => {
                let data = self.observe(model, free);
                let factor = model.with_priors(free, data.factor.clone());
                Evaluation {
                    factor: factor.pulled(&data.pull),
                    cost,
                    ..data
                }
            }
        }
    }

    /// The same from the data alone.
    pub(crate) fn observe(&self, model: &Model, free: &[usize]) -> Evaluation {
        let data = self.linearised::<StackedRows>(model, free, SPAN);
        let (cost, factor) = (data.cost, data.sum.clone());
        data.with(cost, factor)
    }

    /// Residuals and derivatives of all rows, in parts of so many.
    fn linearised<S: RowSums>(
        &self,
        model: &Model,
        free: &[usize],
        part: usize,
    ) -> Linearised<S::Sum> {
        let column = columns(model, free);
        let spans: Vec<Linearised<S::Sum>> = self
            .rows
            .par_chunks(part.max(1))
            .map(|span| self.span::<S>(model, span, &column, free.len()))
            .collect();
        let whole = spans.into_iter().reduce(|mut sum, span| {
            sum.residuals.extend(span.residuals);
            sum.volume += span.volume;
            axpy(1.0, &span.pull, &mut sum.pull);
            sum.sum = S::both(sum.sum, span.sum);
            sum
        });
        let whole = whole.unwrap_or_else(|| self.span::<S>(model, &[], &column, free.len()));
        let errors = self.errors(&whole.residuals).into_iter();
        Linearised {
            cost: errors.map(|(error, axes)| huber(error, axes)).sum(),
            ..whole
        }
    }

    /// Residuals and sums of some rows, in memory of a chunk.
    fn span<S: RowSums>(
        &self,
        model: &Model,
        rows: &[usize],
        column: &[Option<usize>],
        p: usize,
    ) -> Linearised<S::Sum> {
        let mut scratch = model.stack.scratch(&model.robot);
        let data = self.data;
        let kinds = kinds(data);
        // Three lines for each kind, whatever a row has of it.
        let lines_of_row = 3 * kinds.len();
        let mut tall = S::new(p + 1, lines_of_row * rows.len().min(CHUNK));
        let mut residuals = Vec::with_capacity(rows.len());
        let (mut volume, mut pull) = (0.0, vec![0.0; p]);
        for chunk in rows.chunks(CHUNK) {
            let height = lines_of_row * chunk.len();
            let mut lines = tall.chunk(height);
            let mut write = |first: usize, term: ObservationTerm, placed: &mut PlacedRow| {
                let share = term.share();
                term.sensitivity
                    .derivatives(placed, |parameter, derivative| {
                        if let Some(j) = column[parameter] {
                            axpy(share, derivative.as_slice(), &mut lines[j][first..]);
                        }
                    });
                axpy(share, term.error.as_slice(), &mut lines[p][first..]);
            };
            for (i, &row) in chunk.iter().enumerate() {
                let mut placed = model.place(self.data, row, &mut scratch);
                for (k, kind) in kinds.iter().enumerate() {
                    if let Some((term, residual)) =
                        ObservationTerm::of(*kind, self.data, row, &placed, self.excess)
                    {
                        write(lines_of_row * i + 3 * k, term, &mut placed);
                        residuals.push(residual);
                        if let Some(closing) = kind.closing(RowView {
                            data,
                            row,
                            placed: &placed,
                        }) {
                            let log_volume = placed.log_volume(&closing, |parameter, change| {
                                column[parameter]
                                    .into_iter()
                                    .for_each(|j| pull[j] += change);
                            });
                            volume += log_volume.unwrap_or_default();
                        }
                    }
                }
            }
            tall.absorb(height);
        }
        Linearised {
            residuals,
            cost: 0.0,
            volume,
            pull,
            sum: tall.sum(),
        }
    }
}

/// Root mean square of the lengths (m) of the first kind that measured one.
fn rms(residuals: &[Residual]) -> f64 {
    let lengths = KINDS
        .iter()
        .map(|kind| kind.about())
        .filter(|kind| kind.dimension == Dimension::Length);
    let squares = |name: &str| -> Vec<f64> {
        let of_kind = residuals
            .iter()
            .filter(|residual| residual.kind.about().name == name);
        of_kind
            .map(|residual| residual.error.norm_squared())
            .collect()
    };
    let first = lengths
        .map(|kind| squares(kind.name))
        .find(|squares| !squares.is_empty())
        .unwrap_or_default();
    (first.iter().sum::<f64>() / first.len().max(1) as f64).sqrt()
}

/// Beyond this whitened error length (99.3 % of good terms of one, two, three numbers are below) a term pulls with constant force.
const HUBER_BY_AXES: [f64; 4] = [f64::INFINITY, 2.7, 3.15, HUBER];
pub(crate) const HUBER: f64 = 3.5;

/// Weighted residual and derivatives of one kind in one row.
pub(crate) struct ObservationTerm {
    /// Measured - predicted in standard deviations.
    pub(crate) error: Vector3<f64>,
    pub(crate) axes: usize,
    /// Derivatives of what was predicted, in standard deviations per unit of the parameter.
    pub(crate) sensitivity: Sensitivity,
}

impl ObservationTerm {
    /// With `excess` in addition to the measurement's noise. `None` where the row measured none.
    pub fn of(
        kind: &'static dyn MeasurementKind,
        data: &Measurements,
        row: usize,
        placed: &PlacedRow,
        excess: ExcessSigma,
    ) -> Option<(Self, Residual)> {
        let residual = Residual::of(kind, data, row, placed)?;
        let weight = residual.weight(data, excess.of(residual.dimension()));
        let error = weight.apply(&residual.error);
        let sensitivity = residual.sensitivity(data, placed, weight);
        Some((
            Self {
                error,
                axes: residual.axes,
                sensitivity,
            },
            residual,
        ))
    }

    /// Root of Huber's weight: the share by which errors and derivatives count.
    pub(crate) fn share(&self) -> f64 {
        share(self.error.norm(), self.axes)
    }
}

/// Where each parameter of the stack is among the `free` ones.
pub(crate) fn columns(model: &Model, free: &[usize]) -> Vec<Option<usize>> {
    let mut column = vec![None; model.stack.specs().len()];
    for (j, parameter) in free.iter().enumerate() {
        column[*parameter] = Some(j);
    }
    column
}

/// Root of Huber's weight of an error of so many axes, in standard deviations.
pub(crate) fn share(error: f64, axes: usize) -> f64 {
    let bound = bound(axes);
    if error > bound {
        (bound / error).sqrt()
    } else {
        1.0
    }
}

/// Where Huber's loss turns linear for a term of so many axes.
pub(crate) fn bound(axes: usize) -> f64 {
    HUBER_BY_AXES[axes]
}

pub(crate) fn huber(error: f64, axes: usize) -> f64 {
    let bound = bound(axes);
    if error <= bound {
        0.5 * error * error
    } else {
        bound * (error - 0.5 * bound)
    }
}

/// Factor by which a squared error of so many axes has the median of three.
pub(crate) fn as_of_three(axes: usize) -> f64 {
    MEDIAN_CHI2[3] / MEDIAN_CHI2[axes]
}
