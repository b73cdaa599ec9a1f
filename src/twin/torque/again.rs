//! A case once more: the same arm with further physics, on other paths or on a motion that is given, and its truth in numbers.

use super::draw::{TorqueCase, paths};
use super::law::{Fall, Law};
use super::path::Path;
use super::record::TorqueRows;
use super::rigid::{Body, JointState};
use crate::noise::{Noise, Purpose};

impl TorqueCase {
    /// The same arm with so much more on the tool (kg), the payload's centre off by so much (m).
    pub fn carrying(self, mass: f64, centre: [f64; 3]) -> Self {
        self.with(Law::payload(mass, centre))
    }

    /// The same arm with friction of a joint (from 0) that is greater at low speed (Nm), until so fast (rad/s).
    pub fn with_stribeck(self, joint: usize, size: f64, speed: f64) -> Self {
        self.with(Law::stribeck(joint, size, speed, Fall::Exponential(1.0)))
    }

    /// The same arm with so much more Coulomb friction at a joint (from 0), Nm.
    pub fn with_drag(self, joint: usize, size: f64) -> Self {
        self.with(Law::coulomb(joint, size, 0.008))
    }

    fn with(mut self, law: Law) -> Self {
        self.laws.push(law);
        self
    }

    /// The same arm and physics on other paths, with other noise.
    pub fn on_other_paths(mut self, seed: u64, seconds: f64) -> Self {
        let speed = 1.0;
        let mut noise = Noise::new(seed, Purpose::Poses);
        (self.paths, self.fitted) = paths(&self.robot, speed, seconds, &mut noise);
        self.seed = seed;
        self
    }

    /// The same arm and physics on a motion that is given in even steps (s), to fit, and on its own paths that judge.
    pub fn on_motion(mut self, step: f64, states: Vec<JointState>) -> Self {
        let judging = self.paths.split_off(self.fitted);
        self.paths = std::iter::once(Path::given(step, states))
            .chain(judging)
            .collect();
        self.fitted = 1;
        self
    }

    /// All rows without noise.
    pub fn true_rows(&self) -> TorqueRows {
        self.rows(&(0..self.laws.len()).collect::<Vec<_>>())
    }

    /// Torques of rows with the noise of the recording, Nm, row-major.
    pub fn noisy(&self, rows: &TorqueRows) -> Vec<f64> {
        let (_, signal) = self.measured(rows);
        signal
            .chunks_exact(self.per_unit.len())
            .flat_map(|row| {
                row.iter()
                    .zip(&self.per_unit)
                    .map(|(value, unit)| value * unit)
            })
            .collect()
    }

    /// Nm, white noise by joint.
    pub fn white_noise(&self) -> &[f64] {
        &self.white
    }

    /// Viscous (Nm s/rad) and Coulomb friction (Nm) by joint; none where it is not concealed.
    pub fn plain_friction(&self) -> Vec<[Option<f64>; 2]> {
        let of = |joint: usize| {
            let viscous = self.laws.iter().find_map(|law| match law {
                Law::Viscous {
                    joint: at, size, ..
                } if *at == joint => Some(*size),
                _ => None,
            });
            let coulomb = self.laws.iter().find_map(|law| match law {
                Law::Coulomb {
                    joint: at, size, ..
                } if *at == joint => Some(*size),
                _ => None,
            });
            [viscous, coulomb]
        };
        (0..self.stated.axes.len()).map(of).collect()
    }

    /// The last link and what it carries as they are.
    pub fn last_bodies(&self) -> (Body, Option<Body>) {
        let machine = self.true_machine(self.laws.iter());
        (machine.links[machine.links.len() - 1], machine.payload)
    }
}
