//! Many twins: what is stated of the arm's distances holds as often as it should. `CALIB_RECORDINGS=200` for the whole count.

use super::{
    Length, calibrated, fitted_with, fixture, plane, priors, socket, sphere, touched, true_points,
    truth,
};
use crate::compensate::concealed::from_environment;
use crate::fixture::rms;
use crate::identify::normal;
use calib::description::RobotDescription;
use calib::estimate::scale;
use calib::twin::touch::Fixture;
use nalgebra::{DVector, Vector3};

/// um
const SIGMA: f64 = 60.0;

/// Sockets alone, with planes, with a sphere, with both: all within reach of both arms.
fn cell(kind: usize) -> Vec<Fixture> {
    let mut all = vec![
        socket("a/0", [480.0, 120.0, 300.0], 30, SIGMA),
        socket("a/1", [480.0, 170.0, 300.0], 30, SIGMA),
        socket("b/0", [-250.0, 450.0, 380.0], 30, SIGMA),
        socket("b/1", [-250.0, 450.0, 430.0], 30, SIGMA),
    ];
    if kind % 4 == 1 || kind % 4 == 3 {
        all.push(plane(
            "table",
            [100.0, -480.0, 320.0],
            [0.2, 0.1, 1.0],
            40,
            SIGMA,
        ));
    }
    if kind % 4 >= 2 {
        all.push(sphere("ball", [350.0, -350.0, 450.0], 40.0, 40, SIGMA));
    }
    all
}

fn recordings() -> usize {
    from_environment("CALIB_RECORDINGS", 12) as usize
}

fn robot(seed: usize) -> RobotDescription {
    [fixture::offset_wrist, fixture::seven][seed % 2]()
}

#[test]
fn stated_sigmas_of_distances_hold() {
    let count = recordings();
    let mut scores = Vec::new();
    for seed in 0..count {
        let robot = robot(seed);
        let truth = truth(&robot, seed);
        let data = touched(&robot, &truth, &cell(seed / 2), seed).measurements();
        let length =
            |from, to, k: usize| Length(from, to, 0.05 + 2e-5 * normal(77 * seed + k), 2e-5);
        let (model, fitted) = calibrated(
            &robot,
            &data,
            &[length("a/0", "a/1", 1), length("b/0", "b/1", 2)],
            &[],
        );
        let Some(covariance) = &fitted.covariance else {
            panic!("{} {seed}: singular", robot.name)
        };
        let (there, points) = (true_points(&robot, &truth, &data), model.predict(&data));
        let mut scratch = model.stack.scratch(&model.robot);
        for pair in [
            [3, 75],
            [40, 100],
            [10, data.rows() - 5],
            [70, data.rows() - 20],
        ] {
            let [a, b] = pair;
            let along = (points[a] - points[b]).normalize();
            let mut rates = vec![0.0; model.x.len()];
            for (row, sign) in [(a, 1.0), (b, -1.0)] {
                model.stack.derivatives(
                    &model.robot,
                    &data,
                    row,
                    &model.x,
                    &mut scratch,
                    |k, rate| rates[k] += sign * along.dot(&rate),
                );
            }
            let parameters = covariance.parameters();
            let weights =
                DVector::from_iterator(parameters.len(), parameters.iter().map(|k| rates[*k]));
            let sigma = weights
                .dot(&(covariance.block(parameters).unwrap() * &weights))
                .sqrt();
            scores.push(((points[a] - points[b]).norm() - (there[a] - there[b]).norm()) / sigma);
        }
    }
    let scatter = rms(scores.iter().copied());
    let covered =
        scores.iter().filter(|score| score.abs() < 1.96).count() as f64 / scores.len() as f64;
    // Twelve twins leave room for chance.
    let (scatters, coverage) = if count >= 100 {
        (0.85..1.18, 0.92..0.98)
    } else {
        (0.7..1.35, 0.85..1.001)
    };
    assert!(
        scatters.contains(&scatter) && coverage.contains(&covered),
        "scatter {scatter:.3}, coverage {covered:.3}"
    );
}

/// Links that err on their own, each within its prior: what is stated for just that holds as often as it should, and the statement for
/// tolerances that lean together is wider.
#[test]
fn the_scale_that_priors_tell_scatters_as_stated_where_links_err_on_their_own() {
    let count = recordings();
    let mut scores = Vec::new();
    for seed in 0..count {
        let robot = robot(seed);
        let truth = truth(&robot, 500 + seed);
        let data = touched(&robot, &truth, &cell(0), 500 + seed).measurements();
        let rows: Vec<usize> = (0..data.rows()).collect();
        let (model, fitted) = fitted_with(
            &robot,
            &data,
            &rows,
            &["joint_offset", "link_geometry"],
            &[],
            priors,
        );
        let stated = scale(&model, &data, &rows, fitted.covariance.as_ref()).unwrap();
        let (together, apart) = (stated.sigma.unwrap(), stated.independent.unwrap());
        assert!(
            !stated.by_length && stated.by_priors && apart <= together,
            "{stated:?}"
        );
        let there = true_points(&robot, &truth, &data);
        let [ours, real] = [model.predict(&data), there].map(|points| {
            let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            rms(points.iter().map(|point| (point - middle).norm()))
        });
        // The factor by which links are off more than their priors say is by chance here.
        scores.push((ours / real - 1.0) * stated.beyond / apart);
    }
    let scatter = rms(scores.iter().copied());
    let scatters = if count >= 100 { 0.85..1.18 } else { 0.6..1.5 };
    assert!(scatters.contains(&scatter), "{scatter:.3}");
}
