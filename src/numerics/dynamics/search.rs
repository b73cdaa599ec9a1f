//! Torques as a problem of the one engine: a fit is a set of forms with their amplitudes, given the base, the noise and the shapes of the forms.

use super::cause::{TORQUE_CONSTANT, TorqueForm};
use super::cells::{CauseChoice, TorqueComponent, TorqueTable, forms, without};
use crate::criteria::cells::{RIVAL, SWAPS};
use crate::criteria::torque::{APART, COMPONENTS, EXCHANGES, USUAL};
use calib_engine::{Accepted, Cause, Cell, Finding, Options, Problem, Scanned};

/// A set of forms in the covariance.
#[derive(Clone)]
pub(super) struct TorqueFit {
    components: Vec<TorqueComponent>,
    /// ln of its posterior.
    log: f64,
}

impl Problem for TorqueTable<'_, '_> {
    /// Number of the cell.
    type Key = usize;
    type Fit = TorqueFit;
    /// Columns do not depend on a fit.
    type Around = ();

    fn around(&self, _fit: &TorqueFit, _before: Option<&()>) {}

    fn scan(&self, fit: &TorqueFit, _around: &(), out: Option<usize>) -> Vec<Scanned<usize>> {
        let components = &fit.components;
        let whole = self.state(components, None);
        let state = out.map(|place| {
            let kappa = Some(whole.known.kappa);
            self.state(&without(components, place), kappa)
        });
        let state = state.as_ref().unwrap_or(&whole);
        let cells: Vec<usize> = match out {
            Some(place) => self.competing(components[place].form).collect(),
            None => (0..self.cells.len()).collect(),
        };
        let scanned = |cell: usize| {
            let (log_odds, best) = self.cell(cell, state)?;
            (log_odds > 0.0).then(|| Scanned {
                accepted: self.accepted(&best),
                log_odds,
            })
        };
        let mut all: Vec<Scanned<usize>> = cells.into_iter().filter_map(scanned).collect();
        all.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        all
    }

    fn fit(&self, set: &[Accepted<usize>], _before: Option<&TorqueFit>, _least: f64) -> TorqueFit {
        let component = |one: &Accepted<usize>| TorqueComponent {
            form: self.cells[one.cell.key].forms[one.shape],
            amplitude: one.numbers[0],
        };
        self.fitted(set.iter().map(component).collect())
    }

    fn settled(&self, fit: &TorqueFit) -> TorqueFit {
        let mut fit = fit.clone();
        for _ in 0..*EXCHANGES {
            let Some(reshaped) = self.reshaped(&fit.components) else {
                break;
            };
            fit = self.fitted(reshaped);
        }
        fit
    }

    fn set(&self, fit: &TorqueFit) -> Vec<Accepted<usize>> {
        fit.components
            .iter()
            .map(|component| self.accepted(component))
            .collect()
    }

    fn log_evidence(&self, fit: &TorqueFit, _independence: f64) -> f64 {
        fit.log
    }

    fn odds(&self, fit: &TorqueFit, member: usize, _independence: f64) -> Option<f64> {
        if self.kept.contains(&fit.components[member].form) {
            return Some(f64::INFINITY);
        }
        let kappa = self.state(&fit.components, None).known.kappa;
        Some(self.odds_of(&fit.components, member, kappa))
    }

    fn excludes(&self, one: &Accepted<usize>, other: &Accepted<usize>) -> bool {
        let [one, other] = [one, other].map(|one| self.cells[one.cell.key].forms[one.shape]);
        self.choice.excludes(one, other)
    }
}

impl TorqueTable<'_, '_> {
    /// Components with their amplitudes, without those that cannot be.
    fn fitted(&self, mut components: Vec<TorqueComponent>) -> TorqueFit {
        while let Some(place) = self.backfit(&mut components) {
            components.remove(place);
        }
        TorqueFit {
            log: self.total(&components),
            components,
        }
    }

    /// Components with one of them in a shape of its cell that is more probable; none where there is none.
    fn reshaped(&self, components: &[TorqueComponent]) -> Option<Vec<TorqueComponent>> {
        let kappa = self.state(components, None).known.kappa;
        (0..components.len()).find_map(|place| {
            let here = components[place].form;
            let state = self.state(&without(components, place), Some(kappa));
            let now = self
                .form(here, &state)
                .map_or(f64::NEG_INFINITY, |found| found.0);
            let shapes = self.shapes(self.cell_of[&here], &state);
            let (log, best) = shapes.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
            (log > now + *SWAPS).then(|| {
                let mut components = components.to_vec();
                components[place] = best;
                components
            })
        })
    }

    /// A component as the engine has it.
    fn accepted(&self, component: &TorqueComponent) -> Accepted<usize> {
        let key = self.cell_of[&component.form];
        let cell = &self.cells[key];
        let here = |form: &usize| *form == component.form;
        Accepted {
            shape: cell.forms.iter().position(here).unwrap_or_default(),
            cell: Cell {
                key,
                cause: Cause::named(cell.name.clone()),
                place: cell.place.to_string(),
                log_prior: cell.log_prior,
                // Which forms it has, and what each weighs, the table knows.
                shapes: Vec::new(),
                needs: cell.needs.clone(),
            },
            numbers: vec![component.amplitude],
        }
    }

    /// Amplitudes anew, each given all others; the member that cannot be, the newest last, or that misses what it needs.
    fn backfit(&self, components: &mut [TorqueComponent]) -> Option<usize> {
        for _ in 0..BACKFITS {
            let kappa = self.state(components, None).known.kappa;
            let mut changed = false;
            // The newest first: of its size nothing is known.
            for place in (0..components.len()).rev() {
                let state = self.state(&without(components, place), Some(kappa));
                let found = self.form(components[place].form, &state);
                let amplitude = found.map(|(_, amplitude)| amplitude);
                changed |= amplitude.is_some_and(|size| size != components[place].amplitude);
                components[place].amplitude = amplitude.unwrap_or(components[place].amplitude);
            }
            if !changed {
                break;
            }
        }
        let kappa = self.state(components, None).known.kappa;
        let taken: Vec<usize> = components
            .iter()
            .map(|one| self.cell_of[&one.form])
            .collect();
        let is_none = |place: &usize| {
            let needs = &self.cells[taken[*place]].needs;
            let state = || self.state(&without(components, *place), Some(kappa));
            !self.kept.contains(&components[*place].form)
                && (!needs.iter().all(|cell| taken.contains(cell))
                    || self.form(components[*place].form, &state()).is_none())
        };
        (0..components.len()).find(is_none)
    }

    /// Components of given forms, of which no size is known.
    fn begun(&self, set: &[usize]) -> Vec<TorqueComponent> {
        let begun = |form: &usize| TorqueComponent {
            form: *form,
            amplitude: *USUAL,
        };
        set.iter().map(begun).collect()
    }

    /// A set as the engine has it.
    fn members(&self, set: &[usize]) -> Vec<Accepted<usize>> {
        let begun = self.begun(set);
        begun.iter().map(|one| self.accepted(one)).collect()
    }

    /// Components of given forms with their amplitudes.
    pub(super) fn components(&self, set: &[usize]) -> Vec<TorqueComponent> {
        let mut components = self.begun(set);
        self.backfit(&mut components);
        components
    }

    /// The best set that steps from a start lead to.
    fn searched(&self, start: &[usize]) -> TorqueFit {
        let start = self.settled(&self.fit(&self.members(start), None, f64::NEG_INFINITY));
        calib_engine::diagnose(self, &self.set(&start), &options(), |_| ()).after
    }

    /// What each of a set is, and what else could be in its place.
    pub(super) fn findings(&self, set: &[usize]) -> Vec<(usize, Finding<usize>)> {
        let found = calib_engine::findings(self, &self.members(set), &options());
        let form = |one: &Accepted<usize>| self.cells[one.cell.key].forms[one.shape];
        found
            .into_iter()
            .map(|one| (form(&one.accepted), one))
            .collect()
    }

    /// Components without those that are useless.
    pub(super) fn dropped(&self, set: &[usize]) -> Vec<TorqueComponent> {
        calib_engine::dropped(self, &self.members(set), &options(), |_| ()).components
    }
}

/// Rounds in which amplitudes find each other, at most.
const BACKFITS: usize = 2;

fn options() -> Options {
    Options {
        joins: 0.5 * *APART,
        leaves: 0.5 * *APART,
        exchanges: *SWAPS,
        exchanged: *EXCHANGES,
        most: *COMPONENTS,
        told: *RIVAL,
        regroups: false,
        ..Options::default()
    }
}

/// The best set from viscous and Coulomb friction of every joint. One factor on the whole torque of each joint is tried before masses, and preferred where it
/// explains as much.
pub(super) fn from_common(choice: &CauseChoice) -> Vec<usize> {
    let table = TorqueTable::new(choice);
    let is_drive = |form: &TorqueForm| form.name() == TORQUE_CONSTANT;
    let has_masses = |fit: &TorqueFit| {
        choice.has(&forms(&fit.components), |form| {
            form.cause.inertial && !is_drive(form)
        })
    };
    let masses = table.searched(&choice.common());
    let drives = (0..choice.open).filter(|number| {
        let form = choice.form(*number);
        is_drive(form) && form.shape.is_empty()
    });
    let start: Vec<usize> = choice.common().into_iter().chain(drives).collect();
    if !has_masses(&masses) || start == choice.common() {
        return forms(&masses.components);
    }
    let scaled = table.searched(&start);
    let most = match has_masses(&scaled) {
        true => 0.0,
        false => 0.5 * *APART,
    };
    let is_scaled = masses.log - scaled.log <= most;
    forms(&if is_scaled { scaled } else { masses }.components)
}

/// The best set from a start.
pub(super) fn search(choice: &CauseChoice, start: &[usize]) -> Vec<usize> {
    forms(&TorqueTable::new(choice).searched(start).components)
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
    let clear = table.dropped(set);
    let kappa = table.state(&clear, None).known.kappa;
    // What others need stays in the set, but not for itself.
    let pays = |place: &usize| table.odds_of(&clear, *place, kappa) > options().leaves;
    let clear = (0..clear.len()).filter(pays).map(|place| clear[place].form);
    let clear: Vec<usize> = clear.collect();
    // When others go, a form may take another shape.
    let is_one = |a: usize, b: usize| {
        table.cell_of[&a] == table.cell_of[&b] && choice.form(a).with == choice.form(b).with
    };
    let is_clear = |number: usize| clear.iter().any(|one| is_one(*one, number));
    let is_faint = |number: &usize| !is_clear(*number) && !silent.contains(number);
    set.iter().copied().filter(is_faint).collect()
}

#[cfg(test)]
mod tests {
    use super::super::cases::{Row, arm, record, sign};
    use super::super::problem::{TorqueBand, TorqueProblem, basic_forms, noise_of, rich_forms};
    use super::super::recording::RecordingClock;
    use super::super::refine::take_sign_widths;
    use super::super::types::TorqueQuestion;
    use super::super::weighted::NoiseMemory;
    use super::*;
    use crate::effect::Place;

    #[test]
    fn a_form_of_a_refined_shape_is_clear_though_others_are_faint() {
        let arm = arm();
        let friction = |(joint, _, _, velocity, ..): Row| {
            let falls = 4.0 * libm::exp(-velocity.abs() / 0.1);
            sign(velocity) * (5.0 + if joint == 2 { falls } else { 0.0 })
        };
        let recording = record(&arm, 0.0, &friction);
        let clock = RecordingClock::of(&recording);
        let (question, band) = (TorqueQuestion::default(), TorqueBand::whole(10.0));
        let mut problem = TorqueProblem::new(&arm, recording, &question, &clock, band);
        take_sign_widths(&mut problem, false);
        problem.form();
        let rich = rich_forms(&problem, &[]);
        problem.noise = noise_of(&problem, &rich, NoiseMemory::Short);
        let mut set = basic_forms(&problem);
        let mut forms = problem.all.forms.iter();
        let stribeck = forms.find(|form| form.is_called("stribeck_friction", Place::Joint(2)));
        let refined = stribeck.expect("listed").with_shape(0, 0.115);
        let refined = problem.push(refined);
        set.push(refined);
        let weighted = problem.weighted(&set);
        let faint = faint(&CauseChoice::new(&problem, &weighted), &set, &[]);
        // There is no viscous friction, and with that the shape that is listed is the better one.
        assert!(!faint.is_empty());
        assert!(!faint.contains(&refined));
    }
}
