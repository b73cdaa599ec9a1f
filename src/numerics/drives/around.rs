//! What every cell of the table would do around a fit: columns of all of them by their products, and what each member of the set does, so that
//! one linearisation serves the cells that may join the set and those that may replace a member.

use crate::causes::cells;
use crate::fit::{Anew, DriveFit};
use crate::independence::Rich;
use crate::key::Key;
use crate::normal::Normal;
use crate::physics::Physics;
use crate::problem::Drives;
use crate::rollout::{Direction, Which, roll};
use crate::sizes::furthest;
use calib_engine::{Block, Cell, Rows, Scanned, ranked};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;

/// rad rms of a unit of amplitude: the amplitudes of the table of causes are those of metres at a tool.
const UNIT: f64 = 10.0;
/// Standard deviations of what noise alone makes of a joint's squared residual, above which causes with a memory may join there.
const ABOVE_NOISE: f64 = 2.0;
/// Share of the drive's error, rms, that is left at a joint whose gain may be far off.
const FAR_OFF: f64 = 0.5;

/// What cells and members do around a fit.
pub struct Around {
    candidates: Vec<Candidate>,
    sums: Sums,
    /// Base columns, then what each member does: products with each other and with the residual.
    own: Normal,
    /// Base columns of each member.
    members: Vec<Vec<usize>>,
    precision: Vec<f64>,
    /// Of the base's numbers from where they are expected.
    distances: DVector<f64>,
    /// Residuals of fitted rows.
    freedom: f64,
    rolled: Vec<Rolled>,
    /// Share of rows that are independent given all columns at once: a linear model says the more, the less is missing.
    pub(crate) rich: f64,
}

/// A cell that may join the set, or replace the member that excludes it.
struct Candidate {
    cell: Cell<Key>,
    instead: Option<usize>,
}

/// A column that only a roll-out of its own shows: it holds as long as no other cells act where it does.
#[derive(Clone)]
struct Rolled {
    key: Key,
    numbers: Vec<f64>,
    neighbours: Vec<Key>,
    /// rad, by row and joint.
    change: Arc<Vec<f64>>,
}

/// Where a column of a scan comes from.
enum Column {
    Carried(Direction),
    Rolled(Rolled),
}

/// Change of angles, none where a simulation runs away.
fn changed(after: Vec<f64>, before: &[f64]) -> Vec<f64> {
    let pairs = after.into_iter().zip(before);
    let change = pairs.map(|(after, before)| after - before);
    change
        .map(|change| if change.is_finite() { change } else { 0.0 })
        .collect()
}

impl Drives {
    /// Cells that may be there around a fit.
    fn candidates(&self, fit: &DriveFit) -> Vec<Candidate> {
        let n = self.chain.joints();
        let rows_a_joint = self.fitted().count() as f64;
        let squares = self.squares(fit);
        let level = |count: f64| count * (1.0 + ABOVE_NOISE * (2.0 / count).sqrt());
        let (slow, sums) = self.slow_squares(fit);
        let above = |joint: usize| {
            squares[joint] > level(rows_a_joint) || (sums > 0.0 && slow[joint] > level(sums))
        };
        let any = (0..n).any(above);
        // A gain that is far off shows in the residual: as much as the drive's own error.
        let residual = self.errors_of(&fit.angles);
        let is_far = |joint: usize| residual[joint] > FAR_OFF * self.usual[joint].error;
        let candidate = |mut cell: Cell<Key>| {
            let key = cell.key;
            let leaves: Vec<usize> = (0..fit.set.len())
                .filter(|member| key.excludes(fit.set[*member].cell.key))
                .collect();
            // A gear that yields may stand where another one does; everything else that excludes is another number of the same.
            let instead = match leaves[..] {
                [] => None,
                [member] if key.is_gear() && key != fit.set[member].cell.key => Some(member),
                _ => return None,
            };
            // What explains a joint, or the arm, may be another cause there though no more than noise is left.
            let may_replace = || fit.set.iter().any(|one| one.cell.place == cell.place);
            let seen = match key {
                Key::Hold | Key::Sag => any || may_replace(),
                Key::Integral(j)
                | Key::SpeedLimit(j)
                | Key::Presliding(j)
                | Key::Backlash(j, _)
                | Key::Elasticity(j) => above(j) || may_replace(),
                _ => true,
            };
            if let Key::Gain(from, to) = key
                && !(from..=to).all(is_far)
            {
                cell.shapes.truncate(1);
            }
            let wanted = !self.without.iter().any(|name| *name == cell.cause.name);
            (seen && wanted).then_some(Candidate { cell, instead })
        };
        let all = cells(&self.base, &self.usual, self.recording.period, self.shown);
        all.into_iter().filter_map(candidate).collect()
    }

    /// Angles without a member of a set.
    fn without(&self, fit: &DriveFit, member: usize) -> (Physics, Vec<f64>) {
        let mut rest = fit.set.clone();
        rest.remove(member);
        let physics = self.physics(&fit.inertia, &rest);
        let angles = self.angles(&physics, Which::Fitted);
        (physics, angles)
    }
}

impl Around {
    pub(crate) fn new(drives: &Drives, fit: &DriveFit, before: Option<&Self>) -> Self {
        let n = drives.chain.joints();
        let now = drives.physics(&fit.inertia, &fit.set);
        let candidates = drives.candidates(fit);
        let members: Vec<(Physics, Vec<f64>)> = (0..fit.set.len())
            .into_par_iter()
            .map(|member| drives.without(fit, member))
            .collect();
        // In the order of cells, shapes and columns.
        let wanted: Vec<(&Candidate, &Vec<f64>)> = candidates
            .iter()
            .flat_map(|one| {
                let shapes = one.cell.shapes.iter();
                shapes.flat_map(move |shape| shape.columns.iter().map(move |x| (one, x)))
            })
            .collect();
        let set: Vec<Key> = fit.set.iter().map(|one| one.cell.key).collect();
        let column = |(one, x): &(&Candidate, &Vec<f64>)| {
            let key = one.cell.key;
            let (base, angles) = one
                .instead
                .map_or((&now, &fit.angles), |k| (&members[k].0, &members[k].1));
            let mut with = base.clone();
            key.apply(x, &drives.usual, drives.duration, &mut with);
            if !key.is_rolled(x) {
                return Column::Carried(Direction::between(&now, &with));
            }
            let near = |other: &Key| key.meets(*other);
            let neighbours: Vec<Key> = set.iter().copied().filter(near).collect();
            let known = before.and_then(|before| {
                before.rolled.iter().find(|known| {
                    known.key == key && known.numbers == **x && known.neighbours == neighbours
                })
            });
            Column::Rolled(known.cloned().unwrap_or_else(|| Rolled {
                key,
                numbers: (*x).clone(),
                neighbours,
                change: Arc::new(changed(drives.angles(&with, Which::Fitted), angles)),
            }))
        };
        let columns: Vec<Column> = wanted.par_iter().map(column).collect();
        let effects: Vec<Vec<f64>> = members
            .into_iter()
            .map(|(_, without)| changed(fit.angles.clone(), &without))
            .collect();
        let base = drives.base_columns(fit, Anew::Unknown);
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
        for shape in candidates.iter().flat_map(|one| &one.cell.shapes) {
            blocks.push((from, shape.columns.len()));
            from += shape.columns.len();
        }
        let mut own = Normal::new(nb + effects.len());
        let mut sums = Sums::new(nb + effects.len(), blocks);
        let mut b = vec![0.0; nb + effects.len()];
        let mut rich = Rich::new(drives, nb + columns.len());
        roll(
            &drives.scanned,
            &now,
            &drives.recording,
            &carried,
            Which::Fitted,
            |row| {
                for joint in 0..n {
                    let at = row.row * n + joint;
                    let sigma = drives.sigma[at] * fit.doubt[joint];
                    let residual = (drives.recording.angle[at] - fit.angles[at]) / sigma;
                    base.at(at, row.change[joint], sigma, &mut b[..nb]);
                    for (to, effect) in b[nb..].iter_mut().zip(&effects) {
                        *to = effect[at] / sigma;
                    }
                    own.add(&b, residual);
                    let changes = columns.iter().zip(&place);
                    let changes = changes.map(|(column, place)| match (column, place) {
                        (Column::Rolled(rolled), _) => rolled.change[at],
                        (_, Some(k)) => row.change[joint][*k],
                        _ => 0.0,
                    });
                    let whitened = changes.clone().map(|change| change / sigma);
                    let all = b[..nb].iter().copied().chain(whitened);
                    rich.add(row.row, joint, residual, all);
                    sums.add(&b, residual, sigma, changes);
                }
            },
        );
        sums.close();
        let of_member = |member: usize| {
            let numbers = base.numbers.iter().enumerate();
            let own = numbers.filter(|(_, (c, _))| *c == member);
            own.map(|(k, _)| fit.inertia.len() + k).collect()
        };
        Self {
            sums,
            own,
            members: (0..fit.set.len()).map(of_member).collect(),
            distances: drives.distances(fit, &base),
            precision: base.precision,
            freedom: (drives.fitted().count() * n) as f64,
            rolled: columns
                .into_iter()
                .filter_map(|column| match column {
                    Column::Rolled(rolled) => Some(rolled),
                    Column::Carried(_) => None,
                })
                .collect(),
            rich: rich.independence(),
            candidates,
        }
    }

    /// Cells by their evidence, member `out` of the set left out.
    pub(crate) fn scan(&self, fit: &DriveFit, out: Option<usize>) -> Vec<Scanned<Key>> {
        let nb = self.precision.len();
        let kept: Vec<usize> = (0..nb)
            .filter(|column| out.is_none_or(|member| !self.members[member].contains(column)))
            .collect();
        let gram = self.own.gram_matrix();
        let lost = |of: usize| out.map_or(0.0, |member| gram[(of, nb + member)]);
        let scale = (fit.square / self.freedom).max(1.0);
        // What is free already is pulled back to where it is expected: what it takes up beyond its tolerance a cell may explain.
        let prior = |of: usize| self.precision[of] * scale / fit.share();
        let gradient =
            |of: usize| self.own.gradient[of] + lost(of) - prior(of) * self.distances[of];
        let square = self.own.square
            + out.map_or(0.0, |member| {
                2.0 * self.own.gradient[nb + member] + lost(nb + member)
            });
        let count = kept.len();
        let mut rows = Rows::new(
            (square, self.freedom),
            &DMatrix::from_fn(count, count, |i, k| gram[(kept[i], kept[k])]),
            DVector::from_fn(count, |i, _| gradient(kept[i])),
            &DVector::from_fn(count, |i, _| prior(kept[i])),
        );
        rows.square = rows.square.max(self.freedom);
        rows.independence = fit.share();
        rows.unit = UNIT;
        let mut next = 0;
        let mut scanned = Vec::new();
        for one in &self.candidates {
            let first = next;
            next += one.cell.shapes.len();
            if one.instead.is_some() && one.instead != out {
                continue;
            }
            let shapes = one.cell.shapes.iter().enumerate();
            let shapes = shapes.map(|(k, shape)| {
                let effect = out.map(|member| nb + member);
                let block = self.sums.block(first + k, &kept, effect, self.freedom);
                let (log, size) = rows.evidence(&block);
                begun(shape, log, &size)
            });
            scanned.push((one.cell.clone(), shapes.collect()));
        }
        ranked(scanned)
    }
}

/// Rows that are multiplied at once.
const BATCH: usize = 192;

/// Sums of products of a scan's columns, of their blocks with each other and of all with the base.
struct Sums {
    blocks: Vec<(usize, usize)>,
    grams: Vec<DMatrix<f64>>,
    /// Of the base, of what members do, and of the residual in the last line, with every column.
    cross: DMatrix<f64>,
    rms: Vec<f64>,
    /// Rows that are not multiplied yet: base and residual by row, row by column.
    base: DMatrix<f64>,
    batch: DMatrix<f64>,
    filled: usize,
}

impl Sums {
    fn new(base: usize, blocks: Vec<(usize, usize)>) -> Self {
        let count = blocks.iter().map(|(_, k)| k).sum();
        Self {
            grams: blocks.iter().map(|(_, k)| DMatrix::zeros(*k, *k)).collect(),
            cross: DMatrix::zeros(base + 1, count),
            rms: vec![0.0; count],
            base: DMatrix::zeros(base + 1, BATCH),
            batch: DMatrix::zeros(BATCH, count),
            filled: 0,
            blocks,
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

    /// A block by its products with the kept columns of the base; `effect`, which is left out, is in the residual.
    fn block(&self, at: usize, kept: &[usize], effect: Option<usize>, rows: f64) -> Block {
        let (from, k) = self.blocks[at];
        let last = self.cross.nrows() - 1;
        let with = |line: usize, j: usize| self.cross[(line, from + j)];
        let rms = self.rms[from..from + k].iter();
        Block {
            gram: self.grams[at].clone(),
            gradient: DVector::from_fn(k, |j, _| {
                with(last, j) + effect.map_or(0.0, |line| with(line, j))
            }),
            cross: DMatrix::from_fn(kept.len(), k, |i, j| with(kept[i], j)),
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
        let (at, wide) = (shape.centre[k], furthest(shape, k));
        let [low, high] = shape.bounds[k];
        *number = number.clamp(at - wide, at + wide).clamp(low, high);
    }
    (log, numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::against_mujoco::{TOLERANCE, motion};
    use calib_engine::{Accepted, Problem};

    #[test]
    fn what_explains_a_joint_to_the_noise_may_still_be_a_cause_with_a_memory() {
        let (chain, base, mut recording) = motion();
        let drives = Drives::new(chain, base.clone(), recording.clone(), TOLERANCE);
        let all = cells(&base, &drives.usual, recording.period, drives.shown);
        let accepted = |key: Key| {
            let cell = all.iter().find(|cell| cell.key == key).unwrap();
            Accepted {
                numbers: cell.shapes[0].start.clone(),
                cell: cell.clone(),
                shape: 0,
            }
        };
        let slews = accepted(Key::SpeedLimit(1));
        recording.angle = drives.angles(&drives.physics(&[], &[slews]), Which::All);
        let measured = Drives::new(drives.chain.clone(), base, recording, TOLERANCE);
        let friction = accepted(Key::Viscous(1));
        let mut fit = measured.fit(&[friction], None, f64::NEG_INFINITY);
        // As large a model error as that leaves nothing out of noise.
        fit.doubt.fill(1e4);
        let around = measured.around(&fit, None);
        let is_seen = |out: Option<usize>, joint: usize| {
            let is_it = |one: &Scanned<Key>| one.accepted.cell.key == Key::SpeedLimit(joint);
            measured.scan(&fit, &around, out).iter().any(is_it)
        };
        assert!(is_seen(Some(0), 1));
        assert!(!is_seen(Some(0), 2));
    }
}
