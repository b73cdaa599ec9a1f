//! The table of causes: every cause is a cell (a place, a motion there, what it follows), the curve inside is free, and all cells, with a name
//! or without, compete by one evidence.
//!
//! A cell's shapes share one unit of prior weight, so that a cause pays for being there and not for the number of its shapes; components
//! that were accepted sit in the covariance of the rows, and every other cell is asked given them.

mod answer;
mod cause_table;
mod cell;
mod coarse;
mod component;
mod factored;
mod frame;
mod generated;
mod given;
mod listed;
mod noise_shape;
mod refine;
mod scan;
mod search;
mod separable;
mod size;
mod state;
mod stepped;

pub(crate) use answer::{Answer, FoundCell};
pub(crate) use generated::places;
pub use given::{CellAnswer, GivenCell};
pub(crate) use given::{answers, given_causes};
pub(crate) use listed::forms_of;
pub use size::rms_size;
pub use state::KnownState;

use super::round::{EstimatedCause, RoundView};
use super::types::Located;
use crate::criteria::cells::{IDLE, OPEN, ROUNDS, UNEXPLAINED};
use crate::criteria::judge::REFUTED;
use crate::criteria::screen::MISTAKES;
use crate::effect::{Basis, Form, Law, Place, Survey, Variable, names};
use crate::estimate::Prior;
use crate::observation::only_contacts;
use cause_table::CauseTable;
use cell::{CauseCell, FreeShape};
use component::Component;
use frame::SearchRows;
use noise_shape::NoiseShape;
use std::collections::BTreeSet;

/// What rounds of searching around better and better models keep.
#[derive(Default)]
pub(crate) struct Rounds {
    known: KnownComponents,
    shown: Vec<FreeShape>,
    /// Whether cells without a name are asked of few rows, too.
    is_open: bool,
    /// Products of two variables that show together; none before they were looked for.
    pairs: Option<Vec<FreeShape>>,
    /// Whether those have come since the last round.
    has_new_pairs: bool,
    /// Whether rows that are far off count as the others in the next round.
    all_count: bool,
    first: Option<(Located, f64)>,
    round: usize,
    /// Keys of cells that are not asked again: in the whole model they came to nothing.
    empty: BTreeSet<String>,
    /// Searches in a row of which stretches of a path confirmed nothing.
    refuted: usize,
    /// Keys of the cells of sets that were answered, or that an answer led to.
    exchanged: BTreeSet<Vec<String>>,
    /// What the last answer led to.
    better: Option<KnownComponents>,
}

/// Components from round to round.
#[derive(Default)]
struct KnownComponents {
    /// With the keys of their cells.
    components: Vec<(String, Component)>,
    /// Products among them, with ln of their prior odds.
    products: Vec<(FreeShape, f64)>,
}

impl KnownComponents {
    fn of(table: &CauseTable, components: Vec<Component>) -> Self {
        let cell = |component: &Component| &table.cells[component.cell];
        let product = |component: &Component| {
            let free = cell(component).free().filter(|free| free.is_product())?;
            Some((*free, cell(component).log_prior))
        };
        let keyed = |component: Component| (cell(&component).key.clone(), component);
        Self {
            products: components.iter().filter_map(product).collect(),
            components: components.into_iter().map(keyed).collect(),
        }
    }

    /// Keys of the cells, in their order.
    fn keys(&self) -> Vec<String> {
        let mut keys: Vec<String> = self.components.iter().map(|(key, _)| key.clone()).collect();
        keys.sort();
        keys
    }
}

/// What a round found.
pub(crate) struct Round {
    pub(crate) causes: Vec<EstimatedCause>,
    /// What it means, where the round is the last one.
    pub(crate) answer: Option<Answer>,
    /// How many cells were compared.
    pub(crate) cells: usize,
}

impl Rounds {
    /// The number of rounds so far.
    pub(crate) fn count(&self) -> usize {
        self.round
    }

    /// From the beginning, where the noise is believed to be another one; where the residual sat at first stays.
    pub(crate) fn again(&mut self) {
        *self = Self {
            first: self.first.take(),
            empty: std::mem::take(&mut self.empty),
            refuted: self.refuted,
            ..Self::default()
        };
    }

    /// The same of those that stretches of a path do not confirm, of so many in all.
    pub(crate) fn again_unconfirmed(&mut self, causes: &[usize], all: usize) -> bool {
        self.refuted = match causes.len() == all {
            true => self.refuted + 1,
            false => 0,
        };
        self.again_without(causes)
    }

    /// From the beginning without the cells of some causes of the last model; false if they are none.
    pub(crate) fn again_without(&mut self, causes: &[usize]) -> bool {
        let mut at = 0;
        for (key, component) in &self.known.components {
            let range = at..at + component.forms.len();
            at = range.end;
            if causes.iter().any(|cause| range.contains(cause)) {
                self.empty.insert(key.clone());
            }
        }
        if !causes.is_empty() {
            self.again();
        }
        !causes.is_empty()
    }

    /// Goes on with the components that the last answer found to be more probable; false where there are none, or where they were had before.
    pub(crate) fn exchange(&mut self) -> bool {
        let Some(better) = self.better.take() else {
            return false;
        };
        let is_new = self.exchanged.insert(better.keys());
        if is_new {
            self.known = better;
        }
        is_new
    }

    /// Searches around a fitted model.
    pub(crate) fn search(&mut self, view: &RoundView) -> Round {
        self.round += 1;
        let survey = view.survey();
        let all_count = std::mem::take(&mut self.all_count);
        let noise = if self.round > 1 && !all_count {
            NoiseShape::of(view)
        } else {
            NoiseShape::at_first(view)
        };
        let components = self.known.components.iter();
        let sizes =
            components.flat_map(|(_, one)| one.forms.iter().map(move |form| (form, one.amplitude)));
        let noise = noise.with_unknown_memory(&survey, sizes);
        let many_far = noise.far > *MISTAKES;
        let mut frame = SearchRows::of(view, noise);
        let question = view.fitter.question;
        let contacts_only = only_contacts(&view.fitter.data, question.fit);
        let empty = self.empty.clone();
        let keeps = |cell: &CauseCell| !empty.contains(&cell.key) && is_kept(cell, view, &survey);
        let all_pairs = if self.pairs.is_none() {
            generated::pairs(&survey, &mut frame)
        } else {
            Vec::new()
        };
        let before = self.known.keys();
        let known = std::mem::take(&mut self.known);
        let products = known.products.into_iter();
        let products = products.map(|(free, prior)| generated::cell(free, prior, &survey));
        let mut products: Vec<_> = products.collect();
        let pairs = self.pairs.as_deref().unwrap_or_default();
        products.extend(generated::pair_cells(pairs, &survey));
        let products = (&self.shown[..], products);
        let is_open = self.is_open || survey.rows.len() >= *OPEN;
        let mut table = CauseTable::new(&mut frame, &survey, question, products, is_open, keeps);
        table.from_before.clone_from(&before);
        table.has_steps = self.pairs.is_some();
        table.is_closed = self.refuted >= *REFUTED;
        let mut components = Vec::new();
        for (key, component) in known.components {
            if let Some(cell) = table.cell(&key) {
                components.push(table.component_of(&component, cell));
            }
        }
        if self.first.is_none() {
            let state = table.state(&[], None);
            let scan = table.scan(&state, 12, &[]);
            self.first = Some((table.locate(&state), answer::nothing(&scan)));
        }
        let has_begun = !components.is_empty();
        components = if has_begun {
            table.backfit(components, 1)
        } else {
            table.start()
        };
        // Joints that yield come first: masses and currents speak of what yields in the model, and large motions are not linear.
        let waits = !has_begun && !components.is_empty() && self.round < *ROUNDS;
        if !waits {
            components = table.searched(components);
        }
        if !waits && !components.is_empty() {
            if table.add_siblings(&components, &self.empty) {
                components = table.searched(components);
            }
            if std::mem::take(&mut self.has_new_pairs) {
                components = table.or_from_named(components);
            }
            components = table.by_several(components);
        }
        let known = KnownComponents::of(&table, components.clone());
        let keys = known.keys();
        let shown = table.shown(&components);
        let is_settled = keys == before && shown.len() <= self.shown.len();
        let mut is_last =
            components.is_empty() || is_settled && self.round > 1 || self.round >= *ROUNDS;
        if is_last && !(is_open && self.pairs.is_some()) {
            let state = table.state(&components, None);
            let unexplained = (state.kappa > *UNEXPLAINED || many_far) && !contacts_only;
            if !is_open {
                self.is_open = unexplained;
                is_last = !unexplained;
            } else if self.pairs.is_none() {
                let named = table.named(&components);
                let mut seen = Vec::new();
                if unexplained {
                    seen = table.seen_pairs(&all_pairs, &state);
                }
                // What several components without a name explain may be one product.
                if named.len() + 1 < components.len() {
                    let mut more = table.seen_pairs(&all_pairs, &table.state(&named, None));
                    more.retain(|free| !seen.contains(free));
                    seen.extend(more);
                }
                // Rows that stand out in number may be those between two steps.
                self.all_count = many_far && !contacts_only;
                is_last = seen.is_empty() && !self.all_count;
                self.has_new_pairs = !is_last;
                self.pairs = Some(seen);
            }
        }
        let answer = is_last.then(|| {
            table.add_siblings(&components, &self.empty);
            table.answer(&components, self.first.clone().unwrap_or_default())
        });
        // A closer look may find something more probable in the stead of a finding.
        let better = answer.as_ref().and_then(|answer| answer.better.clone());
        let better = better.and_then(|(members, component)| {
            let mut next = search::without(&components, &members);
            next.push(component);
            let next = table.backfit(next, 1);
            table.is_better(&next, &components).then_some(next)
        });
        self.exchanged.insert(keys);
        self.better = better.map(|next| KnownComponents::of(&table, next));
        let mut causes = estimated(&table, &components);
        by_currents(&mut causes, view);
        let cells = table.cells.len();
        (self.known, self.shown) = (known, shown);
        Round {
            causes,
            answer,
            cells,
        }
    }
}

/// Whether a cell may be asked of a recording.
fn is_kept(cell: &CauseCell, view: &RoundView, survey: &Survey) -> bool {
    let fitter = view.fitter;
    // Where nothing but joints was recorded, base and first joint move with all places that the target was laid into.
    let unseen = only_contacts(&fitter.data, fitter.question.fit)
        && (cell.place == Place::Base
            || cell.place == Place::Joint(0) && cell.name == names::ZERO_SHIFT);
    let values = |variable| view.problem.values(variable);
    let groups = cell.groups(survey, &values, false);
    let mut forms = groups.iter().flat_map(|group| &group.forms);
    let stands = |form: &Form| {
        let mut joints = form
            .variables()
            .into_iter()
            .filter_map(Variable::by_motion_of);
        joints.any(|joint| survey.stands(joint))
    };
    // A joint that stands says nothing by its motion: what is left of that is the noise of its encoder.
    !(unseen
        || fitter.causes_of_the_arm_first() && forms.clone().any(Form::follows_time)
        || !groups.is_empty() && forms.all(stands))
}

/// Components as causes of the whole model, each with what the evidence says of the size of its coefficients; waves that the rows could not
/// show are left out.
fn estimated(table: &CauseTable, components: &[Component]) -> Vec<EstimatedCause> {
    let coefficients = table.state(components, None).coefficients(table.frame);
    let mut out = Vec::new();
    for (component, coefficients) in components.iter().zip(coefficients) {
        let sigmas = component.sigmas();
        let seen = |k: usize| {
            let root = component.amplitude * component.shape.shares[k].sqrt();
            root * component.values.column(k).norm() > *IDLE
        };
        let mut first = 0;
        for (form, count) in component.forms.iter().zip(&component.counts) {
            let range = first..first + count;
            first += count;
            let (form, kept) = without_idle_waves(form, *count, &|k| seen(range.start + k));
            out.push(EstimatedCause {
                form,
                coefficients: kept.iter().map(|k| coefficients[range.start + k]).collect(),
                priors: kept
                    .iter()
                    .map(|k| Prior {
                        mean: 0.0,
                        sigma: sigmas[range.start + k].max(f64::MIN_POSITIVE.sqrt()),
                    })
                    .collect(),
            });
        }
    }
    out
}

/// What the motor currents say of the numbers of the torque model, as their priors.
fn by_currents(causes: &mut [EstimatedCause], view: &RoundView) {
    let is_asked = |cause: &&mut EstimatedCause| cause.form.is_of_torque_model();
    let mut asked: Vec<&mut EstimatedCause> = causes.iter_mut().filter(is_asked).collect();
    let forms: Vec<&Form> = asked.iter().map(|cause| &cause.form).collect();
    let mut priors = view.problem.priors_by_currents(&forms).into_iter();
    for cause in &mut asked {
        let by_current: Vec<Prior> = priors.by_ref().take(cause.coefficients.len()).collect();
        if by_current.len() == cause.coefficients.len() {
            cause.priors = by_current;
        }
    }
}

/// A form with a curve of no more waves than are `seen`, and which of its columns stay.
fn without_idle_waves(
    form: &Form,
    count: usize,
    seen: &dyn Fn(usize) -> bool,
) -> (Form, Vec<usize>) {
    let curve = form.term().filter(|term| term.law().times.is_none());
    let curve = curve.and_then(|term| match term.basis() {
        Basis::Cosines { low, high, count } => Some((term, [low, high], count)),
        _ => None,
    });
    let Some((term, [low, high], waves)) = curve else {
        return (form.clone(), (0..count).collect());
    };
    let fields = count / waves.max(1);
    let alternates = cell::alternates(term.motion());
    let wave = |column: usize| match alternates {
        true => column / fields,
        false => column % waves,
    };
    let columns = 0..fields * waves;
    let last = columns
        .clone()
        .filter(|column| seen(*column))
        .map(wave)
        .max();
    let count = last.map_or(1, |last| last + 1);
    let law = Law::new(
        term.law().first.variable,
        Basis::Cosines { low, high, count },
    );
    let kept = columns.filter(|column| wave(*column) < count);
    (Form::from(term.with(law)), kept.collect())
}
