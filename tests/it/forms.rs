//! The laws that every form of every cause obeys, on all fixture arms, standing and moving, with all columns that a recording may have.

use crate::answer::starts_with;
use crate::fixture;
use calib::effect::{
    Axes, AxisPoint, Basis, CAUSES, Clock, Effect, EffectContext, EffectStack, Form, Hypothesis,
    Law, Load, Motion, ParameterEstimate, ParameterSpec, Place, Polar, Summary, Survey, Term,
    Unknown, Variable, arm_effect, cause, people,
};
use calib::robot::{LoadCorrection, Measurements, PointReadings, Posture, RobotModel};
use calib::spatial::{Pose, Twist};
use calib::units::Unit;
use nalgebra::Vector3;
use std::collections::BTreeSet;

const ROWS: usize = 120;
/// Rows at which a form is evaluated; the first has no way to it.
const LOOKED_AT: [usize; 4] = [0, 41, 78, 119];
/// rad/Nm of every joint: what the torque model is seen through.
const COMPLIANCE: f64 = 2e-7;

fn data(robot: &RobotModel, moving: bool) -> Measurements {
    let n = robot.joints();
    let spread =
        |salt: usize, count: usize| (0..count).map(move |k| fixture::spread(k, salt) - 0.5);
    let q = fixture::poses(robot.description(), ROWS);
    Measurements {
        joints: n,
        q: q.clone(),
        points: PointReadings::new(
            q.chunks(n)
                .map(|q| setting().base.point(&robot.forward(q).translation))
                .collect(),
            1e-5,
        ),
        payload: (0..ROWS).map(|row| [0.0, 4.0, 10.0][row % 3]).collect(),
        current: Some(spread(3, ROWS * n).map(|value| 5.0 * value).collect()),
        direction: Some(spread(5, ROWS * n).map(f64::signum).collect()),
        velocity: moving.then(|| spread(7, ROWS * n).collect()),
        temperature: Some((0..ROWS).map(|row| 20.0 + 0.1 * row as f64).collect()),
        time: Some((0..ROWS).map(|row| 12.0 * row as f64).collect()),
        ..Measurements::default()
    }
}

fn torques(robot: &RobotModel, data: &Measurements) -> Vec<f64> {
    let mut posture = Posture::new(robot.joints());
    let mut out = Vec::new();
    let stack = EffectStack::new(
        robot,
        Pose::identity(),
        vec![arm_effect("joint_compliance", &setting()).unwrap()],
    );
    let mut scratch = stack.scratch(robot);
    for row in 0..data.rows() {
        let motion = stack.point_motion(
            robot,
            data,
            row,
            &vec![0.0; stack.specs().len()],
            &mut scratch,
        );
        posture.clone_from(&motion.posture);
        out.extend_from_slice(&posture.torque);
    }
    out
}

fn setting() -> EffectContext {
    EffectContext {
        base: Pose::exp(&Twist::new(9.0, -1.0, 0.5, 0.1, -0.2, 2.0)),
        load: Load::GravityTorque,
    }
}

/// What no cause of the list is: motions over variables, as lines, curves, steps and products.
fn unnamed(survey: &Survey) -> Vec<Hypothesis> {
    let last = survey.joints() - 1;
    let axis = |turning| Motion::Axis {
        joint: 1,
        about: None,
        turning,
        at: AxisPoint::Own,
    };
    let motions = [
        Motion::Joint { joint: 0 },
        Motion::Joint { joint: 1 },
        Motion::Coupled { by: 0, moved: 1 },
        axis(true),
        axis(false),
        Motion::Slide {
            joint: 1,
            along: true,
        },
        Motion::Slide {
            joint: 1,
            along: false,
        },
        Motion::Links { first: 1, last: 1 },
        Motion::Bend { link: 1 },
        Motion::Tool { axes: Axes::Place },
        Motion::Base { axes: Axes::Place },
        Motion::Base {
            axes: Axes::Rotation,
        },
    ];
    let read = [Polar::Azimuth, Polar::Elevation, Polar::Range]
        .map(|of| Motion::Instrument { reading: of });
    let along = [0.0, 0.6, 0.8];
    let everywhere = [
        Variable::Angle { joint: 1 },
        Variable::Approach { joint: 1 },
        Variable::Time,
        Variable::Temperature,
        Variable::Payload,
    ];
    let inside = [
        Variable::Load { joint: 1 },
        Variable::Move { joint: 1 },
        Variable::Stretch {
            joint: 1,
            limit: 0.2,
        },
        Variable::Recent {
            joint: 1,
            time: 35.0,
        },
        Variable::Position { along },
        Variable::Gravity {
            axis: Some(last % 3),
        },
    ];
    let outside = [
        Variable::Azimuth,
        Variable::Elevation,
        Variable::Range,
        Variable::Sighted { along },
    ];
    let mut out = Vec::new();
    let mut add = |motion, law| out.push(Hypothesis::new(Term::new(&Unknown, motion, law), 1));
    for (motions, others) in [(&motions[..], &inside[..]), (&read[..], &outside[..])] {
        for (motion, variable) in motions.iter().flat_map(|motion| {
            everywhere
                .iter()
                .chain(others)
                .map(move |variable| (*motion, *variable))
        }) {
            // Wide: what follows a load moves it a little by what it does.
            let (low, high) = (-300.0, 900.0);
            add(
                motion,
                Law::new(
                    variable,
                    Basis::Linear {
                        zero: 0.2,
                        per: 300.0,
                    },
                ),
            );
            add(
                motion,
                Law::new(
                    variable,
                    Basis::Cosines {
                        low,
                        high,
                        count: 4,
                    },
                ),
            );
            add(
                motion,
                Law::new(
                    variable,
                    Basis::Series {
                        low,
                        high,
                        count: 3,
                    },
                )
                .times(
                    Variable::Time,
                    Basis::Straight {
                        zero: 0.0,
                        per: 9e2,
                    },
                ),
            );
        }
        motions.iter().for_each(|motion| {
            add(
                *motion,
                Law::new(Variable::Time, Basis::After { at: 700.0 }),
            )
        });
    }
    let wave = Basis::Wave {
        order: 1,
        overtone: false,
    };
    add(
        Motion::Bend { link: 1 },
        Law::new(Variable::Angle { joint: 1 }, wave),
    );
    add(
        Motion::Joint { joint: 1 },
        Law::new(Variable::Angle { joint: 1 }, wave).times(Variable::Angle { joint: 2 }, wave),
    );
    out
}

/// Runs `law` on every hypothesis of every fixture arm; returns how many there were.
fn over_all(mut law: impl FnMut(&Survey, &Hypothesis)) -> usize {
    let mut count = 0;
    for description in fixture::all() {
        let robot = RobotModel::new(description.clone());
        let mut bare = description;
        bare.joints.iter_mut().for_each(|joint| joint.mass = None);
        for (robot, moving) in [
            (robot.clone(), false),
            (robot, true),
            (RobotModel::new(bare), false),
        ] {
            let data = data(&robot, moving);
            let (rows, torque) = ((0..data.rows()).collect::<Vec<_>>(), torques(&robot, &data));
            let compliance = vec![COMPLIANCE; robot.joints()];
            let survey = Survey::new(&robot, &data, &rows, &torque, &compliance);
            let all: Vec<Hypothesis> = CAUSES
                .iter()
                .flat_map(|cause| cause.propose(&survey))
                .chain(unnamed(&survey))
                .collect();
            count += all.len();
            all.iter().for_each(|hypothesis| law(&survey, hypothesis));
        }
    }
    count
}

/// The stack of yielding joints and a form, the form first or last, and the range of its parameters.
fn stack(robot: &RobotModel, form: &Form, first: bool) -> (EffectStack, std::ops::Range<usize>) {
    let setting = setting();
    let mut effects = vec![
        arm_effect("joint_compliance", &setting).unwrap(),
        arm_effect("joint_offset", &setting).unwrap(),
    ];
    effects.insert(if first { 0 } else { 2 }, Box::new(form.clone()));
    let stack = EffectStack::new(robot, setting.base, effects);
    let range = stack
        .effects()
        .find(|(effect, _)| effect.form().is_some())
        .unwrap()
        .1;
    (stack, range)
}

/// Parameters with all joints yielding, zeros off, and those of the form at `values`.
fn at(stack: &EffectStack, own: &std::ops::Range<usize>, values: &[f64]) -> Vec<f64> {
    let mut x: Vec<f64> = stack
        .specs()
        .iter()
        .map(|spec| {
            if spec.name.starts_with("joint_compliance") {
                COMPLIANCE
            } else {
                1e-4
            }
        })
        .collect();
    x[own.clone()].copy_from_slice(values);
    x
}

/// A plausible value of each parameter of a form: what moves the point by some ten micrometres.
fn plausible(form: &Form, robot: &RobotModel) -> Vec<f64> {
    let specs = form.parameters(robot);
    let sized = specs.iter().enumerate().map(|(k, spec)| {
        let size = match spec.unit {
            Unit::RadianPerNewtonMetre => COMPLIANCE,
            _ if spec.tolerance > 1e3 => 1.0,
            _ => 1e-3 * spec.tolerance,
        };
        (0.5 + fixture::spread(k, 11)) * size
    });
    sized.collect()
}

#[test]
fn a_form_without_size_moves_nothing_and_its_partials_are_central_differences() {
    let count = over_all(|survey, hypothesis| {
        let (robot, form) = (survey.robot, &hypothesis.form);
        let (stack, range) = stack(robot, form, false);
        let without = EffectStack::new(robot, setting().base, {
            let names = ["joint_compliance", "joint_offset"];
            names
                .map(|name| arm_effect(name, &setting()).unwrap())
                .into()
        });
        let none = at(&stack, &range, &vec![0.0; range.len()]);
        let bare: Vec<f64> = none[..range.start].to_vec();
        let values = plausible(form, robot);
        let x = at(&stack, &range, &values);
        let (mut scratch, mut other) = (stack.scratch(robot), without.scratch(robot));
        for row in LOOKED_AT {
            let nominal = without.point(robot, survey.data, row, &bare, &mut other);
            let point = stack.point(robot, survey.data, row, &none, &mut scratch);
            assert!(
                (point - nominal).norm() < 1e-12,
                "{form:?} moves the point without a size"
            );
            let mut partials = vec![Vector3::zeros(); x.len()];
            stack.derivatives(robot, survey.data, row, &x, &mut scratch, |k, d| {
                partials[k] += d
            });
            for (k, value) in range.clone().zip(&values) {
                let mut moved = x.clone();
                moved[k] = x[k] + value;
                let plus = stack.point(robot, survey.data, row, &moved, &mut scratch);
                moved[k] = x[k] - value;
                let minus = stack.point(robot, survey.data, row, &moved, &mut scratch);
                let difference = (plus - minus) / (2.0 * value);
                // Torques move with the deflection: second order. Below a nanometre a difference of points is rounding.
                let tolerance = 1e-10 / value.abs() + 1e-2 * difference.norm();
                assert!(
                    (difference - partials[k]).norm() < tolerance,
                    "{form:?}: {difference} against {}",
                    partials[k]
                );
            }
        }
    });
    assert!(count > 1500, "only {count} forms");
    println!("{count} forms on {} arms", fixture::all().len());
}

#[test]
fn the_order_of_forms_is_irrelevant() {
    over_all(|survey, hypothesis| {
        let (robot, form) = (survey.robot, &hypothesis.form);
        let values = plausible(form, robot);
        let ends = [false, true].map(|first| {
            let (stack, range) = stack(robot, form, first);
            let x = at(&stack, &range, &values);
            stack.point(
                robot,
                survey.data,
                LOOKED_AT[2],
                &x,
                &mut stack.scratch(robot),
            )
        });
        assert!((ends[0] - ends[1]).norm() < 1e-12, "{form:?}");
    });
}

#[test]
fn a_form_is_the_same_after_it_was_stored_and_its_neighbours_are_of_its_kind() {
    over_all(|survey, hypothesis| {
        let form = &hypothesis.form;
        let text = serde_json::to_string(form).unwrap();
        let read: Form =
            serde_json::from_str(&text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(read, *form, "{text}");
        assert_eq!(serde_json::to_string(&read).unwrap(), text);
        for near in form.near(survey, 0) {
            assert_eq!(
                (near.name(), near.place()),
                (form.name(), form.place()),
                "{text}"
            );
            assert_ne!(near, *form, "{text} is its own neighbour");
            assert_eq!(
                near.parameters(survey.robot).len(),
                form.parameters(survey.robot).len()
            );
        }
    });
}

#[test]
fn a_form_has_named_numbers_a_place_variables_a_cause_and_a_sentence() {
    let mut places = BTreeSet::new();
    over_all(|survey, hypothesis| {
        let form = &hypothesis.form;
        let specs = form.parameters(survey.robot);
        assert!(!specs.is_empty(), "{form:?}");
        let names: BTreeSet<&str> = specs.iter().map(|spec| spec.name.as_str()).collect();
        assert_eq!(
            names.len(),
            specs.len(),
            "{form:?} has two numbers of one name"
        );
        for spec in &specs {
            starts_with(
                &spec.name,
                &format!("{}.{}", form.name(), form.place().tag()),
            );
            assert!(spec.tolerance > 0.0 && spec.tolerance.is_finite());
            assert_eq!(spec.place, form.place());
        }
        let variables: Vec<String> = form.variables().iter().map(ToString::to_string).collect();
        assert!(
            !variables.is_empty() && variables.iter().all(|name| !name.is_empty()),
            "{form:?}"
        );
        places.insert(form.place());
        let numbers = numbers_of(form, survey.robot);
        let summary = Summary {
            place: form.place(),
            forms: std::slice::from_ref(form),
            parameters: &numbers,
            clock: Clock::Seconds { first: 0.0 },
        };
        let sentence = cause(form.name()).unwrap().sentence(&summary);
        assert!(sentence.len() > 20, "{sentence}");
    });
    for place in [Place::Base, Place::Tool, Place::Tracker, Place::Recording] {
        assert!(places.contains(&place), "nothing sits at the {place}");
    }
}

fn numbers_of(form: &Form, robot: &RobotModel) -> Vec<ParameterEstimate> {
    let estimate = |spec: ParameterSpec| ParameterEstimate {
        name: spec.name,
        form: 0,
        value: 1.5,
        unit: people(spec.unit).1,
        sigma: None,
    };
    form.parameters(robot).into_iter().map(estimate).collect()
}

/// A sentence with `#` for every number.
fn without_numbers(sentence: &str) -> String {
    let mut out = String::new();
    let mut before = ' ';
    for (i, letter) in sentence.char_indices() {
        let next = sentence[i + letter.len_utf8()..]
            .chars()
            .next()
            .unwrap_or(' ');
        let sign = letter == '-' && before == ' ' && next.is_ascii_digit();
        let inside = before == '#'
            && (letter == '.' || letter == 'e' || letter == '-')
            && (next.is_ascii_digit() || next == '-');
        if letter.is_ascii_digit() || sign || inside {
            if before != '#' {
                out.push('#');
            }
            before = '#';
        } else {
            out.push(letter);
            before = letter;
        }
    }
    out
}

#[test]
fn every_sentence_is_as_it_was_read() {
    let mut messages: BTreeSet<String> = BTreeSet::new();
    over_all(|survey, hypothesis| {
        let form = &hypothesis.form;
        let numbers = numbers_of(form, survey.robot);
        for clock in [Clock::Seconds { first: 0.0 }, Clock::Rows] {
            let summary = Summary {
                place: form.place(),
                forms: std::slice::from_ref(form),
                parameters: &numbers,
                clock,
            };
            messages.insert(format!(
                "{}: {}",
                form.name(),
                without_numbers(&form.cause().sentence(&summary))
            ));
        }
    });
    let printed: String = messages.into_iter().map(|line| line + "\n").collect();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/it/forms/sentences.txt");
    if std::env::var_os("CALIB_UPDATE").is_some() {
        std::fs::write(path, &printed).unwrap();
    }
    assert!(
        printed == std::fs::read_to_string(path).unwrap(),
        "CALIB_UPDATE=1 cargo test --test it forms writes {path}; read what is new there"
    );
}

#[test]
fn a_joint_that_slides_errs_at_millimetres_and_has_no_turns() {
    let robot = RobotModel::new(fixture::on_track());
    let data = data(&robot, false);
    let (rows, torque) = ((0..data.rows()).collect::<Vec<_>>(), torques(&robot, &data));
    let compliance = vec![COMPLIANCE; robot.joints()];
    let survey = Survey::new(&robot, &data, &rows, &torque, &compliance);
    let named: BTreeSet<String> = CAUSES
        .iter()
        .flat_map(|cause| cause.propose(&survey))
        .filter(|hypothesis| hypothesis.form.place() == Place::Joint(0))
        .map(|hypothesis| hypothesis.form.name().to_string())
        .collect();
    assert_eq!(named, BTreeSet::from(["zero_shift".to_string()]));
    let by_length = |joint: usize| {
        let all = unnamed(&survey)
            .into_iter()
            .map(|hypothesis| hypothesis.form);
        let mut proposals = all.filter(move |form| {
            form.term()
                .is_some_and(|term| term.motion() == Motion::Joint { joint })
        });
        proposals.all(|form| {
            form.parameters(&robot)
                .iter()
                .all(|spec| spec.unit == Unit::Millimetre)
        })
    };
    assert!(by_length(0) && !by_length(1));
}

#[test]
fn every_cause_is_listed_once_and_described() {
    let mut seen = BTreeSet::new();
    for cause in CAUSES {
        let about = cause;
        assert!(seen.insert(about.name), "{} is listed twice", about.name);
        assert!(
            [
                about.place,
                about.formula,
                about.size,
                about.confounded,
                about.needs
            ]
            .iter()
            .all(|words| !words.is_empty())
        );
        if let Some(effect) = cause.arm_effect(&setting()) {
            assert_eq!(effect.name(), about.name);
        }
    }
}

#[test]
fn a_burden_is_that_of_the_forms_alone() {
    over_all(|survey, hypothesis| {
        let form = &hypothesis.form;
        let mut load_correction = LoadCorrection::new(survey.joints());
        form.load_correction(
            survey.data.q(7),
            10.0,
            &plausible(form, survey.robot),
            &mut load_correction,
        );
        let none = LoadCorrection::new(survey.joints());
        assert_eq!(
            format!("{load_correction:?}") != format!("{none:?}"),
            form.is_of_torque_model(),
            "{form:?}"
        );
    });
}

#[test]
fn only_a_coefficient_of_the_load_itself_is_per_newton_metre() {
    let robot = RobotModel::new(fixture::offset_wrist());
    let unit = |basis: Basis| {
        let law =
            Law::of(Variable::Approach { joint: 1 }).times(Variable::Load { joint: 1 }, basis);
        Form::from(Term::new(&Unknown, Motion::Joint { joint: 1 }, law)).parameters(&robot)[0].unit
    };
    assert_eq!(unit(Basis::PROPORTIONAL), Unit::RadianPerNewtonMetre);
    assert_eq!(
        unit(Basis::Series {
            low: -10.0,
            high: 10.0,
            count: 4
        }),
        Unit::Radian
    );
    assert_eq!(
        unit(Basis::Linear {
            zero: 5.0,
            per: 10.0
        }),
        Unit::Radian
    );
}
