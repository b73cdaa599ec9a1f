//! Which poses to measure: D-optimal for the parameters that poses can tell, or T-optimal for separating two effects.
//!
//! Random allowed poses, the best of them by Fedorov's exchange, then exchanges with neighbours of what was chosen. Both aims
//! are sums of log determinants: ln |M| for D; for T, what is left of either effect's columns once the rival and all else were
//! fitted, ln |M| - ln |M without the effect|. Only seen parameters count, so redundant ones change nothing.

mod contact;
mod exchange;
mod point_jacobian;
mod site;
mod t_optimal;
mod visit_order;

pub use contact::{
    BallOffset, ContactProposal, ContactRequest, LeftOutPlace, PriorSigma, propose_contacts,
};
pub use point_jacobian::{PointJacobian, Score};
pub(crate) use site::even;
pub use site::{Circumstances, Site, spread};
pub use t_optimal::{
    Alternative, Discrimination, DiscriminationProblem, MIN_SEPARATION_L, Proposed, tell,
};

use super::model::Model;
use crate::criteria::choose::{RANDOM_SETS, WORKSPACE};
use crate::robot::{Measurements, Named};
use crate::statistics::nearest;
use exchange::{Criterion, DesignTerm};
use point_jacobian::gather;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

/// What the poses are for.
#[derive(Debug, Clone, PartialEq)]
pub enum Aim {
    /// All seen parameters, as well as possible together.
    Information,
    /// Telling these two effects apart, whatever the others do.
    Separation([String; 2]),
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct DesignRequest {
    /// What the poses are for.
    pub aim: Aim,
    /// Poses to propose.
    pub count: usize,
    /// Random poses to start from; each is a candidate once a payload.
    pub candidates: usize,
    /// Standard deviation per axis of a measured point, m.
    pub sigma: f64,
    /// The same seed gives the same poses.
    pub seed: u64,
}

/// Poses in the order of driving, and how good they are.
pub struct Proposal {
    /// Positions are the nominal robot's, in its base frame.
    pub poses: Measurements,
    /// Side from which each joint comes to rest, +1 or -1, row-major.
    pub direction: Vec<f64>,
    /// Least share, over the joints, of an error by direction of approach that no seen parameter imitates.
    pub approach_seen: f64,
    /// Parameters that poses can tell, last the effects to separate.
    pub jacobian: PointJacobian,
    /// Score of the chosen poses.
    pub score: Score,
    /// The same for random sets of as many poses.
    pub random: Vec<Score>,
    /// For each effect to separate: its non-centrality in units of the random sets' median, geometric mean over what is separated.
    pub separation: Vec<Separation>,
    /// Poses spread over the workspace, for scores of other sets.
    pub workspace: Measurements,
}

/// How well an effect is told from its rival.
pub struct Separation {
    /// Canonical name.
    pub effect: String,
    /// Canonical name.
    pub rival: String,
    /// Parameters that are separated, with their standard deviation (SI) beside the rival: proposed, and median of random sets.
    pub sigma: Vec<(usize, f64, f64)>,
    /// Parameters that the rival and the others imitate at every allowed pose.
    pub imitated: Vec<usize>,
    /// Non-centrality over that of the median random set.
    pub gain: f64,
}

/// Proposes poses for a model; fails with a sentence when no such poses are possible.
pub fn propose(model: Model, site: &Site, wish: &DesignRequest) -> Result<Proposal, String> {
    let mut drawn = site.draw(&model.robot, wish.candidates, wish.sigma, wish.seed)?;
    let workspace = site.draw(
        &model.robot,
        WORKSPACE.div_ceil(site.payloads.len()),
        wish.sigma,
        wish.seed ^ *WORKSPACE as u64,
    )?;
    enough(&drawn, wish)?;
    drawn.points.position = model.predict(&drawn);
    let all: Vec<usize> = (0..model.stack.specs().len()).collect();
    let orders: Vec<(f64, Vec<usize>)> = match &wish.aim {
        Aim::Information => vec![(1.0, all)],
        Aim::Separation(names) => {
            let (others, [a, b]) = parted(&model, names)?;
            vec![
                (2.0, [&others[..], &b, &a].concat()),
                (-1.0, [&others[..], &b].concat()),
                (-1.0, [&others[..], &a].concat()),
            ]
        }
    };
    let jacobians: Vec<(f64, PointJacobian)> = orders
        .iter()
        .map(|(weight, order)| (*weight, PointJacobian::of(&model, &drawn, order)))
        .collect();
    let Some((_, whole)) = jacobians.first() else {
        return Err("nothing to choose for".into());
    };
    check(wish, &jacobians, whole)?;
    let terms = jacobians
        .iter()
        .map(|(weight, jacobian)| DesignTerm::new(*weight, jacobian.clone(), &model, &drawn));
    let criterion = Criterion {
        terms: terms
            .collect::<Option<_>>()
            .ok_or("the candidate poses do not separate the parameters")?,
    };

    let mut draw = ChaCha8Rng::seed_from_u64(wish.seed.wrapping_add(1));
    let around = |poses: &Measurements, step| site.around(&model.robot, poses, step, &mut draw);
    let mut poses = criterion.choose(&model, &drawn, wish.count, around);
    poses = subset(&poses, &visit_order::order(&poses, &site.ranges));
    poses.points.position = model.predict(&poses);
    let whole = whole.clone();
    let (direction, approach_seen) = visit_order::approach(&model, &whole, &poses, wish.seed);

    let sets = random_sets(&drawn, wish.count, wish.seed);
    let (rows, around) = (whole.rows(&model, &drawn), whole.rows(&model, &workspace));
    let random: Vec<Score> = sets
        .par_iter()
        .map(|set| whole.score_rows(&gather(&rows, set), &around, &workspace))
        .collect();
    let score = whole.score_rows(&whole.rows(&model, &poses), &around, &workspace);
    let separation = match &wish.aim {
        Aim::Information => Vec::new(),
        Aim::Separation(names) => separations(&model, names, &drawn, &poses, &sets)?,
    };
    Ok(Proposal {
        poses,
        direction,
        approach_seen,
        jacobian: whole,
        score,
        random,
        separation,
        workspace,
    })
}

/// Fails where the candidates are few.
fn enough(drawn: &Measurements, wish: &DesignRequest) -> Result<(), String> {
    if drawn.rows() >= 2 * wish.count {
        return Ok(());
    }
    Err(format!(
        "{} candidates are few for {} poses: take at least {}",
        drawn.rows(),
        wish.count,
        20 * wish.count
    ))
}

/// Positions in the stack of an effect's parameters.
fn parameters(model: &Model, name: &str) -> Result<Vec<usize>, String> {
    let found = model
        .stack
        .effects()
        .find(|(effect, _)| effect.name() == name);
    found
        .map(|(_, range)| range.collect())
        .ok_or_else(|| format!("`{name}` is not among the effects of this model"))
}

/// All parameters but those of two effects, and those of each of the two.
fn parted(model: &Model, [a, b]: &[String; 2]) -> Result<(Vec<usize>, [Vec<usize>; 2]), String> {
    let two = [parameters(model, a)?, parameters(model, b)?];
    let is_other = |k: &usize| !two.iter().any(|one| one.contains(k));
    let others = (0..model.stack.specs().len()).filter(is_other).collect();
    Ok((others, two))
}

fn check(
    wish: &DesignRequest,
    jacobians: &[(f64, PointJacobian)],
    whole: &PointJacobian,
) -> Result<(), String> {
    let parameters = whole.free().len();
    if parameters == 0 {
        return Err("no parameter of these effects shows at the allowed poses".into());
    }
    let least = parameters.div_ceil(3);
    if wish.count < least {
        return Err(format!(
            "{} poses cannot determine {parameters} parameters: take at least {least}, better {parameters}",
            wish.count
        ));
    }
    if let Aim::Separation([a, b]) = &wish.aim {
        for ((_, without), (effect, rival)) in jacobians.iter().skip(1).zip([(a, b), (b, a)]) {
            if without.free().len() == parameters {
                return Err(format!(
                    "no allowed pose separates `{effect}` from `{rival}` and the other effects: more payloads, wider limits or fewer effects may"
                ));
            }
        }
    }
    Ok(())
}

fn separations(
    model: &Model,
    names: &[String; 2],
    drawn: &Measurements,
    poses: &Measurements,
    sets: &[Vec<usize>],
) -> Result<Vec<Separation>, String> {
    let (others, two) = parted(model, names)?;
    let mut out = Vec::new();
    for (k, effect) in names.iter().enumerate() {
        let (parameters, rivals) = (&two[k], &two[1 - k]);
        let order = [&others[..], rivals, parameters].concat();
        let jacobian = PointJacobian::of(model, drawn, &order);
        let free = jacobian.free().iter().copied();
        let separated: Vec<usize> = free.filter(|k| parameters.contains(k)).collect();
        let (log, sigma) = jacobian.remainder(&jacobian.rows(model, poses), separated.len());
        let rows = jacobian.rows(model, drawn);
        let random: Vec<(f64, Vec<f64>)> = sets
            .par_iter()
            .map(|set| jacobian.remainder(&gather(&rows, set), separated.len()))
            .collect();
        let usual = median(random.iter().map(|(log, _)| *log).collect());
        let usual_of = |i: usize| median(random.iter().map(|(_, all)| all[i]).collect());
        let rows = separated.iter().zip(&sigma).enumerate();
        let lost = parameters.iter().filter(|k| !separated.contains(k));
        out.push(Separation {
            effect: effect.clone(),
            rival: names[1 - k].clone(),
            sigma: rows
                .map(|(i, (parameter, sigma))| (*parameter, *sigma, usual_of(i)))
                .collect(),
            imitated: lost.copied().collect(),
            gain: ((log - usual) / separated.len().max(1) as f64).exp(),
        });
    }
    Ok(out)
}

/// Rows of a recording as one of their own.
pub(super) fn subset(data: &Measurements, rows: &[usize]) -> Measurements {
    let some = |all: &[f64]| {
        let width = all.len() / data.rows().max(1);
        let row = |row: &usize| all[row * width..(row + 1) * width].iter().copied();
        rows.iter().flat_map(row).collect::<Vec<f64>>()
    };
    let circumstances = data.circumstances.iter();
    Measurements {
        joints: data.joints,
        q: some(&data.q),
        points: data.points.subset(rows),
        payload: some(&data.payload),
        time: data.time.as_deref().map(some),
        temperature: data.temperature.as_deref().map(some),
        circumstances: circumstances
            .map(|(name, all)| (*name, some(all)))
            .collect(),
        direction: data.direction.as_deref().map(some),
        target: data
            .target
            .as_ref()
            .map(|all| Named::of(rows.iter().map(|row| all.name(*row)))),
        readings: data
            .readings
            .iter()
            .map(|block| block.subset(rows))
            .collect(),
        ..Measurements::default()
    }
}

/// Sets of `count` different candidates, drawn evenly.
fn random_sets(drawn: &Measurements, count: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut draw = ChaCha8Rng::seed_from_u64(seed.wrapping_add(2));
    let set = |_| {
        let mut rows: Vec<usize> = (0..drawn.rows()).collect();
        for i in 0..count {
            let other = draw.random_range(i..rows.len());
            rows.swap(i, other);
        }
        rows.truncate(count);
        rows
    };
    (0..*RANDOM_SETS).map(set).collect()
}

/// The middle value, NaN of none.
pub fn median(mut values: Vec<f64>) -> f64 {
    nearest(&mut values, 0.5).unwrap_or(f64::NAN)
}
