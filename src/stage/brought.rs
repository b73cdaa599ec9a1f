//! What identifications and diagnoses say of rows in which the target was only brought to something: how well it closes, which rows stand
//! out, and what such data tell of the scale of the arm.

use crate::effect::AnchorShift;
use crate::error::counted;
use crate::estimate::{Fitted, Model, ParameterStatus, reseated, scale};
use crate::observation::{MeasurementKind, kinds};
use crate::robot::{Measurements, Shape};
use crate::stage::Context;
use crate::table::Recording;
<<<<<<< HEAD
use nalgebra::{Rotation3, Vector3};
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

/// The known place of a socket.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownPoint {
    /// x, y, z in the frame of the cell, which is the tracker's where one was used, mm.
    pub mm: [f64; 3],
    /// The standard deviation of each, mm.
    pub sigma: f64,
}

/// What is known of a cell from elsewhere.
pub(super) struct KnownCell<'a> {
    pub distances: &'a [KnownDistance],
    pub spheres: &'a BTreeMap<String, KnownSphere>,
    pub points: &'a BTreeMap<String, KnownPoint>,
}

/// Faults of known distances, spheres and points.
pub(super) fn faults(known: &KnownCell) -> Vec<Fault> {
    let KnownCell { distances, spheres, points } = known;
    let mut faults = Vec::new();
    for (name, KnownPoint { mm, sigma }) in *points {
        if !(mm.iter().all(|value| value.is_finite()) && *sigma > 0.0 && sigma.is_finite()) {
            faults.push(Fault::new(
                format!("points.{name}"),
                "expected a place and a sigma above 0, e.g. {mm: [400, 0, 50], sigma: 0.05}",
            ));
        }
    }
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
    for (name, KnownSphere { diameter, sigma }) in *spheres {
        if !(*diameter > 0.0 && diameter.is_finite() && *sigma > 0.0 && sigma.is_finite()) {
            faults.push(Fault::new(format!("spheres.{name}"), "expected both above 0, e.g. {diameter: 40, sigma: 0.01}"));
        }
    }
    faults
}

/// The robot standing where it has known points best, with all that it was brought to; as it is where nothing is known, or a tracker
/// says where it stands. One point shifts it, two turn it too, but not about their line.
pub(super) fn standing(
    robot: RobotModel,
    base: Pose,
    points: &BTreeMap<String, KnownPoint>,
    data: &Measurements,
    rows: &[usize],
) -> (RobotModel, Pose) {
    let setup = robot.setup();
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = points
        .iter()
        .filter_map(|(name, known)| Some((setup.anchors.get(setup.anchor(name)?)?.place, Vector3::from(known.mm) * 1e-3)))
        .collect();
    if pairs.is_empty() || !only_brought(data, rows) {
        return (robot, base);
    }
    let (from, to): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = pairs.into_iter().unzip();
    let turn = match from.len() {
        1 => Rotation3::identity(),
        2 => Rotation3::rotation_between(&(from[1] - from[0]), &(to[1] - to[0])).unwrap_or_else(Rotation3::identity),
        _ => Rotation3::from_matrix_unchecked(align_points(&from, &to).rotation),
    };
    let middle = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let change = Pose::new(*turn.matrix(), middle(&to) - turn * middle(&from));
    let mut setup = setup.clone();
    for anchor in &mut setup.anchors {
        anchor.place = change.point(&anchor.place);
        if let Shape::Plane(normal) = &mut anchor.shape {
            *normal = change.rotation * *normal;
        }
    }
    (robot.measured_by(setup), change * base)
}

/// Tells the model what is known. Fails with a name that the recording does not have.
pub(super) fn apply(model: &mut Model, known: &KnownCell, context: &Context) -> Result<()> {
    let KnownCell { distances, spheres, points } = *known;
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
    for (name, known) in points {
        let socket = setup.anchors.iter().find(|anchor| anchor.name == *name && anchor.shape == Shape::Point);
        let socket = socket.ok_or_else(|| wrong(format!("points.{name}"), format!("no socket `{name}`")))?;
        for (axis, ending) in ["x", "y", "z"].into_iter().enumerate() {
            let parameter = format!("{}{ending}", AnchorShift::prefix(name));
            if let Some(k) = model.stack.specs().iter().position(|spec| spec.name == parameter) {
                let prior = Prior { mean: 1e-3 * known.mm[axis] - socket.place[axis], sigma: 1e-3 * known.sigma };
                model.known.entry(k).or_default().prior = Some(prior);
            }
        }
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
=======
use nalgebra::Vector3;
>>>>>>> sock

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
    let brought: Vec<&dyn MeasurementKind> = kinds(data).into_iter().filter(|kind| kind.is_brought()).collect();
    let own: Vec<usize> = rows.iter().copied().filter(|row| brought.iter().any(|kind| kind.axes(data, *row) > 0)).collect();
    if own.is_empty() {
        return;
    }
    note_scale(context, model, fitted, data, rows);
    events(model, fitted, data, recording, rows).into_iter().for_each(|line| context.services.warn(line));
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
pub(super) fn events(model: &Model, fitted: &Fitted, data: &Measurements, recording: &Recording, rows: &[usize]) -> Vec<String> {
    let brought: Vec<&dyn MeasurementKind> = kinds(data).into_iter().filter(|kind| kind.is_brought()).collect();
    let own: Vec<usize> = rows.iter().copied().filter(|row| brought.iter().any(|kind| kind.axes(data, *row) > 0)).collect();
    if own.is_empty() {
        return Vec::new();
    }
    let put_back = put_back(model, fitted, data, recording, &own, &brought);
    put_back.into_iter().chain(far(model, fitted, data, recording, &brought)).collect()
}

fn put_back(
    model: &Model,
    fitted: &Fitted,
    data: &Measurements,
    recording: &Recording,
    own: &[usize],
    brought: &[&'static dyn MeasurementKind],
) -> Option<String> {
    let stated = |row: &usize| brought.iter().find_map(|kind| kind.reading(data, *row)).map_or(0.0, |reading| reading.sigma);
    let sigma = (own.iter().map(|row| stated(row).powi(2)).sum::<f64>() / own.len() as f64).sqrt().hypot(fitted.excess_sigma);
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
        let Some((kind, reading)) = brought.iter().find_map(|kind| Some((kind, kind.reading(data, row)?))) else { continue };
        let axes = kind.about().axes as f64;
        let sigma = reading.sigma.hypot(fitted.excess_sigma);
        let limit = (FAR + MORE * (axes - 1.0)) * sigma;
        if error.length < limit {
            continue;
        }
        let near = |(name, place): &&(String, Vector3<f64>)| {
            *name != reading.anchor && (predicted[row] - place).norm() < limit.min(0.3 * error.length)
        };
        let other = places.iter().find(near).map(|(name, _)| name.clone());
        far.push(Far { row, fixture: reading.anchor.into(), off: error.length, other });
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
        if count == 1 { "1 row does".to_string() } else { format!("{count} rows do") },
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
fn places(model: &Model) -> Vec<(String, Vector3<f64>)> {
    let setup = model.robot.setup();
    let first = model.stack.parameters_of(AnchorShift::NAME).next().unwrap_or_default();
    let all = setup.anchors.iter().enumerate().filter(|(_, anchor)| anchor.shape == Shape::Point);
    let place = |(number, anchor): (usize, &crate::robot::Anchor)| {
        let at = first + setup.first_of_anchor(number);
        let shift = model.x.get(at..at + 3).map_or_else(Vector3::zeros, Vector3::from_column_slice);
        (anchor.name.clone(), anchor.place + shift)
    };
    all.map(place).collect()
}
