//! Parameters chosen by name: which are free, held, bounded or known beforehand, by patterns with `*` for anything.
//!
//! Figures are in the unit that the table `parameters` shows for each (mm, rad, rad/Nm, ...). Where several patterns of one
//! setting match a parameter the longest counts.

use crate::effect::{identified, names};
use crate::error::{Place, did_you_mean};
use crate::estimate::{Bounds, Known, Model, Prior};
use crate::stage::Context;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is known of a parameter beforehand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PriorSetting {
    /// One standard deviation, in the parameter's unit.
    pub sigma: f64,
    /// Expected change from nominal, in the parameter's unit.
    #[serde(default)]
    pub mean: f64,
}

/// The settings `free`, `hold`, `prior` and `bounds` of a stage.
pub struct ParameterSet<'a> {
    pub free: Option<&'a [String]>,
    pub hold: &'a [String],
    pub prior: &'a BTreeMap<String, PriorSetting>,
    pub bounds: &'a BTreeMap<String, [f64; 2]>,
}

impl ParameterSet<'_> {
    /// Every pattern with the setting that it stands in.
    fn patterns(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let free = self
            .free
            .unwrap_or_default()
            .iter()
            .map(|pattern| ("free", pattern.as_str()));
        let hold = self.hold.iter().map(|pattern| ("hold", pattern.as_str()));
        let prior = self.prior.keys().map(|pattern| ("prior", pattern.as_str()));
        free.chain(hold).chain(prior).chain(
            self.bounds
                .keys()
                .map(|pattern| ("bounds", pattern.as_str())),
        )
    }

    /// What is wrong with the settings whatever the robot.
    pub fn faults(&self, at: &mut Place) {
        let names: Vec<&str> = identified().map(|cause| cause.name()).collect();
        for (setting, pattern) in self.patterns() {
            let effect = pattern.split('.').next().unwrap_or_default();
            if matches!(setting, "prior" | "bounds") && effect == names::BASE_FRAME {
                let message = "where the robot stands in the tracker's frame is found by alignment: only `free` and `hold` apply";
                at.at(format!("{setting}.{pattern}")).fault(message);
            } else if !names.iter().any(|name| matches(effect, name)) {
                at.at(setting).fault(format!(
                    "`{pattern}` names no effect{}; allowed are names as in the table parameters, e.g. reduction_ratio.j2, \
                     link_geometry.l3.x, or with `*` for anything; effects: {}",
                    did_you_mean(effect, names.iter().copied()),
                    names.join(", ")
                ));
            }
        }
        let none = self.free.is_some_and(<[String]>::is_empty);
        at.at("free").must(
            !none,
            "name at least one parameter, or leave it out: then all are free that are not held",
        );
        for (pattern, PriorSetting { sigma, mean }) in self.prior {
            let possible = *sigma > 0.0 && sigma.is_finite() && mean.is_finite();
            at.at(format!("prior.{pattern}")).must(
                possible,
                "expected a sigma above zero, e.g. {sigma: 0.1, mean: 0}",
            );
        }
        for (pattern, [low, high]) in self.bounds {
            let possible = low < high && low.is_finite() && high.is_finite();
            at.at(format!("bounds.{pattern}")).must(
                possible,
                "expected two numbers, the lower one first, e.g. [-0.5, 0.5]",
            );
        }
    }

    /// Sorts the parameters that this stage may estimate (`open`, positions in the stack) into (candidates, held), and tells the
    /// model what is known beforehand. Patterns that match none of them are warned of.
    pub fn apply(
        &self,
        model: &mut Model,
        open: &[usize],
        context: &Context,
    ) -> (Vec<usize>, Vec<usize>) {
        let specs = model.stack.specs();
        let names: Vec<&str> = open.iter().map(|k| specs[*k].name.as_str()).collect();
        for (setting, pattern) in self
            .patterns()
            .filter(|(_, pattern)| !names.iter().any(|name| matches(pattern, name)))
        {
            let hint = did_you_mean(pattern, names.iter().copied());
            context.warn(format!(
                "{setting}: `{pattern}` matches no parameter of this model{hint}"
            ));
        }
        let any =
            |patterns: &[String], name: &str| patterns.iter().any(|pattern| matches(pattern, name));
        let wanted =
            |name: &str| self.free.is_none_or(|free| any(free, name)) && !any(self.hold, name);
        let (candidates, held): (Vec<usize>, Vec<usize>) =
            open.iter().partition(|k| wanted(&specs[**k].name));
        let base: Vec<usize> = model.stack.parameters_of(names::BASE_FRAME).collect();
        let mut known = BTreeMap::new();
        for &k in candidates.iter().filter(|k| !base.contains(k)) {
            let (name, unit) = (&specs[k].name, specs[k].unit);
            let about = Known {
                prior: longest(self.prior, name).map(|prior| Prior {
                    mean: unit.to_si(prior.mean),
                    sigma: unit.to_si(prior.sigma),
                }),
                bounds: longest(self.bounds, name).map(|[low, high]| Bounds {
                    low: unit.to_si(*low),
                    high: unit.to_si(*high),
                }),
            };
            if about != Known::default() {
                known.insert(k, about);
            }
        }
        model.known = known;
        (candidates, held)
    }
}

/// The entry of the longest pattern that matches.
fn longest<'a, T>(patterns: &'a BTreeMap<String, T>, name: &str) -> Option<&'a T> {
    let matching = patterns
        .iter()
        .filter(|(pattern, _)| matches(pattern, name));
    matching
        .max_by_key(|(pattern, _)| pattern.len())
        .map(|(_, value)| value)
}

/// Whether a pattern with `*` for anything matches the whole name.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, tail)) => name.strip_prefix(head).is_some_and(|rest| {
            rest.char_indices()
                .map(|(at, _)| &rest[at..])
                .chain([""])
                .any(|end| matches(tail, end))
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn a_star_stands_for_anything() {
        assert!(matches("reduction_ratio.*", "reduction_ratio.j2"));
        assert!(matches("*.j2", "reduction_ratio.j2"));
        assert!(matches("*", "x") && matches("*r7", "cell-4 r7") && matches("c*4*7", "cell-4 r7"));
        assert!(matches("a*c*e", "abcde"));
        assert!(!matches("a*c", "abcd"));
        assert!(!matches("reduction_ratio", "reduction_ratio.j2"));
    }
}
