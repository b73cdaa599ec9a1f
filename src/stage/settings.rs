//! Settings that identifications share: parameters chosen by name, cross-validation, the repeatability of joints.
//!
//! Parameters are free, held, bounded or known beforehand by patterns with `*` for anything, in the unit that the table `parameters` shows for
//! each (mm, rad, rad/Nm, ...). Where several patterns of one setting match a parameter the longest counts.

use super::Context;
use crate::effect::{identified, names};
use crate::error::{Place, counted, did_you_mean, suggestion};
use crate::estimate::{
    Bounds, Folds, Known, Model, Poses, Prior, Repeated, Session, cross_validate, fold_poses,
    leave_one_out, spread,
};
use calib_numerics::robot::{Measurements, NoiseBasis};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserializer, Unexpected, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

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
            .map(|one| ("free", one));
        let hold = self.hold.iter().map(|one| ("hold", one));
        let prior = self.prior.keys().map(|one| ("prior", one));
        let bounds = self.bounds.keys().map(|one| ("bounds", one));
        let all = free.chain(hold).chain(prior).chain(bounds);
        all.map(|(setting, pattern)| (setting, pattern.as_str()))
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
                    "`{pattern}` names no effect{} Allowed are names as in the table parameters, e.g. reduction_ratio.j2, \
                     link_geometry.l3.x, or with `*` for anything; effects: {}",
                    suggestion(effect, names.iter().copied()),
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
        let is_unknown =
            |(_, pattern): &(&str, &str)| !names.iter().any(|name| matches(pattern, name));
        for (setting, pattern) in self.patterns().filter(is_unknown) {
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
    let all = patterns
        .iter()
        .filter(|(pattern, _)| matches(pattern, name));
    let longest = all.max_by_key(|(pattern, _)| pattern.len());
    longest.map(|(_, value)| value)
}

/// Whether a pattern with `*` for anything matches the whole name.
pub fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, tail)) => name.strip_prefix(head).is_some_and(|middle| {
            let mut ends = middle.char_indices().map(|(at, _)| &middle[at..]);
            ends.any(|end| matches(tail, end)) || matches(tail, "")
        }),
    }
}

/// Beyond this, every fold is a fit for next to no news.
const MOST_PARTS: usize = 100;
/// Poses that are left out one by one, at most.
const MOST_POSES: usize = 1000;

/// Parts of a cross-validation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoldSetting {
    /// So many; 0 for none.
    Parts(usize),
    /// `n`: every pose is a part of its own.
    EachPose,
}

impl Default for FoldSetting {
    fn default() -> Self {
        Self::Parts(5)
    }
}

impl FoldSetting {
    pub(super) fn faults(self, at: &mut Place) {
        let possible = !matches!(self, Self::Parts(parts) if parts == 1 || parts > MOST_PARTS);
        at.at("folds").must(
            possible,
            format!(
                "allowed: 0 for none, 2 to {MOST_PARTS}, or n to leave out one pose after the other"
            ),
        );
    }

    /// The folds of a fit, or why there are none though they were asked for.
    pub(super) fn divide(self, whole: &Session, seed: u64) -> Result<Option<Folds>, String> {
        let poses = fold_poses(whole.data, whole.rows);
        let few = |allowed: &str| {
            format!(
                "{} in {} are too few; allowed: {allowed}",
                counted(poses, "pose"),
                counted(whole.rows.len(), "row")
            )
        };
        match self {
            Self::Parts(0) => Ok(None),
            Self::EachPose if poses > MOST_POSES => {
                Err(format!("{poses} poses are too many to leave out one by one; allowed: up to {MOST_POSES}, or folds: 5"))
            }
            Self::EachPose => leave_one_out(whole).map(Some).ok_or_else(|| few("more rows than a third of the parameters with any one pose left out")),
            Self::Parts(parts) => cross_validate(whole, parts, seed).map(Some).ok_or_else(|| {
                few(&format!("two poses for each of {parts} folds and more values than parameters with any fold left out; fewer folds; or folds: n"))
            }),
        }
    }

    /// The folds of a fit; where they had to be dropped, a warning says so.
    pub(super) fn folds(
        self,
        whole: &Session,
        context: &Context,
    ) -> (Option<Folds>, Option<usize>) {
        match self.divide(whole, context.seed) {
            Ok(folds) => (folds, None),
            Err(why) => {
                context.warn(format!("not cross-validated: {why}"));
                (None, Some(fold_poses(whole.data, whole.rows)))
            }
        }
    }
}

impl Serialize for FoldSetting {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Parts(parts) => serializer.serialize_u64(*parts as u64),
            Self::EachPose => serializer.serialize_str("n"),
        }
    }
}

impl<'de> Deserialize<'de> for FoldSetting {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberOrWord)
    }
}

struct NumberOrWord;

impl Visitor<'_> for NumberOrWord {
    type Value = FoldSetting;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number of folds (0 for none), or n for one a pose")
    }
    fn visit_u64<E: de::Error>(self, parts: u64) -> Result<FoldSetting, E> {
        usize::try_from(parts)
            .map(FoldSetting::Parts)
            .map_err(|_| E::invalid_value(Unexpected::Unsigned(parts), &self))
    }
    fn visit_i64<E: de::Error>(self, parts: i64) -> Result<FoldSetting, E> {
        usize::try_from(parts)
            .map(FoldSetting::Parts)
            .map_err(|_| E::invalid_value(Unexpected::Signed(parts), &self))
    }
    fn visit_str<E: de::Error>(self, word: &str) -> Result<FoldSetting, E> {
        if word == "n" {
            Ok(FoldSetting::EachPose)
        } else {
            Err(E::invalid_value(Unexpected::Str(word), &self))
        }
    }
}

impl JsonSchema for FoldSetting {
    fn schema_name() -> Cow<'static, str> {
        "FoldSetting".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A number of folds, or `n` for one a pose.",
            "anyOf": [{ "type": "integer", "minimum": 0, "maximum": MOST_PARTS }, { "const": "n" }],
        })
    }
}

/// How well joints come back to where they were; rows far out on the arm weigh less for it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Repeatability {
    /// Estimated, where the recording returns to poses.
    #[default]
    Measured,
    /// Not taken into account.
    Ignored,
    /// One standard deviation of every revolute joint, arcsec.
    Arcsec(f64),
}

/// rad per arcsec.
const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

impl Repeatability {
    pub fn faults(&self, at: &mut Place) {
        let possible = !matches!(self, Self::Arcsec(sigma) if !(*sigma > 0.0 && sigma.is_finite()));
        at.at("repeatability").must(
            possible,
            "expected `measured`, `ignored`, or a figure above zero, e.g. {arcsec: 3}",
        );
    }

    /// Gives every row the covariance that the joints make of it; the standard deviation of a joint (rad), where one is known.
    pub fn apply(
        &self,
        model: &Model,
        data: &mut Measurements,
        rows: &[usize],
        context: &Context,
    ) -> Option<f64> {
        let sigma = match self {
            Self::Ignored => None,
            Self::Arcsec(sigma) => Some(sigma * ARCSEC),
            Self::Measured => Poses::of(data, rows).joint_repeatability(model, data).inspect(|sigma| {
                let arcsec = sigma / ARCSEC;
                context.note(format!("joints return to a pose to {arcsec:.1} arcsec each (one sigma): rows are weighted by it"));
            }),
        };
        data.spread = sigma.map(|sigma| spread(model, data, sigma));
        if sigma.is_some() && *self == Self::Measured {
            data.noise_basis = NoiseBasis::Repeats;
        }
        sigma
    }
}

/// Below this chance of a complete model doing as badly the model lacks something.
const UNLIKELY: f64 = 0.01;

/// Notes for the person on what repeats say against the fit.
pub fn note_repeats(context: &Context, repeated: &Repeated) {
    let Repeated {
        poses,
        noise,
        freedom,
        revisited,
        lack_of_fit,
    } = repeated;
    let what = if *revisited {
        "noise and repeatability"
    } else {
        "noise (the arm stood still: no word on repeatability)"
    };
    let (floor, poses, degrees) = (
        noise * 1e3,
        counted(poses, "pose"),
        counted(freedom, "degree"),
    );
    let lack = match lack_of_fit {
        None => String::new(),
        Some((ratio, chance)) if *chance < UNLIKELY => format!(
            "; the residual between poses is {ratio:.1} times that in mean square: this model lacks something"
        ),
        Some((ratio, chance)) => format!(
            "; the residual between poses is no larger (F {ratio:.2}, p {chance:.2}): no lack of fit shows"
        ),
    };
    context.note(format!(
        "measured more than once: {poses}, {floor:.3} mm per axis of {what}, {degrees} of freedom{lack}"
    ));
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
