//! Whether a diagnosis looked in the right place, gave no wrong name, and named `unknown` where it knew no name.

use super::paper::{Atoms, Cause, Finding, Truth, all_atoms};
use super::share::Share;
use serde::Serialize;
use std::collections::BTreeSet;

/// Faults of single points: they say nothing about where a cause sits.
pub(super) const POINT_FAULTS: [&str; 2] = ["outlier", "mislabelled_point"];
/// A name that is stated with this probability or more is given.
pub(crate) const GIVEN: f64 = 0.5;
/// What has a place and no name.
pub const NAMELESS: &str = "unknown";

/// What was named of a cause.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Placed {
    /// The strongest finding, but for faults of points and what sits at the other causes' places, is at its place or at an accepted one.
    pub place: bool,
    /// It has its name or an accepted one, or `unknown` stands at its place.
    pub name_or_unknown: bool,
    /// A name was given that is not there: by a finding that is neither wanted nor accepted nor has such a rival, or as the first choice
    /// at the right place.
    pub wrong_name: bool,
    /// The same with a probability of [`GIVEN`] or more.
    pub(crate) wrong_given: bool,
}

fn places(names: &Atoms) -> BTreeSet<&str> {
    names.iter().map(|(_, place)| place.as_str()).collect()
}

/// Judges what was named of `cause`; `known` are all names that are there or accepted, `reach` all that a finding may mean.
pub(super) fn placed(
    cause: &Cause,
    truth: &Truth,
    findings: &[Finding],
    known: &Atoms,
    reach: impl Fn(&Finding) -> Atoms,
) -> Placed {
    let own = cause.atoms();
    let accepted = all_atoms(&truth.accepted);
    let right: BTreeSet<&str> = places(&own).union(&places(&accepted)).copied().collect();
    let others: Atoms = truth.effects.iter().flat_map(Cause::atoms).collect();
    let elsewhere: BTreeSet<&str> = places(&others).difference(&right).copied().collect();

    let named: Vec<(&Finding, Atoms)> = findings
        .iter()
        .map(|finding| (finding, finding.atoms()))
        .collect();
    let physical = || {
        named
            .iter()
            .filter(|(finding, _)| !POINT_FAULTS.contains(&finding.effect.as_str()))
    };
    let there = |names: &Atoms| !places(names).is_disjoint(&right);
    let found: Atoms = named.iter().flat_map(|(_, names)| names.clone()).collect();
    let wrong = |finding: &Finding, names: &Atoms| {
        finding.effect != NAMELESS
            && names.is_disjoint(known)
            && (there(names) || reach(finding).is_disjoint(known))
    };
    Placed {
        place: physical()
            .find(|(_, names)| !places(names).is_subset(&elsewhere))
            .is_some_and(|(_, names)| there(names)),
        name_or_unknown: own.is_subset(&found)
            || !accepted.is_disjoint(&found)
            || named
                .iter()
                .any(|(finding, names)| finding.effect == NAMELESS && there(names)),
        wrong_name: named.iter().any(|(finding, names)| wrong(finding, names)),
        wrong_given: named.iter().any(|(finding, names)| {
            wrong(finding, names) && finding.probability.unwrap_or(1.0) >= GIVEN
        }),
    }
}

/// Shares of causes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub(crate) struct Places {
    pub(crate) place: Share,
    /// Right names, or `unknown` at the right place.
    pub(crate) name_or_unknown: Share,
    pub(crate) wrong_name: Share,
    /// Wrong names with a probability of [`GIVEN`] or more.
    #[serde(rename = "wrong_name_0.5")]
    pub(crate) wrong_given: Share,
}

impl Places {
    /// Each with a title.
    pub(super) fn titled(&self) -> [(&'static str, Share); 4] {
        [
            ("place right", self.place),
            (
                "name right, or unknown at the right place",
                self.name_or_unknown,
            ),
            ("a wrong name at all", self.wrong_name),
            ("a wrong name with 0.5 or more", self.wrong_given),
        ]
    }
    pub(super) fn of(causes: impl Iterator<Item = Placed>) -> Places {
        let all: Vec<Placed> = causes.collect();
        let share = |holds: fn(&Placed) -> bool| Share::of(all.iter().map(holds));
        Places {
            place: share(|one| one.place),
            name_or_unknown: share(|one| one.name_or_unknown),
            wrong_name: share(|one| one.wrong_name),
            wrong_given: share(|one| one.wrong_given),
        }
    }
}
