//! What such data show is what theory says, counted at joints that close; the volume term is the derivative that it claims to be.

use super::{
    Length, calibrated, calibrated_knowing, directions, fixture, known_place, plane, socket,
    sphere, touched, truth,
};
use crate::fixture::all_rows;
use calib::description::RobotDescription;
use calib::estimate::Determined;
use calib::observation::rank;
use calib::twin::touch::Fixture;

/// Geometry of an arm with its ball that a fit sees beside the numbers of the fixtures themselves.
fn seen(
    robot: &RobotDescription,
    fixtures: &[Fixture],
    lengths: &[Length],
    effects: &[&str],
) -> usize {
    seen_knowing(robot, fixtures, lengths, effects, &[])
}

/// The same with numbers of the fixtures that are known beforehand.
fn seen_knowing(
    robot: &RobotDescription,
    fixtures: &[Fixture],
    lengths: &[Length],
    effects: &[&str],
    known: &[(String, f64, f64)],
) -> usize {
    let data = touched(robot, &truth(robot, 1), fixtures, 7).measurements();
    let (model, _) = calibrated_knowing(robot, &data, lengths, effects, known);
    let (setup, free) = (model.robot.setup(), directions(&model, &data));
    // Theory knows places of sockets, three numbers each, and no diameters.
    if effects.is_empty() && known.len().is_multiple_of(3) {
        let (rows, scaled) = (all_rows(&data), !lengths.is_empty());
        let expected = rank(&model.robot, &data, &rows, scaled, known.len() / 3);
        assert_eq!(expected, Some(free), "{}", robot.name);
    }
    free - setup.first_of_anchor(setup.anchors.len())
}

fn arms() -> [RobotDescription; 2] {
    [fixture::offset_wrist(), fixture::seven()]
}

/// Within reach of both arms.
const A: [f64; 3] = [480.0, 120.0, 300.0];
const B: [f64; 3] = [480.0, 170.0, 310.0];
const C: [f64; 3] = [-200.0, 450.0, 420.0];

#[test]
fn sockets_planes_and_spheres_show_what_theory_says() {
    for robot in arms() {
        let n = robot.joints.len();
        let three = [("a", A), ("b", B), ("c", C)].map(|(name, at)| socket(name, at, 40, 0.0));
        let tilted = [
            plane("low", A, [0.3, -0.2, 1.0], 90, 0.0),
            plane("high", [480.0, 120.0, 380.0], [0.3, -0.2, 1.0], 90, 0.0),
        ];
        let flat = [plane("low", A, [0.0, 0.0, 1.0], 90, 0.0)];
        let ball = [sphere("ball", A, 40.0, 90, 0.0)];
        let length = [Length("a", "b", 0.051, 1e-6)];
        let apart = [Length("low", "high", 0.08 / 1.13f64.sqrt(), 1e-6)];
        let ratios = &["reduction_ratio"][..];
        // All but the base and the scale; a length shows that too, and a plane square to the first axis two less.
        type Case<'a> = (
            &'a str,
            &'a [Fixture],
            &'a [Length<'a>],
            &'a [&'a str],
            usize,
        );
        let cases: [Case; 8] = [
            ("one socket", &three[..1], &[], &[], 4 * n - 4),
            ("three sockets", &three, &[], &[], 4 * n - 4),
            ("a length", &three, &length, &[], 4 * n - 3),
            ("ratios", &three, &[], ratios, 5 * n - 4),
            ("a tilted plane", &tilted[..1], &[], &[], 4 * n - 4),
            (
                "two planes a known distance apart",
                &tilted,
                &apart,
                &[],
                4 * n - 3,
            ),
            ("a sphere", &ball, &[], &[], 4 * n - 4),
            (
                "a plane whose normal is along axis 1",
                &flat,
                &[],
                &[],
                4 * n - 6,
            ),
        ];
        for (what, fixtures, lengths, effects, expected) in cases {
            let found = seen(&robot, fixtures, lengths, effects);
            assert_eq!(found, expected, "{}: {what}", robot.name);
        }
        let known = [("anchor.ball.radius".to_string(), 0.04, 1e-6)];
        let found = seen_knowing(&robot, &ball, &[], &[], &known);
        assert_eq!(found, 4 * n - 3, "{}: a known diameter", robot.name);
    }
}

#[test]
fn known_points_show_place_then_scale_and_turns() {
    for robot in arms() {
        let n = robot.joints.len();
        let places = [("a", A), ("b", B), ("c", C)];
        let sockets = places.map(|(name, place)| socket(name, place, 40, 0.0));
        for (count, expected) in [(1, 4 * n - 1), (2, 4 * n + 2), (3, 4 * n + 3)] {
            let known = places[..count].iter();
            let known: Vec<_> = known
                .flat_map(|(name, at)| known_place(name, *at))
                .collect();
            let found = seen_knowing(&robot, &sockets[..count], &[], &[], &known);
            assert_eq!(found, expected, "{}: {count} known", robot.name);
        }
    }
}

#[test]
fn wind_up_adds_one_for_each_joint_that_gravity_loads() {
    for robot in arms() {
        let n = robot.joints.len();
        let fixtures = [socket("a", A, 60, 0.0), socket("c", C, 60, 0.0)];
        let data = touched(&robot, &truth(&robot, 1), &fixtures, 7).measurements();
        let (model, fitted) = calibrated(&robot, &data, &[], &["joint_compliance"]);
        let wind_up: Vec<Determined> = model
            .stack
            .parameters_of("joint_compliance")
            .filter_map(|k| fitted.determined(&model, k))
            .collect();
        assert_eq!(wind_up.len(), n, "{}: {wind_up:?}", robot.name);
        // The first axis is vertical: nothing loads it. Masses near the axes of a wrist load these too little to be seen.
        assert_eq!(wind_up[0], Determined::ByTolerance, "{}", robot.name);
        let is_seen = |known: &&Determined| **known == Determined::Determined;
        let loaded = wind_up.iter().filter(is_seen).count();
        assert!(loaded >= 3, "{}: {wind_up:?}", robot.name);
    }
}
