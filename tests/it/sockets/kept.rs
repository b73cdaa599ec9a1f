//! A model of sockets, planes and spheres is the same when it is read from its tables again.

use super::{dirty, fixture, plane, socket, sphere, touched, truth};
use crate::recorded::Recorded;
use calib::effect::Load;
use calib::robot::{Anchor, RobotModel};
use calib::stage::Identify;
use calib::table::{Parameters, Prediction};
use nalgebra::Vector3;

#[test]
fn planes_and_spheres_stand_where_they_were_identified() {
    let things = [
        socket("a/0", [480.0, 120.0, 300.0], 30, 60.0),
        socket("a/1", [480.0, 170.0, 300.0], 30, 60.0),
        plane("table", [100.0, -480.0, 320.0], [0.2, 0.1, 1.0], 40, 60.0),
        plane("wall", [450.0, -100.0, 420.0], [1.0, 0.1, 0.05], 40, 60.0),
        sphere("ball", [350.0, -350.0, 450.0], 40.0, 40, 60.0),
    ];
    let robot = fixture::seven();
    let recording = touched(&robot, &truth(&robot, 12), &things, 12);
    let stage: Identify = serde_saphyr::from_str(dirty::SETTINGS).unwrap();
    let data = recording.measurements();
    let made = Recorded::fitted(&robot, recording)
        .identify_by(&stage)
        .unwrap();
    let (parameters, prediction): (Parameters, Prediction) = (made.get(), made.get());
    let model = parameters
        .model(RobotModel::new(robot.clone()), &[], Load::GravityTorque)
        .unwrap();
    for (error, row) in model.row_errors(&data).iter().zip(&prediction.0) {
        let (read, stored) = (1e3 * error.length, row.error_mm);
        assert!(
            (read - stored).abs() < 1e-6,
            "{}: {read} and {stored}",
            row.point_id
        );
    }
    let rows = &parameters.0;
    let value = |name: &str| rows.iter().find(|row| row.name == name).unwrap().value;
    let radius = value("anchor.ball.radius");
    assert!((radius - 40.0).abs() < 0.3, "{radius}");
    // The base stands at nominal, up to what the tolerances of the first link leave.
    let normal = Anchor::normal([value("anchor.wall.rx"), value("anchor.wall.ry")]);
    assert!(
        (normal - Vector3::new(1.0, 0.1, 0.05).normalize()).norm() < 5e-3,
        "{normal}"
    );
}

#[test]
fn tilts_are_a_normal_and_move_it_as_they_say() {
    for normal in [
        [0.0, 0.0, 1.0],
        [1.0, 0.1, 0.05],
        [0.3, -0.8, 0.2],
        [1e-5, -2e-5, 1.0],
    ] {
        let normal = Vector3::from(normal).normalize();
        let tilts = Anchor::tilts(&normal);
        assert!((Anchor::normal(tilts) - normal).norm() < 1e-14);
        for (k, rate) in Anchor::across(&normal).iter().enumerate() {
            let moved = |step: f64| {
                let mut tilts = tilts;
                tilts[k] += step;
                Anchor::normal(tilts)
            };
            let central = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!(
                (central - rate).norm() < 1e-8,
                "{normal}, {k}: {central} by differences, {rate}"
            );
        }
    }
}
