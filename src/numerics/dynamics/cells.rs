//! Torques by the evidence of the table of causes: a cell is a cause at a place in every shape that it may have; what was accepted stands in the
//! covariance with its amplitude, and every other cell is compared given these. Of the forms of a problem: which may stand together, which in
//! each other's place.

use super::cause::{COULOMB, TORQUE_CONSTANT, TorqueForm, UNKNOWN, VISCOUS};
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;
use crate::criteria::cells::{COMMON, NU, SWAPS};
use crate::criteria::torque::{APART, COMPONENTS, EXCHANGES, LEAST_NOISE, PER_METRE, USUAL};
use crate::diagnose::table::{
    AMPLITUDES, ComponentSearch, EvidenceRows, KnownState, evidence, log_sum,
};
use crate::effect::Place;
use nalgebra::{DMatrix, DVector};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// The forms of one problem, with the base model that is fitted with all of them.
pub(super) struct CauseChoice<'a> {
    pub(crate) problem: &'a TorqueProblem<'a>,
    pub(crate) weighted: &'a WeightedColumns,
    pub(crate) base: SweptColumns<'a>,
    /// Forms that may be chosen; trial forms of a refinement are none of them.
    pub(crate) open: usize,
}

impl<'a> CauseChoice<'a> {
    /// Over all forms of a problem.
    pub(crate) fn new(problem: &'a TorqueProblem<'a>, weighted: &'a WeightedColumns) -> Self {
        Self {
            problem,
            weighted,
            base: SweptColumns::base(&problem.all, weighted),
            open: problem.all.listed,
        }
    }

    /// Over those with a name: a curve without one would be a push, or several causes at once.
    pub(crate) fn named(problem: &'a TorqueProblem<'a>, weighted: &'a WeightedColumns) -> Self {
        let mut forms = problem.all.forms[..problem.all.listed].iter();
        let open = forms.position(|form| form.cause.name == UNKNOWN);
        Self {
            open: open.unwrap_or(problem.all.listed),
            ..Self::new(problem, weighted)
        }
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
        let only_positive = cause.positive || (cause.brakes && !self.has(set, is_curve));
        (!only_positive || rises())
            && (cause.is_itself)(form, &self.problem.scene)
            && (cause.is_possible)(form, &values())
    }

    /// Whether a form may join a set: once a name and place, and what modifies a friction after it.
    fn may_join(&self, number: usize, set: &[usize]) -> bool {
        let form = self.form(number);
        let taken = |other: &usize| {
            let other_form = self.form(*other);
            *other == number
                || (form.is_called_as(other_form)
                    && (!form.cause.may_repeat || form.with == other_form.with))
        };
        let is_barred = || self.problem.barred.iter().any(|one| form.is_of_kind(one));
        !set.iter().any(taken)
            && self.has_what_it_modifies(number, set)
            && !self.has(set, |other| form.is_one_curve_with(other))
            && !is_barred()
    }

    /// Whether the frictions that a form modifies are in a set.
    fn has_what_it_modifies(&self, number: usize, set: &[usize]) -> bool {
        let form = self.form(number);
        let mut modified = form.cause.modifies.iter();
        modified.all(|name| self.has(set, |other| other.is_called(name, form.place)))
    }

    /// Whether all of a set have what they modify.
    fn is_whole(&self, set: &[usize]) -> bool {
        set.iter()
            .all(|number| self.has_what_it_modifies(*number, set))
    }

    /// Viscous and Coulomb friction of every joint: hardly an arm is without.
    fn common(&self) -> Vec<usize> {
        let common = |number: &usize| [VISCOUS, COULOMB].contains(&self.form(*number).cause.name);
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
            let TorqueForm { cause, place, .. } = self.form(*number);
            let other = match cause.name {
                VISCOUS => COULOMB,
                _ => VISCOUS,
            };
            !self.has(set, |form| form.is_called(cause.name, *place))
                && self.has(set, |form| form.is_called(other, *place))
        };
        let sweep = self.base.with(set);
        let missing = self.common().into_iter().filter(missing);
        // Friction that would drive is none.
        missing.filter(|number| sweep.rises(*number)).collect()
    }
}

/// A cause at a place in every shape that is listed of it.
pub(super) struct TorqueCell {
    pub(super) name: &'static str,
    pub(super) place: Place,
    pub(super) log_prior: f64,
    /// Numbers of its forms.
    pub(super) forms: Vec<usize>,
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
    /// What the base leaves of the products of components' columns with all others.
    left: RefCell<BTreeMap<usize, Rc<Vec<f64>>>>,
}

impl ComponentSearch for TorqueTable<'_, '_> {
    type Component = TorqueComponent;

    fn least(&self) -> f64 {
        0.5 * *APART
    }

    fn noise(&self, components: &[TorqueComponent]) -> f64 {
        self.state(components, None).known.kappa
    }

    fn odds(&self, components: &[TorqueComponent], place: usize, kappa: f64) -> Option<f64> {
        let is_free = !self.kept.contains(&components[place].form)
            && self.choice.is_whole(&forms(&without(components, place)));
        is_free.then(|| self.odds_of(components, place, kappa))
    }

    fn best(&mut self, components: &[TorqueComponent]) -> Option<TorqueComponent> {
        let state = (components.len() < *COMPONENTS).then(|| self.state(components, None))?;
        let (log_odds, best) = self.strongest(0..self.cells.len(), &state)?;
        (log_odds >= self.least()).then_some(best)
    }

    fn with_newest(&mut self, components: Vec<TorqueComponent>) -> Vec<TorqueComponent> {
        self.backfit(components)
    }

    fn anew(&mut self, components: Vec<TorqueComponent>) -> Vec<TorqueComponent> {
        self.backfit(components)
    }
}

impl<'a, 'b> TorqueTable<'a, 'b> {
    /// The cells of the listed forms.
    pub(crate) fn new(choice: &'b CauseChoice<'a>) -> Self {
        let all = &choice.problem.all;
        let mut keys: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (number, form) in all.forms.iter().enumerate() {
            let cause = form.cause;
            let key = (cause.name, form.kind(), form.place, (cause.cell)(form));
            keys.entry(key).or_default().push(number);
        }
        let cells = keys.into_iter().map(|((name, _, place, _), forms)| {
            let prices = forms.iter().map(|number| choice.form(*number));
            let prices = prices.map(|form| (form.cause.price)(form));
            TorqueCell {
                name,
                place,
                log_prior: COMMON.ln() - 0.5 * prices.fold(f64::INFINITY, f64::min),
                forms,
            }
        });
        let cells: Vec<TorqueCell> = cells.collect();
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
            left: RefCell::default(),
        }
    }

    /// What the base leaves of the products of a column with all others.
    fn left_of(&self, column: usize) -> Rc<Vec<f64>> {
        let fresh = || Rc::new(self.choice.base.left_of(column));
        self.left
            .borrow_mut()
            .entry(column)
            .or_insert_with(fresh)
            .clone()
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
        let left: Vec<Rc<Vec<f64>>> = left.collect();
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
        let left: Vec<Rc<Vec<f64>>> = left.collect();
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
        forms.filter(|form| *form < self.choice.open)
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
        let all = self.shapes(cell, state);
        let (_, best) = *all.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let logs: Vec<f64> = all.iter().map(|(log, _)| *log).collect();
        let log = log_sum(&logs) - self.log_count(cell);
        Some((self.cells[cell].log_prior + log, best))
    }

    /// The most probable of some cells given a state.
    fn strongest(
        &self,
        cells: impl IntoIterator<Item = usize>,
        state: &TorqueState,
    ) -> Option<(f64, TorqueComponent)> {
        let all = cells.into_iter().filter_map(|cell| self.cell(cell, state));
        all.max_by(|a, b| a.0.total_cmp(&b.0))
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

    /// Amplitudes anew, each given all others.
    fn backfit(&self, mut components: Vec<TorqueComponent>) -> Vec<TorqueComponent> {
        for _ in 0..2 {
            let kappa = self.state(&components, None).known.kappa;
            let mut changed = false;
            for place in 0..components.len() {
                let state = self.state(&without(&components, place), Some(kappa));
                if let Some((_, amplitude)) = self.form(components[place].form, &state) {
                    changed |= components[place].amplitude != amplitude;
                    components[place].amplitude = amplitude;
                }
            }
            if !changed {
                break;
            }
        }
        components
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

    /// Exchanges components for cells that are more probable in their place.
    fn swap(&self, mut components: Vec<TorqueComponent>) -> Vec<TorqueComponent> {
        'rounds: for _ in 0..*EXCHANGES {
            let kappa = self.state(&components, None).known.kappa;
            for place in 0..components.len() {
                let here = components[place].form;
                let others = without(&components, place);
                let state = self.state(&others, Some(kappa));
                let stays = self.odds_of(&components, place, kappa);
                let Some((log_odds, best)) = self.strongest(self.competing(here), &state) else {
                    continue;
                };
                let is_same = self.cell_of[&best.form] == self.cell_of[&here];
                let gain = match is_same {
                    // Another shape of the same cell: by itself, against the present one.
                    true => {
                        let log = |form: usize| self.form(form, &state).map(|found| found.0);
                        let log = |form: usize| log(form).unwrap_or(f64::NEG_INFINITY);
                        log(best.form) - log(here)
                    }
                    false => log_odds - stays,
                };
                let mut next = others.clone();
                next.insert(place, best);
                if gain <= *SWAPS || !self.choice.is_whole(&forms(&next)) {
                    continue;
                }
                let next = self.backfit(next);
                if is_same || self.total(&next) > self.total(&components) {
                    components = next;
                    continue 'rounds;
                }
            }
            break;
        }
        components
    }

    /// Cells that may stand in the place of a form.
    pub(super) fn competing(&self, form: usize) -> impl Iterator<Item = usize> {
        let may = move |cell: &usize| self.choice.compete(self.cells[*cell].forms[0], form);
        (0..self.cells.len()).filter(may)
    }

    /// Components of given forms.
    pub(super) fn components(&self, set: &[usize]) -> Vec<TorqueComponent> {
        let component = |form: &usize| TorqueComponent {
            form: *form,
            amplitude: *USUAL,
        };
        self.backfit(set.iter().map(component).collect())
    }

    /// The best components that steps from a start lead to.
    pub(super) fn searched(&mut self, start: &[usize]) -> Vec<TorqueComponent> {
        let components = self.add(self.components(start));
        let components = self.settled(components);
        let components = self.add(components);
        self.prune(components)
    }

    /// Exchanges and removals.
    pub(super) fn settled(&mut self, components: Vec<TorqueComponent>) -> Vec<TorqueComponent> {
        // What an arm cannot have is first exchanged for what it can have.
        let components = self.swap(components);
        let components = self.prune(components);
        let components = self.swap(components);
        self.prune(components)
    }

    /// ln of the posterior odds of a component, and of other names and places that could stand in its place.
    pub(crate) fn odds_in_place(&self, components: &[TorqueComponent], form: usize) -> CellOdds {
        let here = |component: &TorqueComponent| component.form == form;
        let Some(place) = components.iter().position(here) else {
            return (0.0, Vec::new());
        };
        let kappa = self.state(components, None).known.kappa;
        let log_odds = self.odds_of(components, place, kappa);
        let state = self.state(&without(components, place), Some(kappa));
        let rivals = self
            .competing(form)
            .filter(|cell| *cell != self.cell_of[&form]);
        let rival = |cell: usize| {
            let TorqueCell { name, place, .. } = self.cells[cell];
            Some(((name, place), self.cell(cell, &state)?.0))
        };
        (log_odds, rivals.filter_map(rival).collect())
    }
}

/// ln of posterior odds, and those of rivals.
pub(super) type CellOdds = (f64, Vec<((&'static str, Place), f64)>);

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

/// The best set from what hardly an arm is without. One factor on the whole torque of each joint is asked before masses: where factors explain as
/// much, it is these.
pub(super) fn from_common(choice: &CauseChoice) -> Vec<usize> {
    let mut table = TorqueTable::new(choice);
    let is_drive = |number: &usize| choice.form(*number).cause.name == TORQUE_CONSTANT;
    let has_masses = |set: &[TorqueComponent]| {
        let masses = |number: &usize| choice.form(*number).cause.inertial && !is_drive(number);
        forms(set).iter().any(masses)
    };
    let masses = table.searched(&choice.common());
    let drives =
        (0..choice.open).filter(|number| is_drive(number) && choice.form(*number).shape.is_empty());
    let start: Vec<usize> = choice.common().into_iter().chain(drives).collect();
    if !has_masses(&masses) || start == choice.common() {
        return forms(&masses);
    }
    let scaled = table.searched(&start);
    let worse = table.total(&masses) - table.total(&scaled);
    let most = match has_masses(&scaled) {
        true => 0.0,
        false => 0.5 * *APART,
    };
    forms(if worse <= most { &scaled } else { &masses })
}

/// The best set from a start.
pub(super) fn search(choice: &CauseChoice, start: &[usize]) -> Vec<usize> {
    forms(&TorqueTable::new(choice).searched(start))
}

/// A set after exchanges and removals.
pub(super) fn settle(choice: &CauseChoice, set: &[usize]) -> Vec<usize> {
    let mut table = TorqueTable::new(choice);
    let components = table.components(set);
    forms(&table.settled(components))
}

/// 1 / variance beforehand of the columns of a set, by the amplitudes that the rows show.
pub(super) fn priors(choice: &CauseChoice, set: &[usize]) -> Vec<(usize, f64)> {
    let table = TorqueTable::new(choice);
    let state = table.state(&table.components(set), None);
    let seen = state.columns.iter().filter(|(_, root)| *root > 0.0);
    seen.map(|(column, root)| (*column, root.powi(-2)))
        .collect()
}

/// What of a set would not be found under the present noise; `silent` stays in any case.
pub(super) fn faint(choice: &CauseChoice, set: &[usize], silent: &[usize]) -> Vec<usize> {
    let mut table = TorqueTable::new(choice);
    table.kept = silent.to_vec();
    let components = table.components(set);
    let clear = table.prune(components);
    let kappa = table.noise(&clear);
    // What others need stays in the set, but not for itself.
    let pays = |place: &usize| table.odds_of(&clear, *place, kappa) > table.least();
    let clear = (0..clear.len()).filter(pays).map(|place| clear[place].form);
    let clear: Vec<usize> = clear.collect();
    let is_faint = |number: &usize| !clear.contains(number) && !silent.contains(number);
    set.iter().copied().filter(is_faint).collect()
}
