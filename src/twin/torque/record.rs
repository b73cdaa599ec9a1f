//! A case measured: joints by encoders, torques by currents or sensors, with noise that lasts from row to row.

use super::draw::{FITTED, TorqueCase, paths};
use super::law::{Body, Fall, Law, Machine, Moment};
use crate::folder::{File, Sheet, pretty, robot_json};
use crate::matrix;
use crate::noise::{Noise, Purpose};
use crate::way::{JointState, Path};
use serde_json::{Value, json};

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
                let plain = laws.iter().filter_map(|law| law.plain_friction(&state));
                plain.for_each(|(joint, size)| friction[joint] += size);
                let mut torque = rigid.clone();
                let now = Moment {
                    time: begin + time,
                    step,
                    state: &state,
                    rigid: &rigid,
                    friction: &friction,
                };
                let pairs = laws.iter().zip(&mut past);
                pairs.for_each(|(law, past)| law.add(&now, past, &mut torque));
                let after = laws.iter();
                after.for_each(|law| law.change_sum(&machine, &now, &mut torque));
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
                let torque = |j: usize| fine[low][j] * (1.0 - part) + fine[high][j] * part;
                rows.torque.extend((0..n).map(torque));
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
    /// What touches the arm, and what is wrong with the sum of all torques.
    fn change_sum(&self, machine: &Machine, now: &Moment, torque: &mut [f64]) {
        match *self {
            Self::Contact {
                start,
                end,
                force,
                held,
            } if (start..end).contains(&now.time) => {
                let part = (now.time - start) / (end - start);
                let wave = (std::f64::consts::PI * part).sin();
                let push = force.map(|f| f * if held { (3.0 * wave).min(1.0) } else { wave });
                let against = machine.against(&now.state.q, push);
                let joints = torque.iter_mut().zip(against);
                joints.for_each(|(torque, against)| *torque += against);
            }
            Self::TorqueConstant { joint, share, half } => {
                torque[joint] *= 1.0 + share / (1.0 + torque[joint].abs() / half);
            }
            _ => {}
        }
    }

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

impl TorqueCase {
    /// robot.json and recording.csv.
    pub fn recording(&self) -> [File; 2] {
        let rows = self.csv(&self.true_rows());
        [
            ("robot.json", pretty(&self.robot_json())),
            ("recording.csv", rows),
        ]
    }

    /// The truth: what is concealed, with its numbers and how visible each effect is.
    pub fn sealed(&self) -> String {
        let rows = self.true_rows();
        let pair = |effect: &str, place: &str| json!({ "effect": effect, "where": place });
        let seen = self.visible(&rows);
        let mut accepted = Vec::new();
        let mut effects = Vec::new();
        for (number, (law, seen)) in self.laws.iter().zip(&seen).enumerate() {
            let kin = law.kin().iter().map(|effect| pair(effect, &law.place()));
            let same = seen.same.iter().map(|(effect, place)| pair(effect, place));
            let same: Vec<Value> = same.chain(kin).collect();
            let other = law.is_of_another_form();
            accepted.extend(same.iter().cloned());
            effects.push(json!({
                "effect": law.name(), "where": law.place(), "form": if other { "other" } else { "usual" }, "strange": other,
                "wanted": number >= self.common, "same": same, "law": format!("{law:?}"),
                "L": seen.l, "L_before_projection": seen.before, "parameters": [],
            }));
        }
        let names: Vec<&str> = self.laws[self.common..].iter().map(Law::name).collect();
        let to_fit = rows.to_fit();
        pretty(&json!({
            "case": self.name, "content": self.content, "family": names.join("+"), "robot": self.robot.name,
            "seed": self.seed, "accepted": accepted, "effects": effects, "tampered": [],
            "points": { "fit": to_fit, "validate": rows.validate.len() - to_fit },
            "noise_nm": { "white": self.white, "lasting": self.lasting },
        }))
    }

    fn csv(&self, rows: &TorqueRows) -> String {
        let n = self.stated.axes.len();
        let (angles, signal) = self.measured(rows);
        let mut sheet = Sheet::default();
        sheet.add("time_s", |row| format!("{:.3}", rows.time[row]));
        sheet.add("traj", |row| rows.trajectory[row].to_string());
        let usage = |validate| if validate { "validate" } else { "fit" };
        sheet.add("use", move |row| usage(rows.validate[row]).into());
        sheet.of_joints("q{}_deg", n, &angles, |angle| format!("{angle:.5}"));
        match self.sensors {
            true => sheet.of_joints("tau{}_nm", n, &signal, |torque| format!("{torque:.2}")),
            false => sheet.of_joints("i{}_a", n, &signal, |current| format!("{current:.3}")),
        }
        sheet.text(rows.time.len())
    }

    /// What the robot file of points states, and what moving bodies take.
    fn robot_json(&self) -> Value {
        let (robot, moments) = (&self.robot, &self.robot.inertias);
        let mut out = robot_json(robot).expect("an arm of the library has such a file");
        out["inertia"] = json!(moments.links);
        out["payload_inertia"] = json!(moments.payload);
        out["gravity"] = json!(robot.gravity);
        out["inertia_tolerance"] = json!(moments.tolerance.map(|one| {
            json!({ "mass_rel": one.mass, "com_mm": one.centre * 1e3, "inertia_rel": one.inertia })
        }));
        out
    }

    /// The same arm with so much more on the tool (kg), the payload's centre off by so much (m).
    pub fn carrying(self, mass: f64, centre: [f64; 3]) -> Self {
        self.with(Law::payload(mass, centre))
    }

    /// The same arm with friction of a joint (from 0) that is greater at low speed (Nm), until so fast (rad/s).
    pub fn with_stribeck(self, joint: usize, size: f64, speed: f64) -> Self {
        self.with(Law::stribeck(joint, size, speed, Fall::Exponential(1.0)))
    }

    /// The same arm with play (rad) at a joint (from 0) behind which friction (Nm) holds the link.
    pub fn with_play(self, joint: usize, play: f64, friction: f64) -> Self {
        self.with(Law::play(joint, play, friction, 0.008, 0.0))
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
        let mut noise = Noise::new(seed, Purpose::Poses);
        self.paths = paths(&self.robot, 1.0, seconds, &mut noise);
        (self.fitted, self.seed) = (FITTED, seed);
        self
    }

    /// The same arm and physics on a motion that is given in even steps (s), to fit, and on its own paths that judge.
    pub fn on_motion(mut self, step: f64, states: Vec<JointState>) -> Self {
        let judging = self.paths.split_off(self.fitted);
        let given = (step * states.len() as f64, Path::Given(step, states));
        self.paths = std::iter::once(given).chain(judging).collect();
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
        let pairs = signal.iter().zip(self.per_unit.iter().cycle());
        pairs.map(|(value, unit)| value * unit).collect()
    }

    /// Nm, white noise by joint.
    pub fn white_noise(&self) -> &[f64] {
        &self.white
    }

    /// Viscous (Nm s/rad) and Coulomb friction (Nm) by joint; none where it is not concealed.
    pub fn plain_friction(&self) -> Vec<[Option<f64>; 2]> {
        let mut friction = vec![[None; 2]; self.stated.axes.len()];
        for law in &self.laws {
            let (joint, kind, size) = match law {
                Law::Viscous { joint, size, .. } => (joint, 0, size),
                Law::Coulomb { joint, size, .. } => (joint, 1, size),
                _ => continue,
            };
            friction[*joint][kind].get_or_insert(*size);
        }
        friction
    }

    /// The last link and what it carries as they are.
    pub fn last_bodies(&self) -> (Body, Option<Body>) {
        let machine = self.true_machine(self.laws.iter());
        (machine.links[machine.links.len() - 1], machine.payload)
    }
}
