//! How much of each effect data can show: its squared size over the noise, after masses within their tolerance and the other concealed
//! effects have absorbed what they can; and which other names would say the same.

use super::draw::TorqueCase;
use super::law::{Fall, Law, Moment};
use super::record::{AR1_COEFFICIENT, TorqueRows};
use crate::matrix::{Column, Shadow, length};
use crate::torque::law::{Body, Machine};
use std::f64::consts::FRAC_PI_2;

/// Rows that are averaged into one: as a low-pass does.
const AVERAGED: usize = 4;
/// What is left of an effect beside another name, as a share and as L, where data cannot separate the two.
const SAME_SHARE: f64 = 0.02;
const SAME: f64 = 12.0;
/// Ripples of more a turn are like nothing else.
const LARGEST_ORDER: usize = 3;
/// A rival's column of which the others leave less than this share of it counts as theirs.
const COLLINEAR: f64 = 1e-3;

/// An effect as data show it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Visible {
    /// After and before projection.
    pub(crate) l: f64,
    pub(crate) before: f64,
    /// Names and places that say the same.
    pub(crate) same: Vec<(&'static str, String)>,
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
        let columns = Columns::new(self, rows);
        let inertial = columns.inertial();
        // Masses cost what their tolerance says: one more row for each of their numbers, in which a standard deviation of it is 1.
        let numbers = inertial.len();
        let priced = |mut column: Column, number: Option<usize>| {
            column.extend((0..numbers).map(|row| f64::from(number == Some(row))));
            column
        };
        let effect = |index: usize| {
            if index < self.common {
                return priced(columns.of_law(&self.laws[index]), None);
            }
            let others = (0..self.laws.len()).filter(|other| *other != index);
            let less = self.rows(&others.collect::<Vec<_>>());
            let pairs = rows.torque.iter().zip(&less.torque);
            priced(columns.of(pairs.map(|(with, less)| with - less)), None)
        };
        let effects: Vec<Column> = (0..self.laws.len()).map(effect).collect();
        let mut masses = Shadow::default();
        for (number, column) in inertial.into_iter().enumerate() {
            masses.add(priced(column, Some(number)));
        }
        let is_any = self.common < self.laws.len();
        let rivals = if is_any { columns.rivals() } else { vec![] };
        let seen = |index: usize| {
            let shadow = masses.with_others(&effects, index);
            let visible = shadow.outside(effects[index].clone());
            let l = length(&visible).powi(2);
            let law = &self.laws[index];
            let known = (law.name(), law.place());
            let says_the_same = |columns: &[Column]| {
                let mut space = Shadow::default();
                for column in columns.iter().map(|column| priced(column.clone(), None)) {
                    let size = length(&column);
                    let outside = shadow.outside(column);
                    if length(&outside) > COLLINEAR * size {
                        space.add(outside);
                    }
                }
                length(&space.outside(visible.clone())).powi(2) < SAME.max(SAME_SHARE * l)
            };
            let rivals = rivals.iter().filter(|_| index >= self.common);
            let others = rivals.filter(|(name, place, _)| (*name, place) != (known.0, &known.1));
            let same = others.filter(|(.., columns)| says_the_same(columns));
            Visible {
                l,
                before: length(&effects[index]).powi(2),
                same: same
                    .map(|(name, place, _)| (*name, place.clone()))
                    .collect(),
            }
        };
        (0..self.laws.len()).map(seen).collect()
    }
}

impl<'a> Columns<'a> {
    fn new(case: &'a TorqueCase, rows: &'a TorqueRows) -> Self {
        // Lasting noise counts as one value in so many averaged rows.
        let lasts = AR1_COEFFICIENT.powi(AVERAGED as i32);
        let lasting = (1.0 + lasts) / (1.0 - lasts);
        let weight = case.white.iter().zip(&case.lasting);
        let square =
            |(white, slow): (&f64, &f64)| white * white / AVERAGED as f64 + slow * slow * lasting;
        let weight = weight.map(square).map(|square| square.sqrt().recip());
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
        for (link, body) in self.case.stated.links.iter().enumerate() {
            columns.push(self.of_machine(|arm| arm.links[link].mass *= 1.0 + mass));
            columns.extend(self.centre(link, centre));
            let moments = body.inertia.iter().map(|x| x.abs());
            let most = moments.fold(0.0, f64::max);
            columns.extend(self.inertia(link, inertia * most));
        }
        columns
    }

    /// The centre of a link moved along each axis, m.
    fn centre(&self, link: usize, by: f64) -> Vec<Column> {
        (0..3)
            .map(|k| self.of_machine(|arm| arm.links[link].centre[k] += by))
            .collect()
    }

    /// Each moment of a link changed, kg m2.
    fn inertia(&self, link: usize, by: f64) -> Vec<Column> {
        (0..6)
            .map(|k| self.of_machine(|arm| arm.links[link].inertia[k] += by))
            .collect()
    }

    /// Linear effects of unit size, by name and place.
    fn rivals(&self) -> Vec<(&'static str, String, Vec<Column>)> {
        let n = self.weight.len();
        let mut rivals = Vec::new();
        let mut add =
            |law: &Law, columns: Vec<Column>| rivals.push((law.name(), law.place(), columns));
        for joint in 0..n {
            for law in per_joint(joint) {
                add(&law, vec![self.of_law(&law)]);
            }
            for laws in waves(joint) {
                add(&laws[0], laws.iter().map(|law| self.of_law(law)).collect());
            }
            if !self.case.sensors {
                let torque = self.rows.torque.iter().enumerate();
                let torque = torque.map(|(k, x)| if k % n == joint { *x } else { 0.0 });
                let law = Law::torque_constant(joint, 0.0, f64::INFINITY);
                add(&law, vec![self.of(torque)]);
            }
            let mass = self.of_machine(|arm| arm.links[joint].mass += 1.0);
            add(&Law::link_mass(joint, 0.0, [0.0; 3]), vec![mass]);
            add(&Law::link_centre(joint, [0.0; 3]), self.centre(joint, 0.01));
            add(&Law::link_inertia(joint, 0.0), self.inertia(joint, 0.1));
        }
        let payload = |change: &dyn Fn(&mut Body)| {
            self.of_machine(|arm| arm.payload.iter_mut().for_each(change))
        };
        let mut columns = vec![payload(&|body| body.mass += 1.0)];
        columns.extend((0..3).map(|k| payload(&|body| body.centre[k] += 0.01)));
        add(&Law::payload(0.0, [0.0; 3]), columns);
        let tilt = [0, 1].map(|k| self.of_machine(|arm| arm.gravity[k] += 0.1));
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
        Law::load(joint, 1.0, 1.0, 1.0, width),
        Law::rotor(joint, 1.0),
        Law::offset(joint, size, 0.0),
        Law::cable(joint, 1.0, 0.0, 0.0),
        Law::spring(joint, size, 0.0, 0.0),
        Law::spring(joint, size, FRAC_PI_2, 0.0),
    ]
}

/// Torques by a joint's angle whose phase is free: a balancer, which is a wave a turn, and ripples.
fn waves(joint: usize) -> Vec<[Law; 2]> {
    let phases = [0.0, FRAC_PI_2];
    let ripple =
        |order: usize| phases.map(|phase| Law::ripple(joint, 1.0, order as f64, phase, 0.0));
    let balancer = phases.map(|zero| Law::spring(joint, 1.0, zero, 0.0));
    std::iter::once(balancer)
        .chain((1..=LARGEST_ORDER).map(ripple))
        .collect()
}
