//! Findings: what the chosen causes are called, how large they are, what else would explain them.

use super::faults::{faults, rows_apart};
use super::last_round::LastRound;
use super::probability::{weigh, weigh_fault};
use super::rivals::{exact, rivals};
use crate::criteria::words::{ASTRAY, FIRM, REFINEMENT, REJECTED};
use crate::diagnose::finding_groups::{FindingKey, groups};
use crate::diagnose::judge::FoldGain;
use crate::diagnose::open_world::NameOdds;
use crate::diagnose::pool::{CachedHypotheses, HypothesisSet, Solution};
use crate::diagnose::round::FitState;
use crate::diagnose::types::{Evidence, Finding, Probabilities, RivalCause};
use crate::diagnose::words::{left_out, none_of_the_list, not_so, sentence, small, told};
use crate::effect::{
    Basis, Clock, FittedForms, Form, Hypothesis, ModelledFinding, ParameterEstimate, Place, Summary, Variable, follows, names,
    people,
};
use crate::estimate::{ErrorScale, Model, ParameterStatus, tail};
use crate::observation::Dimension;

/// The causes of the last round as findings, strongest first; `something_left` says whether they leave more than noise.
pub(super) fn findings(last: &LastRound, something_left: bool) -> Vec<Finding> {
    let state = &last.judged.state;
    if let Some(offset) = state.screening.apart {
        let mut apart = rows_apart(offset, last);
        weigh_fault(&mut apart);
        return vec![apart];
    }
    let set = last.set();
    let whole = Whole { solution: last.pool.solve(&set), bic: last.pool.bic(&set), set };
    let groups = groups(state, &last.judged.set, last.pool, last.survey);
    let own = |members: &Vec<usize>| members.iter().map(|i| last.judged.set[*i]).collect();
    last.pool.leave_out(&whole.set, &groups.values().map(own).collect());
    let judged = |(key, members): (FindingKey, Vec<usize>)| {
        let mut own = finding(last, &whole, key, &members);
        if let Some(odds) = last.odds.get(&key) {
            let rejected = own.effect != key.0 && own.effect == names::UNKNOWN && !last.excludes(key.0);
            weigh(&mut own, odds, rejected);
            unnamed(&mut own, odds);
        }
        own
    };
    let mut out: Vec<Finding> = groups.into_iter().map(judged).collect();
    let data = last.survey.data;
    let by_the_way_there = |form: &Form| match form.variables().first() {
        Some(Variable::LastMove) => true,
        Some(of) => of.follows_the_way() && data.direction.is_none(),
        None => false,
    };
    // Nobody knows from where the arm came to the first row.
    let unknown = state.causes.iter().any(|cause| by_the_way_there(&cause.form)).then_some(0);
    let mut faults = faults(last, unknown, something_left);
    faults.iter_mut().for_each(weigh_fault);
    out.extend(faults);
    let strength = |finding: &Finding| finding.evidence.map_or(0.0, |evidence| evidence.gain);
    out.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    out
}

/// What has a rejected name is unknown, and the name becomes a rival; the size of what has no law is told by the evidence of its free form.
fn unnamed(finding: &mut Finding, odds: &NameOdds) {
    let has_no_law = finding.has_no_law();
    if let Some(evidence) = finding.evidence.as_mut().filter(|_| has_no_law) {
        evidence.delta_bic = 2.0 * odds.log;
    }
    let Probabilities { name, place, none } = finding.probabilities;
    if finding.effect == names::UNKNOWN || none <= *REJECTED {
        return;
    }
    finding.statement = none_of_the_list(finding.place, &finding.statement, none, odds.share);
    finding.rivals.retain(|rival| rival.effect != names::UNKNOWN);
    finding.rivals.insert(0, RivalCause { effect: finding.effect, place: finding.place, delta_bic: 0.0, probability: name });
    finding.effect = names::UNKNOWN;
    finding.probabilities = Probabilities { name: none, place, none: 0.0 };
}

/// All causes together.
struct Whole {
    set: Vec<usize>,
    solution: Solution,
    bic: f64,
}

/// The finding that some of the causes make up.
fn finding(last: &LastRound, whole: &Whole, (effect, place): FindingKey, members: &[usize]) -> Finding {
    let (pool, state) = (last.pool, &last.judged.state);
    let own: Vec<usize> = members.iter().map(|i| last.judged.set[*i]).collect();
    let rest = without(pool, &whole.set, &own);
    let forms: Vec<Form> = members.iter().map(|i| state.causes[*i].form.clone()).collect();
    let mut rivals = rivals(last, &rest, &own, whole.bic, (effect, place));
    exact(effect, &forms, last.survey, &mut rivals);
    let modelled = modelled(last, effect, &forms);
    if let Some((effect, place)) = modelled.as_ref().map(|modelled| modelled.same)
        && !rivals.iter().any(|rival| (rival.effect, rival.place) == (effect, place))
    {
        rivals.push(RivalCause { effect, place, delta_bic: 0.0, probability: 0.0 });
    }
    let scale = last.scale;
    let effect_rms = size((pool, scale), members.iter().map(|i| (last.judged.set[*i], &state.model.x[state.ranges[*i].clone()])));
    let without = pool.solve(&rest);
    let gain = whole.solution.gain - without.gain;
    let rank = whole.solution.rank.saturating_sub(without.rank).max(1);
    let freedom = pool.residual_rows.saturating_sub(pool.rank() + whole.solution.rank).max(1) as f64;
    let f_statistic =
        gain / rank as f64 / ((pool.square - whole.solution.gain) / freedom) * pool.effective_rows / pool.residual_rows as f64;
    let evidence = Evidence {
        f_statistic,
        p_value: tail(f_statistic, rank as f64, freedom),
        delta_bic: pool.bic(&rest) - whole.bic,
        heldout_gain: heldout_gain(&forms, place, &last.judged.gains),
        effect_rms,
        gain,
    };
    let parameters = parameters(state, effect, members);
    let clock = Clock::of(last.survey.data);
    let summary = Summary { place, forms: &forms, parameters: &parameters, clock };
    let varies = varying(&own, pool, whole, gain, clock);
    let impossible = impossible(last, members, effect).or_else(|| more_than_it_does(effect, &evidence, scale.dimension()));
    if let (None, Some((_, loss))) = (&impossible, &varies) {
        rivals.push(RivalCause { effect, place, delta_bic: *loss, probability: 0.0 });
    }
    rivals.retain(|rival| !last.excludes(rival.effect));
    rivals.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic).then(a.effect.cmp(b.effect)));
    let why = impossible.or_else(|| varies.map(|(why, _)| why));
    let rms = small(effect_rms, scale.dimension());
    let (effect, statement) = match (why, modelled) {
        _ if last.excludes(effect) => (names::UNKNOWN, left_out(&summary, &rms)),
        (Some(why), _) => (names::UNKNOWN, not_so(effect, &summary, &why, &rms)),
        (None, Some(modelled)) => (effect, told(&modelled.sentence, &rms)),
        (None, None) => (effect, sentence(effect, &summary, &rms)),
    };
    // What has lost its name is no rival of itself.
    rivals.retain(|rival| (rival.effect, rival.place) != (effect, place));
    let valid = valid(&forms, last);
    Finding {
        effect,
        place,
        statement,
        parameters,
        evidence: Some(evidence),
        rivals,
        probabilities: Probabilities::default(),
        valid,
        forms,
    }
}

/// What a finding is in the fitted model as a whole, unless the user excludes what would do the same.
fn modelled(last: &LastRound, called: &'static str, forms: &[Form]) -> Option<ModelledFinding> {
    let state = &last.judged.state;
    let Model { robot, stack, x, .. } = &state.model;
    let fitted = FittedForms { robot, stack, x, data: last.survey.data, rows: &state.screening.kept, called, forms };
    let modelled = forms.first()?.cause().in_the_model(&fitted)?;
    (!last.excludes(modelled.same.0)).then_some(modelled)
}

/// Why causes cannot be what they are called: a number that the fit of the whole model puts beyond what physics allows, or beyond what the
/// recording holds.
fn impossible(last: &LastRound, members: &[usize], effect: &str) -> Option<String> {
    let state = &last.judged.state;
    members.iter().find_map(|i| {
        let Hypothesis { positive, largest, ref form, .. } = last.pool.hypotheses[last.judged.set[*i]];
        let range = state.ranges[*i].clone();
        let error = |column: usize| match state.fitted.statuses[range.start + column] {
            ParameterStatus::Free(sigma) => *FIRM * sigma,
            _ => 0.0,
        };
        let values = &state.model.x[range.clone()];
        // The finer shape of a finding is not what it is called by.
        let own = effect != names::UNKNOWN && [form.name(), form.called(values, last.survey)].contains(&effect);
        let beyond = own.then(|| form.impossible(values, &error, last.survey)).flatten();
        if beyond.is_some() {
            return beyond;
        }
        if form.is_against_load(values, &error) {
            return Some("has the wrong sign".into());
        }
        range.clone().find_map(|k| {
            let ParameterStatus::Free(sigma) = state.fitted.statuses[k] else { return None };
            let value = state.model.x[k];
            if positive && value < -*FIRM * sigma {
                Some("has the wrong sign".into())
            } else {
                (value.abs() - *FIRM * sigma > largest).then(|| "is more than is possible".into())
            }
        })
    })
}

/// Why what the folds say is nothing of a cause: its absence costs more than all that it does.
fn more_than_it_does(effect: &str, evidence: &Evidence, of: Dimension) -> Option<String> {
    let gain = evidence.heldout_gain.filter(|gain| effect != names::UNKNOWN && *gain > *ASTRAY * evidence.effect_rms)?;
    let [gain, all] = [gain, evidence.effect_rms].map(|size| small(size, of));
    Some(format!("other poses would gain {gain} by it, which is more than all that it does, {all} rms"))
}

/// The other causes of a set that make sense alone: a product only beside the law that it is made of, the torque model only beside a
/// joint that yields.
fn without(pool: &CachedHypotheses, set: &[usize], own: &[usize]) -> Vec<usize> {
    let others: Vec<usize> = set.iter().copied().filter(|k| !own.contains(k)).collect();
    let made_of = |k: usize, law: usize| follows(&pool.hypotheses[k].form, &pool.hypotheses[law].form).is_some();
    let whole = |k: &usize| !pool.hypotheses[*k].inherits || others.iter().any(|law| made_of(*k, *law));
    let mut rest: Vec<usize> = others.iter().copied().filter(whole).collect();
    if !pool.bic(&rest).is_finite() {
        rest.retain(|k| !pool.of_torque_model[*k]);
    }
    rest
}

/// What the size of a named cause follows although its name claims a constant, and what the criterion loses where it is one.
fn varying(own: &[usize], pool: &CachedHypotheses, whole: &Whole, gain: f64, clock: Clock) -> Option<(String, f64)> {
    let form = |k: usize| &pool.hypotheses[k].form;
    let by = |k: usize| own.iter().find_map(|named| follows(form(k), form(*named)));
    let (products, by): (Vec<usize>, Vec<Variable>) = own.iter().filter_map(|k| Some((*k, by(*k)?))).unzip();
    let named: Vec<usize> = whole.set.iter().copied().filter(|k| !products.contains(k)).collect();
    let lost = whole.solution.gain - pool.solve(&named).gain;
    let by: Vec<String> = by.into_iter().map(|variable| clock.named(variable)).collect();
    let why = || format!("its size depends on the {}", by.join(" and the "));
    (!by.is_empty() && lost > *REFINEMENT * gain).then(|| (why(), pool.bic(&named) - whole.bic))
}

/// The fitted parameters of some causes, as people read them.
fn parameters(state: &FitState, effect: &str, members: &[usize]) -> Vec<ParameterEstimate> {
    let one = |(form, k): (usize, usize)| {
        let spec = &state.model.stack.specs()[k];
        let sigma = match state.fitted.statuses[k] {
            ParameterStatus::Free(sigma) => Some(sigma),
            _ => None,
        };
        let (unit, symbol) = people(spec.unit);
        let name = spec.name.strip_prefix(effect).unwrap_or(&spec.name).trim_start_matches('.');
        ParameterEstimate {
            name: name.to_string(),
            form,
            value: unit.from_si(state.model.x[k]),
            unit: symbol,
            sigma: sigma.map(|sigma| unit.from_si(sigma)),
        }
    };
    members.iter().enumerate().flat_map(|(form, i)| state.ranges[*i].clone().map(move |k| (form, k))).map(one).collect()
}

/// Joint and range over which the errors of a joint hold.
fn valid(forms: &[Form], last: &LastRound) -> Option<(usize, [f64; 2])> {
    let Place::Joint(joint) = forms[0].place() else { return None };
    let table = forms.iter().find_map(|form| match form.term()?.basis() {
        Basis::Fading { low, high, .. } => Some([low, high]),
        _ => None,
    });
    Some((joint, table.unwrap_or(last.survey.range[joint])))
}

/// What folds say of forms of one effect at a place.
fn heldout_gain(forms: &[Form], place: Place, gains: &[FoldGain]) -> Option<f64> {
    let name = forms.first()?.name();
    let own = gains.iter().find(|own| own.effect == name && own.place == place);
    own.filter(|_| forms.iter().all(|form| form.name() == name)).map(|own| own.gain)
}

/// Rms size (m or rad) of the whole effect over the fitted rows, the absorbed part included, of hypotheses with their fitted coefficients.
fn size<'a>((pool, scale): (&HypothesisSet, ErrorScale), own: impl Iterator<Item = (usize, &'a [f64])>) -> f64 {
    // In standard deviations of the rows; the mean noise turns it into a size.
    let mut sum = vec![0.0; pool.residual_rows];
    for (k, coefficients) in own {
        let columns = pool.problem.motions_by(&pool.hypotheses[k].form);
        for (column, coefficient) in columns.chunks(pool.residual_rows).zip(coefficients) {
            sum.iter_mut().zip(column).for_each(|(value, c)| *value += c * coefficient);
        }
    }
    let rows = &pool.problem.rows;
    let squares = rows.iter().enumerate().map(|(i, row)| {
        let lines = pool.problem.readings_of(i);
        let (values, whitened) = (lines.len().max(1) as f64, lines.map(|line| sum[line].powi(2)).sum::<f64>());
        whitened * scale.noise(pool.problem.data, *row).powi(2) / values
    });
    (squares.sum::<f64>() / rows.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_gains_more_than_all_that_it_does_is_not_what_it_is_called() {
        let evidence = |gain| Evidence { heldout_gain: gain, effect_rms: 220e-6, ..Evidence::default() };
        let said = more_than_it_does("gear_cyclic", &evidence(Some(8.3e-3)), Dimension::Length).expect("more");
        assert_eq!(said, "other poses would gain 8300 um by it, which is more than all that it does, 220 um rms");
        assert_eq!(more_than_it_does("gear_cyclic", &evidence(Some(430e-6)), Dimension::Length), None);
        assert_eq!(more_than_it_does("gear_cyclic", &evidence(None), Dimension::Length), None);
        assert_eq!(more_than_it_does(names::UNKNOWN, &evidence(Some(8.3e-3)), Dimension::Length), None);
    }
}
