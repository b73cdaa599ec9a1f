//! What such data show is what theory says, counted at joints that close; the volume term is the derivative that it claims to be.

use super::{
    Length, calibrated, calibrated_knowing, fixture, free, known_place, plane, socket, sphere,
    touched, truth,
};
use calib::description::RobotDescription;
use calib::estimate::ParameterStatus;
use calib::observation::rank;
use calib::twin::touch::Fixture;

/// Geometry of an arm with its ball that a fit sees beside the numbers of the fixtures themselves.
fn seen(
    robot: &RobotDescription,
    fixtures: &[Fixture],
    lengths: &[Length],
    effects: &[&str],
) -> usize {
    let data = touched(robot, &truth(robot, 1), fixtures, 7).measurements();
    let (model, fitted) = calibrated(robot, &data, lengths, effects);
    let setup = model.robot.setup();
    let ours = setup.first_of_anchor(setup.anchors.len());
    if effects.is_empty() {
        let rows: Vec<usize> = (0..data.rows()).collect();
        assert_eq!(
            rank(&model.robot, &data, &rows, !lengths.is_empty(), 0),
            Some(free(&fitted))
        );
    }
    free(&fitted) - ours
}

fn arms() -> [RobotDescription; 2] {
    [fixture::offset_wrist(), fixture::seven()]
}

/// Within reach of both arms.
const A: [f64; 3] = [480.0, 120.0, 300.0];
const B: [f64; 3] = [480.0, 170.0, 310.0];
const C: [f64; 3] = [-200.0, 450.0, 420.0];

#[test]
fn sockets_show_all_but_the_base_and_the_scale_and_a_length_shows_that_too() {
    for robot in arms() {
        let n = robot.joints.len();
        let two = [
            socket("a", A, 40, 0.0),
            socket("b", B, 40, 0.0),
            socket("c", C, 40, 0.0),
        ];
        assert_eq!(
            seen(&robot, &two[..1], &[], &[]),
            4 * n - 4,
            "{}: one socket",
            robot.name
        );
        assert_eq!(
            seen(&robot, &two, &[], &[]),
            4 * n - 4,
            "{}: three sockets",
            robot.name
        );
        assert_eq!(
            seen(&robot, &two, &[Length("a", "b", 0.051, 1e-6)], &[]),
            4 * n - 3,
            "{}: a length",
            robot.name
        );
        assert_eq!(
            seen(&robot, &two, &[], &["reduction_ratio"]),
            5 * n - 4,
            "{}: ratios",
            robot.name
        );
    }
}

#[test]
fn planes_and_spheres_show_what_theory_says() {
    for robot in arms() {
        let n = robot.joints.len();
        let tilted = [
            plane("low", A, [0.3, -0.2, 1.0], 90, 0.0),
            plane("high", [480.0, 120.0, 380.0], [0.3, -0.2, 1.0], 90, 0.0),
        ];
        assert_eq!(
            seen(&robot, &tilted[..1], &[], &[]),
            4 * n - 4,
            "{}: a tilted plane",
            robot.name
        );
        let apart = Length("low", "high", 0.08 / 1.13f64.sqrt(), 1e-6);
        assert_eq!(
            seen(&robot, &tilted, &[apart], &[]),
            4 * n - 3,
            "{}: two planes a known distance apart",
            robot.name
        );
        let ball = sphere("ball", A, 40.0, 90, 0.0);
        assert_eq!(
            seen(&robot, &[ball], &[], &[]),
            4 * n - 4,
            "{}: a sphere",
            robot.name
        );
    }
}

#[test]
fn a_plane_square_to_the_first_axis_shows_two_less_and_a_known_diameter_one_more() {
    for robot in arms() {
        let n = robot.joints.len();
        let flat = plane("low", A, [0.0, 0.0, 1.0], 90, 0.0);
        assert_eq!(
            seen(&robot, &[flat], &[], &[]),
            4 * n - 6,
            "{}: a plane whose normal is along axis 1",
            robot.name
        );
        let data = touched(
            &robot,
            &truth(&robot, 1),
            &[sphere("ball", A, 40.0, 90, 0.0)],
            7,
        )
        .measurements();
        let known = [("anchor.ball.radius".to_string(), 0.04, 1e-6)];
        let (model, fitted) = calibrated_knowing(&robot, &data, &[], &[], &known);
        assert_eq!(
            free(&fitted) - model.robot.setup().first_of_anchor(1),
            4 * n - 3,
            "{}: a known diameter",
            robot.name
        );
    }
}

#[test]
fn known_points_show_place_then_scale_and_turns() {
    for robot in arms() {
        let n = robot.joints.len();
        let places = [("a", A), ("b", B), ("c", C)];
        let sockets = places.map(|(name, place)| socket(name, place, 40, 0.0));
        for (count, expected) in [(1, 4 * n - 1), (2, 4 * n + 2), (3, 4 * n + 3)] {
            let data = touched(&robot, &truth(&robot, 1), &sockets[..count], 7).measurements();
            let known: Vec<_> = places[..count]
                .iter()
                .flat_map(|(name, place)| known_place(name, *place))
                .collect();
            let (model, fitted) = calibrated_knowing(&robot, &data, &[], &[], &known);
            let found = free(&fitted) - model.robot.setup().first_of_anchor(count);
            assert_eq!(found, expected, "{}: {count} known", robot.name);
            let rows: Vec<usize> = (0..data.rows()).collect();
            assert_eq!(
                rank(&model.robot, &data, &rows, false, count),
                Some(free(&fitted)),
                "{}: {count} known",
                robot.name
            );
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
        let wind_up: Vec<&ParameterStatus> = model
            .stack
            .parameters_of("joint_compliance")
            .map(|k| &fitted.statuses[k])
            .collect();
        assert!(
            wind_up
                .iter()
                .all(|status| !matches!(status, ParameterStatus::Redundant(_))),
            "{}: {wind_up:?}",
            robot.name
        );
        // The first axis is vertical: nothing loads it. Masses near the axes of a wrist load these too little to be seen.
        assert!(
            matches!(wind_up[0], ParameterStatus::Unseen),
            "{}: {wind_up:?}",
            robot.name
        );
        let loaded = wind_up
            .iter()
            .filter(|status| matches!(status, ParameterStatus::Free(_)))
            .count();
        assert!(loaded >= 3, "{}: {wind_up:?}", robot.name);
        assert_eq!(
            free(&fitted) - model.robot.setup().first_of_anchor(2),
            4 * n - 4 + loaded,
            "{}",
            robot.name
        );
    }
}
