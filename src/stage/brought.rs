//! What identifications know and say of rows in which the target was only brought to something: lengths known from elsewhere, how well
//! it closes, which rows stand out, and what such data tell of the scale of the arm.

use crate::error::{Error, Fault, Result, counted};
use crate::estimate::{Fitted, KnownLength, Model, ParameterStatus, Prior, reseated, scale};
use crate::observation::{MeasurementKind, kinds};
use crate::robot::{Measurements, Shape};
use crate::stage::Context;
use crate::table::Recording;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A distance between two sockets, planes or spheres that is known from elsewhere: a print, a gauge block, a ball bar.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownDistance {
    /// Their names in the recording, of spheres for their centres; a `*` stands in both for the same text, as of one
    /// print at several places, whose error is the same everywhere: `["*/0", "*/1"]`.
    pub between: [String; 2],
    /// The distance, mm.
    pub mm: f64,
    /// Its standard deviation, mm.
    pub sigma: f64,
}

/// The known size of a sphere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownSphere {
    /// Its diameter together with that of the ball on the tool, mm.
    pub diameter: f64,
    /// The standard deviation of that, mm.
    pub sigma: f64,
}

/// Faults of known distances and spheres.
pub(super) fn faults(distances: &[KnownDistance], spheres: &BTreeMap<String, KnownSphere>) -> Vec<Fault> {
    let mut faults = Vec::new();
    for (index, KnownDistance { between: [from, to], mm, sigma }) in distances.iter().enumerate() {
        if from == to || from.matches('*').count() > 1 || from.matches('*').count() != to.matches('*').count() {
            let message = "expected two different names, with one `*` in each or none, e.g. [front/0, front/1]";
            faults.push(Fault::new(format!("distances[{index}].between"), message));
        }
        if !(*mm > 0.0 && mm.is_finite()) {
            faults.push(Fault::new(format!("distances[{index}].mm"), "expected a distance above 0"));
        }
        if !(*sigma > 0.0 && sigma.is_finite()) {
            faults.push(Fault::new(format!("distances[{index}].sigma"), "expected a standard deviation above 0, e.g. 0.1"));
        }
    }
    for (name, KnownSphere { diameter, sigma }) in spheres {
        if !(*diameter > 0.0 && diameter.is_finite() && *sigma > 0.0 && sigma.is_finite()) {
            faults.push(Fault::new(format!("spheres.{name}"), "expected both above 0, e.g. {diameter: 40, sigma: 0.01}"));
        }
    }
    faults
}

/// Tells the model what is known. Fails with a name that the recording does not have.
pub(super) fn apply(
    model: &mut Model,
    distances: &[KnownDistance],
    spheres: &BTreeMap<String, KnownSphere>,
    context: &Context,
) -> Result<()> {
    let setup = model.robot.setup().clone();
    let names: Vec<&str> = setup.anchors.iter().map(|anchor| anchor.name.as_str()).collect();
    let there = || if names.is_empty() { "none".to_string() } else { names.join(", ") };
    let wrong = |place: String, what: String| {
        Error::spec(format!("{}.with.{place}", context.id), format!("{what}; the recording has: {}", there()))
    };
    for (index, known) in distances.iter().enumerate() {
        let [from, to] = &known.between;
        let pairs: Vec<[usize; 2]> = match from.split_once('*').zip(to.split_once('*')) {
            None => vec![[from, to].map(|name| setup.anchor(name).unwrap_or(usize::MAX))],
            Some(((before, after), (head, tail))) => {
                let same = |name: &&str| name.strip_prefix(before)?.strip_suffix(after).map(str::to_string);
                let pairs = names
                    .iter()
                    .enumerate()
                    .filter_map(|(at, name)| Some([at, setup.anchor(&format!("{head}{}{tail}", same(name)?))?]));
                pairs.collect()
            }
        };
        if pairs.is_empty() || pairs.as_flattened().contains(&usize::MAX) {
            return Err(wrong(format!("distances[{index}].between"), format!("no `{from}` and `{to}`")));
        }
        // One print at several places has one error: all pairs of a pattern together know the length as well as one.
        let (length, sigma) = (1e-3 * known.mm, 1e-3 * known.sigma * (pairs.len() as f64).sqrt());
        model.lengths.extend(pairs.into_iter().map(|between| KnownLength { between, length, sigma }));
    }
    for (name, known) in spheres {
        let sphere = setup.anchors.iter().find(|anchor| anchor.name == *name);
        let Some(Shape::Sphere(radius)) = sphere.map(|anchor| anchor.shape) else {
            return Err(wrong(format!("spheres.{name}"), format!("no sphere `{name}`")));
        };
        let parameter = format!("anchor.{name}.radius");
        if let Some(k) = model.stack.specs().iter().position(|spec| spec.name == parameter) {
            let prior = Prior { mean: 0.5e-3 * known.diameter - radius, sigma: 0.5e-3 * known.sigma };
            model.known.entry(k).or_default().prior = Some(prior);
        }
    }
    Ok(())
}

/// A row farther off than so many standard deviations is named.
const FAR: f64 = 4.0;
/// And by so many more for each further axis.
const MORE: f64 = 0.25;
/// Rows of one name that stand off together in a row are an event from so many on.
const TOGETHER: usize = 3;
/// Links that differ by so much more than their priors say are spoken of.
const TOLD_BEYOND: f64 = 1.05;
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
    let brought: Vec<&dyn MeasurementKind> = kinds(data).into_iter().filter(|kind| kind.is_brought()).collect();
    let own: Vec<usize> = rows.iter().copied().filter(|row| brought.iter().any(|kind| kind.axes(data, *row) > 0)).collect();
    if own.is_empty() {
        return;
    }
    note_scale(context, model, fitted, data, rows);
    note_reseat(context, model, fitted, data, recording, &own, &brought);
    note_far(context, model, fitted, data, recording, &brought);
    let weak: Vec<&str> = fitted
        .prior_checks
        .iter()
        .filter(|(k, check)| matches!(fitted.statuses[**k], ParameterStatus::Free(sigma) if sigma > CARRIED * check.prior.sigma))
        .map(|(k, _)| model.stack.specs()[*k].name.as_str())
        .collect();
    if !weak.is_empty() {
        let more = weak.len().saturating_sub(NAMED);
        let tail = if more > 0 { format!(" and {more} more") } else { String::new() };
        let shown = weak[..weak.len().min(NAMED)].join(", ");
        context.services.note(format!("carried by their priors, hardly by the data: {shown}{tail} (table parameters)"));
    }
}

fn note_scale(context: &Context, model: &Model, fitted: &Fitted, data: &Measurements, rows: &[usize]) {
    let Some(scale) = scale(model, data, rows, fitted.covariance.as_ref()) else { return };
    let known = match (scale.by_length, scale.by_priors) {
        (true, _) => "by the lengths that were given",
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
                true => format!("; links differ {:.1} times as much as their priors say, and so much wider it is stated", scale.beyond),
                false => String::new(),
            };
            context.services.note(format!(
                "the scale of the arm is known to {:.1e} (one sigma) {known}: {:.2} mm at {:.0} mm from the base{beyond}",
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

fn note_reseat(
    context: &Context,
    model: &Model,
    fitted: &Fitted,
    data: &Measurements,
    recording: &Recording,
    own: &[usize],
    brought: &[&'static dyn MeasurementKind],
) {
    let stated = |row: &usize| brought.iter().find_map(|kind| kind.reading(data, *row)).map_or(0.0, |reading| reading.sigma);
    let sigma = (own.iter().map(|row| stated(row).powi(2)).sum::<f64>() / own.len() as f64).sqrt().hypot(fitted.excess_sigma);
    if let Some(found) = reseated(model, data, own, sigma) {
        context.services.warn(format!(
            "from {} on the ball sits elsewhere on the tool, by {:.2} mm or more ({:.0} standard errors): was it taken off? Name it \
             there as another `target`, and each is placed on its own",
            recording.point_id[found.row],
            1e3 * found.shift,
            found.statistic
        ));
    }
}

/// A row that does not close: its name, place in the recording, how far off (m).
struct Far {
    row: usize,
    fixture: String,
    off: f64,
    other: Option<String>,
}

/// Names the rows that the model does not explain; they are down-weighted where they were fitted.
fn note_far(
    context: &Context,
    model: &Model,
    fitted: &Fitted,
    data: &Measurements,
    recording: &Recording,
    brought: &[&'static dyn MeasurementKind],
) {
    let predicted = model.predict(data);
    let errors = model.row_errors(data);
    let places = places(model);
    let mut far: Vec<Far> = Vec::new();
    for (row, error) in errors.iter().enumerate() {
        let Some((kind, reading)) = brought.iter().find_map(|kind| Some((kind, kind.reading(data, row)?))) else { continue };
        let axes = kind.about().axes as f64;
        let sigma = reading.sigma.hypot(fitted.excess_sigma);
        let limit = (FAR + MORE * (axes - 1.0)) * sigma;
        if error.length < limit {
            continue;
        }
        let near = |(name, place): &&(String, nalgebra::Vector3<f64>)| {
            *name != reading.anchor && (predicted[row] - place).norm() < limit.min(0.3 * error.length)
        };
        let other = places.iter().find(near).map(|(name, _)| name.clone());
        far.push(Far { row, fixture: reading.anchor.into(), off: error.length, other });
    }
    if far.is_empty() {
        return;
    }
    let count = far.len();
    let texts: Vec<String> = far
        .chunk_by(|a, b| a.row + 1 == b.row && a.fixture == b.fixture && a.other == b.other)
        .map(|run| run_text(run, recording))
        .collect();
    context.services.warn(format!(
        "{} not close within their noise, and {} down-weighted: {}",
        if count == 1 { "1 row does".to_string() } else { format!("{count} rows do") },
        if count == 1 { "is" } else { "are" },
        texts.join("; ")
    ));
}

fn run_text(run: &[Far], recording: &Recording) -> String {
    let id = |far: &Far| recording.point_id[far.row].as_str();
    let most = 1e3 * run.iter().map(|far| far.off).fold(0.0, f64::max);
    let (first, last) = (&run[0], &run[run.len() - 1]);
    let who = if run.len() == 1 {
        id(first).to_string()
    } else {
        format!("{} to {} ({})", id(first), id(last), counted(run.len(), "row"))
    };
    let why = match &first.other {
        Some(other) => format!(", where `{other}` is"),
        None if run.len() >= TOGETHER => ": ball or fixture moved there".to_string(),
        None => String::new(),
    };
    format!("{who} up to {most:.2} mm{why}")
}

/// Points that anchors are.
fn places(model: &Model) -> Vec<(String, nalgebra::Vector3<f64>)> {
    let setup = model.robot.setup();
    let first = model.stack.parameters_of(crate::effect::AnchorShift::NAME).next().unwrap_or_default();
    let all = setup.anchors.iter().enumerate().filter(|(_, anchor)| anchor.shape == Shape::Point);
    let place = |(number, anchor): (usize, &crate::robot::Anchor)| {
        let at = first + setup.first_of_anchor(number);
        let shift = model.x.get(at..at + 3).map_or_else(nalgebra::Vector3::zeros, nalgebra::Vector3::from_column_slice);
        (anchor.name.clone(), anchor.place + shift)
    };
    all.map(place).collect()
}
