//! What was found in words and numbers: sizes, evidence, rivals, probabilities.
//!
//! A number at an end of its search would be better beyond it: such forms leave the set.

use crate::cause::{COULOMB, FittedNumber, TorqueForm, TorqueParameter, VISCOUS, line_of_power};
use crate::cells::{CellOdds, TorqueTable};
use crate::choice::CauseChoice;
use crate::criteria::cells::{MISLED, RIVAL};
use crate::diagnose::table::log_sum;
use crate::diagnose::{Evidence, Probabilities, RivalCause};
use crate::effect::Place;
use crate::estimate::tail;
use crate::problem::TorqueProblem;
use crate::refine::push;
use crate::scene::largest;
use crate::shape_slopes::{ShapeNumber, ShapeSlopes, slope};
use crate::sweep::{SweptColumns, value_of};
use crate::types::{ContactEvent, TorqueFinding};
use crate::weighted::WeightedColumns;

/// Residual rows of a test, at most: beyond it the tail does not change.
const FREEDOM: f64 = 1e4;

/// Findings of a set but for what is silent, strongest first. A name that the data exclude by others of its place is none; the common
/// frictions are parts of sums.
pub(super) fn findings(
    choice: &CauseChoice,
    (set, silent): (&[usize], &[usize]),
    held_out: &[usize],
    uncertain: (&SweptColumns, &ShapeSlopes),
) -> Vec<TorqueFinding> {
    let sweep = choice.base.with(set);
    let solution = sweep.solution();
    let named = set.iter().filter(|number| {
        silent
            .iter()
            .all(|one| !choice.form(*one).is_called_as(choice.form(**number)))
    });
    let table = TorqueTable::new(choice);
    let components = table.components(set);
    let mut found: Vec<TorqueFinding> = named
        .map(|number| {
            let odds = table.odds_in_place(&components, *number);
            weighed(
                finding(
                    choice,
                    set,
                    (&sweep, &solution),
                    *number,
                    held_out,
                    uncertain,
                ),
                odds,
            )
        })
        .filter(|finding| {
            finding.effect == VISCOUS
                || finding.effect == COULOMB
                || finding.probabilities.name >= *RIVAL
        })
        .collect();
    found.sort_by(|a, b| b.evidence.gain.total_cmp(&a.evidence.gain));
    found
}

fn finding(
    choice: &CauseChoice,
    set: &[usize],
    (sweep, solution): (&SweptColumns, &[(usize, f64)]),
    number: usize,
    held_out: &[usize],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
) -> TorqueFinding {
    let (problem, form) = (choice.problem, choice.form(number));
    let fitted = fitted(choice, set, number, solution, (uncertain, slopes));
    let others: Vec<usize> = set
        .iter()
        .copied()
        .filter(|other| *other != number)
        .collect();
    let without = choice.base.with(&others);
    let loss = sweep.loss(number, solution);
    let rank = loss.rank.max(1) as f64;
    let delta_bic = loss.square - rank * (choice.weighted.rows as f64).ln();
    // Tolerances bend to take the place of a wrong mass, at their price: its size is what the rest leaves as it is.
    let left_without: Vec<(usize, f64)> = match form.cause.inertial {
        true => solution
            .iter()
            .copied()
            .filter(|(column, _)| !problem.all.of(number).contains(column))
            .collect(),
        false => without.solution(),
    };
    TorqueFinding {
        effect: form.cause.name,
        place: form.place,
        statement: (form.cause.statement)(form, &fitted),
        parameters: with_shapes((form.cause.parameters)(form, &fitted), form, |index| {
            slopes.sigma(uncertain, number, index)
        }),
        evidence: Evidence {
            gain: loss.square,
            f_statistic: loss.square / rank,
            p_value: tail(loss.square / rank, rank, FREEDOM),
            delta_bic,
            heldout_gain: (!held_out.is_empty())
                .then(|| held_out_gain(problem, &left_without, solution, held_out)),
            effect_rms: problem.rms_of(number, solution),
        },
        rivals: Vec::new(),
        probabilities: Probabilities::default(),
    }
}

/// A finding with its probabilities: those of its name, of all that could stand in its place, and of nothing.
fn weighed(mut finding: TorqueFinding, CellOdds { log_odds, rivals }: CellOdds) -> TorqueFinding {
    let whole = log_sum(
        &rivals
            .iter()
            .map(|(_, log)| *log)
            .chain([log_odds, 0.0])
            .collect::<Vec<_>>(),
    );
    let share = |log: f64| (1.0 - *MISLED) * (log - whole).exp();
    let mut here = share(log_odds);
    for ((effect, place), log) in rivals {
        let probability = share(log);
        here += if place == finding.place {
            probability
        } else {
            0.0
        };
        if (effect, place) != (finding.effect, finding.place) && probability > *RIVAL {
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
    finding.probabilities = Probabilities {
        name: share(log_odds),
        place: here,
        none: share(0.0) + *MISLED,
    };
    finding
}

/// Parameters with the standard deviations of shape numbers.
fn with_shapes(
    mut all: Vec<TorqueParameter>,
    form: &TorqueForm,
    sigma: impl Fn(usize) -> Option<f64>,
) -> Vec<TorqueParameter> {
    for span in form.shape_numbers() {
        let entry = all.iter_mut().find(|parameter| parameter.name == span.name);
        entry
            .into_iter()
            .for_each(|parameter| parameter.sigma = sigma(span.index));
    }
    all
}

/// Fall of the rms of held-out rows, Nm, over all joints.
fn held_out_gain(
    problem: &TorqueProblem,
    without: &[(usize, f64)],
    solution: &[(usize, f64)],
    rows: &[usize],
) -> f64 {
    let rms = |residual: &[Vec<f64>]| {
        let square: f64 = residual
            .iter()
            .flat_map(|course| rows.iter().map(|row| course[*row].powi(2)))
            .sum();
        (square / (rows.len() * residual.len()) as f64).sqrt()
    };
    rms(&problem.residual(without)) - rms(&problem.residual(solution))
}

/// A finding that has no rivals in the pool: a latency, a contact.
pub(super) fn plain_finding(
    effect: &'static str,
    place: Place,
    statement: String,
    parameters: Vec<TorqueParameter>,
    gain: f64,
    columns: f64,
) -> TorqueFinding {
    let finding = TorqueFinding {
        effect,
        place,
        statement,
        parameters,
        evidence: Evidence {
            gain,
            f_statistic: gain / columns,
            p_value: tail(gain / columns, columns, FREEDOM),
            delta_bic: gain - columns * FREEDOM.ln(),
            heldout_gain: None,
            effect_rms: 0.0,
        },
        rivals: Vec::new(),
        probabilities: Probabilities::default(),
    };
    weighed(
        finding,
        CellOdds {
            log_odds: 0.5 * gain,
            rivals: Vec::new(),
        },
    )
}

/// A push on the arm.
pub(super) fn contact(event: &ContactEvent) -> TorqueFinding {
    let joints: Vec<String> = event
        .joints
        .iter()
        .map(|joint| (joint + 1).to_string())
        .collect();
    let size = event
        .force
        .iter()
        .map(|force| force * force)
        .sum::<f64>()
        .sqrt();
    let number = |name: &str, value: f64, unit: &'static str, sigma: Option<f64>| TorqueParameter {
        name: name.into(),
        value,
        unit,
        sigma,
    };
    let mut parameters = vec![
        number("start", event.start, "s", None),
        number("end", event.end, "s", None),
    ];
    for (axis, name) in ["force_x", "force_y", "force_z"].iter().enumerate() {
        parameters.push(number(
            name,
            event.force[axis],
            "N",
            Some(event.sigma[axis]),
        ));
    }
    let statement = format!(
        "something touches the arm from {:.1} s to {:.1} s, most at joints {}: as {size:.0} N at the tool would",
        event.start,
        event.end,
        joints.join(" and ")
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

/// Takes forms with a number at an end of its search out of a set, and their causes out of the search at their places; tells whether any was.
pub(super) fn take_out_ends(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut Vec<usize>,
) -> bool {
    let before = set.clone();
    for number in before.iter().copied() {
        let form = problem.all.forms[number].clone();
        let place = set.iter().position(|other| *other == number);
        match (form.within_ends(), place) {
            (Some(within), Some(place)) if within.shape != form.shape => {
                set[place] = push(problem, weighted, within);
            }
            (None, Some(place)) => {
                set.remove(place);
                problem.barred.push(form);
            }
            _ => (),
        }
    }
    before != *set
}

/// Coefficients of a form with their standard deviations; of viscous and Coulomb friction where speed enters by another power than the first,
/// the number of the straight line of both together.
pub(super) fn fitted(
    choice: &CauseChoice,
    set: &[usize],
    number: usize,
    solution: &[(usize, f64)],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
) -> Vec<FittedNumber> {
    if let Some(line) = number_of_line(choice, set, number, solution, (uncertain, slopes)) {
        return vec![line];
    }
    let columns: Vec<usize> = choice.problem.all.of(number).collect();
    let covariance = uncertain.covariance(&columns);
    let of_place = |(place, column): (usize, &usize)| FittedNumber {
        value: value_of(solution, *column),
        sigma: covariance[place * (columns.len() + 1)].max(0.0).sqrt(),
    };
    columns.iter().enumerate().map(of_place).collect()
}

/// The number of viscous or Coulomb friction in a set that is of the line; none where speed enters by its first power.
fn number_of_line(
    choice: &CauseChoice,
    set: &[usize],
    number: usize,
    solution: &[(usize, f64)],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
) -> Option<FittedNumber> {
    let (all, form) = (&choice.problem.all, choice.form(number));
    if !form.cause.brakes {
        return None;
    }
    let is_power = |other: &TorqueForm| {
        other.place == form.place
            && other.cause.name == VISCOUS
            && !other.shape_numbers().is_empty()
    };
    let power = *set
        .iter()
        .find(|candidate| is_power(choice.form(**candidate)))?;
    let exponent = choice.form(power).shape[0];
    let fastest = largest(&choice.problem.scene.velocity[form.joint()]);
    let (column, is_viscous) = (all.of(power).start, form.cause.name == VISCOUS);
    let of_exponent = |exponent: f64| line_of_power(exponent, fastest)[usize::from(is_viscous)];
    let mut along = vec![(column, of_exponent(exponent))];
    if !is_viscous {
        along.push((all.of(number).start, 1.0));
    }
    let shape = slopes
        .0
        .iter()
        .find(|(known, _)| *known == ShapeNumber::Of(power, 0));
    let line = along
        .iter()
        .map(|(column, share)| share * value_of(solution, *column))
        .sum();
    along.extend(shape.map(|(_, term)| {
        (
            *term,
            value_of(solution, column) * slope(exponent, of_exponent),
        )
    }));
    let columns: Vec<usize> = along.iter().map(|(column, _)| *column).collect();
    let covariance = uncertain.covariance(&columns);
    let pairs = (0..along.len()).flat_map(|a| (0..along.len()).map(move |b| (a, b)));
    let variance: f64 = pairs
        .map(|(a, b)| along[a].1 * along[b].1 * covariance[a * along.len() + b])
        .sum();
    Some(FittedNumber {
        value: line,
        sigma: variance.max(0.0).sqrt(),
    })
}
