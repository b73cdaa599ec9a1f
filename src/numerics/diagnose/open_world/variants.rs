//! Groups like one that shows: with other numbers of its variables, with variables that go along with these, with shorter waves.

use super::groups::{FreeGroup, GroupColumns, PASSING, alike, moved};
use crate::criteria::open_world::{EACH, FINE};
use crate::effect::{Factor, Law, Variable};
use nalgebra::Vector3;

impl GroupColumns<'_, '_> {
    /// Groups like one in which a variable has a number of its own, with others around it, closer with every level.
    pub fn near(&mut self, group: &FreeGroup, level: i32) -> Vec<FreeGroup> {
        let step = libm::exp2(-f64::from(level));
        let factors = [libm::exp2(0.5 * step), libm::exp2(-0.5 * step)];
        let around = |of: Variable| -> Vec<Variable> {
            match of {
                Variable::Position { along } => {
                    arrows_near(along, 0.3 * step).into_iter().map(|along| Variable::Position { along }).collect()
                }
                Variable::Sighted { along } => {
                    arrows_near(along, 0.3 * step).into_iter().map(|along| Variable::Sighted { along }).collect()
                }
                Variable::Stretch { joint, limit } => factors.map(|by| Variable::Stretch { joint, limit: limit * by }).to_vec(),
                Variable::Recent { joint, time } => factors.map(|by| Variable::Recent { joint, time: time * by }).to_vec(),
                _ => Vec::new(),
            }
        };
        self.with_other_variables(group, around)
    }

    /// Groups like one with what goes along with a variable that shows: what else a joint's travel leaves behind, what else passes with the
    /// recording; of each kind a list.
    pub fn relatives(&mut self, group: &FreeGroup) -> Vec<Vec<FreeGroup>> {
        let survey = self.survey;
        let kind = |of: &Variable| std::mem::discriminant(of);
        let others = |of: Variable| -> Vec<Variable> {
            let all: Vec<Variable> = match of {
                Variable::Angle { joint } | Variable::Approach { joint } | Variable::Move { joint } => {
                    moved(joint, survey).collect()
                }
                Variable::Stretch { joint, .. } | Variable::Recent { joint, .. } => moved(joint, survey).collect(),
                // By themselves these are asked at every place.
                _ if group.law.times.is_some() && PASSING.contains(&of) => PASSING.to_vec(),
                _ => Vec::new(),
            };
            all.into_iter().filter(|other| kind(other) != kind(&of)).collect()
        };
        let kinds = |group: &FreeGroup| group.law.variables().iter().map(kind).collect::<Vec<_>>();
        let mut out: Vec<Vec<FreeGroup>> = Vec::new();
        for other in self.with_other_variables(group, others) {
            match out.iter_mut().find(|alike| kinds(&alike[0]) == kinds(&other)) {
                Some(alike) => alike.push(other),
                None => out.push(vec![other]),
            }
        }
        out
    }

    /// A group with others in the place of each of its variables.
    fn with_other_variables(&mut self, group: &FreeGroup, others: impl Fn(Variable) -> Vec<Variable>) -> Vec<FreeGroup> {
        let Law { first, times } = group.law;
        let count = if times.is_some() { *EACH } else { *FINE };
        let mut laws = Vec::new();
        let mut basis = |of: Variable| if times.is_some() { self.factor(of, count) } else { self.basis(of, count) };
        for of in others(first.of) {
            laws.extend(basis(of).map(|basis| Law { first: Factor::new(of, basis), times }));
        }
        for of in times.map_or(Vec::new(), |times| others(times.of)) {
            laws.extend(basis(of).map(|basis| Law { first, times: Some(Factor::new(of, basis)) }));
        }
        let of = |law: &Law| if times.is_some() { group.of } else { alike(law.first.of) };
        laws.into_iter().map(|law| FreeGroup { motion: group.motion, law, of: of(&law) }).collect()
    }

    /// A group with more and shorter waves; none of a product of two curves.
    pub fn finer(&mut self, group: &FreeGroup) -> Option<FreeGroup> {
        if group.curves() > 1 {
            return None;
        }
        let count = *FINE;
        let two = group.law.times.is_some();
        let mut basis = |of: Variable| if two { self.factor(of, count) } else { self.basis(of, count) };
        let mut finer = |factor: Factor| Some(Factor::new(factor.of, basis(factor.of)?));
        let law = Law { first: finer(group.law.first)?, times: group.law.times.and_then(&mut finer) };
        (law.count() > group.law.count()).then_some(FreeGroup { law, ..*group })
    }
}

/// Unit vectors off one by an angle, across it.
fn arrows_near(along: [f64; 3], angle: f64) -> Vec<[f64; 3]> {
    let along = Vector3::from(along);
    let least = Vector3::ith(along.iamin(), 1.0);
    let across = along.cross(&least).normalize();
    let sides = [across, along.cross(&across)];
    sides.iter().flat_map(|side| [1.0, -1.0].map(|sign| (along + side * (sign * libm::tan(angle))).normalize().into())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::open_world::groups::arrows;

    #[test]
    fn directions_near_one_are_off_it_by_the_angle_that_was_asked() {
        for along in arrows() {
            let near = arrows_near(along, 0.2);
            assert_eq!(near.len(), 4);
            for other in near {
                let (a, b) = (Vector3::from(along), Vector3::from(other));
                assert!((b.norm() - 1.0).abs() < 1e-12 && (a.angle(&b) - 0.2).abs() < 1e-9, "{along:?} {other:?}");
            }
        }
    }
}
