//! One arm in two recordings: what of its torques changed, with payload, temperature, wear or repair. Both are fitted at once; masses and
//! friction are common but for what the second recording shows to be another.

use super::arm::DynamicArm;
use super::carried::{Carried, carried, reach, seen_numbers};
use super::cause::{
    COULOMB_FRICTION, CURRENT_OFFSET, FittedNumber, InertialChanges, TorqueForm, VISCOUS_FRICTION,
};
use super::columns::{TorqueColumn, TorqueColumns};
use super::model::TorqueModel;
use super::problem::{TorqueBand, TorqueProblem, noise_of};
use super::recording::TorqueSource;
use super::sliding::unit_at;
use super::sweep::{SweptColumns, value_of};
use super::types::{ContactEvent, TorqueQuestion};
use super::used::UsedRecording;
use super::weighted::{NoiseMemory, WeightedColumns};
use crate::criteria::torque::NAMED;
use crate::effect::Place;
use crate::error::{Error, Result};
use crate::estimate::tail;
use calib_engine::{Accepted, Cause, Cell, Options, Problem, Scanned};

/// Residual rows of a test, at most: beyond it the tail does not change.
const FREEDOM: f64 = 1e4;
/// True shapes differ a little from those of the library: differences of the criterion count for less than their exponent.
const TEMPERATURE: f64 = 2.0;
/// Another place of a mass is told from this share of probability on.
const NOTABLE: f64 = 0.05;

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
    /// As in the model of torques; of what is carried `payload.mass`, `payload.centre_x`, `added_mass.l2.moment`: what the data see of it.
    pub name: String,
    /// Canonical name of the cause; `payload`, `added_mass`.
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
    /// Other places where the same mass would explain the data as well, with their probability, the likeliest first.
    pub rivals: Vec<(Place, f64)>,
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
    let forms = first.model.places()?.forms;
    let moved = problems[1].friction_moved(|scene| first.model.friction(&forms, scene));
    let found = calib_engine::diagnose(&both, &[], &both.options(), |_| ()).after;
    let mut set = both.clear(found, &problems[1], &moved);
    let fit = both.with(&set);
    let solution = fit.solution();
    set.sort_by(|a, b| {
        let gain = |form: usize| fit.loss(form, &solution).square;
        gain(*b).total_cmp(&gain(*a))
    });
    let mut changes = Vec::new();
    for (rank, form) in set.iter().enumerate() {
        let rivals = both.rivals(&set, *form);
        let of_form = change(&problems[1], &both, &fit, *form, Some(rank + 1));
        changes.extend(of_form.into_iter().map(|change| TorqueChange {
            rivals: rivals.clone(),
            ..change
        }));
    }
    // A mass that is nowhere is not told of each link.
    let unchanged =
        |form: &usize| !set.contains(form) && both.carries(*form) != Some(Carried::OnLink);
    for form in (0..both.all.forms.len()).filter(unchanged) {
        let with = fit.with(&[form]);
        changes.extend(change(&problems[1], &both, &with, form, None));
    }
    let [before, after] = [&both.with(&[]), &fit].map(|fit| both.residual_rms(fit));
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
    let mut problem = TorqueProblem::new(
        arm,
        recording,
        &question,
        &clock,
        TorqueBand::whole(about.cutoff),
    );
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
    problem.noise = noise_of(problem, &forms, NoiseMemory::Short);
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
    let seen = fit.loss(number, &solution).rank.max(1) as f64;
    let p_value = tail(gain / seen, seen, FREEDOM);
    let probability = 1.0 / (1.0 + (-(gain - both.penalty(number)) / (2.0 * TEMPERATURE)).exp());
    let number =
        |effect: &str, name: String, unit: &'static str, change: f64, sigma: f64| TorqueChange {
            name,
            effect: effect.into(),
            place: form.place,
            unit,
            change,
            sigma,
            p_value,
            probability,
            rank,
            rivals: Vec::new(),
        };
    if let Some(what) = Carried::of(form) {
        let numbers = seen_numbers(what, problem.scene.arm, form, &values, &covariance);
        let numbers = numbers.into_iter();
        return numbers
            .map(|one| {
                let name = format!("{}.{}", what.tag(form), one.name);
                number(what.name(), name, one.unit, one.value, one.sigma)
            })
            .collect();
    }
    let names = form.coefficient_names().into_iter().enumerate();
    names
        .map(|(k, (quantity, unit))| {
            let effect = form.name();
            let unit = unit_at(form.slides(&problem.scene.arm.prismatic), unit);
            let name = format!("{effect}.{}.{quantity}", form.place.tag());
            let sigma = covariance[k * (count + 1)].max(0.0).sqrt();
            number(effect, name, unit, values[k], sigma)
        })
        .collect()
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
    /// kg, of the declared payload, and m, how far the arm reaches.
    declared: f64,
    reach: f64,
}

/// Which forms changed, as a problem of the one engine: its evidence is Schwarz's (1978), which is half of what they gain less their penalties.
impl Problem for StackedColumns {
    /// Number of the form.
    type Key = usize;
    type Fit = Vec<usize>;
    type Around = ();

    fn around(&self, _fit: &Vec<usize>, _before: Option<&()>) {}

    fn scan(&self, fit: &Vec<usize>, _around: &(), out: Option<usize>) -> Vec<Scanned<usize>> {
        let out = out.map(|member| fit[member]);
        let set = fit.iter().copied().filter(|form| Some(*form) != out);
        let now = self.with(&set.collect::<Vec<usize>>());
        let scanned = |form: usize| Scanned {
            accepted: self.accepted(form),
            log_odds: 0.5 * (now.square - now.with(&[form]).square - self.penalty(form)),
        };
        let others = (0..self.all.forms.len())
            .filter(|form| !fit.contains(form) && self.is_body(&now, *form));
        let mut all: Vec<Scanned<usize>> = others.map(scanned).collect();
        all.retain(|one| one.log_odds > 0.0);
        all.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        all
    }

    fn fit(
        &self,
        set: &[Accepted<usize>],
        _before: Option<&Vec<usize>>,
        _least: f64,
    ) -> Vec<usize> {
        set.iter().map(|one| one.cell.key).collect()
    }

    fn set(&self, fit: &Vec<usize>) -> Vec<Accepted<usize>> {
        fit.iter().map(|form| self.accepted(*form)).collect()
    }

    fn log_evidence(&self, fit: &Vec<usize>, _independence: f64) -> f64 {
        let penalties: f64 = fit.iter().map(|form| self.penalty(*form)).sum();
        -0.5 * (self.with(fit).square + penalties)
    }
}

impl StackedColumns {
    /// Of two problems whose columns are alike; both have the first `shared` forms.
    fn new(problems: &[TorqueProblem; 2], shared: usize) -> Self {
        let (n, arm) = (problems[0].joints(), problems[0].scene.arm);
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
        let bodies = carried(&problems[1]);
        let first_body = all.columns.len();
        let of_bodies: usize = bodies.iter().map(|(_, columns, _)| columns.len()).sum();
        let scales: Vec<f64> = bodies
            .iter()
            .flat_map(|(.., scale)| scale.clone())
            .collect();
        let bodies = bodies.into_iter().map(|(form, columns, _)| (form, columns));
        for (form, columns) in bodies.chain(forms) {
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
        // What bodies on an arm may be at most keeps what the data do not see from being any number.
        for (number, scale) in (first_body..first_body + of_bodies).zip(scales) {
            all.prior[number] += scale.powi(-2);
        }
        Self {
            all,
            weighted,
            measured: problems.each_ref().map(|one| one.measured.clone()).concat(),
            rows: problems[1].counted_rows(false),
            joints: n,
            declared: arm.payload.map_or(0.0, |payload| payload.mass),
            reach: reach(arm),
        }
    }

    /// A form as the engine has it.
    fn accepted(&self, form: usize) -> Accepted<usize> {
        let form_of = &self.all.forms[form];
        Accepted {
            cell: Cell {
                key: form,
                cause: Cause::named(form_of.name().to_string().into()),
                place: form_of.place.to_string(),
                log_prior: -0.5 * PRICE,
                shapes: Vec::new(),
                needs: Vec::new(),
            },
            shape: 0,
            numbers: Vec::new(),
        }
    }

    /// What gains more than its penalty is in, whatever else.
    fn options(&self) -> Options {
        Options {
            joins: 0.0,
            leaves: 0.0,
            most: self.all.forms.len(),
            regroups: false,
            ..Options::default()
        }
    }

    /// What a form must gain.
    fn penalty(&self, form: usize) -> f64 {
        let rows = [0, self.joints].map(|joint| self.weighted.measured[joint].len());
        let rows: usize = rows.iter().sum();
        let columns = self.all.of(form);
        let seen = columns.filter(|column| self.weighted.gram[*column][*column] > 0.0);
        PRICE + seen.count() as f64 * (rows as f64).ln() + 2.0 * (self.all.forms.len() as f64).ln()
    }

    /// Common numbers and some forms.
    fn with(&self, set: &[usize]) -> SweptColumns<'_> {
        SweptColumns::base(&self.all, &self.weighted).with(set)
    }

    /// What of a set is more than what the filter of the positions makes of friction in the second recording, Nm.
    fn clear(&self, set: Vec<usize>, problem: &TorqueProblem, moved: &[Vec<f64>]) -> Vec<usize> {
        let runs = problem.runs(false);
        let unmoved = self.weighted.measured[..self.joints].iter();
        let unmoved = unmoved.map(|course| vec![0.0; course.len()]);
        let moved = problem.weighing(&runs).measured(moved);
        let weighted = (self.weighted).with_measured(unmoved.chain(moved).collect());
        let made = SweptColumns::base(&self.all, &weighted)
            .with(&set)
            .solution();
        let solution = self.with(&set).solution();
        let square = |form: usize, solution: &[(usize, f64)]| -> f64 {
            let mut torques = self
                .measured
                .iter()
                .map(|course| vec![0.0; course.len()])
                .collect::<Vec<_>>();
            for column in self.all.of(form) {
                self.all.columns[column].add(value_of(solution, column), &mut torques);
            }
            torques.iter().flatten().map(|value| value * value).sum()
        };
        let is_clear =
            |form: &usize| square(*form, &solution) > NAMED.powi(2) * square(*form, &made);
        set.into_iter().filter(is_clear).collect()
    }

    /// What a form carries, if it does.
    fn carries(&self, form: usize) -> Option<Carried> {
        Carried::of(&self.all.forms[form])
    }

    /// Whether the numbers that a form would have are those of a body, where it is one: as far as they are seen.
    fn is_body(&self, now: &SweptColumns, form: usize) -> bool {
        let Some(what) = self.carries(form) else {
            return true;
        };
        let fit = now.with(&[form]);
        let (solution, columns) = (fit.solution(), self.all.of(form));
        let number = |column: usize| FittedNumber {
            value: value_of(&solution, column),
            sigma: fit.sigma(column),
        };
        let numbers: Vec<FittedNumber> = columns.map(number).collect();
        let form = &self.all.forms[form];
        match what {
            Carried::OnLink => {
                let seen = numbers.iter().map(|number| match number.is_seen() {
                    true => number.value,
                    false => 0.0,
                });
                (form.cause.is_possible)(form, &seen.collect::<Vec<f64>>())
            }
            // No mass is farther out than the arm reaches.
            Carried::OnTool => {
                let most = self.declared + numbers[0].value.abs() + 3.0 * numbers[0].sigma;
                let moment = |number: &FittedNumber| number.value.abs() - 3.0 * number.sigma;
                numbers[1..4]
                    .iter()
                    .all(|one| moment(one) < most * self.reach)
            }
        }
    }

    /// Other places where what a form carries would explain the data as well, with their probability among all places.
    fn rivals(&self, set: &[usize], form: usize) -> Vec<(Place, f64)> {
        if Carried::of(&self.all.forms[form]).is_none() {
            return Vec::new();
        }
        let others: Vec<usize> = set.iter().copied().filter(|one| *one != form).collect();
        let without = self.with(&others);
        let is_other = |one: &usize| {
            *one != form
                && !set.contains(one)
                && Carried::of(&self.all.forms[*one]).is_some()
                && self.is_body(&without, *one)
        };
        let criterion = |one: usize| without.with(&[one]).square + self.penalty(one);
        let here = criterion(form);
        let odds = |one: usize| ((here - criterion(one)) / (2.0 * TEMPERATURE)).exp();
        let all: Vec<(Place, f64)> = (0..self.all.forms.len())
            .filter(is_other)
            .map(|one| (self.all.forms[one].place, odds(one)))
            .collect();
        let whole = 1.0 + all.iter().map(|(_, odds)| odds).sum::<f64>();
        let shares = all.into_iter().map(|(place, odds)| (place, odds / whole));
        let mut rivals: Vec<(Place, f64)> = shares.filter(|(_, share)| *share > NOTABLE).collect();
        rivals.sort_by(|a, b| b.1.total_cmp(&a.1));
        rivals
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
