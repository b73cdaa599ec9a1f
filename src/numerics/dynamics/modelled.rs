//! A judged set as one model, with its covariance.

use super::arm::INERTIAL_NUMBERS;
use super::choice::CauseChoice;
use super::model::{JointRange, TorqueModel, TorqueTerm};
use super::problem::TorqueProblem;
use super::scene::{ends, largest};
use super::shape_slopes::ShapeSlopes;
use super::sweep::SweptColumns;
use crate::statistics::nearest;

/// 95 % of a normal distribution lie within so many standard deviations.
pub(super) const COVERAGE: f64 = 1.96;
/// Judged rows at which the usual uncertainty is asked, at most.
const ASKED: usize = 300;

impl TorqueModel {
    /// The model of a judged set.
    pub(super) fn of(
        choice: &CauseChoice,
        set: &[usize],
        (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
        solution: &[(usize, f64)],
    ) -> Self {
        let problem = choice.problem;
        let adds = |number: &usize| {
            let form = choice.form(*number);
            problem
                .scene
                .declared
                .as_ref()
                .is_none_or(|declared| form.cause.inertial(form, declared).is_none())
        };
        let adding: Vec<usize> = set.iter().copied().filter(adds).collect();
        let term = |number: &usize| {
            let form = choice.form(*number);
            TorqueTerm {
                effect: form.cause.name.into(),
                place: form.place,
                with: form.with,
                shape: form.shape.clone(),
                coefficients: problem.coefficients(*number, solution),
                rms: problem.rms_of(*number, solution),
            }
        };
        let (identified, covariance) = covariance(problem, set, &adding, (uncertain, slopes));
        let mut inertials = problem.inertials(set, solution);
        inertials
            .iter_mut()
            .zip(&identified)
            .filter(|(_, known)| !**known)
            .for_each(|(number, _)| *number = 0.0);
        let certainty = certainty(problem, set, (uncertain, slopes), solution);
        Self {
            inertials,
            identified,
            terms: adding.iter().map(term).collect(),
            covariance,
            sign_width: problem.scene.sign_width,
            friction_lead: problem.scene.friction_lead,
            latency: problem.latency,
            cutoff: problem.reduction.cutoff,
            range: certainty
                .into_iter()
                .enumerate()
                .map(|(joint, [misfit, usual])| range(problem, joint, misfit, usual))
                .collect(),
            temperature: problem.temperature,
        }
    }
}

/// What held-out rows (fitted ones where none are) of each joint leave beyond noise and the covariance of the numbers, Nm, one standard
/// deviation, and the median of the torque's uncertainty (95 %).
fn certainty(
    problem: &TorqueProblem,
    set: &[usize],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
    solution: &[(usize, f64)],
) -> Vec<[f64; 2]> {
    let of_forms = set.iter().flat_map(|number| problem.all.of(*number));
    let of_shapes = slopes.0.iter().map(|(_, column)| *column);
    let columns: Vec<usize> = (0..problem.all.base)
        .chain(of_forms)
        .chain(of_shapes)
        .collect();
    let (all, width) = (uncertain.covariance(&columns), columns.len());
    let residual = problem.residual(solution);
    let held: Vec<usize> = problem.runs(true).into_iter().flatten().collect();
    let rows = if held.is_empty() {
        problem.runs(false).into_iter().flatten().collect()
    } else {
        held
    };
    let of = |joint: usize| {
        let course = |(place, column): (usize, &usize)| {
            let column = &problem.all.columns[*column];
            let own = column.joints.iter().position(|one| *one == joint)?;
            Some((place, column.courses[own].as_slice()))
        };
        let acting: Vec<(usize, &[f64])> = columns.iter().enumerate().filter_map(course).collect();
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
        let asked: Vec<f64> = rows
            .iter()
            .step_by(rows.len().div_ceil(ASKED).max(1))
            .map(variance)
            .collect();
        let mean = |values: &mut dyn Iterator<Item = f64>, count: usize| {
            values.sum::<f64>() / count.max(1) as f64
        };
        let left = mean(
            &mut rows.iter().map(|row| residual[joint][*row].powi(2)),
            rows.len(),
        );
        let by_numbers = mean(&mut asked.iter().copied(), asked.len());
        let misfit = (left - problem.noise[joint].sigma.powi(2) - by_numbers).max(0.0);
        let mut usual: Vec<f64> = asked
            .iter()
            .map(|variance| COVERAGE * (variance + misfit).sqrt())
            .collect();
        [misfit.sqrt(), nearest(&mut usual, 0.5).unwrap_or(0.0)]
    };
    (0..problem.joints()).map(of).collect()
}

fn range(problem: &TorqueProblem, joint: usize, misfit: f64, usual: f64) -> JointRange {
    let rows = || {
        (0..problem.reduction.rows.len())
            .filter(|row| !problem.in_event(*row))
            .map(|row| problem.reduction.rows[row])
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
    }
}

/// Which inertial numbers are identified, and the covariance of these, of the coefficients of `adding` and of the numbers of shapes.
fn covariance(
    problem: &TorqueProblem,
    set: &[usize],
    adding: &[usize],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
) -> (Vec<bool>, Vec<f64>) {
    let mut columns: Vec<usize> = Vec::new();
    // Each number of the model as a sum of coefficients: position in `columns`, and share.
    let mut sums: Vec<Vec<(usize, f64)>> = Vec::new();
    let mut identified = Vec::with_capacity(INERTIAL_NUMBERS * problem.joints());
    for link in 0..problem.joints() {
        let changes = problem.inertial_changes(set, link);
        let first = columns.len();
        columns.extend(changes.iter().map(|(column, _)| *column));
        for number in 0..INERTIAL_NUMBERS {
            let own = changes
                .iter()
                .enumerate()
                .map(|(place, (_, ten))| (first + place, ten[number]));
            let own: Vec<(usize, f64)> = own.filter(|(_, share)| *share != 0.0).collect();
            let known = problem.scene.declared.is_some() || !own.is_empty();
            identified.push(known);
            if known {
                sums.push(own);
            }
        }
    }
    for column in adding
        .iter()
        .flat_map(|number| problem.all.of(*number))
        .chain(slopes.0.iter().map(|(_, column)| *column))
    {
        sums.push(vec![(columns.len(), 1.0)]);
        columns.push(column);
    }
    let (all, width) = (uncertain.covariance(&columns), columns.len());
    let entry = |a: &[(usize, f64)], b: &[(usize, f64)]| -> f64 {
        a.iter()
            .map(|(row, left)| {
                left * b
                    .iter()
                    .map(|(column, right)| right * all[row * width + column])
                    .sum::<f64>()
            })
            .sum()
    };
    let covariance = sums
        .iter()
        .flat_map(|a| sums.iter().map(move |b| entry(a, b)))
        .collect();
    (identified, covariance)
}
