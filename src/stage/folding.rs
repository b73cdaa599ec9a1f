//! Cross-validation as the settings ask for it: in so many parts, or pose by pose.

use super::Context;
use crate::error::{Place, counted};
use crate::estimate::{Folds, Session, cross_validate, fold_poses, leave_one_out};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserializer, Unexpected, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;

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

    /// The folds of a fit; where they had to be dropped, the person is told.
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
