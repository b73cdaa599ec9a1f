//! Products of two variables as one curve times another: f(u) g(v) has the numbers of two curves where a product in all of its shapes has as
//! many as both multiplied, so that curves with corners and jumps are within reach of a recording.

use super::cause_table::CauseTable;
use super::cell::{CellShape, FreeShape, Over, ShapeGroup, density, fields, over_fields, support};
use super::scan::Refined;
use super::state::{CellColumns, Component, KnownState};
use crate::criteria::cells::{LENGTHS, NU};
use crate::effect::{Basis, Law, Motion};
use nalgebra::DMatrix;

/// Functions of each variable.
const COUNT: usize = Basis::CURVE;
/// Turns of estimating one curve given the other.
const TURNS: usize = 8;
/// Gain of ln of the evidence below which no further turn is made.
const ENOUGH: f64 = 0.1;

type Weights = [f64; COUNT];

/// One of the curves given the other.
struct Half {
    refined: Refined,
    /// The curve, of unit length.
    weights: Weights,
    /// ln of the evidence over that of the likeliest curve: what its numbers cost.
    cost: f64,
}

impl CauseTable<'_, '_> {
    /// A product as one curve times another, each in its likeliest spectrum; none of what is no product.
    pub(crate) fn separable(
        &self,
        free: &FreeShape,
        state: &KnownState,
        others: &[&Component],
    ) -> Option<Refined> {
        let Over::Product(other) = free.over else {
            return None;
        };
        let supports = [free.of, other].map(|of| Some(support(&self.frame.values(of)?)));
        let [Some(first), Some(second)] = supports else {
            return None;
        };
        let supports = [first, second];
        let mut best: Option<Refined> = None;
        let mut weights = self.first_curve(free, supports, state, others)?;
        let mut cost = 0.0;
        let mut last = f64::NEG_INFINITY;
        for turn in 0..TURNS {
            let given = turn % 2;
            let mut half = self.half(free, supports, (given, weights), state, others)?;
            // What the numbers of the curve that is given cost when it was free.
            if turn > 0 {
                half.refined.log += cost;
                if let Some(shape) = &mut half.refined.shape {
                    shape.log_weight += cost;
                }
                let log = half.refined.log;
                if best.as_ref().is_none_or(|best| log > best.log) {
                    best = Some(half.refined);
                }
                if log < last + ENOUGH && turn > 1 {
                    break;
                }
                last = log;
            }
            (weights, cost) = (half.weights, half.cost);
        }
        best
    }

    /// A curve of the first variable from the likeliest product of few functions of each.
    fn first_curve(
        &self,
        free: &FreeShape,
        [[low, high], _]: [[f64; 2]; 2],
        state: &KnownState,
        others: &[&Component],
    ) -> Option<Weights> {
        let values = |of| self.frame.values(of);
        let block = CellColumns::of(free.groups(self.survey, &values, false), self.frame);
        let across = self.across_block(&block, state, others);
        let mut found = (f64::NEG_INFINITY, 0, 0.0);
        state.shapes(&block, &across, 0, |_, shape, evidence| {
            if evidence.log > found.0 {
                found = (evidence.log, shape, evidence.amplitude);
            }
        });
        let coefficients = state.likeliest(&block, &across, (found.1, found.2))?;
        let law = *block.groups[0].group.forms[0].term()?.law();
        let [rows, columns] = [law.first.basis.count(), law.times?.basis.count()];
        let fields = fields(free.motion);
        let at = |i: usize, j: usize, field: usize| {
            place(free.motion, fields, rows * columns, i * columns + j, field)
        };
        let unfolded = DMatrix::from_fn(rows, columns * fields, |i, k| {
            coefficients[at(i, k / fields, k % fields)]
        });
        let leading = leading(&unfolded)?;
        let mut weights = [0.0; COUNT];
        match law.first.basis {
            // Of two or three values: a line is a cosine.
            Basis::Straight { zero, per } => {
                let end = libm::cos(std::f64::consts::PI * (zero - per - low) / (high - low));
                weights[0] = leading[0];
                weights[1] = -leading[1] / end;
            }
            _ => (0..rows.min(COUNT)).for_each(|k| weights[k] = leading[k]),
        }
        Some(weights)
    }

    /// The other curve given one of them: of the first variable if `given` is 0, else of the second.
    fn half(
        &self,
        free: &FreeShape,
        supports: [[f64; 2]; 2],
        (given, weights): (usize, Weights),
        state: &KnownState,
        others: &[&Component],
    ) -> Option<Half> {
        let Over::Product(other) = free.over else {
            return None;
        };
        let basis = |k: usize| {
            let [low, high] = supports[k];
            if k == given {
                Basis::Curve { low, high, weights }
            } else {
                Basis::Series {
                    low,
                    high,
                    count: COUNT,
                }
            }
        };
        let form = free.term(Law::new(free.of, basis(0)).times(other, basis(1)));
        let fields = fields(free.motion);
        let count = (LENGTHS.len() as f64).ln();
        let shape = |length: &f64| {
            let curve = density(COUNT - 1, *length)
                .into_iter()
                .map(|share| 0.5 * share);
            let shares = std::iter::once(0.5).chain(curve).collect();
            CellShape {
                shares: over_fields(shares, free.motion, fields),
                log_weight: -count,
                is_bent: false,
            }
        };
        let group = ShapeGroup {
            forms: vec![form.clone()],
            shapes: LENGTHS.iter().map(shape).collect(),
            positive: false,
            largest: f64::INFINITY,
        };
        let block = CellColumns::of(vec![group], self.frame);
        let across = self.across_block(&block, state, others);
        let (mut log, mut found) = (f64::NEG_INFINITY, None);
        state.shapes(&block, &across, 0, |_, shape, evidence| {
            if evidence.log > log {
                log = evidence.log;
                found = Some((shape, evidence));
            }
        });
        let (shape, evidence) = found?;
        let coefficients = state.likeliest(&block, &across, (shape, evidence.amplitude))?;
        let unfolded = DMatrix::from_fn(COUNT, fields, |k, field| {
            coefficients[place(free.motion, fields, COUNT, k, field)]
        });
        let whole = *NU + state.rows.square;
        let gain = -0.5 * (state.rows.freedom + *NU) * (1.0 - evidence.fit / whole).max(1e-9).ln();
        let leading = leading(&unfolded)?;
        let mut weights = [0.0; COUNT];
        weights.copy_from_slice(&leading);
        Some(Half {
            refined: Refined {
                forms: vec![form],
                shape: Some(block.groups[0].group.shapes[shape].clone()),
                log,
                amplitude: evidence.amplitude,
            },
            weights,
            cost: log - gain,
        })
    }
}

/// Where the coefficient of a function in a direction stands among those of a motion.
fn place(motion: Motion, fields: usize, functions: usize, function: usize, field: usize) -> usize {
    if matches!(
        motion,
        Motion::Base { .. } | Motion::Tool { .. } | Motion::Tracker { .. }
    ) {
        function * fields + field
    } else {
        field * functions + function
    }
}

/// The left singular vector of the largest singular value, of unit length.
fn leading(matrix: &DMatrix<f64>) -> Option<Vec<f64>> {
    let svd = matrix.clone().svd(true, false);
    let vectors = svd.u?;
    let column = vectors.column(svd.singular_values.imax()).into_owned();
    let length = column.norm();
    (length > 0.0 && matrix.norm() > 0.0).then(|| column.iter().map(|v| v / length).collect())
}
