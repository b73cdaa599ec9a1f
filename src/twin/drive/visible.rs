//! How much of each effect angles can show: its squared size over the noise, after inertials within their tolerance and the other effects have
//! absorbed what they can; and which other names would say the same.

use super::draw::{DriveCase, TOLERANCE};
use super::law::Law;
use super::motion;
use super::rig::Rig;
use crate::matrix::{Column, Shadow, length};

/// Residual of an effect after another name is fitted in its place, as a share and as L, where data cannot separate the two.
const SAME_SHARE: f64 = 0.02;
const SAME: f64 = 12.0;

/// An effect as data show it.
pub(super) struct Visible {
    /// After and before projection.
    pub(super) l: f64,
    pub(super) before: f64,
    pub(super) same: Vec<(&'static str, String)>,
}

impl DriveCase {
    /// The arm with some of its laws.
    pub(super) fn rig(&self, laws: &[Law]) -> Rig {
        let mut rig = self.scattered.clone();
        laws.iter().for_each(|law| law.change(&mut rig));
        rig
    }

    /// How visible each law is.
    pub(super) fn visible(&self) -> Vec<Visible> {
        let n = self.stated.joints();
        let judged = self.lengths.last().copied().unwrap_or_default();
        let fit = self.commands.len() - judged * n;
        let sigma = (self.noise.powi(2) + self.encoder.powi(2) / 12.0).sqrt();
        let simulated = |rig: &Rig| {
            motion::angles(rig, &self.commands[..fit], self.period, motion::coarse(rig))
        };
        let whole_rig = self.rig(&self.laws);
        let whole = simulated(&whole_rig);
        let numbers = 5 * n;
        let column = |angles: Vec<f64>, size: f64, number: Option<usize>| -> Column {
            let rows = angles
                .iter()
                .zip(&whole)
                .map(|(a, b)| (a - b) / (size * sigma));
            let tolerance = (0..numbers).map(|row| f64::from(u8::from(number == Some(row))));
            rows.chain(tolerance).collect()
        };
        if self.laws.is_empty() {
            return Vec::new();
        }
        let mut masses = Shadow::default();
        let [mass, centre, inertia] = TOLERANCE;
        for number in 0..numbers {
            let sd = [mass, centre, centre, centre, inertia][number % 5];
            let other = whole_rig.off(number / 5, number % 5, sd);
            masses.add(column(simulated(&other), 1.0, Some(number)));
        }
        let effects: Vec<Column> = (0..self.laws.len())
            .map(|index| {
                let mut rest = self.laws.clone();
                rest.remove(index);
                column(simulated(&self.rig(&rest)), 1.0, None)
            })
            .collect();
        let rivals: Vec<(Rival, Column)> = (0..n)
            .flat_map(|joint| KINDS.map(|kind| Rival { kind, joint }))
            .chain(ARM.map(|kind| Rival { kind, joint: n - 1 }))
            .map(|rival| {
                (
                    rival,
                    column(
                        simulated(&with(&whole_rig, &self.law_of(rival, 1.0))),
                        1.0,
                        None,
                    ),
                )
            })
            .collect();
        let seen = |index: usize| {
            let shadow = masses.with_others(&effects, index);
            let visible = shadow.outside(effects[index].clone());
            let l = length(&visible).powi(2);
            let law = &self.laws[index];
            // What of the effect a rival leaves, and how large it is in its place.
            let left = |moved: &Column| {
                let moved = shadow.outside(moved.clone());
                let size = dot(&moved, &visible) / dot(&moved, &moved).max(f64::MIN_POSITIVE);
                let rest: Column = visible
                    .iter()
                    .zip(&moved)
                    .map(|(a, b)| a - size * b)
                    .collect();
                (length(&rest).powi(2), size)
            };
            let bar = SAME.max(SAME_SHARE * l);
            let is_same = |(rival, moved): &(Rival, Column)| {
                let named = self.law_of(*rival, 1.0);
                if (named.name(), named.place()) == (law.name(), law.place()) {
                    return None;
                }
                let (mut least, mut size) = left(moved);
                // A small effect may grow by another way than a large one: again from as large a one, in the place of the law.
                for _ in 0..AGAIN {
                    if least < bar || least > FAR_SHARE * l {
                        break;
                    }
                    let mut laws = self.laws.clone();
                    laws[index] = self.law_of(*rival, -size);
                    let instead = column(simulated(&self.rig(&laws)), 1.0, None);
                    let mut moved = effects[index].clone();
                    moved.iter_mut().zip(&instead).for_each(|(a, b)| *a -= b);
                    let (now, by) = left(&moved);
                    (least, size) = (least.min(now), size * by);
                }
                (least < bar).then(|| (named.name(), named.place()))
            };
            Visible {
                l,
                before: length(&effects[index]).powi(2),
                same: rivals.iter().filter_map(is_same).collect(),
            }
        };
        (0..self.laws.len()).map(seen).collect()
    }

    /// A rival so many times its small size.
    fn law_of(&self, Rival { kind, joint }: Rival, size: f64) -> Law {
        let servo = &self.stated.servos[joint];
        match kind {
            "delay" => Law::Delay(Some(joint), 2e-3 * size),
            "offset" => Law::Offset(joint, 1e-3 * size),
            "gain" => Law::Gain(joint, (0.02 * size).exp()),
            "damping" => Law::Damping(joint, (0.05 * size).exp()),
            "rotor" => Law::Rotor(joint, (0.05 * size).exp()),
            "viscous" => Law::Viscous(joint, 0.05 * servo.kd * size),
            "coulomb" => Law::Coulomb(joint, 0.05 * servo.friction * size),
            "cable" => Law::Cable(joint, [0.01 * servo.kp * size, 0.0]),
            "delay of all" => Law::Delay(None, 2e-3 * size),
            _ => Law::Payload(0.02 * self.stated.machine.links[joint].mass * size),
        }
    }
}

/// Another name, and the joint where it would act.
#[derive(Debug, Clone, Copy)]
struct Rival {
    kind: &'static str,
    joint: usize,
}

/// Rivals of a joint, and of the arm.
const KINDS: [&str; 8] = [
    "delay", "offset", "gain", "damping", "rotor", "viscous", "coulomb", "cable",
];
const ARM: [&str; 2] = ["delay of all", "payload"];
/// Times that a rival is made anew as large as it would have to be, and the share of an effect that one may leave before.
const AGAIN: usize = 2;
const FAR_SHARE: f64 = 0.3;

fn with(rig: &Rig, law: &Law) -> Rig {
    let mut rig = rig.clone();
    law.change(&mut rig);
    rig
}

fn dot(a: &Column, b: &Column) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
