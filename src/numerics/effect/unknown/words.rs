//! What a law without a name is a function of and how, in words.

use crate::effect::{Axes, Basis, Clock, Motion, Place, Polar, Term, Variable, figure};

/// A position or width of a joint.
fn position(q: f64, slides: bool) -> String {
    if slides { format!("{} mm", figure(1e3 * q, 0)) } else { format!("{:.1} deg", q.to_degrees()) }
}

/// A law as a function of what and how; `slides` where a joint errs by a length.
pub(super) fn in_words(term: &Term, slides: bool, clock: Clock) -> String {
    let variables: Vec<String> = term.law().variables().into_iter().map(|variable| clock.named(variable)).collect();
    let of = variables.join(" and ");
    if let Motion::Instrument { of: read } = term.motion() {
        let read = match read {
            Polar::Azimuth => "azimuths",
            Polar::Elevation => "elevations",
            Polar::Range => "ranges",
        };
        return match term.basis() {
            Basis::Sway { period } => format!("its {read} swing slowly with a period of {}", clock.span(period)),
            _ => format!("its {read} err with the {of}"),
        };
    }
    let over = if clock == Clock::Rows { "over the recording's rows" } else { "with time" };
    match (term.basis(), term.law().first.of) {
        (Basis::Bump { centre, width }, _) => {
            format!("local bump at {}, width {}", position(centre, slides), position(width, slides))
        }
        (Basis::Rise { centre, width }, _) => {
            format!("step at {} within {}", position(centre, slides), position(width, slides))
        }
        (Basis::Hinge { from, upwards }, _) => {
            let side = if upwards { "above" } else { "below" };
            format!("grows with {of} {side} {}, nothing on the other side", position(from, slides))
        }
        (Basis::Wave { .. }, _) if term.law().times.is_some() => format!("product of functions of {of}"),
        (Basis::Wave { order, .. }, _) => format!("periodic in {of}, {order} a turn"),
        (Basis::Sway { period }, _) => {
            let turns = term.motion() == Motion::Base { axes: Axes::Rotation };
            format!("{} slowly with a period of {}", if turns { "rocks" } else { "sways" }, clock.span(period))
        }
        (Basis::Creep { exponent, .. }, _) if (exponent - 1.0).abs() < 0.3 => format!("creeps steadily {over}"),
        (Basis::Creep { exponent, .. }, _) => {
            format!("creeps {over}, {} and {0}", if exponent > 1.0 { "faster" } else { "slower" })
        }
        (Basis::Sign, Variable::Gravity { axis }) => {
            let name = ["x", "y", "z"].get(axis.unwrap_or(2)).unwrap_or(&"z");
            format!("differs by which side of its {name} points down, as when a seat has play")
        }
        (_, Variable::Gravity { .. }) => "depends on the direction of gravity, as when a mounting yields".into(),
        (Basis::Settling { .. }, _) | (_, Variable::Temperature | Variable::Lagging { .. }) => match term.law().times {
            Some(times) => format!("depends on the warm-up and on {}", clock.named(times.of)),
            None => "depends on the warm-up".into(),
        },
        (_, Variable::Payload) => "differs with the payload".into(),
        _ => format!("function of {of}{}", knots_in_words(term, slides)),
    }
}

/// Where a function steps or turns; places of what the joint itself does.
fn knots_in_words(term: &Term, slides: bool) -> String {
    let knots = term.law().factors().find_map(|factor| match factor.basis {
        Basis::Steps { knots } => Some(("steps", knots.all().to_vec(), factor.of)),
        Basis::Corners { knots } => Some(("turns", knots.inner().to_vec(), factor.of)),
        _ => None,
    });
    let Some((does, knots, of)) = knots else { return String::new() };
    let own = match of {
        Variable::Angle { joint } | Variable::Move { joint } => term.motion().place() == Place::Joint(joint),
        Variable::Stretch { joint, .. } | Variable::Recent { joint, .. } => term.motion().place() == Place::Joint(joint),
        _ => false,
    };
    let places: Vec<String> = knots.iter().map(|at| position(*at, slides)).collect();
    if own { format!(" that {does} at {}", places.join(" and ")) } else { format!(" that {does}") }
}
