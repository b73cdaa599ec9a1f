//! Curves that jump: a line or a curve with a few steps at values of its variable where the rows say most of them. Cosines alone would need
//! more numbers than a recording bears, and leave the name to a product that has them.

use super::cause_table::CauseTable;
use super::cell::{CellShape, FreeShape, ShapeGroup, fields, has_few, line_and_curve, support};
use super::component::CellColumns;
use super::scan::{CellEvidence, Refined};
use super::state::KnownState;
use crate::criteria::cells::{FINELY, LENGTHS, LEVELS, NU, THRESHOLDS};
use crate::effect::{Basis, Form, Law, Term, Variable};
use calib_engine::{EvidenceRows, GroupEvidence, evidence};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A curve and steps, with what the rows say of all of them together.
struct Steps {
    gram: DMatrix<f64>,
    gradient: DVector<f64>,
    rows: EvidenceRows,
    /// Columns of the line and of the curve, which come first, and of each step.
    curve: usize,
    each: usize,
}

impl CauseTable<'_, '_> {
    /// A curve in finer shapes than it was asked in, and with steps, where it leaves more than noise; none of what is no curve. If `closely`,
    /// with the numbers of its variable for which steps say most.
    pub(crate) fn stepped(
        &self,
        cell: usize,
        found: &CellEvidence,
        state: &KnownState,
        closely: bool,
    ) -> Option<Refined> {
        let free = self.cells[cell].free().filter(|free| free.is_curve())?;
        let variable = match &found.refined {
            Some(refined) => refined.forms.first()?.term()?.law().first.variable,
            None => free.variable,
        };
        let mut free = FreeShape { variable, ..*free };
        if !state.leaves_more_than_noise(found.fit) {
            return None;
        }
        let alone = |free: &FreeShape| {
            let form = |basis| free.term(Law::new(free.variable, basis));
            self.with_steps(free, free.variable, &form, state)
        };
        let mut best = alone(&free)?;
        let is_stepped = |refined: &Refined| {
            let steps =
                |form: &Form| matches!(form.term().map(Term::basis), Some(Basis::Steps { .. }));
            refined.forms.iter().any(steps)
        };
        let levels = if closely && is_stepped(&best) {
            1..*LEVELS
        } else {
            0..0
        };
        for level in levels {
            let near = free.near(level).into_par_iter();
            let tried: Vec<_> = near
                .filter_map(|near| Some((alone(&near)?, near)))
                .collect();
            let next = tried.into_iter().max_by(|a, b| a.0.log.total_cmp(&b.0.log));
            if let Some((next, near)) = next.filter(|next| next.0.log > best.log) {
                (best, free) = (next, near);
            }
        }
        Some(best)
    }

    /// A line or a curve over a variable with steps: forms of a motion by the functions of it.
    pub(super) fn with_steps(
        &self,
        free: &FreeShape,
        variable: Variable,
        form: &dyn Fn(Basis) -> Form,
        state: &KnownState,
    ) -> Option<Refined> {
        let values = self
            .frame
            .values(variable)
            .filter(|values| !has_few(values))?;
        if !self.has_steps {
            return None;
        }
        let (line, [low, high]) = (free.line(&values)?, support(&values));
        let mut all = gaps(values);
        if variable == Variable::Time {
            all.retain(|at| !self.survey.is_payload_change(*at));
        }
        let fields = fields(free.motion);
        let curves = free.smooth(*FINELY, LENGTHS.len());
        let rough = free.rough(*FINELY);
        let shapes = line_and_curve(fields * line.count(), &curves, Some(rough));
        let [line, curve] = [line, free.cosines([low, high], *FINELY)].map(form);
        let straight = fields * line.term()?.law().count();
        let with = |some: &[usize]| {
            let after = some.iter().map(|gap| form(Basis::After { at: all[*gap] }));
            let forms = [line.clone(), curve.clone()].into_iter().chain(after);
            let group = ShapeGroup::new(forms.collect(), Vec::new());
            let block = CellColumns::of(vec![group], self.frame);
            let columns = state.columns(self.frame);
            let across = self.across_once(&block, state, &columns);
            let (gram, gradient) = state.seen(&block.groups[0], &across, 0);
            let steps = Steps {
                curve: gradient.len() - some.len() * fields,
                gram,
                gradient,
                rows: state.rows,
                each: fields,
            };
            let (at, shape, best) = steps.best(&shapes, (some.len(), all.len()))?;
            Some((at.into_iter().map(|k| some[k]).collect(), shape, best))
        };
        let few = all.len().min(*THRESHOLDS);
        let some: Vec<usize> = (0..few)
            .map(|k| (2 * k + 1) * all.len() / (2 * few))
            .collect();
        let (mut at, mut shape, mut best): (Vec<usize>, usize, GroupEvidence) = with(&some)?;
        if !at.is_empty() && few < all.len() {
            let near = |gap: &usize| at.iter().any(|at| gap.abs_diff(*at) < all.len() / few + 1);
            let some: Vec<usize> = (0..all.len()).filter(near).collect();
            let closer = with(&some).filter(|closer| closer.2.log > best.log);
            if let Some(closer) = closer {
                (at, shape, best) = closer;
            }
        }
        let chosen = &shapes[shape];
        let (of_line, of_curve) = chosen.shares.split_at(straight);
        let part = if at.is_empty() { 1.0 } else { 0.5 };
        let mut forms: Vec<Form> = Vec::new();
        let mut shares: Vec<f64> = Vec::new();
        for (form, of_form) in [(line, of_line), (curve, of_curve)] {
            if of_form.iter().any(|share| *share > 0.0) {
                forms.push(form);
                shares.extend(of_form.iter().map(|share| part * share));
            }
        }
        if !at.is_empty() {
            let mut places = [0.0; Basis::STEPS];
            places
                .iter_mut()
                .zip(&at)
                .for_each(|(place, k)| *place = all[*k]);
            let count = at.len();
            forms.push(form(Basis::Steps { at: places, count }));
            let columns = count * fields;
            shares.extend(std::iter::repeat_n(part / columns as f64, columns));
        }
        let log_weight = chosen.log_weight - price(at.len(), all.len());
        (!state.has_any(&forms)).then(|| Refined {
            forms,
            shape: Some(CellShape::new(shares, log_weight)),
            log: best.log,
            amplitude: best.amplitude,
            spread: best.spread,
        })
    }
}

impl Steps {
    /// The steps among some of so many, the shape of the curve with them, and the evidence where that is largest.
    fn best(
        &self,
        shapes: &[CellShape],
        (some, all): (usize, usize),
    ) -> Option<(Vec<usize>, usize, GroupEvidence)> {
        let mut best: Option<(Vec<usize>, usize, GroupEvidence)> = None;
        let mut at: Vec<usize> = Vec::new();
        let mut worse = 0;
        loop {
            let price = price(at.len(), all);
            let with_price = |shape: usize| {
                let mut found = self.with(&shapes[shape], &at);
                found.log = found.log + shapes[shape].log_weight - price;
                (shape, found)
            };
            let plain = (0..shapes.len()).filter(|shape| !shapes[*shape].is_bent);
            let (shape, found) = plain
                .map(with_price)
                .max_by(|a, b| a.1.log.total_cmp(&b.1.log))?;
            let next = self.next(&shapes[shape], &at, found.amplitude, some);
            if best.as_ref().is_none_or(|best| found.log > best.2.log) {
                best = Some((at.clone(), shape, found));
                worse = 0;
            } else {
                worse += 1;
            }
            match next {
                Some(next) if at.len() < Basis::STEPS && worse < 2 => at.push(next),
                _ => return best,
            }
        }
    }

    /// Prior shares of all columns: of a curve in a shape and some steps.
    fn shares(&self, shape: &CellShape, at: &[usize]) -> Vec<f64> {
        let mut shares = vec![0.0; self.gradient.len()];
        let part = if at.is_empty() { 1.0 } else { 0.5 };
        let curve = shares.iter_mut().zip(&shape.shares);
        curve.for_each(|(share, of_shape)| *share = part * of_shape);
        for k in at.iter().flat_map(|step| self.columns(*step)) {
            shares[k] = part / (at.len() * self.each) as f64;
        }
        shares
    }

    fn columns(&self, step: usize) -> std::ops::Range<usize> {
        let first = self.curve + step * self.each;
        first..first + self.each
    }

    fn with(&self, shape: &CellShape, at: &[usize]) -> GroupEvidence {
        evidence(
            &self.gram,
            &self.gradient,
            &self.shares(shape, at),
            self.rows,
        )
    }

    /// The step that explains most of what a curve and steps of an amplitude leave.
    fn next(&self, shape: &CellShape, at: &[usize], amplitude: f64, some: usize) -> Option<usize> {
        let shares = self.shares(shape, at);
        let kept: Vec<usize> = (0..shares.len()).filter(|k| shares[*k] > 0.0).collect();
        let roots: Vec<f64> = kept.iter().map(|k| amplitude * shares[*k].sqrt()).collect();
        let count = kept.len();
        let mut matrix = DMatrix::from_fn(count, count, |i, j| {
            roots[i] * self.gram[(kept[i], kept[j])] * roots[j]
        });
        (0..count).for_each(|k| matrix[(k, k)] += 1.0);
        let lower = matrix.cholesky()?.unpack();
        let along = DVector::from_fn(count, |i, _| roots[i] * self.gradient[kept[i]]);
        let along = lower.solve_lower_triangular(&along)?;
        let left = (*NU + self.rows.square - along.norm_squared()).max(f64::MIN_POSITIVE);
        let half = 0.5 * (self.rows.freedom + *NU);
        let variance = 0.5 * amplitude * amplitude / self.each as f64;
        let gain = |step: usize| {
            let columns = self.columns(step);
            let first = columns.start;
            let with = DMatrix::from_fn(count, self.each, |i, j| {
                roots[i] * self.gram[(kept[i], first + j)]
            });
            let with = lower.solve_lower_triangular(&with)?;
            let seen = self.gram.view((first, first), (self.each, self.each)) - with.tr_mul(&with);
            let mut seen = seen * variance;
            (0..self.each).for_each(|k| seen[(k, k)] += 1.0);
            let gradient = self.gradient.rows(first, self.each) - with.tr_mul(&along);
            let factor = seen.cholesky()?;
            let fit = variance * gradient.dot(&factor.solve(&gradient));
            let pivots = factor.l_dirty().diagonal();
            let cost: f64 = pivots.iter().map(|value| value.ln()).sum();
            Some(-half * (1.0 - fit / left).max(1e-9).ln() - cost)
        };
        let others = (0..some).filter(|step| !at.contains(step));
        let gains = others.filter_map(|step| Some((step, gain(step)?)));
        let best = gains.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
        Some(best.0)
    }
}

/// The middles between values.
fn gaps(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let span = values[values.len() - 1] - values[0];
    let gaps = values
        .windows(2)
        .filter(|pair| pair[1] - pair[0] > 1e-9 * span);
    gaps.map(|pair| 0.5 * (pair[0] + pair[1])).collect()
}

/// What steps cost, ln of the evidence: which of all there may be, in any order, and that there are so many.
fn price(count: usize, all: usize) -> f64 {
    let choices = (0..count).map(|k| ((all - k) as f64 / (k + 1) as f64).ln());
    choices.sum::<f64>() + count as f64 * 2.0_f64.ln()
}
