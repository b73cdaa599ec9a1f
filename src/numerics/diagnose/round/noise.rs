//! The noise that repeats show: by how much the instrument's differs from its statement, and how well the joints repeat, one standard deviation
//! for all, by maximum likelihood on repeats or on a residual without structure.

use crate::criteria::noise::{CAP, CLEARER, FEW, MEDIAN, REPEATS, SETTLED};
use crate::diagnose::types::JointRepeatability;
use crate::diagnose::whitened::WhitenedProblem;
use crate::estimate::{Fitted, Model, Poses};
use crate::observation::{MeasurementKind, PointKind, Residual, kinds, values};
use crate::robot::Measurements;
use crate::statistics::nearest;
use nalgebra::{Matrix3, Vector3};

/// Standard deviations tried, rad.
const LOWEST: f64 = 5e-7;
const HIGHEST: f64 = 3e-4;
const STEPS: usize = 60;
/// Scales of the stated noise that are tried, a third as many, as shares of that of the usual repeat: joints may have a part in it.
const SMALLEST: f64 = 0.28;
const LARGEST: f64 = 1.2;

/// Covariances per squared deviation of every joint, by row.
#[derive(Default)]
pub(super) struct JointSpread {
    /// Covariances of the point, m2 per rad2.
    points: Vec<Matrix3<f64>>,
    /// Covariances of what rows measured beside points, of the first three numbers of the kind; zero where a row measured none.
    others: Vec<(&'static dyn MeasurementKind, Vec<Matrix3<f64>>)>,
}

impl JointSpread {
    /// As a model moves; the joints' repeatability has no part in `data` yet.
    pub(crate) fn of(model: &Model, data: &Measurements) -> Self {
        let problem = WhitenedProblem::new(model, data, (0..data.rows()).collect());
        let summed = |motions: &[Vector3<f64>]| -> Matrix3<f64> {
            let squares = motions.iter().map(|motion| motion * motion.transpose());
            squares.sum()
        };
        let spread_of = |kind: &'static dyn MeasurementKind| {
            let name = kind.about().name;
            let by_row = |row: usize| {
                let reading = kind.reading(data, row);
                let variance = reading.map_or(0.0, |reading| reading.sigma * reading.sigma);
                let motions = problem.reading_by_joint(row, name);
                motions.map_or_else(Matrix3::zeros, |motions| summed(&motions) * variance)
            };
            (kind, (0..data.rows()).map(by_row).collect())
        };
        let is_other =
            |kind: &&'static dyn MeasurementKind| kind.about().name != PointKind.about().name;
        let points = (0..data.rows()).map(|row| summed(problem.by_joint(row)));
        Self {
            points: points.collect(),
            others: kinds(data)
                .into_iter()
                .filter(is_other)
                .map(spread_of)
                .collect(),
        }
    }

    /// Gives every row what this deviation (rad) of every joint makes of its readings.
    pub(crate) fn put(&self, data: &mut Measurements, sigma: f64) {
        let square = sigma * sigma;
        data.spread =
            (sigma > 0.0).then(|| self.points.iter().map(|matrix| matrix * square).collect());
        // What sees places has its part by the point's own.
        let turns = self.others.iter();
        let turns = turns.filter(|(kind, _)| sigma > 0.0 && kind.about().rank.rotations);
        let spread = |(kind, all): &(&'static dyn MeasurementKind, Vec<Matrix3<f64>>)| {
            let about = kind.about();
            let variance = |matrix: &Matrix3<f64>| matrix.trace() * square / about.axes as f64;
            (about.name, all.iter().map(variance).collect())
        };
        data.reading_spread = turns.map(spread).collect();
    }
}

/// Rows as a model has them, with what deviations of the joints make of each.
#[derive(Clone, Copy)]
pub(super) struct PredictedRows<'a> {
    pub(super) model: &'a Model,
    pub(super) data: &'a Measurements,
    pub(super) spread: &'a JointSpread,
}

impl PredictedRows<'_> {
    /// Residuals of rows that are no points, and the kind of each.
    fn beside_points(self, rows: &[usize]) -> Vec<(&'static str, Sample)> {
        let Self {
            model,
            data,
            spread,
        } = self;
        let (stack, robot) = (&model.stack, &model.robot);
        let mut scratch = stack.scratch(robot);
        let mut left = Vec::new();
        for row in rows {
            let placed = stack.place(robot, data, *row, &model.x, &mut scratch);
            for (kind, spread) in &spread.others {
                let seen = Residual::of(*kind, data, *row, &placed).zip(kind.reading(data, *row));
                left.extend(seen.map(|(residual, reading)| {
                    // 1 on lines that hold nothing.
                    let fixed = Matrix3::from_fn(|i, j| match (i == j, i < residual.axes) {
                        (true, true) => reading.sigma * reading.sigma,
                        (true, false) => 1.0,
                        (false, _) => 0.0,
                    });
                    let sample = Sample {
                        error: residual.error,
                        fixed,
                        varying: spread[*row],
                    };
                    (kind.about().name, sample)
                }));
            }
        }
        left
    }

    /// Covariance of the instrument in a row's point.
    fn fixed(self, row: usize) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.data.points.sigma[row].map(|s| s * s))
    }

    /// The joints' repeatability (rad) from the residuals of `rows` after a fit that leaves no structure.
    pub(super) fn repeatability(self, fitted: &Fitted, rows: &[usize]) -> f64 {
        let data = self.data;
        let predicted = self.model.predict(data);
        let numbers: usize = rows.iter().map(|row| values(data, *row)).sum();
        let freedom = numbers.saturating_sub(fitted.singular.len()).max(1);
        let freedom = (numbers as f64 / freedom as f64).sqrt();
        let point = |row: &usize| {
            Some(Sample {
                error: (data.point(*row)? - predicted[*row]) * freedom,
                fixed: self.fixed(*row),
                varying: self.spread.points[*row],
            })
        };
        let mut samples: Vec<_> = rows.iter().filter_map(point).collect();
        let others = self.beside_points(rows).into_iter();
        samples.extend(others.map(|(_, left)| Sample {
            error: left.error * freedom,
            ..left
        }));
        likeliest(&samples, 6.0)
    }
}

/// What repeats show of the noise.
pub(super) struct RepeatedNoise {
    /// By what the stated standard deviations of points are multiplied.
    pub(crate) scale: f64,
    pub(crate) joints: JointRepeatability,
}

/// What something is off by, with its covariance.
struct Sample {
    error: Vector3<f64>,
    /// Of the instrument.
    fixed: Matrix3<f64>,
    /// By the joints, per squared deviation.
    varying: Matrix3<f64>,
}

/// Pairs of rows that measured one target in one pose again.
pub(super) struct RepeatPairs {
    pairs: Vec<[usize; 2]>,
    /// Whether the arm was elsewhere between the rows of some: what changes with time or side of approach is then in their difference.
    pub(crate) are_returns: bool,
}

impl RepeatPairs {
    /// Right after each other, where those are enough; else also returns, those after a shorter time, which drifts spoil least.
    pub(crate) fn of(data: &Measurements, rows: &[usize]) -> Self {
        let [mut pairs, returns] = Self::all(data, rows);
        let are_returns = pairs.len() < *REPEATS && !returns.is_empty();
        if are_returns {
            pairs.extend(shortest(returns));
        }
        pairs.sort_unstable_by_key(|pair| pair[1]);
        Self { pairs, are_returns }
    }

    /// Returns alone; none where they are too few.
    pub(crate) fn returns(data: &Measurements, rows: &[usize]) -> Option<Self> {
        let [_, returns] = Self::all(data, rows);
        let mut pairs = shortest(returns);
        pairs.sort_unstable_by_key(|pair| pair[1]);
        (pairs.len() >= *FEW).then_some(Self {
            pairs,
            are_returns: true,
        })
    }

    /// Those right after each other, and those between which the arm was elsewhere.
    fn all(data: &Measurements, rows: &[usize]) -> [Vec<[usize; 2]>; 2] {
        if data.in_motion(rows) {
            // Rows of a halt tell nothing of what the joints do on the way.
            return [Vec::new(), Vec::new()];
        }
        let poses = Poses::of(data, rows);
        let others = without_points(data, &poses);
        let repeated = poses.repeated().chain(&others);
        let pairs = repeated.flat_map(|rows| rows.windows(2).map(|pair| [pair[0], pair[1]]));
        let at_once = |[a, b]: &[usize; 2]| {
            let [from, to] = [data.rank_in_time(*a), data.rank_in_time(*b)];
            let mut between = (from.min(to) + 1..from.max(to)).map(|place| data.at_place(place));
            between.all(|k| data.near_pose(*a, k))
        };
        let (at_once, returns) = pairs.partition(at_once);
        [at_once, returns]
    }

    /// What the pairs show of the instrument's noise, with the joints' repeatability at that: where they follow each other at once, are enough,
    /// and are clear evidence of another noise than the stated one. Where noise `lasts` from pose to pose, shots of a standing arm agree better than
    /// it is small.
    pub(crate) fn noise(&self, rows: PredictedRows, lasts: bool) -> RepeatedNoise {
        let joints = self.repeatability(rows);
        let stated = RepeatedNoise { scale: 1.0, joints };
        let samples = self.point_samples(rows);
        let Some(shown) =
            scale_of(&samples).filter(|_| !self.are_returns && samples.len() >= *REPEATS)
        else {
            return stated;
        };
        // Mistakes speak for no noise.
        let mut usual = samples;
        usual.retain(|one| one.square() < *CAP * shown * shown);
        let deviance = |scale: f64, sigma: f64| {
            let each = usual.iter().map(|one| one.deviance(scale, sigma));
            each.sum::<f64>()
        };
        let best_joints = |scale: f64| {
            let sigmas = std::iter::once(0.0).chain(deviations());
            let all = sigmas.map(|sigma| (deviance(scale, sigma), sigma));
            let best = all.min_by(|a, b| a.0.total_cmp(&b.0));
            best.unwrap_or((f64::INFINITY, 0.0))
        };
        let scales = grid(SMALLEST * shown, LARGEST * shown, STEPS / 3);
        let costs = scales.map(|scale| (best_joints(scale).0, scale));
        let best = costs.min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((cost, scale)) = best else {
            return stated;
        };
        let differs = (scale - 1.0).abs() > *SETTLED * scale.max(1.0) && !(lasts && scale < 1.0);
        if !differs || cost > best_joints(1.0).0 - *CLEARER {
            return stated;
        }
        for sample in &mut usual {
            sample.fixed *= scale * scale;
        }
        RepeatedNoise {
            scale,
            joints: JointRepeatability {
                sigma: likeliest(&usual, 2.0),
                ..joints
            },
        }
    }

    /// What points differ by beyond the motion that the model knows between them.
    fn point_samples(&self, rows: PredictedRows) -> Vec<Sample> {
        let data = rows.data;
        let predicted = rows.model.predict(data);
        let one = |[a, b]: &[usize; 2]| {
            let known = match self.are_returns || !data.same_pose(*a, *b) {
                true => predicted[*b] - predicted[*a],
                false => Vector3::zeros(),
            };
            Some(Sample {
                error: data.point(*b)? - data.point(*a)? - known,
                fixed: rows.fixed(*a) + rows.fixed(*b),
                varying: rows.spread.points[*b] * 2.0,
            })
        };
        self.pairs.iter().filter_map(one).collect()
    }

    /// The joints' repeatability from the differences within pairs beyond the motion that the model knows between them.
    pub(crate) fn repeatability(&self, rows: PredictedRows) -> JointRepeatability {
        let repeats = self.pairs.len();
        let sigma = match repeats < *FEW {
            true => 0.0,
            false => likeliest(&self.samples(rows), 2.0),
        };
        JointRepeatability { sigma, repeats }
    }

    /// What everything that the pairs measured differs by.
    fn samples(&self, rows: PredictedRows) -> Vec<Sample> {
        let data = rows.data;
        let mut samples = self.point_samples(rows);
        let same_anchor = |[a, b]: &&[usize; 2]| data.anchor(*a) == data.anchor(*b);
        for [a, b] in self.pairs.iter().filter(same_anchor) {
            let [from, to] = [a, b].map(|row| rows.beside_points(&[*row]));
            let both = to.iter().filter_map(|(kind, to)| {
                let (_, from) = from.iter().find(|from| from.0 == *kind)?;
                Some((from, to))
            });
            // On lines that hold nothing the error is none and the variance a constant.
            samples.extend(both.map(|(from, to)| Sample {
                error: to.error - from.error,
                fixed: from.fixed + to.fixed,
                varying: from.varying + to.varying,
            }));
        }
        samples
    }
}

/// The rows of a pose that measured other than whole points of one target, from one anchor, where there are several.
fn without_points(data: &Measurements, poses: &Poses) -> Vec<Vec<usize>> {
    let measured =
        |row: &usize| !data.has_point(*row) && values(data, *row) > data.points.axes(*row);
    let same =
        |a: usize, b: usize| data.target(a) == data.target(b) && data.anchor(a) == data.anchor(b);
    let mut out: Vec<Vec<usize>> = Vec::new();
    for pose in poses.all() {
        let first = out.len();
        for row in pose.iter().filter(|row| measured(row)) {
            match out[first..].iter_mut().find(|rows| same(rows[0], *row)) {
                Some(rows) => rows.push(*row),
                None => out.push(vec![*row]),
            }
        }
    }
    out.retain(|rows| rows.len() > 1);
    out
}

/// Returns after the shortest times, half of them.
fn shortest(mut returns: Vec<[usize; 2]>) -> Vec<[usize; 2]> {
    returns.sort_unstable_by_key(|[a, b]| (b - a, *b));
    returns.truncate(returns.len().div_ceil(2).max(*REPEATS));
    returns
}

/// By what stated standard deviations are multiplied for the usual sample to be as far off as it is; none without samples.
fn scale_of(samples: &[Sample]) -> Option<f64> {
    let mut squares: Vec<f64> = samples.iter().map(Sample::square).collect();
    nearest(&mut squares, 0.5)
        .map(|median| (median / *MEDIAN).sqrt())
        .filter(|scale| *scale > 0.0)
}

/// Standard deviations of the joints that are tried, rad.
fn deviations() -> impl Iterator<Item = f64> {
    grid(LOWEST, HIGHEST, STEPS)
}

/// So many numbers from one to another, each the same share larger.
fn grid(least: f64, greatest: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| least * libm::pow(greatest / least, k as f64 / (count - 1) as f64))
}

impl Sample {
    /// Squared, in the instrument's stated standard deviations.
    fn square(&self) -> f64 {
        self.square_in(&self.fixed)
    }

    fn square_in(&self, covariance: &Matrix3<f64>) -> f64 {
        covariance
            .try_inverse()
            .map_or(*CAP, |inverse| self.error.dot(&(inverse * self.error)))
    }

    /// -2 ln of its likelihood, up to a constant.
    fn deviance(&self, scale: f64, sigma: f64) -> f64 {
        let covariance = self.fixed * (scale * scale) + self.varying * (sigma * sigma);
        self.square_in(&covariance) + covariance.determinant().ln()
    }
}

/// The likeliest deviation; none unless it is better than none by `evidence`.
fn likeliest(samples: &[Sample], evidence: f64) -> f64 {
    let cost = |sigma: f64| -> f64 {
        let one = |sample: &Sample| {
            let covariance = sample.fixed + sample.varying * (sigma * sigma);
            sample.square_in(&covariance).min(*CAP) + covariance.determinant().ln()
        };
        samples.iter().map(one).sum()
    };
    let none = cost(0.0);
    let costs = deviations().map(|sigma| (cost(sigma), sigma));
    let best = costs.min_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(cost, _)| *cost < none - evidence)
        .map_or(0.0, |(_, sigma)| sigma)
}
