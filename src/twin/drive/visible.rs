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
        let rivals: Vec<(Law, Column)> = (0..n)
            .flat_map(|joint| self.rivals(joint))
            .chain([
                Law::Delay(None, 2e-3),
                Law::Payload(0.02 * self.stated.machine.links[n - 1].mass),
            ])
            .map(|law| {
                let mut rig = whole_rig.clone();
                law.change(&mut rig);
                let moved = column(simulated(&rig), 1.0, None);
                (law, moved)
            })
            .collect();
        let seen = |index: usize| {
            let shadow = masses.with_others(&effects, index);
            let visible = shadow.outside(effects[index].clone());
            let l = length(&visible).powi(2);
            let law = &self.laws[index];
            let same = rivals.iter().filter(|(rival, column)| {
                if (rival.name(), rival.place()) == (law.name(), law.place()) {
                    return false;
                }
                let mut space = Shadow::default();
                space.add(shadow.outside(column.clone()));
                length(&space.outside(visible.clone())).powi(2) < SAME.max(SAME_SHARE * l)
            });
            Visible {
                l,
                before: length(&effects[index]).powi(2),
                same: same
                    .map(|(rival, _)| (rival.name(), rival.place()))
                    .collect(),
            }
        };
        (0..self.laws.len()).map(seen).collect()
    }

    /// Small effects of a joint.
    fn rivals(&self, joint: usize) -> Vec<Law> {
        let servo = &self.stated.servos[joint];
        vec![
            Law::Delay(Some(joint), 2e-3),
            Law::Offset(joint, 1e-3),
            Law::Gain(joint, 1.02),
            Law::Damping(joint, 1.05),
            Law::Rotor(joint, 1.05),
            Law::Viscous(joint, 0.05 * servo.kd),
            Law::Coulomb(joint, 0.05 * servo.friction),
            Law::Cable(joint, [0.01 * servo.kp, 0.0]),
        ]
    }
}
