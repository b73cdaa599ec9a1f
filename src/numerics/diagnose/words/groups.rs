//! Which causes make up one finding: what one part of the arm does by one law, with the rest that its true shape leaves.

use super::holder::stepped;
use crate::criteria::words::{REFINEMENT, SLOW, TRACE};
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::FitState;
use crate::effect::{
    AxisWobble, Backlash, Basis, GearCyclic, JointCompliance, JointHardening, JointLogLag, Place, Survey, Term, ToolShift,
    Unknown, Variable, ZeroShift, cause, follows,
};
use std::collections::BTreeMap;

/// The effect that chosen causes are called, and their place.
pub(crate) type FindingKey = (&'static str, Place);
/// Positions among the chosen causes.
pub(crate) type FindingGroups = BTreeMap<FindingKey, Vec<usize>>;

/// The chosen causes, whose positions in the pool are `set`, by finding.
pub(crate) fn groups(last: &FitState, set: &[usize], pool: &CachedHypotheses, survey: &Survey) -> FindingGroups {
    let mut groups = FindingGroups::new();
    for (i, k) in set.iter().enumerate() {
        let form = &pool.hypotheses[*k].form;
        let values = &last.model.x[last.ranges[i].clone()];
        groups.entry((form.called(values, survey), form.place())).or_default().push(i);
    }
    products(pool, &mut groups, set);
    refine(pool, &mut groups, set);
    both_angles(pool, &mut groups, set);
    wobbles(pool, &mut groups, set);
    holders(pool, &mut groups, set, survey);
    // One wind-up a joint: a compliance beside a hardening of the same joint is part of it.
    let hard: Vec<Place> = groups.keys().filter(|key| key.0 == JointHardening::NAME).map(|key| key.1).collect();
    for place in hard {
        if let Some(more) = groups.remove(&(JointCompliance::NAME, place)) {
            groups.entry((JointHardening::NAME, place)).or_default().extend(more);
        }
    }
    groups
}

/// A small rest at the joint of a strong finding is no cause of its own but the finer shape of the finding: it joins its group.
fn refine(pool: &CachedHypotheses, groups: &mut FindingGroups, set: &[usize]) {
    let mut sorted = set.to_vec();
    sorted.sort_unstable();
    let whole = pool.solve(&sorted).gain;
    let finer = |(key, members): (&FindingKey, &Vec<usize>)| {
        let own = members.iter().map(|i| pool.hypotheses[set[*i]].form.cause()).find(|own| own.name() == key.0);
        (*key, own.or_else(|| cause(key.0)).map_or(&[] as &[&str], |cause| cause.finer()))
    };
    let finer: BTreeMap<FindingKey, &[&str]> = groups.iter().map(finer).collect();
    let gain = |members: &[usize]| {
        let own: Vec<usize> = members.iter().map(|i| set[*i]).collect();
        let rest: Vec<usize> = sorted.iter().copied().filter(|k| !own.contains(k)).collect();
        whole - pool.solve(&rest).gain
    };
    let gains: BTreeMap<FindingKey, f64> = groups.iter().map(|(key, members)| (*key, gain(members))).collect();
    for (small, own) in &gains {
        let main = gains
            .iter()
            .filter(|(main, gain)| {
                let joins = main.1 == small.1 && *own < *REFINEMENT * **gain && finer[main].contains(&small.0);
                // Both follow the side of the last move.
                joins || (main.0 == JointLogLag::NAME && small.0 == Backlash::NAME && *own < *TRACE * **gain)
            })
            .max_by(|a, b| a.1.total_cmp(b.1));
        if let Some((main, _)) = main.filter(|(main, _)| groups.contains_key(*main)) {
            let members = groups.remove(small).unwrap_or_default();
            groups.entry(*main).or_default().extend(members);
        }
    }
}

/// A product without a name of a named law belongs to that law's finding.
fn products(pool: &CachedHypotheses, groups: &mut FindingGroups, set: &[usize]) {
    let form = |i: &usize| &pool.hypotheses[set[*i]].form;
    let unknown: Vec<FindingKey> = groups.keys().filter(|key| key.0 == Unknown::NAME).copied().collect();
    for key in unknown {
        for product in groups[&key].clone() {
            let made_of = |members: &Vec<usize>| members.iter().any(|i| follows(form(&product), form(i)).is_some());
            let named = groups.iter().find(|(other, members)| **other != key && made_of(members)).map(|(other, _)| *other);
            let Some(named) = named else { continue };
            groups.entry(named).or_default().push(product);
            groups.entry(key).and_modify(|members| members.retain(|i| *i != product));
        }
        groups.retain(|_, members| !members.is_empty());
    }
}

/// What goes in proportion with an angle, or once or twice a turn with it, is a part of a joint's function of that angle and another.
fn both_angles(pool: &CachedHypotheses, groups: &mut FindingGroups, set: &[usize]) {
    let form = |i: &usize| &pool.hypotheses[set[*i]].form;
    let main = groups.iter().find_map(|(key, members)| {
        let angles = members.iter().find_map(|i| form(i).term()?.two_angles())?;
        let Place::Joint(joint) = form(&members[0]).place() else { return None };
        Some((*key, joint, angles))
    });
    let Some((main, joint, angles)) = main else { return };
    let is_part = |i: &usize| match (form(i).place(), form(i).term().map(Term::basis)) {
        (Place::Coupled(by, moved), _) => moved == joint && angles.contains(&by),
        (at, Some(Basis::Wave { order, .. })) if form(i).is(&GearCyclic) => {
            at == Place::Joint(joint) && angles.contains(&joint) && order <= *SLOW
        }
        _ => false,
    };
    let parts: Vec<_> = groups.iter().filter(|(_, members)| members.iter().all(is_part)).map(|(key, _)| *key).collect();
    for part in parts {
        let members = groups.remove(&part).unwrap_or_default();
        groups.entry(main).or_default().extend(members);
    }
}

/// What a neighbour seems to do with the angle of a joint whose axis wobbles is a part of that wobble.
fn wobbles(pool: &CachedHypotheses, groups: &mut FindingGroups, set: &[usize]) {
    // Of a joint that follows a sine of another joint's angle, that other joint.
    let by = |i: &usize| {
        let term = pool.hypotheses[set[*i]].form.term()?;
        match (term.basis(), term.of_one()) {
            (Basis::Wave { .. }, Some((joint, Variable::Angle { joint: by }))) if by != joint => {
                Some((AxisWobble::NAME, Place::Joint(by)))
            }
            _ => None,
        }
    };
    let unknown: Vec<FindingKey> = groups.keys().filter(|key| key.0 == Unknown::NAME).copied().collect();
    for key in unknown {
        let wobble = groups[&key].iter().map(by).reduce(|a, b| if a == b { a } else { None }).flatten();
        if let Some(wobble) = wobble.filter(|wobble| groups.contains_key(wobble)) {
            let members = groups.remove(&key).unwrap_or_default();
            groups.entry(wobble).or_default().extend(members);
        }
    }
}

/// One target on the last body that turns about its axis is one step, though the last joint's zero takes a part of it.
fn holders(pool: &CachedHypotheses, groups: &mut FindingGroups, set: &[usize], survey: &Survey) {
    let at = |key: &FindingKey| {
        let members = groups.get(key)?;
        members.iter().map(|i| stepped(&pool.hypotheses[set[*i]].form, survey.joints())).collect::<Option<Vec<f64>>>()
    };
    let [tool, zero] = [(ToolShift::NAME, Place::Tool), (ZeroShift::NAME, Place::Joint(survey.joints() - 1))];
    let (Some(moved), Some(stepped)) = (at(&tool), at(&zero)) else { return };
    let alone = survey.rows.iter().all(|row| survey.data.target(*row) == survey.data.target(survey.rows[0]));
    let at_once = |time: &f64| moved.iter().any(|other| survey.changes_near(*time).contains(other));
    if alone && stepped.iter().all(at_once) {
        let members = groups.remove(&zero).unwrap_or_default();
        groups.entry(tool).or_default().extend(members);
    }
}
