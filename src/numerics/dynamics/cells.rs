//! Torques by the evidence of the table of causes: a cell is a cause at a place in every shape that it may have; what was accepted stands in the
//! covariance with its amplitude, and every other cell is compared given these.

use super::cause::TORQUE_CONSTANT;
use super::choice::CauseChoice;
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

/// The posterior of a cell given others.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellPosterior {
    /// ln of its posterior odds.
    pub(super) log_odds: f64,
    pub(super) best: TorqueComponent,
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
        is_free.then(|| self.odds_of(components, place, kappa).log_odds)
    }

    fn best(&mut self, components: &[TorqueComponent]) -> Option<TorqueComponent> {
        let state = (components.len() < *COMPONENTS).then(|| self.state(components, None))?;
        let best = self.strongest(0..self.cells.len(), &state)?;
        (best.log_odds >= self.least()).then_some(best.best)
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
        let mut keys: BTreeMap<(&'static str, &'static str, Place, [usize; 2]), Vec<usize>> =
            BTreeMap::new();
        for number in 0..all.forms.len() {
            let form = choice.form(number);
            let kind = form
                .cause
                .coefficients
                .first()
                .map_or("", |(name, _)| *name);
            keys.entry((form.cause.name, kind, form.place, (form.cause.cell)(form)))
                .or_default()
                .push(number);
        }
        let cell = |((name, _, place, _), forms): (
            &(&'static str, &'static str, Place, [usize; 2]),
            &Vec<usize>,
        )| {
            let price = |form: &usize| (choice.form(*form).cause.price)(choice.form(*form));
            let least = forms.iter().map(price).fold(f64::INFINITY, f64::min);
            TorqueCell {
                name,
                place: *place,
                log_prior: COMMON.ln() - 0.5 * least,
                forms: forms.clone(),
            }
        };
        let cells: Vec<TorqueCell> = keys.iter().map(cell).collect();
        let cell_of = cells
            .iter()
            .enumerate()
            .flat_map(|(k, cell)| cell.forms.iter().map(move |form| (*form, k)))
            .collect();
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
        let none = || (DMatrix::zeros(0, 0), DVector::zeros(0));
        let has_products = |number: &usize| choice.weighted.has(all.of(*number).start);
        let forms = (0..all.forms.len())
            .map(|number| {
                if has_products(&number) {
                    products(number)
                } else {
                    none()
                }
            })
            .collect();
        let freedom = choice.weighted.measured.iter().map(Vec::len).sum::<usize>() as f64;
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
        let left: Vec<Rc<Vec<f64>>> = columns
            .iter()
            .map(|(column, _)| self.left_of(*column))
            .collect();
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
        let left: Vec<Rc<Vec<f64>>> = state
            .columns
            .iter()
            .map(|(column, _)| self.left_of(*column))
            .collect();
        let product =
            |a: usize, b: usize| left[a][columns[b]] * state.columns[a].1 * self.unit[columns[b]];
        let across = state.known.solved(DMatrix::from_fn(
            state.columns.len(),
            columns.len(),
            product,
        ));
        let (gram, along) = &self.forms[number];
        state.known.see((gram, along), &across, 0)
    }

    /// ln of the evidence of a form given a state, and its amplitude; none of one that is impossible.
    pub(super) fn form(&self, number: usize, state: &TorqueState) -> Option<(f64, f64)> {
        let (gram, along) = self.seen(number, state);
        let columns: Vec<usize> = self.choice.problem.all.of(number).collect();
        let shares = vec![1.0 / columns.len() as f64; columns.len()];
        let found = evidence(&gram, &along, &shares, state.known.rows);
        let values = || {
            // Their means given the rows: of columns that nearly cancel each other least squares would make whatever is large.
            let least = columns.len() as f64 / found.amplitude.powi(2);
            let factor = (&gram + DMatrix::identity(gram.nrows(), gram.nrows()) * least).cholesky();
            let solved = factor.map_or_else(
                || vec![0.0; columns.len()],
                |factor| factor.solve(&along).as_slice().to_vec(),
            );
            solved
                .iter()
                .zip(&columns)
                .map(|(value, column)| value * self.unit[*column])
                .collect()
        };
        let rises = || along.iter().all(|value| *value > 0.0);
        let may_be = found.amplitude > 0.0
            && (found.log < 0.0 || self.choice.may_be(number, &state.set, rises, values));
        may_be.then_some((found.log, found.amplitude))
    }

    /// ln of the number of shapes of a cell that may be chosen.
    pub(super) fn log_count(&self, cell: usize) -> f64 {
        let forms = self.cells[cell].forms.iter();
        let open = forms.filter(|form| **form < self.choice.open).count();
        (open.max(1) as f64).ln()
    }

    /// ln of the evidence of every shape of a cell that may join a state.
    pub(super) fn shapes(&self, cell: usize, state: &TorqueState) -> Vec<(f64, TorqueComponent)> {
        let shape = |form: usize| {
            let (log, amplitude) = self.form(form, state)?;
            Some((log, TorqueComponent { form, amplitude }))
        };
        let forms = self.cells[cell].forms.iter().copied();
        forms
            .filter(|form| *form < self.choice.open && self.choice.may_join(*form, &state.set))
            .filter_map(shape)
            .collect()
    }

    /// The posterior of a cell given a state.
    pub(super) fn cell(&self, cell: usize, state: &TorqueState) -> Option<CellPosterior> {
        let all = self.shapes(cell, state);
        let best = all.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let log =
            log_sum(&all.iter().map(|(log, _)| *log).collect::<Vec<_>>()) - self.log_count(cell);
        Some(CellPosterior {
            log_odds: self.cells[cell].log_prior + log,
            best: best.1,
        })
    }

    /// The most probable of some cells given a state.
    fn strongest(
        &self,
        cells: impl IntoIterator<Item = usize>,
        state: &TorqueState,
    ) -> Option<CellPosterior> {
        let all = cells.into_iter().filter_map(|cell| self.cell(cell, state));
        all.max_by(|a, b| a.log_odds.total_cmp(&b.log_odds))
    }

    /// ln of the odds of a component given the others.
    pub(super) fn odds_of(
        &self,
        components: &[TorqueComponent],
        place: usize,
        kappa: f64,
    ) -> CellPosterior {
        let state = self.state(&without(components, place), Some(kappa));
        let component = components[place];
        let cell = self.cell_of[&component.form];
        let grid = self.cell(cell, &state);
        let prior = self.cells[cell].log_prior;
        let of_itself = self.form(component.form, &state);
        let Some((log, amplitude)) = of_itself else {
            // One that the arm cannot have, whatever others of its cell would do.
            return CellPosterior {
                log_odds: f64::NEG_INFINITY,
                best: component,
            };
        };
        let log = prior + log - self.log_count(cell);
        CellPosterior {
            log_odds: grid.map_or(log, |grid| grid.log_odds.max(log)),
            best: TorqueComponent {
                amplitude,
                ..component
            },
        }
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
                let stays = self.odds_of(&components, place, kappa).log_odds;
                let may = |cell: &usize| {
                    let form = self.cells[*cell].forms[0];
                    self.choice.compete(form, here)
                };
                let Some(best) = self.strongest((0..self.cells.len()).filter(may), &state) else {
                    continue;
                };
                let is_same = self.cell_of[&best.best.form] == self.cell_of[&here];
                let gain = if is_same {
                    // Another shape of the same cell: by itself, against the present one.
                    let [one, other] = [best.best.form, here].map(|form| {
                        self.form(form, &state)
                            .map_or(f64::NEG_INFINITY, |found| found.0)
                    });
                    one - other
                } else {
                    best.log_odds - stays
                };
                let mut next = others.clone();
                next.insert(place, best.best);
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

    /// Components of given forms.
    pub(super) fn components(&self, set: &[usize]) -> Vec<TorqueComponent> {
        self.backfit(
            set.iter()
                .map(|form| TorqueComponent {
                    form: *form,
                    amplitude: *USUAL,
                })
                .collect(),
        )
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

    /// The odds of a component and of all that could stand in its place.
    pub(crate) fn odds_in_place(&self, components: &[TorqueComponent], form: usize) -> CellOdds {
        let kappa = self.state(components, None).known.kappa;
        let Some(place) = components
            .iter()
            .position(|component| component.form == form)
        else {
            return CellOdds {
                log_odds: 0.0,
                rivals: Vec::new(),
            };
        };
        let log_odds = self.odds_of(components, place, kappa).log_odds;
        let state = self.state(&without(components, place), Some(kappa));
        let others = (0..self.cells.len()).filter(|cell| *cell != self.cell_of[&form]);
        let competing = others.filter(|cell| self.choice.compete(self.cells[*cell].forms[0], form));
        let rival = |cell: usize| {
            let posterior = self.cell(cell, &state)?;
            Some((
                (self.cells[cell].name, self.cells[cell].place),
                posterior.log_odds,
            ))
        };
        CellOdds {
            log_odds,
            rivals: competing.filter_map(rival).collect(),
        }
    }
}

/// ln of posterior odds.
pub(super) struct CellOdds {
    pub(crate) log_odds: f64,
    /// Of other names and places.
    pub(crate) rivals: Vec<((&'static str, Place), f64)>,
}

pub(super) fn forms(components: &[TorqueComponent]) -> Vec<usize> {
    components.iter().map(|component| component.form).collect()
}

pub(super) fn without(components: &[TorqueComponent], place: usize) -> Vec<TorqueComponent> {
    components
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != place)
        .map(|(_, component)| *component)
        .collect()
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
    let most = if has_masses(&scaled) {
        0.0
    } else {
        0.5 * *APART
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
    let pays = |place: &usize| table.odds_of(&clear, *place, kappa).log_odds > table.least();
    let clear: Vec<usize> = (0..clear.len())
        .filter(pays)
        .map(|place| clear[place].form)
        .collect();
    let mut faint = set.to_vec();
    faint.retain(|number| !clear.contains(number) && !silent.contains(number));
    faint
}
