//! The covariance of a fit as a table: the same numbers on the way to and from it, and what `compensate` makes of it.

use crate::fixture::{self, all_rows, fit_all};
use crate::identify::{GEOMETRY, model, recording};
use calib::compensate::{Circumstance, IdentifiedArm, Scatter, Uncertainty};
use calib::effect::Load;
use calib::estimate::{Fitted, Model, align, fit};
use calib::robot::Measurements;
use calib::table::{CovarianceRow, CovarianceTable, Parameters, Table};

fn fitted(data: &Measurements, robot: &calib::robot::RobotModel) -> (Model, Fitted) {
    let rows = all_rows(data);
    let model = model(robot, align(robot, data, &rows), &GEOMETRY);
    fit_all(&model, data, &rows)
}

#[test]
fn the_table_has_the_variances_of_the_parameters_and_every_pair_once() {
    let (data, truth) = recording(&fixture::spherical(), &GEOMETRY, 60, 5);
    let (model, fitted) = fitted(&data, &truth.robot);
    let table = CovarianceTable::of(&model, &fitted, None);
    let parameters = Parameters::of("geometry", &model, &fitted, &[], None);
    let free: Vec<_> = parameters
        .0
        .iter()
        .filter(|row| row.sigma.is_some())
        .collect();
    assert!(free.len() > 20);
    assert_eq!(table.0.len(), free.len() * (free.len() + 1) / 2);
    let same = |name: &str| {
        let is = |pair: &&CovarianceRow| pair.parameter == name && pair.other == name;
        table.0.iter().find(is).unwrap()
    };
    for row in &free {
        let row_of = same(&row.name);
        let sigma = row.sigma.unwrap();
        assert!(
            (row_of.covariance.sqrt() / sigma - 1.0).abs() < 1e-9,
            "{}: {} and {sigma}",
            row.name,
            row_of.covariance.sqrt()
        );
        assert_eq!(row_of.unit, format!("{0} {0}", row.unit));
    }
    for pair in &table.0 {
        let [one, other] = [same(&pair.parameter), same(&pair.other)];
        let bound = (one.covariance * other.covariance).sqrt();
        assert!(
            (pair.covariance - pair.correlation * bound).abs() <= 1e-9 * bound,
            "{pair:?}"
        );
    }
    let stored = CovarianceTable::from_frame(&table.to_frame().unwrap()).unwrap();
    let sorted = |table: CovarianceTable| {
        let mut rows = table.0;
        rows.sort_by(|a, b| (&a.parameter, &a.other).cmp(&(&b.parameter, &b.other)));
        rows
    };
    assert_eq!(sorted(stored), sorted(table));
}

#[test]
fn a_stored_covariance_says_of_every_point_what_the_fit_said() {
    let (data, truth) = recording(&fixture::offset_wrist(), &GEOMETRY, 60, 9);
    let (model, fitted) = fitted(&data, &truth.robot);
    let parameters = Parameters::of("geometry", &model, &fitted, &[], None);
    let read = parameters
        .model(truth.robot.clone(), &[], Load::GravityTorque)
        .unwrap();
    let covariance = CovarianceTable::of(&model, &fitted, None)
        .of_model(&read)
        .unwrap();
    let want = fitted
        .covariance
        .as_ref()
        .unwrap()
        .of_predictions(&model, &data);
    let arm = IdentifiedArm::new(read, None);
    let uncertainty = Uncertainty::new(&arm, covariance, Scatter::default());
    let mut reach = arm.reach();
    for (row, want) in want.iter().enumerate() {
        reach.under(&Circumstance {
            payload: data.payload[row],
            ..Circumstance::unknown(data.joints)
        });
        let found = uncertainty.at(&mut reach, data.q(row)).sigma;
        assert!(
            (found / want - 1.0).abs() < 1e-3,
            "row {row}: {found} and {want}"
        );
    }
}

#[test]
fn what_an_earlier_step_estimated_stays_in_the_table_of_a_later_one() {
    let (data, truth) = recording(&fixture::spherical(), &GEOMETRY, 60, 5);
    let (model, fitted) = fitted(&data, &truth.robot);
    let first = CovarianceTable::of(&model, &fitted, None);
    let joints: Vec<usize> = (0..model.x.len())
        .filter(|k| model.stack.specs()[*k].name.starts_with("joint_offset"))
        .collect();
    let (model, again) = fit(&model, &data, &all_rows(&data), &joints);
    let second = CovarianceTable::of(&model, &again, Some(&first));
    let is_offset = |name: &str| name.starts_with("joint_offset");
    let offsets = |row: &CovarianceRow| [&row.parameter, &row.other].map(|name| is_offset(name));
    let mixed = |table: &CovarianceTable| {
        let rows = table.0.iter().map(offsets);
        rows.filter(|[one, other]| one != other).count()
    };
    assert!(mixed(&first) > 0);
    assert_eq!(
        mixed(&second),
        0,
        "steps of their own are held to be independent"
    );
    let others = |table: &CovarianceTable| {
        let rows = table.0.iter().filter(|row| offsets(row) == [false; 2]);
        rows.cloned().collect::<Vec<_>>()
    };
    assert_eq!(others(&first), others(&second));
    assert!(second.of_model(&model).is_some());
}
