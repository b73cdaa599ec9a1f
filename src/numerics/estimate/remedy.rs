//! What would show a parameter that the data do not determine: each possible measurement is tried on the model, no rule is written down.

use super::choose::even;
use super::factor::TriangularFactor;
use super::fit::{Determined, Session};
use super::model::Model;
use super::problem::Problem;
use crate::effect::names;
use crate::robot::{Measurements, PointReadings, RobotModel};
use faer::Mat;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// What one would have to measure.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Remedy {
    /// Joints (from 0) that hardly moved; all over the ranges of all where empty.
    Move(Vec<usize>),
    /// Poses with and without the declared payload.
    Payload,
    /// A second target off the axis of the last joint.
    SecondTarget,
    /// Nothing of these: points are the same whichever of several parameters is off.
    Nothing,
}

/// So many poses are tried at least and at most, about as many as the recording has.
const FEWEST: usize = 60;
const LIMIT: usize = 300;
/// A joint that used less than this share of its range hardly moved.
const HARDLY: f64 = 0.25;
/// Distance of the second target from the last axis, m.
const OFF_AXIS: f64 = 0.1;
/// Where a target sits on a tool is known to this before any measurement, m.
const TARGET_PRIOR: f64 = 0.1;

/// What would show each parameter that a fit does not determine, by its position in the stack.
pub fn remedies(session: &Session) -> BTreeMap<usize, Remedy> {
    let Session {
        data,
        rows,
        model,
        fitted,
    } = *session;
    let candidates = fitted.free();
    let open = fitted.undetermined(model);
    if open.is_empty() || rows.is_empty() {
        return BTreeMap::new();
    }
    let excess = fitted.excess();
    let at = |model: &Model, mut data: Measurements| {
        // Points where the model has them: others would be taken for outliers.
        data.points.position = model.predict(&data);
        let rows: Vec<usize> = (0..data.rows()).collect();
        let problem = Problem::new(&data, &rows, excess);
        problem.observe(model, &candidates).factor
    };
    let recorded = session.problem().observe(model, &candidates).factor;
    let declared = model.robot.description().payload_mass;
    let usual = data.payload[rows[0]];
    let spread = at(model, poses(model, data, rows, &[usual]));
    let loaded = (declared > 0.0).then(|| at(model, poses(model, data, rows, &[0.0, declared])));
    let target = at(&off_axis(model), poses(model, data, rows, &[usual]));
    let of_tool: Vec<usize> = model.stack.parameters_of(names::TOOL_OFFSET).collect();
    let tool: Vec<bool> = candidates.iter().map(|k| of_tool.contains(k)).collect();
    let prior = model.prior_sigmas(&candidates);
    let none = vec![false; candidates.len()];
    let tried = [
        (
            Remedy::Move(lazy(model, data, rows)),
            Some(shown(&recorded, &spread, &none, &prior)),
        ),
        (
            Remedy::Payload,
            loaded.map(|loaded| shown(&recorded, &loaded, &none, &prior)),
        ),
        (
            Remedy::SecondTarget,
            Some(shown(&recorded, &target, &tool, &prior)),
        ),
    ];
    let remedy = |k: usize| {
        let at = candidates.iter().position(|other| *other == k);
        let mut shows = tried.iter().filter(|(_, shown)| {
            let shown = shown.as_ref().zip(at);
            shown.is_some_and(|(shown, at)| shown[at] != Determined::ByTolerance)
        });
        shows
            .next()
            .map_or(Remedy::Nothing, |(remedy, _)| remedy.clone())
    };
    open.into_iter().map(|k| (k, remedy(k))).collect()
}

/// How well each parameter is known with `more` rows, in which the columns `apart` are new unknowns.
fn shown(
    recorded: &TriangularFactor,
    more: &TriangularFactor,
    apart: &[bool],
    prior: &[f64],
) -> Vec<Determined> {
    let p = prior.len();
    let new: Vec<usize> = (0..p).filter(|j| apart[*j]).collect();
    let all = p + new.len();
    let mut rows = Mat::zeros(2 * p + all, all + 1);
    for j in 0..p {
        let again = new.iter().position(|other| *other == j);
        let second = again.map_or(j, |extra| p + extra);
        rows.col_as_slice_mut(j)[..=j].copy_from_slice(recorded.column(j));
        rows.col_as_slice_mut(second)[p..=p + j].copy_from_slice(more.column(j));
    }
    for j in 0..all {
        let sigma = prior.get(j).copied().unwrap_or(TARGET_PRIOR);
        rows[(2 * p + j, j)] = 1.0 / sigma;
    }
    let inverse = TriangularFactor::of(&rows).inverse();
    let known = |j: usize| match &inverse {
        Some(inverse) => Determined::of(prior[j], inverse.row_norm(j)),
        None => Determined::ByTolerance,
    };
    (0..p).map(known).collect()
}

/// Poses all over the joints' ranges under the payloads in turn.
fn poses(model: &Model, data: &Measurements, rows: &[usize], payloads: &[f64]) -> Measurements {
    let joints = data.joints;
    let count = rows.len().clamp(FEWEST, LIMIT);
    let ranges: Vec<[f64; 2]> = (0..joints)
        .map(|joint| range(model, data, rows, joint))
        .collect();
    let sigma = rows
        .iter()
        .map(|row| data.points.sigma[*row])
        .sum::<Vector3<f64>>()
        / rows.len() as f64;
    Measurements {
        joints,
        q: even(&ranges, count),
        points: PointReadings {
            position: vec![Vector3::zeros(); count],
            sigma: vec![sigma; count],
        },
        payload: (0..count).map(|i| payloads[i % payloads.len()]).collect(),
        ..Measurements::default()
    }
}

/// The limits of a joint; without any a turn of a revolute one, the range used of a prismatic one.
fn range(model: &Model, data: &Measurements, rows: &[usize], joint: usize) -> [f64; 2] {
    let limits = model.robot.description().joints[joint].limits;
    limits.unwrap_or_else(|| {
        if model.robot.is_revolute(joint) {
            [-std::f64::consts::PI, std::f64::consts::PI]
        } else {
            used(data, rows, joint)
        }
    })
}

fn used(data: &Measurements, rows: &[usize], joint: usize) -> [f64; 2] {
    let values = rows.iter().map(|row| data.q(*row)[joint]);
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
        [low.min(q), high.max(q)]
    })
}

fn lazy(model: &Model, data: &Measurements, rows: &[usize]) -> Vec<usize> {
    let hardly = |joint: &usize| {
        let ([low, high], [from, to]) =
            (used(data, rows, *joint), range(model, data, rows, *joint));
        high - low < HARDLY * (to - from)
    };
    (0..data.joints).filter(hardly).collect()
}

/// The same robot with its target moved off the last axis.
fn off_axis(model: &Model) -> Model {
    let last = model.robot.joints() - 1;
    let axis = model.robot.axis(last);
    let across = if axis.x.abs() < 0.6 {
        axis.cross(&Vector3::x())
    } else {
        axis.cross(&Vector3::y())
    };
    let mut description = model.robot.description().clone();
    let moved = Vector3::from(description.tool) + across.normalize() * OFF_AXIS;
    description.tool = moved.into();
    Model {
        robot: RobotModel::new(description),
        ..model.clone()
    }
}
