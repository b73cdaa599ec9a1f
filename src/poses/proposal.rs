//! Poses for a robot file: the best for all parameters together, or for telling two effects apart whatever their sizes.

use super::site::{self, site};
use super::{PoseRequest, wish};
use crate::description::RobotDescription;
use crate::effect::{EffectContext, EffectStack, Load, arm_effect, identified};
use crate::error::{Error, Result};
use crate::estimate::Model;
use crate::estimate::choose::{Aim, Proposal, Score, Site, propose};
use crate::robot::{JointConvention, Measurements, PointReadings, RobotModel};
use crate::spatial::Pose;
use crate::units::Unit;
use nalgebra::Vector3;
use std::path::Path;

/// What was proposed and what for; made once, shown as text, JSON or file.
pub struct PoseProposal<'a> {
    pub(super) request: &'a PoseRequest,
    pub(super) robot: RobotDescription,
    pub(super) ranges: Vec<[f64; 2]>,
    /// A robot file knows no other counting than its own.
    pub(super) convention: JointConvention,
    pub(super) effects: Vec<&'static str>,
    /// Effects left out, with the reason.
    pub(super) left_out: Vec<(&'static str, String)>,
    /// Names and units of the stack's parameters.
    pub(super) parameters: Vec<(String, Unit)>,
    /// mm.
    pub(super) sigma: f64,
    pub(super) proposal: Proposal,
    pub(super) recorded: Option<Score>,
    pub(super) warnings: Vec<String>,
}

/// mm; where neither the request nor a recording says one.
const SIGMA: f64 = 0.02;

/// Proposes poses; `place` names the robot in errors, `pair` are two effects to separate, or none, `against` a recording to compare with.
pub fn proposal<'a>(
    request: &'a PoseRequest,
    imported: RobotDescription,
    place: &str,
    pair: &[String],
    against: Option<&Path>,
) -> Result<PoseProposal<'a>> {
    let site = site(request, &imported, place, None)?;
    let robot = RobotModel::new(imported.clone());
    let (effects, left_out) = effects(&request.effects, &robot, &site);
    let model = || model(&robot, &effects);
    let aim = match pair {
        [a, b] => Aim::Separation([a.clone(), b.clone()]),
        _ => Aim::Information,
    };
    for name in pair {
        if let Some((_, reason)) = left_out.iter().find(|(left, _)| left == name) {
            return Err(Error::spec(
                "--separate",
                format!("`{name}` cannot be separated: {reason}"),
            ));
        }
    }
    let mut recording = against
        .map(|path| site::recording(path, &imported))
        .transpose()?;
    let usual = recording
        .as_ref()
        .and_then(|(data, _)| site::usual_sigma(data));
    let shown = request
        .sigma
        .or(usual.map(|sigma| sigma * 1e3))
        .unwrap_or(SIGMA);
    let sigma = shown * 1e-3;
    // As if measured like the proposed poses: these are compared, not their instruments.
    recording
        .iter_mut()
        .for_each(|(data, _)| data.points.sigma = vec![Vector3::repeat(sigma); data.rows()]);
    let proposal = propose(model(), &site, &wish(request, aim, sigma))
        .map_err(|fault| Error::spec(place, fault))?;
    let score = |data: &Measurements| proposal.jacobian.score(&model(), data, &proposal.workspace);
    let recorded = recording.as_ref().map(|(data, _)| score(data));
    let warnings = recording
        .and_then(|(_, warning)| warning)
        .into_iter()
        .collect();
    let parameters = model()
        .stack
        .specs()
        .iter()
        .map(|spec| (spec.name.clone(), spec.unit))
        .collect();
    let ranges = site.ranges;
    let convention = JointConvention::of_the_robot_file(imported.joints.len());
    Ok(PoseProposal {
        request,
        robot: imported,
        ranges,
        convention,
        effects,
        left_out,
        parameters,
        sigma: shown,
        proposal,
        recorded,
        warnings,
    })
}

type NamedEffects = (Vec<&'static str>, Vec<(&'static str, String)>);

/// The chosen effects that poses can tell of this robot, and those left out.
fn effects(chosen: &[String], robot: &RobotModel, site: &Site) -> NamedEffects {
    let heaviest = site.payloads.iter().copied().fold(0.0, f64::max);
    let data = Measurements {
        joints: robot.joints(),
        q: vec![0.0; robot.joints()],
        points: PointReadings::new(vec![Vector3::zeros()], 0.0),
        payload: vec![heaviest],
        ..Measurements::default()
    };
    let setting = setting();
    let (mut kept, mut left) = (Vec::new(), Vec::new());
    for effect in identified().filter_map(|cause| cause.arm_effect(&setting)) {
        if chosen.is_empty() || chosen.iter().any(|name| name == effect.name()) {
            match effect.missing(robot, &data) {
                Some(reason) => left.push((effect.name(), reason)),
                None => kept.push(effect.name()),
            }
        }
    }
    (kept, left)
}

/// Whether poses can be asked for an effect of this name.
pub(super) fn is_known(effect: &str) -> bool {
    arm_effect(effect, &setting()).is_some()
}

fn setting() -> EffectContext {
    EffectContext {
        base: Pose::identity(),
        load: Load::GravityTorque,
    }
}

fn model(robot: &RobotModel, effects: &[&str]) -> Model {
    let setting = setting();
    let made = effects
        .iter()
        .filter_map(|name| arm_effect(name, &setting))
        .collect();
    Model::nominal(robot.clone(), EffectStack::new(robot, setting.base, made))
}
