//! Commands and responses as a problem of the engine: residual is measured minus simulated angle, whitened by encoder and noise.

use crate::causes::{Key, Usual, cells};
use crate::chain::{Chain, STEP};
use crate::fit::{DriveFit, Normal};
use crate::independence::Rich;
use crate::physics::Physics;
use crate::recording::{Recording, Trajectory};
use crate::rollout::{Direction, Which, roll};
use calib_dynamics::InertialTolerance;
use calib_engine::{Accepted, Block, Cell, Problem, Rows, Scanned, ranked};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Inertial numbers of a link that are free within their tolerance: mass, centre, inertia.
pub(crate) const FREE: usize = 5;
/// rad rms of a unit of amplitude: the amplitudes of the table of causes are those of metres at a tool.
const UNIT: f64 = 10.0;
/// Standard deviations of what noise alone makes of a joint's squared residual, above which causes with a memory are asked there.
const ABOVE_NOISE: f64 = 4.0;

/// Share of the drive's error, rms, that is left at a joint whose gain may be far off.
const FAR_OFF: f64 = 0.5;

/// s of recordings in which causes are looked for, and of a window of longer ones.
const SEARCHED: f64 = 60.0;
const WINDOW: f64 = 8.0;

/// Longer steps that are tried, s, and the share of the noise, rms, that is the same motion: a drive four times as stiff errs four times as much.
const LONGER: [f64; 2] = [2.5e-3, 1.7e-3];
const SAME: f64 = 0.03;

/// A simulated arm and its recording.
pub struct Drives {
    /// What moves.
    pub chain: Chain,
    /// The simulation as its user has it.
    pub base: Physics,
    /// What was commanded and measured.
    pub recording: Recording,
    /// One standard deviation of the declared inertials.
    pub tolerance: InertialTolerance,
    /// Causes that are not tried.
    pub without: Vec<String>,
    pub(crate) sigma: Vec<f64>,
    pub(crate) usual: Vec<Usual>,
    /// s.
    pub(crate) duration: f64,
    /// Share of rows that are independent given a rich model, the most of all scans: a linear model says the more, the less is missing.
    rich: Mutex<f64>,
}

impl Drives {
    /// The problem of an arm and its recording.
    pub fn new(
        mut chain: Chain,
        base: Physics,
        recording: Recording,
        tolerance: InertialTolerance,
    ) -> Self {
        let sigma = recording.sigma();
        chain.step = step(&chain, &base, &recording, &sigma);
        let lasts = |t: &Trajectory| recording.time[t.rows.end - 1] - t.began;
        let duration = recording.trajectories.iter().map(lasts).fold(0.0, f64::max);
        let usual = usual(&chain, &base, &recording);
        Self {
            chain,
            base,
            recording,
            tolerance,
            without: Vec::new(),
            sigma,
            usual,
            duration,
            rich: Mutex::new(0.0),
        }
    }

    fn rich(&self) -> MutexGuard<'_, f64> {
        self.rich.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Share of the rows that are independent: by what a model leaves, or by what a rich one would.
    pub(crate) fn independence_given(&self, own: f64) -> f64 {
        own.max(*self.rich())
    }

    /// The problem of a part of a long recording, in which causes are looked for: windows of all trajectories, each from where it begins.
    pub(crate) fn part(&self) -> Option<Self> {
        let time = |row: usize| self.recording.time[row];
        let fitted = || {
            let all = self.recording.trajectories.iter();
            all.filter(|one| self.recording.is_fitted(one))
        };
        let lasts: f64 = fitted()
            .map(|one| time(one.rows.end - 1) - time(one.rows.start))
            .sum();
        let every = (lasts / SEARCHED).ceil() as usize;
        if every < 2 {
            return None;
        }
        let mut windows: Vec<Trajectory> = Vec::new();
        for one in fitted() {
            let mut from = one.rows.start;
            for row in one.rows.clone() {
                if time(row) - time(from) >= WINDOW || row + 1 == one.rows.end {
                    let began = one.began;
                    windows.push(Trajectory {
                        rows: from..row + 1,
                        began,
                    });
                    from = row + 1;
                }
            }
        }
        let kept = windows.into_iter().step_by(every);
        let kept = kept.filter(|one| one.rows.len() > 1 && self.recording.is_fitted(one));
        let recording = Recording {
            trajectories: kept.collect(),
            ..self.recording.clone()
        };
        Some(Self {
            chain: self.chain.clone(),
            base: self.base.clone(),
            recording,
            tolerance: self.tolerance,
            without: self.without.clone(),
            sigma: self.sigma.clone(),
            usual: self.usual.clone(),
            duration: self.duration,
            rich: Mutex::new(0.0),
        })
    }

    /// The simulation with inertials within their tolerance and a set of causes.
    pub(crate) fn physics(&self, inertia: &[f64], set: &[Accepted<Key>]) -> Physics {
        let mut physics = self.base.clone();
        for (link, by) in physics.bodies.links.iter_mut().zip(inertia.chunks(FREE)) {
            link.mass *= (1.0 + self.tolerance.mass_relative * by[0]).max(0.01);
            for axis in 0..3 {
                link.centre[axis] += self.tolerance.centre * by[1 + axis];
            }
            link.inertia *= (1.0 + self.tolerance.inertia_relative * by[4]).max(0.01);
        }
        for accepted in set {
            accepted
                .cell
                .key
                .apply(&accepted.numbers, &self.usual, self.duration, &mut physics);
        }
        physics
    }

    /// Simulated angles of rows, 0 of those that are not rolled out.
    pub(crate) fn angles(&self, physics: &Physics, which: Which) -> Vec<f64> {
        let n = self.chain.joints();
        let mut angles = vec![0.0; self.recording.angle.len()];
        roll(&self.chain, physics, &self.recording, &[], which, |row| {
            angles[row.row * n..(row.row + 1) * n].copy_from_slice(row.angle);
        });
        angles
    }

    /// Rows that are fitted.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = usize> + '_ {
        let trajectories = self.recording.trajectories.iter();
        let rows = trajectories.flat_map(|t| t.rows.clone());
        rows.filter(|row| !self.recording.held_out[*row])
    }

    /// Whitened squared residual of fitted rows, joint by joint.
    pub(crate) fn squares(&self, angles: &[f64]) -> Vec<f64> {
        let n = self.chain.joints();
        let mut squares = vec![0.0; n];
        for row in self.fitted() {
            for (joint, square) in squares.iter_mut().enumerate() {
                let at = row * n + joint;
                *square += ((self.recording.angle[at] - angles[at]) / self.sigma[at]).powi(2);
            }
        }
        squares
    }

    /// rad rms of the residual of each joint in fitted rows.
    fn errors_of(&self, angles: &[f64]) -> Vec<f64> {
        let n = self.chain.joints();
        let mut squares = vec![0.0; n];
        let mut rows = 0.0;
        for row in self.fitted() {
            rows += 1.0;
            for (joint, square) in squares.iter_mut().enumerate() {
                let at = row * n + joint;
                *square += (self.recording.angle[at] - angles[at]).powi(2);
            }
        }
        squares
            .iter()
            .map(|square| (square / rows).sqrt())
            .collect()
    }
}

/// The longest step, s, at which the simulation as it is goes where finer steps go, to a small share of the noise.
fn step(chain: &Chain, base: &Physics, recording: &Recording, sigma: &[f64]) -> f64 {
    let n = chain.joints();
    let rolled = |step: f64| {
        let mut chain = chain.clone();
        chain.step = step;
        let mut angles = Vec::new();
        roll(&chain, base, recording, &[], Which::Fitted, |row| {
            let at = row.row * n;
            let whitened = row.angle.iter().zip(&sigma[at..at + n]);
            angles.extend(whitened.map(|(angle, sigma)| angle / sigma));
        });
        angles
    };
    let fine = rolled(STEP);
    let near = |step: &f64| {
        let mut squares = vec![0.0; n];
        for (k, (a, b)) in rolled(*step).iter().zip(&fine).enumerate() {
            squares[k % n] += (a - b).powi(2);
        }
        let rows = (fine.len() / n) as f64;
        squares.iter().all(|square| *square < rows * SAME * SAME)
    };
    LONGER.into_iter().find(near).unwrap_or(STEP)
}

/// What the simulation as it is does.
fn usual(chain: &Chain, base: &Physics, recording: &Recording) -> Vec<Usual> {
    let n = chain.joints();
    let mut usual = vec![
        Usual {
            range: [f64::MAX, f64::MIN],
            ..Usual::default()
        };
        n
    ];
    let (mut rows, mut before) = (0.0, vec![0.0; n]);
    let mut before_row: Option<usize> = None;
    roll(chain, base, recording, &[], Which::Fitted, |row| {
        rows += 1.0;
        for (j, u) in usual.iter_mut().enumerate() {
            let command = recording.command[row.row * n + j];
            let angle = recording.angle[row.row * n + j];
            u.torque[0] += row.drive[j].powi(2);
            u.torque[1] = u.torque[1].max(row.drive[j].abs());
            u.speed[0] += row.speed[j].powi(2);
            u.speed[1] = u.speed[1].max(row.speed[j].abs());
            u.error += (command - row.angle[j]).powi(2);
            u.range = [u.range[0].min(angle), u.range[1].max(angle)];
            if let Some(last) = before_row.filter(|last| last + 1 == row.row) {
                let dt = recording.time[row.row] - recording.time[last];
                u.acceleration += ((row.speed[j] - before[j]) / dt).powi(2);
                let sent = (command - recording.command[last * n + j]) / recording.period;
                u.commanded = u.commanded.max(sent.abs());
            }
            before[j] = row.speed[j];
        }
        before_row = Some(row.row);
    });
    for u in &mut usual {
        for sum in [
            &mut u.torque[0],
            &mut u.speed[0],
            &mut u.error,
            &mut u.acceleration,
        ] {
            *sum = (*sum / rows).sqrt();
        }
    }
    usual
}

/// A column of a scan: a change that the step's derivative carries, or a roll-out of its own.
enum Column {
    Carried(Direction),
    Rolled(Vec<f64>),
}

impl Problem for Drives {
    type Key = Key;
    type Fit = DriveFit;

    fn scan(&self, fit: &DriveFit) -> Vec<Scanned<Key>> {
        let n = self.chain.joints();
        let now = self.physics(&fit.inertia, &fit.set);
        let rows_a_joint = self.fitted().count() as f64;
        let squares = self.squares(&fit.angles);
        let level = rows_a_joint * (1.0 + ABOVE_NOISE * (2.0 / rows_a_joint).sqrt());
        let above = |joint: usize| squares[joint] > level;
        let any = (0..n).any(above);
        let asked = |cell: &Cell<Key>| {
            let excluded = self.without.iter().any(|name| name == cell.cause.name)
                || fit.set.iter().any(|one| cell.key.excludes(one.cell.key));
            let seen = match cell.key {
                Key::Hold | Key::Sag => any,
                Key::Integral(j)
                | Key::SpeedLimit(j)
                | Key::Presliding(j)
                | Key::Backlash(j, _)
                | Key::Elasticity(j) => above(j),
                _ => true,
            };
            !excluded && seen
        };
        let all = cells(
            &self.base,
            &self.usual,
            self.duration,
            self.recording.period,
        );
        let mut all: Vec<Cell<Key>> = all.into_iter().filter(asked).collect();
        // A gain that is far off shows in the residual: as much as the drive's own error.
        let residual = self.errors_of(&fit.angles);
        let is_far = |joint: usize| residual[joint] > FAR_OFF * self.usual[joint].error;
        for cell in &mut all {
            if let Key::Gain(from, to) = cell.key
                && !(from..=to).all(is_far)
            {
                cell.shapes.truncate(1);
            }
        }
        // Where each column comes from, in the order of cells, shapes and columns.
        let asked: Vec<(Key, &Vec<f64>)> = all
            .iter()
            .flat_map(|cell| {
                cell.shapes
                    .iter()
                    .flat_map(|shape| shape.columns.iter().map(|x| (cell.key, x)))
            })
            .collect();
        let columns: Vec<Column> = asked
            .par_iter()
            .map(|(key, x)| {
                let mut changed = now.clone();
                key.apply(x, &self.usual, self.duration, &mut changed);
                match key.is_rolled(x) {
                    true => {
                        let mut angles = self.angles(&changed, Which::Fitted);
                        for (angle, before) in angles.iter_mut().zip(&fit.angles) {
                            *angle = if angle.is_finite() {
                                *angle - before
                            } else {
                                0.0
                            };
                        }
                        Column::Rolled(angles)
                    }
                    false => Column::Carried(Direction::between(&now, &changed)),
                }
            })
            .collect();
        let base = self.base_columns(fit, true);
        let nb = base.count();
        let mut carried = base.directions.clone();
        let mut place = Vec::with_capacity(columns.len());
        for column in &columns {
            if let Column::Carried(direction) = column {
                place.push(Some(carried.len()));
                carried.push(direction.clone());
            } else {
                place.push(None);
            }
        }
        let mut blocks: Vec<(usize, usize)> = Vec::new();
        let mut from = 0;
        for shape in all.iter().flat_map(|cell| &cell.shapes) {
            blocks.push((from, shape.columns.len()));
            from += shape.columns.len();
        }
        let mut own = Normal::new(nb);
        let mut sums = Sums::new(nb, &blocks);
        let mut b = vec![0.0; nb];
        let mut rich = Rich::new(self, nb + columns.len());
        roll(
            &self.chain,
            &now,
            &self.recording,
            &carried,
            Which::Fitted,
            |row| {
                for joint in 0..n {
                    let at = row.row * n + joint;
                    let sigma = self.sigma[at];
                    let residual = (self.recording.angle[at] - row.angle[joint]) / sigma;
                    base.at(at, row.change[joint], sigma, &mut b);
                    own.add(&b, residual);
                    let changes = columns.iter().zip(&place);
                    let changes = changes.map(|(column, place)| match (column, place) {
                        (Column::Rolled(angles), _) => angles[at],
                        (_, Some(k)) => row.change[joint][*k],
                        _ => 0.0,
                    });
                    let whitened = changes.clone().map(|change| change / sigma);
                    rich.add(row.row, joint, residual, b.iter().copied().chain(whitened));
                    sums.add(&b, residual, sigma, changes);
                }
            },
        );
        sums.close();
        let independence = rich.independence();
        let most = self.rich().max(independence);
        *self.rich() = most;
        let freedom = rows_a_joint * n as f64;
        let scale = (fit.square / freedom).max(1.0);
        let precision = DVector::from_vec(base.precision.iter().map(|p| p * scale).collect());
        let gradient_of_base = DVector::from_column_slice(&own.gradient);
        let mut rows = Rows::new(
            (own.square, freedom),
            &own.gram_matrix(),
            gradient_of_base,
            &precision,
        );
        rows.square = rows.square.max(freedom);
        rows.independence = self.independence_given(fit.independence);
        rows.unit = UNIT;
        let mut next = 0;
        let mut scanned = Vec::new();
        for cell in all {
            let mut shapes = Vec::new();
            for shape in &cell.shapes {
                let (log, size) = rows.evidence(&sums.block(next, freedom));
                next += 1;
                shapes.push(begun(shape, log, &size));
            }
            scanned.push((cell, shapes));
        }
        ranked(scanned)
    }

    fn fit(&self, set: &[Accepted<Key>], before: Option<&DriveFit>) -> DriveFit {
        self.fitted_with(set, before, false)
    }

    fn settled(&self, fit: &DriveFit) -> DriveFit {
        self.fitted_with(&fit.set, Some(fit), true)
    }

    fn set(&self, fit: &DriveFit) -> Vec<Accepted<Key>> {
        fit.set.clone()
    }

    fn independence(&self, fit: &DriveFit) -> f64 {
        self.independence_given(fit.independence)
    }

    fn log_evidence(&self, fit: &DriveFit, independence: f64) -> f64 {
        fit.log_evidence(independence)
    }

    fn excludes(&self, one: &Key, other: &Key) -> bool {
        one.excludes(*other)
    }
}

/// Rows that are multiplied at once.
const BATCH: usize = 192;

/// Sums of products of a scan's columns, of their blocks with each other and of all with the base.
struct Sums<'a> {
    blocks: &'a [(usize, usize)],
    grams: Vec<DMatrix<f64>>,
    /// Of the base, and of the residual in the last line, with every column.
    cross: DMatrix<f64>,
    rms: Vec<f64>,
    /// Rows that are not multiplied yet: base and residual by row, row by column.
    base: DMatrix<f64>,
    batch: DMatrix<f64>,
    filled: usize,
}

impl<'a> Sums<'a> {
    fn new(base: usize, blocks: &'a [(usize, usize)]) -> Self {
        let count = blocks.iter().map(|(_, k)| k).sum();
        Self {
            blocks,
            grams: blocks.iter().map(|(_, k)| DMatrix::zeros(*k, *k)).collect(),
            cross: DMatrix::zeros(base + 1, count),
            rms: vec![0.0; count],
            base: DMatrix::zeros(base + 1, BATCH),
            batch: DMatrix::zeros(BATCH, count),
            filled: 0,
        }
    }

    /// A row: whitened base and residual; changes of all columns, which `sigma` whitens.
    fn add(&mut self, base: &[f64], residual: f64, sigma: f64, changes: impl Iterator<Item = f64>) {
        let at = self.filled;
        let mut column = self.base.column_mut(at);
        for (to, from) in column.iter_mut().zip(base.iter().chain([&residual])) {
            *to = *from;
        }
        let batch = self.batch.as_mut_slice();
        for (c, change) in changes.enumerate() {
            self.rms[c] += change * change;
            batch[c * BATCH + at] = change / sigma;
        }
        self.filled += 1;
        if self.filled == BATCH {
            self.close();
        }
    }

    fn close(&mut self) {
        self.base
            .columns_mut(self.filled, BATCH - self.filled)
            .fill(0.0);
        self.batch
            .rows_mut(self.filled, BATCH - self.filled)
            .fill(0.0);
        self.cross.gemm(1.0, &self.base, &self.batch, 1.0);
        for ((from, k), gram) in self.blocks.iter().zip(&mut self.grams) {
            for i in 0..*k {
                for j in i..*k {
                    let by = self
                        .batch
                        .column(from + i)
                        .dot(&self.batch.column(from + j));
                    gram[(i, j)] += by;
                    gram[(j, i)] = gram[(i, j)];
                }
            }
        }
        self.filled = 0;
    }

    fn block(&self, at: usize, rows: f64) -> Block {
        let (from, k) = self.blocks[at];
        let base = self.cross.nrows() - 1;
        let rms = self.rms[from..from + k].iter();
        Block {
            gram: self.grams[at].clone(),
            gradient: DVector::from_fn(k, |j, _| self.cross[(base, from + j)]),
            cross: self.cross.view((0, from), (base, k)).into_owned(),
            rms: rms.map(|sum| (sum / rows).sqrt()).collect(),
        }
    }
}

/// The numbers from which a shape's fit begins.
fn begun(shape: &calib_engine::Shape, log: f64, size: &[f64]) -> (f64, Vec<f64>) {
    let whole = shape.columns.len() == 1 && shape.columns[0] == shape.start;
    if whole {
        // The other way round it is not this cause.
        let log = if size[0] > 0.0 {
            log
        } else {
            f64::NEG_INFINITY
        };
        return (log, shape.start.clone());
    }
    let mut numbers = shape.start.clone();
    for (column, size) in shape.columns.iter().zip(size) {
        for (k, number) in numbers.iter_mut().enumerate() {
            *number += size * (column[k] - shape.start[k]);
        }
    }
    for (k, number) in numbers.iter_mut().enumerate() {
        let (at, wide) = (shape.centre[k], 3.0 * shape.usual[k]);
        *number = number.clamp(at - wide, at + wide);
    }
    (log, numbers)
}
