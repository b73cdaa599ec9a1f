//! A case measured: joints by encoders, torques by currents or sensors, with noise that lasts from row to row.

use super::draw::TorqueCase;
use super::law::{Law, Moment};
use crate::matrix;
use crate::noise::{Noise, Purpose};
use crate::torque::law::Machine;
use crate::way::JointState;

/// Hz of the simulation, at least.
const FINE: f64 = 500.0;
/// s between two stretches, in which nothing is recorded.
const PAUSE: f64 = 2.0;
/// Correlation of the lasting part of noise, from row to row.
pub(super) const AR1_COEFFICIENT: f64 = 0.95;

/// Rows of a recording, without noise or with it; per-joint lists are row-major.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TorqueRows {
    /// s.
    pub time: Vec<f64>,
    /// From 1.
    pub trajectory: Vec<usize>,
    /// Whether the row judges in the end.
    pub validate: Vec<bool>,
    /// True joints, rad, rad/s, rad/s2.
    pub state: Vec<JointState>,
    /// Nm of the rigid bodies as they are.
    pub(crate) rigid: Vec<f64>,
    /// Nm at the joints, as the drive or the sensor states it.
    pub torque: Vec<f64>,
}

impl TorqueRows {
    /// Rows to fit; the others, which judge, follow them.
    pub(super) fn to_fit(&self) -> usize {
        let fit = self.validate.iter().filter(|validate| !**validate);
        fit.count()
    }
}

impl TorqueCase {
    /// The bodies as they are: off within the tolerance, and by those laws that change bodies.
    pub(super) fn true_machine<'a>(&self, laws: impl Iterator<Item = &'a Law>) -> Machine {
        let mut machine = self.scattered.clone();
        for law in laws {
            law.change(&mut machine);
        }
        machine
    }

    /// Rows without noise, with the laws of these indices.
    pub(super) fn rows(&self, laws: &[usize]) -> TorqueRows {
        let laws: Vec<&Law> = laws.iter().map(|index| &self.laws[*index]).collect();
        let machine = self.true_machine(laws.iter().copied());
        let n = machine.axes.len();
        let fine_steps = (FINE / self.rate).ceil().max(1.0) as usize;
        let step = 1.0 / (self.rate * fine_steps as f64);
        let behind = |filtered: bool| -> f64 {
            let time = |law: &&Law| match law {
                Law::Latency { time, filter } if *filter == filtered => *time,
                _ => 0.0,
            };
            laws.iter().map(time).sum()
        };
        let (late, filter) = (behind(false), behind(true));
        let mut rows = TorqueRows::default();
        let mut begin = 0.0;
        for (number, (duration, path)) in self.paths.iter().enumerate() {
            let mut past: Vec<_> = Vec::new();
            let mut fine: Vec<Vec<f64>> = Vec::new();
            for k in 0..(duration * self.rate) as usize * fine_steps {
                let time = k as f64 * step;
                let state = path.at(time);
                let rigid = machine.torque(&state);
                if past.is_empty() {
                    past = laws.iter().map(|law| law.begin(&rigid)).collect();
                }
                let mut friction = vec![0.0; n];
                laws.iter()
                    .filter_map(|law| law.plain_friction(&state))
                    .for_each(|(joint, size)| friction[joint] += size);
                let mut torque = rigid.clone();
                let now = Moment {
                    time: begin + time,
                    step,
                    state: &state,
                    rigid: &rigid,
                    friction: &friction,
                };
                laws.iter()
                    .zip(&mut past)
                    .for_each(|(law, past)| law.add(&now, past, &mut torque));
                for law in &laws {
                    match law {
                        Law::Contact {
                            start,
                            end,
                            force,
                            held,
                        } if (*start..*end).contains(&(begin + time)) => {
                            let part = (begin + time - start) / (end - start);
                            let wave = (std::f64::consts::PI * part).sin();
                            let push =
                                force.map(|f| f * if *held { (3.0 * wave).min(1.0) } else { wave });
                            let against = machine.against(&state.q, push);
                            let joints = torque.iter_mut().zip(against);
                            joints.for_each(|(torque, against)| *torque += against);
                        }
                        Law::TorqueConstant { joint, share, half } => {
                            torque[*joint] *= 1.0 + share / (1.0 + torque[*joint].abs() / half);
                        }
                        _ => {}
                    }
                }
                fine.push(torque);
                if k.is_multiple_of(fine_steps) {
                    rows.time.push(begin + time);
                    rows.trajectory.push(number + 1);
                    rows.validate.push(number >= self.fitted);
                    rows.state.push(state);
                    rows.rigid.extend(rigid);
                }
            }
            if filter > 0.0 {
                filtered(&mut fine, step / filter);
            }
            for k in (0..fine.len()).step_by(fine_steps) {
                // Logged late: a row holds what the torque was.
                let at = (k as f64 - late / step).clamp(0.0, (fine.len() - 1) as f64);
                let (low, part) = (at.floor() as usize, at.fract());
                let high = (low + 1).min(fine.len() - 1);
                rows.torque
                    .extend((0..n).map(|j| fine[low][j] * (1.0 - part) + fine[high][j] * part));
            }
            begin += duration + PAUSE;
        }
        rows
    }

    /// Joints over time and the rigid torques (Nm) of the arm as its user believes it to be.
    pub fn rigid(&self) -> Vec<(JointState, Vec<f64>)> {
        let torque = |state: JointState| {
            let torque = self.stated.torque(&state);
            (state, torque)
        };
        self.rows(&[]).state.into_iter().map(torque).collect()
    }

    /// What the files hold: joints in deg as the encoder shows them, and currents (A) or torques (Nm), row-major.
    pub(super) fn measured(&self, rows: &TorqueRows) -> (Vec<f64>, Vec<f64>) {
        let n = self.stated.axes.len();
        let mut noise = Noise::new(self.seed, Purpose::Current);
        let mut lasting = vec![0.0; n];
        let (mut angles, mut signal) = (Vec::new(), Vec::new());
        for (state, torque) in rows.state.iter().zip(rows.torque.chunks_exact(n)) {
            let shown = |q: &f64| (q.to_degrees() / self.encoder_deg).round() * self.encoder_deg;
            angles.extend(state.q.iter().map(shown));
            for j in 0..n {
                let fresh = (1.0 - AR1_COEFFICIENT * AR1_COEFFICIENT).sqrt() * self.lasting[j];
                lasting[j] = AR1_COEFFICIENT * lasting[j] + fresh * noise.normal();
                let stated =
                    (torque[j] + lasting[j] + self.white[j] * noise.normal()) / self.per_unit[j];
                signal.push((stated / self.resolution).round() * self.resolution);
            }
        }
        (angles, signal)
    }
}

/// Each joint's torque behind a filter of first order; steps in parts of its time.
fn filtered(fine: &mut [Vec<f64>], step: f64) {
    let Some(mut kept) = fine.first().cloned() else {
        return;
    };
    for torque in fine {
        for (kept, torque) in kept.iter_mut().zip(torque.iter_mut()) {
            *kept += (1.0 - (-step).exp()) * (*torque - *kept);
            *torque = *kept;
        }
    }
}

impl Law {
    /// Changes the bodies or gravity.
    fn change(&self, machine: &mut Machine) {
        match self {
            Self::Payload { mass, centre } => {
                if let Some(payload) = &mut machine.payload {
                    let share = 1.0 + mass / payload.mass;
                    payload.mass += mass;
                    payload.inertia = payload.inertia.map(|moment| moment * share);
                    payload.centre = matrix::add(payload.centre, *centre);
                }
            }
            Self::LinkMass { link, share, away } => {
                let body = &mut machine.links[*link];
                body.mass *= 1.0 + share;
                let moved = matrix::scale(*away, share / (1.0 + share));
                body.centre = matrix::add(body.centre, moved);
            }
            Self::LinkCentre { link, shift } => {
                let body = &mut machine.links[*link];
                body.centre = matrix::add(body.centre, *shift);
            }
            Self::LinkInertia { link, share } => {
                let body = &mut machine.links[*link];
                body.inertia = body.inertia.map(|moment| moment * (1.0 + share));
            }
            Self::Tilt {
                by: [about_x, about_y],
            } => {
                let turned = matrix::turn_by([*about_x, *about_y, 0.0]);
                machine.gravity = matrix::see(&turned, machine.gravity);
            }
            _ => {}
        }
    }
}
