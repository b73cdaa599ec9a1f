//! What was found in words and numbers: sizes, evidence, rivals, probabilities.
//!
//! What of a set is named. A number at an end of its search would be better beyond it, friction that drives is none, and what is less than
//! two standard deviations may as well be nothing: such forms leave the set, or stay as parts of a sum without a name.

use crate::cause::{
    COULOMB, FittedNumber, TorqueForm, TorqueParameter, UNKNOWN, VISCOUS, line_of_power,
};
use crate::cells::{CellOdds, TorqueTable};
use crate::choice::CauseChoice;
use crate::criteria::cells::{MISLED, RIVAL};
use crate::criteria::torque::NAMED;
use crate::diagnose::table::log_sum;
use crate::diagnose::{Evidence, Probabilities, RivalCause};
use crate::effect::Place;
use crate::estimate::tail;
use crate::judge::OtherInertials;
use crate::problem::TorqueProblem;
use crate::refine::{polish, push};
use crate::scene::largest;
use crate::shape_slopes::{ShapeNumber, ShapeSlopes, slope};
use crate::sweep::{SweptColumns, value_of};
use crate::types::{ContactEvent, TorqueFinding};
use crate::weighted::WeightedColumns;

/// Residual rows of a test, at most: beyond it the tail does not change.
const FREEDOM: f64 = 1e4;

/// Findings of a judged set but for what is silent, strongest first. A name that the data exclude by others of its place is none; the common
/// frictions are parts of sums.
pub(super) fn findings(
    choice: &CauseChoice,
    JudgedSet { set, silent, .. }: &JudgedSet,
    held_out: &[usize],
    uncertain: (&SweptColumns, &ShapeSlopes),
    other: Option<&OtherInertials>,
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
            let mut odds = table.odds_in_place(&components, *number);
            let other = other.filter(|_| choice.form(*number).cause.inertial);
            odds.rivals.extend(
                other
                    .into_iter()
                    .flat_map(|other| other.rivals(choice, odds.own)),
            );
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
    let rest: Vec<usize> = set
        .iter()
        .copied()
        .filter(|other| *other != number)
        .collect();
    let without = choice.base.with(&rest);
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
fn weighed(mut finding: TorqueFinding, CellOdds { own, rivals }: CellOdds) -> TorqueFinding {
    let whole = log_sum(
        &rivals
            .iter()
            .map(|(_, log)| *log)
            .chain([own, 0.0])
            .collect::<Vec<_>>(),
    );
    let share = |log: f64| (1.0 - *MISLED) * (log - whole).exp();
    let mut here = share(own);
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
                delta_bic: 2.0 * (own - log),
                probability,
            });
        }
    }
    finding
        .rivals
        .sort_by(|a, b| b.probability.total_cmp(&a.probability));
    finding.probabilities = Probabilities {
        name: share(own),
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
        let own = all.iter_mut().find(|parameter| parameter.name == span.name);
        own.into_iter()
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
            own: 0.5 * gain,
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

/// Forms that lose their name one after the other, at most.
const ROUNDS: usize = 40;

/// What explains a recording.
#[derive(Default)]
pub(super) struct JudgedSet {
    pub(crate) set: Vec<usize>,
    /// What of the set is part of the model, but too little to be named.
    pub(crate) silent: Vec<usize>,
    /// What cross-validation did not confirm, with what left-out rows gained by each.
    pub(crate) withdrawn: Vec<(usize, f64)>,
}

/// What becomes of a form.
enum NotNamed {
    /// At a position of the set: it leaves.
    Out(usize),
    /// It stays in the model without a name.
    Silent(usize),
    /// Numbers at an end are what they usually are.
    Within(usize, TorqueForm),
}

/// Takes forms with a number at an end of its search out of a set, and their causes out of the search at their places; tells whether any was.
pub(super) fn take_out_ends(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut Vec<usize>,
) -> bool {
    let mut changed = false;
    while let Some(one) = at_end(problem, set) {
        changed = true;
        match one {
            NotNamed::Within(place, form) => set[place] = push(problem, weighted, form),
            NotNamed::Out(place) | NotNamed::Silent(place) => {
                let form = problem.all.forms[set.remove(place)].clone();
                problem.barred.push(form);
            }
        }
    }
    changed
}

/// The first form of a set with a number at an end.
fn at_end(problem: &TorqueProblem, set: &[usize]) -> Option<NotNamed> {
    set.iter().enumerate().find_map(|(place, number)| {
        let form = &problem.all.forms[*number];
        match form.within_ends() {
            None => Some(NotNamed::Out(place)),
            Some(within) => (within.shape != form.shape).then_some(NotNamed::Within(place, within)),
        }
    })
}

/// Takes names off until all that are left are right.
pub(super) fn settle_names(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    judged: &mut JudgedSet,
) {
    for _ in 0..ROUNDS {
        let slopes = ShapeSlopes::of(problem, weighted, &judged.set);
        let next = at_end(problem, &judged.set)
            .or_else(|| next(&CauseChoice::new(problem, weighted), judged, &slopes));
        match next {
            None => return,
            Some(NotNamed::Silent(place)) => {
                judged.silent.push(judged.set[place]);
                continue;
            }
            Some(NotNamed::Out(place)) => _ = judged.set.remove(place),
            Some(NotNamed::Within(place, form)) => {
                judged.set[place] = push(problem, weighted, form)
            }
        }
        polish(problem, weighted, &mut judged.set);
    }
}

/// The form with the least right to its name.
fn next(choice: &CauseChoice, judged: &JudgedSet, slopes: &ShapeSlopes) -> Option<NotNamed> {
    let set = &judged.set;
    let sweep = choice.base.with(set);
    let solution = sweep.solution();
    let uncertain = slopes.with_slopes(&sweep);
    let named = |place: &usize| {
        let form = choice.form(set[*place]);
        form.cause.name != UNKNOWN
            && !judged
                .silent
                .iter()
                .any(|silent| choice.form(*silent).is_called_as(form))
    };
    // The largest of its numbers in standard deviations, with its sign.
    let sure = |place: usize| {
        let numbers = fitted(choice, set, set[place], &solution, (&uncertain, slopes));
        let over = numbers
            .iter()
            .map(|number| number.value / number.sigma.max(f64::MIN_POSITIVE));
        over.max_by(|a, b| a.abs().total_cmp(&b.abs()))
            .unwrap_or(0.0)
    };
    let wrong = |place: usize, sure: f64| choice.form(set[place]).cause.brakes && sure <= 0.0;
    let weak = (0..set.len())
        .filter(named)
        .map(|place| (place, sure(place)));
    let weak = weak.filter(|(place, sure)| sure.abs() < *NAMED || wrong(*place, *sure));
    let (place, sure) = weak.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let form = choice.form(set[place]);
    // Numbers of many waves are uncertain one by one where few of them are not.
    if let Some(plainer) = choice
        .plainer(form)
        .filter(|_| sweep.loss(set[place], &solution).square > NAMED.powi(2) * form.width as f64)
    {
        return Some(NotNamed::Within(place, plainer.clone()));
    }
    let mut leaning = (0..set.len()).filter(|other| choice.form(set[*other]).modifies(form));
    let is_summed = choice.is_part_of_curve(form, set);
    if is_summed || (form.cause.brakes && sure > 0.0) {
        return Some(NotNamed::Silent(place));
    }
    // What leans on friction that is none is none either.
    Some(NotNamed::Out(leaning.next().unwrap_or(place)))
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
    let of = |(place, column): (usize, &usize)| FittedNumber {
        value: value_of(solution, *column),
        sigma: covariance[place * (columns.len() + 1)].max(0.0).sqrt(),
    };
    columns.iter().enumerate().map(of).collect()
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
    let is_power = |own: &TorqueForm| {
        own.place == form.place && own.cause.name == VISCOUS && !own.shape_numbers().is_empty()
    };
    let power = *set.iter().find(|own| is_power(choice.form(**own)))?;
    let exponent = choice.form(power).shape[0];
    let fastest = largest(&choice.problem.scene.velocity[form.joint()]);
    let (column, is_viscous) = (all.of(power).start, form.cause.name == VISCOUS);
    let of = |exponent: f64| line_of_power(exponent, fastest)[usize::from(is_viscous)];
    let mut along = vec![(column, of(exponent))];
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
    along.extend(shape.map(|(_, own)| (*own, value_of(solution, column) * slope(exponent, of))));
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
