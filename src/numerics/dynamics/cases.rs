//! Small recordings with one known cause each, and what is found in them.

use super::*;
use nalgebra::{Matrix3, Point3, Vector3};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Hz.
const RATE: f64 = 100.0;
/// s.
const DURATION: f64 = 40.0;
/// Nm, of white noise.
const NOISE: f64 = 0.3;

/// Four joints: a shoulder, an elbow and a wrist, with a payload of 2 kg.
pub(super) fn arm() -> DynamicArm {
    let rod = |mass: f64, x: f64, length: f64| {
        let across = mass * length * length / 12.0;
        let inertia = Matrix3::from_diagonal(&Vector3::new(0.1 * across, across, across));
        Inertial {
            mass,
            centre: Point3::new(x, 0.02, 0.4),
            inertia,
        }
    };
    DynamicArm {
        axes: vec![Vector3::z(), Vector3::y(), Vector3::y(), Vector3::x()],
        points: [
            [0.0, 0.0, 0.0],
            [0.1, 0.0, 0.4],
            [0.6, 0.0, 0.4],
            [0.8, 0.0, 0.4],
        ]
        .map(Point3::from)
        .to_vec(),
        prismatic: vec![false; 4],
        tool: Point3::new(1.1, 0.0, 0.4),
        links: Some(vec![
            rod(20.0, 0.05, 0.2),
            rod(12.0, 0.35, 0.5),
            rod(6.0, 0.7, 0.2),
            rod(3.0, 0.95, 0.3),
        ]),
        payload: Some(Inertial {
            mass: 2.0,
            centre: Point3::new(1.15, 0.05, 0.42),
            inertia: Matrix3::identity() * 0.01,
        }),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        ratio: vec![100.0; 4],
        coupled: Vec::new(),
        tolerance: InertialTolerance {
            mass_relative: 0.01,
            centre: 0.0015,
            inertia_relative: 0.05,
        },
    }
}

/// A recording that comes in blocks of so many rows.
pub(super) struct Blocks(pub TorqueRecording, pub usize);

impl TorqueSource for Blocks {
    fn joints(&self) -> usize {
        self.0.joints
    }
    fn rows(&self) -> usize {
        self.0.rows()
    }
    fn blocks(&self, take: &mut dyn FnMut(&TorqueRecording) -> Result<()>) -> Result<()> {
        for start in (0..self.0.rows()).step_by(self.1) {
            let mut block = TorqueRecording::like(&self.0);
            block.extend(&self.0, start..(start + self.1).min(self.0.rows()));
            take(&block)?;
        }
        Ok(())
    }
}

/// Position, velocity and acceleration of the joints: sums of sines that share no period.
fn moved(joint: usize, time: f64) -> (f64, f64, f64) {
    let mut sum = (0.1 * joint as f64, 0.0, 0.0);
    for (number, size) in [0.5, 0.25, 0.12].into_iter().enumerate() {
        let pace = 0.45 * (1.0 + 0.31 * joint as f64) * (1.0 + 1.37 * number as f64);
        let (sine, cosine) = (pace * time + number as f64 + joint as f64).sin_cos();
        sum = (
            sum.0 + size * sine,
            sum.1 + size * pace * cosine,
            sum.2 - size * pace * pace * sine,
        );
    }
    sum
}

/// A row of the truth: joint, time, position, velocity, acceleration, rigid torque.
type Row = (usize, f64, f64, f64, f64, f64);

/// A recording of `real` with a torque added at each joint; torques come `latency` s late.
pub(super) fn record(
    real: &DynamicArm,
    latency: f64,
    extra: &dyn Fn(Row) -> f64,
) -> TorqueRecording {
    record_at(real, RATE, latency, extra)
}

/// The same at a rate, Hz.
pub(super) fn record_at(
    real: &DynamicArm,
    rate: f64,
    latency: f64,
    extra: &dyn Fn(Row) -> f64,
) -> TorqueRecording {
    let n = real.joints();
    let theta = arm::DeclaredInertials::of(real, real.links.as_deref().unwrap()).theta;
    let mut dynamics = InverseDynamics::new(real);
    let rows = (DURATION * rate) as usize;
    let mut dice = ChaCha8Rng::seed_from_u64(3);
    let mut recording = TorqueRecording {
        joints: n,
        time: (0..rows).map(|row| row as f64 / rate).collect(),
        position: Vec::new(),
        velocity: None,
        torque: Vec::new(),
        temperature: None,
        trajectory: vec![1; rows],
        held_out: (0..rows).map(|row| row * 5 > rows * 3).collect(),
        from_current: false,
    };
    let mut torque = vec![0.0; n];
    for row in 0..rows {
        let time = row as f64 / rate;
        recording
            .position
            .extend((0..n).map(|joint| moved(joint, time).0));
        let then = time - latency;
        let motion: Vec<(f64, f64, f64)> = (0..n).map(|joint| moved(joint, then)).collect();
        let [q, dq, ddq] = [0, 1, 2].map(|part| {
            motion
                .iter()
                .map(|m| [m.0, m.1, m.2][part])
                .collect::<Vec<f64>>()
        });
        dynamics.torque(
            MotionRow {
                position: &q,
                velocity: &dq,
                acceleration: &ddq,
            },
            &real.gravity,
            &theta,
            &mut torque,
        );
        for joint in 0..n {
            // Nearly normal.
            let noise: f64 = (0..12).map(|_| dice.random::<f64>() - 0.5).sum();
            recording.torque.push(
                torque[joint]
                    + extra((joint, then, q[joint], dq[joint], ddq[joint], torque[joint]))
                    + NOISE * noise,
            );
        }
    }
    recording
}

/// Names with places, sorted.
pub(super) fn found(diagnosis: &TorqueDiagnosis) -> Vec<String> {
    let mut names: Vec<String> = diagnosis
        .findings
        .iter()
        .map(|f| format!("{} {}", f.effect, f.place))
        .collect();
    names.sort();
    names
}

pub(super) fn diagnosed(recording: &TorqueRecording) -> TorqueDiagnosis {
    diagnose(&arm(), recording, &TorqueQuestion::default(), &mut |_| ()).unwrap()
}

/// The value of a parameter of the only finding of a name.
fn number(diagnosis: &TorqueDiagnosis, effect: &str, name: &str) -> f64 {
    let finding = diagnosis
        .findings
        .iter()
        .find(|f| f.effect == effect)
        .unwrap();
    finding
        .parameters
        .iter()
        .find(|parameter| parameter.name == name)
        .unwrap()
        .value
}

#[test]
fn nothing_is_found_in_the_torques_of_the_declared_arm() {
    let diagnosis = diagnosed(&record(&arm(), 0.0, &|_| 0.0));
    assert_eq!(
        (found(&diagnosis), diagnosis.verdict.name()),
        (Vec::new(), "nothing_missing")
    );
    // White noise of 0.3 Nm, of which a low-pass at 10 of 50 Hz leaves about a fifth of the variance.
    for noise in &diagnosis.noise {
        assert!(
            (noise.sigma / (NOISE * 0.2f64.sqrt()) - 1.0).abs() < 0.2,
            "{noise:?}"
        );
    }
}

#[test]
fn the_same_recording_gets_the_same_answer() {
    let recording = record(&arm(), 0.0, &|row| {
        if row.0 == 2 {
            0.4 * (row.3 / 0.003).tanh()
        } else {
            0.0
        }
    });
    assert_eq!(diagnosed(&recording), diagnosed(&recording));
}

#[test]
fn friction_of_a_joint_is_found_within_a_hundredth() {
    let rough = record(&arm(), 0.0, &|(joint, _, _, velocity, ..)| {
        if joint == 1 {
            6.0 * velocity + 5.0 * (velocity / 0.003).tanh()
        } else {
            0.0
        }
    });
    let diagnosis = diagnosed(&rough);
    assert_eq!(
        found(&diagnosis),
        ["coulomb_friction joint 2", "viscous_friction joint 2"]
    );
    assert!((number(&diagnosis, "viscous_friction", "viscous") / 6.0 - 1.0).abs() < 0.02);
    assert!((number(&diagnosis, "coulomb_friction", "coulomb") / 5.0 - 1.0).abs() < 0.01);
    let curve = &diagnosis.friction[0];
    let fastest = curve.velocity.len() - 1;
    assert!(
        (curve.torque[fastest] - 5.0 - 6.0 * curve.velocity[fastest]).abs()
            < 4.0 * curve.sigma[fastest]
    );
}

#[test]
fn each_cause_of_one_joint_is_called_by_its_name() {
    type Case = (&'static str, Box<dyn Fn(Row) -> f64>);
    fn friction(velocity: f64) -> f64 {
        4.0 * velocity + 6.0 * (velocity / 0.003).tanh()
    }
    let at = |joint: usize, law: &'static dyn Fn(Row) -> f64| -> Box<dyn Fn(Row) -> f64> {
        Box::new(move |row| friction(row.3) + if row.0 == joint { law(row) } else { 0.0 })
    };
    let cases: Vec<Case> = vec![
        (
            "asymmetric_friction joint 1",
            at(0, &|row| 1.5 * (row.3 / 0.003).tanh().max(0.0)),
        ),
        (
            "stribeck_friction joint 3",
            at(2, &|row| {
                4.0 * (row.3 / 0.003).tanh() * (-row.3.abs() / 0.1).exp()
            }),
        ),
        (
            "load_friction joint 2",
            at(1, &|row| 0.1 * (row.3 / 0.003).tanh() * row.5.abs()),
        ),
        (
            "warmup_friction joint 3",
            at(2, &|row| (-row.1 / 8.0).exp() * friction(row.3)),
        ),
        ("current_offset joint 4", at(3, &|_| 1.0)),
        (
            "torque_ripple joint 1",
            at(0, &|row| 1.0 * (5.0 * row.2 + 0.4).cos()),
        ),
        ("cable_stiffness joint 4", at(3, &|row| 2.0 * row.2)),
        ("rotor_inertia joint 3", at(2, &|row| 3.0 * row.4)),
    ];
    for (name, law) in cases {
        let diagnosis = diagnosed(&record(&arm(), 0.0, &*law));
        let others: Vec<String> = found(&diagnosis)
            .into_iter()
            .filter(|name| {
                !name.starts_with("viscous_friction") && !name.starts_with("coulomb_friction")
            })
            .collect();
        assert_eq!(others, [name]);
    }
}

#[test]
fn a_payload_that_was_not_declared_is_found_with_its_mass() {
    let mut real = arm();
    real.payload = Some(Inertial {
        mass: 3.5,
        ..real.payload.unwrap()
    });
    let diagnosis = diagnosed(&record(&real, 0.0, &|_| 0.0));
    assert_eq!(found(&diagnosis), ["payload_error tool"]);
    assert!((number(&diagnosis, "payload_error", "mass") - 1.5).abs() < 0.03 * 3.5);
    assert!(
        !diagnosis
            .not_observable
            .iter()
            .any(|remark| remark.contains("payload")),
        "{:?}",
        diagnosis.not_observable
    );
}

#[test]
fn rows_that_are_lost_now_and_then_change_no_finding_and_a_remark_counts_them() {
    let mut holed = record(&arm(), 0.0, &|row| {
        if row.0 == 2 {
            4.0 * (row.3 / 0.003).tanh()
        } else {
            0.0
        }
    });
    let whole = holed.clone();
    // Two rows of each 60: every stretch between would be too short to be filtered.
    let kept = |row: usize| row % 60 < 58;
    let of_values = |values: &[f64], width: usize| -> Vec<f64> {
        values
            .chunks_exact(width)
            .enumerate()
            .filter(|(row, _)| kept(*row))
            .flat_map(|(_, values)| values.to_vec())
            .collect()
    };
    (holed.time, holed.position, holed.torque) = (
        of_values(&whole.time, 1),
        of_values(&whole.position, 4),
        of_values(&whole.torque, 4),
    );
    holed.held_out = (0..whole.rows())
        .filter(|row| kept(*row))
        .map(|row| whole.held_out[row])
        .collect();
    holed.trajectory.truncate(holed.rows());
    let diagnosis = diagnosed(&holed);
    assert_eq!(found(&diagnosis), ["coulomb_friction joint 3"]);
    assert!((number(&diagnosis, "coulomb_friction", "coulomb") / 4.0 - 1.0).abs() < 0.02);
    assert!(
        diagnosis
            .remarks
            .iter()
            .any(|remark| remark.contains("steps of the clock without a row")),
        "{:?}",
        diagnosis.remarks
    );
    let courses = &diagnosis.courses;
    assert!(
        courses
            .row
            .iter()
            .zip(&courses.time)
            .all(|(row, time)| (holed.time[*row] - time).abs() < 0.03)
    );
}

#[test]
fn a_tilted_base_is_found_with_its_angle() {
    let mut real = arm();
    let tilt = 2f64.to_radians();
    real.gravity = Vector3::new(9.81 * tilt.sin(), 0.0, -9.81 * tilt.cos());
    let diagnosis = diagnosed(&record(&real, 0.0, &|_| 0.0));
    assert_eq!(found(&diagnosis), ["gravity_direction base"]);
    assert!((number(&diagnosis, "gravity_direction", "tilt") - 2.0).abs() < 0.1);
}

#[test]
fn torques_that_come_late_are_no_physics_of_the_arm() {
    let diagnosis = diagnosed(&record(&arm(), 0.012, &|_| 0.0));
    assert_eq!(found(&diagnosis), ["current_latency recording"]);
    assert!((number(&diagnosis, "current_latency", "latency") - 12.0).abs() < 1.0);
}

/// Velocity of the tool point per velocity of a joint, by differences.
pub(super) fn lever(joint: usize, time: f64) -> Vector3<f64> {
    const STEP: f64 = 1e-6;
    let tool = |by: f64| {
        let arm = arm();
        (0..4).rev().fold(arm.tool.coords, |point, one| {
            let angle = moved(one, time).0 + if one == joint { by } else { 0.0 };
            let origin = arm.points[one].coords;
            nalgebra::Rotation3::new(arm.axes[one] * angle) * (point - origin) + origin
        })
    };
    (tool(STEP) - tool(-STEP)) / (2.0 * STEP)
}

#[test]
fn a_push_is_found_with_its_time_and_costs_no_friction() {
    let push = |time: f64| {
        if (12.0..13.3).contains(&time) {
            (std::f64::consts::PI * (time - 12.0) / 1.3).sin().powi(2)
        } else {
            0.0
        }
    };
    let force = Vector3::new(20.0, -30.0, 25.0);
    let pushed = record(&arm(), 0.0, &|(joint, time, _, velocity, ..)| {
        5.0 * (velocity / 0.003).tanh() - push(time) * lever(joint, time).dot(&force)
    });
    let diagnosis = diagnosed(&pushed);
    let frictions = (1..=4).map(|joint| format!("coulomb_friction joint {joint}"));
    let expected: Vec<String> = ["contact arm".into()]
        .into_iter()
        .chain(frictions)
        .collect();
    assert_eq!(found(&diagnosis), expected);
    for (found, axis) in [0, 1, 2].map(|axis| (diagnosis.events[0].force[axis], axis)) {
        assert!((found - force[axis]).abs() < 5.0, "{:?}", diagnosis.events);
    }
    assert!((number(&diagnosis, "contact", "start") - 12.0).abs() < 0.3);
}

#[test]
fn masses_that_are_not_declared_are_identified_and_a_sentence_states_it() {
    let recording = record(&arm(), 0.0, &|row| 5.0 * (row.3 / 0.003).tanh());
    let bare = DynamicArm {
        links: None,
        payload: None,
        ..arm()
    };
    let diagnosis = diagnose(&bare, &recording, &TorqueQuestion::default(), &mut |_| ()).unwrap();
    assert!(
        matches!(diagnosis.basis, InertialBasis::Free(count) if count < 30),
        "{:?}",
        diagnosis.basis
    );
    assert_eq!(
        found(&diagnosis),
        [1, 2, 3, 4].map(|joint| format!("coulomb_friction joint {joint}"))
    );
    assert!(
        diagnosis
            .not_observable
            .iter()
            .any(|sentence| sentence.starts_with("masses are identified"))
    );
}

#[test]
fn a_recording_that_cannot_be_used_is_refused_with_its_reason() {
    let good = record(&arm(), 0.0, &|_| 0.0);
    let refusal = |change: &dyn Fn(&mut TorqueRecording)| {
        let mut bad = good.clone();
        change(&mut bad);
        diagnose(&arm(), &bad, &TorqueQuestion::default(), &mut |_| ())
            .unwrap_err()
            .to_string()
    };
    let least = good
        .torque
        .iter()
        .skip(1)
        .step_by(4)
        .copied()
        .fold(0.0, f64::min);
    let answers = [
        (
            refusal(&|r| r.torque.iter_mut().for_each(|torque| *torque *= 1e3)),
            "by 1,000?",
        ),
        (
            refusal(&|r| r.torque.iter_mut().for_each(|torque| *torque *= 0.08)),
            "map them as `current`",
        ),
        (
            refusal(&|r| {
                r.torque.iter_mut().for_each(|torque| *torque *= 12.0);
                r.from_current = true;
            }),
            "map them as `torque`",
        ),
        (
            refusal(&|r| {
                r.position
                    .iter_mut()
                    .for_each(|angle| *angle = angle.to_degrees())
            }),
            "degrees?",
        ),
        (
            refusal(&|r| r.torque.chunks_exact_mut(4).for_each(|row| row.swap(1, 2))),
            "joint 2 and joint 3 look exchanged",
        ),
        (
            refusal(&|r| r.time[700] = r.time[600]),
            "row 701: the clock goes",
        ),
        (
            refusal(&|r| {
                r.torque
                    .iter_mut()
                    .skip(3)
                    .step_by(4)
                    .for_each(|torque| *torque = 1.0)
            }),
            "joint 4: torque is 1 in every row",
        ),
        (
            refusal(&|r| {
                r.torque
                    .iter_mut()
                    .skip(1)
                    .step_by(4)
                    .for_each(|torque| *torque = torque.max(0.8 * least))
            }),
            "is cut off",
        ),
        (
            refusal(&|r| r.position.iter_mut().for_each(|angle| *angle *= 1e-3)),
            "hardly moves",
        ),
        (
            refusal(&|r| r.torque[17] = f64::NAN),
            "row 5: not a finite number",
        ),
    ];
    for (answer, reason) in answers {
        assert!(answer.contains(reason), "{answer}");
    }
}
