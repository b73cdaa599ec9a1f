//! Findings that the last fit leaves without size, or that gain nothing in folds, are taken back, and the model is fitted
//! without them: the search judges a linear picture of each, the fit the whole model.

use super::alternatives::Alternatives;
use super::comparison::ModelComparison;
use super::fold_errors::{FoldErrors, FoldGain};
use crate::diagnose::finding_groups::{FindingGroups, groups};
use crate::diagnose::round::FitState;

/// The fit without findings that cannot stand, and a sentence for each of these; `set` holds the causes' positions in the pool
/// in their order, `gains` what folds say of them.
pub(super) fn withdraw(
    mut now: FitState,
    set: &mut Vec<usize>,
    gains: &mut Vec<FoldGain>,
    comparison: &ModelComparison,
) -> (FitState, Vec<String>) {
    let mut said = Vec::new();
    if now.screening.apart.is_some() {
        return (now, said);
    }
    while let Some((gone, sentence, state)) = empty(&now, set, comparison).or_else(|| harmful(&now, set, gains, comparison)) {
        let kept = |i: &usize| !gone.contains(i);
        *set = (0..set.len()).filter(kept).map(|i| set[i]).collect();
        said.push(sentence);
        now = state;
        // Gains were those of a model that is gone.
        gains.clear();
    }
    if let Some(base) = useless(&now, comparison) {
        set.clear();
        said.push("all findings together: poses that a fit has not seen are predicted as well or better without them".into());
        now = base;
    }
    (now, said)
}

/// The base model fitted alone, where all causes together gain nothing in folds.
fn useless(now: &FitState, comparison: &ModelComparison) -> Option<FitState> {
    if now.causes.is_empty() {
        return None;
    }
    let all: Vec<usize> = (0..now.causes.len()).collect();
    let seen = FoldErrors::of(now, comparison.fitter)?;
    let around = Alternatives::of(now, comparison.fitter, &[])?;
    let bare = around.near().and_then(|near| near.errors(&all, None));
    if bare.is_some_and(|bare| seen.gain_over(&bare) > 0.0) {
        return None;
    }
    let base = comparison.without(now, &all);
    (seen.gain_over(&FoldErrors::of(&base, comparison.fitter)?) <= 0.0).then_some(base)
}

/// The finding that was not estimated, else the weakest of those that are smaller than their own uncertainty.
fn empty(now: &FitState, set: &[usize], comparison: &ModelComparison) -> Option<(Vec<usize>, String, FitState)> {
    let groups = groups(now, set, comparison.pool, comparison.survey);
    let weak = groups.into_iter().filter_map(|(key, members)| Some((now.square_size(&members)?, key, members)));
    let (size, (effect, place), members) = weak.filter(|(size, ..)| *size < 1.0).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let why = if size == 0.0 {
        "these data cannot separate it from the rest of the model"
    } else {
        "in the whole model it is smaller than its own uncertainty"
    };
    let state = comparison.without(now, &members);
    let effect = comparison.said(effect);
    Some((members, format!("{effect} at {place}: {why}"), state))
}

/// The finding that gains least in folds, of those that gain nothing.
fn harmful(
    now: &FitState,
    set: &[usize],
    gains: &mut Vec<FoldGain>,
    comparison: &ModelComparison,
) -> Option<(Vec<usize>, String, FitState)> {
    let fitter = comparison.fitter;
    let seen = FoldErrors::of(now, fitter)?;
    let around = Alternatives::of(now, fitter, &[])?;
    let nearby = around.near();
    let mut worst: Option<(f64, Vec<usize>, String, FitState)> = None;
    let groups: FindingGroups = groups(now, set, comparison.pool, comparison.survey);
    for ((effect, place), members) in groups {
        let names: Vec<&'static str> = members.iter().map(|i| comparison.pool.hypotheses[set[*i]].form.name()).collect();
        let same = names.iter().all(|name| *name == names[0]);
        let known = gains.iter_mut().find(|known| same && known.effect == names[0] && known.place == place);
        if known.as_ref().is_some_and(|known| known.gain > 0.0) {
            continue;
        }
        let bare = nearby.as_ref().and_then(|near| near.errors(&members, None));
        let mut gain = bare.map(|bare| seen.gain_over(&bare));
        let mut state = None;
        // What is to go is fitted before it goes.
        if gain.is_none_or(|gain| gain <= 0.0) {
            let without = comparison.without(now, &members);
            gain = Some(seen.gain_over(&FoldErrors::of(&without, fitter)?));
            state = Some(without);
        }
        let gain = gain?;
        match known {
            Some(known) => known.gain = gain,
            None if same => gains.push(FoldGain { effect: names[0], place, gain }),
            None => (),
        }
        if let Some(state) = state.filter(|_| gain <= 0.0 && worst.as_ref().is_none_or(|(least, ..)| gain < *least)) {
            let effect = comparison.said(effect);
            let sentence =
                format!("{effect} at {place}: poses that a fit has not seen are predicted as well or better without it");
            worst = Some((gain, members, sentence, state));
        }
    }
    worst.map(|(_, members, sentence, state)| (members, sentence, state))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::pool::{CachedHypotheses, HypothesisSet};
    use crate::diagnose::round::{EstimatedCause, Fitter};
    use crate::diagnose::types::Question;
    use crate::diagnose::whitened::WhitenedProblem;
    use crate::effect::{EffectStack, Form, GearCyclic, Survey, hypotheses};
    use crate::estimate::Model;
    use crate::robot::import::{RobotFileText, read_calib};
    use crate::robot::{Measurements, PointReadings, RobotModel};
    use crate::spatial::Pose;
    use nalgebra::Vector3;

    const ROBOT: &str = "calib_robot: 1
name: small
units: {length: mm, angle: deg}
kinematics:
  screws:
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, 1, 0], point: [0, 0, 400]}
    - {axis: [0, 1, 0], point: [0, 0, 900]}
    - {axis: [1, 0, 0], point: [500, 0, 900]}
    - {axis: [0, 1, 0], point: [700, 0, 900]}
    - {axis: [1, 0, 0], point: [700, 0, 900]}
tool: {point: [830, 140, 930]}
joints: [{name: A1}, {name: A2}, {name: A3}, {name: A4}, {name: A5}, {name: A6}]
";
    const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;
    const ROWS: usize = 200;
    const FITTED: usize = 140;

    /// Numbers in [0, 1) without a pattern that a model could follow.
    fn scattered(k: usize) -> f64 {
        (k as f64 * 0.618_033_988_749_895 + (k as f64 * 0.317).sin() * 41.7).rem_euclid(1.0)
    }

    /// Poses of which gears make points: order 2 of joint 2 by 60 arcsec everywhere, order 3 of joint 4 in fitted rows by `passing`.
    fn recorded(robot: &RobotModel, passing: f64) -> Measurements {
        let forms = [GearCyclic::term(1, 2, false), GearCyclic::term(3, 3, false)];
        let effects = forms.into_iter().map(|gear| Box::new(Form::from(gear)) as _).collect();
        let mut truth = Model::nominal(robot.clone(), EffectStack::new(robot, Pose::identity(), effects));
        let mut data = Measurements {
            joints: 6,
            q: (0..6 * ROWS).map(|k| 3.0 * scattered(k + 7) - 1.5).collect(),
            points: PointReadings::new(vec![Vector3::zeros(); ROWS], 2e-5),
            payload: (0..ROWS).map(|row| if row % 7 < 3 { 10.0 } else { 0.0 }).collect(),
            ..Measurements::default()
        };
        let predicted = |x: [f64; 4], truth: &mut Model| {
            truth.x = x.map(|size| size * ARCSEC).to_vec();
            truth.predict(&data)
        };
        let (seen, held) = (predicted([60.0, 0.0, passing, 0.0], &mut truth), predicted([60.0, 0.0, 0.0, 0.0], &mut truth));
        let noise = |row: usize| Vector3::from_fn(|axis, _| 7e-5 * (scattered(3 * row + axis + 5000) - 0.5));
        data.points.position = (0..ROWS).map(|row| if row < FITTED { seen[row] } else { held[row] } + noise(row)).collect();
        data
    }

    /// What stays of the chosen causes, and what is said of the others.
    fn left(passing: f64, keys: &[&str]) -> (Vec<String>, Vec<String>) {
        let text = RobotFileText { label: "robot.yaml", text: ROBOT };
        let robot = RobotModel::new(read_calib(text, None).expect("a robot").robot);
        let data = recorded(&robot, passing);
        let rows: Vec<usize> = (0..ROWS).collect();
        let (fit, validate) = rows.split_at(FITTED);
        let question = Question {
            robot: &robot,
            data: &data,
            fit,
            validate,
            set: &[0; ROWS],
            prior_weight: 1.0,
            open_world: 0.3,
            without: &[],
            own: &[],
            beside_simulation: false,
            seed: 1,
        };
        let (fitter, now) = Fitter::start(&question);
        let problem = WhitenedProblem::new(&now.model, &data, fit.to_vec());
        // So that a payload is proposed at all.
        let (torque, compliance) = (problem.torques(), vec![1e-6; 6]);
        let survey = Survey::new(&robot, &data, fit, &torque, &compliance);
        let (jacobian, all) = (problem.jacobian(fitter.free()), hypotheses(&survey));
        let pool = CachedHypotheses::from(HypothesisSet::new(&problem, &jacobian, &problem.residual, 1.0, all));
        let at = |key: &&str| pool.keys.iter().position(|other| other == key).unwrap_or_else(|| panic!("{key}: {:?}", pool.keys));
        let mut set: Vec<usize> = keys.iter().map(at).collect();
        let causes: Vec<EstimatedCause> = (set.iter())
            .map(|k| {
                let form = pool.hypotheses[*k].form.clone();
                EstimatedCause { coefficients: vec![0.0; form.parameters(&robot).len()], form, priors: Vec::new() }
            })
            .collect();
        let comparison = ModelComparison { pool: &pool, survey: &survey, fitter: &fitter };
        let (last, said) = withdraw(fitter.fit(&now.model, causes), &mut set, &mut Vec::new(), &comparison);
        let kept: Vec<String> = set.iter().map(|k| pool.keys[*k].clone()).collect();
        let in_model: Vec<String> = last.model.stack.effects().filter_map(|(effect, _)| effect.form()).map(Form::key).collect();
        assert_eq!(kept, in_model);
        (kept, said)
    }

    const TRUE: &str = "gear_cyclic@joint 2#order2";
    const PASSING: &str = "gear_cyclic@joint 4#order3";
    const PAYLOAD: &str = "payload_error@tool#";

    #[test]
    fn what_the_data_do_not_tell_from_the_rest_is_taken_back() {
        // Without a joint that yields a payload moves nothing.
        let (kept, said) = left(0.0, &[TRUE, PAYLOAD]);
        assert_eq!(kept, [TRUE]);
        assert_eq!(said, ["payload_error at tool: these data cannot separate it from the rest of the model"]);
    }

    #[test]
    fn what_gains_nothing_is_taken_back() {
        let (kept, said) = left(0.0, &[TRUE, PASSING]);
        assert_eq!((kept, said.len()), (vec![TRUE.to_string()], 1), "{said:?}");
        assert!(said[0].starts_with("gear_cyclic at joint 4: "), "{said:?}");
    }

    #[test]
    fn what_held_out_rows_lack_stays_where_the_fitted_rows_have_it() {
        assert_eq!(left(90.0, &[TRUE, PASSING]), (vec![TRUE.to_string(), PASSING.to_string()], Vec::new()));
    }

    #[test]
    fn what_is_there_stays() {
        assert_eq!(left(0.0, &[TRUE]), (vec![TRUE.to_string()], Vec::new()));
    }
}
