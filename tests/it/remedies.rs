//! What would show a parameter that the data do not: tried on the model, and true when measured.

use crate::fixture::{self, fit_all};
use crate::identify::{GEOMETRY, model, recording};
use calib::description::RobotDescription;
use calib::estimate::{Fitted, Model, Remedy, Session, align, remedies};
use calib::robot::{Measurements, RobotModel};

fn identify(
    description: &RobotDescription,
    data: &Measurements,
    effects: &[&str],
) -> (Model, Fitted) {
    let robot = RobotModel::new(description.clone());
    let rows: Vec<usize> = (0..data.rows()).collect();
    let model = model(&robot, align(&robot, data, &rows), effects);
    fit_all(&model, data, &rows)
}

/// What would show the named parameter, which must be hidden now.
fn remedy(
    description: &RobotDescription,
    data: &Measurements,
    effects: &[&str],
    name: &str,
) -> Remedy {
    let (model, fitted) = identify(description, data, effects);
    let rows: Vec<usize> = (0..data.rows()).collect();
    let k = model
        .stack
        .specs()
        .iter()
        .position(|spec| spec.name == name)
        .unwrap();
    assert!(fitted.undetermined(&model).contains(&k), "{name} is seen");
    remedies(&Session {
        data,
        rows: &rows,
        model: &model,
        fitted: &fitted,
    })
    .remove(&k)
    .unwrap()
}

/// A recording of the nominal robot with joints and payload bent.
fn nominal(description: &RobotDescription, bend: impl Fn(&mut Measurements)) -> Measurements {
    let (mut data, truth) = recording(description, &[], 120, 3);
    bend(&mut data);
    data.points.position = truth.predict(&data);
    data
}

#[test]
fn a_joint_that_never_moves_is_to_be_moved() {
    let description = fixture::offset_wrist();
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    let data = nominal(&description, |data| {
        data.q.iter_mut().skip(3).step_by(6).for_each(|q| *q = 0.4)
    });
    assert_eq!(
        remedy(&description, &data, &effects, "reduction_ratio.j4"),
        Remedy::Move(vec![3])
    );
}

#[test]
fn a_target_on_the_last_axis_wants_another_beside_it() {
    let mut description = fixture::spherical();
    description.tool = [1.954, 0.0, 1.31];
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    let data = nominal(&description, |_| {});
    assert_eq!(
        remedy(&description, &data, &effects, "reduction_ratio.j6"),
        Remedy::SecondTarget
    );
}

#[test]
fn what_is_the_same_to_every_point_is_said_so() {
    let description = fixture::offset_wrist();
    let data = nominal(&description, |_| {});
    assert_eq!(
        remedy(&description, &data, &GEOMETRY, "joint_offset.j1"),
        Remedy::Nothing
    );
    assert_eq!(
        remedy(&description, &data, &GEOMETRY, "link_geometry.l1.z"),
        Remedy::Nothing
    );
}

#[test]
fn without_hidden_parameters_there_is_nothing_to_advise() {
    let description = fixture::offset_wrist();
    let data = nominal(&description, |_| {});
    let (model, fitted) = identify(&description, &data, &["base_frame", "reduction_ratio"]);
    let session = Session {
        data: &data,
        rows: &(0..120).collect::<Vec<_>>(),
        model: &model,
        fitted: &fitted,
    };
    assert!(remedies(&session).is_empty());
}
