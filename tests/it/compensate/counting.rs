//! One counting: a controller that counts its joints otherwise than the robot file gets commands as it counts them. The same simulated robot
//! is recorded, identified and compensated under every convention; where it really goes is the same to a micrometre.

use super::true_error::Cell;
use super::{ROBOT, calib};
use calib::robot::RobotModel;
use calib::robot::import::{RobotFileText, read_calib};
use calib::spatial::Pose;
use calib::twin::plan::Point;
use calib::units::Unit;
use nalgebra::Rotation3;
use std::path::Path;

/// How a controller counts, deg: c = sign * (q, couplings added) + zero.
struct Maker {
    name: &'static str,
    sign: [f64; 6],
    zero: [f64; 6],
    /// Joint, by, ratio; from 1.
    coupled: &'static [(usize, usize, f64)],
}

const PLAIN: Maker = Maker { name: "robot file", sign: [1.0; 6], zero: [0.0; 6], coupled: &[] };

fn makers() -> Vec<Maker> {
    let mut all: Vec<Maker> = (0..6)
        .map(|joint| {
            let mut sign = [1.0; 6];
            sign[joint] = -1.0;
            Maker { name: ["sign 1", "sign 2", "sign 3", "sign 4", "sign 5", "sign 6"][joint], sign, ..PLAIN }
        })
        .collect();
    let swivel = [-1.0, 1.0, 1.0, -1.0, 1.0, -1.0];
    all.push(Maker { name: "signs 1, 4, 6", sign: swivel, ..PLAIN });
    all.push(Maker { name: "zeros", zero: [0.0, -90.0, 90.0, 0.0, 12.5, 180.0], ..PLAIN });
    all.push(Maker { name: "coupled", coupled: &[(3, 2, -1.0), (6, 5, 0.5)], ..PLAIN });
    // As KUKA, ABB (a parallelogram) and FANUC (joint 3 against the horizon) count an upright arm.
    all.push(Maker { name: "KUKA", sign: swivel, zero: [0.0, -90.0, 90.0, 0.0, 0.0, 0.0], ..PLAIN });
    all.push(Maker { name: "ABB, parallelogram", coupled: &[(3, 2, 1.0)], ..PLAIN });
    all.push(Maker { name: "FANUC", sign: [1.0, 1.0, -1.0, -1.0, 1.0, -1.0], coupled: &[(3, 2, -1.0)], ..PLAIN });
    let zero = [10.0, -90.0, 90.0, 30.0, -45.0, 180.0];
    all.push(Maker { name: "all at once", sign: swivel, zero, coupled: &[(3, 2, -1.0), (6, 5, 0.5)] });
    all
}

impl Maker {
    fn counted(&self, q: &[f64]) -> Vec<f64> {
        let own: Vec<f64> = q.iter().map(|q| q.to_degrees()).collect();
        let held = |joint: usize| self.parts(joint).map(|(by, ratio)| ratio * own[by]).sum::<f64>();
        (0..6).map(|joint| self.sign[joint] * (own[joint] + held(joint)) + self.zero[joint]).collect()
    }

    /// What the controller's numbers (deg) make of the joints, rad: no joint that is in another one's number holds a third.
    fn driven(&self, numbers: &[f64]) -> Vec<f64> {
        let plain: Vec<f64> = (0..6).map(|joint| self.sign[joint] * (numbers[joint] - self.zero[joint])).collect();
        let held = |joint: usize| self.parts(joint).map(|(by, ratio)| ratio * plain[by]).sum::<f64>();
        (0..6).map(|joint| (plain[joint] - held(joint)).to_radians()).collect()
    }

    fn parts(&self, joint: usize) -> impl Iterator<Item = (usize, f64)> {
        self.coupled.iter().filter(move |(moved, ..)| *moved == joint + 1).map(|(_, by, ratio)| (by - 1, *ratio))
    }

    fn settings(&self) -> String {
        let coupled = self.coupled.iter().map(|(joint, by, ratio)| format!("{{joint: {joint}, by: {by}, ratio: {ratio}}}"));
        format!("sign: {:?}, zero: {:?}, coupled: [{}]", self.sign, self.zero, coupled.collect::<Vec<_>>().join(", "))
    }
}

/// How far (mm) the true robot is with each command from where it was wanted, in the base as it was identified.
fn misses(cell: &Cell, base: &Pose, wanted: &[Point], commands: &[Vec<f64>]) -> Vec<f64> {
    let driven = wanted.iter().zip(commands).map(|(point, q)| Point { q: q.clone(), ..point.clone() }).collect();
    let robot = RobotModel::new(cell.robot.clone());
    let places = cell.places(driven);
    let goal = |point: &Point| base.point(&robot.forward(&point.q).translation);
    places.iter().zip(wanted).map(|(at, point)| (at - goal(point)).norm() * 1e3).collect()
}

/// Recording, pipeline and targets in the counting of a maker; the true misses of every kind of output.
fn compensated(maker: &Maker, cell: &Cell, points: &[Point], targets: &[Point]) -> Vec<(&'static str, Vec<f64>)> {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    std::fs::write(here.join("robot.yaml"), ROBOT).expect("a file");
    let numbers = |q: &[f64]| maker.counted(q).iter().map(|c| format!("{c:.9}")).collect::<Vec<_>>().join(",");
    let header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg";
    let recorded = cell.recorded_by(points.to_vec(), 77).recording;
    let rows = points.iter().zip(&recorded.position).enumerate().map(|(k, (point, position))| {
        let [x, y, z] = position.map(|x| Unit::Millimetre.from_si(x));
        format!("P{k},{},{x:.6},{y:.6},{z:.6}\n", numbers(&point.q))
    });
    std::fs::write(here.join("log.csv"), format!("id,{header},x,y,z\n{}", rows.collect::<String>())).expect("a file");
    let q = format!("{{column: \"q{{j}}_deg\", unit: deg, {}}}", maker.settings());
    let pipeline = format!(
        "calib: 1\nname: counted\nseed: 3\nstages:\n  - uses: robot\n    with: {{file: robot.yaml}}\n  - uses: ingest\n    with:\n      files:\n        - file: log.csv\n          columns:\n            point_id: {{column: id}}\n            usage: {{value: fit}}\n            q: {q}\n            x: {{column: x, unit: mm}}\n            y: {{column: y, unit: mm}}\n            z: {{column: z, unit: mm}}\n      instrument: leica_at960\n  - uses: split\n    with: {{by: usage}}\n  - uses: identify\n    with: {{on: [fit]}}\n"
    );
    std::fs::write(here.join("pipeline.yaml"), pipeline).expect("a file");
    ran(here, &["run", "pipeline.yaml", "--quiet"], "");

    let robot = RobotModel::new(cell.robot.clone());
    let lines: String = targets.iter().map(|target| numbers(&target.q) + "\n").collect();
    let table = ran(here, &["compensate", "latest", "--plain"], &format!("{header}\n{lines}"));
    let said = said(here, &format!("{header}\n{lines}"));
    assert_eq!(said.contains("joints are counted as at the controller: "), maker.name != PLAIN.name, "{said}");
    let poses: String = targets
        .iter()
        .map(|target| {
            let pose = robot.forward(&target.q);
            let turn = nalgebra::UnitQuaternion::from_matrix(&pose.rotation);
            let place: Vec<String> = pose.translation.iter().map(|x| format!("{:.9}", x * 1e3)).collect();
            format!("{},{},{:.12},{:.12},{:.12},{:.12}\n", numbers(&target.q), place.join(","), turn.w, turn.i, turn.j, turn.k)
        })
        .collect();
    let poses = ran(
        here,
        &["compensate", "latest", "--plain", "--target", "pose"],
        &format!("{header},x_mm,y_mm,z_mm,qw,qx,qy,qz\n{poses}"),
    );
    let six = |q: &[f64]| maker.counted(q).iter().map(|c| format!("{c:.9}")).collect::<Vec<_>>();
    let krl: String = targets
        .iter()
        .map(|target| {
            let named = six(&target.q).iter().zip(1..).map(|(c, j)| format!("A{j} {c}")).collect::<Vec<_>>();
            format!("PTP {{{}}}\n", named.join(","))
        })
        .collect();
    std::fs::write(here.join("t.src"), krl).expect("a file");
    let krl = ran(here, &["compensate", "latest", "t.src"], "");
    let rapid: String = targets
        .iter()
        .map(|target| format!("MoveAbsJ [[{}],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\n", six(&target.q).join(",")))
        .collect();
    std::fs::write(here.join("t.mod"), format!("MODULE m\n{rapid}ENDMODULE\n")).expect("a file");
    let rapid = ran(here, &["compensate", "latest", "t.mod"], "");

    let listed = |text: &str, start: &str, end: &str| -> Vec<Vec<f64>> {
        let number = |part: &str| part.trim().trim_start_matches('A').to_string();
        text.lines()
            .filter_map(|line| line.split_once(start))
            .filter_map(|(_, rest)| rest.split_once(end))
            .map(|(list, _)| {
                let parts = list.split(',').map(|part| number(part.rsplit(' ').next().unwrap_or(part)));
                parts.map(|part| part.parse().expect("a number")).collect()
            })
            .collect()
    };
    let rows = |text: &str| -> Vec<Vec<f64>> {
        text.lines().skip(1).map(|line| line.split(',').take(6).map(|c| c.parse().expect("a number")).collect()).collect()
    };
    let document: serde_json::Value =
        serde_json::from_str(&ran(here, &["export", "latest", "--format", "json", "--quiet"], "")).expect("JSON");
    let three =
        |name: &str| -> [f64; 3] { serde_json::from_value(document["base_in_tracker"][name].clone()).expect("three numbers") };
    let turn = Rotation3::new(three("rotation_vector_rad").into()).into_inner();
    let base = Pose::new(turn, three("point_m").into());
    let before: Vec<Vec<f64>> = targets.iter().map(|target| maker.counted(&target.q)).collect();
    let outputs = [
        ("uncorrected", before),
        ("table of joints", rows(&table)),
        ("table of poses", rows(&poses)),
        ("KRL", listed(&krl, "{", "}")),
        ("RAPID", listed(&rapid, "[[", "]")),
    ];
    outputs
        .into_iter()
        .map(|(output, commands)| {
            assert_eq!(commands.len(), targets.len(), "{output}");
            let driven: Vec<Vec<f64>> = commands.iter().map(|numbers| maker.driven(numbers)).collect();
            (output, misses(cell, &base, targets, &driven))
        })
        .collect()
}

fn ran(here: &Path, arguments: &[&str], input: &str) -> String {
    let output = calib(here, arguments, input);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn said(here: &Path, input: &str) -> String {
    String::from_utf8(calib(here, &["compensate", "latest"], input).stderr).expect("UTF-8")
}

#[test]
fn commands_are_counted_as_the_controller_counts() {
    let robot = read_calib(RobotFileText { label: "robot.yaml", text: ROBOT }, None).expect("a robot").robot;
    let cell = Cell::of(robot, 1.2, [100.0, 200.0], Vec::new());
    let points = cell.points(60, &[0.0], 5);
    let targets = cell.targets_by(20, &[0.0], 99);
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let plain = compensated(&PLAIN, &cell, &points, &targets);
    for (output, misses) in &plain {
        println!("{}: {output}: {:.4} mm at most", PLAIN.name, largest(misses));
        assert!(*output == "uncorrected" || largest(misses) < 0.1 * largest(&plain[0].1), "{output}: {}", largest(misses));
    }
    for maker in makers() {
        for ((output, misses), (_, own)) in compensated(&maker, &cell, &points, &targets).iter().zip(&plain) {
            let apart = misses.iter().zip(own).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
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
