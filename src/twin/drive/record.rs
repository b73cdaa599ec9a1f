//! A case measured: angles by encoders with their steps and white noise, and the files of its user.

use super::draw::{DriveCase, TOLERANCE};
use super::motion;
use crate::folder::{File, Sheet, pretty};
use crate::matrix::minus;
use crate::noise::{Noise, Purpose};
use serde_json::{Value, json};
use std::fmt::Write;

impl DriveCase {
    /// robot.xml, drives.json and recording.csv.
    pub fn recording(&self) -> [File; 3] {
        [
            ("robot.xml", self.robot()),
            ("drives.json", pretty(&self.drives())),
            ("recording.csv", self.csv()),
        ]
    }

    /// The truth: what is concealed, and how visible each effect is.
    pub fn sealed(&self) -> String {
        let seen = self.visible();
        let mut accepted = Vec::new();
        let mut effects = Vec::new();
        for (law, seen) in self.laws.iter().zip(&seen) {
            let same = seen.same.iter();
            let same: Vec<Value> = same
                .map(|(effect, place)| json!({ "effect": effect, "where": place }))
                .collect();
            accepted.extend(same.iter().cloned());
            effects.push(json!({
                "effect": law.name(), "where": law.place(), "form": "usual", "same": same, "law": format!("{law:?}"),
                "L": seen.l, "L_before_projection": seen.before, "parameters": [],
            }));
        }
        let names: Vec<&str> = self.laws.iter().map(|law| law.name()).collect();
        let judged = self.lengths.last().copied().unwrap_or_default();
        let rows: usize = self.lengths.iter().sum();
        pretty(&json!({
            "case": self.name, "content": self.content, "family": names.join("+"), "robot": self.kind, "seed": self.seed,
            "accepted": accepted, "effects": effects, "tampered": [], "points": { "fit": rows - judged, "validate": judged },
        }))
    }

    fn robot(&self) -> String {
        let machine = &self.stated.machine;
        let text = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
        let [gx, gy, gz] = machine.gravity;
        let mut out = format!(
            "<mujoco model=\"{}\">\n  <compiler angle=\"radian\"/>\n  <option timestep=\"0.0005\" gravity=\"{gx} {gy} {gz}\"/>\n  <worldbody>\n",
            self.kind
        );
        let mut before = [0.0; 3];
        for (j, (servo, body)) in self.stated.servos.iter().zip(&machine.links).enumerate() {
            let point = machine.points[j];
            let [xx, xy, xz, yy, yz, zz] = body.inertia;
            let (number, axis) = (j + 1, text(machine.axes[j]));
            let _ = writeln!(
                out,
                "  <body name=\"link{number}\" pos=\"{}\">\n  <joint name=\"joint{number}\" axis=\"{axis}\" armature=\"{}\" damping=\"{}\" frictionloss=\"{}\"/>\n  \
                 <inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{xx} {yy} {zz} {xy} {xz} {yz}\"/>",
                text(minus(point, before)),
                servo.armature,
                servo.damping,
                servo.friction,
                text(minus(body.centre, point)),
                body.mass,
            );
            before = point;
        }
        let _ = writeln!(
            out,
            "  <site name=\"tool\" pos=\"{}\"/>",
            text(minus(machine.tool, before))
        );
        out + &"  </body>\n".repeat(self.stated.joints()) + "  </worldbody>\n</mujoco>\n"
    }

    fn drives(&self) -> Value {
        let joints = self.stated.servos.iter().enumerate().map(|(j, servo)| {
            json!({
                "joint": format!("joint{}", j + 1), "kp": servo.kp, "kd": servo.kd, "kd_on": if servo.on_error { "error" } else { "speed" },
                "torque_limit_nm": servo.limit, "encoder_rad": self.encoder, "noise_rad": self.noise,
            })
        });
        let [mass, centre, inertia] = TOLERANCE;
        json!({
            "command_rate_hz": 1.0 / self.period, "joints": joints.collect::<Vec<Value>>(),
            "inertia_tolerance": { "mass_rel": mass, "com_mm": 1e3 * centre, "inertia_rel": inertia },
        })
    }

    fn csv(&self) -> String {
        let n = self.stated.joints();
        let mut noise = Noise::new(self.seed, Purpose::Tracker);
        let shown = |angle: f64| {
            ((angle + self.noise * noise.normal()) / self.encoder).round() * self.encoder
        };
        let sigma = (self.noise.powi(2) + self.encoder.powi(2) / 12.0).sqrt();
        let angles = motion::settled(&self.rig(&self.laws), &self.commands, self.period, sigma);
        let angles: Vec<f64> = angles.into_iter().map(shown).collect();
        let lengths = self.lengths.iter().enumerate();
        let number: Vec<usize> = lengths.flat_map(|(k, rows)| vec![k + 1; *rows]).collect();
        let last = self.lengths.len();
        let mut sheet = Sheet::default();
        sheet.add("time_s", |row| format!("{:.4}", row as f64 * self.period));
        sheet.add("traj", |row| number[row].to_string());
        sheet.add("use", |row| {
            if number[row] == last {
                "validate"
            } else {
                "fit"
            }
            .into()
        });
        sheet.of_joints("cmd{}_rad", n, &self.commands, |angle| {
            format!("{angle:.7}")
        });
        sheet.of_joints("q{}_rad", n, &angles, |angle| format!("{angle:.7}"));
        sheet.text(number.len())
    }
}
