//! What every cell of torques says of one robot given cells that its fleet has accepted: the numbers that a fleet sums.

use super::cause::{TorqueForm, UNKNOWN};
use super::cells::{
    CauseChoice, TorqueCell, TorqueComponent, TorqueState, TorqueTable, forms, without,
};
use super::solve::SolvedTorques;
use crate::criteria::fleet::LEAST_EVIDENCE;
use crate::criteria::torque::PER_METRE;
use crate::diagnose::table::rms_size;
use crate::diagnose::{CellAnswer, GivenCell};
use calib_engine::{AMPLITUDES, evidence_at, log_sum, log_sums};
use std::collections::BTreeMap;

/// What all cells say given some, and what each of those says and its rivals say in its place; sizes in Nm.
pub(super) fn answers(solved: &mut SolvedTorques, given: &[GivenCell]) -> Vec<CellAnswer> {
    // What the rows of one robot do not confirm, those of all may.
    solved.problem.barred.clear();
    solved.weigh_by_rich_noise();
    let choice = CauseChoice::new(&solved.problem, &solved.weighted);
    let mut table = TorqueTable::new(&choice);
    let components = table.components(&solved.set);
    let components = table.with_given(components, given);
    let (state, mut out) = (table.state(&components, None), Vec::new());
    let kappa = state.known.kappa;
    let taken = components
        .iter()
        .map(|component| table.cell_of[&component.form]);
    let taken: Vec<usize> = taken.collect();
    for cell in (0..table.cells.len()).filter(|cell| !taken.contains(cell)) {
        out.extend(table.answer(cell, &state, None));
    }
    for (place, component) in components.iter().enumerate() {
        let state = table.state(&without(&components, place), Some(kappa));
        let key = table.key(taken[place]);
        let left_out = table.kept.contains(&component.form).then_some(key.as_str());
        let mut shapes = table.answer(taken[place], &state, left_out);
        shapes.retain(|answer| answer.shape.is_some());
        out.extend(shapes);
        out.extend(table.in_place(&components, place, (&state, kappa), left_out));
        if left_out.is_some() {
            let rivals = table.competing(component.form);
            for cell in rivals.filter(|cell| !taken.contains(cell)) {
                out.extend(table.answer(cell, &state, left_out));
            }
        }
    }
    out
}

impl TorqueTable<'_, '_> {
    /// Key of a cell: its name and place, and of what has no name what it depends on.
    fn key(&self, cell: usize) -> String {
        let torque_cell = &self.cells[cell];
        let form = self.choice.form(torque_cell.forms[0]);
        let kind = match torque_cell.name == UNKNOWN {
            true => format!(":{}", form.kind()),
            false => String::new(),
        };
        let [one, two] = (form.cause.cell)(form);
        let with = match [one, two] {
            [0, 0] => String::new(),
            _ => format!(":{},{}", one + 1, two + 1),
        };
        format!("{}@{}{kind}{with}", torque_cell.name, torque_cell.place)
    }

    /// Nm of a form's torque at unit amplitude.
    fn newton_metres(&self, form: usize) -> f64 {
        let all = &self.choice.problem.all;
        let column = all.of(form).start;
        *PER_METRE * all.newton_metres(column) / all.size(column).max(f64::MIN_POSITIVE)
    }

    /// Components with given cells, which do not leave, each in its likeliest shape; those that pay no longer leave.
    fn with_given(
        &mut self,
        mut components: Vec<TorqueComponent>,
        given: &[GivenCell],
    ) -> Vec<TorqueComponent> {
        for one in given {
            let Some(cell) = (0..self.cells.len()).find(|cell| self.key(*cell) == one.cell) else {
                continue;
            };
            let is_shape = |form: usize| {
                let shape = one.shape.as_deref();
                shape.is_none_or(|shape| shape_key(self.choice.form(form)) == shape)
            };
            let place = components.iter().position(|component| {
                self.cell_of[&component.form] == cell && is_shape(component.form)
            });
            let place = place.or_else(|| {
                let state = self.state(&components, None);
                let mut shapes = self.shapes(cell, &state);
                shapes.retain(|(_, component)| is_shape(component.form));
                let (_, component) = shapes.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
                components.push(component);
                Some(components.len() - 1)
            });
            if let Some(place) = place {
                let form = components[place].form;
                components[place].amplitude = one.size / self.newton_metres(form);
                self.kept.push(form);
            }
        }
        self.dropped(&forms(&components))
    }

    /// ln of the evidence of a form given a state at each amplitude.
    fn at_amplitudes(&self, form: usize, state: &TorqueState) -> [f64; AMPLITUDES] {
        let (gram, along) = self.seen(form, state);
        let shares = vec![1.0 / along.len() as f64; along.len()];
        evidence_at(&gram, &along, &shares, state.known.rows, ANY)
    }

    /// What the cell of a form says, with ln of its posterior odds and its size, Nm; not yet at each amplitude.
    fn whole_answer(
        &self,
        form: usize,
        log_odds: f64,
        size: f64,
        left_out: Option<&str>,
    ) -> CellAnswer {
        let cell = self.cell_of[&form];
        let TorqueCell {
            ref name,
            place,
            log_prior,
            ..
        } = self.cells[cell];
        CellAnswer {
            left_out: left_out.map(Into::into),
            cell: self.key(cell),
            shape: None,
            effect: name.clone(),
            place,
            follows: {
                let form = self.choice.form(form);
                (form.cause.follows)(form)
            },
            log: log_odds - log_prior,
            at_amplitudes: [f64::NEG_INFINITY; AMPLITUDES],
            log_prior,
            size,
            sigma: None,
            log_ratio: None,
        }
    }

    /// What a cell says given a state, and each of its shapes that robots may share.
    fn answer(&self, cell: usize, state: &TorqueState, left_out: Option<&str>) -> Vec<CellAnswer> {
        let Some((log_odds, best)) = self.cell(cell, state) else {
            return Vec::new();
        };
        let size = best.amplitude * self.newton_metres(best.form);
        let joining = self.shapes(cell, state).into_iter();
        let joining = joining.map(|(log, TorqueComponent { form, .. })| {
            let at = self.at_amplitudes(form, state);
            (shape_key(self.choice.form(form)), (log, at))
        });
        let joining: Vec<(String, FormEvidence)> = joining.collect();
        let all = log_sums(joining.iter().map(|(_, (_, at))| *at));
        let whole = self.whole_answer(best.form, log_odds, size, left_out);
        let whole = whole.at(all, self.log_count(cell));
        // Forms of each shape, and ln of the evidence of those that may be.
        let mut shapes: BTreeMap<String, (usize, Vec<FormEvidence>)> = BTreeMap::new();
        for form in self.open(cell) {
            let key = shape_key(self.choice.form(form));
            shapes.entry(key).or_default().0 += 1;
        }
        if shapes.len() < 2 {
            return vec![whole];
        }
        for (key, says) in joining {
            shapes.entry(key).or_default().1.push(says);
        }
        let shapes = shapes.into_iter().filter(|(_, (_, logs))| !logs.is_empty());
        let shapes = shapes.map(|(key, (count, says))| {
            let count = (count as f64).ln();
            let logs: Vec<f64> = says.iter().map(|(log, _)| *log).collect();
            CellAnswer {
                log: log_sum(&logs) - count,
                log_prior: count - self.log_count(cell),
                shape: Some(key),
                ..whole.clone()
            }
            .at(log_sums(says.iter().map(|(_, at)| *at)), count)
        });
        let shapes: Vec<CellAnswer> = shapes.collect();
        [vec![whole], shapes].concat()
    }

    /// What a component says given all others, and its size.
    fn in_place(
        &self,
        components: &[TorqueComponent],
        place: usize,
        (state, kappa): (&TorqueState, f64),
        left_out: Option<&str>,
    ) -> Option<CellAnswer> {
        let component = components[place];
        let (gram, along) = self.seen(component.form, state);
        let prior = vec![component.amplitude.powi(2) / along.len() as f64; along.len()];
        let found = rms_size(&gram, &along, &prior)?;
        let unit = self.newton_metres(component.form);
        let log_odds = self.odds_of(components, place, kappa);
        let whole = self.whole_answer(component.form, log_odds, found.size * unit, left_out);
        let at = self.at_amplitudes(component.form, state);
        let whole = whole.at(at, self.log_count(self.cell_of[&component.form]));
        Some(CellAnswer {
            log: whole.log.max(*LEAST_EVIDENCE),
            sigma: Some(found.sigma * unit),
            log_ratio: Some(found.log_ratio),
            ..whole
        })
    }
}

/// ln of the evidence of a form, and at each amplitude.
type FormEvidence = (f64, [f64; AMPLITUDES]);

/// No amplitude is too small or too large.
const ANY: [f64; 2] = [0.0, f64::INFINITY];

/// Key of a shape that robots of a model may share: an order, or which joints.
fn shape_key(form: &TorqueForm) -> String {
    match form.with {
        [0, 0] => String::new(),
        [one, two] => format!("{one},{two}"),
    }
}
