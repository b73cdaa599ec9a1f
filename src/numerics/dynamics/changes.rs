//! One arm in two recordings: what of its torques changed, with payload, temperature, wear or repair. Both are fitted at once; masses and
//! friction are common but for what the second recording shows to be another.

use super::arm::{DynamicArm, INERTIAL_NUMBERS};
use super::cause::{COULOMB, OFFSET, TORQUE_CAUSES, TorqueForm, VISCOUS};
use super::model::TorqueModel;
use super::problem::TorqueProblem;
use super::rich::noise_of_fit;
use super::sweep::{SweptColumns, value_of};
use super::types::{ContactEvent, TorqueQuestion};
use super::used::UsedRecording;
use crate::effect::Place;
use crate::error::{Error, Result};
use crate::estimate::tail;
use crate::sweep::StackedColumns;
use crate::types::TorqueSource;
use crate::weighted::NoiseMemory;

/// Residual rows of a test, at most: beyond it the tail does not change.
const FREEDOM: f64 = 1e4;
/// True shapes differ a little from those of the library: differences of the criterion count for less than their exponent.
const TEMPERATURE: f64 = 2.0;
/// kg: less is nothing to have a centre.
const LIGHTEST: f64 = 0.05;
/// Name of what is on the tool.
const PAYLOAD: &str = "payload";

/// A recording, the model that its diagnosis identified, and the pushes that it found.
pub struct DiagnosedRecording<'a> {
    /// All rows are fitted, held-out ones too.
    pub recording: &'a dyn TorqueSource,
    /// The model of this recording.
    pub model: &'a TorqueModel,
    /// Rows in which something touches the arm.
    pub events: &'a [ContactEvent],
}

/// A number that may have changed.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueChange {
    /// As in the model of torques; of what is on the tool `payload.mass`, `payload.centre_x`.
    pub name: String,
    /// Canonical name of the cause; `payload`.
    pub effect: String,
    /// Where it acts.
    pub place: Place,
    /// Unit of `change` and `sigma`.
    pub unit: &'static str,
    /// In the second recording less the first; of a payload's centre where it is, m, base frame at zero pose.
    pub change: f64,
    /// One standard deviation, with the noise's autocorrelation.
    pub sigma: f64,
    /// Chance that noise gives as much to this cause where nothing changed.
    pub p_value: f64,
    /// That the cause changed.
    pub probability: f64,
    /// From 1, strongest first; `None`: held to be unchanged, the numbers are those that it would have alone.
    pub rank: Option<usize>,
}

/// What changed.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueChanges {
    /// Strongest first, then what is held to be unchanged.
    pub changes: Vec<TorqueChange>,
    /// Nm, per joint of the second recording: what is left where nothing changed, and with the changes.
    pub rms: Vec<[f64; 2]>,
}

/// Compares two diagnosed recordings of an arm.
///
/// # Errors
/// [`crate::error::Error::Data`] where models and arm differ in joints, a model has causes that are not known, or a recording cannot be used.
pub fn changes(
    arm: &DynamicArm,
    first: &DiagnosedRecording,
    second: &DiagnosedRecording,
) -> Result<TorqueChanges> {
    let n = arm.joints();
    if [first, second]
        .iter()
        .any(|one| one.model.joints() != n || one.recording.joints() != n)
    {
        return Err(Error::data(
            "models",
            format!("the arm has {n} joints, models or recordings others"),
        ));
    }
    let shared = shared_forms(first.model, second.model)?;
    let candidates = candidate_forms(&shared, n);
    let mut problems = [
        prepared(arm, first, first.model)?,
        prepared(arm, second, first.model)?,
    ];
    let base = problems[0].all.base_changes.clone();
    problems
        .iter_mut()
        .zip([first, second])
        .for_each(|(problem, one)| {
            take_columns(problem, &base, &candidates, one.model, first.model)
        });
    let both = StackedColumns::new(&problems, shared.len());
    let mut set = both.search();
    let fit = both.fit(&set);
    let solution = fit.solution();
    set.sort_by(|a, b| {
        let gain = |form: usize| fit.loss(form, &solution).square;
        gain(*b).total_cmp(&gain(*a))
    });
    let mut changes = Vec::new();
    for (rank, form) in set.iter().enumerate() {
        changes.extend(change(&problems[1], &both, &fit, *form, Some(rank + 1)));
    }
    for form in (0..both.all.forms.len()).filter(|form| !set.contains(form)) {
        let with = fit.with(&[form]);
        changes.extend(change(&problems[1], &both, &with, form, None));
    }
    let [before, after] = [&both.fit(&[]), &fit].map(|fit| both.residual_rms(fit));
    let rms = before.into_iter().zip(after);
    Ok(TorqueChanges {
        changes,
        rms: rms.map(|(before, after)| [before, after]).collect(),
    })
}

/// Causes of either model, those of the first in its shapes.
fn shared_forms(first: &TorqueModel, second: &TorqueModel) -> Result<Vec<TorqueForm>> {
    let mut forms: Vec<TorqueForm> = Vec::new();
    for term in first.terms.iter().chain(&second.terms) {
        let form = term.form()?;
        if !forms.iter().any(|known| {
            known.is_called_as(&form)
                && known.with == form.with
                && known.cause.has_shape(&form.shape)
        }) {
            forms.push(form);
        }
    }
    Ok(forms)
}

/// The shared forms, then friction and offset of each joint where they are not among them: each may change.
fn candidate_forms(shared: &[TorqueForm], joints: usize) -> Vec<TorqueForm> {
    let mut forms = shared.to_vec();
    for name in [VISCOUS, COULOMB, OFFSET] {
        let Some(cause) = TORQUE_CAUSES.into_iter().find(|cause| cause.name == name) else {
            continue;
        };
        for joint in 0..joints {
            let form = TorqueForm::at_joint(cause, joint, 1);
            if !forms.iter().any(|known| known.is_called_as(&form)) {
                forms.push(form);
            }
        }
    }
    forms
}

/// A recording about the first model's masses, with the base alone as columns.
fn prepared<'a>(
    arm: &'a DynamicArm,
    one: &DiagnosedRecording,
    about: &TorqueModel,
) -> Result<TorqueProblem<'a>> {
    let UsedRecording {
        mut recording,
        clock,
        ..
    } = UsedRecording::of(arm, one.recording, Some(about.cutoff))?;
    recording.held_out.fill(false);
    let question = TorqueQuestion {
        free_inertials: arm.links.is_none(),
        ..TorqueQuestion::default()
    };
    let mut problem = TorqueProblem::new(arm, recording, &question, &clock, about.cutoff);
    problem.scene.turn_over(about.sign_width);
    problem
        .scene
        .turn_each_over(about.range.iter().map(|range| range.sign_width));
    problem.scene.friction_lead = about.friction_lead;
    problem.events = one.events.to_vec();
    problem.scene.believe(&about.inertials);
    problem.scene.friction = about.friction(&about.forms()?, &problem.scene);
    let all: Vec<String> = TORQUE_CAUSES
        .iter()
        .map(|cause| cause.name.to_string())
        .collect();
    problem.form(&all);
    Ok(problem)
}

/// Takes a base that both recordings have in common, and all candidates as columns.
fn take_columns(
    problem: &mut TorqueProblem,
    base: &[(usize, [f64; INERTIAL_NUMBERS])],
    candidates: &[TorqueForm],
    identified: &TorqueModel,
    about: &TorqueModel,
) {
    let prior = problem.all.prior.first().copied().unwrap_or(0.0);
    problem.all.columns = base
        .iter()
        .map(|(link, ten)| problem.regressor.column(*link, ten))
        .collect();
    problem.all.base = base.len();
    problem.all.base_changes = base.to_vec();
    // Declared numbers have one prior; where base parameters are identified, nothing is known of them beforehand.
    problem.all.prior = vec![
        if problem.scene.declared.is_some() {
            prior
        } else {
            0.0
        };
        base.len()
    ];
    for form in candidates {
        problem.push(form.clone());
    }
    // Noise about its own masses: a payload of the other recording is none.
    problem.theta.clone_from(&identified.inertials);
    problem.shift(identified.latency);
    let forms: Vec<usize> = (0..candidates.len()).collect();
    problem.noise = noise_of_fit(problem, &forms, NoiseMemory::Short).0;
    problem.theta.clone_from(&about.inertials);
    problem.shift(identified.latency);
}

/// The numbers of a form.
fn change(
    problem: &TorqueProblem,
    both: &StackedColumns,
    fit: &SweptColumns,
    number: usize,
    rank: Option<usize>,
) -> Vec<TorqueChange> {
    let (form, solution) = (&both.all.forms[number], fit.solution());
    let columns: Vec<usize> = both.all.of(number).collect();
    let values: Vec<f64> = columns
        .iter()
        .map(|column| value_of(&solution, *column))
        .collect();
    let covariance = fit.covariance(&columns);
    let gain = fit.loss(number, &solution).square;
    let count = values.len();
    let p_value = tail(gain / count.max(1) as f64, count.max(1) as f64, FREEDOM);
    let probability = 1.0 / (1.0 + (-(gain - both.penalty(number)) / (2.0 * TEMPERATURE)).exp());
    let number =
        |name: String, effect: &str, place: Place, unit: &'static str, change: f64, sigma: f64| {
            TorqueChange {
                name,
                effect: effect.into(),
                place,
                unit,
                change,
                sigma,
                p_value,
                probability,
                rank,
            }
        };
    if form.place == Place::Tool {
        let point = problem.scene.arm.points[problem.joints() - 1].coords;
        let mass = values[0];
        let sigma = |number: usize| covariance[number * (count + 1)].max(0.0).sqrt();
        let mut all = vec![number(
            format!("{PAYLOAD}.mass"),
            PAYLOAD,
            Place::Tool,
            "kg",
            mass,
            sigma(0),
        )];
        if mass.abs() > LIGHTEST && count == INERTIAL_NUMBERS {
            for (axis, name) in ["centre_x", "centre_y", "centre_z"].iter().enumerate() {
                let (moment, place) = (values[1 + axis], 1 + axis);
                // The slope of moment over mass.
                let slope = [-moment / (mass * mass), 1.0 / mass];
                let entry = |a: usize, b: usize| covariance[a * count + b];
                let variance = slope[0] * slope[0] * entry(0, 0)
                    + 2.0 * slope[0] * slope[1] * entry(0, place)
                    + slope[1] * slope[1] * entry(place, place);
                let centre = point[axis] + moment / mass;
                all.push(number(
                    format!("{PAYLOAD}.{name}"),
                    PAYLOAD,
                    Place::Tool,
                    "m",
                    centre,
                    variance.max(0.0).sqrt(),
                ));
            }
        }
        return all;
    }
    let names = form.coefficient_names();
    let of_place = |(place, (quantity, unit)): (usize, (String, &'static str))| {
        let name = format!("{}.{}.{quantity}", form.cause.name, form.place.tag());
        number(
            name,
            form.cause.name,
            form.place,
            unit,
            values[place],
            covariance[place * (count + 1)].max(0.0).sqrt(),
        )
    };
    names.into_iter().enumerate().map(of_place).collect()
}
