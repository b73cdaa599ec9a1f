//! The rows as they stand around the present model: what is left without any cell, and the columns of whatever moves it; both weighed, with
//! geometry projected off.

use super::factored::{FactoredColumns, Functions, MotionRows, WeighedDirection, sums, unit};
use super::noise_shape::NoiseShape;
use crate::diagnose::round::RoundView;
use crate::effect::{Basis, Factor, Form, Law, Motion, Variable};
use crate::linear::{self, Columns, product, project, shown_directions, view};
use calib_engine::EvidenceRows;
use faer::{Mat, MatRef};
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// Columns of unit rms motion at the tool.
pub(super) struct UnitColumns {
    /// Residual rows x columns.
    pub(crate) values: Arc<Columns>,
    /// Mean squared motion (m2 or rad2) by a unit of each coefficient.
    pub(crate) square: Vec<f64>,
}

/// Columns with their products with the directions of each motion, row by row, each computed once.
pub(super) struct MultipliedColumns<'c> {
    /// One block after another.
    blocks: Vec<&'c Columns>,
    by_row: Vec<OnceLock<Vec<DMatrix<f64>>>>,
}

impl MultipliedColumns<'_> {
    fn count(&self) -> usize {
        self.blocks.iter().map(|block| block.ncols()).sum()
    }

    /// Of each block its columns x lines.
    fn by_line(&self) -> Vec<&DMatrix<f64>> {
        self.blocks.iter().map(|block| block.by_line()).collect()
    }

    /// The transpose of these columns times others that are written down.
    pub(super) fn times(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.count(), columns.ncols());
        let mut first = 0;
        for block in &self.blocks {
            let products = linear::product(view(block), view(columns));
            out.rows_mut(first, block.ncols()).copy_from(&products);
            first += block.ncols();
        }
        out
    }
}

/// A variable at every row, none where some row does not tell it; and functions of it.
struct VariableRows {
    variable: Variable,
    values: Option<Vec<f64>>,
    functions: Vec<(Basis, Arc<Functions>)>,
}

/// Columns one after another, of so many rows, weighed and of unit rms motion, with the mean squared motion by a unit of each.
struct Weighed {
    columns: Vec<f64>,
    rows: usize,
    square: Vec<f64>,
}

/// The rows of the recording around a model.
pub(super) struct SearchRows<'a> {
    pub(crate) view: &'a RoundView<'a>,
    base: Mat<f64>,
    /// Columns of the base x residual rows.
    base_by_line: DMatrix<f64>,
    residual: Vec<f64>,
    /// Variance of one number of a row, m2 or rad2, by which columns become sizes.
    variance: Vec<f64>,
    noise: NoiseShape,
    motions: Vec<MotionRows>,
    variables: Vec<VariableRows>,
}

impl<'a> SearchRows<'a> {
    /// Around a fitted model; the residual is that without its causes.
    pub(crate) fn of(view: &'a RoundView<'a>, noise: NoiseShape) -> Self {
        let problem = &view.problem;
        let variance = |(i, row): (usize, &usize)| {
            view.fitter.scale.noise(problem.data, *row).powi(2)
                / problem.readings_of(i).len().max(1) as f64
        };
        let variance = problem.rows.iter().enumerate().map(variance).collect();
        let mut residual = view.without_causes(view.now);
        let mut out = Self {
            view,
            base: Mat::new(),
            base_by_line: DMatrix::zeros(0, 0),
            residual: Vec::new(),
            variance,
            noise,
            motions: Vec::new(),
            variables: Vec::new(),
        };
        let parameters = view.fitter.base();
        let mut jacobian = problem.jacobian(&parameters);
        (0..jacobian.ncols()).for_each(|j| out.weigh(jacobian.col_as_slice_mut(j)));
        out.weigh(&mut residual);
        out.base = shown_directions(&jacobian, &problem.prior_sigmas(&parameters));
        project(out.base.as_ref(), &mut residual);
        let base = &out.base;
        out.base_by_line = DMatrix::from_fn(base.ncols(), base.nrows(), |j, line| base[(line, j)]);
        out.residual = residual;
        out
    }

    /// What is left, and how many rows say something of their own.
    pub(crate) fn rows(&self) -> EvidenceRows {
        let square = self.residual.iter().map(|value| value * value).sum();
        let counted = self.residual.len() as f64 / self.view.autocorrelation_time;
        EvidenceRows {
            freedom: (counted - self.base.ncols() as f64).max(1.0),
            square,
        }
    }

    /// The least variance of the noise over what is stated: what motor currents leave says nothing of the points'.
    pub(crate) fn least_noise(&self) -> f64 {
        if self.view.problem.measured_residual().len() < self.residual.len() {
            1.0
        } else {
            0.09
        }
    }

    pub(crate) fn residual(&self) -> &[f64] {
        &self.residual
    }

    /// Products of some columns with the residual.
    pub(crate) fn along(&self, columns: MatRef<'_, f64>) -> DVector<f64> {
        let residual = MatRef::from_column_major_slice(&self.residual, self.residual.len(), 1);
        DVector::from_vec(product(columns, residual).data.into())
    }

    /// Products of some columns with each other and with the residual.
    pub(crate) fn products(&self, columns: MatRef<'_, f64>) -> (DMatrix<f64>, DVector<f64>) {
        (product(columns, columns), self.along(columns))
    }

    /// A variable at every row; none where some row does not tell it.
    pub(crate) fn values(&self, variable: Variable) -> Option<Vec<f64>> {
        match self.variable(variable) {
            Some(known) => known.values.clone(),
            None => self.view.problem.values(variable),
        }
    }

    fn variable(&self, variable: Variable) -> Option<&VariableRows> {
        self.variables
            .iter()
            .find(|known| known.variable == variable)
    }

    /// Computes once what the columns of many forms are made of.
    pub(crate) fn prepare(&mut self, motions: &[Motion], variables: &[Variable]) {
        let is_fresh = |motion: &&Motion| self.motions.iter().all(|known| known.motion != **motion);
        let fresh: Vec<&Motion> = motions.iter().filter(is_fresh).collect();
        let fresh = fresh.into_par_iter().map(|motion| self.motion(*motion));
        let fresh: Vec<MotionRows> = fresh.collect();
        self.motions.extend(fresh);
        let is_fresh = |variable: &&Variable| self.variable(**variable).is_none();
        let fresh: Vec<&Variable> = variables.iter().filter(is_fresh).collect();
        let problem = &self.view.problem;
        let rows = |variable: &Variable| VariableRows {
            variable: *variable,
            values: problem.values(*variable),
            functions: Vec::new(),
        };
        self.variables.par_extend(fresh.into_par_iter().map(rows));
    }

    /// Computes once the functions of one variable that forms have.
    pub(crate) fn tabulate<'l>(&mut self, laws: impl Iterator<Item = &'l Law>) {
        for factor in laws.flat_map(Law::factors) {
            let is_it = |known: &VariableRows| known.variable == factor.variable;
            let Some(known) = self.variables.iter().position(is_it) else {
                continue;
            };
            let mut functions = self.variables[known].functions.iter();
            if functions.all(|(basis, _)| *basis != factor.basis)
                && let Some(fresh) = self.factor(factor)
            {
                let fresh = Arc::new(Functions { values: fresh });
                self.variables[known].functions.push((factor.basis, fresh));
            }
        }
    }

    /// Columns of a form as directions times functions; none where it is no such product, or where rows have a part in each other.
    pub(crate) fn factored(&self, form: &Form) -> Option<FactoredColumns> {
        self.is_by_row().then(|| self.product(form)).flatten()
    }

    /// Columns of a form as directions times functions.
    fn product(&self, form: &Form) -> Option<FactoredColumns> {
        let (motion, functions) = self.factors(form)?;
        let directions = &self.motions[motion];
        Some(FactoredColumns::of(motion, directions, functions))
    }

    /// The position of a form's motion and the functions along its directions; none where it is no product of such.
    fn factors(&self, form: &Form) -> Option<(usize, Arc<Functions>)> {
        let term = form.term()?;
        let motion = |known: &MotionRows| known.motion == term.motion();
        let motion = self.motions.iter().position(motion)?;
        Some((motion, self.functions(term.law())?))
    }

    /// Whether rows are weighed each by itself, and all of them are readings.
    fn is_by_row(&self) -> bool {
        !self.view.problem.is_correlated()
            && self.view.problem.measured_residual().len() == self.residual.len()
    }

    /// What a motion's columns are made of.
    fn motion(&self, motion: Motion) -> MotionRows {
        let raw = self.view.problem.directions(motion);
        let directions = raw.into_iter().map(|raw| self.direction(raw)).collect();
        let out = MotionRows::of(motion, directions);
        if !self.is_by_row() {
            return out;
        }
        let row_of = self.view.problem.rows_of_readings();
        out.by_row(&self.base_by_line, &self.residual, row_of)
    }

    /// Some columns, of which the base is projected off, to be multiplied with factored ones.
    pub(crate) fn multiplied<'c>(&self, blocks: Vec<&'c Columns>) -> MultipliedColumns<'c> {
        MultipliedColumns {
            blocks,
            by_row: self.motions.iter().map(|_| OnceLock::new()).collect(),
        }
    }

    /// The transpose of some columns times factored ones.
    pub(crate) fn with_factored(
        &self,
        with: &MultipliedColumns,
        factored: &[&FactoredColumns],
    ) -> DMatrix<f64> {
        let row_of = self.view.problem.rows_of_readings();
        let mut out = Vec::new();
        for forms in factored.chunk_by(|a, b| a.motion == b.motion) {
            let motion = forms[0].motion;
            let by_row = with.by_row[motion]
                .get_or_init(|| self.motions[motion].with(&with.by_line(), row_of));
            out.append(&mut sums(forms, by_row));
        }
        let count = out.len() / with.count().max(1);
        DMatrix::from_vec(with.count(), count, out)
    }

    /// Products of factored columns with each other and with the residual, the base projected off; none of several motions.
    pub(crate) fn factored_products(
        &self,
        factored: &[FactoredColumns],
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let first = factored.first()?.motion;
        let is_one = factored.iter().all(|form| form.motion == first);
        is_one.then(|| self.motions[first].products(&factored.iter().collect::<Vec<_>>()))
    }

    /// Columns of some forms, one form after another, and how many each has. They end before the rows of motor currents where no form says
    /// anything of these.
    pub(crate) fn columns(&self, forms: &[Form]) -> (UnitColumns, Vec<usize>) {
        let mut each: Vec<Weighed> = forms
            .iter()
            .map(|form| {
                self.term_columns(form)
                    .unwrap_or_else(|| self.form_columns(form))
            })
            .collect();
        let rows = each.iter().map(|block| block.rows).max();
        let rows = rows.unwrap_or(self.residual.len());
        let counts: Vec<usize> = each.iter().map(|block| block.square.len()).collect();
        let mut values = match &mut each[..] {
            [block] => std::mem::take(&mut block.columns),
            _ => Vec::with_capacity(rows * counts.iter().sum::<usize>()),
        };
        for block in &each {
            for column in block.columns.chunks(block.rows.max(1)) {
                values.extend_from_slice(column);
                values.resize(values.len() + rows - block.rows, 0.0);
            }
        }
        project(self.base.as_ref().subrows(0, rows), &mut values);
        let square: Vec<f64> = each.into_iter().flat_map(|block| block.square).collect();
        (
            UnitColumns {
                values: Arc::new(DMatrix::from_vec(rows, square.len(), values).into()),
                square,
            },
            counts,
        )
    }

    /// The columns of any form; without the rows of currents where it says nothing of these.
    fn form_columns(&self, form: &Form) -> Weighed {
        let problem = &self.view.problem;
        let (all, points) = (self.residual.len(), problem.measured_residual().len());
        let mut columns = problem.motions_by(form);
        let is_zero = |column: &[f64]| column[points..].iter().all(|value| *value == 0.0);
        let silent = columns.chunks(all.max(1)).all(is_zero);
        let rows = if silent { points } else { all };
        if rows < all {
            let point_rows = columns.chunks(all).flat_map(|column| &column[..points]);
            columns = point_rows.copied().collect();
        }
        let each = columns.chunks(rows.max(1));
        let square: Vec<f64> = each.map(|column| self.mean_square(column)).collect();
        for (column, square) in columns.chunks_mut(rows.max(1)).zip(&square) {
            problem.innovate(column);
            self.weigh(column);
            let scale = unit(*square);
            column.iter_mut().for_each(|value| *value *= scale);
        }
        Weighed {
            columns,
            rows,
            square,
        }
    }

    /// How much of the squared length of `left` the columns of a law at a place explain if they are orthogonal; nothing of what needs more.
    pub(crate) fn roughly(&self, form: &Form, left: &[f64]) -> Option<f64> {
        if self.view.problem.is_correlated() {
            return None;
        }
        let (motion, functions) = self.factors(form)?;
        let sum = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a + c, b + d];
        let mut fit = 0.0;
        for WeighedDirection { weighed, .. } in &self.motions[motion].directions {
            let products = |i: usize| {
                let lines = self.view.problem.readings_of(i);
                let products =
                    lines.map(|line| [weighed[line] * left[line], weighed[line] * weighed[line]]);
                products.fold([0.0, 0.0], sum)
            };
            let rows: Vec<[f64; 2]> = (0..self.variance.len()).map(products).collect();
            for function in functions.values.column_iter() {
                let sums = function
                    .iter()
                    .zip(&rows)
                    .map(|(value, [along, square])| [value * along, value * value * square]);
                let [along, square] = sums.fold([0.0, 0.0], sum);
                fit += along * along / square.max(f64::MIN_POSITIVE);
            }
        }
        Some(fit)
    }

    /// What is needed of a direction of a motion by a unit.
    fn direction(&self, mut raw: Vec<f64>) -> WeighedDirection {
        raw.truncate(self.view.problem.measured_residual().len());
        let count = self.variance.len().max(1) as f64;
        let square = self.squares_by_row(&raw).map(|square| square / count);
        let square = square.collect();
        if !self.view.problem.is_correlated() {
            self.weigh(&mut raw);
        }
        WeighedDirection {
            weighed: raw,
            square,
        }
    }

    /// The columns of a law at a place from the motion's directions and the law's functions.
    fn term_columns(&self, form: &Form) -> Option<Weighed> {
        let product = self.product(form)?;
        let directions = &self.motions[product.motion].directions;
        let (problem, row_of) = (&self.view.problem, self.view.problem.rows_of_readings());
        let mut columns = Vec::new();
        for (direction, function) in product.scaled() {
            let first = columns.len();
            let lines = directions[direction].weighed.iter().zip(row_of);
            columns.extend(lines.map(|(weighed, row)| weighed * function[*row]));
            if problem.is_correlated() {
                let column = &mut columns[first..];
                problem.innovate(column);
                self.weigh(column);
            }
        }
        Some(Weighed {
            columns,
            rows: row_of.len(),
            square: product.square,
        })
    }

    /// The functions of a law at every row; none of a variable of several numbers, or that some row does not tell.
    fn functions(&self, law: &Law) -> Option<Arc<Functions>> {
        let known_functions = |factor: &Factor| {
            let mut functions = self.variable(factor.variable)?.functions.iter();
            let known = functions.find(|(basis, _)| *basis == factor.basis)?;
            Some(&known.1)
        };
        if let (Some(functions), None) = (known_functions(&law.first), law.times) {
            return Some(functions.clone());
        }
        let factor = |factor: &Factor| match known_functions(factor) {
            Some(functions) => Some(Cow::Borrowed(&functions.values)),
            None => Some(Cow::Owned(self.factor(factor)?)),
        };
        let first = factor(&law.first)?;
        let Some(times) = law.times.as_ref() else {
            return Some(Arc::new(Functions {
                values: first.into_owned(),
            }));
        };
        let second = factor(times)?;
        let products: Vec<DVector<f64>> = first
            .column_iter()
            .flat_map(|a| second.column_iter().map(move |b| a.component_mul(&b)))
            .collect();
        Some(Arc::new(Functions {
            values: DMatrix::from_columns(&products),
        }))
    }

    /// The functions of one variable at every row, rows x functions.
    fn factor(&self, factor: &Factor) -> Option<DMatrix<f64>> {
        if !factor.variable.is_single() {
            return None;
        }
        let values = match self.variable(factor.variable) {
            Some(known) => Cow::Borrowed(known.values.as_deref()?),
            None => Cow::Owned(self.view.problem.values(factor.variable)?),
        };
        let mut functions = DMatrix::zeros(values.len(), factor.basis.count());
        for (row, u) in values.iter().enumerate() {
            factor
                .basis
                .at(*u, &mut |k, value| functions[(row, k)] = value);
        }
        Some(functions)
    }

    /// Rms motion at the tool of what makes the squared residual smaller by so much.
    pub(crate) fn size(&self, fit: f64) -> f64 {
        let count = self.variance.len().max(1) as f64;
        (fit.max(0.0) * self.variance.iter().sum::<f64>() / (count * count)).sqrt()
    }

    fn mean_square(&self, column: &[f64]) -> f64 {
        self.squares_by_row(column).sum::<f64>() / self.variance.len().max(1) as f64
    }

    /// Squared motion of each row by a column.
    fn squares_by_row(&self, column: &[f64]) -> impl Iterator<Item = f64> {
        self.variance.iter().enumerate().map(|(i, variance)| {
            let lines = self.view.problem.readings_of(i);
            column[lines].iter().map(|value| value * value).sum::<f64>() * variance
        })
    }

    fn weigh(&self, column: &mut [f64]) {
        let problem = &self.view.problem;
        for (i, row) in problem.rows.iter().enumerate() {
            let lines = problem.readings_of(i);
            if let (Some(whitening), 3) = (&self.noise.whitening, lines.len()) {
                let white = whitening * Vector3::from_column_slice(&column[lines.clone()]);
                column[lines.clone()].copy_from_slice(white.as_slice());
            }
            if let Some(weight) = self.noise.weights.get(*row) {
                column[lines].iter_mut().for_each(|value| *value *= weight);
            }
        }
        if let Some(factor) = self.noise.currents {
            let points = problem.measured_residual().len();
            let currents = column[points..].iter_mut();
            currents.for_each(|value| *value *= factor);
        }
    }
}
