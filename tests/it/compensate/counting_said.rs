//! What is not a command says in which counting its joints stand: proposed poses, comparisons of runs, the report.

use super::ROBOT;
use super::maker::{Maker, PLAIN, makers, ran, recorded};
use super::true_error::Cell;
use crate::answer::{calib, read, starts_with};
use crate::fixture::{apart, robot_of};
use calib::poses::{Drive, write};
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::twin::effect::{JointCompliance, Physical};
use std::path::Path;

fn robot() -> RobotModel {
    RobotModel::new(robot_of(ROBOT))
}

fn all_at_once() -> Maker {
    makers().pop().unwrap()
}

/// Rows of a file of poses: joints (deg), sides, point (mm).
fn poses(file: &Path) -> Vec<[Vec<f64>; 3]> {
    let text = read(file);
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        [
            cells[1..7].to_vec(),
            cells[8..14].to_vec(),
            cells[14..17].to_vec(),
        ]
    };
    text.lines().skip(1).map(row).collect()
}

fn within_limits(robot: &RobotModel, q: &[f64]) {
    for (joint, q) in robot.description().joints.iter().zip(q) {
        let [low, high] = joint.limits.unwrap();
        assert!(
            (low - 1e-12..=high + 1e-12).contains(q),
            "{}: {q} in {low} to {high}",
            joint.name
        );
    }
}

#[test]
fn poses_in_the_controllers_counting_keep_the_joints_within_their_limits() {
    let (robot, maker) = (robot(), all_at_once());
    let convention = maker.convention();
    let ranges: Vec<[f64; 2]> = robot
        .description()
        .joints
        .iter()
        .map(|joint| joint.limits.unwrap())
        .collect();
    // Corners of the travel, where rounding can leave it, and poses within.
    let pose = |k: usize| -> Vec<f64> {
        let at = |(joint, [low, high]): (usize, &[f64; 2])| match k {
            0..64 => [*low, *high][(k >> joint) & 1],
            _ => low + (high - low) * (0.5 + 0.5 * (1.3 * k as f64 + 0.7 * joint as f64).sin()),
        };
        ranges.iter().enumerate().map(at).collect()
    };
    let q: Vec<Vec<f64>> = (0..200).map(pose).collect();
    let direction: Vec<f64> = (0..1200)
        .map(|k| if k % 5 < 2 { -1.0 } else { 1.0 })
        .collect();
    let data = Measurements {
        joints: 6,
        q: q.concat(),
        points: PointReadings::new(
            q.iter().map(|q| robot.forward(q).translation).collect(),
            0.0,
        ),
        payload: vec![0.0; 200],
        ..Measurements::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("poses.csv");
    let drive = Drive {
        robot: robot.description().clone(),
        ranges,
        poses: data,
        direction: direction.clone(),
        convention,
    };
    write(&file, &drive).unwrap();
    for (k, [numbers, sides, _]) in poses(&file).iter().enumerate() {
        let driven = maker.driven(numbers);
        within_limits(&robot, &driven);
        for joint in 0..6 {
            // A coupled joint is rounded again where the other joint's rounding moves it.
            let apart = (driven[joint] - q[k][joint]).abs().to_degrees();
            assert!(apart < 4e-4, "pose {k}, joint {}: {apart} deg", joint + 1);
            assert_eq!(sides[joint], direction[6 * k + joint] * maker.sign[joint]);
        }
    }
}

#[test]
fn poses_comparisons_and_report_of_a_run_say_in_which_counting_joints_stand() {
    let robot = robot();
    let compliance = Physical::JointCompliance(JointCompliance {
        joint: 2,
        rad_per_nm: 4e-6,
    });
    let description = robot.description().clone();
    let cell = Cell::of(description, 1.2, [100.0, 200.0], vec![compliance]);
    let points = cell.points(80, &[0.0, 30.0], 5);
    let stages = "  - uses: diagnose\n  - uses: validate\n  - uses: report\n";
    for maker in [PLAIN, all_at_once()] {
        let folder = recorded(&maker, &cell, &points, ROBOT, stages);
        let here = folder.path();
        let difference = "sign [-1, 1, 1, -1, 1, -1], zero [10, -90, 90, 30, -45, 180] deg, joint 3 with -1 times joint 2, joint 6 with 0.5 times joint 5";
        let otherwise = maker.name != PLAIN.name;

        let separate = "poses --run HEAD --separate 1 'link_compliance@link 2'";
        let few = "--count 12 --candidates 100 --out poses.csv";
        let text = ran(here, &format!("{separate} {few}"), "");
        let sentence = "joints and directions of the poses are counted as at the controller: ";
        let sentence = format!("{sentence}{difference}\n");
        for part in [&*sentence, "counted as"] {
            assert_eq!(text.contains(part), otherwise, "{text}");
        }
        let document = calib(here, &format!("{separate} {few} --json")).json();
        let counting = match otherwise {
            true => format!("controller: {difference}"),
            false => "robot file".into(),
        };
        assert_eq!(document["counting"], counting.as_str());
        let rows = poses(&here.join("poses.csv"));
        assert_eq!(rows.len(), 12);
        for ([numbers, _, point], object) in rows.iter().zip(document["poses"].as_array().unwrap())
        {
            assert_eq!(object["q3_deg"].as_f64(), Some(numbers[2]));
            let driven = maker.driven(numbers);
            within_limits(&robot, &driven);
            let reached = robot.forward(&driven).translation * 1e3;
            let apart = apart(reached.as_slice(), point);
            assert!(
                apart < 0.02,
                "{}: {numbers:?} reaches {reached:?}",
                maker.name
            );
        }

        let printed = format!(
            "joints stand in the robot file's counting; both controllers count otherwise ({difference})"
        );
        for one in ["HEAD", "HEAD/ingest/recording"] {
            let text = ran(here, &format!("diff {one} {one}"), "");
            let lines = text.lines().filter(|line| **line == printed);
            assert_eq!(lines.count(), usize::from(otherwise), "{text}");
            assert_eq!(text.contains("counting"), otherwise, "{text}");
            let document = calib(here, &format!("diff {one} {one} --json")).json();
            let counting = document["counting"].as_str();
            assert_eq!(counting, otherwise.then_some(printed.as_str()));
        }
        // Joints are stated where they are.
        let parameters = "diff HEAD/diagnose/parameters HEAD/diagnose/parameters";
        assert!(!calib(here, parameters).out.contains("counting"));

        let page = read(here.join(".calib/documents/counted/report.html"));
        let sentence = "Zeros, ratios and couplings of joints stand in the robot file&#x27;s counting; the controller counts otherwise";
        assert_eq!(page.matches(sentence).count(), usize::from(otherwise));
        let report = read(here.join(".calib/documents/counted/report.json"));
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        let counting = report["parameters_counting"].as_str().unwrap();
        starts_with(counting, "robot file");
        assert_eq!(counting.contains(difference), otherwise, "{counting}");
    }
}
