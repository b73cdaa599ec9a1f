//! Two recordings in one system of normal equations: what is common to both, and groups of numbers that only the second one has besides.

use super::newton_euler::INERTIAL_NUMBERS;
use super::problem::TorqueProblem;
use super::regressor::TorqueColumn;
use super::weighted::{WeightedColumns, dot};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// -2 ln of how common a change is beside none.
const PRICE: f64 = 6.0;
/// What is known of a number beforehand, as a share of its own information.
const UNKNOWN: f64 = 1e-9;

/// A form that may change: its columns, and whether both recordings have it.
pub(super) struct CandidateColumns {
    pub columns: std::ops::Range<usize>,
    pub shared: bool,
}

/// Numbers that change together.
struct ChangeGroup {
    /// Form of the problems; none: the last link's inertial numbers.
    form: Option<usize>,
    /// Columns of the normal equations.
    columns: std::ops::Range<usize>,
}

/// The system of all numbers: common ones, then every group.
pub(super) struct StackedNormal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// Product of the measured torques with themselves.
    square: f64,
    common: usize,
    groups: Vec<ChangeGroup>,
    /// Rows of a joint in both.
    rows: usize,
    /// Columns of the second problem behind the numbers of the system.
    columns: Vec<TorqueColumn>,
}

/// Numbers of a set of groups.
pub(super) struct StackedFit {
    factor: Cholesky<f64, Dyn>,
    solution: DVector<f64>,
    /// Numbers of the system that are in it.
    pivots: Vec<usize>,
    square: f64,
    groups: Vec<(usize, std::ops::Range<usize>)>,
}

impl StackedNormal {
    /// Stacks both problems, whose columns are alike.
    pub fn new(problems: &[TorqueProblem; 2], candidates: &[CandidateColumns]) -> Self {
        let weighted = problems
            .each_ref()
            .map(|problem| problem.weighted_of(&(0..problem.all.forms.len()).collect::<Vec<_>>()));
        let base = problems[0].all.base;
        let shared = candidates
            .iter()
            .filter(|one| one.shared)
            .map(|one| one.columns.end)
            .max()
            .unwrap_or(base);
        let payload = payload_columns(&problems[1]);
        let mut groups = vec![ChangeGroup {
            form: None,
            columns: shared..shared + payload.len(),
        }];
        let mut width = shared + payload.len();
        for (form, one) in candidates.iter().enumerate() {
            groups.push(ChangeGroup {
                form: Some(form),
                columns: width..width + one.columns.len(),
            });
            width += one.columns.len();
        }
        // Whitened columns of each number in the second recording; of the first only common ones.
        let runs = problems[1].runs(false);
        let weighing = problems[1].weighing(&runs);
        let own = |column: usize| {
            (
                weighted[1].columns[column].clone(),
                problems[1].all.columns[column].clone(),
            )
        };
        let mut second: Vec<(TorqueColumn, TorqueColumn)> = (0..shared).map(own).collect();
        second.extend(
            payload
                .into_iter()
                .map(|column| (weighing.column(&column), column)),
        );
        second.extend(
            candidates
                .iter()
                .flat_map(|one| one.columns.clone())
                .map(own),
        );
        let mut matrix = DMatrix::zeros(width, width);
        let mut right = DVector::zeros(width);
        for a in 0..width {
            right[a] = along(&second[a].0, &weighted[1])
                + if a < shared {
                    weighted[0].right[a]
                } else {
                    0.0
                };
            for b in 0..=a {
                let first = if a < shared {
                    weighted[0].gram[a][b]
                } else {
                    0.0
                };
                let value = first + product(&second[a].0, &second[b].0);
                (matrix[(a, b)], matrix[(b, a)]) = (value, value);
            }
        }
        for number in 0..width {
            let prior = if number < base {
                problems[0].all.prior[number]
            } else {
                0.0
            };
            let own: f64 = matrix[(number, number)];
            matrix[(number, number)] += prior + UNKNOWN * own + f64::MIN_POSITIVE;
        }
        Self {
            matrix,
            right,
            square: weighted[0].square + weighted[1].square,
            common: shared,
            groups,
            rows: weighted[0].rows + weighted[1].rows,
            columns: second.into_iter().map(|(_, plain)| plain).collect(),
        }
    }

    /// Number of groups; the first is the payload.
    pub fn groups(&self) -> usize {
        self.groups.len()
    }

    /// The form of a group; none of the payload.
    pub fn form_of(&self, group: usize) -> Option<usize> {
        self.groups[group].form
    }

    /// What a group must gain.
    pub fn penalty(&self, group: usize) -> f64 {
        PRICE
            + self.groups[group].columns.len() as f64 * (self.rows as f64).ln()
            + 2.0 * (self.groups.len() as f64).ln()
    }

    /// Common numbers and some groups.
    pub fn fit(&self, set: &[usize]) -> StackedFit {
        let mut pivots: Vec<usize> = (0..self.common).collect();
        let mut groups = Vec::new();
        for group in set {
            let first = pivots.len();
            pivots.extend(self.groups[*group].columns.clone());
            groups.push((*group, first..pivots.len()));
        }
        let scale: Vec<f64> = pivots
            .iter()
            .map(|number| self.matrix[(*number, *number)].sqrt())
            .collect();
        let mut matrix = DMatrix::from_fn(pivots.len(), pivots.len(), |a, b| {
            self.matrix[(pivots[a], pivots[b])] / (scale[a] * scale[b])
        });
        let factor = loop {
            match matrix.clone().cholesky() {
                Some(factor) => break factor,
                // Numbers that say the same: the smallest addition that lets one of them stand.
                None => (0..pivots.len()).for_each(|place| matrix[(place, place)] *= 1.0 + UNKNOWN),
            }
        };
        let right = DVector::from_fn(pivots.len(), |place, _| {
            self.right[pivots[place]] / scale[place]
        });
        let mut solution = factor.solve(&right);
        let square = self.square - right.dot(&solution);
        solution
            .iter_mut()
            .zip(&scale)
            .for_each(|(value, scale)| *value /= scale);
        // Unscaled again, so that a group's covariance is that of its numbers.
        let unscaled = DMatrix::from_fn(pivots.len(), pivots.len(), |a, b| {
            factor.l()[(a, b)] * scale[a]
        });
        StackedFit {
            factor: Cholesky::pack_dirty(unscaled),
            solution,
            pivots,
            square,
            groups,
        }
    }

    /// Adds the best group while it is worth its penalty, then removes what is not.
    pub fn search(&self) -> (Vec<usize>, StackedFit) {
        let mut set: Vec<usize> = Vec::new();
        let mut now = self.fit(&set);
        loop {
            let worth = |group: usize| {
                let with = self.fit(&[set.as_slice(), &[group]].concat());
                now.square - with.square - self.penalty(group)
            };
            let others = (0..self.groups.len()).filter(|group| !set.contains(group));
            let best = others
                .map(|group| (group, worth(group)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            match best {
                Some((group, worth)) if worth > 0.0 => set.push(group),
                _ => break,
            }
            now = self.fit(&set);
            while let Some(place) = set
                .iter()
                .position(|group| now.gain(*group) < self.penalty(*group))
            {
                set.remove(place);
                now = self.fit(&set);
            }
        }
        (set, now)
    }

    /// What a fit leaves of the second recording, Nm rms per joint.
    pub fn residual_rms(&self, problem: &TorqueProblem, fit: &StackedFit) -> Vec<f64> {
        let mut left = problem.measured.clone();
        for (place, number) in fit.pivots.iter().enumerate() {
            let column = &self.columns[*number];
            for (joint, course) in column.joints.iter().zip(&column.courses) {
                left[*joint]
                    .iter_mut()
                    .zip(course)
                    .for_each(|(value, part)| *value -= fit.solution[place] * part);
            }
        }
        let rows: Vec<usize> = problem.runs(false).into_iter().flatten().collect();
        let rms = |course: &Vec<f64>| {
            (rows.iter().map(|row| course[*row].powi(2)).sum::<f64>() / rows.len().max(1) as f64)
                .sqrt()
        };
        left.iter().map(rms).collect()
    }
}

impl StackedFit {
    /// Values of a group with their covariance, row-major; empty where it is not in the fit.
    pub fn of_group(&self, group: usize) -> (Vec<f64>, Vec<f64>) {
        let Some((_, places)) = self.groups.iter().find(|(own, _)| *own == group) else {
            return Default::default();
        };
        let values = places.clone().map(|place| self.solution[place]).collect();
        let unit = |place: usize| {
            let mut unit = DVector::zeros(self.solution.len());
            unit[place] = 1.0;
            self.factor.solve(&unit)
        };
        let columns: Vec<DVector<f64>> = places.clone().map(unit).collect();
        let covariance = places
            .clone()
            .flat_map(|row| columns.iter().map(move |column| column[row]))
            .collect();
        (values, covariance)
    }

    /// How much worse the fit is without a group.
    pub fn gain(&self, group: usize) -> f64 {
        let (values, covariance) = self.of_group(group);
        let covariance = DMatrix::from_row_slice(values.len(), values.len(), &covariance);
        let values = DVector::from_vec(values);
        covariance
            .cholesky()
            .map_or(0.0, |factor| values.dot(&factor.solve(&values)))
    }
}

/// The last link's inertial numbers that torques can determine: all where masses are declared.
fn payload_columns(problem: &TorqueProblem) -> Vec<TorqueColumn> {
    let last = problem.joints() - 1;
    let unit = |number: usize| {
        std::array::from_fn::<f64, INERTIAL_NUMBERS, _>(|entry| {
            f64::from(u8::from(entry == number))
        })
    };
    (0..INERTIAL_NUMBERS)
        .map(|number| problem.regressor.column(last, &unit(number)))
        .collect()
}

fn product(a: &TorqueColumn, b: &TorqueColumn) -> f64 {
    let with = |(joint, course): (&usize, &Vec<f64>)| {
        b.joints
            .iter()
            .position(|one| one == joint)
            .map_or(0.0, |place| dot(course, &b.courses[place]))
    };
    a.joints.iter().zip(&a.courses).map(with).sum()
}

fn along(column: &TorqueColumn, weighted: &WeightedColumns) -> f64 {
    column
        .joints
        .iter()
        .zip(&column.courses)
        .map(|(joint, course)| dot(course, &weighted.measured[*joint]))
        .sum()
}
