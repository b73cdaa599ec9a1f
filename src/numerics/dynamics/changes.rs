//! One arm in two recordings: what of its torques changed, with payload, temperature, wear or repair. Both are fitted at once; masses and
//! friction are common but for what the second recording shows to be another.

use super::arm::{DynamicArm, INERTIAL_NUMBERS, unit_number};
use super::cause::{
    CENTRE, COULOMB_FRICTION, CURRENT_OFFSET, InertialChanges, PAYLOAD, TorqueForm,
    VISCOUS_FRICTION,
};
use super::columns::{TorqueColumn, TorqueColumns};
use super::model::TorqueModel;
use super::problem::{TorqueProblem, noise_of_fit};
use super::recording::TorqueSource;
use super::sweep::{SweptColumns, value_of};
use super::types::{ContactEvent, TorqueQuestion};
use super::used::UsedRecording;
use super::weighted::{NoiseMemory, WeightedColumns};
use crate::effect::Place;
use crate::error::{Error, Result};
use crate::estimate::tail;

/// Residual rows of a test, at most: beyond it the tail does not change.
const FREEDOM: f64 = 1e4;
/// True shapes differ a little from those of the library: differences of the criterion count for less than their exponent.
const TEMPERATURE: f64 = 2.0;
/// kg: less is nothing to have a centre.
const LIGHTEST: f64 = 0.05;
/// Name of what is on the tool.
const ON_TOOL: &str = "payload";

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
    for (problem, one) in problems.iter_mut().zip([first, second]) {
        take_columns(problem, &base, &candidates, one.model, first.model);
    }
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
    for cause in [&VISCOUS_FRICTION, &COULOMB_FRICTION, &CURRENT_OFFSET] {
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
    problem.scene.friction = about.friction(&about.places()?.forms, &problem.scene);
    problem.form_base();
    Ok(problem)
}

/// Takes a base that both recordings have in common, and all candidates as columns.
fn take_columns(
    problem: &mut TorqueProblem,
    base: &InertialChanges,
    candidates: &[TorqueForm],
    identified: &TorqueModel,
    about: &TorqueModel,
) {
    let prior = problem.all.prior.first().copied().unwrap_or(0.0);
    problem.all.columns = problem.regressor.columns(base);
    problem.all.base = base.len();
    problem.all.base_changes = base.clone();
    // Declared numbers have one prior; where base parameters are identified, nothing is known of them beforehand.
    let known = problem.scene.declared.as_ref().map_or(0.0, |_| prior);
    problem.all.prior = vec![known; base.len()];
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
    let of_column = |column: &usize| value_of(&solution, *column);
    let values: Vec<f64> = columns.iter().map(of_column).collect();
    let covariance = fit.covariance(&columns);
    let gain = fit.loss(number, &solution).square;
    let count = values.len();
    let p_value = tail(gain / count.max(1) as f64, count.max(1) as f64, FREEDOM);
    let probability = 1.0 / (1.0 + (-(gain - both.penalty(number)) / (2.0 * TEMPERATURE)).exp());
    let on_tool = form.place == Place::Tool;
    let effect = if on_tool { ON_TOOL } else { form.cause.name };
    let number = |name: &str, unit: &'static str, change: f64, variance: f64| TorqueChange {
        name: match on_tool {
            true => format!("{ON_TOOL}.{name}"),
            false => format!("{effect}.{}.{name}", form.place.tag()),
        },
        effect: effect.into(),
        place: form.place,
        unit,
        change,
        sigma: variance.max(0.0).sqrt(),
        p_value,
        probability,
        rank,
    };
    let entry = |a: usize, b: usize| covariance[a * count + b];
    if !on_tool {
        let names = form.coefficient_names().into_iter().enumerate();
        return names
            .map(|(k, (quantity, unit))| number(&quantity, unit, values[k], entry(k, k)))
            .collect();
    }
    let point = problem.scene.arm.points[problem.joints() - 1].coords;
    let mass = values[0];
    let mut all = vec![number("mass", "kg", mass, entry(0, 0))];
    if mass.abs() > LIGHTEST && count == INERTIAL_NUMBERS {
        for (axis, name) in CENTRE.into_iter().enumerate() {
            let (moment, place) = (values[1 + axis], 1 + axis);
            // The slope of moment over mass.
            let slope = [-moment / (mass * mass), 1.0 / mass];
            let variance = slope[0] * slope[0] * entry(0, 0)
                + 2.0 * slope[0] * slope[1] * entry(0, place)
                + slope[1] * slope[1] * entry(place, place);
            all.push(number(name, "m", point[axis] + moment / mass, variance));
        }
    }
    all
}

// Two recordings in one least squares: what is common to both, and forms that only the second one has. Joints of the second count on from those of
// the first.

/// -2 ln of how common a change is against none.
const PRICE: f64 = 6.0;
/// What is known of a number beforehand, as a share of its own information.
const UNKNOWN: f64 = 2e-9;

/// Common columns as the base, and forms that may change: the last link's inertial numbers, then causes.
struct StackedColumns {
    all: TorqueColumns,
    weighted: WeightedColumns,
    /// Nm, of both.
    measured: Vec<Vec<f64>>,
    /// Judged rows of the second that count.
    rows: Vec<usize>,
    joints: usize,
}

impl StackedColumns {
    /// Of two problems whose columns are alike; both have the first `shared` forms.
    fn new(problems: &[TorqueProblem; 2], shared: usize) -> Self {
        let n = problems[0].joints();
        let runs = problems.each_ref().map(|problem| problem.runs(false));
        let weighings = [0, 1].map(|which| problems[which].weighing(&runs[which]));
        // A column of one of the two, as it is and whitened.
        let placed = |which: usize, column: &TorqueColumn| {
            let joints = column.joints.iter().map(|joint| n * which + joint);
            let joints: Vec<usize> = joints.collect();
            let white = weighings[which].column(column);
            [column.clone(), white].map(|column| TorqueColumn {
                joints: joints.clone(),
                ..column
            })
        };
        let (mut all, mut white) = (TorqueColumns::default(), Vec::new());
        let second = &problems[1].all;
        all.base = (0..shared).fold(second.base, |end, form| end.max(second.of(form).end));
        for number in 0..all.base {
            let both = [0, 1].map(|which| placed(which, &problems[which].all.columns[number]));
            let [plain, whitened] = [0, 1].map(|is_white| TorqueColumn {
                joints: both
                    .each_ref()
                    .map(|one| one[is_white].joints.clone())
                    .concat(),
                courses: both
                    .each_ref()
                    .map(|one| one[is_white].courses.clone())
                    .concat(),
            });
            white.push(whitened);
            all.push_bare(plain);
            if number < second.base {
                all.prior[number] = problems[0].all.prior[number];
            }
        }
        let columns_of = |form: usize| second.columns[second.of(form)].to_vec();
        let forms = second.forms.iter().cloned().enumerate();
        let forms = forms.map(|(number, form)| (form, columns_of(number)));
        for (form, columns) in std::iter::once(payload(&problems[1])).chain(forms) {
            let both = columns.iter().map(|column| placed(1, column));
            let (plain, whitened): (Vec<_>, Vec<_>) = both.map(|[a, b]| (a, b)).unzip();
            white.extend(whitened);
            all.take(form, plain);
        }
        let whitened = [0, 1].map(|which| weighings[which].measured(&problems[which].measured));
        let chosen: Vec<usize> = (0..white.len()).collect();
        let weighted = WeightedColumns::of_white(white, whitened.concat(), &chosen);
        for number in chosen {
            all.prior[number] += UNKNOWN * weighted.gram[number][number] + f64::MIN_POSITIVE;
        }
        Self {
            all,
            weighted,
            measured: problems.each_ref().map(|one| one.measured.clone()).concat(),
            rows: problems[1].counted_rows(false),
            joints: n,
        }
    }

    /// What a form must gain.
    fn penalty(&self, form: usize) -> f64 {
        let rows = [0, self.joints].map(|joint| self.weighted.measured[joint].len());
        let rows: usize = rows.iter().sum();
        PRICE
            + self.all.of(form).len() as f64 * (rows as f64).ln()
            + 2.0 * (self.all.forms.len() as f64).ln()
    }

    /// Common numbers and some forms.
    fn fit(&self, set: &[usize]) -> SweptColumns<'_> {
        SweptColumns::base(&self.all, &self.weighted).with(set)
    }

    /// Adds the best form while it is worth its penalty, then removes what is not.
    fn search(&self) -> Vec<usize> {
        let mut set: Vec<usize> = Vec::new();
        loop {
            let now = self.fit(&set);
            let worth = |form: usize| now.square - now.with(&[form]).square - self.penalty(form);
            let others = (0..self.all.forms.len()).filter(|form| !set.contains(form));
            let best = others
                .map(|form| (form, worth(form)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            match best {
                Some((form, worth)) if worth > 0.0 => set.push(form),
                _ => return set,
            }
            loop {
                let now = self.fit(&set);
                let solution = now.solution();
                // Not by rounding alone: what is removed so would be added again, for ever.
                let idle = |form: &usize| {
                    now.loss(*form, &solution).square < (1.0 - 1e-6) * self.penalty(*form)
                };
                let Some(place) = set.iter().position(idle) else {
                    break;
                };
                set.remove(place);
            }
        }
    }

    /// Residual of the second recording after a fit, Nm rms per joint.
    fn residual_rms(&self, fit: &SweptColumns) -> Vec<f64> {
        let mut left = self.measured.clone();
        for (number, value) in fit.solution() {
            self.all.columns[number].add(-value, &mut left);
        }
        let rms = |course: &Vec<f64>| {
            let squares = self.rows.iter().map(|row| course[*row].powi(2));
            (squares.sum::<f64>() / self.rows.len().max(1) as f64).sqrt()
        };
        left[self.joints..].iter().map(rms).collect()
    }
}

/// The last link's inertial numbers that torques can determine: all where masses are declared.
fn payload(problem: &TorqueProblem) -> (TorqueForm, Vec<TorqueColumn>) {
    let last = problem.joints() - 1;
    let changes = (0..INERTIAL_NUMBERS).map(|number| (last, unit_number(number)));
    let form = TorqueForm {
        place: Place::Tool,
        ..TorqueForm::at_joint(&PAYLOAD, last, INERTIAL_NUMBERS)
    };
    (form, problem.regressor.columns(&changes.collect()))
}
