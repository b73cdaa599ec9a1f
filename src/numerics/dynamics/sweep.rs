//! Least squares of the base and a set of forms, and what every further column would gain: Gram-Schmidt on inner products.
//!
//! Two recordings in one least squares: what is common to both, and forms that only the second one has. Joints of the second count
//! on from those of the first.

use crate::arm::INERTIAL_NUMBERS;
use crate::cause::{TORQUE_CAUSES, TorqueForm};
use crate::columns::TorqueColumns;
use crate::effect::Place;
use crate::problem::TorqueProblem;
use crate::reduce::TorqueColumn;
use crate::weighted::WeightedColumns;
use nalgebra::{DMatrix, DVector};

/// A column of which less than this share is new adds nothing.
const REDUNDANT: f64 = 1e-9;
/// The same inside a form: what the base and the set leave of its columns.
const INVISIBLE: f64 = 2e-5;

/// What a form would gain.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Gain {
    /// Fall of the whitened squared residual, what the base's tolerances are stretched by included.
    pub(crate) square: f64,
    /// Columns of it that are seen.
    pub(crate) rank: usize,
}

/// The base and a set of forms, swept out of all columns.
#[derive(Clone)]
pub(super) struct SweptColumns<'a> {
    all: &'a TorqueColumns,
    weighted: &'a WeightedColumns,
    pivots: Vec<usize>,
    /// Per pivot: its direction's inner products with all columns.
    rows: Vec<Vec<f64>>,
    /// Per pivot: its direction's inner product with the measured torque.
    along: Vec<f64>,
    /// Per column: what is left of its inner product with the measured torque.
    right: Vec<f64>,
    /// Whitened squared residual and what the base's tolerances are stretched by.
    pub(crate) square: f64,
}

/// The coefficient of a column; 0 of one that is not seen.
pub(super) fn value_of(solution: &[(usize, f64)], column: usize) -> f64 {
    let known = solution.iter().find(|(pivot, _)| *pivot == column);
    known.map_or(0.0, |(_, value)| *value)
}

impl<'a> SweptColumns<'a> {
    /// The base alone.
    pub(crate) fn base(all: &'a TorqueColumns, weighted: &'a WeightedColumns) -> Self {
        let mut sweep = Self {
            all,
            weighted,
            pivots: Vec::new(),
            rows: Vec::new(),
            along: Vec::new(),
            right: weighted.right.clone(),
            square: weighted.square,
        };
        (0..all.base).for_each(|column| sweep.take(column));
        sweep
    }

    /// With forms.
    pub(crate) fn with(&self, forms: &[usize]) -> Self {
        let mut sweep = self.clone();
        forms.iter().for_each(|form| sweep.add(*form));
        sweep
    }

    /// Takes a form.
    pub(crate) fn add(&mut self, form: usize) {
        self.all.of(form).for_each(|column| self.take(column));
    }

    /// Takes a column.
    pub(crate) fn take(&mut self, column: usize) {
        let prior = self.prior(column);
        let diagonal = self.weighted.gram[column][column] + prior;
        let mut row = self.weighted.gram[column].clone();
        for known in &self.rows {
            let share = known[column];
            if share != 0.0 {
                row.iter_mut()
                    .zip(known)
                    .for_each(|(value, other)| *value -= share * other);
            }
        }
        let left = row[column] + prior;
        if left <= REDUNDANT * diagonal || diagonal <= 0.0 {
            return;
        }
        let root = left.sqrt();
        row[column] = left;
        row.iter_mut().for_each(|value| *value /= root);
        let along = self.right[column] / root;
        self.right
            .iter_mut()
            .zip(&row)
            .for_each(|(right, value)| *right -= along * value);
        self.square -= along * along;
        self.pivots.push(column);
        self.rows.push(row);
        self.along.push(along);
    }

    /// 1 / variance beforehand of a coefficient.
    fn prior(&self, column: usize) -> f64 {
        self.all.prior.get(column).copied().unwrap_or(0.0)
    }

    /// What a form would gain, given the present ones.
    pub(crate) fn gain(&self, form: usize) -> f64 {
        let (gram, right) = self.left_among(form);
        let first = self.all.of(form).start;
        let scale: Vec<f64> = (0..right.len())
            .map(|a| {
                self.weighted.gram[first + a][first + a]
                    .max(f64::MIN_POSITIVE)
                    .sqrt()
            })
            .collect();
        let mut block = DMatrix::from_fn(right.len(), right.len(), |a, b| {
            gram[(a, b)] / (scale[a] * scale[b])
        });
        (0..right.len()).for_each(|a| {
            block[(a, a)] += INVISIBLE + self.prior(first + a) / (scale[a] * scale[a])
        });
        let along = DVector::from_fn(right.len(), |a, _| right[a] / scale[a]);
        block
            .cholesky()
            .map_or(0.0, |factor| along.dot(&factor.solve(&along)))
    }

    /// What the present ones leave of the inner products of a column with all others.
    pub(crate) fn left_of(&self, column: usize) -> Vec<f64> {
        let mut left = self.weighted.gram[column].clone();
        for known in &self.rows {
            let share = known[column];
            if share != 0.0 {
                left.iter_mut()
                    .zip(known)
                    .for_each(|(value, other)| *value -= share * other);
            }
        }
        left
    }

    /// The same of columns of a form among each other, and with the measured torque.
    pub(crate) fn left_among(&self, form: usize) -> (DMatrix<f64>, DVector<f64>) {
        let columns = self.all.of(form);
        let (first, width) = (columns.start, columns.len());
        let swept = |a: usize, b: usize| {
            self.rows
                .iter()
                .map(|row| row[first + a] * row[first + b])
                .sum::<f64>()
        };
        let gram = |a: usize, b: usize| self.weighted.gram[first + a][first + b] - swept(a, b);
        (
            DMatrix::from_fn(width, width, gram),
            DVector::from_fn(width, |a, _| self.right[first + a]),
        )
    }

    /// What is left of the inner product of a column with the measured torque.
    pub(crate) fn right_of(&self, column: usize) -> f64 {
        self.right[column]
    }

    /// Whether each coefficient of a form would be positive alone.
    pub(crate) fn rises(&self, form: usize) -> bool {
        self.all.of(form).all(|column| self.right[column] > 0.0)
    }

    /// What a form of the set gains in addition to the others.
    pub(crate) fn loss(&self, form: usize, solution: &[(usize, f64)]) -> Gain {
        let of_column =
            |column: usize| solution.iter().find(|(pivot, _)| *pivot == column).copied();
        let (columns, values): (Vec<usize>, Vec<f64>) =
            self.all.of(form).filter_map(of_column).unzip();
        let covariance =
            DMatrix::from_row_slice(columns.len(), columns.len(), &self.covariance(&columns));
        let values = DVector::from_vec(values);
        let square = covariance
            .cholesky()
            .map_or(0.0, |factor| values.dot(&factor.solve(&values)));
        Gain {
            square,
            rank: columns.len(),
        }
    }

    /// Coefficients of the pivots.
    pub(crate) fn solution(&self) -> Vec<(usize, f64)> {
        let count = self.pivots.len();
        let mut values = self.along.clone();
        for i in (0..count).rev() {
            let sum: f64 = (i + 1..count)
                .map(|m| self.rows[i][self.pivots[m]] * values[m])
                .sum();
            values[i] = (values[i] - sum) / self.rows[i][self.pivots[i]];
        }
        self.pivots.iter().copied().zip(values).collect()
    }

    /// Covariance of some columns, row-major; columns that are no pivots have none.
    pub(crate) fn covariance(&self, columns: &[usize]) -> Vec<f64> {
        // Rows of the factor's inverse: covariance is their inner products.
        let count = self.pivots.len();
        let inverse = |column: &usize| {
            let mut row = vec![0.0; count];
            if let Some(place) = self.pivots.iter().position(|pivot| pivot == column) {
                // Solve U x = e by back substitution: x is the column of the inverse of U = L^T; the row is what multiplies `along`.
                row[place] = 1.0;
            }
            row
        };
        let mut halves: Vec<Vec<f64>> = columns.iter().map(inverse).collect();
        for half in &mut halves {
            // w^T = e^T U^-1, forward through U.
            for i in 0..count {
                if half[i] == 0.0 {
                    continue;
                }
                half[i] /= self.rows[i][self.pivots[i]];
                let value = half[i];
                for (entry, pivot) in half.iter_mut().zip(&self.pivots).skip(i + 1) {
                    *entry -= value * self.rows[i][*pivot];
                }
            }
        }
        let product = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(x, y)| x * y).sum();
        halves
            .iter()
            .flat_map(|a| halves.iter().map(move |b| product(a, b)))
            .collect()
    }
}

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
        let other_columns = &problems[1].all;
        all.base = (0..shared).fold(other_columns.base, |end, form| {
            end.max(other_columns.of(form).end)
        });
        for number in 0..all.base {
            let both = |whitened: bool| {
                let of_which = |which: usize| {
                    let column = &problems[which].all.columns[number];
                    let white = || weighings[which].column(column);
                    counted(which, if whitened { white() } else { column.clone() })
                };
                let [first, second] = [of_which(0), of_which(1)];
                TorqueColumn {
                    joints: [first.joints, second.joints].concat(),
                    courses: [first.courses, second.courses].concat(),
                }
            };
            let prior = if number < other_columns.base {
                problems[0].all.prior[number]
            } else {
                0.0
            };
            white.push(both(true));
            all.push_bare(both(false));
            all.prior[number] = prior;
        }
        let payload = payload(&problems[1]).into_iter();
        let forms = (0..other_columns.forms.len()).map(|form| {
            (
                other_columns.forms[form].clone(),
                other_columns.columns[other_columns.of(form)].to_vec(),
            )
        });
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
