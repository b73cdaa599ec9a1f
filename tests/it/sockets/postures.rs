//! `calib poses --sockets`: postures in which the ball lies in the sockets, and what they tell.

use super::fixture;
use super::mukca::panda;
use calib::estimate::choose::{ContactRequest, PriorSigma, Site, propose_contacts};
use calib::poses::places;
use calib::robot::RobotModel;
use nalgebra::Vector3;

fn site(robot: &calib::description::RobotDescription) -> Site {
    Site {
        ranges: robot
            .joints
            .iter()
            .map(|joint| joint.limits.unwrap())
            .collect(),
        bounds: [[f64::NEG_INFINITY, f64::INFINITY]; 3],
        floor: 0.0,
        payloads: vec![0.0],
    }
}

fn request(places: &[[f64; 3]]) -> ContactRequest {
    ContactRequest {
        places: places.iter().map(|place| Vector3::from(*place)).collect(),
        count: 40,
        candidates: 80,
        sigma: 1e-4,
        priors: vec![PriorSigma {
            begins: "link_geometry.",
            turns: 1e-3,
            others: 3e-4,
        }],
        seed: 3,
    }
}

#[test]
fn the_ball_lies_in_a_socket_at_every_posture_and_limits_hold() {
    let robot = panda();
    let (ours, sockets) = (
        RobotModel::new(robot.clone()),
        [[0.4, 0.1, 0.05], [0.4, 0.15, 0.05]],
    );
    let found = propose_contacts(&ours, &site(&robot), &request(&sockets)).unwrap();
    assert_eq!(found.poses.rows(), 40);
    for (row, socket) in found.socket.iter().enumerate() {
        let q = found.poses.q(row);
        assert!((ours.forward(q).translation - Vector3::from(sockets[*socket])).norm() < 1e-8);
        assert!(q.iter().zip(&robot.joints).all(|(q, joint)| {
            joint
                .limits
                .is_some_and(|[low, high]| *q >= low && *q <= high)
        }));
    }
    assert!(
        found
            .without
            .iter()
            .all(|ours| ours.count > 0 && ours.growth >= 1.0),
        "{:?}",
        found.without
    );
    // D-optimal beside the priors: no worse than what chance gives.
    let gain: f64 = found
        .sigma
        .iter()
        .map(|(_, _, ours, random)| (random / ours).ln())
        .sum();
    assert!(gain > 0.0, "{gain}");
    let again = propose_contacts(&ours, &site(&robot), &request(&sockets)).unwrap();
    assert_eq!(again.poses.q, found.poses.q);
}

#[test]
fn a_ball_on_the_last_axis_hides_two_directions_that_one_beside_it_shows() {
    let robot = panda();
    let found = propose_contacts(
        &RobotModel::new(robot.clone()),
        &site(&robot),
        &request(&[[0.4, 0.1, 0.05]]),
    )
    .unwrap();
    let (on_axis, nearby) = (found.offsets[0], found.offsets[found.offsets.len() - 1]);
    assert!(on_axis.off < 1e-9);
    assert_eq!(on_axis.directions, 4 * 7 - 4);
    assert!(
        on_axis.known <= 22 && !on_axis.weakest.is_finite(),
        "{on_axis:?}"
    );
    assert!(
        nearby.known > on_axis.known && nearby.weakest.is_finite(),
        "{nearby:?}"
    );
}

#[test]
fn sockets_out_of_reach_and_other_texts_are_refused() {
    let robot = fixture::seven();
    let far = propose_contacts(
        &RobotModel::new(robot.clone()),
        &site(&robot),
        &request(&[[3.0, 0.0, 0.5]]),
    );
    assert!(far.err().is_some_and(|text| text.contains("out of reach")));
    assert_eq!(
        places("[[0.4, 0.1, 0.0], [0.4,0.15,0.0]]").unwrap(),
        [[0.4, 0.1, 0.0], [0.4, 0.15, 0.0]]
    );
    for (text, expected) in [
        ("[]", "expected sockets"),
        ("[0.4, 0.1]", "expected sockets"),
        ("[[400, 100, 0]]", "are in m"),
    ] {
        assert!(
            places(text).expect_err("refused").contains(expected),
            "{text}"
        );
    }
}
