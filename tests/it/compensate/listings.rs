//! Programs of FANUC and Universal Robots, compensated: where the true robot goes, in two postures and three countings.

use super::maker::{Maker, PLAIN, makers_of};
use super::round_trip::{Trip, pose, read};
use crate::fixture::apart;
use calib::compensate::ArmSides;
use calib::program::{Language, TargetKind};
use calib::spatial::Pose;
use nalgebra::{Rotation3, Vector3};

/// deg: the wrist above and below.
const POSES: [[f64; 6]; 6] = [
    [20.0, 15.0, -20.0, 25.0, 40.0, 30.0],
    [20.0, 15.0, -20.0, 25.0, -40.0, 30.0],
    [-35.0, -10.0, 30.0, -50.0, 60.0, -20.0],
    [-35.0, -10.0, 30.0, -50.0, -60.0, -20.0],
    [50.0, 30.0, 10.0, 100.0, -25.0, 150.0],
    [5.0, 40.0, -50.0, -120.0, 70.0, -100.0],
];

fn three() -> Vec<Maker> {
    makers_of(&[PLAIN.name, "FANUC", "all at once"])
}

fn wanted() -> Vec<Vec<f64>> {
    POSES
        .iter()
        .map(|q| q.iter().map(|deg| deg.to_radians()).collect())
        .collect()
}

/// Poses and joints lead to one place, as far as the model is right.
fn near(poses: &[f64], joints: &[f64], what: &str) {
    assert!(
        apart(poses, joints) < 1e-3 && joints.iter().all(|mm| *mm < 0.01),
        "{what}: {poses:?} and {joints:?} mm"
    );
}

#[test]
fn a_listing_of_fanuc_leads_the_true_robot_to_its_targets() {
    let trip = Trip::new();
    let wanted = wanted();
    for maker in three() {
        let sides = ArmSides::of(&trip.robot, &maker.convention()).unwrap();
        let mut text = String::from("/PROG  WELD\n/ATTR\nDEFAULT_GROUP\t= 1,*,*,*,*;\n/MN\n");
        for k in 1..=2 * POSES.len() {
            text.push_str(&format!(
                "{k:4}:{} P[{k}] 100mm/sec FINE    ;\n",
                if k > POSES.len() { "J" } else { "L" }
            ));
        }
        text.push_str("/POS\n");
        for (k, q) in wanted.iter().enumerate() {
            let (pose, c, share) = (
                trip.robot.forward(q),
                maker.counted(q),
                sides.at(&trip.robot, q),
            );
            assert!(share[0] > 0.0, "before the base");
            let (wrist, elbow) = (
                if q[4] > 0.0 { 'F' } else { 'N' },
                if share[1] > 0.0 { 'U' } else { 'D' },
            );
            let turns = [0, 3, 5]
                .map(|joint| format!("{}", (c[joint] / 360.0).round()))
                .join(", ");
            let at = pose.translation * 1e3;
            let (w, p, r) = Rotation3::from_matrix_unchecked(pose.rotation).euler_angles();
            let [w, p, r] = [w, p, r].map(f64::to_degrees);
            text.push_str(&format!(
                "P[{}]{{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : '{wrist} {elbow} T, {turns}',\n\tX = {:9.6}  mm,\tY = {:9.6}  mm,\tZ = {:9.6}  mm,\n\
                 \tW = {w:9.7} deg,\tP = {p:9.7} deg,\tR = {r:9.7} deg\n}};\n",
                k + 1,
                at.x,
                at.y,
                at.z
            ));
        }
        for (k, q) in wanted.iter().enumerate() {
            let joints: Vec<String> = maker
                .counted(q)
                .iter()
                .zip(1..)
                .map(|(c, j)| format!("\tJ{j}= {c:9.7} deg"))
                .collect();
            text.push_str(&format!(
                "P[{}]{{\n   GP1:\n\tUF : 0, UT : 1,\t\n{}\n}};\n",
                k + 1 + POSES.len(),
                joints.join(",\n")
            ));
        }
        text.push_str("/END\n");
        let corrected = trip
            .compensated(&maker, Language::Fanuc, &text)
            .unwrap_or_else(|message| panic!("{message}\n{text}"));
        let literals = read(Language::Fanuc, &corrected.bytes);
        let (poses, joints) = literals.split_at(POSES.len());
        assert!(
            joints
                .iter()
                .all(|literal| literal.kind == TargetKind::Joints)
        );
        let driven: Vec<Vec<f64>> = poses
            .iter()
            .zip(&wanted)
            .map(|(literal, q)| trip.driven(pose(literal), q))
            .collect();
        let of_poses = trip.misses(&wanted, &driven);
        let driven: Vec<Vec<f64>> = joints
            .iter()
            .map(|literal| maker.driven(&literal.values))
            .collect();
        near(&of_poses, &trip.misses(&wanted, &driven), maker.name);
        assert!(
            trip.misses(&wanted, &wanted).iter().all(|mm| *mm > 0.1),
            "nothing was to be corrected"
        );
    }
}

#[test]
fn a_script_of_universal_robots_leads_the_true_robot_to_its_targets() {
    let trip = Trip::new();
    let wanted = wanted();
    for maker in three() {
        let mut text = String::from("def weld():\n  set_tcp(p[0.04, 0.03, 0.13, 0, 0, 0])\n");
        let list = |numbers: &[f64]| {
            numbers
                .iter()
                .map(|number| format!("{number:.9}"))
                .collect::<Vec<_>>()
                .join(", ")
        };
        for (k, q) in wanted.iter().enumerate() {
            let pose = trip.robot.forward(q);
            let numbers = [
                pose.translation.as_slice(),
                pose.rotation_vector().as_slice(),
            ]
            .concat();
            let joints: Vec<f64> = maker.counted(q).iter().map(|c| c.to_radians()).collect();
            text.push_str(&format!(
                "  global wp{k}_p = p[{}]\n  global wp{k}_q = [{}]\n",
                list(&numbers),
                list(&joints)
            ));
            text.push_str(&format!(
                "  movej(get_inverse_kin(wp{k}_p, qnear=wp{k}_q), a=1.4, v=1.05)\n"
            ));
            text.push_str(&format!("  movej([{}], a=1.4, v=1.05)\n", list(&joints)));
        }
        text.push_str("end\n");
        let corrected = trip
            .compensated(&maker, Language::UrScript, &text)
            .unwrap_or_else(|message| panic!("{message}\n{text}"));
        let literals = read(Language::UrScript, &corrected.bytes);
        let of_kind =
            |kind: TargetKind| literals.iter().filter(move |literal| literal.kind == kind);
        let pose = |v: &[f64]| {
            Pose::from_rotation_vector(
                Vector3::new(v[3], v[4], v[5]),
                Vector3::new(v[0], v[1], v[2]),
            )
        };
        let driven = of_kind(TargetKind::RotationVector)
            .zip(&wanted)
            .map(|(literal, q)| trip.driven(pose(&literal.values), q));
        let of_poses = trip.misses(&wanted, &driven.collect::<Vec<_>>());
        let degrees = |literal: &calib::program::Literal| -> Vec<f64> {
            literal.values.iter().map(|q| q.to_degrees()).collect()
        };
        let driven: Vec<Vec<f64>> = of_kind(TargetKind::Radians)
            .map(|literal| maker.driven(&degrees(literal)))
            .collect();
        near(&of_poses, &trip.misses(&wanted, &driven), maker.name);
        // Joints near which a pose is reached are no targets.
        let near_line = |text: &str| {
            text.lines()
                .filter(|line| line.contains("_q = ["))
                .map(String::from)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            near_line(&String::from_utf8_lossy(&corrected.bytes)),
            near_line(&text)
        );
    }
}
