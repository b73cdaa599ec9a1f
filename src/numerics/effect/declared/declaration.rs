//! A declared effect as a person writes it: place, motion, laws, shape numbers, and what is said of a finding.

use serde::de::{self, Deserializer, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// One effect; the words in which it is read from YAML and kept with a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectDeclaration {
    /// Lower snake case.
    pub name: String,
    /// `joint` (any that turns), `joint 3`, `link` (any), `link 2`, `link 2-4`, `base`, `tool`, `tracker`.
    pub place: String,
    /// What moves there; `None`: what usually does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<String>,
    /// Formulas; each has a coefficient.
    pub law: Laws,
    /// Numbers within the formulas that are refined.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub shape: BTreeMap<String, ShapeRange>,
    /// Unit of the coefficients; `None`: that of the motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// What the formulas are in, in words, e.g. `K rad`: stands behind the unit in the sentence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per: Option<String>,
    /// The usual size of a coefficient, in `unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// Whether only positive coefficients make sense.
    #[serde(default, skip_serializing_if = "is_false")]
    pub positive: bool,
    /// What a mechanic is told, with `{place}`, `{value}`, `{values}` and the names of shape numbers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sentence: Option<String>,
    /// Effects that do nearly the same, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confounded: Option<String>,
    /// What a recording must have, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs: Option<String>,
    /// What to measure, beside poses, to separate it from others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub advice: Option<String>,
}

fn is_false(value: &bool) -> bool {
    !value
}

/// Where a shape number starts and how far it may go.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShapeRange {
    /// Smallest.
    pub from: f64,
    /// Largest.
    pub to: f64,
    /// Numbers at which a search starts; empty: some between both ends.
    #[serde(default, skip_serializing_if = "Starts::is_empty")]
    pub start: Starts,
}

/// Starts between both ends where none are given: of one shape number, of each of two, of each of three.
const BETWEEN: [usize; 3] = [25, 9, 5];

impl ShapeRange {
    /// At which a search of so many shape numbers starts.
    pub(crate) fn starts(&self, numbers: usize) -> Vec<f64> {
        if !self.start.0.is_empty() {
            return self.start.0.clone();
        }
        let count = BETWEEN[numbers.clamp(1, BETWEEN.len()) - 1];
        let share = |k: usize| (k as f64 + 0.5) / count as f64;
        let between = |k| match self.is_of_ratios() {
            true => self.from * libm::pow(self.to / self.from, share(k)),
            false => self.from + share(k) * (self.to - self.from),
        };
        (0..count).map(between).collect()
    }

    /// Whether it goes in ratios: over more than a power of ten of positive numbers.
    pub fn is_of_ratios(&self) -> bool {
        self.from > 0.0 && self.to >= 10.0 * self.from
    }
}

/// One number or several.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Starts(pub Vec<f64>);

impl Starts {
    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// One formula or several.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Laws(pub Vec<String>);

/// A list, item by item.
fn listed<'de, T: Deserialize<'de>, A: SeqAccess<'de>>(mut items: A) -> Result<Vec<T>, A::Error> {
    let mut out = Vec::new();
    while let Some(item) = items.next_element()? {
        out.push(item);
    }
    Ok(out)
}

struct OneOrMoreTexts;

impl<'de> Visitor<'de> for OneOrMoreTexts {
    type Value = Vec<String>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a formula as text, or a list of such")
    }
    fn visit_str<E: de::Error>(self, value: &str) -> Result<Self::Value, E> {
        Ok(vec![value.into()])
    }
    fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Self::Value, A::Error> {
        listed(items)
    }
}

struct OneOrMoreNumbers;

impl<'de> Visitor<'de> for OneOrMoreNumbers {
    type Value = Vec<f64>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, or a list of numbers")
    }
    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Self::Value, E> {
        Ok(vec![value])
    }
    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Self::Value, E> {
        Ok(vec![value as f64])
    }
    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Self::Value, E> {
        Ok(vec![value as f64])
    }
    fn visit_i128<E: de::Error>(self, value: i128) -> Result<Self::Value, E> {
        Ok(vec![value as f64])
    }
    fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Self::Value, A::Error> {
        listed(items)
    }
}

impl<'de> Deserialize<'de> for Laws {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrMoreTexts).map(Self)
    }
}

impl<'de> Deserialize<'de> for Starts {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrMoreNumbers).map(Self)
    }
}
