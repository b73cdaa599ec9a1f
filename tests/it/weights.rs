//! Wind-up of arms whose masses nobody knows: gravity's torque of whatever masses is made of the moments that the form has.

use crate::answer::has;
use crate::fixture;
use calib::description::RobotDescription;
use calib::effect::{
    Clock, Deflection, Direction, EffectContext, EffectStack, Form, Load, ParameterEstimate,
    ParameterSpec, Place, Summary, Survey, arm_effect, cause, people,
};
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::spatial::Pose;
use nalgebra::{DMatrix, DVector, Vector3};

const ROWS: usize = 80;

fn data(robot: &RobotModel) -> Measurements {
    Measurements {
        joints: robot.joints(),
        q: fixture::poses(robot.description(), ROWS),
        points: PointReadings::new(vec![Vector3::zeros(); ROWS], 1e-5),
        payload: vec![0.0; ROWS],
        ..Measurements::default()
    }
}

fn stack(robot: &RobotModel) -> EffectStack {
    let setting = EffectContext {
        base: Pose::identity(),
        load: Load::GravityTorque,
    };
    EffectStack::new(
        robot,
        setting.base,
        vec![arm_effect("joint_compliance", &setting).unwrap()],
    )
}

/// Load torques of every row (Nm), row-major, and what each number of a form turns its joint by.
fn torques(robot: &RobotModel, data: &Measurements) -> Vec<f64> {
    let stack = stack(robot);
    let (mut scratch, none) = (stack.scratch(robot), vec![0.0; stack.specs().len()]);
    (0..ROWS)
        .flat_map(|row| {
            stack
                .point_motion(robot, data, row, &none, &mut scratch)
                .posture
                .torque
                .clone()
        })
        .collect()
}

fn turns(robot: &RobotModel, data: &Measurements, form: &Form) -> DMatrix<f64> {
    let stack = stack(robot);
    let (mut scratch, none) = (stack.scratch(robot), vec![0.0; stack.specs().len()]);
    let zeros = vec![0.0; form.parameters(robot).len()];
    let mut out = DMatrix::zeros(ROWS, zeros.len());
    let mut buffer = Deflection::new(robot.joints());
    for row in 0..ROWS {
        let motion = stack.point_motion(robot, data, row, &none, &mut scratch);
        motion.deflect(robot, data, form, &zeros, &mut buffer);
        for (k, direction) in &buffer.partials {
            let Direction::Joint(_, rate) = direction else {
                panic!("{direction:?}")
            };
            out[(row, *k)] += rate;
        }
    }
    out
}

/// A survey of all rows is handed to `tell`.
fn surveyed<T>(robot: &RobotModel, data: &Measurements, tell: impl FnOnce(&Survey) -> T) -> T {
    let (rows, torque, compliance) = (
        (0..ROWS).collect::<Vec<_>>(),
        torques(robot, data),
        vec![0.0; robot.joints()],
    );
    tell(&Survey::new(robot, data, &rows, &torque, &compliance))
}

fn windups(robot: &RobotModel, data: &Measurements) -> Vec<Form> {
    let all = surveyed(robot, data, |survey| {
        cause("joint_compliance").unwrap().propose(survey)
    });
    all.into_iter().map(|hypothesis| hypothesis.form).collect()
}

fn bare(mut description: RobotDescription) -> RobotModel {
    description
        .joints
        .iter_mut()
        .for_each(|joint| (joint.mass, joint.centre) = (None, None));
    RobotModel::new(description)
}

#[test]
fn gravity_torques_of_any_masses_are_made_of_the_moments_of_the_bodies_outwards() {
    let mut compared = 0;
    for description in fixture::all() {
        let (weighed, bare) = (RobotModel::new(description.clone()), bare(description));
        let data = data(&weighed);
        let (torque, forms) = (torques(&weighed, &data), windups(&bare, &data));
        let most = torque
            .iter()
            .fold(0.0, |most: f64, torque| most.max(torque.abs()));
        for joint in 0..weighed.joints() {
            let ours = DVector::from_iterator(
                ROWS,
                torque.iter().skip(joint).step_by(weighed.joints()).copied(),
            );
            let size = ours.amax();
            let here = forms
                .iter()
                .filter(|form| form.place() == Place::Joint(joint));
            let Some(widest) = here.max_by_key(|form| form.parameters(&bare).len()) else {
                assert!(
                    !weighed.is_revolute(joint) || size < 0.05 * most,
                    "nothing for joint {} of {size} Nm",
                    joint + 1
                );
                continue;
            };
            let turns = turns(&bare, &data, widest);
            let solved = turns.clone().svd(true, true).solve(&ours, 1e-10).unwrap();
            let left = (turns * solved - &ours).amax();
            assert!(
                left < 1e-9 * most,
                "joint {}: {left} of {size} Nm",
                joint + 1
            );
            compared += 1;
        }
        assert!(
            windups(&weighed, &data)
                .iter()
                .all(|form| form.parameters(&weighed).len() == 1),
            "masses are known"
        );
    }
    assert!(compared > 12, "{compared}");
}

/// About the first level axis a weight does what an eccentric wheel does.
#[test]
fn the_weight_of_the_next_link_alone_is_an_eccentric_gear_by_another_name() {
    let robot = bare(fixture::spherical());
    let data = data(&robot);
    let forms = windups(&robot, &data);
    let names = |form: &Form| {
        form.parameters(&robot)
            .into_iter()
            .map(|spec| spec.name)
            .collect::<Vec<_>>()
    };
    let mut kinds = [0; 3];
    for form in forms.iter().filter(|form| form.place() == Place::Joint(1)) {
        let (names, identities) = (names(form), form.identities("joint_compliance"));
        let alone = names
            .iter()
            .all(|name| name.starts_with("joint_compliance.j2.gravity.link2"));
        let same: &[(&str, Place)] = if alone {
            &[
                ("gear_cyclic", Place::Joint(1)),
                ("counterbalance", Place::Joint(1)),
            ]
        } else {
            &[]
        };
        assert_eq!(identities, same, "{names:?}");
        kinds[if alone { names.len() - 1 } else { 2 }] += 1;
    }
    assert!(kinds[0] == 1 && kinds[1] == 1 && kinds[2] > 1, "{kinds:?}");
}

/// A payload tells how stiff a joint is, also where nobody knows the arm's own masses.
#[test]
fn with_a_payload_the_stiffness_is_said_beside_the_weight() {
    let robot = RobotModel::new(fixture::spherical());
    let data = data(&robot);
    let at = |robot: &RobotModel| {
        windups(robot, &data)
            .into_iter()
            .find(|form| form.place() == Place::Joint(2))
            .unwrap()
    };
    let (weight, load) = (at(&bare(fixture::spherical())), at(&robot));
    let message_of = |forms: &[Form]| {
        let specs_of = |(form, one_form): (usize, &Form)| {
            let specs = one_form.parameters(&robot).into_iter();
            let number = |spec: ParameterSpec| {
                let (unit, symbol) = people(spec.unit);
                ParameterEstimate {
                    name: spec.name,
                    form,
                    value: unit.from_si(1e-4),
                    unit: symbol,
                    sigma: None,
                }
            };
            specs.map(number).collect::<Vec<_>>()
        };
        let parameters: Vec<ParameterEstimate> =
            forms.iter().enumerate().flat_map(specs_of).collect();
        let summary = Summary {
            place: Place::Joint(2),
            forms,
            parameters: &parameters,
            clock: Clock::Rows,
        };
        forms[0].cause().sentence(&summary)
    };
    // 1e-4 rad are 20.6 arcsec.
    let alone = message_of(std::slice::from_ref(&weight));
    has(
        &alone,
        [
            "by up to 21 arcsec",
            "cannot be separated from the links' weight",
        ],
    );
    let both = message_of(&[weight, load]);
    has(
        &both,
        [
            "1.000e-4 rad/Nm, and under its own weight",
            "by up to 21 arcsec",
        ],
    );
}
