//! One counting: a controller that counts its joints otherwise than the robot file gets commands as it counts them. The same simulated robot
//! is recorded, identified and compensated under every convention; where it really goes is the same to a micrometre.

use super::ROBOT;
use super::maker::{IDENTIFY, Maker, PLAIN, makers, ran, recorded};
use super::sides::confdata;
use super::true_error::Cell;
use crate::answer::{fed, put};
use crate::fixture::robot_of;
use calib::compensate::{Nominal, ToolGoal, least_change, turns};
use calib::robot::RobotModel;
use calib::spatial::Pose;
use calib::twin::plan::Point;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::path::Path;

/// How far (mm) the true robot is with each command from where it was wanted, in the base as it was identified.
fn misses(cell: &Cell, base: &Pose, wanted: &[Point], commands: &[Vec<f64>]) -> Vec<f64> {
    let driven = wanted
        .iter()
        .zip(commands)
        .map(|(point, q)| Point {
            q: q.clone(),
            ..point.clone()
        })
        .collect();
    let robot = RobotModel::new(cell.robot.clone());
    let places = cell.places(driven);
    let goal = |point: &Point| base.point(&robot.forward(&point.q).translation);
    places
        .iter()
        .zip(wanted)
        .map(|(at, point)| (at - goal(point)).norm() * 1e3)
        .collect()
}

/// Recording, pipeline and targets in the counting of a maker; the true misses of every kind of output.
fn compensated(
    maker: &Maker,
    cell: &Cell,
    points: &[Point],
    targets: &[Point],
) -> Vec<(&'static str, Vec<f64>)> {
    let folder = recorded(maker, cell, points, ROBOT, IDENTIFY);
    let here = folder.path();
    let numbers = |q: &[f64]| {
        maker
            .counted(q)
            .iter()
            .map(|c| format!("{c:.9}"))
            .collect::<Vec<_>>()
            .join(",")
    };
    let header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg";
    let robot = RobotModel::new(cell.robot.clone());
    let lines: String = targets
        .iter()
        .map(|target| numbers(&target.q) + "\n")
        .collect();
    let table = ran(
        here,
        "compensate latest --plain",
        &format!("{header}\n{lines}"),
    );
    let said = said(here, &format!("{header}\n{lines}"));
    assert_eq!(
        said.contains("joints are counted as at the controller: "),
        maker.name != PLAIN.name,
        "{said}"
    );
    let poses: String = targets
        .iter()
        .map(|target| {
            let pose = robot.forward(&target.q);
            let turn = nalgebra::UnitQuaternion::from_matrix(&pose.rotation);
            let place: Vec<String> = pose
                .translation
                .iter()
                .map(|x| format!("{:.9}", x * 1e3))
                .collect();
            format!(
                "{},{},{:.12},{:.12},{:.12},{:.12}\n",
                numbers(&target.q),
                place.join(","),
                turn.w,
                turn.i,
                turn.j,
                turn.k
            )
        })
        .collect();
    let poses = ran(
        here,
        "compensate latest --plain --target pose",
        &format!("{header},x_mm,y_mm,z_mm,qw,qx,qy,qz\n{poses}"),
    );
    let six = |q: &[f64]| {
        maker
            .counted(q)
            .iter()
            .map(|c| format!("{c:.9}"))
            .collect::<Vec<_>>()
    };
    let krl: String = targets
        .iter()
        .map(|target| {
            let named = six(&target.q)
                .iter()
                .zip(1..)
                .map(|(c, j)| format!("A{j} {c}"))
                .collect::<Vec<_>>();
            format!("PTP {{{}}}\n", named.join(","))
        })
        .collect();
    put(here, "t.src", krl);
    let krl = ran(here, "compensate latest t.src", "");
    let rapid: String = targets
        .iter()
        .map(|target| {
            format!(
                "MoveAbsJ [[{}],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\n",
                six(&target.q).join(",")
            )
        })
        .collect();
    put(here, "t.mod", format!("MODULE m\n{rapid}ENDMODULE\n"));
    let rapid = ran(here, "compensate latest t.mod", "");

    let cartesian: Vec<(Vec<f64>, [f64; 3], nalgebra::UnitQuaternion<f64>)> = targets
        .iter()
        .map(|target| {
            let pose = robot.forward(&target.q);
            (
                maker.counted(&target.q),
                (pose.translation * 1e3).into(),
                nalgebra::UnitQuaternion::from_matrix(&pose.rotation),
            )
        })
        .collect();
    let krl_poses: String = cartesian
        .iter()
        .map(|(counted, [x, y, z], turn)| {
            let (c, b, a) = turn.euler_angles();
            let [a, b, c] = [a, b, c].map(|angle: f64| format!("{:.9}", angle.to_degrees()));
            let turn: u32 = (0..6)
                .filter(|joint| counted[*joint] < 0.0)
                .map(|joint| 1 << joint)
                .sum();
            format!("LIN {{X {x:.6},Y {y:.6},Z {z:.6},A {a},B {b},C {c},T {turn}}}\n")
        })
        .collect();
    put(here, "poses.src", krl_poses);
    let krl_poses = ran(here, "compensate latest poses.src", "");
    let rapid_poses: String = cartesian
        .iter()
        .map(|(counted, [x, y, z], turn)| {
            let q = format!("{:.10},{:.10},{:.10},{:.10}", turn.w, turn.i, turn.j, turn.k);
            let [one, four, six, cfx] = confdata(maker, &maker.driven(counted));
            format!("MoveL [[{x:.6},{y:.6},{z:.6}],[{q}],[{one},{four},{six},{cfx}],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\n")
        })
        .collect();
    put(
        here,
        "poses.mod",
        format!("MODULE m\n{rapid_poses}ENDMODULE\n"),
    );
    let rapid_poses = ran(here, "compensate latest poses.mod", "");

    let listed = |text: &str, start: &str, end: &str| -> Vec<Vec<f64>> {
        let number = |part: &str| part.trim().trim_start_matches('A').to_string();
        text.lines()
            .filter_map(|line| line.split_once(start))
            .filter_map(|(_, rest)| rest.split_once(end))
            .map(|(list, _)| {
                let parts = list
                    .split(',')
                    .map(|part| number(part.rsplit(' ').next().unwrap_or(part)));
                parts.map(|part| part.parse().unwrap()).collect()
            })
            .collect()
    };
    let rows = |text: &str| -> Vec<Vec<f64>> {
        text.lines()
            .skip(1)
            .map(|line| {
                line.split(',')
                    .take(6)
                    .map(|c| c.parse().unwrap())
                    .collect()
            })
            .collect()
    };
    let document: serde_json::Value =
        serde_json::from_str(&ran(here, "export latest --format json --quiet", "")).unwrap();
    let three = |name: &str| -> [f64; 3] {
        serde_json::from_value(document["base_in_tracker"][name].clone()).unwrap()
    };
    let turn = Rotation3::new(three("rotation_vector_rad").into()).into_inner();
    let base = Pose::new(turn, three("point_m").into());
    let before: Vec<Vec<f64>> = targets
        .iter()
        .map(|target| maker.counted(&target.q))
        .collect();
    let outputs = [
        ("uncorrected", before),
        ("table of joints", rows(&table)),
        ("table of poses", rows(&poses)),
        ("KRL", listed(&krl, "{", "}")),
        ("RAPID", listed(&rapid, "[[", "]")),
    ];
    let joints = outputs.map(|(output, commands)| {
        (
            output,
            commands
                .iter()
                .map(|numbers| maker.driven(numbers))
                .collect(),
        )
    });
    // A controller that believes in the robot file drives to a pose from where it is near.
    let driven = |poses: Vec<(Matrix3<f64>, [f64; 3])>| -> Vec<Vec<f64>> {
        let near = |((rotation, place), target): ((Matrix3<f64>, [f64; 3]), &Point)| {
            let goal = ToolGoal {
                pose: Pose::new(rotation, Vector3::from(place) * 1e-3),
                oriented: true,
            };
            let found = least_change(&mut Nominal::new(&robot), &goal, &target.q, &target.q);
            assert!(found.residual < 1e-6, "{}", found.residual);
            found.q
        };
        poses.into_iter().zip(targets).map(near).collect()
    };
    let of_krl = |numbers: Vec<f64>| {
        let [a, b, c] = [3, 4, 5].map(|k| numbers[k].to_radians());
        (turns(a, b, c), [numbers[0], numbers[1], numbers[2]])
    };
    let of_rapid = |numbers: Vec<f64>| {
        let turn = nalgebra::Quaternion::new(numbers[3], numbers[4], numbers[5], numbers[6]);
        let turn = nalgebra::UnitQuaternion::from_quaternion(turn)
            .to_rotation_matrix()
            .into_inner();
        (turn, [numbers[0], numbers[1], numbers[2]])
    };
    let poses = [
        (
            "KRL, poses",
            driven(
                listed(&krl_poses, "{", ",T")
                    .into_iter()
                    .map(of_krl)
                    .collect(),
            ),
        ),
        (
            "RAPID, poses",
            driven(
                listed(&rapid_poses.replace("],[", ","), "[[", ",9E9")
                    .into_iter()
                    .map(of_rapid)
                    .collect(),
            ),
        ),
    ];
    joints
        .into_iter()
        .chain(poses)
        .map(|(output, driven)| {
            assert_eq!(driven.len(), targets.len(), "{output}");
            (output, misses(cell, &base, targets, &driven))
        })
        .collect()
}

fn said(here: &Path, input: &str) -> String {
    fed(here, "compensate latest", input).err
}

#[test]
fn commands_are_counted_as_the_controller_counts() {
    let robot = robot_of(ROBOT);
    let cell = Cell::of(robot, 1.2, [100.0, 200.0], Vec::new());
    let points = cell.points(60, &[0.0], 5);
    let targets = cell.targets_by(20, &[0.0], 99);
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let plain = compensated(&PLAIN, &cell, &points, &targets);
    for (output, misses) in &plain {
        println!(
            "{}: {output}: {:.4} mm at most",
            PLAIN.name,
            largest(misses)
        );
        assert!(
            *output == "uncorrected" || largest(misses) < 0.1 * largest(&plain[0].1),
            "{output}: {}",
            largest(misses)
        );
    }
    for maker in makers() {
        for ((output, misses), (_, own)) in compensated(&maker, &cell, &points, &targets)
            .iter()
            .zip(&plain)
        {
            let apart = misses
                .iter()
                .zip(own)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            println!(
                "{}: {output}: {:.4} mm at most, {:.6} mm from the robot file's counting",
                maker.name,
                largest(misses),
                apart
            );
            assert!(apart < 1e-3, "{}: {output}: {apart} mm", maker.name);
        }
    }
}
