//! Products of two variables as one curve times another: f(u) g(v) has the numbers of two curves where a product in all of its shapes has as
//! many as both multiplied, so that curves with corners and jumps are within reach of a recording.

use super::cause_table::CauseTable;
use super::cell::{
    CellShape, FreeShape, Over, ShapeGroup, alternates, cornered, density, fields, over_fields,
    support, with_mean,
};
use super::component::CellColumns;
use super::scan::{CellEvidence, Refined};
use super::state::KnownState;
use crate::criteria::cells::{JUMPING, LENGTHS, NU, TURNED, TURNS};
use crate::effect::{Basis, Law, Motion};
use calib_engine::GroupEvidence;
use nalgebra::{DMatrix, DVector};

type Weights = [f64; Basis::CURVE];

/// One of the curves given the other.
struct Half {
    refined: Refined,
    /// The curve, of unit length.
    weights: Weights,
    /// ln of the evidence over that of the likeliest curve: what its numbers cost.
    cost: f64,
    /// What it explains of the squared residual.
    fit: f64,
}

impl CauseTable<'_, '_> {
    /// A product as one curve times another, each in its likeliest spectrum and with the numbers of its variables that a scan found; none of what
    /// is no product.
    pub(crate) fn separable(
        &self,
        cell: usize,
        found: &CellEvidence,
        state: &KnownState,
    ) -> Option<Refined> {
        let mut free = *self.cells[cell].free()?;
        if let Some(refined) = &found.refined {
            let law = *refined.forms.first()?.term()?.law();
            free.variable = law.first.variable;
            free.over = Over::Product(law.times?.variable);
        }
        let free = &free;
        let Over::Product(other) = free.over else {
            return None;
        };
        let range = |variable| Some(support(&self.frame.values(variable)?));
        let supports = [range(free.variable)?, range(other)?];
        let mut curves = [(self.first_curve(free, supports[0], state)?, 0.0); 2];
        let mut best: Option<Half> = None;
        let mut last = f64::NEG_INFINITY;
        for turn in 0..*TURNS {
            let given = turn % 2;
            let known = (given, curves[given]);
            let half = self.half(free, (supports, Basis::CURVE), known, state)?;
            curves[1 - given] = (half.weights, half.cost);
            if turn == 0 {
                continue;
            }
            let log = half.refined.log;
            if best.as_ref().is_none_or(|best| log > best.refined.log) {
                best = Some(half);
            }
            if log < last + *TURNED {
                break;
            }
            last = log;
        }
        for (given, curve) in curves.into_iter().enumerate() {
            let half = self.half(free, (supports, *JUMPING), (given, curve), state);
            best = best
                .into_iter()
                .chain(half)
                .max_by(|a, b| a.refined.log.total_cmp(&b.refined.log));
        }
        let Half {
            refined: mut best,
            fit,
            ..
        } = best?;
        // Where that is not all, the free one of the two curves may jump.
        if state.leaves_more_than_noise(fit) {
            for (given, (weights, cost)) in curves.into_iter().enumerate() {
                let [low, high] = supports[given];
                let curve = Basis::Curve { low, high, weights };
                let form = |basis| {
                    let bases = if given == 0 {
                        [curve, basis]
                    } else {
                        [basis, curve]
                    };
                    free.term(Law::new(free.variable, bases[0]).times(other, bases[1]))
                };
                let variable = [other, free.variable][given];
                if let Some(mut stepped) = self.with_steps(free, variable, &form, state)
                    && stepped.log + cost > best.log
                {
                    stepped.log += cost;
                    if let Some(shape) = &mut stepped.shape {
                        shape.log_weight += cost;
                    }
                    best = stepped;
                }
            }
        }
        (!state.has_any(&best.forms)).then_some(best)
    }

    /// A curve of the first variable from the likeliest product of few functions of each.
    fn first_curve(
        &self,
        free: &FreeShape,
        [low, high]: [f64; 2],
        state: &KnownState,
    ) -> Option<Weights> {
        let block = CellColumns::of(self.groups(free, false), self.frame);
        let (.., coefficients) = self.likeliest(&block, state)?;
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
        let mut weights = [0.0; Basis::CURVE];
        match law.first.basis {
            // Of two or three values: a line is a cosine.
            Basis::Straight { zero, per } => {
                let end = libm::cos(std::f64::consts::PI * (zero - per - low) / (high - low));
                weights[0] = leading[0];
                weights[1] = -leading[1] / end;
            }
            _ => (0..rows.min(Basis::CURVE)).for_each(|k| weights[k] = leading[k]),
        }
        Some(weights)
    }

    /// The other curve, of so many functions, given one of them, of which the numbers cost something when it was free: of the first variable
    /// if `given` is 0, else of the second.
    fn half(
        &self,
        free: &FreeShape,
        (supports, functions): ([[f64; 2]; 2], usize),
        (given, (weights, cost)): (usize, (Weights, f64)),
        state: &KnownState,
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
                    count: functions,
                }
            }
        };
        let form = free.term(Law::new(free.variable, basis(0)).times(other, basis(1)));
        let fields = fields(free.motion);
        let smooth = LENGTHS.iter().map(|length| density(functions - 1, *length));
        let spectra: Vec<Vec<f64>> = smooth.chain([cornered(functions - 1)]).collect();
        let log_weight = cost - (spectra.len() as f64).ln();
        let shape = |curve: Vec<f64>| {
            let shares = over_fields(with_mean(curve), free.motion, fields);
            CellShape::new(shares, log_weight)
        };
        let shapes = spectra.into_iter().map(shape).collect();
        let group = ShapeGroup::new(vec![form.clone()], shapes);
        let block = CellColumns::of(vec![group], self.frame);
        let (shape, evidence, coefficients) = self.likeliest(&block, state)?;
        let unfolded = DMatrix::from_fn(functions, fields, |k, field| {
            coefficients[place(free.motion, fields, functions, k, field)]
        });
        let whole = *NU + state.rows.square;
        let gain = -0.5 * (state.rows.freedom + *NU) * (1.0 - evidence.fit / whole).max(1e-9).ln();
        let leading = leading(&unfolded)?;
        let mut weights = [0.0; Basis::CURVE];
        weights.copy_from_slice(&leading[..Basis::CURVE]);
        Some(Half {
            refined: Refined {
                forms: vec![form],
                shape: Some(block.groups[0].group.shapes[shape].clone()),
                log: evidence.log,
                amplitude: evidence.amplitude,
                spread: evidence.spread,
            },
            weights,
            cost: evidence.log - cost - gain,
            fit: evidence.fit,
        })
    }

    /// The shape of a block of one group that says most, its evidence and its likeliest coefficients (SI).
    fn likeliest(
        &self,
        block: &CellColumns,
        state: &KnownState,
    ) -> Option<(usize, GroupEvidence, DVector<f64>)> {
        let columns = state.columns(self.frame);
        let across = self.across_once(block, state, &columns);
        let mut best: Option<(usize, GroupEvidence)> = None;
        for (_, shape, found) in state.shapes(block, &across, 0) {
            if found.log > best.map_or(f64::NEG_INFINITY, |best| best.1.log) {
                best = Some((shape, found));
            }
        }
        let (shape, found) = best?;
        let coefficients = state.likeliest(block, &across, (shape, found.amplitude))?;
        Some((shape, found, coefficients))
    }
}

/// Where the coefficient of a function in a direction stands among those of a motion.
fn place(motion: Motion, fields: usize, functions: usize, function: usize, field: usize) -> usize {
    if alternates(motion) {
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
