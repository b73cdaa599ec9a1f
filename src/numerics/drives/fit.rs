//! Everything at once, in the roll-out itself: Gauss-Newton on the numbers of causes and on inertials under their tolerance.

use crate::independence::independent;
use crate::key::Key;
use crate::normal::Normal;
use crate::problem::{Drives, FREE};
use crate::rollout::{Direction, Which, roll};
use crate::sizes::{Sizes, furthest};
use calib_engine::Accepted;
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Steps of Gauss and Newton at most, and the fall of the objective, and the share of it, below which no further one is made.
struct Patience {
    steps: usize,
    fall: f64,
    share: f64,
    /// Share of a step below which none is tried.
    least: f64,
}

/// Of a trial among many, and of what stands.
const TRIAL: Patience = Patience {
    steps: 6,
    fall: 0.5,
    share: 5e-4,
    least: 0.1,
};
const STANDS: Patience = Patience {
    steps: 10,
    fall: 0.05,
    share: 1e-5,
    least: 0.02,
};

/// Times what a linear step promises that a fit may still gain.
const REACH: f64 = 3.0;

/// Model error of a cause, a share of the rms of its effect, and its degrees of freedom: friction, gears and integrators of real
/// arms follow no formula to a hundredth; what a drive computes and how rigid bodies move is exact but for rounding, stamps and steps.
const FORM_ERRS: f64 = 0.02;
const EXACT_ERRS: f64 = 0.0005;
const WAYS: f64 = 10.0;

/// A fitted model.
#[derive(Debug, Clone)]
pub struct DriveFit {
    /// Causes with their numbers.
    pub set: Vec<Accepted<Key>>,
    /// Inertials, in standard deviations of their tolerance, five a link.
    pub inertia: Vec<f64>,
    /// Simulated angles of fitted rows, rad.
    pub angles: Vec<f64>,
    /// Whitened squared residual of fitted rows.
    pub square: f64,
    /// Fitted numbers.
    pub freedom: f64,
    /// Effective rows per row, estimated from this model's residual.
    pub independence: f64,
    /// The same from the residual of a rich model, the largest estimate so far.
    pub rich: f64,
    /// By joint, the factor by which the model error of the causes increases the noise.
    pub doubt: Vec<f64>,
    /// Squared distance of all numbers from where they are expected, in their usual sizes.
    pub penalty: f64,
    /// Covariance of the numbers of each member, as they are fitted.
    pub covariances: Vec<DMatrix<f64>>,
    /// ln of the prior odds of the set.
    pub log_prior: f64,
    /// Products of the columns in units of their priors.
    pub(crate) gram: DMatrix<f64>,
    /// Cause and number of each column beyond the inertials.
    pub(crate) numbers: Vec<(usize, usize)>,
    /// Responses as they were when all of them were made anew, which hardly change with a further cause, and those to that cause.
    responses: Arc<Responses>,
}

/// Responses to inertials and to numbers of causes.
#[derive(Debug, Clone, Default)]
struct Responses {
    /// Of each column beyond the inertials.
    numbers: Vec<(Key, usize)>,
    /// Each rows x joints, rad.
    changes: Vec<Vec<f64>>,
}

/// Which columns are made anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anew {
    /// All.
    All,
    /// Those of causes.
    Causes,
    /// Those of which no response is known.
    Unknown,
}

/// Where a column comes from: a direction, or a roll-out of its own (rows x joints, rad); and the size of the change.
enum Source {
    Carried(usize, f64),
    Rolled(Vec<f64>, f64),
    /// One of the responses that are known.
    Known(Arc<Responses>, usize),
}

/// Columns of all that is free in a model.
pub(crate) struct BaseColumns {
    /// Those that the step's derivative carries, the first of a roll-out's.
    pub(crate) directions: Vec<Direction>,
    sources: Vec<Source>,
    /// Of the priors.
    pub(crate) precision: Vec<f64>,
    /// Cause and number of each column beyond the inertials.
    pub(crate) numbers: Vec<(usize, usize)>,
}

impl BaseColumns {
    pub(crate) fn count(&self) -> usize {
        self.sources.len()
    }

    /// The columns at a row and joint, whitened.
    pub(crate) fn at(&self, at: usize, change: &[f64], sigma: f64, out: &mut [f64]) {
        for (out, source) in out.iter_mut().zip(&self.sources) {
            *out = match source {
                Source::Carried(k, size) => change[*k] / (size * sigma),
                Source::Rolled(changes, size) => changes[at] / (size * sigma),
                Source::Known(responses, k) => responses.changes[*k][at] / sigma,
            };
        }
    }
}

impl DriveFit {
    /// Number of the known response to a number of a cause.
    fn known(&self, key: Key, number: usize) -> Option<usize> {
        let numbers = &self.responses.numbers;
        let at = numbers.iter().position(|one| *one == (key, number))?;
        Some(self.inertia.len() + at)
    }
}

impl Drives {
    /// Columns of inertials and of the numbers of a fit.
    pub(crate) fn base_columns(&self, fit: &DriveFit, anew: Anew) -> BaseColumns {
        let now = self.physics(&fit.inertia, &fit.set);
        let mut columns = BaseColumns {
            directions: Vec::new(),
            sources: Vec::new(),
            precision: Vec::new(),
            numbers: Vec::new(),
        };
        for k in 0..fit.inertia.len() {
            columns.precision.push(1.0);
            if anew != Anew::All && k < fit.responses.changes.len() {
                columns
                    .sources
                    .push(Source::Known(fit.responses.clone(), k));
                continue;
            }
            let mut inertia = fit.inertia.clone();
            inertia[k] += 0.1;
            let changed = self.physics(&inertia, &fit.set);
            columns
                .sources
                .push(Source::Carried(columns.directions.len(), 0.1));
            columns.directions.push(Direction::between(&now, &changed));
        }
        for (c, accepted) in fit.set.iter().enumerate() {
            let shape = &accepted.cell.shapes[accepted.shape];
            let sizes = Sizes::of(accepted);
            for (k, usual) in shape
                .usual
                .iter()
                .enumerate()
                .filter(|(_, usual)| **usual > 0.0)
            {
                let by = if sizes.numbers.contains(&k) {
                    sizes.precision()
                } else {
                    1.0
                };
                columns.precision.push(by / (usual * usual));
                columns.numbers.push((c, k));
                let known = fit.known(accepted.cell.key, k);
                if let Some(at) = known.filter(|_| anew == Anew::Unknown) {
                    columns
                        .sources
                        .push(Source::Known(fit.responses.clone(), at));
                    continue;
                }
                let memory = accepted.cell.key.has_memory();
                let size = if memory { 0.02 * usual } else { 2e-3 * usual };
                let mut set = fit.set.clone();
                set[c].numbers[k] += size;
                let changed = self.physics(&fit.inertia, &set);
                let source = match memory {
                    true => {
                        let mut rolled = self.angles(&changed, Which::Fitted);
                        for (angle, before) in rolled.iter_mut().zip(&fit.angles) {
                            *angle = if angle.is_finite() {
                                *angle - before
                            } else {
                                0.0
                            };
                        }
                        Source::Rolled(rolled, size)
                    }
                    false => {
                        columns.directions.push(Direction::between(&now, &changed));
                        Source::Carried(columns.directions.len() - 1, size)
                    }
                };
                columns.sources.push(source);
            }
        }
        columns
    }

    /// Simulates a fit as it is: its angles and their whitened square; infinite where the simulation runs away.
    fn evaluate(&self, fit: &mut DriveFit) {
        fit.angles = self.angles(&self.physics(&fit.inertia, &fit.set), Which::Fitted);
        let square: f64 = self.squares(fit).iter().sum();
        fit.square = if square.is_finite() {
            square
        } else {
            f64::INFINITY
        };
    }

    /// By joint, the factor by which the model error of a fit's causes increases the noise: a share of their effect with few degrees of
    /// freedom, where noise has as many as there are independent rows.
    fn doubt(&self, fit: &DriveFit) -> Vec<f64> {
        let n = self.chain.joints();
        if fit.set.is_empty() {
            return vec![1.0; n];
        }
        let exact: Vec<Accepted<Key>> = (fit.set.iter())
            .filter(|one| one.cell.key.is_exact())
            .cloned()
            .collect();
        let rolled =
            |set: &[Accepted<Key>]| self.angles(&self.physics(&fit.inertia, set), Which::Fitted);
        let nothing = rolled(&[]);
        let mut errs = vec![0.0; n];
        let mut add = |share: f64, with: &[f64], without: &[f64]| {
            let by = share * share * fit.share() / WAYS;
            let effects = self.effects(with, without).into_iter();
            (errs.iter_mut().zip(effects)).for_each(|(err, effect)| *err += by * effect);
        };
        match exact.len() {
            0 => add(FORM_ERRS, &fit.angles, &nothing),
            count if count == fit.set.len() => add(EXACT_ERRS, &fit.angles, &nothing),
            _ => {
                let exact = rolled(&exact);
                add(FORM_ERRS, &fit.angles, &exact);
                add(EXACT_ERRS, &exact, &nothing);
            }
        }
        errs.into_iter().map(|err| (1.0 + err).sqrt()).collect()
    }

    /// By joint, the whitened squared change between two simulations.
    fn effects(&self, with: &[f64], without: &[f64]) -> Vec<f64> {
        let n = self.chain.joints();
        let mut effects = vec![0.0; n];
        for row in self.fitted() {
            for (joint, effect) in effects.iter_mut().enumerate() {
                let at = row * n + joint;
                let [low, high] = self.usual[joint].range;
                // Where the one or the other runs away no effect is larger than the motion.
                let most = high - low;
                let change = with[at] - without[at];
                let change = if change.is_finite() {
                    change.abs().min(most)
                } else {
                    most
                };
                *effect += (change / self.sigma[at]).powi(2);
            }
        }
        effects
    }

    /// Fits inertials and a set's numbers from where they are; stops where evidence `least` is out of reach.
    pub(crate) fn fitted_with(
        &self,
        set: &[Accepted<Key>],
        before: Option<&DriveFit>,
        anew: bool,
        least: f64,
    ) -> DriveFit {
        let anew = anew || before.is_none();
        let patience = if anew { &STANDS } else { &TRIAL };
        let n = self.chain.joints();
        let inertia = before.map_or_else(|| vec![0.0; FREE * n], |fit| fit.inertia.clone());
        let freedom = (self.fitted().count() * n) as f64;
        let mut fit = DriveFit {
            set: set.to_vec(),
            inertia,
            angles: vec![0.0; self.recording.angle.len()],
            square: f64::INFINITY,
            freedom,
            independence: before.map_or(1.0, |fit| fit.independence),
            rich: before.map_or(0.0, |fit| fit.rich),
            doubt: before.map_or_else(|| vec![1.0; n], |fit| fit.doubt.clone()),
            penalty: 0.0,
            covariances: Vec::new(),
            log_prior: set
                .iter()
                .map(|one| one.cell.log_prior + one.cell.shapes[one.shape].log_weight)
                .sum(),
            gram: DMatrix::zeros(0, 0),
            numbers: Vec::new(),
            responses: before.map_or_else(Default::default, |fit| fit.responses.clone()),
        };
        // Columns that are roll-outs of their own are dear: they wait until the step is known to be good.
        let dear = set.iter().any(|one| {
            let key = one.cell.key;
            key.has_memory() && (anew || fit.known(key, 0).is_none())
        });
        let stands = anew && !set.is_empty();
        if dear || stands {
            self.evaluate(&mut fit);
        }
        if stands {
            if before.is_none() {
                fit.independence = self.independence_of(&fit);
            }
            fit.doubt = self.doubt(&fit);
        }
        let first = if anew { Anew::All } else { Anew::Unknown };
        // Of a trial the responses to torques in proportion to their numbers hold from the beginning, all others are made anew.
        let is_proportional = set.iter().all(|one| {
            let key = one.cell.key;
            fit.known(key, 0).is_some() || key.is_proportional()
        });
        let hold = anew || is_proportional;
        let is_rolled = dear || stands;
        let (mut columns, mut normal) = self.looked(&mut fit, first, (hold, is_rolled));
        if before.is_none() {
            fit.independence = self.independence_of(&fit);
        }
        let weigh = |fit: &DriveFit| fit.share() / (fit.square / freedom).max(1.0);
        let mut is_new = true;
        for step in 1..=patience.steps {
            if !fit.square.is_finite() || columns.count() == 0 {
                break;
            }
            let weight = weigh(&fit);
            let gram = normal.gram_matrix() * weight;
            let precision = DVector::from_column_slice(&columns.precision);
            let gradient = DVector::from_column_slice(&normal.gradient) * weight
                - self.distances(&fit, &columns).component_mul(&precision);
            let whole = gram + DMatrix::from_diagonal(&precision);
            let Some(factor) = whole.cholesky() else {
                break;
            };
            let change = factor.solve(&gradient);
            // The first step leads from where a linear scan began; from then on a step says how far the next ones may lead.
            let falls = REACH * gradient.dot(&change) / weight;
            if step > 1 && fit.reach(falls, fit.share()) < least {
                break;
            }
            let objective = weight * fit.square + self.penalty(&fit);
            let again = match anew {
                true if step < 2 => Anew::All,
                true => Anew::Causes,
                false => Anew::Unknown,
            };
            let hold = match anew {
                true => again == Anew::All,
                false => is_proportional,
            };
            let (mut by, mut moved) = (1.0, None);
            while by > patience.least {
                let mut trial = fit.clone();
                let nb = trial.inertia.len();
                for (k, number) in trial.inertia.iter_mut().enumerate() {
                    *number += by * change[k];
                }
                for ((c, k), by_column) in columns.numbers.iter().zip(change.iter().skip(nb)) {
                    let Accepted {
                        cell,
                        shape,
                        numbers,
                    } = &mut trial.set[*c];
                    let shape = &cell.shapes[*shape];
                    let most = furthest(shape, *k);
                    let [low, high] = shape.bounds[*k];
                    let number = numbers[*k] + (by * by_column).clamp(-most, most);
                    numbers[*k] = number.clamp(low, high);
                }
                let seen = if dear {
                    self.evaluate(&mut trial);
                    None
                } else {
                    Some(self.looked(&mut trial, again, (hold, false)))
                };
                let now = weight * trial.square + self.penalty(&trial);
                if now < objective {
                    moved = Some((trial, seen, objective - now));
                    break;
                }
                by *= 0.4;
            }
            let Some((next, seen, fall)) = moved else {
                break;
            };
            fit = next;
            (columns, normal) = seen.unwrap_or_else(|| self.looked(&mut fit, again, (hold, true)));
            is_new = again == Anew::All;
            // What is doubted is fitted as well as what is not.
            let doubt = fit
                .doubt
                .iter()
                .fold(1.0, |most: f64, doubt| most.max(*doubt));
            if fall < patience.fall.max(patience.share * objective) / (doubt * doubt) {
                break;
            }
        }
        if anew && !is_new {
            (columns, normal) = self.looked(&mut fit, Anew::All, (true, true));
        }
        fit.independence = self.independence_of(&fit);
        fit.penalty = self.penalty(&fit);
        fit.numbers.clone_from(&columns.numbers);
        let roots: Vec<f64> = columns.precision.iter().map(|p| 1.0 / p.sqrt()).collect();
        let gram = normal.gram_matrix();
        fit.gram = DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, k| {
            roots[i] * gram[(i, k)] * roots[k]
        });
        let none = |one: &Accepted<Key>| DMatrix::zeros(one.numbers.len(), one.numbers.len());
        fit.covariances = fit.set.iter().map(none).collect();
        let weight = weigh(&fit);
        let whole = &fit.gram * weight + DMatrix::identity(gram.nrows(), gram.ncols());
        if let Some(inverse) = whole.cholesky().map(|factor| factor.inverse()) {
            let nb = fit.inertia.len();
            for (a, (c, k)) in columns.numbers.iter().enumerate() {
                for (b, (_, l)) in (columns.numbers.iter().enumerate()).filter(|(_, of)| of.0 == *c)
                {
                    let scaled = inverse[(nb + a, nb + b)];
                    fit.covariances[*c][(*k, *l)] = scaled * roots[nb + a] * roots[nb + b];
                }
            }
        }
        fit
    }

    /// Columns around a fit and their products; whether responses are held from here on, and whether the fit is rolled out, so that it has its
    /// angles.
    fn looked(
        &self,
        fit: &mut DriveFit,
        anew: Anew,
        (hold, is_rolled): (bool, bool),
    ) -> (BaseColumns, Normal) {
        let columns = self.base_columns(fit, anew);
        let is_new = |source: &Source| !matches!(source, Source::Known(..));
        let kept = hold && columns.sources.iter().any(is_new);
        let normal = self.normal(fit, &columns, kept, is_rolled);
        (columns, normal)
    }

    /// Products of the columns around a fit, whose responses may be `kept`; the fit's angles are those of the same roll-out, where none was made
    /// yet or a column needs one.
    fn normal(
        &self,
        fit: &mut DriveFit,
        columns: &BaseColumns,
        kept: bool,
        is_rolled: bool,
    ) -> Normal {
        let n = self.chain.joints();
        let physics = self.physics(&fit.inertia, &fit.set);
        let count = columns.count();
        let mut normal = Normal::new(count);
        let mut x = vec![0.0; count];
        let mut changes = vec![vec![0.0; fit.angles.len()]; if kept { count } else { 0 }];
        let doubt = &fit.doubt;
        let mut add = |row: usize, joint: usize, angle: f64, change: &[f64]| {
            let at = row * n + joint;
            let sigma = self.sigma[at] * doubt[joint];
            columns.at(at, change, sigma, &mut x);
            changes
                .iter_mut()
                .zip(&x)
                .for_each(|(change, x)| change[at] = x * sigma);
            normal.add(&x, (self.recording.angle[at] - angle) / sigma);
        };
        if is_rolled && columns.directions.is_empty() {
            for row in self.fitted() {
                (0..n).for_each(|joint| add(row, joint, fit.angles[row * n + joint], &[]));
            }
        } else {
            let angles = &mut fit.angles;
            roll(
                &self.chain,
                &physics,
                &self.recording,
                &columns.directions,
                Which::Fitted,
                |row| {
                    for joint in 0..n {
                        angles[row.row * n + joint] = row.angle[joint];
                        add(row.row, joint, row.angle[joint], row.change[joint]);
                    }
                },
            );
        }
        if kept {
            let key = |(c, k): &(usize, usize)| (fit.set[*c].cell.key, *k);
            fit.responses = Arc::new(Responses {
                numbers: columns.numbers.iter().map(key).collect(),
                changes,
            });
        }
        let square = normal.square;
        fit.square = if square.is_finite() {
            square
        } else {
            f64::INFINITY
        };
        normal
    }

    /// Of every number from where it is expected.
    pub(crate) fn distances(&self, fit: &DriveFit, columns: &BaseColumns) -> DVector<f64> {
        let numbers = columns.numbers.iter().map(|(c, k)| {
            let one = &fit.set[*c];
            one.numbers[*k] - one.cell.shapes[one.shape].centre[*k]
        });
        DVector::from_iterator(columns.count(), fit.inertia.iter().copied().chain(numbers))
    }

    fn penalty(&self, fit: &DriveFit) -> f64 {
        let inertia: f64 = fit.inertia.iter().map(|x| x * x).sum();
        let numbers: f64 = fit
            .set
            .iter()
            .map(|one| {
                let shape = &one.cell.shapes[one.shape];
                let sizes = Sizes::of(one);
                let others = (0..one.numbers.len())
                    .filter(|k| shape.usual[*k] > 0.0 && !sizes.numbers.contains(k));
                let others: f64 = others
                    .map(|k| ((one.numbers[k] - shape.centre[k]) / shape.usual[k]).powi(2))
                    .sum();
                others + sizes.penalty()
            })
            .sum();
        inertia + numbers
    }

    /// Effective rows a row, by the correlation of the residual from row to row.
    fn independence_of(&self, fit: &DriveFit) -> f64 {
        let n = self.chain.joints();
        let (mut next, mut own) = (0.0, 0.0);
        let is_fitted = |row: usize| !self.recording.held_out[row];
        for trajectory in &self.recording.trajectories {
            let rows = trajectory.rows.clone();
            for at in rows
                .clone()
                .filter(|row| is_fitted(*row))
                .flat_map(|row| row * n..(row + 1) * n)
            {
                let whitened = |at: usize| {
                    (self.recording.angle[at] - fit.angles[at])
                        / (self.sigma[at] * fit.doubt[at % n])
                };
                let here = whitened(at);
                own += here * here;
                if at >= (rows.start + 1) * n && is_fitted(at / n - 1) {
                    next += here * whitened(at - n);
                }
            }
        }
        if own > 0.0 && own.is_finite() {
            independent(next / own)
        } else {
            1.0
        }
    }
}
