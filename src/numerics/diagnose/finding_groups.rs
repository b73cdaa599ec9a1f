//! Which causes make up one finding: what one part of the arm does by one law, with the rest that its true shape leaves.
//!
//! Causes themselves say what is a part of theirs, see [`Cause::absorbs_below`] and [`Cause::has_part`].

use super::pool::CachedHypotheses;
use super::round::FitState;
use crate::effect::{Cause, Form, NamedForms, Place, Survey, cause, follows, names};
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
    let mut chosen = ChosenCauses { pool, set, groups };
    chosen.products();
    chosen.finer_shapes();
    chosen.parts(survey);
    chosen.groups
}

struct ChosenCauses<'a, 'p> {
    pool: &'a CachedHypotheses<'p>,
    set: &'a [usize],
    groups: FindingGroups,
}

impl ChosenCauses<'_, '_> {
    fn form(&self, i: usize) -> &Form {
        &self.pool.hypotheses[self.set[i]].form
    }

    fn named(&self, key: FindingKey) -> NamedForms<'_> {
        NamedForms { name: key.0, place: key.1, forms: self.groups[&key].iter().map(|i| self.form(*i)).collect() }
    }

    /// The cause by which a finding is called: of one of its forms, or of the library.
    fn own(&self, key: FindingKey) -> Option<&'static dyn Cause> {
        let of_forms = self.groups[&key].iter().map(|i| self.form(*i).cause()).find(|own| own.name() == key.0);
        of_forms.or_else(|| cause(key.0))
    }

    fn join(&mut self, part: FindingKey, main: FindingKey) {
        let members = self.groups.remove(&part).unwrap_or_default();
        self.groups.entry(main).or_default().extend(members);
    }

    /// A product without a name of a named law belongs to that law's finding.
    fn products(&mut self) {
        let unknown: Vec<FindingKey> = self.groups.keys().filter(|key| key.0 == names::UNKNOWN).copied().collect();
        for key in unknown {
            for product in self.groups[&key].clone() {
                let made_of = |members: &Vec<usize>| members.iter().any(|i| follows(self.form(product), self.form(*i)).is_some());
                let named =
                    self.groups.iter().find(|(other, members)| **other != key && made_of(members)).map(|(other, _)| *other);
                let Some(named) = named else { continue };
                self.groups.entry(named).or_default().push(product);
                self.groups.entry(key).and_modify(|members| members.retain(|i| *i != product));
            }
            self.groups.retain(|_, members| !members.is_empty());
        }
    }

    /// A small rest beside a strong finding is no cause of its own but the finer shape of the finding: it joins its group.
    fn finer_shapes(&mut self) {
        let mut sorted = self.set.to_vec();
        sorted.sort_unstable();
        let all = self.pool.solve(&sorted).gain;
        let gain = |members: &[usize]| {
            let own: Vec<usize> = members.iter().map(|i| self.set[*i]).collect();
            let rest: Vec<usize> = sorted.iter().copied().filter(|k| !own.contains(k)).collect();
            all - self.pool.solve(&rest).gain
        };
        let gains: BTreeMap<FindingKey, f64> = self.groups.iter().map(|(key, members)| (*key, gain(members))).collect();
        let of_small = |small: &FindingKey| {
            let shape = self.named(*small);
            let absorbs = |(main, gain): &(&FindingKey, &f64)| {
                let below = self.own(**main).and_then(|own| own.absorbs_below(&self.named(**main), &shape));
                below.is_some_and(|share| gains[small] < share * **gain)
            };
            gains.iter().filter(absorbs).max_by(|a, b| a.1.total_cmp(b.1)).map(|(main, _)| *main)
        };
        let mains: Vec<(FindingKey, FindingKey)> = gains.keys().filter_map(|small| Some((*small, of_small(small)?))).collect();
        for (small, main) in mains {
            if self.groups.contains_key(&main) {
                self.join(small, main);
            }
        }
    }

    /// A finding that another one's cause claims whatever it gains joins that one's group.
    fn parts(&mut self, survey: &Survey) {
        for part in self.groups.keys().copied().collect::<Vec<_>>() {
            let shape = self.named(part);
            let claims = |main: &&FindingKey| {
                let own = self.named(**main);
                let causes = self.own(**main).into_iter().chain(own.forms.iter().map(|form| form.cause()));
                causes.into_iter().any(|cause| cause.has_part(&own, &shape, survey))
            };
            let main = self.groups.keys().filter(|main| **main != part).find(claims).copied();
            if let Some(main) = main {
                self.join(part, main);
            }
        }
    }
}
