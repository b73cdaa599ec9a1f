//! Programs state every posture of a spherical wrist: status and turn of KRL, confdata of RAPID, in the controller's counting. With them the
//! true robot goes to the same points as with the targets stated as joints.

use super::maker::{Maker, PLAIN, makers};
use super::round_trip::{Trip, pose, read};
use super::{ROBOT, cell};
use crate::answer::{calib, has, put};
use crate::fixture::{apart, largest, robot_of};
use calib::program::{Language, PostureStatement};
use calib::robot::RobotModel;
use calib::spatial::Pose;
use nalgebra::UnitQuaternion;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// Whether the wrist centre is in front of axis 1, beyond the stretched arm in the positive sense of the counted joint 3, and joint 5 above
/// 0: by the lengths of the arm, 500 and 700 mm.
fn sides(maker: &Maker, q: &[f64]) -> [bool; 3] {
    let x = 500.0 * q[1].sin() + 700.0 * (q[1] + q[2]).cos();
    [
        x > 0.0,
        q[2].cos() * maker.sign[2] > 0.0,
        q[4].sin() * maker.sign[4] > 0.0,
    ]
}

fn is_clear(maker: &Maker, q: &[f64]) -> bool {
    let x = 500.0 * q[1].sin() + 700.0 * (q[1] + q[2]).cos();
    maker.is_clear(q) && x.abs() > 60.0 && q[2].cos().abs() > 0.1 && q[4].sin().abs() > 0.1
}

/// Poses within the limits, as many in each of the eight postures.
pub fn poses(trip: &Trip, maker: &Maker, count: usize) -> Vec<Vec<f64>> {
    // Multiples of square roots of primes fill the limits evenly.
    const ROOTS: [f64; 6] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0];
    let pose = |k: usize| -> Vec<f64> {
        let at = |(joint, root): (&calib::description::JointDescription, f64)| {
            let [low, high] = joint.limits.unwrap();
            low + (high - low) * (k as f64 * root.sqrt()).fract()
        };
        trip.robot
            .description()
            .joints
            .iter()
            .zip(ROOTS)
            .map(at)
            .collect()
    };
    let mut found: BTreeMap<[bool; 3], usize> = BTreeMap::new();
    let mut wanted = |q: &Vec<f64>| {
        let so_far = found.entry(sides(maker, q)).or_default();
        *so_far += 1;
        *so_far <= count / 8
    };
    // A turn more of a joint has another sign, or is beyond its limits.
    let limits = |joint: usize| trip.robot.description().joints[joint].limits.unwrap();
    let result_of = |q: &Vec<f64>, joint: usize, more: f64| {
        let (turned, [low, high], c) = (
            q[joint] + more * TAU,
            limits(joint),
            maker.counted(q)[joint],
        );
        !(low..=high).contains(&turned) || (c + maker.sign[joint] * more * 360.0 < 0.0) != (c < 0.0)
    };
    let is_told =
        |q: &Vec<f64>| (0..6).all(|joint| result_of(q, joint, 1.0) && result_of(q, joint, -1.0));
    (1..20000)
        .map(pose)
        .filter(|q| is_clear(maker, q) && is_told(q))
        .filter(|q| wanted(q))
        .take(count)
        .collect()
}

pub fn status(maker: &Maker, q: &[f64]) -> u32 {
    let [front, beyond, above] = sides(maker, q);
    u32::from(!front) + 2 * u32::from(beyond) + 4 * u32::from(!above)
}

pub fn turn(maker: &Maker, q: &[f64]) -> u32 {
    maker
        .counted(q)
        .iter()
        .enumerate()
        .filter(|(_, c)| **c < 0.0)
        .map(|(joint, _)| 1 << joint)
        .sum()
}

pub fn confdata(maker: &Maker, q: &[f64]) -> [i32; 4] {
    let [front, beyond, above] = sides(maker, q);
    let quadrant = |joint: usize| (maker.counted(q)[joint] / 90.0).floor() as i32;
    [
        quadrant(0),
        quadrant(3),
        quadrant(5),
        4 * i32::from(!front) + 2 * i32::from(!beyond) + i32::from(!above),
    ]
}

pub fn krl(pose: &Pose, posture: &str) -> String {
    let (c, b, a) = UnitQuaternion::from_matrix(&pose.rotation).euler_angles();
    let [a, b, c] = [a, b, c].map(f64::to_degrees);
    let [x, y, z]: [f64; 3] = (pose.translation * 1e3).into();
    format!("PTP {{X {x:.6},Y {y:.6},Z {z:.6},A {a:.9},B {b:.9},C {c:.9}{posture}}}\n")
}

pub fn rapid(pose: &Pose, [one, four, six, x]: [i32; 4]) -> String {
    let turn = UnitQuaternion::from_matrix(&pose.rotation);
    let [px, py, pz]: [f64; 3] = (pose.translation * 1e3).into();
    format!(
        "MoveJ [[{px:.6},{py:.6},{pz:.6}],[{:.10},{:.10},{:.10},{:.10}],[{one},{four},{six},{x}],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\n",
        turn.w, turn.i, turn.j, turn.k
    )
}

/// Whether a maker's RAPID says on which side the arm is: not with a parallelogram.
fn uses_cfx(maker: &Maker) -> bool {
    let parallelogram = maker
        .convention()
        .coupled()
        .iter()
        .any(|coupling| (coupling.joint, coupling.by) == (2, 1));
    !parallelogram
}

#[test]
fn every_posture_that_a_program_states_is_reached_as_its_joints_are() {
    let trip = Trip::new();
    for maker in std::iter::once(PLAIN).chain(makers()) {
        let poses = poses(&trip, &maker, 48);
        let postures: BTreeSet<[bool; 3]> = poses.iter().map(|q| sides(&maker, q)).collect();
        assert_eq!((poses.len(), postures.len()), (48, 8), "{}", maker.name);
        let placed = |text: fn(&Maker, &[f64], &Pose) -> String| -> String {
            poses
                .iter()
                .map(|q| text(&maker, q, &trip.robot.forward(q)))
                .collect()
        };
        let ours = trip.misses_by_joints(&maker, &poses);
        let status_turn = placed(|maker, q, at| {
            krl(at, &format!(",S {},T {}", status(maker, q), turn(maker, q)))
        });
        let bits = placed(|maker, q, at| {
            krl(
                at,
                &format!(",S 'B{:03b}',T 'B{:06b}'", status(maker, q), turn(maker, q)),
            )
        });
        let configured = placed(|maker, q, at| rapid(at, confdata(maker, q)));
        let mut programs = vec![
            ("KRL", Language::Krl, status_turn),
            ("KRL, bits", Language::Krl, bits),
        ];
        if uses_cfx(&maker) {
            programs.push(("RAPID", Language::Rapid, configured));
        }
        for (name, language, text) in programs {
            let written = trip
                .compensated(&maker, language, &text)
                .unwrap_or_else(|refused| panic!("{} {name}: {refused}", maker.name));
            let targets = read(language, &written.bytes);
            let driven: Vec<Vec<f64>> = targets
                .iter()
                .zip(&poses)
                .map(|(target, q)| trip.driven(pose(target), q))
                .collect();
            for (target, q) in targets.iter().zip(&driven) {
                let stated = match language {
                    Language::Krl => PostureStatement::StatusTurn {
                        status: Some(status(&maker, q)),
                        turn: Some(turn(&maker, q)),
                    },
                    _ => PostureStatement::Configuration(confdata(&maker, q)),
                };
                assert_eq!(target.posture, stated, "{} {name}: {q:?}", maker.name);
            }
            let apart = apart(&trip.misses(&poses, &driven), &ours);
            println!(
                "{}: {name}: {apart:.6} mm from the same targets as joints",
                maker.name
            );
            assert!(apart < 1e-3, "{} {name}", maker.name);
        }
        assert!(largest(ours) < 0.1, "{}", maker.name);
    }
}

#[test]
fn a_posture_that_no_joints_have_is_refused_with_its_line() {
    let trip = Trip::new();
    let q = [10.0f64, 15.0, -20.0, 25.0, 40.0, 30.0].map(f64::to_radians);
    let at = trip.robot.forward(&q);
    assert_eq!(
        (status(&PLAIN, &q), turn(&PLAIN, &q), confdata(&PLAIN, &q)),
        (2, 4, [0, 0, 0, 0])
    );
    let message_of = |language: Language, text: String| {
        trip.compensated(&PLAIN, language, &text)
            .expect_err("refused")
    };
    let sound = krl(&at, ",S 2,T 4");
    // Joint 5 below 0 by S, above by T.
    let refused = message_of(Language::Krl, format!("{sound}{}", krl(&at, ",S 6,T 4")));
    has(
        &refused,
        [
            "program:2:",
            "not reached in the posture that is stated (S 6, T 4)",
        ],
    );
    let refused = message_of(Language::Rapid, rapid(&at, [0, 0, 0, 1]));
    has(
        &refused,
        "not reached in the posture that is stated ([0,0,0,1]); it is reached in [0,0,0,0]",
    );
    // S alone, of which the wrist turned over is another solution.
    let over = trip
        .compensated(&PLAIN, Language::Krl, &krl(&at, ",S 6"))
        .unwrap();
    assert_ne!(
        over.bytes,
        trip.compensated(&PLAIN, Language::Krl, &krl(&at, ",S 2"))
            .unwrap()
            .bytes
    );
}

#[test]
fn a_joint_that_the_correction_takes_over_its_zero_is_stated_anew() {
    let trip = Trip::new();
    // Joints 1, 4 and 6 at zero: the correction takes some of them below it.
    let q = [0.0f64, 15.0, -20.0, 0.0, 40.0, 0.0].map(f64::to_radians);
    let at = trip.robot.forward(&q);
    for (language, text) in [
        (Language::Krl, krl(&at, ",S 2,T 4")),
        (Language::Krl, krl(&at, ",S 'B010',T 'B000100'")),
        (Language::Rapid, rapid(&at, [0, 0, 0, 0])),
    ] {
        let written = trip.compensated(&PLAIN, language, &text).unwrap();
        let target = read(language, &written.bytes).remove(0);
        let driven = trip.driven(pose(&target), &q);
        assert!(
            [0, 3, 5].iter().any(|joint| driven[*joint] < -1e-5),
            "{driven:?}"
        );
        let stated = match language {
            Language::Krl => PostureStatement::StatusTurn {
                status: Some(2),
                turn: Some(turn(&PLAIN, &driven)),
            },
            _ => PostureStatement::Configuration(confdata(&PLAIN, &driven)),
        };
        assert_eq!(
            target.posture,
            stated,
            "{}",
            String::from_utf8_lossy(&written.bytes)
        );
        assert!(
            written
                .warnings
                .iter()
                .any(|note| note.message.contains("of the corrected joints, was")),
            "{:?}",
            written.warnings
        );
        let bits = String::from_utf8_lossy(&written.bytes).contains(",T 'B");
        assert_eq!(bits, text.contains("'B"));
    }
}

#[test]
fn programs_state_postures_and_are_told_once_where_they_do_not() {
    let q = [10.0f64, 15.0, -20.0, 25.0, 40.0, 30.0].map(f64::to_radians);
    let pose = RobotModel::new(robot_of(ROBOT)).forward(&q);
    let module = |configuration| format!("MODULE m\n{}ENDMODULE\n", rapid(&pose, configuration));
    let ptp = |posture: &str| krl(&pose, posture);
    let run = |name: &str, text: String| {
        put(cell(), name, text);
        let words = format!("compensate latest {name} --start 2,3,4,5,40,0");
        calib(cell(), &words)
    };
    let silent = |name: &str, text: String| {
        let answer = run(name, text).code(0);
        assert!(!answer.err.contains("posture"), "{}", answer.err);
        answer.out
    };
    let unreached = "not reached in the posture that is stated";
    let ours = silent("own.mod", module([0, 0, 0, 0]));
    // The wrist turned over: another posture, another error, another correction.
    assert_ne!(ours, run("over.mod", module([0, -2, -2, 1])).ok());
    let err = run("none.mod", module([1, 0, 0, 0])).refused();
    has(&err, ["none.mod:2:", unreached]);
    // Joint 3 below 0, by number and by bits.
    let by_number = silent("t.src", ptp(",S 2,T 4"));
    let by_bits = silent("b.src", ptp(",T 'B000100'"));
    let targets = |text: &str| {
        let lines = text.lines().filter(|line| line.starts_with("PTP"));
        lines.map(|line| line[..60].to_string()).collect::<Vec<_>>()
    };
    assert_eq!(targets(&by_number), targets(&by_bits));
    let err = run("s.src", ptp(",S 3,T 4")).code(10).err;
    has(&err, &format!("{unreached} (S 3, T 4)"));
    let err = run("below.src", ptp(",T 'B000101'")).code(10).err;
    has(&err, unreached);
    let err = run("open.src", ptp("") + &ptp("")).code(0).err;
    let open = "posture not stated: taken nearest to the target before";
    assert_eq!(err.matches(open).count(), 1, "{err}");
    has(&err, "open.src:1:");
}
