//! Two recordings in one least squares: what is common to both, and forms that only the second one has. Joints of the second count
//! on from those of the first.

use super::arm::INERTIAL_NUMBERS;
use super::cause::{TORQUE_CAUSES, TorqueForm};
use super::columns::TorqueColumns;
use super::problem::TorqueProblem;
use super::reduce::TorqueColumn;
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;
use crate::effect::Place;

/// -2 ln of how common a change is against none.
const PRICE: f64 = 6.0;
/// What is known of a number beforehand, as a share of its own information.
const UNKNOWN: f64 = 2e-9;
/// Canonical name of a payload that is another.
const PAYLOAD: &str = "payload_error";

/// Common columns as the base, and forms that may change: the last link's inertial numbers, then causes.
pub(super) struct StackedColumns {
    pub(crate) all: TorqueColumns,
    weighted: WeightedColumns,
    /// Nm, of both.
    measured: Vec<Vec<f64>>,
    /// Judged rows of the second that count.
    rows: Vec<usize>,
    joints: usize,
}

impl StackedColumns {
    /// Of two problems whose columns are alike; both have the first `shared` forms.
    pub(crate) fn new(problems: &[TorqueProblem; 2], shared: usize) -> Self {
        let n = problems[0].joints();
        let runs = problems.each_ref().map(|problem| problem.runs(false));
        let weighings = [0, 1].map(|which| problems[which].weighing(&runs[which]));
        let counted = |which: usize, column: TorqueColumn| TorqueColumn {
            joints: column
                .joints
                .iter()
                .map(|joint| n * which + joint)
                .collect(),
            ..column
        };
        let mut all = TorqueColumns::empty();
        let mut white = Vec::new();
        let own = &problems[1].all;
        all.base = (0..shared).fold(own.base, |end, form| end.max(own.of(form).end));
        for number in 0..all.base {
            let both = |whitened: bool| {
                let of = |which: usize| {
                    let column = &problems[which].all.columns[number];
                    let white = || weighings[which].column(column);
                    counted(which, if whitened { white() } else { column.clone() })
                };
                let [first, second] = [of(0), of(1)];
                TorqueColumn {
                    joints: [first.joints, second.joints].concat(),
                    courses: [first.courses, second.courses].concat(),
                }
            };
            let prior = if number < own.base {
                problems[0].all.prior[number]
            } else {
                0.0
            };
            white.push(both(true));
            all.push_bare(both(false));
            all.prior[number] = prior;
        }
        let payload = payload(&problems[1]).into_iter();
        let forms = (0..own.forms.len())
            .map(|form| (own.forms[form].clone(), own.columns[own.of(form)].to_vec()));
        for (form, columns) in payload.chain(forms) {
            white.extend(
                columns
                    .iter()
                    .map(|column| counted(1, weighings[1].column(column))),
            );
            all.take(
                form,
                columns
                    .into_iter()
                    .map(|column| counted(1, column))
                    .collect(),
            );
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
            measured: problems
                .each_ref()
                .map(|problem| problem.measured.clone())
                .concat(),
            rows: runs[1].iter().flat_map(Clone::clone).collect(),
            joints: n,
        }
    }

    /// What a form must gain.
    pub(crate) fn penalty(&self, form: usize) -> f64 {
        let rows: usize = [0, self.joints]
            .map(|joint| self.weighted.measured[joint].len())
            .iter()
            .sum();
        PRICE
            + self.all.of(form).len() as f64 * (rows as f64).ln()
            + 2.0 * (self.all.forms.len() as f64).ln()
    }

    /// Common numbers and some forms.
    pub(crate) fn fit(&self, set: &[usize]) -> SweptColumns<'_> {
        SweptColumns::base(&self.all, &self.weighted).with(set)
    }

    /// Adds the best form while it is worth its penalty, then removes what is not.
    pub(crate) fn search(&self) -> Vec<usize> {
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
                let idle = |form: &usize| now.loss(*form, &solution).square < self.penalty(*form);
                let Some(place) = set.iter().position(idle) else {
                    break;
                };
                set.remove(place);
            }
        }
    }

    /// What a fit leaves of the second recording, Nm rms per joint.
    pub(crate) fn residual_rms(&self, fit: &SweptColumns) -> Vec<f64> {
        let mut left = self.measured.clone();
        for (number, value) in fit.solution() {
            self.all.columns[number].add(-value, &mut left);
        }
        let square = |course: &Vec<f64>| {
            self.rows
                .iter()
                .map(|row| course[*row].powi(2))
                .sum::<f64>()
        };
        let rms = |course: &Vec<f64>| (square(course) / self.rows.len().max(1) as f64).sqrt();
        left[self.joints..].iter().map(rms).collect()
    }
}

/// The last link's inertial numbers that torques can determine: all where masses are declared.
fn payload(problem: &TorqueProblem) -> Option<(TorqueForm, Vec<TorqueColumn>)> {
    let last = problem.joints() - 1;
    let unit = |number: usize| std::array::from_fn(|entry| f64::from(u8::from(entry == number)));
    let columns = (0..INERTIAL_NUMBERS).map(|number| problem.regressor.column(last, &unit(number)));
    let cause = TORQUE_CAUSES
        .into_iter()
        .find(|cause| cause.name == PAYLOAD)?;
    let form = TorqueForm {
        place: Place::Tool,
        ..TorqueForm::at_joint(cause, last, INERTIAL_NUMBERS)
    };
    Some((form, columns.collect()))
}
