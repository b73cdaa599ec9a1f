//! A Cartesian target is reached in the posture that it states, as the controller counts, or not at all.

use super::maker::{Maker, makers_of};
use super::{ROBOT, cell};
use crate::answer::{Answer, calib, has, put};
use crate::fixture::robot_of;
use calib::compensate::{
    CommandTarget, CorrectionOptions, Corrector, IdentifiedArm, StatedPosture,
};
use calib::effect::EffectStack;
use calib::estimate::Model;
use calib::robot::RobotModel;
use calib::spatial::Pose;

/// Poses within the limits, 5 deg off every border of a quadrant and of a limit.
fn poses(robot: &RobotModel, maker: &Maker) -> Vec<Vec<f64>> {
    let pose = |k: usize| -> Vec<f64> {
        let at = |(j, joint): (usize, &calib::description::JointDescription)| {
            let [low, high] = joint.limits.unwrap();
            low + (high - low) * (0.5 + 0.48 * (1.7 * k as f64 + 2.3 * j as f64 + 0.1).sin())
        };
        robot
            .description()
            .joints
            .iter()
            .enumerate()
            .map(at)
            .collect()
    };
    let all = (0..4000).map(pose).filter(|q| maker.is_clear(q));
    all.take(40).collect()
}

#[test]
fn a_pose_is_reached_in_the_posture_that_it_states() {
    let robot = RobotModel::new(robot_of(ROBOT));
    let stack = EffectStack::new(&robot, Pose::identity(), Vec::new());
    let arm = IdentifiedArm::new(Model::nominal(robot.clone(), stack), None);
    for maker in makers_of(&["sign 1", "zeros", "KUKA", "all at once"]) {
        let poses = poses(&robot, &maker);
        assert!(poses.len() > 20, "{}: {} poses", maker.name, poses.len());
        let quadrant = |c: f64| (c / 90.0).floor() as i32;
        let by_quadrants = |q: &[f64]| {
            let c = maker.counted(q);
            StatedPosture::of_quadrants(6, &[0, 3, 5].map(|joint| (joint, quadrant(c[joint]))))
        };
        let by_signs = |q: &[f64]| {
            let below: Vec<bool> = maker.counted(q).iter().map(|c| *c < 0.0).collect();
            StatedPosture::of_signs(&below)
        };
        let same = |c: &[f64], found: &[f64]| {
            let mut joints = [0, 3, 5].into_iter();
            joints.all(|j: usize| quadrant(c[j]) == quadrant(found[j]))
        };
        let solved = |posture: &dyn Fn(&[f64]) -> Option<StatedPosture>| -> Vec<Option<Vec<f64>>> {
            let target = |q: &Vec<f64>| {
                let pose = robot.forward(q);
                CommandTarget {
                    point: Some(pose.translation),
                    rotation: Some(pose.rotation),
                    posture: posture(q),
                    ..CommandTarget::default()
                }
            };
            let manner = CorrectionOptions {
                cartesian: true,
                ..CorrectionOptions::counted_by(maker.convention())
            };
            let answers =
                Corrector::new(&arm, None, None, manner).batch(poses.iter().map(target).collect());
            answers
                .into_iter()
                .map(|answer| answer.q.map(|q| q.iter().map(|q| q.to_degrees()).collect()))
                .collect()
        };
        let nearest = poses.iter().zip(solved(&|_| None));
        let other = nearest.filter(|(q, found)| !same(&maker.counted(q), found.as_ref().unwrap()));
        let other = other.count();
        assert!(
            other > 5,
            "{}: the nearest posture is the one that is stated anyway",
            maker.name
        );
        for (q, found) in poses.iter().zip(solved(&|q| Some(by_quadrants(q)))) {
            let (c, found) = (maker.counted(q), found.unwrap());
            assert!(same(&c, &found), "{}: {c:?}, found {found:?}", maker.name);
            let [there, here] = [&maker.driven(&found), q].map(|q| robot.forward(q).translation);
            assert!((there - here).norm() < 1e-6);
        }
        for (q, found) in poses.iter().zip(solved(&|q| Some(by_signs(q)))) {
            let (c, found) = (maker.counted(q), found.unwrap());
            assert!(
                c.iter().zip(&found).all(|(a, b)| (*a < 0.0) == (*b < 0.0)),
                "{}: {c:?}, found {found:?}",
                maker.name
            );
        }
    }
}

fn run(name: &str, text: &str) -> Answer {
    put(cell(), name, text);
    let words = format!("compensate latest {name} --start 2,3,4,5,40,0");
    calib(cell(), &words)
}

#[test]
fn programs_state_postures_and_are_told_once_where_they_do_not() {
    let robot = RobotModel::new(robot_of(ROBOT));
    let q = [10.0f64, 15.0, -20.0, 25.0, 40.0, 30.0].map(f64::to_radians);
    let pose = robot.forward(&q);
    let turn = nalgebra::UnitQuaternion::from_matrix(&pose.rotation);
    let at: Vec<String> = pose
        .translation
        .iter()
        .map(|x| format!("{:.6}", x * 1e3))
        .collect();
    let rapid = |configuration: &str| {
        let turn = format!("{:.9},{:.9},{:.9},{:.9}", turn.w, turn.i, turn.j, turn.k);
        format!(
            "MODULE m\nMoveL [[{}],[{turn}],[{configuration}],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\nENDMODULE\n",
            at.join(",")
        )
    };
    let silent = |name: &str, text: &str| {
        let answer = run(name, text).code(0);
        assert!(!answer.err.contains("posture"), "{}", answer.err);
        answer.out
    };
    let unreached = "not reached in the posture that is stated";
    let ours = silent("own.mod", &rapid("0,0,0,0"));
    // The wrist turned over: another posture, another error, another correction.
    assert_ne!(ours, run("over.mod", &rapid("0,-2,-2,1")).ok());
    let err = run("none.mod", &rapid("1,0,0,0")).refused();
    has(&err, ["none.mod:2:", unreached]);

    let (c, b, a) = turn.euler_angles();
    let krl = |posture: &str| {
        let angles = [a, b, c].map(|angle| format!("{:.9}", angle.to_degrees()));
        format!(
            "LIN {{X {},Y {},Z {},A {},B {},C {}{posture}}}\n",
            at[0], at[1], at[2], angles[0], angles[1], angles[2]
        )
    };
    // Joint 3 below 0, by number and by bits.
    let by_number = silent("t.src", &krl(",S 2,T 4"));
    let by_bits = silent("b.src", &krl(",T 'B000100'"));
    let targets = |text: &str| {
        let lines = text.lines().filter(|line| line.starts_with("LIN"));
        lines.map(|line| line[..60].to_string()).collect::<Vec<_>>()
    };
    assert_eq!(targets(&by_number), targets(&by_bits));
    let err = run("s.src", &krl(",S 3,T 4")).code(10).err;
    has(&err, &format!("{unreached} (S 3, T 4)"));
    has(
        &run("below.src", &krl(",T 'B000101'")).code(10).err,
        unreached,
    );
    let err = run("open.src", &(krl("") + &krl(""))).code(0).err;
    let open = "posture not stated: taken nearest to the target before";
    assert_eq!(err.matches(open).count(), 1, "{err}");
    has(&err, "open.src:1:");
}
