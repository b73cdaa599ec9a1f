//! A case as text: what the user has (robot.json, recording.csv), and the truth.
//!
//! A case once more: the same arm with further physics, on other paths or on a motion that is given, and its truth in numbers.

use crate::folder::{File, Sheet, pretty, robot_json};
use crate::noise::{Noise, Purpose};
use crate::torque::draw::{FITTED, TorqueCase, paths};
use crate::torque::law::{Body, Fall, Law};
use crate::torque::record::TorqueRows;
use crate::way::{JointState, Path};
use serde_json::{Value, json};

impl TorqueCase {
    /// robot.json and recording.csv.
    pub fn recording(&self) -> [File; 2] {
        let rows = self.true_rows();
        [
            ("robot.json", pretty(&self.robot_json())),
            ("recording.csv", self.csv(&rows)),
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
            let same: Vec<Value> = seen
                .same
                .iter()
                .map(|(effect, place)| pair(effect, place))
                .chain(kin)
                .collect();
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
        let usage = |row: usize| {
            if rows.validate[row] {
                "validate"
            } else {
                "fit"
            }
        };
        sheet.add("use", move |row| usage(row).into());
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
}

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
        let units = self.per_unit.iter().cycle();
        signal
            .iter()
            .zip(units)
            .map(|(value, unit)| value * unit)
            .collect()
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
