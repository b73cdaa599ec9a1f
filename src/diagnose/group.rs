//! Which causes make up one finding: what one part of the arm does by one law, with the rest that its true shape leaves.

use super::Course;
use super::pool::Pool;
use super::state::solve;
use crate::effect::{Effect, Form, Place, Placed, Signature, Survey};
use std::collections::BTreeMap;
use std::ops::Range;

/// Positions among the chosen causes, by the effect and the place that they are called.
pub(crate) type Groups = BTreeMap<(&'static str, String), Vec<usize>>;

/// Where in the model's parameters those of each chosen cause are.
pub(crate) fn ranges(last: &Course) -> Vec<Range<usize>> {
    let rigid = last.model.stack.effects().count() - last.chosen.len();
    last.model.stack.effects().skip(rigid).map(|(_, range)| range).collect()
}

/// The chosen causes, whose positions in the pool are `set`, by finding.
pub(crate) fn groups(last: &Course, set: &[usize], pool: &Pool, survey: &Survey) -> Groups {
    let mut groups = Groups::new();
    let ranges = ranges(last);
    for (i, k) in set.iter().enumerate() {
        let form = &pool.hypotheses[*k].form;
        let values = &last.model.x[ranges[i].clone()];
        let name = match form {
            Form::JointTable(_) if is_wavy(values) => "gear_cyclic",
            Form::JointHardening(law) if law.is_lost_motion(values, survey.load(law.joint())) => "backlash",
            Form::Unknown(unknown) if unknown.is_hose() => "cable_drag",
            _ => form.name(),
        };
        groups.entry((name, form.place().to_string())).or_default().push(i);
    }
    refine(pool, &mut groups, set);
    both_angles(pool, &mut groups, set);
    wobbles(pool, &mut groups, set);
    // One wind-up a joint: a compliance beside a hardening of the same joint is part of it.
    let hard: Vec<String> = groups.keys().filter(|key| key.0 == "joint_hardening").map(|key| key.1.clone()).collect();
    for place in hard {
        if let Some(more) = groups.remove(&("joint_compliance", place.clone())) {
            groups.entry(("joint_hardening", place)).or_default().extend(more);
        }
    }
    groups
}

/// Cosines of a curve up to this one make at most two periods over its range.
const SMOOTH: usize = 4;

/// Whether a curve has most of its variance in waves of more than two periods over its range: a gear or an encoder.
fn is_wavy(coefficients: &[f64]) -> bool {
    let square = |some: &[f64]| some.iter().map(|c| c * c).sum::<f64>();
    2.0 * square(&coefficients[SMOOTH.min(coefficients.len())..]) > square(coefficients)
}

/// What else an effect's own shape may leave at the same joint where it is not quite that of the library.
fn leaves(main: &str) -> &'static [&'static str] {
    match main {
        "counterbalance" | "cable_drag" => &["gear_cyclic", "unknown", "joint_table", "backlash"],
        "joint_hardening" => &["backlash", "unknown"],
        "joint_compliance" => &["unknown"],
        "backlash" => &["joint_hardening", "joint_compliance", "unknown"],
        "viscous_windup" => &["backlash", "gear_cyclic", "unknown"],
        "gear_cyclic" | "joint_table" => &["unknown"],
        "unknown" => &["gear_cyclic", "joint_table"],
        _ => &[],
    }
}

/// A small rest at the joint of a strong finding is no cause of its own but the finer shape of the finding: it joins its group.
fn refine(pool: &Pool, groups: &mut Groups, set: &[usize]) {
    let mut sorted = set.to_vec();
    sorted.sort_unstable();
    let whole = solve(pool, &sorted).gain;
    let gain = |members: &[usize]| {
        let own: Vec<usize> = members.iter().map(|i| set[*i]).collect();
        let rest: Vec<usize> = sorted.iter().copied().filter(|k| !own.contains(k)).collect();
        whole - solve(pool, &rest).gain
    };
    let gains: BTreeMap<(&'static str, String), f64> = groups.iter().map(|(key, members)| (key.clone(), gain(members))).collect();
    for (small, own) in &gains {
        let main = gains
            .iter()
            .filter(|(main, gain)| {
                let finer = main.1 == small.1 && *own < REFINEMENT * **gain && leaves(main.0).contains(&small.0);
                // Both go with the side of the last move.
                finer || (main.0 == "joint_log_lag" && small.0 == "backlash" && *own < TRACE * **gain)
            })
            .max_by(|a, b| a.1.total_cmp(b.1));
        if let Some((main, _)) = main.filter(|(main, _)| groups.contains_key(*main)) {
            let members = groups.remove(small).unwrap_or_default();
            groups.entry(main.clone()).or_default().extend(members);
        }
    }
}

/// What goes in proportion with an angle, or once or twice a turn with it, is a part of a joint's function of that angle and another.
fn both_angles(pool: &Pool, groups: &mut Groups, set: &[usize]) {
    let form = |i: &usize| &pool.hypotheses[set[*i]].form;
    let main = groups.iter().find_map(|(key, members)| {
        let angles =
            members.iter().find_map(|i| if let Form::Unknown(unknown) = form(i) { unknown.two_angles() } else { None })?;
        let Place::Joint(joint) = form(&members[0]).place() else { return None };
        Some((key.clone(), joint, angles))
    });
    let Some((main, joint, angles)) = main else { return };
    let is_part = |i: &usize| match form(i) {
        Form::GearCyclic(gear) => gear.joint() == joint && angles.contains(&joint) && gear.order() <= SLOW,
        other => matches!(other.place(), Place::Coupled(by, moved) if moved == joint && angles.contains(&by)),
    };
    let parts: Vec<_> = groups.iter().filter(|(_, members)| members.iter().all(is_part)).map(|(key, _)| key.clone()).collect();
    for part in parts {
        let members = groups.remove(&part).unwrap_or_default();
        groups.entry(main.clone()).or_default().extend(members);
    }
}

/// Orders that a smooth function of an angle may have, too.
const SLOW: u32 = 2;

/// What a neighbour seems to do with the angle of a joint whose axis wobbles is a part of that wobble.
fn wobbles(pool: &Pool, groups: &mut Groups, set: &[usize]) {
    let by = |i: &usize| match &pool.hypotheses[set[*i]].form {
        Form::Unknown(unknown) => match unknown.signature() {
            Signature::Periodic { by, .. } => Some(("axis_wobble", Place::Joint(by).to_string())),
            _ => None,
        },
        _ => None,
    };
    let unknown: Vec<(&'static str, String)> = groups.keys().filter(|key| key.0 == "unknown").cloned().collect();
    for key in unknown {
        let wobble = groups[&key].iter().map(by).reduce(|a, b| if a == b { a } else { None }).flatten();
        if let Some(wobble) = wobble.filter(|wobble| groups.contains_key(wobble)) {
            let members = groups.remove(&key).unwrap_or_default();
            groups.entry(wobble).or_default().extend(members);
        }
    }
}

/// Less than this share of a finding's gain at its own joint is its finer shape; anywhere, of a lag of all joints.
const REFINEMENT: f64 = 0.1;
const TRACE: f64 = 0.05;
