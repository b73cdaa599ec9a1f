//! Whitened rows of all columns and their inner products, formed once for one noise and one choice of rows.

use super::columns::{TorqueColumn, TorqueColumns};
use super::recording::{add, dot};
use crate::criteria::torque::MEMORY;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use std::ops::Range;

/// Noise per joint, and which runs of judged rows are looked at.
#[derive(Clone, Copy)]
pub(super) struct Weighing<'a> {
    pub(crate) noise: &'a [JointNoise],
    pub(crate) runs: &'a [Range<usize>],
}

impl Weighing<'_> {
    /// A course of a joint.
    fn course(&self, joint: usize, course: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(course.len());
        self.noise[joint].whiten(course, self.runs, &mut out);
        out
    }

    /// A column, joint after joint.
    pub(crate) fn column(&self, column: &TorqueColumn) -> TorqueColumn {
        column.map(|joint, course| self.course(joint, course))
    }

    /// Measured minus rigid, of all joints.
    pub(crate) fn measured(&self, measured: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let courses = measured.iter().enumerate();
        courses
            .map(|(joint, course)| self.course(joint, course))
            .collect()
    }
}

/// Inner products of whitened columns; those that are left out have none.
pub(super) struct WeightedColumns {
    pub(crate) columns: Vec<TorqueColumn>,
    /// `[joint]`: whitened rows of measured minus rigid torque.
    pub(crate) measured: Vec<Vec<f64>>,
    /// Symmetric, row after row.
    pub(crate) gram: Vec<Vec<f64>>,
    /// With the measured torque.
    pub(crate) right: Vec<f64>,
    /// Product of the measured torque with itself.
    pub(crate) square: f64,
    /// Rows of a joint.
    pub(crate) rows: usize,
}

impl WeightedColumns {
    /// Products of the columns whose numbers are `chosen`, ascending.
    pub(crate) fn new(
        columns: &TorqueColumns,
        measured: &[Vec<f64>],
        weighing: Weighing,
        chosen: &[usize],
    ) -> Self {
        let mut white = vec![TorqueColumn::default(); columns.columns.len()];
        for number in chosen {
            white[*number] = weighing.column(&columns.columns[*number]);
        }
        Self::of_white(white, weighing.measured(measured), chosen)
    }

    /// The same of columns and torques that are whitened already.
    pub(crate) fn of_white(
        columns: Vec<TorqueColumn>,
        measured: Vec<Vec<f64>>,
        chosen: &[usize],
    ) -> Self {
        let count = columns.len();
        let mut all = Self {
            columns,
            square: measured.iter().flatten().map(|value| value * value).sum(),
            rows: measured.iter().map(Vec::len).max().unwrap_or(0),
            measured,
            gram: vec![Vec::new(); count],
            right: vec![0.0; count],
        };
        for number in chosen {
            all.gram[*number] = vec![0.0; count];
        }
        (0..all.measured.len()).for_each(|joint| all.take_joint(joint, chosen));
        all
    }

    /// Adds the inner products of a joint.
    fn take_joint(&mut self, joint: usize, chosen: &[usize]) {
        let courses: Vec<(usize, &[f64])> = chosen
            .iter()
            .filter_map(|number| Some((*number, self.columns[*number].at(joint)?)))
            .collect();
        let measured = &self.measured[joint];
        let rows = Mat::from_fn(measured.len(), courses.len(), |row, column| {
            courses[column].1[row]
        });
        let mut products = Mat::<f64>::zeros(courses.len(), courses.len());
        matmul(
            products.as_mut(),
            Accum::Replace,
            rows.transpose(),
            rows.as_ref(),
            1.0,
            Par::Seq,
        );
        for (a, (number, course)) in courses.iter().enumerate() {
            self.right[*number] += dot(course, measured);
            let row = &mut self.gram[*number];
            courses
                .iter()
                .enumerate()
                .for_each(|(b, (other, _))| row[*other] += products[(b, a)]);
        }
    }

    /// The same columns with another measured torque (whitened, `[joint]`).
    pub(crate) fn with_measured(&self, measured: Vec<Vec<f64>>) -> Self {
        let right = self.columns.iter();
        Self {
            right: right.map(|column| along(column, &measured)).collect(),
            square: measured.iter().flatten().map(|value| value * value).sum(),
            measured,
            columns: self.columns.clone(),
            gram: self.gram.clone(),
            rows: self.rows,
        }
    }

    /// Whether a column has inner products.
    pub(crate) fn has(&self, column: usize) -> bool {
        !self.gram[column].is_empty()
    }

    /// Takes what is known of coefficients beforehand, 1 / variance of each.
    pub(crate) fn know(&mut self, priors: &[(usize, f64)]) {
        for (column, precision) in priors {
            self.gram[*column][*column] += precision;
        }
    }

    /// Takes what coefficients explain off the measured torque; inner products stay as they were.
    pub(crate) fn subtract(&mut self, solution: &[(usize, f64)]) {
        for (column, value) in solution {
            self.columns[*column].add(-value, &mut self.measured);
        }
    }

    /// Takes one more column.
    pub(crate) fn push(&mut self, column: &TorqueColumn, weighing: Weighing) {
        let white = weighing.column(column);
        let product = |other: &TorqueColumn| {
            let parts = white.joints.iter().zip(&white.courses);
            let with = |(joint, course): (&usize, &Vec<f64>)| Some(dot(course, other.at(*joint)?));
            parts.filter_map(with).sum::<f64>()
        };
        let mut row: Vec<f64> = self.columns.iter().map(&product).collect();
        row.push(product(&white));
        self.gram
            .iter_mut()
            .zip(&row)
            .filter(|(old, _)| !old.is_empty())
            .for_each(|(old, value)| old.push(*value));
        self.gram.push(row);
        self.right.push(along(&white, &self.measured));
        self.columns.push(white);
    }
}

/// Product of a column with torques of all joints.
fn along(column: &TorqueColumn, measured: &[Vec<f64>]) -> f64 {
    let parts = column.joints.iter().zip(&column.courses);
    parts
        .map(|(joint, course)| dot(course, &measured[*joint]))
        .sum()
}

/// How many rows before a row remembers, at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoiseMemory {
    /// By the residual of a rich model, which absorbs slow noise.
    Short = 0,
    /// By the residual of a set of causes, with all of the slow noise.
    Long = 1,
}

/// The noise of one joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct JointNoise {
    /// Nm, of the course.
    pub(crate) sigma: f64,
    /// Nm, of what is new in a row.
    pub(crate) innovation: f64,
    /// Share of the rows before, nearest first.
    pub(crate) memory: Vec<f64>,
}

impl JointNoise {
    /// White noise.
    pub(crate) fn white(sigma: f64) -> Self {
        Self {
            sigma,
            innovation: sigma,
            memory: Vec::new(),
        }
    }

    /// The noise of a residual over runs of rows, `spent` of whose freedoms a fit has taken: Yule and Walker's equations by Levinson, the order by
    /// Akaike's criterion.
    pub(crate) fn of(
        residual: &[f64],
        runs: &[Range<usize>],
        spent: f64,
        longest: NoiseMemory,
    ) -> Self {
        let longest = MEMORY[longest as usize];
        let rows: usize = runs.iter().map(Range::len).sum();
        let correlation: Vec<f64> = (0..=longest)
            .map(|lag| {
                let product = |run: &Range<usize>| -> f64 {
                    let run = &residual[run.clone()];
                    let later = run.get(lag..).unwrap_or_default();
                    run.iter().zip(later).map(|(a, b)| a * b).sum()
                };
                runs.iter().map(product).sum::<f64>() / rows.max(1) as f64
            })
            .collect();
        let freedom = rows as f64 / (rows as f64 - spent).max(1.0);
        let mut memory: Vec<f64> = Vec::new();
        let mut left = correlation[0].max(f64::MIN_POSITIVE);
        let mut best = (rows as f64 * left.ln(), left, memory.clone());
        for order in 1..=longest {
            let before = correlation[..order].iter().rev();
            let ahead: f64 = memory
                .iter()
                .zip(before)
                .map(|(share, value)| share * value)
                .sum();
            let reflection = (correlation[order] - ahead) / left;
            let turned: Vec<f64> = memory.iter().rev().copied().collect();
            add(&mut memory, -reflection, &turned);
            memory.push(reflection);
            left *= 1.0 - reflection * reflection;
            let criterion = rows as f64 * left.max(f64::MIN_POSITIVE).ln() + 2.0 * order as f64;
            if criterion < best.0 {
                best = (criterion, left, memory.clone());
            }
        }
        Self {
            sigma: (correlation[0] * freedom).sqrt(),
            innovation: (best.1 * freedom).sqrt(),
            memory: best.2,
        }
    }

    /// This noise, or white noise as large as another's course where that is larger: what is no noise does not lose by being slow.
    pub(crate) fn at_least(self, floor: &Self) -> Self {
        match floor.sigma > self.sigma {
            true => Self::white(floor.sigma),
            false => self,
        }
    }

    /// White noise as dense as a course over runs is where it changes slowly, by its correlation over so many rows (Newey & West, 1987): what
    /// explains it need not be right from row to row.
    pub(crate) fn evened(&self, course: &[f64], runs: &[Range<usize>], rows: usize) -> Self {
        let products = |lag: usize| -> f64 {
            let of_run = |run: &Range<usize>| {
                let run = &course[run.clone()];
                dot(
                    &run[..run.len().saturating_sub(lag)],
                    run.get(lag..).unwrap_or_default(),
                )
            };
            runs.iter().map(of_run).sum()
        };
        let share = |lag: usize| 2.0 * (1.0 - lag as f64 / (rows + 1) as f64);
        let others: f64 = (1..=rows).map(|lag| share(lag) * products(lag)).sum();
        let lasting = 1.0 + others / products(0).max(f64::MIN_POSITIVE);
        Self {
            innovation: self.sigma * lasting.max(1.0).sqrt(),
            memory: Vec::new(),
            ..*self
        }
    }

    /// What a row counts for: less than one where the noise is evened.
    pub(crate) fn share_of_rows(&self) -> f64 {
        match self.memory.is_empty() {
            true => (self.sigma / self.innovation).powi(2).min(1.0),
            false => 1.0,
        }
    }

    /// How many rows in a row count as one for what is slow.
    pub(crate) fn autocorrelation(&self) -> f64 {
        let gain = 1.0 - self.memory.iter().sum::<f64>();
        (self.innovation / self.sigma / gain.max(1e-3)).powi(2)
    }

    /// What is new in each row of the runs, in standard deviations; the first rows of a run only serve as memory.
    pub(crate) fn whiten(&self, course: &[f64], runs: &[Range<usize>], out: &mut Vec<f64>) {
        let scale = 1.0 / self.innovation;
        for run in runs {
            let rows = &course[run.clone()];
            for now in self.memory.len()..rows.len() {
                let before = rows[..now].iter().rev();
                let known: f64 = self.memory.iter().zip(before).map(|(a, b)| a * b).sum();
                out.push((rows[now] - known) * scale);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    /// Numbers that are nearly normal.
    fn normal(seed: u64) -> impl FnMut() -> f64 {
        let mut dice = ChaCha8Rng::seed_from_u64(seed);
        move || (0..12).map(|_| dice.random::<f64>() - 0.5).sum()
    }

    #[test]
    fn a_course_that_remembers_is_found_with_its_memory_and_whitened() {
        let (mut normal, mut now) = (normal(1), 0.0);
        let course: Vec<f64> = (0..20_000)
            .map(|_| {
                now = 0.8 * now + normal();
                now
            })
            .collect();
        let whole = 0..course.len();
        let runs = std::slice::from_ref(&whole);
        let noise = JointNoise::of(&course, runs, 0.0, NoiseMemory::Short);
        assert!(
            (noise.memory[0] - 0.8).abs() < 0.03 && (noise.innovation - 1.0).abs() < 0.02,
            "{noise:?}"
        );
        // (1 + 0.8) / (1 - 0.8).
        let lasting = noise.autocorrelation();
        assert!((lasting / 9.0 - 1.0).abs() < 0.15, "{lasting}");
        let mut white = Vec::new();
        noise.whiten(&course, runs, &mut white);
        let lag = white.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / white.len() as f64;
        assert!(lag.abs() < 0.03, "{lag}");
    }

    #[test]
    fn slow_noise_in_quick_noise_is_seen_at_its_full_density_by_the_long_memory() {
        let mut normal = normal(2);
        // 25 rows a second: white, and with a quarter of its variance what lasts a fifth of a second.
        let keeps = libm::exp(-0.2_f64);
        let mut now = 0.0;
        let course: Vec<f64> = (0..100_000)
            .map(|_| {
                now = keeps * now + (1.0 - keeps * keeps).sqrt() * normal();
                0.5 * now + normal()
            })
            .collect();
        let runs = 0..course.len();
        let at_rest = |memory: NoiseMemory| {
            let noise = JointNoise::of(&course, std::slice::from_ref(&runs), 0.0, memory);
            let gain = 1.0 - noise.memory.iter().sum::<f64>();
            (noise.innovation / gain).powi(2)
        };
        // Spectral density of the sum at rest: 1 + (1 - k^2) / (1 - k)^2 / 4. Yule and Walker's equations of its correlations, solved apart, see
        // 0.797 of it with 4 rows and 0.989 with 12.
        let density = 1.0 + 0.25 * (1.0 - keeps * keeps) / (1.0 - keeps).powi(2);
        let [short, long] =
            [NoiseMemory::Short, NoiseMemory::Long].map(|memory| at_rest(memory) / density);
        assert!((short - 0.797).abs() < 0.05, "{short}");
        assert!((long - 0.989).abs() < 0.05, "{long}");
    }
}
