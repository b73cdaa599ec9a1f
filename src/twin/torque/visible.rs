//! How much of each effect data can show: its squared size over the noise, after masses within their tolerance and the other concealed
//! effects have absorbed what they can; and which other names would say the same.

use super::draw::TorqueCase;
use super::law::{Fall, Law, Moment};
use super::record::{AR1_COEFFICIENT, TorqueRows};
use crate::torque::law::Machine;
use std::f64::consts::FRAC_PI_2;

/// Rows that are averaged into one: as a low-pass does.
const AVERAGED: usize = 4;
/// What is left of an effect beside another name, as a share and as L, where data cannot separate the two.
const SAME_SHARE: f64 = 0.02;
const SAME: f64 = 12.0;
/// Ripples of more a turn are like nothing else.
const LARGEST_ORDER: usize = 3;
/// Added to the diagonal so that what is not determined absorbs nothing, as a share.
const HELD: f64 = 1e-9;

/// An effect as data show it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Visible {
    /// After and before projection.
    pub(crate) l: f64,
    pub(crate) before: f64,
    /// Names and places that say the same.
    pub(crate) same: Vec<(String, String)>,
}

/// Averaged and whitened columns of the rows to fit.
struct Columns<'a> {
    case: &'a TorqueCase,
    rows: &'a TorqueRows,
    weight: Vec<f64>,
    /// Nm, of the arm as it is stated, in rows to fit.
    stated: Vec<f64>,
}

impl TorqueCase {
    /// How visible each law is; `rows` are those with all of them. No other names are looked for of the friction of all joints.
    pub(super) fn visible(&self, rows: &TorqueRows) -> Vec<Visible> {
        let all: Vec<usize> = (0..self.laws.len()).collect();
        let columns = Columns::new(self, rows);
        let effect = |index: usize| {
            if index < self.common {
                return columns.of_law(&self.laws[index]);
            }
            let others: Vec<usize> = all
                .iter()
                .copied()
                .filter(|other| *other != index)
                .collect();
            let less = self.rows(&others);
            columns.of(rows
                .torque
                .iter()
                .zip(&less.torque)
                .map(|(with, less)| with - less))
        };
        let effects: Vec<Vec<f64>> = all.iter().map(|index| effect(*index)).collect();
        let base = columns.inertial();
        // Masses cost what their tolerance says: their columns are in standard deviations, with 1 on the diagonal.
        let beside = |index: Option<usize>| -> Vec<(&[f64], f64)> {
            let others = effects
                .iter()
                .enumerate()
                .filter(|(other, _)| Some(*other) != index)
                .map(|(_, c)| c.as_slice());
            base.iter()
                .map(|c| (c.as_slice(), 1.0))
                .chain(others.map(|c| (c, 0.0)))
                .collect()
        };
        let whole = Space::new(&beside(None));
        let rivals = if self.common < self.laws.len() {
            columns.rivals()
        } else {
            Vec::new()
        };
        let seen = |index: usize| {
            let (l, before) = (whole.alone(base.len() + index), square(&effects[index]));
            if index < self.common {
                return Visible {
                    l,
                    before,
                    same: Vec::new(),
                };
            }
            let law = &self.laws[index];
            let known = (law.name().to_string(), law.place());
            let space = Space::new(&beside(Some(index)));
            let own = space.projected(&effects[index]);
            let l = space.dot(&own, &own);
            let says_the_same = |rival: &&(String, String, Vec<Vec<f64>>)| {
                space.left(&own, &rival.2, l) < SAME.max(SAME_SHARE * l)
            };
            let same = rivals
                .iter()
                .filter(says_the_same)
                .map(|(name, place, _)| (name.clone(), place.clone()));
            let same = same.filter(|rival| *rival != known).collect();
            Visible { l, before, same }
        };
        all.iter().map(|index| seen(*index)).collect()
    }
}

impl<'a> Columns<'a> {
    fn new(case: &'a TorqueCase, rows: &'a TorqueRows) -> Self {
        // Lasting noise counts as one value in so many averaged rows.
        let lasts = AR1_COEFFICIENT.powi(AVERAGED as i32);
        let lasting = (1.0 + lasts) / (1.0 - lasts);
        let weight = case.white.iter().zip(&case.lasting);
        let weight = weight.map(|(white, own)| {
            (white * white / AVERAGED as f64 + own * own * lasting)
                .sqrt()
                .recip()
        });
        let fit = rows.to_fit();
        let stated = rows.state[..fit]
            .iter()
            .flat_map(|state| case.stated.torque(state))
            .collect();
        Self {
            case,
            rows,
            weight: weight.collect(),
            stated,
        }
    }

    /// The column of torques in all rows.
    fn of(&self, torque: impl Iterator<Item = f64>) -> Vec<f64> {
        let n = self.weight.len();
        let torque: Vec<f64> = torque.collect();
        let fit = self.rows.to_fit();
        let mut out = Vec::with_capacity(fit / AVERAGED * n);
        for block in torque[..fit * n].chunks_exact(AVERAGED * n) {
            for (joint, weight) in self.weight.iter().enumerate() {
                let sum: f64 = block.iter().skip(joint).step_by(n).sum();
                out.push(weight * sum / AVERAGED as f64);
            }
        }
        out
    }

    fn of_machine(&self, change: impl Fn(&mut Machine)) -> Vec<f64> {
        let mut machine = self.case.stated.clone();
        change(&mut machine);
        let fit = self.stated.len() / self.weight.len();
        let with = self.rows.state[..fit]
            .iter()
            .flat_map(|state| machine.torque(state));
        self.of(with.zip(&self.stated).map(|(with, less)| with - less))
    }

    /// Every number of every body changed by one standard deviation.
    fn inertial(&self) -> Vec<Vec<f64>> {
        let tolerance = self.case.robot.inertias.tolerance;
        let (mass, centre, inertia) =
            tolerance.map_or((0.05, 0.01, 0.2), |one| (one.mass, one.centre, one.inertia));
        let mut columns = Vec::new();
        for link in 0..self.case.stated.links.len() {
            columns.push(self.of_machine(|machine| machine.links[link].mass *= 1.0 + mass));
            columns.extend(
                (0..3).map(|k| self.of_machine(|machine| machine.links[link].centre[k] += centre)),
            );
            for k in 0..6 {
                let most = self.case.stated.links[link]
                    .inertia
                    .iter()
                    .fold(0.0, |most: f64, x| most.max(x.abs()));
                columns.push(
                    self.of_machine(|machine| machine.links[link].inertia[k] += inertia * most),
                );
            }
        }
        columns
    }

    /// Linear effects of unit size, by name and place.
    fn rivals(&self) -> Vec<(String, String, Vec<Vec<f64>>)> {
        let n = self.weight.len();
        let mut rivals: Vec<(String, String, Vec<Vec<f64>>)> = Vec::new();
        let mut add = |law: &Law, columns: Vec<Vec<f64>>| {
            rivals.push((law.name().into(), law.place(), columns))
        };
        for joint in 0..n {
            for law in per_joint(joint) {
                add(&law, vec![self.of_law(&law)]);
            }
            for laws in waves(joint) {
                add(&laws[0], laws.iter().map(|law| self.of_law(law)).collect());
            }
            let law = Law::torque_constant(joint, 0.0, f64::INFINITY);
            let own = self
                .rows
                .torque
                .iter()
                .enumerate()
                .map(|(k, torque)| if k % n == joint { *torque } else { 0.0 });
            if !self.case.sensors {
                add(&law, vec![self.of(own)]);
            }
            add(
                &Law::link_mass(joint, 0.0, [0.0; 3]),
                vec![self.of_machine(|machine| machine.links[joint].mass += 1.0)],
            );
            let centre =
                (0..3).map(|k| self.of_machine(|machine| machine.links[joint].centre[k] += 0.01));
            add(&Law::link_centre(joint, [0.0; 3]), centre.collect());
            let inertia =
                (0..6).map(|k| self.of_machine(|machine| machine.links[joint].inertia[k] += 0.1));
            add(&Law::link_inertia(joint, 0.0), inertia.collect());
        }
        let payload = |change: fn(&mut crate::torque::law::Body)| {
            self.of_machine(|machine| machine.payload.iter_mut().for_each(change))
        };
        let payload: Vec<Vec<f64>> = vec![
            payload(|body| body.mass += 1.0),
            payload(|body| body.centre[0] += 0.01),
            payload(|body| body.centre[1] += 0.01),
            payload(|body| body.centre[2] += 0.01),
        ];
        add(&Law::payload(0.0, [0.0; 3]), payload);
        let tilt = [0, 1].map(|k| self.of_machine(|machine| machine.gravity[k] += 0.1));
        add(&Law::tilt([0.0; 2]), tilt.into());
        rivals
    }

    /// The torques of a law alone, on the rigid arm.
    fn of_law(&self, law: &Law) -> Vec<f64> {
        let n = self.weight.len();
        let mut all = Vec::with_capacity(self.rows.torque.len());
        let mut past = law.begin(&self.rows.rigid[..n]);
        let friction = vec![0.0; n];
        for (row, state) in self.rows.state.iter().enumerate() {
            let rigid = &self.rows.rigid[row * n..(row + 1) * n];
            let mut torque = vec![0.0; n];
            let now = Moment {
                time: self.rows.time[row],
                step: 1.0 / self.case.rate,
                state,
                rigid,
                friction: &friction,
            };
            law.add(&now, &mut past, &mut torque);
            all.extend(torque);
        }
        self.of(all.into_iter())
    }
}

/// Effects of a joint that are linear in their size, in usual forms.
fn per_joint(joint: usize) -> [Law; 11] {
    let (size, width, fall) = (1.0, 0.008, Fall::Exponential(1.0));
    [
        Law::viscous(joint, size, 1.0),
        Law::coulomb(joint, size, width),
        Law::asymmetric(joint, size, width, 0.0),
        Law::stribeck(joint, size, 0.05, fall),
        Law::stribeck(joint, size, 0.1, fall),
        Law::load(joint, 1.0, 1.0, width),
        Law::rotor(joint, 1.0),
        Law::offset(joint, size, 0.0),
        Law::cable(joint, 1.0, 0.0, 0.0),
        Law::spring(joint, size, 0.0, 0.0),
        Law::spring(joint, size, FRAC_PI_2, 0.0),
    ]
}

/// Torques by a joint's angle whose phase is free: a balancer, which is a wave a turn, and ripples.
fn waves(joint: usize) -> Vec<Vec<Law>> {
    let phases = [0.0, FRAC_PI_2];
    let ripple = |order: usize| {
        let law = |phase| Law::ripple(joint, 1.0, order as f64, phase, 0.0);
        phases.map(law).to_vec()
    };
    let balancer = phases
        .map(|zero| Law::spring(joint, 1.0, zero, 0.0))
        .to_vec();
    std::iter::once(balancer)
        .chain((1..=LARGEST_ORDER).map(ripple))
        .collect()
}

fn square(column: &[f64]) -> f64 {
    column.iter().map(|x| x * x).sum()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The space of held columns, each with what its number costs; a Cholesky factor of their normal matrix.
struct Space<'a> {
    held: Vec<&'a [f64]>,
    factor: Vec<Vec<f64>>,
}

/// A column beside what the held ones make of it.
struct Projected {
    column: Vec<f64>,
    /// L^-1 of its products with the held columns.
    seen: Vec<f64>,
}

impl<'a> Space<'a> {
    fn new(held: &[(&'a [f64], f64)]) -> Self {
        let gram = |i: usize, j: usize| {
            let own = product(held[i].0, held[j].0);
            if i == j {
                own * (1.0 + HELD) + held[i].1 + f64::MIN_POSITIVE
            } else {
                own
            }
        };
        let mut factor: Vec<Vec<f64>> = Vec::with_capacity(held.len());
        for i in 0..held.len() {
            let mut row = Vec::with_capacity(i + 1);
            for j in 0..=i {
                let sum: f64 = product(
                    &row,
                    &factor.get(j).map_or(&row[..], |other| other)[..j.min(row.len())],
                );
                let rest = gram(i, j) - sum;
                row.push(if i == j {
                    rest.max(HELD * gram(i, i)).max(f64::MIN_POSITIVE).sqrt()
                } else {
                    rest / factor[j][j]
                });
            }
            factor.push(row);
        }
        Self {
            held: held.iter().map(|(column, _)| *column).collect(),
            factor,
        }
    }

    /// What a held column leaves beside all others: the inverse of its diagonal in the normal matrix's inverse.
    fn alone(&self, index: usize) -> f64 {
        let mut solved: Vec<f64> = vec![0.0; index];
        for row in &self.factor[index..] {
            let unit = if solved.len() == index { 1.0 } else { 0.0 };
            solved.push((unit - product(&row[..solved.len()], &solved)) / row[solved.len()]);
        }
        1.0 / square(&solved)
    }

    fn projected(&self, column: &[f64]) -> Projected {
        let mut seen: Vec<f64> = Vec::with_capacity(self.held.len());
        for (row, held) in self.factor.iter().zip(&self.held) {
            let rest = product(held, column) - product(&row[..seen.len()], &seen);
            seen.push(rest / row[seen.len()]);
        }
        Projected {
            column: column.to_vec(),
            seen,
        }
    }

    fn dot(&self, a: &Projected, b: &Projected) -> f64 {
        product(&a.column, &b.column) - product(&a.seen, &b.seen)
    }

    /// What is left of `own` (of square `l`) beside these columns.
    fn left(&self, own: &Projected, columns: &[Vec<f64>], l: f64) -> f64 {
        let mut basis: Vec<Projected> = Vec::new();
        let mut left = l;
        for column in columns {
            let mut next = self.projected(column);
            let before = square(column).max(f64::MIN_POSITIVE);
            for other in &basis {
                let share = self.dot(&next, other) / self.dot(other, other);
                next.column
                    .iter_mut()
                    .zip(&other.column)
                    .for_each(|(x, y)| *x -= share * y);
                next.seen
                    .iter_mut()
                    .zip(&other.seen)
                    .for_each(|(x, y)| *x -= share * y);
            }
            let size = self.dot(&next, &next);
            if size > 1e-6 * before {
                let along = self.dot(own, &next);
                left -= along * along / size;
                basis.push(next);
            }
        }
        left
    }
}
