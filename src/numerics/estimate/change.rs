//! What changed on a robot between two recordings: the same parameters in both, a base of its own in each, and one more step
//! for every parameter that may have changed since.
//!
//! All is linear about the robust fits. With what both recordings share eliminated by QR, the steps are judged one by one and
//! taken in as long as they explain more than chance; sigmas include what the earlier recording did not know.

use crate::effect::names;
use crate::estimate::factor::{TriangularFactor, axpy};
use crate::estimate::fit::Session;
use crate::estimate::model::Model;
use crate::robot::{Anchor, Shape, Target};
use crate::spatial::{Pose, Twist};
use faer::Mat;
use nalgebra::Vector3;

/// A parameter's step from one recording to the other, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterChange {
    /// Position in the stack.
    pub parameter: usize,
    /// From the earlier recording to this one, SI.
    pub step: f64,
    /// One standard deviation of the step, SI.
    pub sigma: f64,
    /// Two-sided.
    pub p_value: f64,
    /// Order in which it was taken in, from 1.
    pub rank: Option<usize>,
}

/// Steps taken in at most.
const LIMIT: usize = 6;
/// A step is taken in where chance gives one as large in one robot of so many. The fleet's own limit is stricter.
const CHANCE: f64 = 1e-3;
/// Below this share of its own length a column is a combination of the others.
const DISTINCT: f64 = 1e-6;
/// Steps nearly as good as the best: an earlier one in the list is the better known cause.
const TIE: f64 = 0.99;

/// Tests every parameter but the base's, in order of precedence; both models have the same parameters.
pub fn changes(
    before: &Session,
    after: &Session,
    precedence: impl Fn(usize) -> usize,
) -> Vec<ParameterChange> {
    let stack = &before.model.stack;
    let base: Vec<usize> = stack.parameters_of(names::BASE_FRAME).collect();
    let shared: Vec<usize> = (0..stack.specs().len())
        .filter(|k| !base.contains(k))
        .collect();
    let mut reduced = Reduced::of(before, after, &shared, &base);
    let wide = |j: usize| stack.specs()[shared[j]].tolerance;
    let mut ranks: Vec<Option<usize>> = vec![None; shared.len()];
    for rank in 1..=LIMIT {
        let open: Vec<usize> = (0..shared.len())
            .filter(|j| ranks[*j].is_none())
            .filter(|j| reduced.sigma(*j).is_some_and(|s| s < wide(*j)))
            .collect();
        let score = |j: usize| reduced.step(j).abs() / reduced.sigma(j).unwrap_or(f64::INFINITY);
        let Some(best) = open.iter().map(|j| score(*j)).max_by(f64::total_cmp) else {
            break;
        };
        if chance(best) * open.len() as f64 > CHANCE {
            break;
        }
        let tied = open.into_iter().filter(|j| score(*j) >= TIE * best);
        let Some(chosen) = tied.min_by_key(|j| precedence(shared[*j])) else {
            break;
        };
        ranks[chosen] = Some(rank);
        reduced.take(chosen);
    }
    let found = (0..shared.len()).filter_map(|j| {
        // Those taken in are judged beside each other.
        let others = (0..ranks.len()).filter(|i| *i != j && ranks[*i].is_some());
        let alone = if ranks[j].is_some() {
            reduced.fresh_without(others)
        } else {
            reduced.clone()
        };
        let (step, sigma) = (alone.step(j), alone.sigma(j)?);
        (sigma < wide(j)).then(|| ParameterChange {
            parameter: shared[j],
            step,
            sigma,
            p_value: chance(step.abs() / sigma),
            rank: ranks[j],
        })
    });
    found.collect()
}

/// Two-sided chance of a normal variable so many standard deviations off.
fn chance(score: f64) -> f64 {
    libm::erfc(score / std::f64::consts::SQRT_2)
}

/// The steps' problem with everything else eliminated.
#[derive(Clone)]
struct Reduced {
    columns: Vec<Vec<f64>>,
    right: Vec<f64>,
    /// Before any was taken in.
    original: (Vec<Vec<f64>>, Vec<f64>),
    lengths: Vec<f64>,
    /// How large the noise is against what the weights say; never below one.
    scale: f64,
}

impl Reduced {
    fn of(before: &Session, after: &Session, shared: &[usize], base: &[usize]) -> Self {
        let order: Vec<usize> = shared.iter().chain(base).copied().collect();
        let [first, second] =
            [before, after].map(|one| one.problem().observe(one.model, &order).factor);
        let (s, b) = (shared.len(), base.len());
        let height = s + b + 1;
        // Columns: shared | base before | base after | steps | right side. Rows: before, after, what is known beforehand.
        let width = s + 2 * b + s + 1;
        let mut rows = Mat::zeros(2 * height + s, width);
        for i in 0..height {
            for j in 0..s + b {
                rows[(i, j)] = first.entry(i, j);
                let place = if j < s { j } else { j + b };
                rows[(height + i, place)] = second.entry(i, j);
                if j < s {
                    rows[(height + i, s + 2 * b + j)] = second.entry(i, j);
                }
            }
            // About the values before: what the later fit moved is for the steps to explain.
            let moved: f64 = (0..s)
                .map(|j| {
                    second.entry(i, j) * (after.model.x[shared[j]] - before.model.x[shared[j]])
                })
                .sum();
            rows[(i, width - 1)] = first.entry(i, s + b);
            rows[(height + i, width - 1)] = second.entry(i, s + b) + moved;
        }
        for (j, k) in shared.iter().enumerate() {
            let sigma = before.model.stack.specs()[*k].tolerance;
            rows[(2 * height + j, j)] = 1.0 / sigma;
            rows[(2 * height + j, width - 1)] = -before.model.x[*k] / sigma;
        }
        let whole = TriangularFactor::of(&rows);
        let start = s + 2 * b;
        let columns: Vec<Vec<f64>> = (0..s)
            .map(|j| (0..s).map(|i| whole.entry(start + i, start + j)).collect())
            .collect();
        let right: Vec<f64> = (0..s).map(|i| whole.entry(start + i, width - 1)).collect();
        let values = 3 * (before.rows.len() + after.rows.len());
        let freedom = values.saturating_sub(2 * s + 2 * b).max(1) as f64;
        let unexplained = whole.entry(width - 1, width - 1).powi(2);
        let lengths = (0..s)
            .map(|j| {
                (0..s + b + 1)
                    .map(|i| second.entry(i, j).powi(2))
                    .sum::<f64>()
                    .sqrt()
            })
            .collect();
        let original = (columns.clone(), right.clone());
        Self {
            columns,
            right,
            original,
            lengths,
            scale: (unexplained / freedom).sqrt().max(1.0),
        }
    }

    fn square(&self, j: usize) -> f64 {
        self.columns[j].iter().map(|value| value * value).sum()
    }
    fn step(&self, j: usize) -> f64 {
        self.columns[j]
            .iter()
            .zip(&self.right)
            .map(|(a, b)| a * b)
            .sum::<f64>()
            / self.square(j).max(f64::MIN_POSITIVE)
    }
    /// `None` where the rest can do the same.
    fn sigma(&self, j: usize) -> Option<f64> {
        let length = self.square(j).sqrt();
        (length > DISTINCT * self.lengths[j] && length > 0.0).then(|| self.scale / length)
    }

    /// Eliminates a step, so that the others are judged beside it.
    fn take(&mut self, j: usize) {
        let square = self.square(j);
        if square <= 0.0 {
            return;
        }
        let taken = self.columns[j].clone();
        let project = |column: &mut Vec<f64>| {
            let share = column.iter().zip(&taken).map(|(a, b)| a * b).sum::<f64>() / square;
            axpy(-share, &taken, column);
        };
        project(&mut self.right);
        self.columns
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| *i != j)
            .for_each(|(_, column)| project(column));
        self.columns[j].fill(0.0);
    }

    /// From the beginning, with others taken in.
    fn fresh_without(&self, others: impl Iterator<Item = usize>) -> Self {
        let (columns, right) = self.original.clone();
        let mut fresh = self.clone();
        (fresh.columns, fresh.right) = (columns, right);
        others.for_each(|other| fresh.take(other));
        fresh
    }
}

impl Model {
    /// Nominal and present value of a parameter of the stack, SI.
    pub fn standing(&self, parameter: usize) -> (f64, f64) {
        let change = (0.0, self.x.get(parameter).copied().unwrap_or_default());
        let found = self
            .stack
            .effects()
            .find(|(_, range)| range.contains(&parameter));
        let Some((effect, range)) = found else {
            return change;
        };
        let number = parameter - range.start;
        match effect.name() {
            names::BASE_FRAME => (
                component(self.stack.base(), number),
                component(&self.base(), number),
            ),
            names::ANCHOR => self.anchored(number).unwrap_or(change),
            names::TOOL_OFFSET => self.mounting(number, &self.x[range]).unwrap_or(change),
            _ => change,
        }
    }

    /// The `number`-th parameter of anchors at the start and now: a coordinate or a radius; of a plane its distance from the origin
    /// along its normal, or a tilt of that.
    fn anchored(&self, number: usize) -> Option<(f64, f64)> {
        let setup = self.robot.setup();
        let anchor_number = (0..setup.anchors.len())
            .rev()
            .find(|anchor_number| setup.first_of_anchor(*anchor_number) <= number)?;
        let axis = number - setup.first_of_anchor(anchor_number);
        let anchor = setup.anchors.get(anchor_number)?;
        let now = self.standing_anchor(anchor_number)?;
        match (anchor.shape, now.shape) {
            (Shape::Plane(before), Shape::Plane(normal)) if axis == 0 => {
                Some((before.dot(&anchor.place), normal.dot(&now.place)))
            }
            (Shape::Plane(before), Shape::Plane(normal)) => Some((
                Anchor::tilts(&before)[axis - 1],
                Anchor::tilts(&normal)[axis - 1],
            )),
            (Shape::Sphere(before), Shape::Sphere(radius)) if axis == 3 => Some((before, radius)),
            _ => Some((anchor.place[axis], now.place[axis])),
        }
    }

    /// The `number`-th parameter of targets with corrections `x`; none where the tool point is what is measured.
    fn mounting(&self, number: usize, x: &[f64]) -> Option<(f64, f64)> {
        let mut first = 0;
        for target in &self.robot.setup().targets {
            let width = if target.oriented { 6 } else { 3 };
            if number < first + width {
                let corrected = corrected(target, x.get(first..first + width)?);
                let axis = number - first;
                return Some((
                    self.beside_tool(&target.mounting, axis),
                    self.beside_tool(&corrected, axis),
                ));
            }
            first += width;
        }
        None
    }

    /// x, y, z from the tool point (m), or a component of the rotation vector from the tool frame (rad), base axes at the zero pose.
    fn beside_tool(&self, mounting: &Pose, axis: usize) -> f64 {
        let home = self.robot.home();
        component(
            &Pose::new(
                mounting.rotation * home.rotation.transpose(),
                mounting.translation - home.translation,
            ),
            axis,
        )
    }
}

/// The mounting after corrections as `tool_offset` makes them.
fn corrected(target: &Target, x: &[f64]) -> Pose {
    let mut twist = Twist::zeros();
    for (axis, value) in x.iter().enumerate() {
        if axis < 3 {
            twist[axis] += value;
        } else {
            twist +=
                crate::spatial::screw(&Vector3::ith(axis - 3, 1.0), &target.mounting.translation)
                    * *value;
        }
    }
    Pose::exp(&twist) * target.mounting
}

/// x, y, z (m) or a component of the rotation vector (rad).
fn component(pose: &Pose, axis: usize) -> f64 {
    if axis < 3 {
        pose.translation[axis]
    } else {
        pose.rotation_vector()[axis - 3]
    }
}
