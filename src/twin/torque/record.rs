//! A case measured: joints by encoders, torques by currents or sensors, with noise that lasts from row to row.
//!
//! How joints move while torques are recorded: sums of sines that begin and end at rest, and moves from point to point with pauses.

use crate::noise::{Noise, Purpose};
use crate::torque::draw::TorqueCase;
use crate::torque::law::{JointState, Law, Machine, Moment};

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
        let behind = |filtered: bool| {
            let time = |law: &&Law| {
                if let Law::Latency { time, filter } = law {
                    (*filter == filtered).then_some(*time)
                } else {
                    None
                }
            };
            laws.iter().filter_map(time).sum::<f64>()
        };
        let (late, filter) = (behind(false), behind(true));
        let mut rows = TorqueRows::default();
        let mut begin = 0.0;
        for (number, path) in self.paths.iter().enumerate() {
            let mut past: Vec<_> = Vec::new();
            let mut fine: Vec<Vec<f64>> = Vec::new();
            for k in 0..(path.duration * self.rate) as usize * fine_steps {
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
                            torque
                                .iter_mut()
                                .zip(against)
                                .for_each(|(torque, against)| *torque += against);
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
            begin += path.duration + PAUSE;
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
            angles.extend(
                state
                    .q
                    .iter()
                    .map(|q| (q.to_degrees() / self.encoder_deg).round() * self.encoder_deg),
            );
            for j in 0..n {
                lasting[j] = AR1_COEFFICIENT * lasting[j]
                    + (1.0 - AR1_COEFFICIENT * AR1_COEFFICIENT).sqrt()
                        * self.lasting[j]
                        * noise.normal();
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
                    payload.centre = std::array::from_fn(|i| payload.centre[i] + centre[i]);
                }
            }
            Self::LinkMass { link, share, away } => {
                let body = &mut machine.links[*link];
                body.mass *= 1.0 + share;
                body.centre =
                    std::array::from_fn(|i| body.centre[i] + share / (1.0 + share) * away[i]);
            }
            Self::LinkCentre { link, shift } => {
                let body = &mut machine.links[*link];
                body.centre = std::array::from_fn(|i| body.centre[i] + shift[i]);
            }
            Self::LinkInertia { link, share } => {
                let body = &mut machine.links[*link];
                body.inertia = body.inertia.map(|moment| moment * (1.0 + share));
            }
            Self::Tilt {
                by: [about_x, about_y],
            } => {
                let turned = crate::matrix::turn_by([*about_x, *about_y, 0.0]);
                machine.gravity = crate::matrix::see(&turned, machine.gravity);
            }
            _ => {}
        }
    }
}

/// A stretch of the recording.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    /// s.
    pub(crate) duration: f64,
    form: Form,
}

#[derive(Debug, Clone, PartialEq)]
enum Form {
    /// Joint by joint: middle, and amplitude, rad/s and phase of each sine.
    Sines {
        middle: Vec<f64>,
        waves: Vec<Vec<[f64; 3]>>,
    },
    /// Where each move begins and how long it takes, s, from and to.
    Moves(Vec<Leg>),
    /// States at even steps, s.
    Given(f64, Vec<JointState>),
}

#[derive(Debug, Clone, PartialEq)]
struct Leg {
    start: f64,
    takes: f64,
    from: Vec<f64>,
    to: Vec<f64>,
}

/// Turns of the slowest sine in a stretch, and sines of a joint.
const WAVES: [usize; 5] = [1, 2, 3, 5, 7];
/// Seconds in which the arm starts and stops.
const RAMP: f64 = 1.0;

impl Path {
    /// Sines that stay inside `ranges` (rad) and below `speed` (rad/s).
    pub(super) fn sines(noise: &mut Noise, ranges: &[[f64; 2]], speed: f64, duration: f64) -> Self {
        let mut middle = Vec::new();
        let mut waves = Vec::new();
        for [lower, upper] in ranges {
            let reach = 0.5 * (upper - lower);
            let slowest = std::f64::consts::TAU / duration;
            let mut own: Vec<[f64; 3]> = WAVES
                .iter()
                .map(|k| {
                    let rate = slowest * *k as f64 * noise.uniform(0.9, 1.1);
                    [
                        noise.uniform(0.2, 1.0) / *k as f64,
                        rate,
                        noise.uniform(0.0, std::f64::consts::TAU),
                    ]
                })
                .collect();
            let (far, fast) = (
                own.iter().map(|w| w[0]).sum::<f64>(),
                own.iter().map(|w| w[0] * w[1]).sum::<f64>(),
            );
            let share = (0.8 * reach / far).min(speed / fast);
            own.iter_mut().for_each(|wave| wave[0] *= share);
            let room = (reach - share * far).max(0.0);
            middle.push(0.5 * (lower + upper) + noise.uniform(-1.0, 1.0) * room);
            waves.push(own);
        }
        Self {
            duration,
            form: Form::Sines { middle, waves },
        }
    }

    /// Moves between points inside `ranges`, each with a pause after it.
    pub(super) fn moves(noise: &mut Noise, ranges: &[[f64; 2]], speed: f64, duration: f64) -> Self {
        let point = |noise: &mut Noise| {
            ranges
                .iter()
                .map(|[lower, upper]| noise.uniform(*lower, *upper))
                .collect::<Vec<f64>>()
        };
        let (mut legs, mut start, mut from) = (Vec::new(), 0.4, point(noise));
        while start < duration {
            let to = point(noise);
            let far = from
                .iter()
                .zip(&to)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            // The peak of this profile is 1.875 times its mean.
            let takes = (1.875 * far / (speed * noise.uniform(0.4, 1.0))).max(0.5);
            legs.push(Leg {
                start,
                takes,
                from,
                to: to.clone(),
            });
            start += takes + noise.uniform(0.3, 0.7);
            from = to;
        }
        Self {
            duration,
            form: Form::Moves(legs),
        }
    }

    /// A motion in even steps, s.
    pub(super) fn given(step: f64, states: Vec<JointState>) -> Self {
        Self {
            duration: step * states.len() as f64,
            form: Form::Given(step, states),
        }
    }

    /// The joints at a time from the stretch's begin, s.
    pub(super) fn at(&self, time: f64) -> JointState {
        match &self.form {
            Form::Sines { middle, waves } => {
                let [gate, rate, bend] = self.gate(time);
                let mut state = JointState::default();
                for (middle, waves) in middle.iter().zip(waves) {
                    let [mut x, mut dx, mut ddx] = [0.0; 3];
                    for [size, w, phase] in waves {
                        let (s, c) = (w * time + phase).sin_cos();
                        x += size * s;
                        dx += size * w * c;
                        ddx -= size * w * w * s;
                    }
                    state.q.push(middle + gate * x);
                    state.v.push(gate * dx + rate * x);
                    state.a.push(gate * ddx + 2.0 * rate * dx + bend * x);
                }
                state
            }
            Form::Moves(legs) => {
                let leg = legs.iter().rfind(|leg| leg.start <= time).or(legs.first());
                leg.map_or_else(JointState::default, |leg| leg.at(time))
            }
            Form::Given(step, states) => {
                states[((time / step).round() as usize).min(states.len() - 1)].clone()
            }
        }
    }

    /// 0 at both ends, 1 between, with its derivatives.
    fn gate(&self, time: f64) -> [f64; 3] {
        let (near, sign) = if time < 0.5 * self.duration {
            (time, 1.0)
        } else {
            (self.duration - time, -1.0)
        };
        let [s, ds, dds] = smooth(near / RAMP);
        [s, sign * ds / RAMP, dds / (RAMP * RAMP)]
    }
}

impl Leg {
    fn at(&self, time: f64) -> JointState {
        let [s, ds, dds] = smooth((time - self.start) / self.takes);
        let mut state = JointState::default();
        for (from, to) in self.from.iter().zip(&self.to) {
            state.q.push(from + s * (to - from));
            state.v.push(ds * (to - from) / self.takes);
            state.a.push(dds * (to - from) / (self.takes * self.takes));
        }
        state
    }
}

/// From 0 to 1 with velocity and acceleration 0 at both ends, and its derivatives.
fn smooth(x: f64) -> [f64; 3] {
    let x = x.clamp(0.0, 1.0);
    let s = x * x * x * (10.0 + x * (6.0 * x - 15.0));
    let ds = 30.0 * x * x * (x * (x - 2.0) + 1.0);
    let dds = 60.0 * x * (x * (2.0 * x - 3.0) + 1.0);
    [s, ds, dds]
}
