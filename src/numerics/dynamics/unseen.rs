//! What these data cannot show, a sentence each.

use super::choice::CauseChoice;
use super::sweep::SweptColumns;

/// rad over which a joint must move for its gravity to show.
const SMALL_RANGE: f64 = 0.2;
/// A coefficient whose standard deviation is above this share of the joint's largest torque is not seen.
const UNSEEN: f64 = 0.5;

/// Sentences on a set's problem.
pub(super) fn not_observable(
    choice: &CauseChoice,
    set: &[usize],
    sweep: &SweptColumns,
) -> Vec<String> {
    let scene = &choice.problem.scene;
    let mut sentences = Vec::new();
    if scene.declared.is_none() {
        sentences.push(
            "masses are identified, not declared: a wrong payload, link, torque constant or tilted base vanishes in them".into(),
        );
    }
    for joint in 0..scene.joints() {
        let (least, most) = range(&scene.position[joint]);
        let name = joint + 1;
        if most - least < SMALL_RANGE {
            sentences.push(format!(
                "joint {name}: it moves over {:.3} rad only; an offset, a cable or spring and gravity are one there",
                most - least
            ));
        }
        let (slowest, fastest) = speeds(&scene.velocity[joint], scene.sign_width);
        if fastest < 1.5 * slowest {
            sentences.push(format!("joint {name}: it moves at one speed only; viscous and Coulomb friction are one there"));
        }
    }
    for number in 0..choice.open {
        let form = choice.form(number);
        let found = set
            .iter()
            .any(|other| choice.form(*other).is_called_as(form));
        if !found && form.width == 1 && form.cause.inertial && is_unseen(choice, sweep, number) {
            sentences.push(format!(
                "{} {}: these motions do not show it",
                form.place,
                form.cause.name.replace('_', " ")
            ));
        }
    }
    sentences
}

/// Least and most.
fn range(course: &[f64]) -> (f64, f64) {
    course.iter().fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(least, most), value| (least.min(*value), most.max(*value)),
    )
}

/// Speeds below and above which a tenth of the moving rows are.
fn speeds(velocity: &[f64], width: f64) -> (f64, f64) {
    let mut moving: Vec<f64> = velocity
        .iter()
        .map(|value| value.abs())
        .filter(|speed| *speed > 2.0 * width)
        .collect();
    moving.sort_by(f64::total_cmp);
    let at = |share: f64| crate::statistics::quantile(&moving, share).unwrap_or(0.0);
    (at(0.1), at(0.9))
}

/// Whether a form as large as a good part of the joint's torque would not be noticed.
fn is_unseen(choice: &CauseChoice, sweep: &SweptColumns, number: usize) -> bool {
    let problem = choice.problem;
    let column = &problem.all.columns[problem.all.of(number).start];
    let largest = column
        .courses
        .iter()
        .flatten()
        .map(|value| value.abs())
        .fold(0.0, f64::max);
    let torque = column
        .joints
        .iter()
        .flat_map(|joint| &problem.measured[*joint])
        .map(|value| value.abs())
        .fold(0.0, f64::max);
    let mut with = sweep.clone();
    with.add(number);
    let sigma = with.covariance(&[problem.all.of(number).start])[0]
        .max(0.0)
        .sqrt();
    sigma == 0.0 || sigma * largest > UNSEEN * torque
}
