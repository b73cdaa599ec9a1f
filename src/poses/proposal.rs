//! Poses for a robot file: the best for all parameters together, or for telling two effects apart whatever their sizes.
//!
//! What the proposed poses promise, as a short table and as JSON.

use crate::description::RobotDescription;
use crate::effect::{EffectContext, EffectStack, Load, arm_effect, identified};
use crate::error::{Error, Result};
use crate::estimate::Model;
use crate::estimate::choose::{Aim, Proposal, Score, Site, median, propose};
use crate::poses::site::{self, site};
use crate::poses::{Drive, PoseAnswer, PoseRequest, drive, wish};
use crate::robot::{JointConvention, Measurements, PointReadings, RobotModel};
use crate::spatial::Pose;
use crate::text::filled;
use crate::units::Unit;
use minijinja::context;
use minijinja::value::Serde;
use nalgebra::Vector3;
use serde_json::json;
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

impl PoseAnswer for PoseProposal<'_> {
    fn drive(&self) -> Option<Drive<'_>> {
        let Proposal {
            poses, direction, ..
        } = &self.proposal;
        Some(Drive {
            robot: &self.robot,
            ranges: &self.ranges,
            poses,
            direction,
            convention: &self.convention,
        })
    }

    fn text(&self) -> String {
        text(self)
    }

    fn document(&self) -> serde_json::Value {
        document(self)
    }

    fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

/// Proposed poses, the median random set, the recording.
fn sets(work: &PoseProposal) -> Vec<(String, Score)> {
    let random = &work.proposal.random;
    let middle = |value: &dyn Fn(&Score) -> f64| median(random.iter().map(value).collect());
    let usual = Score {
        points: work.proposal.score.points,
        o1: middle(&|score| score.o1),
        sigma: (0..work.proposal.jacobian.free().len())
            .map(|k| middle(&|score| score.sigma[k]))
            .collect(),
        median: middle(&|score| score.median),
        p95: middle(&|score| score.p95),
        max: middle(&|score| score.max),
    };
    let mut out = vec![
        ("proposed".into(), work.proposal.score.clone()),
        (format!("random, median of {}", random.len()), usual),
    ];
    out.extend(
        work.recorded
            .iter()
            .map(|score| ("recorded".to_string(), score.clone())),
    );
    out
}

/// Median over the parameters of a set's sigma relative to another's.
fn relative(score: &Score, to: &Score) -> f64 {
    median(
        score
            .sigma
            .iter()
            .zip(&to.sigma)
            .map(|(a, b)| a / b)
            .collect(),
    )
}

fn text(work: &PoseProposal) -> String {
    let sets = sets(work);
    let usual = sets.get(1).map(|(_, usual)| usual);
    let rows = sets.iter().map(|(name, score)| {
        let relative = usual.map_or(1.0, |usual| relative(score, usual));
        let [p95, max] = [score.p95, score.max].map(|sigma| sigma * 1e3);
        (name, score.points, score.o1, relative, p95, max)
    });
    let others = sets.iter().skip(1);
    let ratios = others.map(|(name, score)| (name, work.proposal.score.o1 / score.o1));
    let about = context! {
        of => Serde(document(work)), asked => work.parameters.len(), sigma => work.sigma.to_string(),
        width => sets.iter().map(|(name, _)| name.len()).max(), sets => Serde(rows.collect::<Vec<_>>()),
        ratios => Serde(ratios.collect::<Vec<_>>()), closing => closing(work.request),
    };
    filled(include_str!("proposal.txt"), about)
}

/// What every proposal ends with.
pub(super) fn closing(request: &PoseRequest) -> String {
    let text = "self-collision and collision with the cell are not checked: drive the poses slowly first\n";
    match &request.out {
        Some(path) => format!("{text}poses: {}\n", path.display()),
        None => format!("{text}no file was written: give --out poses.csv (or .parquet)\n"),
    }
}

fn document(work: &PoseProposal) -> serde_json::Value {
    let proposal = &work.proposal;
    let sets = sets(work);
    let name = |parameter: usize| &work.parameters[parameter].0;
    let set = |(name, score): &(String, Score)| {
        json!({
            "set": name, "points": score.points, "o1": score.o1,
            "position_sigma_median_mm": score.median * 1e3, "position_sigma_p95_mm": score.p95 * 1e3,
            "position_sigma_max_mm": score.max * 1e3,
        })
    };
    let parameters = proposal.jacobian.free().iter().enumerate().map(|(k, parameter)| {
        let (name, unit) = &work.parameters[*parameter];
        let sigma = |index: usize| sets.get(index).map(|(_, score)| unit.from_si(score.sigma[k]));
        json!({ "name": name, "unit": unit.symbol(), "sigma": sigma(0), "sigma_random": sigma(1), "sigma_recorded": sigma(2) })
    });
    let separation = proposal.separation.iter().map(|part| {
        let parameters = part.sigma.iter().map(|(parameter, sigma, random)| {
            let unit = work.parameters[*parameter].1;
            json!({
                "name": name(*parameter), "unit": unit.symbol(), "sigma": unit.from_si(*sigma), "sigma_random": unit.from_si(*random),
            })
        });
        json!({
            "effect": part.effect, "rival": part.rival, "noncentrality_over_random": part.gain,
            "parameters": parameters.collect::<Vec<_>>(),
            "imitated": part.imitated.iter().map(|parameter| name(*parameter)).collect::<Vec<_>>(),
        })
    });
    json!({
        "robot": work.robot.name,
        "seed": work.request.seed,
        "effects": work.effects,
        "left_out": work.left_out.iter().map(|(effect, reason)| json!({"effect": effect, "reason": reason})).collect::<Vec<_>>(),
        "sigma_mm": work.sigma,
        "sets": sets.iter().map(set).collect::<Vec<_>>(),
        "parameters": parameters.collect::<Vec<_>>(),
        "separation": separation.collect::<Vec<_>>(),
        "approach_visible_share": proposal.approach_seen,
        "self_collision_checked": false,
        "counting": drive::counting(&work.convention, &work.robot),
        "out": work.request.out.as_ref().map(|out| out.to_string_lossy()),
        "poses": work.drive().map_or_else(Vec::new, |poses| drive::objects(&poses)),
    })
}
