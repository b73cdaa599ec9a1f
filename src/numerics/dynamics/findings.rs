//! What was found in words and numbers (sizes, evidence, rivals, probabilities), and as one model with its covariance.

use super::arm::INERTIAL_NUMBERS;
use super::cause::{
    COULOMB, FittedNumber, TorqueForm, TorqueParameter, VISCOUS, line_of_power, plain, shape, slope,
};
use super::cells::{CauseChoice, TorqueTable, all_but};
use super::model::{COVERAGE, JointRange, TorqueModel, TorqueTerm};
use super::problem::TorqueProblem;
use super::recording::{ends, largest};
use super::refine::{ShapeNumber, ShapeSlopes};
use super::sliding::unit_of;
use super::sweep::{SweptColumns, value_of};
use super::types::{ContactEvent, TorqueFinding};
use crate::criteria::cells::{MISLED, RIVAL};
use crate::diagnose::{Evidence, Probabilities, RivalCause};
use crate::effect::Place;
use crate::estimate::tail;
use crate::statistics::nearest;
use calib_engine::log_sum;
use std::borrow::Cow;

/// A set fitted with the base, and what is not known of its numbers.
pub(super) struct FittedSet<'a> {
    pub(crate) choice: &'a CauseChoice<'a>,
    pub(crate) set: &'a [usize],
    pub(crate) sweep: SweptColumns<'a>,
    /// Coefficients.
    pub(crate) solution: Vec<(usize, f64)>,
    /// With numbers of shapes: for covariances.
    pub(crate) uncertain: SweptColumns<'a>,
    slopes: &'a ShapeSlopes,
}

impl<'a> FittedSet<'a> {
    /// The fit of a set.
    pub(crate) fn of(
        choice: &'a CauseChoice<'a>,
        set: &'a [usize],
        slopes: &'a ShapeSlopes,
    ) -> Self {
        let sweep = choice.base.with(set);
        Self {
            choice,
            set,
            solution: sweep.solution(),
            uncertain: slopes.with_slopes(&sweep),
            sweep,
            slopes,
        }
    }

    /// Findings of the set but for what is silent, strongest first. A name that the data exclude by others of its place is none; the common
    /// frictions are parts of sums.
    pub(crate) fn findings(&self, silent: &[usize], held_out: &[usize]) -> Vec<TorqueFinding> {
        let choice = self.choice;
        let is_silent = |form: &TorqueForm| {
            let mut silent = silent.iter();
            silent.any(|one| choice.form(*one).is_called_as(form))
        };
        let mut table = TorqueTable::new(choice);
        // What stands was decided under the noise of the whole search.
        table.kept = self.set.to_vec();
        let found = table.findings(self.set).into_iter();
        let found = found.filter(|(number, _)| !is_silent(choice.form(*number)));
        let found = found.map(|(number, one)| {
            let mut finding = self.finding(number, held_out);
            finding.evidence.delta_bic = 2.0 * (one.log_odds - table.log_prior(number));
            let rivals = one.rivals.iter().map(|rival| {
                let cell = &table.cells[rival.accepted.cell.key];
                (
                    (cell.name.clone(), cell.place),
                    one.log_odds + rival.log_odds,
                )
            });
            weighed(finding, (one.log_odds, rivals.collect()))
        });
        let is_named = |finding: &TorqueFinding| {
            [VISCOUS, COULOMB].contains(&&*finding.effect) || finding.probabilities.name >= *RIVAL
        };
        let mut found: Vec<TorqueFinding> = found.filter(is_named).collect();
        found.sort_by(|a, b| b.evidence.gain.total_cmp(&a.evidence.gain));
        found
    }

    fn finding(&self, number: usize, held_out: &[usize]) -> TorqueFinding {
        let (problem, form) = (self.choice.problem, self.choice.form(number));
        let fitted = self.fitted(number);
        let loss = self.sweep.loss(number, &self.solution);
        let rank = loss.rank.max(1) as f64;
        // Tolerances bend to take the place of a wrong mass, at their price: its size is what the rest leaves as it is.
        let left_without = match form.cause.inertial {
            true => {
                let columns = problem.all.of(number);
                let others = self.solution.iter().copied();
                others
                    .filter(|(column, _)| !columns.contains(column))
                    .collect()
            }
            false => self.choice.base.with(&all_but(self.set, number)).solution(),
        };
        let gain = || held_out_gain(problem, &left_without, &self.solution, held_out);
        let unit = unit_of(form.slides(&problem.scene.arm.prismatic));
        let mut parameters = (form.cause.parameters)(form, &fitted);
        for parameter in &mut parameters {
            parameter.unit = unit(parameter.unit);
        }
        for span in form.shape_numbers() {
            if let Some(entry) = parameters.iter_mut().find(|one| one.name == span.name) {
                entry.sigma = self.slopes.sigma(&self.uncertain, number, span.index);
            }
        }
        TorqueFinding {
            effect: Cow::Owned(form.name().into()),
            place: form.place,
            follows: (form.cause.follows)(form),
            statement: (form.cause.statement)(form, &fitted, unit),
            parameters,
            evidence: Evidence {
                delta_bic: loss.square - rank * (self.choice.weighted.rows as f64).ln(),
                heldout_gain: (!held_out.is_empty()).then(gain),
                effect_rms: problem.rms_of(number, &self.solution),
                ..evidence(loss.square, rank)
            },
            rivals: Vec::new(),
            probabilities: Probabilities::default(),
        }
    }

    /// Coefficients of a form with their standard deviations; of viscous and Coulomb friction where speed enters by another power than the
    /// first, the number of the straight line of both together.
    fn fitted(&self, number: usize) -> Vec<FittedNumber> {
        if let Some(line) = self.number_of_line(number) {
            return vec![line];
        }
        let columns: Vec<usize> = self.choice.problem.all.of(number).collect();
        let covariance = self.uncertain.covariance(&columns);
        let of_place = |(place, column): (usize, &usize)| FittedNumber {
            value: value_of(&self.solution, *column),
            sigma: covariance[place * (columns.len() + 1)].max(0.0).sqrt(),
        };
        columns.iter().enumerate().map(of_place).collect()
    }

    /// The number of viscous or Coulomb friction that is of the line; none where speed enters by its first power.
    fn number_of_line(&self, number: usize) -> Option<FittedNumber> {
        let (all, form) = (&self.choice.problem.all, self.choice.form(number));
        if !form.cause.brakes {
            return None;
        }
        let mut set = self.set.iter().copied();
        let power = set.find(|candidate| {
            let form_there = self.choice.form(*candidate);
            form_there.is_called(VISCOUS, form.place) && !form_there.shape_numbers().is_empty()
        })?;
        let exponent = self.choice.form(power).shape[0];
        let fastest = largest(&self.choice.problem.scene.velocity[form.joint()]);
        let (column, is_viscous) = (all.of(power).start, form.name() == VISCOUS);
        let of_exponent = |exponent: f64| line_of_power(exponent, fastest)[usize::from(is_viscous)];
        let mut along = vec![(column, of_exponent(exponent))];
        if !is_viscous {
            along.push((all.of(number).start, 1.0));
        }
        let parts = along.iter();
        let value = parts
            .map(|(column, share)| share * value_of(&self.solution, *column))
            .sum();
        if let Some(term) = self.slopes.column(ShapeNumber::Of(power, 0)) {
            let size = value_of(&self.solution, column);
            along.push((term, size * slope(exponent, of_exponent)));
        }
        let (columns, shares): (Vec<usize>, Vec<f64>) = along.into_iter().unzip();
        Some(FittedNumber {
            value,
            sigma: sigma_of(&shares, &self.uncertain.covariance(&columns)),
        })
    }
}

/// Standard deviation of a sum of shares of numbers, by their covariance.
pub(super) fn sigma_of(shares: &[f64], covariance: &[f64]) -> f64 {
    let count = shares.len();
    let entries = covariance.iter().enumerate();
    let parts = entries.map(|(at, entry)| shares[at / count] * shares[at % count] * entry);
    parts.sum::<f64>().max(0.0).sqrt()
}

/// Residual rows of a test, at most: beyond it the tail does not change.
const FREEDOM: f64 = 1e4;

/// The weight in the data of what gains so much by so many numbers.
fn evidence(gain: f64, numbers: f64) -> Evidence {
    Evidence {
        gain,
        f_statistic: gain / numbers,
        p_value: tail(gain / numbers, numbers, FREEDOM),
        delta_bic: gain - numbers * FREEDOM.ln(),
        heldout_gain: None,
        effect_rms: 0.0,
    }
}

/// ln of posterior odds, and those of rivals.
type CellOdds = (f64, Vec<((Cow<'static, str>, Place), f64)>);

/// A finding with its probabilities: those of its name, of all that could stand in its place, and of nothing.
fn weighed(mut finding: TorqueFinding, (log_odds, rivals): CellOdds) -> TorqueFinding {
    let logs = rivals.iter().map(|(_, log)| *log).chain([log_odds, 0.0]);
    let whole = log_sum(&logs.collect::<Vec<_>>());
    let share = |log: f64| (1.0 - *MISLED) * (log - whole).exp();
    let mut here = share(log_odds);
    for ((effect, place), log) in rivals {
        let probability = share(log);
        if place == finding.place {
            here += probability;
        }
        if (&effect, place) != (&finding.effect, finding.place) && probability > *RIVAL {
            finding.rivals.push(RivalCause {
                effect,
                place,
                delta_bic: 2.0 * (log_odds - log),
                probability,
            });
        }
    }
    finding
        .rivals
        .sort_by(|a, b| b.probability.total_cmp(&a.probability));
    finding.probabilities = Probabilities::new(share(log_odds), here, share(0.0) + *MISLED);
    finding
}

/// Fall of the rms of held-out rows, Nm, over all joints.
fn held_out_gain(
    problem: &TorqueProblem,
    without: &[(usize, f64)],
    solution: &[(usize, f64)],
    rows: &[usize],
) -> f64 {
    let rms = |solution: &[(usize, f64)]| {
        let residual = problem.residual(solution);
        let courses = residual.iter();
        let squares = courses.flat_map(|course| rows.iter().map(|row| course[*row].powi(2)));
        (squares.sum::<f64>() / (rows.len() * residual.len()) as f64).sqrt()
    };
    rms(without) - rms(solution)
}

/// A finding of a time that has no rivals in the pool: a latency, a contact.
pub(super) fn plain_finding(
    effect: &'static str,
    place: Place,
    statement: String,
    parameters: Vec<TorqueParameter>,
    gain: f64,
    columns: f64,
) -> TorqueFinding {
    let finding = TorqueFinding {
        effect: effect.into(),
        place,
        follows: "time",
        statement,
        parameters,
        evidence: evidence(gain, columns),
        rivals: Vec::new(),
        probabilities: Probabilities::default(),
    };
    weighed(finding, (0.5 * gain, Vec::new()))
}

/// A push on the arm.
pub(super) fn contact(event: &ContactEvent) -> TorqueFinding {
    let joints = event.joints.iter().map(|joint| (joint + 1).to_string());
    let squares = event.force.iter().map(|force| force * force);
    let mut parameters = vec![
        shape("start", event.start, "s"),
        shape("end", event.end, "s"),
    ];
    for (axis, name) in ["force_x", "force_y", "force_z"].iter().enumerate() {
        let [value, sigma] = [event.force[axis], event.sigma[axis]];
        parameters.push(plain(name, FittedNumber { value, sigma }, "N"));
    }
    let statement = format!(
        "something touches the arm from {:.1} s to {:.1} s, most at joints {}: as {:.0} N at the tool would",
        event.start,
        event.end,
        joints.collect::<Vec<_>>().join(" and "),
        squares.sum::<f64>().sqrt()
    );
    plain_finding(
        super::CONTACT,
        Place::Arm,
        statement,
        parameters,
        event.gain,
        3.0,
    )
}

/// Judged rows at which the usual uncertainty is asked, at most.
const ASKED: usize = 300;

impl FittedSet<'_> {
    /// The model of the set with some coefficients.
    pub(crate) fn model(&self, solution: &[(usize, f64)]) -> TorqueModel {
        let Self { choice, set, .. } = *self;
        let problem = choice.problem;
        let adds = |number: &usize| choice.form(*number).inertial(&problem.scene).is_none();
        let adding: Vec<usize> = set.iter().copied().filter(adds).collect();
        let term = |number: &usize| {
            let form = choice.form(*number);
            TorqueTerm {
                effect: form.name().into(),
                declared: form.law.as_deref().cloned(),
                place: form.place,
                with: form.with,
                shape: form.shape.clone(),
                coefficients: problem.coefficients(*number, solution),
                rms: problem.rms_of(*number, solution),
            }
        };
        let (identified, covariance) = self.covariance(&adding);
        let mut inertials = problem.inertials(set, solution);
        for (number, known) in inertials.iter_mut().zip(&identified) {
            *number = if *known { *number } else { 0.0 };
        }
        let certainty = self.certainty(solution).into_iter().enumerate();
        TorqueModel {
            inertials,
            identified,
            terms: adding.iter().map(term).collect(),
            covariance,
            sign_width: problem.scene.sign_width,
            friction_lead: problem.scene.friction_lead,
            latency: problem.latency,
            cutoff: problem.reduction.cutoff,
            range: certainty
                .map(|(joint, [misfit, usual])| range(problem, joint, misfit, usual))
                .collect(),
            temperature: problem.temperature,
        }
    }

    /// What held-out rows (fitted ones where none are) of each joint leave beyond noise and the covariance of the numbers, Nm, one standard
    /// deviation, and the median of the torque's uncertainty (95 %).
    fn certainty(&self, solution: &[(usize, f64)]) -> Vec<[f64; 2]> {
        let problem = self.choice.problem;
        let mut columns = problem.all.with_base(self.set);
        columns.extend(self.slopes.columns());
        let (all, width) = (self.uncertain.covariance(&columns), columns.len());
        let residual = problem.residual(solution);
        let rows = problem.judging_rows();
        let of_joint = |joint: usize| {
            let course = |(place, column): (usize, &usize)| {
                Some((place, problem.all.columns[*column].at(joint)?))
            };
            let acting: Vec<(usize, &[f64])> =
                columns.iter().enumerate().filter_map(course).collect();
            let variance = |row: &usize| {
                let each = |(a, first): &(usize, &[f64])| {
                    let with = acting
                        .iter()
                        .map(|(b, second)| all[a * width + b] * second[*row])
                        .sum::<f64>();
                    first[*row] * with
                };
                acting.iter().map(each).sum::<f64>().max(0.0)
            };
            let asked = rows.iter().step_by(rows.len().div_ceil(ASKED).max(1));
            let asked: Vec<f64> = asked.map(variance).collect();
            let squares = rows.iter().map(|row| residual[joint][*row].powi(2));
            let left = squares.sum::<f64>() / rows.len().max(1) as f64;
            let by_numbers = asked.iter().sum::<f64>() / asked.len().max(1) as f64;
            let misfit = (left - problem.noise[joint].sigma.powi(2) - by_numbers).max(0.0);
            let usual = asked
                .iter()
                .map(|variance| COVERAGE * (variance + misfit).sqrt());
            let mut usual: Vec<f64> = usual.collect();
            [misfit.sqrt(), nearest(&mut usual, 0.5).unwrap_or(0.0)]
        };
        (0..problem.joints()).map(of_joint).collect()
    }

    /// Which inertial numbers are identified, and the covariance of these, of the coefficients of `adding` and of the numbers of shapes.
    fn covariance(&self, adding: &[usize]) -> (Vec<bool>, Vec<f64>) {
        let problem = self.choice.problem;
        let mut columns: Vec<usize> = Vec::new();
        // Each number of the model as a sum of coefficients: position in `columns`, and share.
        let mut sums: Vec<Vec<(usize, f64)>> = Vec::new();
        let mut identified = Vec::with_capacity(INERTIAL_NUMBERS * problem.joints());
        for link in 0..problem.joints() {
            let changes = problem.inertial_changes(self.set, link);
            let first = columns.len();
            columns.extend(changes.iter().map(|(column, _)| *column));
            for number in 0..INERTIAL_NUMBERS {
                let shares = (first..).zip(&changes);
                let shares = shares.map(|(place, (_, ten))| (place, ten[number]));
                let shares: Vec<(usize, f64)> = shares.filter(|(_, share)| *share != 0.0).collect();
                let known = problem.scene.declared.is_some() || !shares.is_empty();
                identified.push(known);
                if known {
                    sums.push(shares);
                }
            }
        }
        let of_forms = adding.iter().flat_map(|number| problem.all.of(*number));
        for column in of_forms.chain(self.slopes.columns()) {
            sums.push(vec![(columns.len(), 1.0)]);
            columns.push(column);
        }
        let (all, width) = (self.uncertain.covariance(&columns), columns.len());
        let entry = |a: &[(usize, f64)], b: &[(usize, f64)]| -> f64 {
            let of_row = |(row, left): &(usize, f64)| {
                let parts = b
                    .iter()
                    .map(|(column, right)| right * all[row * width + column]);
                left * parts.sum::<f64>()
            };
            a.iter().map(of_row).sum()
        };
        let pairs = sums
            .iter()
            .flat_map(|a| sums.iter().map(move |b| entry(a, b)));
        (identified, pairs.collect())
    }
}

/// What the judged rows visited at a joint.
fn range(problem: &TorqueProblem, joint: usize, misfit: f64, usual: f64) -> JointRange {
    let rows = || {
        let judged = problem.reduction.rows.iter().enumerate();
        let counted = judged.filter(|(row, _)| !problem.in_event(*row));
        counted.map(|(_, row)| *row)
    };
    let most = |course: &[f64]| largest(rows().map(|row| &course[row]));
    let position = &problem.scene.position[joint];
    JointRange {
        position: ends(rows().map(|row| position[row])),
        speed: most(&problem.scene.velocity[joint]),
        acceleration: most(&problem.scene.acceleration[joint]),
        load: most(&problem.scene.rigid[joint]),
        misfit,
        usual,
        sign_width: problem.scene.width_at(joint),
        slides: problem.scene.arm.prismatic[joint],
    }
}
