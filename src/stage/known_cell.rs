//! What is known of a cell from elsewhere where sockets, planes and spheres hold the target: lengths, sizes, places.

use crate::Context;
use crate::effect::AnchorShift;
use crate::error::{Error, Place, Result, listed};
use crate::estimate::{KnownLength, Model, Prior, align_points};
use crate::observation::only_contacts;
use crate::spatial::Pose;
use calib_numerics::robot::{Measurements, RobotModel, Shape};
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

impl KnownCell<'_> {
    /// Faults of known distances, spheres and points.
    pub fn faults(&self, at: &mut Place) {
        let is_size = |value: f64| value > 0.0 && value.is_finite();
        for (name, KnownPoint { mm, sigma }) in self.points {
            let possible = mm.iter().all(|value| value.is_finite()) && is_size(*sigma);
            at.at(format!("points.{name}")).must(
                possible,
                "expected a place and a sigma above 0, e.g. {mm: [400, 0, 50], sigma: 0.05}",
            );
        }
        for (index, KnownDistance { between, mm, sigma }) in self.distances.iter().enumerate() {
            let mut at = at.at(format!("distances[{index}]"));
            let [from, to] = between.each_ref().map(|name| name.matches('*').count());
            at.at("between").must(
                between[0] != between[1] && from <= 1 && from == to,
                "expected two different names, with one `*` in each or none, e.g. [front/0, front/1]",
            );
            at.at("mm")
                .must(is_size(*mm), "expected a distance above 0");
            at.at("sigma").must(
                is_size(*sigma),
                "expected a standard deviation above 0, e.g. 0.1",
            );
        }
        for (name, KnownSphere { diameter, sigma }) in self.spheres {
            at.at(format!("spheres.{name}")).must(
                is_size(*diameter) && is_size(*sigma),
                "expected both above 0, e.g. {diameter: 40, sigma: 0.01}",
            );
        }
    }
}

/// The robot standing where it has known points best, with all its contacts; as it is where nothing is known, or a tracker
/// says where it stands. One point shifts it, two turn it too, but not about their line.
pub(super) fn standing(
    robot: RobotModel,
    base: Pose,
    points: &BTreeMap<String, KnownPoint>,
    data: &Measurements,
    rows: &[usize],
) -> (RobotModel, Pose) {
    let setup = robot.setup();
    let pairs = points.iter().filter_map(|(name, known)| {
        let place = setup.anchors.get(setup.anchor(name)?)?.place;
        Some((place, Vector3::from(known.mm) * 1e-3))
    });
    let (from, to): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = pairs.unzip();
    if from.is_empty() || !only_contacts(data, rows) {
        return (robot, base);
    }
    let turn = match from.len() {
        1 => Rotation3::identity(),
        2 => Rotation3::rotation_between(&(from[1] - from[0]), &(to[1] - to[0]))
            .unwrap_or_else(Rotation3::identity),
        _ => Rotation3::from_matrix_unchecked(align_points(&from, &to).rotation),
    };
    let middle =
        |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
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
    let KnownCell {
        distances,
        spheres,
        points,
    } = *known;
    let setup = model.robot.setup().clone();
    let anchors = setup.anchors.iter();
    let names: Vec<&str> = anchors.map(|anchor| anchor.name.as_str()).collect();
    let wrong = |place: String, what: String| {
        let message = format!("{what}; the recording has: {}", listed(&names));
        Error::spec(format!("{}.with.{place}", context.id), message)
    };
    for (index, known) in distances.iter().enumerate() {
        let [from, to] = &known.between;
        let pairs: Vec<[usize; 2]> = match from.split_once('*').zip(to.split_once('*')) {
            None => vec![[from, to].map(|name| setup.anchor(name).unwrap_or(usize::MAX))],
            Some(((before, after), (head, tail))) => {
                let same = |name: &&str| {
                    name.strip_prefix(before)?
                        .strip_suffix(after)
                        .map(str::to_string)
                };
                let pairs = names.iter().enumerate().filter_map(|(at, name)| {
                    Some([at, setup.anchor(&format!("{head}{}{tail}", same(name)?))?])
                });
                pairs.collect()
            }
        };
        if pairs.is_empty() || pairs.as_flattened().contains(&usize::MAX) {
            let place = format!("distances[{index}].between");
            return Err(wrong(place, format!("no `{from}` and `{to}`")));
        }
        // One print at several places has one error: all pairs of a pattern together know the length as well as one.
        let sigma = 1e-3 * known.sigma * (pairs.len() as f64).sqrt();
        let lengths = pairs.into_iter().map(|between| KnownLength {
            between,
            length: 1e-3 * known.mm,
            sigma,
        });
        model.lengths.extend(lengths);
    }
    let mut believe = |parameter: String, mean: f64, sigma: f64| {
        let mut specs = model.stack.specs().iter();
        if let Some(k) = specs.position(|spec| spec.name == parameter) {
            model.known.entry(k).or_default().prior = Some(Prior { mean, sigma });
        }
    };
    for (name, known) in points {
        let mut anchors = setup.anchors.iter();
        let socket = anchors.find(|anchor| anchor.name == *name && anchor.shape == Shape::Point);
        let socket =
            socket.ok_or_else(|| wrong(format!("points.{name}"), format!("no socket `{name}`")))?;
        for (axis, ending) in ["x", "y", "z"].into_iter().enumerate() {
            let parameter = format!("{}{ending}", AnchorShift::prefix(name));
            let mean = 1e-3 * known.mm[axis] - socket.place[axis];
            believe(parameter, mean, 1e-3 * known.sigma);
        }
    }
    for (name, known) in spheres {
        let sphere = setup.anchors.iter().find(|anchor| anchor.name == *name);
        let Some(Shape::Sphere(radius)) = sphere.map(|anchor| anchor.shape) else {
            let what = format!("no sphere `{name}`");
            return Err(wrong(format!("spheres.{name}"), what));
        };
        let mean = 0.5e-3 * known.diameter - radius;
        believe(format!("anchor.{name}.radius"), mean, 0.5e-3 * known.sigma);
    }
    Ok(())
}
