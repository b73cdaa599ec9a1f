//! Sockets beside points of a tracker in one estimation: the tracker tells scale and place, the sockets add to the arm.

use super::{calibrated, directions, fixture, socket, touched, true_points, truth};
use crate::identify::normal;
use calib::estimate::scale;
use calib::observation::{only_contacts, rank};
use calib::robot::{Measurements, Named, PointReadings, Readings};
use nalgebra::Vector3;

/// The tracker's noise, m.
const SIGMA: f64 = 2e-5;

/// Rows with points of a tracker in front of those of sockets.
fn joined(points: Measurements, sockets: &Measurements) -> Measurements {
    let (rows, more) = (points.rows(), sockets.rows());
    let ours = &sockets.readings[0];
    let names: Vec<&str> = std::iter::repeat_n("", rows)
        .chain((0..more).map(|row| ours.row(row).unwrap().anchor))
        .collect();
    let readings = Readings {
        kind: ours.kind,
        sigma: std::iter::repeat_n(f64::NAN, rows)
            .chain(ours.sigma.iter().copied())
            .collect(),
        anchor: Some(Named::of(names.iter().copied())),
        ..Readings::default()
    };
    Measurements {
        joints: points.joints,
        q: [points.q, sockets.q.clone()].concat(),
        points: PointReadings {
            position: [points.points.position, sockets.points.position.clone()].concat(),
            sigma: [points.points.sigma, sockets.points.sigma.clone()].concat(),
        },
        payload: vec![0.0; rows + more],
        readings: vec![readings],
        ..Measurements::default()
    }
}

#[test]
fn points_of_a_tracker_tell_the_scale_of_sockets() {
    for robot in [fixture::offset_wrist(), fixture::seven()] {
        let truth = truth(&robot, 21);
        let cell = [
            socket("a", [480.0, 120.0, 300.0], 40, 60.0),
            socket("b", [-250.0, 450.0, 380.0], 40, 60.0),
        ];
        let elsewhere = [
            socket("x", [350.0, -350.0, 450.0], 12, 0.0),
            socket("y", [-200.0, 450.0, 520.0], 12, 0.0),
        ];
        let mut points = touched(&robot, &truth, &elsewhere, 5).measurements();
        points.points.position = true_points(&robot, &truth, &points);
        for (row, point) in points.points.position.iter_mut().enumerate() {
            let noise = Vector3::from_fn(|axis, _| SIGMA * normal(7 * row + axis));
            *point += Vector3::new(1.0, -2.0, 0.5) + noise;
        }
        points.points.sigma = vec![Vector3::repeat(SIGMA); points.rows()];
        let data = joined(points, &touched(&robot, &truth, &cell, 21).measurements());
        let rows: Vec<usize> = (0..data.rows()).collect();
        let (model, fitted) = calibrated(&robot, &data, &[], &[]);
        assert_eq!(
            rank(&model.robot, &data, &rows, false, 0),
            Some(directions(&model, &data)),
            "{}",
            robot.name
        );
        assert!(
            !only_contacts(&data, &rows)
                && scale(&model, &data, &rows, fitted.covariance.as_ref()).is_none()
        );
        let [ours, real] = [model.predict(&data), true_points(&robot, &truth, &data)]
            .map(|points| (points[30] - points[data.rows() - 1]).norm());
        let apart = ours - real;
        assert!(
            apart.abs() < 1.5e-4,
            "{}: distances of sockets are {:.3} mm off",
            robot.name,
            1e3 * apart
        );
    }
}
