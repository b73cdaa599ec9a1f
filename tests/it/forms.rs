//! The laws that every form of every cause obeys, on all fixture arms, standing and moving, with all columns that a recording may have.

use crate::fixture;
use calib::effect::{
    Basis, CAUSES, Clock, Effect, EffectContext, EffectStack, Form, Hypothesis, Law, Load, Motion, ParameterEstimate,
    ParameterSpec, Place, Summary, Survey, Term, Unknown, Variable, arm_effect, cause, hypotheses, people,
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
    let spread = |salt: usize, count: usize| (0..count).map(move |k| fixture::spread(k, salt) - 0.5);
    let q = fixture::poses(robot.description(), ROWS);
    Measurements {
        joints: n,
        q: q.clone(),
        points: PointReadings::new(q.chunks(n).map(|q| setting().base.point(&robot.forward(q).translation)).collect(), 1e-5),
        payload: (0..ROWS).map(|row| [0.0, 4.0, 10.0][row % 3]).collect(),
        current: Some(spread(3, ROWS * n).map(|value| 5.0 * value).collect()),
        direction: Some(spread(5, ROWS * n).map(f64::signum).collect()),
        velocity: moving.then(|| spread(7, ROWS * n).collect()),
        temperature: Some((0..ROWS).map(|row| 20.0 + 0.1 * row as f64).collect()),
        time: Some((0..ROWS).map(|row| 12.0 * row as f64).collect()),
        ..Measurements::default()
    }
}

fn survey_of<'a>(
    robot: &'a RobotModel,
    data: &'a Measurements,
    rows: &'a [usize],
    torque: &'a [f64],
    compliance: &'a [f64],
) -> Survey<'a> {
    Survey::new(robot, data, rows, torque, compliance)
}

fn torques(robot: &RobotModel, data: &Measurements) -> Vec<f64> {
    let mut posture = Posture::new(robot.joints());
    let mut out = Vec::new();
    let stack = EffectStack::new(robot, Pose::identity(), vec![arm_effect("joint_compliance", &setting()).expect("a cause")]);
    let mut scratch = stack.scratch(robot);
    for row in 0..data.rows() {
        let motion = stack.point_motion(robot, data, row, &vec![0.0; stack.specs().len()], &mut scratch);
        posture.clone_from(&motion.posture);
        out.extend_from_slice(&posture.torque);
    }
    out
}

fn setting() -> EffectContext {
    EffectContext { base: Pose::exp(&Twist::new(9.0, -1.0, 0.5, 0.1, -0.2, 2.0)), load: Load::GravityTorque }
}

/// Runs `law` on every hypothesis of every fixture arm; returns how many there were.
fn over_all(mut law: impl FnMut(&Survey, &Hypothesis)) -> usize {
    let mut count = 0;
    for description in fixture::all() {
        let robot = RobotModel::new(description.clone());
        let mut bare = description;
        bare.joints.iter_mut().for_each(|joint| joint.mass = None);
        for (robot, moving) in [(robot.clone(), false), (robot, true), (RobotModel::new(bare), false)] {
            let data = data(&robot, moving);
            let (rows, torque) = ((0..data.rows()).collect::<Vec<_>>(), torques(&robot, &data));
            let compliance = vec![COMPLIANCE; robot.joints()];
            let survey = survey_of(&robot, &data, &rows, &torque, &compliance);
            let all = hypotheses(&survey);
            count += all.len();
            all.iter().for_each(|hypothesis| law(&survey, hypothesis));
        }
    }
    count
}

/// The stack of yielding joints and a form, the form first or last, and the range of its parameters.
fn stack(robot: &RobotModel, form: &Form, first: bool) -> (EffectStack, std::ops::Range<usize>) {
    let setting = setting();
    let mut effects =
        vec![arm_effect("joint_compliance", &setting).expect("a cause"), arm_effect("joint_offset", &setting).expect("a cause")];
    effects.insert(if first { 0 } else { 2 }, Box::new(form.clone()));
    let stack = EffectStack::new(robot, setting.base, effects);
    let range = stack.effects().find(|(effect, _)| effect.form().is_some()).expect("the form").1;
    (stack, range)
}

/// Parameters with all joints yielding, zeros off, and those of the form at `values`.
fn at(stack: &EffectStack, own: &std::ops::Range<usize>, values: &[f64]) -> Vec<f64> {
    let mut x: Vec<f64> =
        stack.specs().iter().map(|spec| if spec.name.starts_with("joint_compliance") { COMPLIANCE } else { 1e-4 }).collect();
    x[own.clone()].copy_from_slice(values);
    x
}

/// A plausible value of each parameter of a form: what moves the point by some ten micrometres.
fn plausible(form: &Form, robot: &RobotModel) -> Vec<f64> {
    let specs = form.parameters(robot);
    let sized = specs.iter().enumerate().map(|(k, spec)| {
        let size = match spec.unit {
            Unit::RadianPerNewtonMetre => COMPLIANCE,
            _ if spec.prior_sigma > 1e3 => 1.0,
            _ => 1e-3 * spec.prior_sigma,
        };
        (0.5 + fixture::spread(k, 11)) * size
    });
    sized.collect()
}

#[test]
fn a_form_without_size_moves_nothing_and_its_partials_are_central_differences() {
    let count = over_all(|survey, hypothesis| {
        let (robot, form) = (survey.robot, &hypothesis.form);
        let (stack, own) = stack(robot, form, false);
        let without = EffectStack::new(robot, setting().base, {
            let names = ["joint_compliance", "joint_offset"];
            names.map(|name| arm_effect(name, &setting()).expect("a cause")).into()
        });
        let none = at(&stack, &own, &vec![0.0; own.len()]);
        let bare: Vec<f64> = none[..own.start].to_vec();
        let values = plausible(form, robot);
        let x = at(&stack, &own, &values);
        let (mut scratch, mut other) = (stack.scratch(robot), without.scratch(robot));
        for row in LOOKED_AT {
            let nominal = without.point(robot, survey.data, row, &bare, &mut other);
            let point = stack.point(robot, survey.data, row, &none, &mut scratch);
            assert!((point - nominal).norm() < 1e-12, "{form:?} moves the point without a size");
            let mut partials = vec![Vector3::zeros(); x.len()];
            stack.derivatives(robot, survey.data, row, &x, &mut scratch, |k, d| partials[k] += d);
            for (k, value) in own.clone().zip(&values) {
                let mut moved = x.clone();
                moved[k] = x[k] + value;
                let plus = stack.point(robot, survey.data, row, &moved, &mut scratch);
                moved[k] = x[k] - value;
                let minus = stack.point(robot, survey.data, row, &moved, &mut scratch);
                let difference = (plus - minus) / (2.0 * value);
                // Torques move with the deflection: second order. Below a nanometre a difference of points is rounding.
                let tolerance = 1e-10 / value.abs() + 1e-2 * difference.norm();
                assert!((difference - partials[k]).norm() < tolerance, "{form:?}: {difference} against {}", partials[k]);
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
            let (stack, own) = stack(robot, form, first);
            let x = at(&stack, &own, &values);
            stack.point(robot, survey.data, LOOKED_AT[2], &x, &mut stack.scratch(robot))
        });
        assert!((ends[0] - ends[1]).norm() < 1e-12, "{form:?}");
    });
}

#[test]
fn a_form_is_the_same_after_it_was_stored_and_its_neighbours_are_of_its_kind() {
    over_all(|survey, hypothesis| {
        let form = &hypothesis.form;
        let text = serde_json::to_string(form).expect("numbers and names");
        let read: Form = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(read, *form, "{text}");
        assert_eq!(serde_json::to_string(&read).expect("numbers and names"), text);
        for near in form.near(survey, 0) {
            assert_eq!((near.name(), near.place()), (form.name(), form.place()), "{text}");
            assert_ne!(near, *form, "{text} is its own neighbour");
            assert_eq!(near.parameters(survey.robot).len(), form.parameters(survey.robot).len());
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
        assert_eq!(names.len(), specs.len(), "{form:?} has two numbers of one name");
        for spec in &specs {
            assert!(spec.name.starts_with(&format!("{}.{}", form.name(), form.place().tag())), "{}", spec.name);
            assert!(spec.prior_sigma > 0.0 && spec.prior_sigma.is_finite());
            assert_eq!(spec.place, form.place());
        }
        let variables: Vec<String> = form.variables().iter().map(ToString::to_string).collect();
        assert!(!variables.is_empty() && variables.iter().all(|name| !name.is_empty()), "{form:?}");
        places.insert(form.place());
        let numbers = numbers_of(form, survey.robot);
        let summary = Summary {
            place: form.place(),
            forms: std::slice::from_ref(form),
            parameters: &numbers,
            clock: Clock::Seconds { first: 0.0 },
        };
        let coefficients = vec![0.0; specs.len()];
        for name in [form.name(), form.called(&coefficients, survey)] {
            let cause = cause(name).unwrap_or_else(|| panic!("{name} has no cause"));
            let sentence = cause.sentence(&summary);
            assert_ne!(sentence, format!("{name} at {}", form.place()), "{form:?} has no sentence of its own");
            assert!(sentence.len() > 20, "{sentence}");
        }
    });
    for place in [Place::Base, Place::Tool, Place::Tracker, Place::Recording] {
        assert!(places.contains(&place), "nothing sits at the {place}");
    }
}

fn numbers_of(form: &Form, robot: &RobotModel) -> Vec<ParameterEstimate> {
    let estimate =
        |spec: ParameterSpec| ParameterEstimate { name: spec.name, form: 0, value: 1.5, unit: people(spec.unit).1, sigma: None };
    form.parameters(robot).into_iter().map(estimate).collect()
}

/// A sentence with `#` for every number.
fn without_numbers(sentence: &str) -> String {
    let mut out = String::new();
    let mut before = ' ';
    for (i, letter) in sentence.char_indices() {
        let next = sentence[i + letter.len_utf8()..].chars().next().unwrap_or(' ');
        let sign = letter == '-' && before == ' ' && next.is_ascii_digit();
        let inside = before == '#' && (letter == '.' || letter == 'e' || letter == '-') && (next.is_ascii_digit() || next == '-');
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
fn what_rows_do_not_determine_is_held_to_what_gears_err_by() {
    let mut held: BTreeSet<String> = BTreeSet::new();
    over_all(|_, hypothesis| {
        if let Some((numbers, sigma)) = hypothesis.form.held() {
            let all = numbers.len() == hypothesis.form.term().map_or(1, |term| term.law().count());
            held.insert(format!("{} {all} {sigma:.0e}", hypothesis.form.name()));
        }
    });
    for name in ["gear_cyclic", "gear_flank", "gear_motor_cyclic", "unknown"] {
        assert!(held.contains(&format!("{name} true 1e-3")), "{name}: {held:?}");
    }
}

#[test]
fn every_sentence_is_as_it_was_read() {
    let mut said: BTreeSet<String> = BTreeSet::new();
    over_all(|survey, hypothesis| {
        let form = &hypothesis.form;
        let numbers = numbers_of(form, survey.robot);
        for clock in [Clock::Seconds { first: 0.0 }, Clock::Rows] {
            let summary = Summary { place: form.place(), forms: std::slice::from_ref(form), parameters: &numbers, clock };
            said.insert(format!("{}: {}", form.name(), without_numbers(&form.cause().sentence(&summary))));
        }
    });
    let said: String = said.into_iter().map(|line| line + "\n").collect();
    let read = include_str!("forms/sentences.txt");
    if said != read {
        let path = std::env::temp_dir().join("sentences.txt");
        std::fs::write(&path, &said).expect("a file");
        panic!("read {} and put it in place of tests/it/forms/sentences.txt if it reads well", path.display());
    }
}

#[test]
fn a_joint_that_slides_errs_at_millimetres_and_has_no_turns() {
    let robot = RobotModel::new(fixture::on_track());
    let data = data(&robot, false);
    let (rows, torque) = ((0..data.rows()).collect::<Vec<_>>(), torques(&robot, &data));
    let compliance = vec![COMPLIANCE; robot.joints()];
    let survey = survey_of(&robot, &data, &rows, &torque, &compliance);
    let mut said: BTreeSet<String> = BTreeSet::new();
    for hypothesis in hypotheses(&survey).iter().filter(|hypothesis| hypothesis.form.name() == "unknown") {
        let form = &hypothesis.form;
        let (place, numbers) = (form.place(), numbers_of(form, &robot));
        let summary = Summary { place, forms: std::slice::from_ref(form), parameters: &numbers, clock: Clock::Rows };
        let sentence = form.cause().sentence(&summary);
        let in_angles = place == Place::Joint(0) && (sentence.contains(" deg") || sentence.contains("arcsec"));
        let in_turns = sentence.contains("periodic in q1,") || sentence.contains("product of functions of q1 ");
        assert!(!in_angles && !in_turns, "{form:?}: {sentence}");
        said.insert(sentence);
    }
    let bumps = |joint: usize, width: &str| {
        let start = format!("joint {joint} has an error that no entry of the library explains: local bump at ");
        said.iter().any(|sentence| sentence.starts_with(&start) && sentence.ends_with(width))
    };
    assert!(bumps(1, " mm, width 80 mm") && bumps(2, " deg, width 9.2 deg"), "{said:?}");
}

#[test]
fn every_cause_is_listed_once_and_described() {
    let mut seen = BTreeSet::new();
    for cause in CAUSES {
        let about = cause.about();
        assert!(seen.insert(about.name), "{} is listed twice", about.name);
        assert!([about.place, about.formula, about.size, about.confounded, about.needs].iter().all(|words| !words.is_empty()));
        if let Some(effect) = cause.arm_effect(&setting()) {
            assert_eq!(effect.name(), about.name);
        }
    }
    let folder = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/src/numerics/effect")).expect("the effects' folder");
    let sources =
        folder.filter_map(|file| Some(file.ok()?.path())).filter(|path| path.extension().is_some_and(|end| end == "rs"));
    let files: Vec<String> = sources.filter_map(|path| std::fs::read_to_string(path).ok()).collect();
    let implemented: usize = files.iter().map(|text| text.matches("impl Cause for").count()).sum();
    assert_eq!(implemented, CAUSES.len(), "a cause is implemented and not listed");
}

#[test]
fn a_burden_is_that_of_the_forms_alone() {
    over_all(|survey, hypothesis| {
        let form = &hypothesis.form;
        let mut load_correction = LoadCorrection::new(survey.joints());
        form.load_correction(survey.data.q(7), 10.0, &plausible(form, survey.robot), &mut load_correction);
        let none = LoadCorrection::new(survey.joints());
        assert_eq!(format!("{load_correction:?}") != format!("{none:?}"), form.is_of_torque_model(), "{form:?}");
    });
}

#[test]
fn only_a_coefficient_of_the_load_itself_is_per_newton_metre() {
    let robot = RobotModel::new(fixture::offset_wrist());
    let unit = |basis: Basis| {
        let law = Law::of(Variable::Approach { joint: 1 }).times(Variable::Load { joint: 1 }, basis);
        Form::from(Term::new(&Unknown, Motion::Joint { joint: 1 }, law)).parameters(&robot)[0].unit
    };
    assert_eq!(unit(Basis::PROPORTIONAL), Unit::RadianPerNewtonMetre);
    assert_eq!(unit(Basis::Series { low: -10.0, high: 10.0, count: 4 }), Unit::Radian);
    assert_eq!(unit(Basis::Linear { zero: 5.0, per: 10.0 }), Unit::Radian);
}
