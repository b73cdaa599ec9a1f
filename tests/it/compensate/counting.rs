//! One counting: a controller that counts its joints otherwise than the robot file gets commands as it counts them. The same simulated robot
//! is recorded, identified and compensated under every convention; where it really goes is the same to a micrometre.

use super::ROBOT;
use super::maker::{IDENTIFY, Maker, PLAIN, makers, ran, recorded};
use super::round_trip::{driven, pose, read};
use super::sides::{confdata, krl, rapid, turn};
use super::true_error::Cell;
use crate::answer::{fed, put};
use crate::fixture::{apart, largest, robot_of};
use calib::program::{Language, Literal};
use calib::robot::RobotModel;
use calib::spatial::Pose;
use calib::twin::plan::Point;
use nalgebra::{Rotation3, UnitQuaternion};

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
    let robot = RobotModel::new(cell.robot.clone());
    let each =
        |value_of: &dyn Fn(&Point) -> String| targets.iter().map(value_of).collect::<String>();
    let counted = |target: &Point| -> Vec<String> {
        let numbers = maker.counted(&target.q).into_iter();
        numbers.map(|number| format!("{number:.9}")).collect()
    };
    let list = |target: &Point| counted(target).join(",");
    let header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg";
    let input = format!("{header}\n{}", each(&|target| list(target) + "\n"));
    let table = ran(here, "compensate latest --plain", &input);
    let printed = fed(here, "compensate latest", &input).err;
    assert_eq!(
        printed.contains("joints are counted as at the controller: "),
        maker.name != PLAIN.name,
        "{printed}"
    );
    let posed = each(&|target| {
        let pose = robot.forward(&target.q);
        let turn = UnitQuaternion::from_matrix(&pose.rotation);
        let [x, y, z]: [f64; 3] = (pose.translation * 1e3).into();
        let (w, i, j, k) = (turn.w, turn.i, turn.j, turn.k);
        let joints = list(target);
        format!("{joints},{x:.9},{y:.9},{z:.9},{w:.12},{i:.12},{j:.12},{k:.12}\n")
    });
    let poses = ran(
        here,
        "compensate latest --plain --target pose",
        &format!("{header},x_mm,y_mm,z_mm,qw,qx,qy,qz\n{posed}"),
    );
    let rows = |text: &str| -> Vec<Vec<f64>> {
        let six = |line: &str| {
            line.split(',')
                .take(6)
                .map(|c| c.parse().unwrap())
                .collect()
        };
        text.lines().skip(1).map(six).collect()
    };
    let program = |name: &str, language: Language, text: String| -> Vec<Literal> {
        put(here, name, text);
        let written = ran(here, &format!("compensate latest {name}"), "");
        read(language, written.as_bytes())
    };
    let module = |text: String| format!("MODULE m\n{text}ENDMODULE\n");
    let by_joints = [
        (
            "KRL",
            "t.src",
            Language::Krl,
            each(&|target| maker.ptp(&target.q)),
        ),
        (
            "RAPID",
            "t.mod",
            Language::Rapid,
            module(each(&|target| {
                format!(
                    "MoveAbsJ [[{}],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\n",
                    list(target)
                )
            })),
        ),
    ];
    let by_joints = by_joints.map(|(output, name, language, text)| {
        let targets = program(name, language, text).into_iter();
        (output, targets.map(|target| target.values).collect())
    });
    let before = targets
        .iter()
        .map(|target| maker.counted(&target.q))
        .collect();
    let joints = [
        ("uncorrected", before),
        ("table of joints", rows(&table)),
        ("table of poses", rows(&poses)),
    ];
    let joints = joints
        .into_iter()
        .chain(by_joints)
        .map(|(output, commands)| {
            let driven: Vec<Vec<f64>> = commands
                .iter()
                .map(|numbers| maker.driven(numbers))
                .collect();
            (output, driven)
        });
    // A controller that believes in the robot file drives to a pose from where it is near.
    let by_poses = [
        (
            "KRL, poses",
            "poses.src",
            Language::Krl,
            each(&|target| {
                krl(
                    &robot.forward(&target.q),
                    &format!(",T {}", turn(maker, &target.q)),
                )
            }),
        ),
        (
            "RAPID, poses",
            "poses.mod",
            Language::Rapid,
            module(each(&|target| {
                rapid(&robot.forward(&target.q), confdata(maker, &target.q))
            })),
        ),
    ];
    let by_poses = by_poses.map(|(output, name, language, text)| {
        let written = program(name, language, text);
        let near = written.iter().zip(targets);
        (
            output,
            near.map(|(one, target)| driven(&robot, pose(one), &target.q))
                .collect(),
        )
    });
    let document: serde_json::Value =
        serde_json::from_str(&ran(here, "export latest --format json --quiet", "")).unwrap();
    let three = |name: &str| -> [f64; 3] {
        serde_json::from_value(document["base_in_tracker"][name].clone()).unwrap()
    };
    let turn = Rotation3::new(three("rotation_vector_rad").into()).into_inner();
    let base = Pose::new(turn, three("point_m").into());
    let judged = joints.chain(by_poses).map(|(output, driven)| {
        assert_eq!(driven.len(), targets.len(), "{output}");
        (output, misses(cell, &base, targets, &driven))
    });
    judged.collect()
}

#[test]
fn commands_are_counted_as_the_controller_counts() {
    let robot = robot_of(ROBOT);
    let cell = Cell::of(robot, 1.2, [100.0, 200.0], Vec::new());
    let points = cell.points(60, &[0.0], 5);
    let targets = cell.targets_by(20, &[0.0], 99);
    let plain = compensated(&PLAIN, &cell, &points, &targets);
    let most: Vec<f64> = plain
        .iter()
        .map(|(_, miss)| largest(miss.clone()))
        .collect();
    let corrected = plain.iter().zip(&most).skip(1);
    for ((output, _), mm) in corrected {
        assert!(*mm < 0.1 * most[0], "{output}: {mm} of {} mm", most[0]);
    }
    for maker in makers() {
        for ((output, misses), (_, ours)) in compensated(&maker, &cell, &points, &targets)
            .iter()
            .zip(&plain)
        {
            let apart = apart(misses, ours);
            println!(
                "{}: {output}: {apart:.6} mm from the robot file's counting",
                maker.name
            );
            assert!(apart < 1e-3, "{}: {output}: {apart} mm", maker.name);
        }
    }
}
