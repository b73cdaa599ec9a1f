//! Poses measured more than once: pure error that no model can explain, how well joints repeat, and what the model lacks.
//!
//! Rows of one pose right after each other are one visit: the arm stood still and only the tracker's noise differs. Visits of a
//! pose differ by the joints' repeatability too: covariance s2 J J' of the point, s by restricted maximum likelihood.

use super::model::Model;
use crate::effect::{EffectContext, EffectStack, Load, arm_effect};
use crate::estimate::covariance::tail;
use crate::observation::{Residual, Weight};
use crate::robot::Measurements;
use crate::robot::pose_groups::{NEAR, SAME, STILL, grouped, near};
use nalgebra::{Matrix3, Vector3};

/// Rows grouped by pose and payload, near poses being one; poses in the order of their first rows, rows in the order of recording.
pub struct Poses {
    all: Vec<Vec<usize>>,
    /// Whole points of one target in one pose.
    points: Vec<Vec<usize>>,
}

/// What repeats say against a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeated {
    /// Poses with more than one row.
    pub poses: usize,
    /// Standard deviation per axis of rows about their pose's mean, m.
    pub noise: f64,
    /// Degrees of freedom of `noise`.
    pub freedom: usize,
    /// Whether the arm left some pose and came back; else `noise` lacks the joints' repeatability.
    pub revisited: bool,
    /// Mean square of what the model leaves between poses over that within: F, and the chance of more under a complete model.
    pub lack_of_fit: Option<(f64, f64)>,
}

impl Poses {
    /// Poses of some rows of a recording.
    pub fn of(data: &Measurements, rows: &[usize]) -> Self {
        // The neighbours of a row are always near in a recording of a moving arm.
        let limit = if data.in_motion(rows) { SAME } else { NEAR };
        let poses = grouped(
            rows,
            |row| data.q(row),
            limit,
            |a, b| data.payload[a] == data.payload[b],
        );
        let points = poses.iter().flat_map(|rows| points(data, rows)).collect();
        Self { all: poses, points }
    }

    /// The rows of every pose.
    pub fn all(&self) -> &[Vec<usize>] {
        &self.all
    }

    /// Points measured more than once: the rows of each target in each pose, where there are several.
    pub fn repeated(&self) -> impl Iterator<Item = &Vec<usize>> {
        self.points.iter().filter(|rows| rows.len() > 1)
    }

    /// What the repeats say against what a fit of `parameters` left of `whole` points. `None` without repeats.
    pub(crate) fn against<'a>(
        &self,
        model: &Model,
        data: &Measurements,
        whole: impl Iterator<Item = &'a Residual> + Clone,
        parameters: usize,
    ) -> Option<Repeated> {
        let (mut squares, mut whitened, mut freedom, mut revisited) = (0.0, 0.0, 0, false);
        for pose in self.repeated() {
            let points = in_first_pose(model, data, pose);
            let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            for (row, point) in pose.iter().zip(points) {
                let off = point - mean;
                squares += off.norm_squared();
                whitened += Weight::of(data, *row, 0.0).apply(&off).norm_squared();
            }
            freedom += 3 * (pose.len() - 1);
            revisited |= visits(data, pose).len() > 1;
        }
        if freedom == 0 {
            return None;
        }
        let total: f64 = whole
            .clone()
            .map(|residual| residual.whitened(data, 0.0).norm_squared())
            .sum();
        let between = (3 * whole.count())
            .checked_sub(parameters + freedom)
            .filter(|between| *between > 0);
        let lack_of_fit = between.filter(|_| whitened > 0.0).map(|between| {
            let ratio = (total - whitened).max(0.0) / between as f64 / (whitened / freedom as f64);
            (ratio, tail(ratio, between as f64, freedom as f64))
        });
        let noise = (squares / freedom as f64).sqrt();
        Some(Repeated {
            poses: self.repeated().count(),
            noise,
            freedom,
            revisited,
            lack_of_fit,
        })
    }

    /// One standard deviation (rad) by which revolute joints miss a pose that they return to. `None` where no pose was left and
    /// returned to, or where the tracker's noise explains the scatter.
    pub fn joint_repeatability(&self, model: &Model, data: &Measurements) -> Option<f64> {
        let groups: Vec<PoseGroup> = self
            .repeated()
            .filter_map(|pose| PoseGroup::of(model, data, pose))
            .collect();
        // A pose that scatters far more than the others saw a mistake or an event.
        let mut scatters: Vec<f64> = groups.iter().map(|group| group.scatter).collect();
        scatters.sort_unstable_by(f64::total_cmp);
        let limit = STRANGE * scatters.get(scatters.len() / 2)?;
        let groups: Vec<PoseGroup> = groups
            .into_iter()
            .filter(|group| group.scatter <= limit)
            .collect();
        let deviance = |log: f64| {
            groups
                .iter()
                .map(|group| group.deviance(log.exp()))
                .sum::<f64>()
        };
        let silent: f64 = groups.iter().map(|group| group.deviance(0.0)).sum();
        let grid = (0..=60).map(|k| FINEST.ln() + (COARSEST / FINEST).ln() * f64::from(k) / 60.0);
        let best = grid.min_by(|a, b| deviance(*a).total_cmp(&deviance(*b)))?;
        let step = (COARSEST / FINEST).ln() / 60.0;
        let log = minimum(deviance, best - step, best + step);
        (silent - deviance(log) > CLEAR).then(|| log.exp())
    }
}

/// A scatter of so many times the median one is strange: five times its standard deviation.
const STRANGE: f64 = 25.0;
/// Joint repeatability between these (rad) is looked for: 0.002 to 2000 arcsec.
const FINEST: f64 = 1e-8;
const COARSEST: f64 = 1e-2;
/// Fall of the deviance that chance alone makes once in a hundred recordings: half of chi-square's, since s cannot be negative.
const CLEAR: f64 = 5.4;

/// Points of near poses as they would have been measured in the first of them: less what the model moves them in between.
fn in_first_pose(model: &Model, data: &Measurements, rows: &[usize]) -> Vec<Vector3<f64>> {
    let exact = |row: &usize| near(data.q(rows[0]), data.q(*row), SAME);
    if rows.iter().all(exact) {
        return rows.iter().filter_map(|row| data.point(*row)).collect();
    }
    let mut scratch = model.stack.scratch(&model.robot);
    let mut predicted = |row: usize| model.place(data, row, &mut scratch).point;
    let first = predicted(rows[0]);
    rows.iter()
        .filter_map(|row| Some(data.point(*row)? - (predicted(*row) - first)))
        .collect()
}

/// The whole points among the rows of a pose, by target.
fn points(data: &Measurements, pose: &[usize]) -> Vec<Vec<usize>> {
    let mut by_target: Vec<Vec<usize>> = Vec::new();
    for row in pose.iter().filter(|row| data.has_point(**row)) {
        match by_target
            .iter_mut()
            .find(|rows| data.target(rows[0]) == data.target(*row))
        {
            Some(rows) => rows.push(*row),
            None => by_target.push(vec![*row]),
        }
    }
    by_target
}

/// Rows of a point between which the arm did not move: nothing but rows of the same pose lies between.
pub(crate) fn visits<'a>(data: &Measurements, point: &'a [usize]) -> Vec<&'a [usize]> {
    let stands = |a: usize, b: usize| {
        data.payload[a] == data.payload[b] && near(data.q(a), data.q(b), STILL)
    };
    point
        .chunk_by(|a, b| (a + 1..=*b).all(|next| stands(*a, next)))
        .collect()
}

/// A pose that was left and returned to.
struct PoseGroup {
    /// Mean point of each visit (m) and the covariance of its noise.
    visits: Vec<(Vector3<f64>, Matrix3<f64>)>,
    /// J J' of the revolute joints, m2 per rad2.
    lever: Matrix3<f64>,
    /// Mean square of the visits about their mean, m2.
    scatter: f64,
}

impl PoseGroup {
    fn of(model: &Model, data: &Measurements, pose: &[usize]) -> Option<Self> {
        let mut points = in_first_pose(model, data, pose).into_iter();
        let visits: Vec<(Vector3<f64>, Matrix3<f64>)> = visits(data, pose)
            .into_iter()
            .map(|rows| {
                let variance = rows
                    .iter()
                    .map(|row| data.points.sigma[*row].map(|sigma| sigma * sigma))
                    .sum::<Vector3<f64>>();
                let count = rows.len() as f64;
                let mean = points.by_ref().take(rows.len()).sum::<Vector3<f64>>() / count;
                (mean, Matrix3::from_diagonal(&(variance / (count * count))))
            })
            .collect();
        let middle =
            visits.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / visits.len() as f64;
        let squares: f64 = visits
            .iter()
            .map(|(point, _)| (point - middle).norm_squared())
            .sum();
        let freedom = visits.len().checked_sub(1).filter(|freedom| *freedom > 0)?;
        let lever = levers(model, data, pose.first().copied().into_iter()).pop()?;
        Some(Self {
            visits,
            lever,
            scatter: squares / freedom as f64,
        })
    }

    /// -2 log of the restricted likelihood of a joint repeatability (rad), but for a constant.
    fn deviance(&self, sigma: f64) -> f64 {
        let (mut sum, mut information, mut weighted) = (0.0, Matrix3::zeros(), Vector3::zeros());
        let mut inverses = Vec::with_capacity(self.visits.len());
        for (point, noise) in &self.visits {
            let covariance = noise + self.lever * (sigma * sigma);
            let inverse = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
            sum += covariance.determinant().ln();
            information += inverse;
            weighted += inverse * point;
            inverses.push(inverse);
        }
        sum += information.determinant().ln();
        let middle = information.try_inverse().unwrap_or_else(Matrix3::zeros) * weighted;
        let squares = self
            .visits
            .iter()
            .zip(&inverses)
            .map(|((point, _), inverse)| (point - middle).dot(&(inverse * (point - middle))));
        sum + squares.sum::<f64>()
    }
}

/// J J' (m2 per rad2, tracker frame) of the revolute joints at every row.
fn levers(
    model: &Model,
    data: &Measurements,
    rows: impl Iterator<Item = usize>,
) -> Vec<Matrix3<f64>> {
    let setting = EffectContext {
        base: model.base(),
        load: Load::GravityTorque,
    };
    let zeros = arm_effect("joint_offset", &setting);
    let joints = Model::nominal(
        model.robot.clone(),
        EffectStack::new(&model.robot, setting.base, zeros.into_iter().collect()),
    );
    let mut scratch = joints.stack.scratch(&joints.robot);
    let mut columns = vec![Vector3::zeros(); joints.robot.joints()];
    rows.map(|row| {
        columns.fill(Vector3::zeros());
        joints.stack.derivatives(
            &joints.robot,
            data,
            row,
            &joints.x,
            &mut scratch,
            |joint, derivative| {
                if joints.robot.is_revolute(joint) {
                    columns[joint] += derivative;
                }
            },
        );
        columns
            .iter()
            .map(|column| column * column.transpose())
            .sum()
    })
    .collect()
}

/// Covariance (m2) that joints make of every row's point which repeat to `sigma` (rad, one standard deviation).
pub fn spread(model: &Model, data: &Measurements, sigma: f64) -> Vec<Matrix3<f64>> {
    levers(model, data, 0..data.rows())
        .into_iter()
        .map(|lever| lever * (sigma * sigma))
        .collect()
}

/// Golden section: where a function of one valley between `low` and `high` is least.
fn minimum(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    for _ in 0..30 {
        let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if value(left) < value(right) {
            high = right
        } else {
            low = left
        }
    }
    0.5 * (low + high)
}

/// Beyond so many autocorrelation times the sum is noise.
const WINDOW: f64 = 5.0;
/// Beyond this share of the rows nothing can be said.
const FARTHEST: usize = 20;
/// A correlation within so many standard deviations of chance is none.
const CHANCE: f64 = 3.0;

/// How many rows in a row count as one, from `each` numbers a row in the order of recording; at least 1.
pub fn autocorrelation_time(residual: &[f64], each: usize) -> f64 {
    let rows = residual.len() / each.max(1);
    let square: f64 = residual.iter().map(|value| value * value).sum();
    if rows < FARTHEST || square == 0.0 {
        return 1.0;
    }
    let chance = CHANCE / (residual.len() as f64).sqrt();
    let mut time = 1.0;
    for lag in 1..=rows / FARTHEST {
        let product: f64 = residual
            .iter()
            .zip(&residual[lag * each..])
            .map(|(a, b)| a * b)
            .sum();
        let correlation = product / square;
        if correlation < chance || lag as f64 > WINDOW * time {
            break;
        }
        time += 2.0 * correlation;
    }
    time
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    /// Noise of which `share` lasts from row to row.
    fn lasting(share: f64) -> Vec<f64> {
        let mut dice = ChaCha8Rng::seed_from_u64(5);
        let mut now = [0.0; 3];
        let fresh = (1.0 - share * share).sqrt();
        let row = |_| {
            now = now.map(|value| share * value + fresh * (dice.random::<f64>() - 0.5));
            now
        };
        (0..4000).flat_map(row).collect()
    }

    #[test]
    fn lasting_noise_counts_for_as_many_rows_as_theory_says() {
        // 1 + 2 sum share^k = (1 + share) / (1 - share).
        for (share, expected) in [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)] {
            let found = autocorrelation_time(&lasting(share), 3);
            assert!((found / expected - 1.0).abs() < 0.25, "{share}: {found}");
        }
    }
}
