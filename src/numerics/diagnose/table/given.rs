//! What every cell says of one robot given cells that its fleet has accepted: the numbers that a fleet sums.

use super::cause_table::CauseTable;
use super::cell::CauseCell;
use super::component::{CellColumns, Component, SeenGroup, shape_keys};
use super::frame::SearchRows;
use super::noise_shape::NoiseShape;
use super::search::without;
use super::size::{SizeEvidence, rms_size};
use super::state::KnownState;
use super::{by_currents, estimated, is_kept};
use crate::criteria::cells::{CLOSELY, OPEN, SMALLEST};
use crate::criteria::fleet::{LEAST_EVIDENCE, WRITTEN};
use crate::diagnose::round::{EstimatedCause, RoundView};
use crate::effect::{Basis, Form, Place, Term, names};
use calib_engine::{AMPLITUDES, log_sum, log_sums};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// A cell that is taken to be in the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenCell {
    /// Key of the cell.
    pub cell: String,
    /// Key of its shape (an order, a knee), where all robots share it; else the robot's likeliest.
    pub shape: Option<String>,
    /// Rms motion at the tool that is expected of it, m; of a torque Nm.
    pub size: f64,
}

/// What a cell, or a shape of it, says of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct CellAnswer {
    /// The given cell that is left out; none where all that are given stay.
    pub left_out: Option<String>,
    /// Key of the cell.
    pub cell: String,
    /// Key of one shape of it; none of all its shapes together.
    pub shape: Option<String>,
    /// Canonical name of its cause.
    pub effect: Cow<'static, str>,
    /// Where it acts.
    pub place: Place,
    /// Kind of variable.
    pub follows: &'static str,
    /// ln of the evidence for it over that of nothing.
    pub log: f64,
    /// The same at each amplitude of the grid, of which that is the mean over those that can be: robots that share a cause share its size, too.
    pub at_amplitudes: [f64; AMPLITUDES],
    /// ln of its prior odds; of a shape ln of its weight within its cell.
    pub log_prior: f64,
    /// Rms motion at the tool, m, or torque, Nm: the likeliest amplitude, of a given cell its estimate.
    pub size: f64,
    /// One standard deviation of the size of a given cell, in its unit.
    pub sigma: Option<f64>,
    /// ln of the likelihood of the size of a given cell over that of none.
    pub log_ratio: Option<f64>,
}

impl CellAnswer {
    /// The same with its evidence at each amplitude, by that of its columns and ln of the weight of all shapes that could have any.
    pub fn at(self, amplitudes: [f64; AMPLITUDES], log_weight: f64) -> Self {
        Self {
            at_amplitudes: amplitudes.map(|log| log - log_weight),
            ..self
        }
    }

    /// Whether a sum over robots has to know it: what is missing there counts as the least evidence.
    pub fn counts(&self) -> bool {
        let is_plain = self.shape.is_none() && self.effect != names::UNKNOWN;
        self.log >= WRITTEN[usize::from(!is_plain)] || self.sigma.is_some()
    }
}

/// Does something with the table of the cells that `keeps` leaves, around a fitted model.
fn with_table<T>(
    view: &RoundView,
    keeps: impl Fn(&CauseCell) -> bool,
    ask: impl FnOnce(&mut CauseTable) -> T,
) -> T {
    let survey = view.survey();
    let noise = match view.now.causes.is_empty() {
        true => NoiseShape::at_first(view),
        false => NoiseShape::of(view),
    };
    let mut frame = SearchRows::of(view, noise);
    let is_open = survey.rows.len() >= *OPEN;
    let kept = |cell: &CauseCell| keeps(cell) && is_kept(cell, view, &survey);
    let none = (&[][..], Vec::new());
    let question = view.fitter.question;
    ask(&mut CauseTable::new(
        &mut frame, &survey, question, none, is_open, kept,
    ))
}

/// Given cells as causes of the whole model around a fitted one.
pub(crate) fn given_causes(view: &RoundView, given: &[GivenCell]) -> Vec<EstimatedCause> {
    let keeps = |cell: &CauseCell| given.iter().any(|one| one.cell == cell.key);
    let mut causes = with_table(view, keeps, |table| {
        let components = table.given(given);
        estimated(table, &components)
    });
    by_currents(&mut causes, view);
    causes
}

/// What all cells say given some, and what each of those says and its rivals say in its place.
pub(crate) fn answers(view: &RoundView, given: &[GivenCell]) -> Vec<CellAnswer> {
    with_table(
        view,
        |_| true,
        |table| {
            let components = table.given(given);
            let state = table.state(&components, None);
            let is_given = |cell: &usize| components.iter().any(|one| one.cell == *cell);
            let others: Vec<usize> = (0..table.cells.len())
                .filter(|cell| !is_given(cell))
                .collect();
            let mut out = table.answers(&others, &state, None);
            for (i, component) in components.iter().enumerate() {
                let state = table.state(&without(&components, &[i]), Some(state.kappa));
                let left_out = table.cells[component.cell].key.clone();
                let mut alike = table.alike(component, 40);
                alike.retain(|cell| !is_given(cell));
                alike.push(component.cell);
                let mut rivals = table.answers(&alike, &state, Some(&left_out));
                let is_own = |rival: &CellAnswer| rival.cell == left_out && rival.shape.is_none();
                let own = rivals.iter().position(is_own).map(|at| rivals.remove(at));
                out.extend(rivals);
                out.extend(own.and_then(|own| table.given_answer(component, &state, own)));
            }
            out
        },
    )
}

impl CauseTable<'_, '_> {
    /// Given cells as components of the expected size, each in its likeliest shape given the others.
    fn given(&mut self, given: &[GivenCell]) -> Vec<Component> {
        let mut out: Vec<(usize, Component)> = Vec::new();
        for turn in 0..2 {
            for (i, one) in given.iter().enumerate() {
                let Some(cell) = self.cell(&one.cell) else {
                    continue;
                };
                let others = out.iter().filter(|(other, _)| *other != i);
                let others: Vec<Component> = others.map(|(_, other)| other.clone()).collect();
                let state = self.state(&others, None);
                let Some(found) = self.closely_in(cell, &state, one.shape.as_deref()) else {
                    continue;
                };
                let component = Component {
                    amplitude: one.size,
                    ..self.as_found(cell, &found)
                };
                let component = self.with_part(component);
                match out.iter_mut().find(|(other, _)| *other == i) {
                    Some((_, before)) => *before = component,
                    None => out.push((i, component)),
                }
            }
            if out.len() < 2 && turn == 0 {
                break;
            }
        }
        let out: Vec<Component> = out.into_iter().map(|(_, component)| component).collect();
        out
    }

    /// What some cells say given a state, and each shape of those with a name; closely of the likeliest. What a sum does not have to know is left
    /// out.
    fn answers(
        &self,
        cells: &[usize],
        state: &KnownState,
        left_out: Option<&str>,
    ) -> Vec<CellAnswer> {
        let (across, first) = self.across_cells(cells, state);
        let answer = |k: usize| {
            let (cell, block) = (&self.cells[cells[k]], &self.coarse[cells[k]]);
            let mut groups: Vec<Vec<f64>> = vec![Vec::new(); block.groups.len()];
            let mut best = (f64::NEG_INFINITY, 0.0, 0);
            for (group, _, found) in state.shapes(block, &across, first[k]) {
                groups[group].push(found.log);
                if found.log > best.0 {
                    best = (found.log, found.amplitude, group);
                }
            }
            let logs: Vec<f64> = groups.iter().map(|logs| log_sum(logs)).collect();
            let likeliest = block.groups.get(best.2).map(|group| &group.group.forms[0]);
            let follows = likeliest.map_or("constant", |form| form.follows(cell.place));
            let whole = CellAnswer {
                left_out: left_out.map(Into::into),
                cell: cell.key.clone(),
                shape: None,
                effect: cell.name.clone(),
                place: cell.place,
                follows,
                log: log_sum(&logs),
                at_amplitudes: [f64::NEG_INFINITY; AMPLITUDES],
                log_prior: cell.log_prior,
                size: best.1,
                sigma: None,
                log_ratio: None,
            };
            let shared = cell.is_named() && logs.len() > 1;
            let shape = |(group, ((seen, log), key)): (usize, ((&SeenGroup, &f64), String))| {
                let weights = seen.group.shapes.iter().map(|shape| shape.log_weight);
                let weight = log_sum(&weights.collect::<Vec<_>>());
                let shape = CellAnswer {
                    shape: Some(key),
                    log: log - weight,
                    log_prior: weight,
                    ..whole.clone()
                };
                (group, shape)
            };
            let steps =
                |form: &Form| matches!(form.term().map(Term::basis), Some(Basis::After { .. }));
            // Keys are long to make.
            let keys = match shared && logs.iter().any(|log| log.is_finite()) {
                true => shape_keys(&block.groups),
                false => Vec::new(),
            };
            let shapes = block.groups.iter().zip(&logs).zip(keys).enumerate();
            let shapes = shapes.filter(|(_, ((seen, log), _))| {
                log.is_finite() && !seen.group.forms.iter().any(steps)
            });
            let shapes: Vec<(usize, CellAnswer)> = shapes.map(shape).collect();
            (whole, shapes)
        };
        let mut out: Vec<(CellAnswer, Vec<(usize, CellAnswer)>)> =
            (0..cells.len()).into_par_iter().map(answer).collect();
        let mut order: Vec<usize> = (0..out.len()).collect();
        order.retain(|k| out[*k].0.log.is_finite());
        let odds = |k: &usize| out[*k].0.log + out[*k].0.log_prior;
        order.sort_by(|a, b| odds(b).total_cmp(&odds(a)).then(a.cmp(b)));
        order.truncate(*CLOSELY);
        order.retain(|k| self.cells[cells[*k]].is_coarse());
        let closely = |k: &usize| {
            let found = self.closely(cells[*k], state)?;
            (found.log > out[*k].0.log).then_some((*k, found))
        };
        let closely: Vec<_> = order.par_iter().filter_map(closely).collect();
        let mut finely = BTreeSet::new();
        for (k, found) in closely {
            (out[k].0.log, out[k].0.size) = (found.log, found.amplitude);
            finely.insert(k);
        }
        // What moves the tool by less than anything sees, as masses that motor currents show may, is no cause of its errors.
        let is_seen =
            |whole: &CellAnswer| whole.size > *SMALLEST || whole.size > 0.0 && whole.log <= 0.0;
        // Of a given cell itself it is always asked what it says.
        let is_own = |whole: &CellAnswer| left_out == Some(whole.cell.as_str());
        let written =
            |(k, (whole, mut shapes)): (usize, (CellAnswer, Vec<(usize, CellAnswer)>))| {
                shapes.retain(|(_, shape)| shape.counts());
                let is_written = |one: &CellAnswer| one.counts() || is_own(one);
                if !is_written(&whole) && shapes.is_empty() {
                    return Vec::new();
                }
                let block = &self.coarse[cells[k]];
                let groups = state.at_amplitudes(block, &across, first[k]);
                let groups: BTreeMap<usize, [f64; AMPLITUDES]> = groups.into_iter().collect();
                let all = match finely.contains(&k) {
                    true => self.at_amplitudes(self.fine(cells[k]), state),
                    false => log_sums(groups.values().copied()),
                };
                let all = whole.at(all, self.log_weight(cells[k]));
                let shapes = shapes.into_iter().filter_map(|(group, shape)| {
                    let weight = shape.log_prior;
                    Some(shape.at(*groups.get(&group)?, weight))
                });
                std::iter::once(all)
                    .filter(is_written)
                    .chain(shapes)
                    .collect()
            };
        out.into_par_iter()
            .enumerate()
            .filter(|(_, (whole, _))| whole.log.is_finite() && (is_seen(whole) || is_own(whole)))
            .flat_map_iter(written)
            .collect()
    }

    /// What a given cell says given the others, and its size, by what its cell says without.
    fn given_answer(
        &self,
        component: &Component,
        state: &KnownState,
        own: CellAnswer,
    ) -> Option<CellAnswer> {
        let alone = self.component_evidence(component, state);
        let alone = alone.map(|found| found.log).filter(|log| *log > own.log);
        let own = match alone {
            Some(log) => {
                let block = CellColumns::of_component(component, self.frame);
                let weight = self.log_weight(component.cell);
                CellAnswer { log, ..own }.at(self.at_amplitudes(&block, state), weight)
            }
            None => own,
        };
        let found_size = self.sized(component, state)?;
        Some(CellAnswer {
            follows: component.forms.first()?.follows(own.place),
            // A sum takes no less for what is less.
            log: own.log.max(*LEAST_EVIDENCE),
            size: found_size.size,
            sigma: Some(found_size.sigma),
            log_ratio: Some(found_size.log_ratio),
            ..own
        })
    }

    /// ln of the weight of all shapes of a cell.
    fn log_weight(&self, cell: usize) -> f64 {
        let groups = self.coarse[cell].groups.iter();
        let shapes = groups.flat_map(|seen| &seen.group.shapes);
        log_sum(&shapes.map(|shape| shape.log_weight).collect::<Vec<_>>())
    }

    /// ln of the evidence of all shapes of a block together at each amplitude.
    fn at_amplitudes(&self, block: &CellColumns, state: &KnownState) -> [f64; AMPLITUDES] {
        let across = self.across_block(block, state);
        let groups = state.at_amplitudes(block, &across, 0);
        log_sums(groups.into_iter().map(|(_, at)| at))
    }

    /// Rms motion of a component given others, m.
    fn sized(&self, component: &Component, state: &KnownState) -> Option<SizeEvidence> {
        let block = CellColumns::of_component(component, self.frame);
        let across = self.across_block(&block, state);
        let (gram, gradient) = state.seen(&block.groups[0], &across, 0);
        let prior = component.shape.shares.iter();
        let prior: Vec<f64> = prior
            .map(|share| component.amplitude * component.amplitude * share)
            .collect();
        rms_size(&gram, &gradient, &prior)
    }
}
