//! Effects of a user's own: laws as formulas do what the library's do, and declarations survive as JSON.

use crate::answer::has;
use crate::fixture;
use calib::effect::{
    Axes, AxisPoint, Basis, DeclaredCause, DeclaredForm, EffectDeclaration, EffectStack, Form, Law,
    Laws, Motion, Polar, ShapeRange, Starts, Survey, Term, Variable, cause,
};
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::spatial::{Pose, Twist};
use nalgebra::Vector3;

const ROWS: usize = 40;

fn data(robot: &RobotModel) -> Measurements {
    let n = robot.joints();
    let q = fixture::poses(robot.description(), ROWS);
    let base = Pose::exp(&Twist::new(9.0, -1.0, 0.5, 0.1, -0.2, 2.0));
    Measurements {
        joints: n,
        points: PointReadings::new(
            q.chunks(n)
                .map(|q| base.point(&robot.forward(q).translation))
                .collect(),
            1e-5,
        ),
        q,
        payload: (0..ROWS).map(|row| [0.0, 4.0, 10.0][row % 3]).collect(),
        temperature: Some((0..ROWS).map(|row| 20.0 + 0.3 * row as f64).collect()),
        time: Some((0..ROWS).map(|row| 12.0 * row as f64).collect()),
        ..Measurements::default()
    }
}

fn declaration(place: &str, motion: &str, law: &[&str]) -> EffectDeclaration {
    EffectDeclaration {
        name: "own_effect".into(),
        place: place.into(),
        motion: Some(motion.into()),
        law: Laws(law.iter().map(|text| (*text).to_string()).collect()),
        ..EffectDeclaration::default()
    }
}

/// The forms of a declaration on an arm.
fn forms(declaration: &EffectDeclaration, robot: &RobotModel, data: &Measurements) -> Vec<Form> {
    let declared = DeclaredCause::of(declaration).unwrap_or_else(|faults| panic!("{faults:?}"));
    let rows: Vec<usize> = (0..ROWS).collect();
    let torque = vec![1.0; ROWS * robot.joints()];
    let compliance = vec![0.0; robot.joints()];
    let survey = Survey::new(robot, data, &rows, &torque, &compliance);
    DeclaredForm::hypotheses(&declared, &survey)
        .into_iter()
        .map(|hypothesis| hypothesis.form)
        .collect()
}

/// Points and partials of an arm with one form at these coefficients.
fn moved(robot: &RobotModel, data: &Measurements, form: &Form) -> Vec<Vec<Vector3<f64>>> {
    let base = Pose::exp(&Twist::new(9.0, -1.0, 0.5, 0.1, -0.2, 2.0));
    let stack = EffectStack::new(robot, base, vec![Box::new(form.clone())]);
    let x: Vec<f64> = (0..stack.specs().len())
        .map(|k| 1e-4 * (1.0 + k as f64))
        .collect();
    let mut scratch = stack.scratch(robot);
    let row = |row: usize| {
        let mut out = vec![Vector3::zeros(); x.len() + 1];
        let point = stack.derivatives(robot, data, row, &x, &mut scratch, |k, partial| {
            out[k] += partial
        });
        out[x.len()] = point;
        out
    };
    (0..ROWS).map(row).collect()
}

fn term(name: &str, motion: Motion, law: Law) -> Form {
    Term::new(cause(name).unwrap(), motion, law).into()
}

#[test]
fn a_formula_moves_the_arm_as_the_same_law_of_the_library() {
    let robot = RobotModel::new(fixture::spherical());
    let data = data(&robot);
    let warm = Law::new(
        Variable::Temperature,
        Basis::Linear {
            zero: 20.0,
            per: 1.0,
        },
    );
    let joint = 2;
    let pairs: Vec<(EffectDeclaration, Form)> = vec![
        (
            declaration("joint 3", "angle", &["sin(3 * q)", "cos(3 * q)"]),
            term(
                "gear_cyclic",
                Motion::Joint { joint },
                Law::new(
                    Variable::Angle { joint },
                    Basis::Wave {
                        order: 3,
                        overtone: false,
                    },
                ),
            ),
        ),
        (
            declaration("joint 3", "angle", &["(temperature - 20) * q"]),
            term(
                "joint_warming",
                Motion::Joint { joint },
                warm.times(Variable::Angle { joint }, Basis::PROPORTIONAL),
            ),
        ),
        (
            declaration("joint 3", "angle", &["q_before * load"]),
            term(
                "unknown",
                Motion::Joint { joint },
                Law::of(Variable::Angle { joint: 1 })
                    .times(Variable::Load { joint }, Basis::PROPORTIONAL),
            ),
        ),
        (
            declaration("joint 3", "axis", &["sin(q)", "cos(q)"]),
            term(
                "axis_wobble",
                Motion::Axis {
                    joint,
                    about: None,
                    turning: false,
                    at: AxisPoint::Own,
                },
                Law::new(
                    Variable::Angle { joint },
                    Basis::Wave {
                        order: 1,
                        overtone: false,
                    },
                ),
            ),
        ),
        (
            declaration("link 2", "growth", &["temperature - 20"]),
            term("thermal_growth", Motion::Links { first: 1, last: 1 }, warm),
        ),
        (
            declaration("tool", "displacement", &["step(payload - 5)"]),
            term(
                "unknown",
                Motion::Tool { axes: Axes::Place },
                Law::new(Variable::Payload, Basis::After { at: 5.0 }),
            ),
        ),
        (
            declaration("base", "both", &["1 - exp(-time / 100)"]),
            term(
                "base_shift",
                Motion::Base { axes: Axes::Both },
                Law::new(
                    Variable::Time,
                    Basis::Settling {
                        start: 0.0,
                        constant: 100.0,
                    },
                ),
            ),
        ),
        (
            declaration("tracker", "azimuth", &["sin(azimuth)", "cos(azimuth)"]),
            term(
                "tracker_circle",
                Motion::Instrument {
                    reading: Polar::Azimuth,
                },
                Law::new(
                    Variable::Azimuth,
                    Basis::Wave {
                        order: 1,
                        overtone: false,
                    },
                ),
            ),
        ),
        (
            declaration("joint 3", "angle", &["slip(0.05)"]),
            term(
                "presliding",
                Motion::Joint { joint },
                Law::of(Variable::Slip {
                    joint,
                    travel: 0.05,
                }),
            ),
        ),
    ];
    for (declared, library) in pairs {
        let ours = forms(&declared, &robot, &data);
        let [ours] = &ours[..] else {
            panic!("{} forms of {declared:?}", ours.len())
        };
        assert_eq!(ours.place(), library.place(), "{declared:?}");
        let (ours, library) = (moved(&robot, &data, ours), moved(&robot, &data, &library));
        for (row, (own, library)) in ours.iter().zip(&library).enumerate() {
            assert_eq!(own.len(), library.len(), "{declared:?}");
            for (ours, library) in own.iter().zip(library) {
                assert!(
                    (ours - library).norm() < 1e-12,
                    "{declared:?} at row {row}: {ours} instead of {library}"
                );
            }
        }
    }
}

#[test]
fn a_form_carries_its_declaration_wherever_its_json_goes() {
    let robot = RobotModel::new(fixture::spherical());
    let data = data(&robot);
    let range = ShapeRange {
        from: -3.0,
        to: 3.0,
        start: Starts(vec![-1.0, 1.0]),
    };
    let declared = EffectDeclaration {
        shape: [("centre".to_string(), range)].into(),
        sentence: Some("{place} by {value} near {centre}".into()),
        ..declaration("joint", "angle", &["abs(q - centre)"])
    };
    let all = forms(&declared, &robot, &data);
    assert_eq!(all.len(), 2 * robot.joints());
    for form in &all {
        let text = serde_json::to_string(form).unwrap();
        let again: Form = serde_json::from_str(&text).unwrap();
        assert!(
            again == *form
                && again.key() == form.key()
                && serde_json::to_string(&again).unwrap() == text
        );
    }
    let text = serde_json::to_string(&all[0]).unwrap();
    for (from, to, printed) in [
        ("abs(q", "abs(p", "`p` is no name"),
        (
            "\"shape\":[-1.0]",
            "\"shape\":[]",
            "is not as it was declared",
        ),
        (
            "{\"own_effect\":",
            "{\"other_effect\":",
            "is not as it was declared",
        ),
        ("\"declared\"", "\"decleared\"", "no cause `own_effect`"),
    ] {
        assert!(text.contains(from), "{from}: {text}");
        let error = serde_json::from_str::<Form>(&text.replace(from, to))
            .expect_err("not a form")
            .to_string();
        has(&error, printed);
    }
}

#[test]
fn a_declaration_says_what_it_needs_and_is_not_tried_without() {
    let robot = RobotModel::new(fixture::spherical());
    let mut data = data(&robot);
    let declared = declaration("joint", "angle", &["lagging(300) * q"]);
    assert_eq!(forms(&declared, &robot, &data).len(), robot.joints());
    // The first joint has none before it.
    assert_eq!(
        forms(
            &declaration("joint", "angle", &["q_before * q"]),
            &robot,
            &data
        )
        .len(),
        robot.joints() - 1
    );
    data.temperature = None;
    assert_eq!(forms(&declared, &robot, &data).len(), 0);
    let cause = DeclaredCause::of(&declared).unwrap();
    let rows: Vec<usize> = (0..ROWS).collect();
    let torque = vec![1.0; ROWS * robot.joints()];
    let compliance = vec![0.0; robot.joints()];
    let survey = Survey::new(&robot, &data, &rows, &torque, &compliance);
    assert_eq!(
        (cause.name(), DeclaredForm::lacking(&cause, &survey)),
        ("own_effect", Some("temperature"))
    );
}
