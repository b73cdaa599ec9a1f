//! `unknown`: laws without a name, for what no cause of the list explains: placed and described, never christened.

use super::{
    Axes, AxisPoint, Basis, Cause, Clock, Factor, Motion, NumberSpec, Place, Polar, Summary, Term,
    Variable, names,
};
use crate::robot::RobotModel;
use crate::units::Unit;

/// Structure of no law of the list, as a cause: see [`Term::new`].
pub struct Unknown;

impl From<&Unknown> for &'static Cause {
    fn from(_: &Unknown) -> Self {
        &CAUSE
    }
}

pub(super) static CAUSE: Cause = Cause {
    name: names::UNKNOWN,
    place: "joint, link, base, tool or tracker",
    formula: "a form-free function of joints, time, payload or sight",
    confounded: "whatever is in no list",
    sentence: "{place} {law}, unnamed",
    ..Cause::PLAIN
};

/// One sigma of what is known of a coefficient before any measurement, SI.
const WIDE: f64 = 0.01;
const PER_LOAD: f64 = 1e-4;
/// The same of a curve of a joint's own angle, rad (60 arcsec): holds it down where points are sparse.
pub(super) const PLAUSIBLE: f64 = 3e-4;

/// The coefficients of a law without a name.
pub(super) fn numbers(term: &Term, robot: &RobotModel) -> Vec<NumberSpec> {
    let counted = 1..=term.law().count();
    let each = |prefixes: &[&str], unit: Unit, sigma: f64| -> Vec<NumberSpec> {
        let of_one = |prefix| {
            counted
                .clone()
                .map(move |k| (format!("{prefix}{k}"), unit, sigma))
        };
        prefixes.iter().flat_map(of_one).collect()
    };
    match term.motion() {
        Motion::Joint { .. } => match term
            .law()
            .times
            .filter(|factor| matches!(factor.variable, Variable::Load { .. }))
        {
            Some(load) if load.basis == Basis::PROPORTIONAL => {
                each(&["c"], Unit::RadianPerNewtonMetre, PER_LOAD)
            }
            Some(_) => each(&["c"], term.motion().unit(robot), PER_LOAD),
            None => each(
                &["c"],
                term.motion().unit(robot),
                if term.is_own_curve() { PLAUSIBLE } else { WIDE },
            ),
        },
        Motion::Instrument {
            reading: Polar::Range,
        } => each(&["c"], Unit::Millimetre, 1e-3),
        Motion::Instrument { .. } => each(&["c"], Unit::Radian, 1e-4),
        Motion::Axis {
            about: Some(axis), ..
        } => each(&[["a", "b"][axis.min(1)]], Unit::Radian, WIDE),
        Motion::Axis { .. } | Motion::Bend { .. } => each(&["a", "b"], Unit::Radian, WIDE),
        Motion::Links { .. } => each(&["c"], Unit::One, WIDE),
        Motion::Slide { along: true, .. } => each(&["s"], Unit::Millimetre, WIDE),
        Motion::Slide { .. } => each(&["u", "v"], Unit::Millimetre, WIDE),
        Motion::Coupled { .. } => each(&["c"], term.motion().unit(robot), WIDE),
        motion => {
            let numbers = counted
                .clone()
                .flat_map(|k| motion.frame_numbers(move |axis| format!("{axis}{k}")));
            numbers.map(|(name, unit, _)| (name, unit, WIDE)).collect()
        }
    }
}

/// What tells a law without a name from others at its place: see [`Placed::variant`](super::Placed::variant).
pub(super) fn variant(term: &Term) -> String {
    let label = |variable: &Variable| match variable {
        Variable::Gravity { axis: Some(axis) } => format!("gravity_{}", ["x", "y", "z"][*axis]),
        Variable::Stretch { joint, .. } => format!("stretch_{}", joint + 1),
        Variable::Recent { joint, .. } => format!("recent_{}", joint + 1),
        Variable::Position { along } | Variable::Sighted { along } => {
            format!(
                "position_{}",
                along.map(|value| format!("{:.0}", 100.0 * value)).join("_")
            )
        }
        variable => variable.to_string().replace(' ', "_"),
    };
    let names: Vec<String> = term.law().variables().iter().map(label).collect();
    let steps = |factor: &Factor| matches!(factor.basis, Basis::Steps { .. });
    let jumps = term.law().factors().any(steps);
    let shape = match term.basis() {
        _ if jumps => "_steps".into(),
        Basis::Linear { .. } => "_line".into(),
        Basis::After { at } => format!("_after_{at:.0}"),
        _ => String::new(),
    };
    if let Motion::Instrument { reading } = term.motion() {
        return format!("{reading:?}_{}{shape}", names.join("_")).to_lowercase();
    }
    let curve = term.law().factors().any(|factor| factor.basis.is_curve());
    let moves = match term.motion() {
        Motion::Slide { along: true, .. } => "along_",
        Motion::Slide { .. } => "across_",
        Motion::Bend { .. } => "bent_",
        Motion::Axis { turning: true, .. } => "axis_turning_",
        Motion::Axis { .. } => "axis_",
        Motion::Base {
            axes: Axes::Rotation,
        } => "turned_",
        _ => "",
    };
    if !moves.is_empty() || curve && term.law().times.is_some() {
        return format!("{moves}{}{shape}", names.join("_"));
    }
    match (term.basis(), term.law().first.variable) {
        _ if jumps => format!("{}{shape}", names.join("_")),
        (_, Variable::Gravity { .. }) if curve => names.join("_"),
        (_, Variable::Gravity { .. }) => "sag".into(),
        (Basis::After { at }, Variable::Time) => format!("after_{at:.0}"),
        (Basis::Cosines { .. }, Variable::Time) if term.law().times.is_none() => "time".into(),
        (_, Variable::Temperature) if curve => "warm_curve".into(),
        (_, Variable::Temperature) => "warm".into(),
        (_, Variable::Payload) => "payload".into(),
        _ => format!("{}{shape}", names.join("_")),
    }
}

/// Causes that do the same as a law without a name, in a finding of the name `called`.
pub(super) fn identities(term: &Term, called: &str) -> Vec<(&'static str, Place)> {
    let place = term.motion().place();
    let joint = matches!(place, Place::Joint(_));
    match (term.basis(), term.law().first.variable) {
        (Basis::Wave { .. }, Variable::Angle { joint: by }) if term.law().times.is_none() => {
            vec![(names::AXIS_WOBBLE, Place::Joint(by))]
        }
        // No motor current tells of a pull.
        _ if called == names::CABLE_DRAG => vec![(names::UNKNOWN, place)],
        _ if joint && term.two_angles().is_some() => vec![(names::CABLE_DRAG, place)],
        _ => the_same_motion(term.motion())
            .map(|place| (names::UNKNOWN, place))
            .into_iter()
            .collect(),
    }
}

/// The other place of which a motion is: what carries a joint is the end of the link before it, and a joint that moves with another one moves.
fn the_same_motion(motion: Motion) -> Option<Place> {
    match motion {
        Motion::Axis {
            joint,
            about: None,
            turning: false,
            at: AxisPoint::Own,
        }
        | Motion::Slide { joint, .. } => joint.checked_sub(1).map(|link| Place::Links(link, link)),
        Motion::Coupled { moved, .. } => Some(Place::Joint(moved)),
        _ => None,
    }
}

/// What moves and what it follows, as a place does it: `tilts with the angle of joint 5`; none where a finding has no such law.
pub(super) fn described(summary: &Summary) -> Option<String> {
    let mut terms = summary.terms(names::UNKNOWN);
    let first = terms.next()?;
    let mut variables = first.law().variables();
    for variable in terms.flat_map(|term| term.law().variables()) {
        if !variables.contains(&variable) {
            variables.push(variable);
        }
    }
    Some(in_words(first, &variables, summary.clock))
}

/// What a place does by its motion.
fn verb(motion: Motion) -> &'static str {
    match motion {
        Motion::Joint { .. } => "errs",
        Motion::Coupled { .. } => "moves along",
        Motion::Axis { .. } => "tilts",
        Motion::Bend { .. } => "bends",
        Motion::Links { .. } => "grows",
        Motion::Slide { .. } => "shifts",
        Motion::Base { axes } | Motion::Tracker { axes } | Motion::Tool { axes } => match axes {
            Axes::Place => "shifts",
            Axes::Rotation => "turns",
            _ => "moves",
        },
        Motion::Instrument { reading } => match reading {
            Polar::Azimuth => "errs in azimuth",
            Polar::Elevation => "errs in elevation",
            Polar::Range => "errs in range",
        },
    }
}

/// A motion with the variables that it follows.
fn in_words(term: &Term, variables: &[Variable], clock: Clock) -> String {
    let named = |variable: Variable| match variable {
        Variable::Angle { joint } => format!("the angle of joint {}", joint + 1),
        Variable::Temperature => "the warm-up".into(),
        Variable::Payload | Variable::Time | Variable::ArmLoad => {
            format!("the {}", clock.named(variable))
        }
        variable => clock.named(variable),
    };
    let only = variables.len() == 1;
    let variables: Vec<String> = variables.iter().copied().map(named).collect();
    let (verb, subject) = (verb(term.motion()), variables.join(" and "));
    match term.basis() {
        Basis::Wave { order, .. } if only => {
            format!("{verb} with {subject}, {order} times a turn")
        }
        _ => format!("{verb} with {subject}"),
    }
}
