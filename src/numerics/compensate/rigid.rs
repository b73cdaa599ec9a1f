//! The rigid part of an identified model as a robot description of its own: what other programs can take over.

use super::arm::IdentifiedArm;
use super::solve::{Chain, parts};
use crate::description::RobotDescription;
use crate::effect::{Place, names};
use crate::estimate::Model;
use crate::robot::{Measurements, RobotModel};
use nalgebra::{Matrix3, Vector3};

/// Effects that a description holds.
pub const RIGID: [&str; 4] = [
    names::BASE_FRAME,
    names::TOOL_OFFSET,
    names::LINK_GEOMETRY,
    names::JOINT_OFFSET,
];

/// What a rigid description leaves out.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Canonical name of the effect.
    pub effect: String,
    /// Where it acts.
    pub place: Place,
    /// What the point moves without it, m, rms and at most, over the poses.
    pub rms: f64,
    /// Largest displacement over the rows, m.
    pub most: f64,
}

/// The robot with the identified geometry in place of the nominal; base frame as identified.
pub fn rigid(model: &Model) -> RobotDescription {
    let kept = |effect: &str| RIGID.contains(&effect);
    let arm = IdentifiedArm::new(only(model, |effect, _| kept(effect)), None);
    let nominal = &model.robot;
    let mut reach = arm.reach();
    let tool = reach.place(&vec![0.0; nominal.joints()]);
    let mut out = nominal.description().clone();
    for (j, (joint, velocity)) in out.joints.iter_mut().zip(reach.velocities()).enumerate() {
        let (v, w) = parts(velocity);
        if nominal.is_revolute(j) {
            // The axis is placed by its point that is nearest to the nominal one.
            let near = tool.translation + w.cross(&v);
            joint.axis = w.into();
            joint.point = (near + w * w.dot(&(nominal.point(j) - near))).into();
        } else {
            joint.axis = v.into();
        }
    }
    out.tool = tool.translation.into();
    let rotation: &Matrix3<f64> = &tool.rotation;
    out.tool_rotation = [0, 1, 2].map(|i| [0, 1, 2].map(|k| rotation[(i, k)]));
    out
}

/// The model with the parameters that `keep` refuses (by effect and place) at zero.
fn only(model: &Model, keep: impl Fn(&str, Place) -> bool) -> Model {
    let mut out = model.clone();
    let specs = model.stack.specs();
    for (effect, range) in model.stack.effects() {
        for k in range.filter(|k| !keep(effect.name(), specs[*k].place)) {
            out.x[k] = 0.0;
        }
    }
    out
}

/// Every effect but those `carried` and where the base stands, at every place, with what it does to the point over the rows of `data`; the
/// largest first.
pub fn left_out(model: &Model, data: &Measurements, carried: &[&str]) -> Vec<LeftOut> {
    let whole = model.predict(data);
    let specs = model.stack.specs();
    let mut places: Vec<(String, Place)> = Vec::new();
    for (effect, range) in model.stack.effects().filter(|(effect, _)| {
        effect.name() != names::BASE_FRAME && !carried.contains(&effect.name())
    }) {
        for k in range.filter(|k| model.x[*k] != 0.0) {
            let key = (effect.name().to_string(), specs[k].place);
            if !places.contains(&key) {
                places.push(key);
            }
        }
    }
    let mut out: Vec<LeftOut> = (places.into_iter())
        .map(|(effect, place)| {
            let without = only(model, |e, p| e != effect || p != place).predict(data);
            let (rms, most) = apart(whole.iter().zip(&without).map(|(a, b)| (a - b).norm()));
            LeftOut {
                effect,
                place,
                rms,
                most,
            }
        })
        .collect();
    out.sort_by(|a, b| b.rms.total_cmp(&a.rms));
    out
}

/// Rms and maximum (m) of how far `description` puts what the rows of `data` measured from where the model does.
pub fn distance(model: &Model, description: &RobotDescription, data: &Measurements) -> (f64, f64) {
    let nominal = &model.robot;
    let robot = RobotModel::new(description.clone());
    let body = *robot.home() * nominal.tool_at(nominal.setup().target("")).inverse();
    let base = model.base();
    let whole = model.predict(data);
    let off = |(row, point): (usize, &Vector3<f64>)| {
        let mounting = body.point(&nominal.mounting_at(data, row).translation);
        (base.point(&robot.last_body(data.q(row)).point(&mounting)) - point).norm()
    };
    apart(whole.iter().enumerate().map(off))
}

fn apart(lengths: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut sum, mut count, mut most) = (0.0, 0.0, 0.0f64);
    for length in lengths {
        (sum, count, most) = (sum + length * length, count + 1.0, most.max(length));
    }
    (
        if count > 0.0 {
            f64::sqrt(sum / count)
        } else {
            0.0
        },
        most,
    )
}
