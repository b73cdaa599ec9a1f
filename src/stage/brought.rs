//! What identifications and diagnoses say of rows in which the target was only brought to something: how well it closes, which rows stand
//! out, and what such data tell of the scale of the arm.

use crate::effect::names;
use crate::error::counted;
use crate::estimate::{Fitted, Model, ParameterStatus, reseated, scale};
use crate::observation::{MeasurementKind, kinds};
use crate::robot::{Measurements, Shape};
use crate::stage::Context;
use crate::table::Recording;
use nalgebra::Vector3;

/// A row farther off than so many standard deviations is named.
const FAR: f64 = 4.0;
/// And by so many more for each further axis.
const MORE: f64 = 0.25;
/// Rows of one name that stand off together in a row are an event from so many on.
const TOGETHER: usize = 3;
/// Links that differ by so much more than their priors say are spoken of.
const TOLD_BEYOND: f64 = 1.05;
/// A scale that is known so much better where links err independently is told too.
const LEANING: f64 = 0.95;
/// Weak directions that are named.
const NAMED: usize = 4;
/// What the data know hardly better than the prior.
const CARRIED: f64 = 0.7;

/// Tells the person what a fit to such rows shows; nothing where no row was brought to a place.
pub(super) fn note(
    context: &Context,
    model: &Model,
    fitted: &Fitted,
    data: &Measurements,
    recording: &Recording,
    rows: &[usize],
) {
    let brought: Vec<&dyn MeasurementKind> = kinds(data)
        .into_iter()
        .filter(|kind| kind.is_contact())
        .collect();
    let own: Vec<usize> = rows
        .iter()
        .copied()
        .filter(|row| brought.iter().any(|kind| kind.axes(data, *row) > 0))
        .collect();
    if own.is_empty() {
        return;
    }
    note_scale(context, model, fitted, data, rows);
    events(model, fitted, data, recording, rows)
        .into_iter()
        .for_each(|line| context.services.warn(line));
    let weak: Vec<&str> = fitted
        .prior_checks
        .iter()
        .filter(|(k, check)| matches!(fitted.statuses[**k], ParameterStatus::Free(sigma) if sigma > CARRIED * check.prior.sigma))
        .map(|(k, _)| model.stack.specs()[*k].name.as_str())
        .collect();
    if !weak.is_empty() {
        let more = weak.len().saturating_sub(NAMED);
        let tail = if more > 0 {
            format!(" and {more} more")
        } else {
            String::new()
        };
        let shown = weak[..weak.len().min(NAMED)].join(", ");
        context.services.note(format!(
            "carried by their priors, hardly by the data: {shown}{tail} (table parameters)"
        ));
    }
}

fn note_scale(
    context: &Context,
    model: &Model,
    fitted: &Fitted,
    data: &Measurements,
    rows: &[usize],
) {
    let Some(scale) = scale(model, data, rows, fitted.covariance.as_ref()) else {
        return;
    };
    let known = match (scale.by_length, scale.by_priors) {
        (true, false) => "by the lengths that were given",
        (true, true) => "by the lengths that were given and the priors of the links",
        (false, true) => "by the priors of the links alone: no length was given",
        (false, false) => {
            context.services.warn(
                "the scale of the arm is not observable: no length was given, so that arm, ball and fixtures may all be larger or \
                 smaller together. Say `distances: [{between: [.., ..], mm: .., sigma: ..}]` or the size of a sphere"
                    .into(),
            );
            return;
        }
    };
    match scale.sigma {
        Some(sigma) => {
            let beyond = match scale.beyond > TOLD_BEYOND {
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
            context.services.note(format!(
                "the scale of the arm is known to {:.1e} (one sigma) {known}: {:.2} mm at {:.0} mm from the base{apart}{beyond}",
                sigma,
                1e3 * sigma * scale.reach,
                1e3 * scale.reach
            ));
        }
        None => context
            .services
            .note(format!("all rows close at one place: what is known of the scale of the arm, {known}, cannot be stated")),
    }
}

/// What befell ball and fixtures by the rows of a recording, a sentence each: the ball was put back elsewhere, rows do not close.
pub(super) fn events(
    model: &Model,
    fitted: &Fitted,
    data: &Measurements,
    recording: &Recording,
    rows: &[usize],
) -> Vec<String> {
    let brought: Vec<&dyn MeasurementKind> = kinds(data)
        .into_iter()
        .filter(|kind| kind.is_contact())
        .collect();
    let own: Vec<usize> = rows
        .iter()
        .copied()
        .filter(|row| brought.iter().any(|kind| kind.axes(data, *row) > 0))
        .collect();
    if own.is_empty() {
        return Vec::new();
    }
    let put_back = put_back(model, fitted, data, recording, &own, &brought);
    put_back
        .into_iter()
        .chain(far(model, fitted, data, recording, &brought))
        .collect()
}

fn put_back(
    model: &Model,
    fitted: &Fitted,
    data: &Measurements,
    recording: &Recording,
    own: &[usize],
    brought: &[&'static dyn MeasurementKind],
) -> Option<String> {
    let stated = |row: &usize| {
        brought
            .iter()
            .find_map(|kind| kind.reading(data, *row))
            .map_or(0.0, |reading| reading.sigma)
    };
    let sigma = (own.iter().map(|row| stated(row).powi(2)).sum::<f64>() / own.len() as f64)
        .sqrt()
        .hypot(fitted.excess_sigma);
    let found = reseated(model, data, own, sigma)?;
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
fn far(
    model: &Model,
    fitted: &Fitted,
    data: &Measurements,
    recording: &Recording,
    brought: &[&'static dyn MeasurementKind],
) -> Option<String> {
    let predicted = model.predict(data);
    let errors = model.row_errors(data);
    let places = places(model);
    let mut far: Vec<Far> = Vec::new();
    for (row, error) in errors.iter().enumerate() {
        let Some((kind, reading)) = brought
            .iter()
            .find_map(|kind| Some((kind, kind.reading(data, row)?)))
        else {
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
    let count = far.len();
    let texts: Vec<String> = far
        .chunk_by(|a, b| a.row + 1 == b.row && a.fixture == b.fixture && a.other == b.other)
        .map(|run| run_text(run, recording))
        .collect();
    Some(format!(
        "{} not close within their noise, and {} down-weighted: {}",
        if count == 1 {
            "1 row does".to_string()
        } else {
            format!("{count} rows do")
        },
        if count == 1 { "is" } else { "are" },
        texts.join("; ")
    ))
}

fn run_text(run: &[Far], recording: &Recording) -> String {
    let id = |far: &Far| recording.point_id[far.row].as_str();
    let most = 1e3 * run.iter().map(|far| far.off).fold(0.0, f64::max);
    let (first, last) = (&run[0], &run[run.len() - 1]);
    let who = if run.len() == 1 {
        id(first).to_string()
    } else {
        format!(
            "{} to {} ({})",
            id(first),
            id(last),
            counted(run.len(), "row")
        )
    };
    let why = match &first.other {
        Some(other) => format!(", where `{other}` is"),
        None if run.len() >= TOGETHER => ": ball or fixture moved there".to_string(),
        None => String::new(),
    };
    format!("{who} up to {most:.2} mm{why}")
}

/// Points that anchors are.
fn places(model: &Model) -> Vec<(String, Vector3<f64>)> {
    let setup = model.robot.setup();
    let first = model
        .stack
        .parameters_of(names::ANCHOR)
        .next()
        .unwrap_or_default();
    let all = setup
        .anchors
        .iter()
        .enumerate()
        .filter(|(_, anchor)| anchor.shape == Shape::Point);
    let place = |(number, anchor): (usize, &crate::robot::Anchor)| {
        let at = first + setup.first_of_anchor(number);
        let shift = model
            .x
            .get(at..at + 3)
            .map_or_else(Vector3::zeros, Vector3::from_column_slice);
        (anchor.name.clone(), anchor.place + shift)
    };
    all.map(place).collect()
}
