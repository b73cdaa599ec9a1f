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

/// An arm on the floor whose joints turn about some axes through some points, of no declared masses.
pub(super) fn bare_arm(
    axes: impl IntoIterator<Item = [f64; 3]>,
    points: impl IntoIterator<Item = [f64; 3]>,
    tool: [f64; 3],
) -> DynamicArm {
    let axes = axes.into_iter().map(|axis| Vector3::from(axis).normalize());
    let axes: Vec<Vector3<f64>> = axes.collect();
    let n = axes.len();
    DynamicArm {
        axes,
        points: points.into_iter().map(Point3::from).collect(),
        prismatic: vec![false; n],
        tool: tool.into(),
        links: None,
        payload: None,
        gravity: Vector3::new(0.0, 0.0, -9.81),
        ratio: vec![100.0; n],
        coupled: Vec::new(),
        tolerance: InertialTolerance {
            mass_relative: 0.01,
            centre: 0.0015,
            inertia_relative: 0.05,
        },
    }
}

/// Four joints: a shoulder, an elbow and a wrist, without declared masses.
pub(super) fn bare() -> DynamicArm {
    let axes = [
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
    ];
    let points = [
        [0.0, 0.0, 0.0],
        [0.1, 0.0, 0.4],
        [0.6, 0.0, 0.4],
        [0.8, 0.0, 0.4],
    ];
    bare_arm(axes, points, [1.1, 0.0, 0.4])
}

/// The same with its masses and a payload of 2 kg.
pub(super) fn arm() -> DynamicArm {
    let rod = |mass: f64, x: f64, length: f64| {
        let across = mass * length * length / 12.0;
        Inertial {
            mass,
            centre: Point3::new(x, 0.02, 0.4),
            inertia: Matrix3::from_diagonal(&Vector3::new(0.1 * across, across, across)),
        }
    };
    DynamicArm {
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
        ..bare()
    }
}

/// What causes see of 100 rows a second of a motion of an arm.
pub(super) fn scene(arm: &DynamicArm, position: Vec<f64>) -> scene::DynamicScene<'_> {
    let rows = position.len() / arm.joints();
    let time = (0..rows).map(|row| row as f64 / RATE).collect();
    let recording = TorqueRecording::of_motion(arm.joints(), time, position);
    let clock = RecordingClock::of(&recording);
    scene::DynamicScene::new(arm, &recording, &clock, 10.0, false)
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
pub(super) type Row = (usize, f64, f64, f64, f64, f64);

/// The smoothed sign of a velocity.
pub(super) fn sign(velocity: f64) -> f64 {
    (velocity / 0.003).tanh()
}

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
    let time: Vec<f64> = (0..rows).map(|row| row as f64 / rate).collect();
    let position = time
        .iter()
        .flat_map(|time| (0..n).map(|joint| moved(joint, *time).0));
    let position = position.collect();
    let mut recording = TorqueRecording::of_motion(n, time, position);
    recording.held_out = (0..rows).map(|row| row * 5 > rows * 3).collect();
    let mut torque = vec![0.0; n];
    for time in &recording.time {
        let then = time - latency;
        let motion: Vec<(f64, f64, f64)> = (0..n).map(|joint| moved(joint, then)).collect();
        let [q, dq, ddq] = [0, 1, 2].map(|part| {
            let motion = motion.iter().map(|m| [m.0, m.1, m.2][part]);
            motion.collect::<Vec<f64>>()
        });
        let row = MotionRow {
            position: &q,
            velocity: &dq,
            acceleration: &ddq,
        };
        dynamics.torque(row, &real.gravity, &theta, &mut torque);
        for (joint, torque) in torque.iter().enumerate() {
            // Nearly normal.
            let noise: f64 = (0..12).map(|_| dice.random::<f64>() - 0.5).sum();
            let more = extra((joint, then, q[joint], dq[joint], ddq[joint], *torque));
            recording.torque.push(torque + more + NOISE * noise);
        }
    }
    recording
}

/// Names with places, sorted.
pub(super) fn found(diagnosis: &TorqueDiagnosis) -> Vec<String> {
    let names = diagnosis.findings.iter();
    let mut names: Vec<String> = names.map(|f| format!("{} {}", f.effect, f.place)).collect();
    names.sort();
    names
}

pub(super) fn diagnosed(recording: &TorqueRecording) -> TorqueDiagnosis {
    diagnose(&arm(), recording, &TorqueQuestion::default(), &mut |_| ()).unwrap()
}

/// The same of the declared arm with a torque added at each joint.
pub(super) fn diagnosed_with(extra: &dyn Fn(Row) -> f64) -> TorqueDiagnosis {
    diagnosed(&record(&arm(), 0.0, extra))
}

/// The first finding of a name.
pub(super) fn of_name<'a>(diagnosis: &'a TorqueDiagnosis, effect: &str) -> &'a TorqueFinding {
    let mut findings = diagnosis.findings.iter();
    findings.find(|finding| finding.effect == effect).unwrap()
}

/// A parameter of a finding.
pub(super) fn parameter<'a>(finding: &'a TorqueFinding, name: &str) -> &'a cause::TorqueParameter {
    let mut parameters = finding.parameters.iter();
    parameters.find(|parameter| parameter.name == name).unwrap()
}

/// The value of a parameter of the first finding of a name.
fn number(diagnosis: &TorqueDiagnosis, effect: &str, name: &str) -> f64 {
    parameter(of_name(diagnosis, effect), name).value
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
    let recording = record(&arm(), 0.0, &|row| match row.0 {
        2 => 0.4 * sign(row.3),
        _ => 0.0,
    });
    assert_eq!(diagnosed(&recording), diagnosed(&recording));
}

#[test]
fn friction_of_a_joint_is_found_within_a_hundredth() {
    let diagnosis = diagnosed_with(&|(joint, _, _, velocity, ..)| match joint {
        1 => 6.0 * velocity + 5.0 * sign(velocity),
        _ => 0.0,
    });
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
fn errors_of_friction_scatter_by_their_standard_deviations() {
    const FRICTION: [(&str, &str, f64); 2] = [
        ("viscous_friction", "viscous", 4.0),
        ("coulomb_friction", "coulomb", 6.0),
    ];
    let mut squares = Vec::new();
    for seed in 0..8 {
        // Noise that lasts a tenth of a second beside the white one, Nm.
        let slow = std::cell::RefCell::new((ChaCha8Rng::seed_from_u64(seed), [0.0; 4]));
        let recording = record(&arm(), 0.0, &|(joint, _, _, velocity, ..)| {
            let (dice, lasting) = &mut *slow.borrow_mut();
            let fresh: f64 = (0..12).map(|_| dice.random::<f64>() - 0.5).sum();
            lasting[joint] = 0.9 * lasting[joint] + 0.13 * fresh;
            let braked = FRICTION[0].2 * velocity + FRICTION[1].2 * sign(velocity);
            braked + lasting[joint]
        });
        let diagnosis =
            diagnose(&bare(), &recording, &TorqueQuestion::default(), &mut |_| ()).unwrap();
        for (effect, name, truth) in FRICTION {
            let found = diagnosis.findings.iter().filter(|one| one.effect == effect);
            let numbers = found.map(|one| parameter(one, name));
            squares.extend(numbers.map(|one| ((one.value - truth) / one.sigma.unwrap()).powi(2)));
        }
    }
    let count = squares.len() as f64;
    let rms = (squares.iter().sum::<f64>() / count).sqrt();
    assert!(
        count > 60.0 && (0.8..1.2).contains(&rms),
        "{rms} of {count}"
    );
}

#[test]
fn each_cause_of_one_joint_is_called_by_its_name() {
    fn friction(velocity: f64) -> f64 {
        4.0 * velocity + 6.0 * sign(velocity)
    }
    type Case = (&'static str, usize, fn(Row) -> f64);
    let cases: [Case; 8] = [
        ("asymmetric_friction", 0, |row| 1.5 * sign(row.3).max(0.0)),
        ("stribeck_friction", 2, |row| {
            4.0 * sign(row.3) * (-row.3.abs() / 0.1).exp()
        }),
        ("load_friction", 1, |row| 0.1 * sign(row.3) * row.5.abs()),
        ("warmup_friction", 2, |row| {
            (-row.1 / 8.0).exp() * friction(row.3)
        }),
        ("current_offset", 3, |_| 1.0),
        ("torque_ripple", 0, |row| 1.0 * (5.0 * row.2 + 0.4).cos()),
        ("cable_stiffness", 3, |row| 2.0 * row.2),
        ("rotor_inertia", 2, |row| 3.0 * row.4),
    ];
    for (name, joint, law) in cases {
        let diagnosis =
            diagnosed_with(&|row| friction(row.3) + if row.0 == joint { law(row) } else { 0.0 });
        let mut others = found(&diagnosis);
        let common = ["viscous_friction", "coulomb_friction"];
        others.retain(|name| !common.iter().any(|common| name.starts_with(common)));
        assert_eq!(others, [format!("{name} joint {}", joint + 1)]);
    }
}

#[test]
fn load_friction_is_found_by_its_law() {
    fn friction(velocity: f64) -> f64 {
        4.0 * velocity + 6.0 * sign(velocity)
    }
    let of_joint = |law: fn(Row) -> f64| {
        diagnosed_with(&|row| friction(row.3) + if row.0 == 1 { law(row) } else { 0.0 })
    };
    let driven_back = of_joint(|row| {
        let share = if row.5 * row.3 > 0.0 { 0.25 } else { 0.1 };
        share * sign(row.3) * row.5.abs()
    });
    for (name, truth) in [("share", 0.25), ("share_driven_back", 0.1)] {
        let share = number(&driven_back, "load_friction", name);
        assert!((share - truth).abs() < 0.03, "{name}: {share}");
    }
    let square = of_joint(|row| 0.002 * sign(row.3) * row.5 * row.5);
    let exponent = number(&square, "load_friction", "exponent");
    assert!((exponent - 2.0).abs() < 0.3, "{exponent}");
}

#[test]
fn what_the_simulation_of_a_recording_lacks_is_found_without_masses() {
    let rigid = std::cell::RefCell::new(Vec::new());
    let mut recording = record(&arm(), 0.0, &|row| {
        rigid.borrow_mut().push(row.5);
        match row.0 {
            1 => 6.0 * row.3 + 5.0 * sign(row.3) + 0.2 * sign(row.3) * row.5.abs(),
            _ => 0.0,
        }
    });
    recording.simulated = Some(rigid.into_inner());
    let bare = DynamicArm {
        links: None,
        ..arm()
    };
    let diagnosis = diagnose(&bare, &recording, &TorqueQuestion::default(), &mut |_| ()).unwrap();
    let names = ["coulomb_friction", "load_friction", "viscous_friction"];
    assert_eq!(
        found(&diagnosis),
        names.map(|name| format!("{name} joint 2"))
    );
    for (name, parameter, truth) in [
        (names[0], "coulomb", 5.0),
        (names[1], "share", 0.2),
        (names[2], "viscous", 6.0),
    ] {
        let value = number(&diagnosis, name, parameter);
        assert!((value / truth - 1.0).abs() < 0.05, "{name}: {value}");
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
    let hidden = diagnosis.not_observable.join("; ");
    assert!(!hidden.contains("payload"), "{hidden}");
}

#[test]
fn rows_that_are_lost_now_and_then_change_no_finding_and_a_remark_counts_them() {
    let whole = record(&arm(), 0.0, &|row| match row.0 {
        2 => 4.0 * sign(row.3),
        _ => 0.0,
    });
    let mut holed = TorqueRecording::like(&whole);
    // Two rows of each 60: every stretch between would be too short to be filtered.
    for row in (0..whole.rows()).filter(|row| row % 60 < 58) {
        holed.extend(&whole, row..row + 1);
    }
    let diagnosis = diagnosed(&holed);
    assert_eq!(found(&diagnosis), ["coulomb_friction joint 3"]);
    assert!((number(&diagnosis, "coulomb_friction", "coulomb") / 4.0 - 1.0).abs() < 0.02);
    let remarks = diagnosis.remarks.join("; ");
    assert!(
        remarks.contains("steps of the clock without a row"),
        "{remarks}"
    );
    let courses = &diagnosis.courses;
    let mut rows = courses.row.iter().zip(&courses.time);
    assert!(rows.all(|(row, time)| (holed.time[*row] - time).abs() < 0.03));
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
    let force = Vector3::new(20.0, -30.0, 25.0);
    // Begin and end: in the middle, and of two seconds early in the recording.
    for (begin, end, near) in [(12.0, 13.3, 0.3), (1.2, 3.4, 0.1)] {
        let push = |time: f64| match (time - begin) / (end - begin) {
            share if (0.0..1.0).contains(&share) => (std::f64::consts::PI * share).sin().powi(2),
            _ => 0.0,
        };
        let diagnosis = diagnosed_with(&|(joint, time, _, velocity, ..)| {
            5.0 * sign(velocity) - push(time) * lever(joint, time).dot(&force)
        });
        let frictions = (1..=4).map(|joint| format!("coulomb_friction joint {joint}"));
        let expected = std::iter::once("contact arm".into()).chain(frictions);
        assert_eq!(found(&diagnosis), expected.collect::<Vec<String>>());
        let event = &diagnosis.events[0];
        assert!(
            (Vector3::from(event.force) - force).amax() < 5.0,
            "{event:?}"
        );
        assert!((event.start - begin).abs() < near, "{event:?}");
        assert!((event.end - end).abs() < near, "{event:?}");
        assert_eq!(number(&diagnosis, "contact", "start"), event.start);
    }
}

#[test]
fn masses_that_are_not_declared_are_identified_and_a_sentence_states_it() {
    let recording = record(&arm(), 0.0, &|row| 5.0 * sign(row.3));
    let question = TorqueQuestion::default();
    let diagnosis = diagnose(&bare(), &recording, &question, &mut |_| ()).unwrap();
    assert!(
        matches!(diagnosis.basis, InertialBasis::Free(count) if count < 30),
        "{:?}",
        diagnosis.basis
    );
    assert_eq!(
        found(&diagnosis),
        [1, 2, 3, 4].map(|joint| format!("coulomb_friction joint {joint}"))
    );
    let mut sentences = diagnosis.not_observable.iter();
    assert!(sentences.any(|sentence| sentence.starts_with("masses are identified")));
}

#[test]
fn a_recording_that_cannot_be_used_is_refused_with_its_reason() {
    let good = record(&arm(), 0.0, &|_| 0.0);
    let least = recording::ends(recording::column(&good.torque, 4, 1))[0];
    type Change = Box<dyn Fn(&mut TorqueRecording)>;
    // The torques of a joint, from 0.
    let of_joint = |joint: usize, change: fn(f64, f64) -> f64| -> Change {
        Box::new(move |r| {
            let torques = r.torque.iter_mut().skip(joint).step_by(4);
            torques.for_each(|torque| *torque = change(*torque, least));
        })
    };
    let times = |factor: f64, from_current: bool| -> Change {
        Box::new(move |r| {
            r.torque.iter_mut().for_each(|torque| *torque *= factor);
            r.from_current = from_current;
        })
    };
    let angles = |change: fn(f64) -> f64| -> Change {
        Box::new(move |r| {
            r.position
                .iter_mut()
                .for_each(|angle| *angle = change(*angle))
        })
    };
    let refused: [(Change, &str); 10] = [
        (times(1e3, false), "by 1,000?"),
        (times(0.08, false), "map them as `current`"),
        (times(12.0, true), "map them as `torque`"),
        (angles(f64::to_degrees), "degrees?"),
        (
            Box::new(|r| r.torque.chunks_exact_mut(4).for_each(|row| row.swap(1, 2))),
            "joint 2 and joint 3 look exchanged",
        ),
        (
            Box::new(|r| r.time[700] = r.time[600]),
            "row 701: the clock goes",
        ),
        (of_joint(3, |_, _| 1.0), "joint 4: torque is 1 in every row"),
        (
            of_joint(1, |torque, least| torque.max(0.8 * least)),
            "is cut off",
        ),
        (angles(|angle| 1e-3 * angle), "hardly moves"),
        (
            Box::new(|r| r.torque[17] = f64::NAN),
            "row 5: not a finite number",
        ),
    ];
    for (change, reason) in refused {
        let mut bad = good.clone();
        change(&mut bad);
        let answer = diagnose(&arm(), &bad, &TorqueQuestion::default(), &mut |_| ()).unwrap_err();
        assert!(answer.to_string().contains(reason), "{answer}");
    }
}
