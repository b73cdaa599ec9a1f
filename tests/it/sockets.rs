//! Calibration without an instrument: a ball that is brought to sockets, planes and spheres, nothing read but the joints.

mod diagnosed;
mod dirty;
mod files;
mod kept;
mod left_out;
mod mixed;
mod mukca;
mod postures;
mod rank;
mod twins;

use crate::fixture::{self, all_rows, fit_all};
use crate::identify::{GEOMETRY, model, normal};
use crate::recorded::made;
use calib::description::RobotDescription;
use calib::effect::names;
use calib::estimate::{Fitted, KnownLength, Model, Prior, determined_directions, gauge};
use calib::robot::{Measurements, Named, RobotModel};
use calib::stage::{Simulate, SimulateReads, Stage};
use calib::table::{Recording, Robot};
use calib::twin::arm::{Arm, Motion};
use calib::twin::touch::{Fixture, FixtureKind};
use calib::twin::truth::{LinkError, TrueRobot};
use nalgebra::Vector3;
use std::collections::BTreeMap;

fn socket(name: &str, centre_mm: [f64; 3], points: usize, sigma_um: f64) -> Fixture {
    let (normal, radius_mm, usage) = (None, None, "fit".into());
    Fixture {
        kind: FixtureKind::Socket,
        name: name.into(),
        centre_mm,
        normal,
        radius_mm,
        points,
        sigma_um,
        usage,
    }
}

fn plane(
    name: &str,
    centre_mm: [f64; 3],
    normal: [f64; 3],
    points: usize,
    sigma_um: f64,
) -> Fixture {
    let (kind, normal, radius_mm) = (FixtureKind::Plane, Some(normal), Some(300.0));
    Fixture {
        kind,
        normal,
        radius_mm,
        ..socket(name, centre_mm, points, sigma_um)
    }
}

fn sphere(
    name: &str,
    centre_mm: [f64; 3],
    radius_mm: f64,
    points: usize,
    sigma_um: f64,
) -> Fixture {
    Fixture {
        kind: FixtureKind::Sphere,
        radius_mm: Some(radius_mm),
        ..socket(name, centre_mm, points, sigma_um)
    }
}

/// Errors of every link and joint as a maker leaves them: 0.3 mm, 1 mrad, zeros of 2 mrad.
fn truth(robot: &RobotDescription, seed: usize) -> TrueRobot {
    let joints = robot.joints.len();
    let draw = |k: usize| normal(10_000 * (seed + 1) + k);
    let link = |link: usize| LinkError {
        link: link + 1,
        shift_mm: [0, 1, 2].map(|axis| 0.3 * draw(10 * link + axis)),
        tilt_arcsec: [0, 1, 2].map(|axis| 206.0 * draw(10 * link + 3 + axis)),
    };
    TrueRobot {
        links: (0..joints).map(link).collect(),
        offset_deg: (0..joints)
            .map(|joint| 0.115 * draw(1000 + joint))
            .collect(),
        ..TrueRobot::default()
    }
}

/// What a twin records at fixtures.
fn touched(
    robot: &RobotDescription,
    truth: &TrueRobot,
    fixtures: &[Fixture],
    seed: usize,
) -> Recording {
    touched_with(robot, truth, "[]", fixtures, seed)
}

/// The same with effects of the twin, YAML.
fn touched_with(
    robot: &RobotDescription,
    truth: &TrueRobot,
    effects: &str,
    fixtures: &[Fixture],
    seed: usize,
) -> Recording {
    let settings = Simulate {
        effects: serde_saphyr::from_str(effects).unwrap(),
        truth: truth.clone(),
        fixtures: fixtures.to_vec(),
        seed: Some(seed as u64),
        ..serde_saphyr::from_str("{}").unwrap()
    };
    assert_eq!(settings.check(), []);
    let robot = Robot::from_description(robot);
    made(&settings, SimulateReads { robot }).get()
}

/// A length between two fixtures of a setup, m.
struct Length<'a>(&'a str, &'a str, f64, f64);

/// A fit of the geometry to all rows, from the nominal robot.
fn calibrated(
    robot: &RobotDescription,
    data: &Measurements,
    lengths: &[Length],
    effects: &[&str],
) -> (Model, Fitted) {
    calibrated_knowing(robot, data, lengths, effects, &[])
}

/// The same with numbers of anchors that are known beforehand: parameter, value and standard deviation, SI.
fn calibrated_knowing(
    robot: &RobotDescription,
    data: &Measurements,
    lengths: &[Length],
    effects: &[&str],
    known: &[(String, f64, f64)],
) -> (Model, Fitted) {
    let rows: Vec<usize> = (0..data.rows()).collect();
    let (robot, base) = gauge(
        RobotModel::new(robot.clone()),
        data,
        &rows,
        &BTreeMap::new(),
    )
    .unwrap();
    let mut model = model(
        &robot,
        base,
        &[&["anchor"][..], &GEOMETRY, effects].concat(),
    );
    let number = |name: &str| robot.setup().anchor(name).unwrap();
    model.lengths = lengths
        .iter()
        .map(|Length(from, to, length, sigma)| KnownLength {
            between: [number(from), number(to)],
            length: *length,
            sigma: *sigma,
        })
        .collect();
    for (name, value, sigma) in known {
        let mut specs = model.stack.specs().iter();
        let k = specs.position(|spec| spec.name == *name).unwrap();
        let mean = value - model.standing(k).0;
        let sigma = *sigma;
        model.known.entry(k).or_default().prior = Some(Prior { mean, sigma });
    }
    fit_all(&model, data, &rows)
}

/// How many directions of all parameters the data tell, however wide tolerances are: the rank that theory speaks of.
fn directions(fitted: &Model, data: &Measurements) -> usize {
    let mut wide = fitted.clone();
    wide.tolerances
        .iter_mut()
        .for_each(|tolerance| *tolerance *= 100.0);
    let (model, fitted) = fit_all(&wide, data, &all_rows(data));
    let all: Vec<usize> = (0..model.x.len()).collect();
    determined_directions(&model, &fitted, &all)
}

/// What a socket's known place (mm) says of its parameters.
fn known_place(name: &str, place: [f64; 3]) -> Vec<(String, f64, f64)> {
    ["x", "y", "z"]
        .iter()
        .zip(place)
        .map(|(axis, mm)| (format!("anchor.{name}.{axis}"), 1e-3 * mm, 1e-6))
        .collect()
}

/// One standard deviation beforehand, SI, of what a maker's tolerances justify.
fn priors(name: &str) -> Option<f64> {
    let effect = name.split('.').next().unwrap_or_default();
    let tilt = name
        .rsplit('.')
        .next()
        .is_some_and(|ending| ending.starts_with('r'));
    match effect {
        "link_geometry" => Some(if tilt { 1e-3 } else { 3e-4 }),
        "joint_offset" => Some(0.03),
        "joint_compliance" => Some(1e-4),
        _ => None,
    }
}

/// A fit of some rows with priors by name and sockets 50 mm apart.
fn fitted_with(
    robot: &RobotDescription,
    data: &Measurements,
    rows: &[usize],
    effects: &[&str],
    pairs: &[[String; 2]],
    prior: impl Fn(&str) -> Option<f64>,
) -> (Model, Fitted) {
    let (robot, base) =
        gauge(RobotModel::new(robot.clone()), data, rows, &BTreeMap::new()).unwrap();
    let mut model = model(
        &robot,
        base,
        &[&["anchor", "base_frame", "tool_offset"][..], effects].concat(),
    );
    for (k, spec) in model.stack.specs().iter().enumerate() {
        if let Some(sigma) = prior(&spec.name) {
            model.known.entry(k).or_default().prior = Some(Prior { mean: 0.0, sigma });
        }
    }
    let seen = |name: &String| {
        rows.iter()
            .any(|row| data.anchor(*row) == Some(name.as_str()))
    };
    let number = |name: &String| robot.setup().anchor(name).unwrap();
    let there: Vec<&[String; 2]> = pairs
        .iter()
        .filter(|[from, to]| seen(from) && seen(to))
        .collect();
    // One print, of 0.1 mm, at all positions.
    let sigma = 1e-4 * (there.len() as f64).sqrt();
    model.lengths = there
        .into_iter()
        .map(|[from, to]| KnownLength {
            between: [number(from), number(to)],
            length: 0.05,
            sigma,
        })
        .collect();
    fit_all(&model, data, rows)
}

/// Where the true arm has its ball in every row, m.
fn true_points(
    robot: &RobotDescription,
    truth: &TrueRobot,
    data: &Measurements,
) -> Vec<Vector3<f64>> {
    let (arm, still) = (Arm::new(robot, truth), Motion::none(robot.joints.len()));
    let place = |row| arm.posture(&truth.drive(robot, data.q(row)), &still).tool;
    (0..data.rows()).map(|row| place(row).into()).collect()
}

/// Where a fit has the sockets, m.
fn places_of(model: &Model) -> BTreeMap<String, Vector3<f64>> {
    let first = model.stack.parameters_of(names::ANCHOR).next().unwrap();
    let all = model.robot.setup().anchors.iter().enumerate();
    all.map(|(k, anchor)| {
        (
            anchor.name.clone(),
            anchor.place + Vector3::from_column_slice(&model.x[first + 3 * k..][..3]),
        )
    })
    .collect()
}
