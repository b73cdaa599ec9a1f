//! What identifications and diagnoses say of rows in which a socket, plane or sphere holds the target: how well they close, which rows stand
//! out, and what such data say of the scale of the arm.

use crate::Context;
use crate::effect::names;
use crate::error::{counted, first_of};
use crate::estimate::{Model, ParameterStatus, Session, reseated, scale};
use crate::observation::contacts;
use crate::table::Recording;
use calib_numerics::robot::Shape;
use nalgebra::Vector3;

/// A row farther off than so many standard deviations is named.
const FAR: f64 = 4.0;
/// And by so many more for each further axis.
const MORE: f64 = 0.25;
/// Rows of one name that stand off together in a row are an event from so many on.
const TOGETHER: usize = 3;
/// Links that differ by so much more than their priors say are named.
const NAMED_BEYOND: f64 = 1.05;
/// A scale that is known so much better where links err independently is stated too.
const LEANING: f64 = 0.95;
/// Weak directions that are named.
const NAMED: usize = 4;
/// What the data know hardly better than the prior.
const CARRIED: f64 = 0.7;

/// Notes what a fit to such rows shows; nothing where no row is held by a contact.
pub(super) fn note(context: &Context, session: &Session, recording: &Recording) {
    let Session {
        data,
        rows,
        model,
        fitted,
    } = *session;
    if !rows.iter().any(|row| contacts(data, *row).next().is_some()) {
        return;
    }
    note_scale(context, session);
    context.warn_each(events(session, recording));
    let is_weak = |k: &usize, prior: f64| matches!(fitted.statuses[*k], ParameterStatus::Free(sigma) if sigma > CARRIED * prior);
    let checks = fitted.prior_checks.iter();
    let weak = checks.filter(|(k, check)| is_weak(k, check.prior.sigma));
    let weak: Vec<&str> = weak.map(|(k, _)| &*model.stack.specs()[*k].name).collect();
    if !weak.is_empty() {
        let shown = first_of(&weak, NAMED);
        context.note(format!(
            "carried by their priors, hardly by the data: {shown} (table parameters)"
        ));
    }
}

fn note_scale(context: &Context, session: &Session) {
    let Session {
        data,
        rows,
        model,
        fitted,
    } = *session;
    let Some(scale) = scale(model, data, rows, fitted.covariance.as_ref()) else {
        return;
    };
    let known = match (scale.by_length, scale.by_priors) {
        (true, false) => "by the lengths that were given",
        (true, true) => "by the lengths that were given and the priors of the links",
        (false, true) => "by the priors of the links alone: no length was given",
        (false, false) => {
            context.warn(
                "the scale of the arm is not observable: no length was given, so that arm, ball and fixtures may all be larger or \
                 smaller together. Say `distances: [{between: [.., ..], mm: .., sigma: ..}]` or the size of a sphere",
            );
            return;
        }
    };
    match scale.sigma {
        Some(sigma) => {
            let beyond = match scale.beyond > NAMED_BEYOND {
                true => format!(
                    "; links differ {:.1} times as much as their priors say, and so much wider it is stated",
                    scale.beyond
                ),
                false => String::new(),
            };
            let apart = match scale.independent.filter(|independent| *independent < LEANING * sigma) {
                Some(independent) => format!(", or to {independent:.1e} if no two links lean the same way"),
                None => String::new(),
            };
            context.note(format!(
                "the scale of the arm is known to {:.1e} (one sigma) {known}: {:.2} mm at {:.0} mm from the base{apart}{beyond}",
                sigma,
                1e3 * sigma * scale.reach,
                1e3 * scale.reach
            ));
        }
        None => context.note(format!("all rows close at one place: what is known of the scale of the arm, {known}, cannot be stated")),
    }
}

/// Events at ball and fixtures in the rows of a recording, a sentence each: the ball was put back elsewhere, rows do not close.
pub(super) fn events(session: &Session, recording: &Recording) -> Vec<String> {
    let rows = session.rows.iter().copied();
    let held: Vec<usize> = rows
        .filter(|row| contacts(session.data, *row).next().is_some())
        .collect();
    if held.is_empty() {
        return Vec::new();
    }
    let put_back = put_back(session, recording, &held).into_iter();
    put_back.chain(far(session, recording)).collect()
}

fn put_back(session: &Session, recording: &Recording, held: &[usize]) -> Option<String> {
    let Session {
        data,
        model,
        fitted,
        ..
    } = *session;
    let stated = |row: &usize| {
        let first = contacts(data, *row).next();
        first.map_or(0.0, |(_, reading)| reading.sigma)
    };
    let sigma = (held.iter().map(|row| stated(row).powi(2)).sum::<f64>() / held.len() as f64)
        .sqrt()
        .hypot(fitted.excess_sigma);
    let found = reseated(model, data, held, sigma)?;
    Some(format!(
        "from {} on the ball sits elsewhere on the tool, by {:.2} mm or more ({:.0} standard errors): was it taken off? Name it there as \
         another `target`, and each is placed on its own",
        recording.point_id[found.row],
        1e3 * found.shift,
        found.statistic
    ))
}

/// A row that does not close: its name, place in the recording, how far off (m).
struct Far {
    row: usize,
    fixture: String,
    off: f64,
    other: Option<String>,
}

/// Names the rows that the model does not explain; they are down-weighted where they were fitted.
fn far(session: &Session, recording: &Recording) -> Option<String> {
    let Session {
        data,
        model,
        fitted,
        ..
    } = *session;
    let predicted = model.predict(data);
    let errors = model.row_errors(data);
    let places = places(model);
    let mut far: Vec<Far> = Vec::new();
    for (row, error) in errors.iter().enumerate() {
        let Some((kind, reading)) = contacts(data, row).next() else {
            continue;
        };
        let axes = kind.about().axes as f64;
        let sigma = reading.sigma.hypot(fitted.excess_sigma);
        let limit = (FAR + MORE * (axes - 1.0)) * sigma;
        if error.length < limit {
            continue;
        }
        let near = |(name, place): &&(String, Vector3<f64>)| {
            *name != reading.anchor
                && (predicted[row] - place).norm() < limit.min(0.3 * error.length)
        };
        let other = places.iter().find(near).map(|(name, _)| name.clone());
        far.push(Far {
            row,
            fixture: reading.anchor.into(),
            off: error.length,
            other,
        });
    }
    if far.is_empty() {
        return None;
    }
    let texts: Vec<String> = far
        .chunk_by(|a, b| a.row + 1 == b.row && a.fixture == b.fixture && a.other == b.other)
        .map(|run| run_text(run, recording))
        .collect();
    let (rows, they_are) = match far.len() {
        1 => ("1 row does".to_string(), "is"),
        count => (format!("{count} rows do"), "are"),
    };
    let texts = texts.join("; ");
    Some(format!(
        "{rows} not close within their noise, and {they_are} down-weighted: {texts}"
    ))
}

fn run_text(run: &[Far], recording: &Recording) -> String {
    let id = |far: &Far| recording.point_id[far.row].as_str();
    let most = 1e3 * run.iter().map(|far| far.off).fold(0.0, f64::max);
    let (first, last) = (&run[0], &run[run.len() - 1]);
    let who = match run.len() {
        1 => id(first).to_string(),
        rows => format!("{} to {} ({})", id(first), id(last), counted(rows, "row")),
    };
    let why = match &first.other {
        Some(other) => format!(", where `{other}` is"),
        None if run.len() >= TOGETHER => ": ball or fixture moved there".to_string(),
        None => String::new(),
    };
    format!("{who} up to {most:.2} mm{why}")
}

fn places(model: &Model) -> Vec<(String, Vector3<f64>)> {
    let setup = model.robot.setup();
    let first = model.stack.parameters_of(names::ANCHOR).next();
    let first = first.unwrap_or_default();
    let anchors = setup.anchors.iter().enumerate();
    let all = anchors.filter(|(_, anchor)| anchor.shape == Shape::Point);
    let place = |(number, anchor): (usize, &calib_numerics::robot::Anchor)| {
        let at = first + setup.first_of_anchor(number);
        let shift = model.x.get(at..at + 3);
        let shift = shift.map_or_else(Vector3::zeros, Vector3::from_column_slice);
        (anchor.name.clone(), anchor.place + shift)
    };
    all.map(place).collect()
}
