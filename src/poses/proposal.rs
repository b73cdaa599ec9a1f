//! Poses for a robot file: the best for all parameters together, or for telling two effects apart whatever their sizes.

use super::site::{self, site};
use super::{Drive, PoseAnswer, PoseRequest, closing, drive, wish};
use crate::description::RobotDescription;
use crate::effect::{EffectContext, EffectStack, Load, arm_effect, identified};
use crate::error::{Error, Result};
use crate::estimate::Model;
use crate::estimate::choose::{Aim, Proposal, Score, Site, median, propose};
use crate::robot::{JointConvention, Measurements, PointReadings, RobotModel};
use crate::spatial::Pose;
use crate::text::filled;
use minijinja::context;
use minijinja::value::Serde;
use nalgebra::Vector3;
use serde_json::json;
use std::path::Path;

/// mm; where neither the request nor a recording says one.
const SIGMA: f64 = 0.02;

/// Proposes poses; `place` names the robot in errors, `pair` are two effects to separate, or none, `against` a recording to compare with.
pub fn proposal(
    request: &PoseRequest,
    description: RobotDescription,
    place: &str,
    pair: &[String],
    against: Option<&Path>,
) -> Result<PoseAnswer> {
    let site = site(request, &description, place, None)?;
    let robot = RobotModel::new(description.clone());
    let (effects, left_out) = effects(&request.effects, &robot, &site);
    let model = || model(&robot, &effects);
    let aim = match pair {
        [a, b] => Aim::Separation([a.clone(), b.clone()]),
        _ => Aim::Information,
    };
    for name in pair {
        if let Some((_, reason)) = left_out.iter().find(|(left, _)| left == name) {
            let message = format!("`{name}` cannot be separated: {reason}");
            return Err(Error::spec("--separate", message));
        }
    }
    let recording = against.map(|path| site::recording(path, &description));
    let (mut recording, warning) = recording.transpose()?.unzip();
    let usual = recording.as_ref().and_then(site::usual_sigma);
    let usual = usual.map(|sigma| sigma * 1e3);
    let shown = request.sigma.or(usual).unwrap_or(SIGMA);
    let sigma = shown * 1e-3;
    // As if measured like the proposed poses: these are compared, not their instruments.
    if let Some(data) = &mut recording {
        data.points.sigma = vec![Vector3::repeat(sigma); data.rows()];
    }
    let proposal = propose(model(), &site, &wish(request, aim, sigma))
        .map_err(|fault| Error::spec(place, fault))?;
    let score = |data| proposal.jacobian.score(&model(), data, &proposal.workspace);
    let recorded = recording.as_ref().map(score);
    let sets = sets(&proposal, recorded);
    let drive = Drive {
        ranges: site.ranges,
        poses: proposal.poses.clone(),
        direction: proposal.direction.clone(),
        // A robot file knows no other counting than its own.
        convention: JointConvention::of_the_robot_file(description.joints.len()),
        robot: description,
    };
    let stack = model().stack;
    let (specs, free) = (stack.specs(), proposal.jacobian.free());
    let set = |(name, score): &(String, Score)| {
        json!({
            "set": name, "points": score.points, "o1": score.o1,
            "position_sigma_median_mm": score.median * 1e3, "position_sigma_p95_mm": score.p95 * 1e3,
            "position_sigma_max_mm": score.max * 1e3,
        })
    };
    let parameters = free.iter().enumerate().map(|(k, parameter)| {
        let spec = &specs[*parameter];
        let sigma = |index: usize| sets.get(index).map(|(_, score)| spec.unit.from_si(score.sigma[k]));
        json!({
            "name": spec.name, "unit": spec.unit.symbol(), "sigma": sigma(0), "sigma_random": sigma(1), "sigma_recorded": sigma(2),
        })
    });
    let separation = proposal.separation.iter().map(|part| {
        let parameters = part.sigma.iter().map(|(parameter, sigma, random)| {
            let spec = &specs[*parameter];
            let [sigma, random] = [sigma, random].map(|sigma| spec.unit.from_si(*sigma));
            json!({ "name": spec.name, "unit": spec.unit.symbol(), "sigma": sigma, "sigma_random": random })
        });
        json!({
            "effect": part.effect, "rival": part.rival, "noncentrality_over_random": part.gain,
            "parameters": parameters.collect::<Vec<_>>(),
            "imitated": part.imitated.iter().map(|parameter| &specs[*parameter].name).collect::<Vec<_>>(),
        })
    });
    let left_out = left_out
        .iter()
        .map(|(effect, reason)| json!({"effect": effect, "reason": reason}));
    let document = json!({
        "robot": drive.robot.name,
        "seed": request.seed,
        "effects": effects,
        "left_out": left_out.collect::<Vec<_>>(),
        "sigma_mm": shown,
        "sets": sets.iter().map(set).collect::<Vec<_>>(),
        "parameters": parameters.collect::<Vec<_>>(),
        "separation": separation.collect::<Vec<_>>(),
        "approach_visible_share": proposal.approach_seen,
        "self_collision_checked": false,
        "counting": drive::counting(&drive.convention, &drive.robot),
        "out": request.out.as_ref().map(|out| out.to_string_lossy()),
        "poses": drive::objects(&drive),
    });
    let usual = &sets[1].1;
    let rows = sets.iter().map(|(name, score)| {
        let [p95, max] = [score.p95, score.max].map(|sigma| sigma * 1e3);
        (
            name,
            score.points,
            score.o1,
            relative(score, usual),
            p95,
            max,
        )
    });
    let others = sets.iter().skip(1);
    let ratios = others.map(|(name, score)| (name, proposal.score.o1 / score.o1));
    let about = context! {
        of => Serde(&document), asked => specs.len(), sigma => shown.to_string(),
        width => sets.iter().map(|(name, _)| name.len()).max(), sets => Serde(rows.collect::<Vec<_>>()),
        ratios => Serde(ratios.collect::<Vec<_>>()), closing => closing(request),
    };
    Ok(PoseAnswer {
        text: filled(include_str!("proposal.txt"), about),
        document,
        drive: Some(drive),
        warnings: warning.flatten().into_iter().collect(),
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
    let all = identified().filter_map(|cause| Some((cause.name, cause.arm_effect(&setting)?)));
    for (name, effect) in all {
        if chosen.is_empty() || chosen.iter().any(|one| one == name) {
            match effect.missing(robot, &data) {
                Some(reason) => left.push((name, reason)),
                None => kept.push(name),
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

/// Proposed poses, the median random set, the recording.
fn sets(proposal: &Proposal, recorded: Option<Score>) -> Vec<(String, Score)> {
    let random = &proposal.random;
    let middle = |value: &dyn Fn(&Score) -> f64| median(random.iter().map(value).collect());
    let usual = Score {
        points: proposal.score.points,
        o1: middle(&|score| score.o1),
        sigma: (0..proposal.jacobian.free().len())
            .map(|k| middle(&|score| score.sigma[k]))
            .collect(),
        median: middle(&|score| score.median),
        p95: middle(&|score| score.p95),
        max: middle(&|score| score.max),
    };
    let sets = [
        ("proposed".into(), proposal.score.clone()),
        (format!("random, median of {}", random.len()), usual),
    ];
    let recorded = recorded.map(|score| ("recorded".to_string(), score));
    sets.into_iter().chain(recorded).collect()
}

/// Median over the parameters of a set's sigma relative to another's.
fn relative(score: &Score, to: &Score) -> f64 {
    let pairs = score.sigma.iter().zip(&to.sigma);
    median(pairs.map(|(a, b)| a / b).collect())
}
