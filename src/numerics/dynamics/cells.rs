//! Cells of torques and their evidence: a cell is a cause at a place in every shape that it may have; what was accepted stands in the
//! covariance with its amplitude, and every other cell is compared given these. Of the forms of a problem: which may stand together, which in
//! each other's place.

use super::cause::{COULOMB, TorqueForm, UNKNOWN, VISCOUS};
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;
use crate::criteria::cells::{COMMON, NU};
use crate::criteria::torque::{LEAST_NOISE, PER_METRE};
use crate::diagnose::table::KnownState;
use crate::effect::Place;
use calib_engine::{AMPLITUDES, EvidenceRows, evidence, log_sum};
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The forms of one problem, with the base model that is fitted with all of them.
pub(super) struct CauseChoice<'a> {
    pub(crate) problem: &'a TorqueProblem<'a>,
    pub(crate) weighted: &'a WeightedColumns,
    pub(crate) base: SweptColumns<'a>,
    /// Forms that may be chosen; trial forms of a refinement are none of them.
    pub(crate) open: usize,
    /// Whether those without a name are none of them.
    is_named: bool,
}

impl<'a> CauseChoice<'a> {
    /// Over all forms of a problem.
    pub(crate) fn new(problem: &'a TorqueProblem<'a>, weighted: &'a WeightedColumns) -> Self {
        Self {
            problem,
            weighted,
            base: SweptColumns::base(&problem.all, weighted),
            open: problem.all.listed,
            is_named: false,
        }
    }

    /// Over those with a name: a curve without one would be a push, or several causes at once.
    pub(crate) fn named(problem: &'a TorqueProblem<'a>, weighted: &'a WeightedColumns) -> Self {
        Self {
            is_named: true,
            ..Self::new(problem, weighted)
        }
    }

    /// Whether a form may be chosen.
    pub(super) fn is_open(&self, number: usize) -> bool {
        number < self.open && !(self.is_named && self.form(number).name() == UNKNOWN)
    }

    pub(crate) fn form(&self, number: usize) -> &TorqueForm {
        &self.problem.all.forms[number]
    }

    /// Whether a set has a form for which something holds.
    pub(crate) fn has(&self, set: &[usize], holds: impl Fn(&TorqueForm) -> bool) -> bool {
        set.iter().any(|number| holds(self.form(*number)))
    }

    /// Whether a form with some coefficients, given the forms of a set, is one that its cause can have.
    fn may_be(
        &self,
        number: usize,
        set: &[usize],
        rises: impl Fn() -> bool,
        values: impl Fn() -> Vec<f64>,
    ) -> bool {
        let (form, cause) = (self.form(number), self.form(number).cause);
        let is_curve = |one: &TorqueForm| one.place == form.place && one.is_nameless_curve();
        let only_positive = form.is_positive() || (cause.brakes && !self.has(set, is_curve));
        (!only_positive || rises())
            && (cause.is_itself)(form, &self.problem.scene)
            && (cause.is_possible)(form, &values())
    }

    /// Whether two forms exclude each other: a name once at a place, and one curve of speed.
    pub(super) fn excludes(&self, number: usize, other: usize) -> bool {
        let [form, known] = [number, other].map(|number| self.form(number));
        let is_same = form.is_called_as(known)
            && (!form.cause.may_repeat || form.with == known.with || number == other);
        is_same || form.is_one_curve_with(known)
    }

    /// Whether a form may join a set: nothing of it excludes the form, and it is not barred.
    fn may_join(&self, number: usize, set: &[usize]) -> bool {
        let form = self.form(number);
        let is_barred = || self.problem.barred.iter().any(|one| form.is_of_kind(one));
        !set.iter().any(|other| self.excludes(number, *other)) && !is_barred()
    }

    /// Viscous and Coulomb friction of every joint: hardly an arm is without.
    pub(super) fn common(&self) -> Vec<usize> {
        let common = |number: &usize| [VISCOUS, COULOMB].contains(&self.form(*number).name());
        (0..self.open).filter(common).collect()
    }

    /// Whether two forms may stand in each other's place: they change the torque of one joint.
    pub(crate) fn compete(&self, a: usize, b: usize) -> bool {
        let joints = self.problem.joints();
        let [a, b] = [a, b].map(|number| self.form(number).acts_on(joints));
        a.iter().any(|joint| b.contains(joint))
    }

    /// Viscous or Coulomb friction where a set has only the other one: hardly a joint is without either, and the missing one would bias the
    /// other without being in its uncertainty.
    pub(crate) fn other_friction(&self, set: &[usize]) -> Vec<usize> {
        let missing = |number: &usize| {
            let form = self.form(*number);
            let (name, place) = (form.name(), form.place);
            let other = match name {
                VISCOUS => COULOMB,
                _ => VISCOUS,
            };
            !self.has(set, |form| form.is_called(name, place))
                && self.has(set, |form| form.is_called(other, place))
        };
        let sweep = self.base.with(set);
        let missing = self.common().into_iter().filter(missing);
        // Friction that would drive is none.
        missing.filter(|number| sweep.rises(*number)).collect()
    }
}

/// A cause at a place in every shape that is listed of it.
pub(super) struct TorqueCell {
    pub(super) name: Cow<'static, str>,
    pub(super) place: Place,
    pub(super) log_prior: f64,
    /// Numbers of its forms.
    pub(super) forms: Vec<usize>,
    /// Cells that it modifies; one that is none where there is none.
    pub(super) needs: Vec<usize>,
}

/// A form in the covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TorqueComponent {
    pub(crate) form: usize,
    pub(crate) amplitude: f64,
}

/// A form's columns at unit amplitude, the base swept out: with each other, and with the measured torque.
pub(super) type FormProducts = (DMatrix<f64>, DVector<f64>);

/// Components in the covariance.
pub(super) struct TorqueState {
    pub(super) known: KnownState,
    /// Their columns and the roots of their prior variances.
    pub(super) columns: Vec<(usize, f64)>,
    set: Vec<usize>,
}

/// All cells of a problem.
pub(super) struct TorqueTable<'a, 'b> {
    pub(super) choice: &'b CauseChoice<'a>,
    pub(super) cells: Vec<TorqueCell>,
    pub(super) cell_of: BTreeMap<usize, usize>,
    rows: EvidenceRows,
    pub(super) forms: Vec<FormProducts>,
    /// Coefficient of each column at unit amplitude.
    unit: Vec<f64>,
    /// Forms that do not leave.
    pub(super) kept: Vec<usize>,
    /// What the base leaves of the products of each column with all others, of those that were asked for.
    left: Vec<OnceLock<Vec<f64>>>,
}

impl<'a, 'b> TorqueTable<'a, 'b> {
    /// The cells of the listed forms.
    pub(crate) fn new(choice: &'b CauseChoice<'a>) -> Self {
        let all = &choice.problem.all;
        let mut keys: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (number, form) in all.forms.iter().enumerate() {
            let key = (
                form.name(),
                form.kind(),
                form.place,
                (form.cause.cell)(form),
            );
            keys.entry(key).or_default().push(number);
        }
        let cells = keys.into_iter().map(|((name, _, place, _), forms)| {
            let prices = forms.iter().map(|number| choice.form(*number));
            let prices = prices.map(|form| (form.cause.price)(form));
            let open = match name == UNKNOWN {
                true => choice.problem.openness,
                false => 0.0,
            };
            TorqueCell {
                name: Cow::Owned(name.into()),
                place,
                log_prior: COMMON.ln() - 0.5 * prices.fold(f64::INFINITY, f64::min) + open,
                forms,
                needs: Vec::new(),
            }
        });
        let mut cells: Vec<TorqueCell> = cells.collect();
        let of_name = |name: &str, place: Place| {
            let mut all = cells.iter();
            all.position(|cell| cell.name == name && cell.place == place)
        };
        let needs = |cell: &TorqueCell| -> Vec<usize> {
            let names = choice.form(cell.forms[0]).cause.modifies.iter();
            let none = cells.len();
            names
                .map(|name| of_name(name, cell.place).unwrap_or(none))
                .collect()
        };
        let needs: Vec<Vec<usize>> = cells.iter().map(needs).collect();
        for (cell, needs) in cells.iter_mut().zip(needs) {
            cell.needs = needs;
        }
        let mut cell_of = BTreeMap::new();
        for (number, cell) in cells.iter().enumerate() {
            cell_of.extend(cell.forms.iter().map(|form| (*form, number)));
        }
        let unit = |column: usize| {
            let size = all.size(column);
            if size > 0.0 { *PER_METRE / size } else { 0.0 }
        };
        let unit: Vec<f64> = (0..all.columns.len()).map(unit).collect();
        let products = |number: usize| {
            let (mut gram, mut along) = choice.base.left_among(number);
            for (a, column) in all.of(number).enumerate() {
                along[a] *= unit[column];
                gram.row_mut(a).scale_mut(unit[column]);
                gram.column_mut(a).scale_mut(unit[column]);
            }
            (gram, along)
        };
        // Trial forms that are in no set have no products.
        let forms =
            (0..all.forms.len()).map(|number| match choice.weighted.has(all.of(number).start) {
                true => products(number),
                false => (DMatrix::zeros(0, 0), DVector::zeros(0)),
            });
        let forms = forms.collect();
        let measured = choice.weighted.measured.iter();
        let rows = measured.zip(&choice.problem.noise);
        let rows = rows.map(|(course, noise)| course.len() as f64 * noise.share_of_rows());
        let freedom = rows.sum();
        let rows = EvidenceRows {
            freedom,
            square: choice.base.square,
        };
        Self {
            choice,
            cells,
            cell_of,
            rows,
            forms,
            unit,
            kept: Vec::new(),
            left: all.columns.iter().map(|_| OnceLock::new()).collect(),
        }
    }

    /// What the base leaves of the products of a column with all others.
    fn left_of(&self, column: usize) -> &[f64] {
        self.left[column].get_or_init(|| self.choice.base.left_of(column))
    }

    /// Components in the covariance, with the noise that fits them or a stated one.
    pub(super) fn state(&self, components: &[TorqueComponent], kappa: Option<f64>) -> TorqueState {
        let all = &self.choice.problem.all;
        let columns_of = |component: &TorqueComponent| {
            let columns = all.of(component.form);
            let root = component.amplitude / (columns.len() as f64).sqrt();
            columns
                .map(|column| (column, self.unit[column] * root))
                .collect::<Vec<_>>()
        };
        let columns: Vec<(usize, f64)> = components.iter().flat_map(columns_of).collect();
        let left = columns.iter().map(|(column, _)| self.left_of(*column));
        let left: Vec<&[f64]> = left.collect();
        let count = columns.len();
        let gram = DMatrix::from_fn(count, count, |a, b| {
            left[a][columns[b].0] * columns[a].1 * columns[b].1
        });
        let along = DVector::from_fn(count, |a, _| {
            self.choice.base.right_of(columns[a].0) * columns[a].1
        });
        let known = KnownState::new(&gram, along, self.rows, *LEAST_NOISE, kappa);
        TorqueState {
            known,
            columns,
            set: forms(components),
        }
    }

    /// A form's products seen through the covariance.
    pub(super) fn seen(&self, number: usize, state: &TorqueState) -> FormProducts {
        let columns: Vec<usize> = self.choice.problem.all.of(number).collect();
        let left = state
            .columns
            .iter()
            .map(|(column, _)| self.left_of(*column));
        let left: Vec<&[f64]> = left.collect();
        let product =
            |a: usize, b: usize| left[a][columns[b]] * state.columns[a].1 * self.unit[columns[b]];
        let products = DMatrix::from_fn(left.len(), columns.len(), product);
        let across = state.known.solved(products);
        let (gram, along) = &self.forms[number];
        state.known.see((gram, along), &across, 0)
    }

    /// ln of the evidence of a form given a state, and its amplitude; none of one that is impossible.
    pub(super) fn form(&self, number: usize, state: &TorqueState) -> Option<(f64, f64)> {
        let (gram, along) = self.seen(number, state);
        let count = along.len();
        let shares = vec![1.0 / count as f64; count];
        let found = evidence(&gram, &along, &shares, state.known.rows);
        let values = || {
            // Their means given the rows: of columns that nearly cancel each other least squares would make whatever is large.
            let least = count as f64 / found.amplitude.powi(2);
            let factor = (&gram + DMatrix::identity(count, count) * least).cholesky();
            let solved =
                factor.map_or_else(|| DVector::zeros(count), |factor| factor.solve(&along));
            let units = &self.unit[self.choice.problem.all.of(number)];
            let values = solved.iter().zip(units);
            values.map(|(value, unit)| value * unit).collect()
        };
        let rises = || along.iter().all(|value| *value > 0.0);
        let may_be = found.amplitude > 0.0
            && (found.log < 0.0 || self.choice.may_be(number, &state.set, rises, values));
        may_be.then_some((found.log, found.amplitude))
    }

    /// ln of the odds of a form's cell before the rows are looked at.
    pub(super) fn log_prior(&self, form: usize) -> f64 {
        self.cells[self.cell_of[&form]].log_prior
    }

    /// ln of the number of shapes of a cell that may be chosen.
    pub(super) fn log_count(&self, cell: usize) -> f64 {
        (self.open(cell).count().max(1) as f64).ln()
    }

    /// Shapes of a cell that may be chosen.
    pub(super) fn open(&self, cell: usize) -> impl Iterator<Item = usize> {
        let forms = self.cells[cell].forms.iter().copied();
        forms.filter(|form| self.choice.is_open(*form))
    }

    /// ln of the evidence of every shape of a cell that may join a state.
    pub(super) fn shapes(&self, cell: usize, state: &TorqueState) -> Vec<(f64, TorqueComponent)> {
        let shape = |form: usize| {
            let (log, amplitude) = self.form(form, state)?;
            Some((log, TorqueComponent { form, amplitude }))
        };
        self.open(cell)
            .filter(|form| self.choice.may_join(*form, &state.set))
            .filter_map(shape)
            .collect()
    }

    /// ln of the posterior odds of a cell given a state, and its best shape.
    pub(super) fn cell(&self, cell: usize, state: &TorqueState) -> Option<(f64, TorqueComponent)> {
        let taken = |cell: &usize| state.set.iter().any(|form| self.cell_of[form] == *cell);
        if !self.cells[cell].needs.iter().all(taken) {
            return None;
        }
        let all = self.shapes(cell, state);
        let (_, best) = *all.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let logs: Vec<f64> = all.iter().map(|(log, _)| *log).collect();
        let log = log_sum(&logs) - self.log_count(cell);
        Some((self.cells[cell].log_prior + log, best))
    }

    /// ln of the odds of a component given the others.
    pub(super) fn odds_of(&self, components: &[TorqueComponent], place: usize, kappa: f64) -> f64 {
        let state = self.state(&without(components, place), Some(kappa));
        let component = components[place];
        let cell = self.cell_of[&component.form];
        let Some((log, _)) = self.form(component.form, &state) else {
            // One that the arm cannot have, whatever others of its cell would do.
            return f64::NEG_INFINITY;
        };
        let log = self.cells[cell].log_prior + log - self.log_count(cell);
        let grid = self.cell(cell, &state);
        grid.map_or(log, |(grid, _)| grid.max(log))
    }

    /// ln of the posterior of a set of components, up to a constant.
    pub(super) fn total(&self, components: &[TorqueComponent]) -> f64 {
        let state = self.state(components, Some(1.0)).known;
        let mut log = -state.log_determinant();
        for component in components {
            let cell = self.cell_of[&component.form];
            log += self.cells[cell].log_prior - self.log_count(cell) - (AMPLITUDES as f64).ln();
        }
        log - 0.5 * (self.rows.freedom + *NU) * (*NU + state.rows.square).ln()
    }

    /// Cells that may stand in the place of a form.
    pub(super) fn competing(&self, form: usize) -> impl Iterator<Item = usize> {
        let may = move |cell: &usize| self.choice.compete(self.cells[*cell].forms[0], form);
        (0..self.cells.len()).filter(may)
    }
}

/// A set without a form.
pub(super) fn all_but(set: &[usize], form: usize) -> Vec<usize> {
    set.iter().copied().filter(|other| *other != form).collect()
}

pub(super) fn forms(components: &[TorqueComponent]) -> Vec<usize> {
    components.iter().map(|component| component.form).collect()
}

pub(super) fn without(components: &[TorqueComponent], place: usize) -> Vec<TorqueComponent> {
    [&components[..place], &components[place + 1..]].concat()
}
