//! Findings: what the chosen causes are called, how large they are, what else would explain them.

use crate::criteria::cells::{DETAIL, FAINT, IDENTITY, SMALLEST, TRACE};
use crate::criteria::words::FIRM;
use crate::diagnose::table::{Answer, FoundCell, places};
use crate::effect::{
    Cause, Clock, FittedForms, Form, ModelledFinding, ParameterEstimate, Place, Summary, Survey,
    Variable, cause, figure, moved_with_the_payload, names, people, turned_holder,
};
use crate::estimate::{Model, ParameterStatus, tail};
use crate::observation::Dimension;
use crate::round::{FitState, RoundView};
use crate::types::{Evidence, Finding, Probabilities, RivalCause};
use crate::verdict::not_observable::{faults, rows_apart};
use crate::verdict::windup::turns_back;
use crate::whitened::add_columns;
use crate::words::{left_out, not_so, sentence, small, with_size};
use std::borrow::Cow;

/// The causes of the last round as findings, largest at the tool first; whether they leave more than noise `at_fitted_rows` or anywhere.
pub(super) fn findings(
    last: &LastRound,
    at_fitted_rows: bool,
    something_left: bool,
) -> Vec<Finding> {
    let state = &last.state;
    if let Some(offset) = state.screening.apart {
        return vec![rows_apart(offset, last)];
    }
    let mut out: Vec<Finding> = without_details(last, something_left)
        .iter()
        .map(|(found, details)| finding(last, found, details))
        .collect();
    let data = last.survey.data;
    let by_the_way_there = |form: &Form| match form.variables().first() {
        Some(Variable::LastMove) => true,
        Some(variable) => variable.follows_the_way() && data.direction.is_none(),
        None => false,
    };
    // Nobody knows from where the arm came to the first row.
    let unknown = state
        .causes
        .iter()
        .any(|cause| by_the_way_there(&cause.form))
        .then_some(0);
    out.extend(faults(last, unknown, at_fitted_rows));
    let size = |finding: &Finding| finding.evidence.map_or(0.0, |evidence| evidence.effect_rms);
    out.sort_by(|a, b| size(b).total_cmp(&size(a)));
    out
}

/// What was found, with the causes of the model that are a part of each but no numbers of it: what has no name and is small beside a finding
/// at its place, or a trace of the largest of all, is a misfit of their shapes. So is, as long as the residual exceeds the noise, whatever is
/// weaker at the place of a finding without a name.
fn without_details(last: &LastRound, something_left: bool) -> Vec<(FoundCell, Vec<usize>)> {
    let found = last.answer.found.clone();
    let sized = |found: FoundCell| (size(last, &found.members), found, Vec::new());
    let mut all: Vec<(f64, FoundCell, Vec<usize>)> = found.into_iter().map(sized).collect();
    let logs = last.answer.found.iter().map(|found| found.log);
    let strongest = logs.fold(0.0, f64::max);
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut out: Vec<(f64, FoundCell, Vec<usize>)> = Vec::new();
    for (rms, found, details) in all {
        // No instrument sees so little of the tool: currents alone speak of it.
        if rms < *SMALLEST
            && !out.is_empty()
            && last.view.fitter.scale.dimension() == Dimension::Length
        {
            out[0].2.extend(&found.members);
            continue;
        }
        let unclear = |main: &FoundCell| {
            something_left && main.effect == names::UNKNOWN && found.log < main.log
        };
        let unclear_main = out
            .iter()
            .position(|(_, main, _)| main.place == found.place && unclear(main));
        let is_curve = [names::UNKNOWN, names::JOINT_TABLE].contains(&&*found.effect);
        let first = is_curve.then(|| {
            let mut mains = out.iter();
            let here =
                mains.position(|(most, main, _)| main.place == found.place && rms < *DETAIL * most);
            let trace = |(most, ..): &&(f64, FoundCell, Vec<usize>)| {
                rms < *TRACE * most || found.log < *FAINT * strongest
            };
            here.or_else(|| out.first().filter(trace).map(|_| 0))
        });
        match unclear_main.or(first.flatten()) {
            Some(main) => out[main].2.extend(&found.members),
            None => out.push((rms, found, details)),
        }
    }
    let all = out.into_iter();
    all.map(|(_, found, details)| (found, details)).collect()
}

/// Every cause is searched once. A second step of the same cause (a tool that was taken off twice) is therefore found as unknown, with that cause
/// as its likeliest rival: it gets the name of the cause.
pub(super) fn name_repeated_steps(all: &mut [FoundCell]) {
    let named: Vec<(Cow<'static, str>, Place)> = all
        .iter()
        .map(|found| (found.effect.clone(), found.place))
        .filter(|(effect, _)| *effect != names::UNKNOWN)
        .collect();
    for found in all.iter_mut().filter(|one| one.effect == names::UNKNOWN) {
        let rivals = found.rivals.iter().enumerate();
        let likeliest = rivals.max_by(|a, b| a.1.probability.total_cmp(&b.1.probability));
        let Some((k, rival)) = likeliest else {
            continue;
        };
        let steps = cause(&rival.effect).is_some_and(Cause::is_a_step);
        let again = steps && named.contains(&(rival.effect.clone(), rival.place));
        let Probabilities { name, none, .. } = found.probabilities;
        if !again || rival.probability <= name + none {
            continue;
        }
        let unnamed = RivalCause {
            effect: found.effect.clone(),
            place: found.place,
            probability: name,
            ..rival.clone()
        };
        let rival = std::mem::replace(&mut found.rivals[k], unnamed);
        (found.effect, found.place) = (rival.effect, rival.place);
        found.probabilities.name = rival.probability;
    }
}

/// A finding with its numbers in the whole model.
fn finding(last: &LastRound, found: &FoundCell, details: &[usize]) -> Finding {
    let state = &last.state;
    let FoundCell {
        place,
        ref effect,
        ref members,
        ..
    } = *found;
    let effect = effect.clone();
    let form = |i: &usize| state.causes[*i].form.clone();
    let mut forms: Vec<Form> = members.iter().map(form).collect();
    let mut rivals = found.rivals.clone();
    let mut probabilities = found.probabilities;
    probabilities.name = share_with_identities(
        &effect,
        &forms,
        last.survey,
        probabilities.name,
        &mut rivals,
    );
    let modelled = modelled(last, &effect, &forms);
    if let Some((effect, place)) = modelled.as_ref().map(|modelled| modelled.same)
        && !rivals
            .iter()
            .any(|rival| rival.effect == effect && rival.place == place)
    {
        probabilities.name /= 2.0;
        rivals.push(RivalCause {
            effect: effect.into(),
            place,
            delta_bic: 0.0,
            probability: probabilities.name,
        });
    }
    let effect_rms = size(last, members);
    let freedom =
        (last.view.problem.residual_rows() as f64 - state.fitted.singular.len() as f64).max(1.0);
    let rank = found.numbers.max(1) as f64;
    let f_statistic = found.gain / rank;
    let evidence = Evidence {
        f_statistic,
        p_value: tail(f_statistic, rank, freedom),
        delta_bic: 2.0 * found.log,
        heldout_gain: None,
        effect_rms,
        gain: found.gain,
    };
    let parameters = parameters(last, &effect, members);
    let clock = Clock::of(last.survey.data);
    let summary = Summary {
        place,
        forms: &forms,
        parameters: &parameters,
        clock,
    };
    let impossible = impossible(last, found);
    let rms = small(effect_rms, last.view.fitter.scale.dimension());
    let named = effect != names::UNKNOWN;
    let excluded = forms
        .iter()
        .any(|form| !form.cause().is_nameless() && last.excludes(form.name()));
    let (effect, statement) = match (impossible, modelled) {
        _ if !named && excluded => (names::UNKNOWN.into(), left_out(&summary, &rms)),
        (Some(why), _) if named => (names::UNKNOWN.into(), not_so(&effect, &summary, &why, &rms)),
        (_, Some(modelled)) => (effect, with_size(&modelled.sentence, &rms)),
        _ => {
            let said = sentence(&effect, &summary, &rms);
            (effect, said)
        }
    };
    rivals.retain(|rival| {
        !last.excludes(&rival.effect) && (&rival.effect, rival.place) != (&effect, place)
    });
    let valid = valid(&forms, last);
    forms.extend(details.iter().map(form));
    Finding {
        effect,
        place,
        statement,
        parameters,
        evidence: Some(evidence),
        rivals,
        probabilities,
        valid,
        forms,
    }
}

/// What a finding is in the fitted model as a whole, unless the user excludes what would do the same.
fn modelled(last: &LastRound, called: &str, forms: &[Form]) -> Option<ModelledFinding> {
    let state = &last.state;
    let Model {
        robot, stack, x, ..
    } = &state.model;
    let fitted = FittedForms {
        robot,
        stack,
        x,
        data: last.survey.data,
        rows: &state.screening.kept,
        called,
        forms,
    };
    let modelled = turned_holder(&fitted)?;
    (!last.excludes(modelled.same.0)).then_some(modelled)
}

/// Why causes cannot be what they are called: a number that the fit of the whole model puts beyond what physics allows, or beyond what the
/// recording holds.
fn impossible(last: &LastRound, found: &FoundCell) -> Option<String> {
    if let Some(loads) = turns_back(last, found) {
        let [from, to] = loads.map(|load| figure(load, 0));
        return Some(format!(
            "no joint turns back as its load grows from {from} to {to} Nm"
        ));
    }
    let state = &last.state;
    let mut members = found.members.iter().zip(&found.bounds);
    members.find_map(|(i, (positive, largest))| {
        let form = &state.causes[*i].form;
        // The finer shape of a finding is not what it is called by.
        if form.cause().is_nameless() {
            return None;
        }
        let range = state.ranges[*i].clone();
        let sigma = |k: usize| match state.fitted.statuses[k] {
            ParameterStatus::Free(sigma) => Some(*FIRM * sigma),
            _ => None,
        };
        let error = |column: usize| sigma(range.start + column).unwrap_or(0.0);
        let values = &state.model.x[range.clone()];
        let beyond = form.impossible(values, &error, last.survey);
        if beyond.is_some() {
            return beyond;
        }
        let wrong_sign = || Some("has the wrong sign".into());
        if form.is_against_load(values, &error) {
            return wrong_sign();
        }
        range.clone().find_map(|k| {
            let (value, error) = (state.model.x[k], sigma(k)?);
            if *positive && value < -error {
                return wrong_sign();
            }
            (value.abs() - error > *largest).then(|| "is more than is possible".into())
        })
    })
}

/// The fitted parameters of some causes, as people read them: without the name of the finding, and of a cause that is not to be named.
fn parameters(last: &LastRound, effect: &str, members: &[usize]) -> Vec<ParameterEstimate> {
    let state = &last.state;
    let mut out: Vec<ParameterEstimate> = Vec::new();
    for (form, i) in members.iter().enumerate() {
        let cause = state.causes[*i].form.name();
        let is_hidden = last.excludes(cause) || state.causes[*i].form.cause().is_nameless();
        let hidden = if is_hidden { cause } else { effect };
        for k in state.ranges[*i].clone() {
            let spec = &state.model.stack.specs()[k];
            let sigma = match state.fitted.statuses[k] {
                ParameterStatus::Free(sigma) => Some(sigma),
                _ => None,
            };
            let (unit, symbol) = people(spec.unit);
            let name = spec.name.strip_prefix(hidden).unwrap_or(&spec.name);
            let mut name = name.trim_start_matches('.').to_string();
            while out.iter().any(|other| other.name == name) {
                name.push('~');
            }
            out.push(ParameterEstimate {
                name,
                form,
                value: unit.from_si(state.model.x[k]),
                unit: symbol,
                sigma: sigma.map(|sigma| unit.from_si(sigma)),
            });
        }
    }
    out
}

/// Joint and range over which the errors of a joint hold.
fn valid(forms: &[Form], last: &LastRound) -> Option<(usize, [f64; 2])> {
    let Place::Joint(joint) = forms[0].place() else {
        return None;
    };
    Some((joint, last.survey.range[joint]))
}

/// Rms size (m or rad) of some causes over the fitted rows, with what geometry could absorb of them.
fn size(last: &LastRound, members: &[usize]) -> f64 {
    let (problem, state) = (&last.view.problem, &last.state);
    // In standard deviations of the rows; the mean noise turns it into a size.
    let mut sum = vec![0.0; problem.residual_rows()];
    for i in members {
        let columns = problem.motions_by(&state.causes[*i].form);
        add_columns(&mut sum, &columns, &state.model.x[state.ranges[*i].clone()]);
    }
    let squares = problem.rows.iter().enumerate().map(|(i, row)| {
        let lines = problem.readings_of(i);
        let (values, whitened) = (
            lines.len().max(1) as f64,
            lines.map(|line| sum[line].powi(2)).sum::<f64>(),
        );
        whitened * last.view.fitter.scale.noise(problem.data, *row).powi(2) / values
    });
    (squares.sum::<f64>() / problem.rows.len().max(1) as f64).sqrt()
}

/// What does the same as a form of the finding in whatever data, as a rival that takes a share of the finding's probability `name`; what may have
/// moved when a payload changed that changes only once, in place of a form that follows the payload, takes half of it. Returns the residual.
pub(super) fn share_with_identities(
    called: &str,
    forms: &[Form],
    survey: &Survey,
    name: f64,
    rivals: &mut Vec<RivalCause>,
) -> f64 {
    let mut left = name;
    let moved = forms.iter();
    let moved = moved.filter_map(|form| moved_with_the_payload(form, survey));
    let moved = moved.map(|same| (same, 0.5));
    let same = forms.iter().flat_map(|form| form.identities(called));
    let mut same: Vec<_> = same
        .filter(|(_, place)| is_a_place(*place, survey))
        .collect();
    same.dedup();
    let same = same.into_iter().map(|same| (same, *IDENTITY));
    for ((effect, place), share) in moved.chain(same) {
        let is_same = |rival: &&mut RivalCause| rival.effect == effect && rival.place == place;
        let known = rivals.iter_mut().find(is_same);
        // Of one motion that is of two places neither is the usual one.
        let is_motion = [effect, called] == [names::UNKNOWN; 2];
        let share = if is_motion { 0.5 } else { share };
        if let Some(known) = known {
            if is_motion {
                known.probability += share * left;
                known.delta_bic = 0.0;
                left *= 1.0 - share;
            }
        } else {
            rivals.push(RivalCause {
                effect: effect.into(),
                place,
                delta_bic: 0.0,
                probability: share * left,
            });
            left *= 1.0 - share;
        }
    }
    rivals.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    left
}

/// Whether a link is a place of its own: two joints at one point have none between them.
fn is_a_place(place: Place, survey: &Survey) -> bool {
    match place {
        Place::Links(first, last) if first == last => places(survey).contains(&place),
        _ => true,
    }
}

/// The last round.
pub(crate) struct LastRound<'a, 'b> {
    pub(crate) view: &'b RoundView<'a>,
    pub(crate) survey: &'b Survey<'a>,
    /// The whole model with all causes.
    pub(crate) state: FitState,
    pub(crate) answer: Answer,
}

impl LastRound<'_, '_> {
    /// Whether a name is not to be given.
    pub(crate) fn excludes(&self, effect: &str) -> bool {
        let without = self.view.fitter.question.without;
        without.iter().any(|name| name == effect)
    }
}
