//! The noise of the recording: standard deviations as they were recorded, else by the instrument, else a weight to start from.

use super::Ingest;
use super::arm::Slots;
use super::columns::Join;
use crate::error::{Place, did_you_mean};
use crate::observation::Part;
use calib_numerics::robot::{INSTRUMENTS, Instrument, START, SigmaSource};
use nalgebra::Vector3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

/// The instrument by which points were measured: its name, or its figures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum InstrumentSetting {
    /// By name.
    Named(&'static str),
    /// By numbers.
    Figures(Instrument),
}

impl InstrumentSetting {
    pub(super) fn figures(self) -> Instrument {
        match self {
            Self::Named(name) => Instrument::named(name).unwrap_or(START),
            Self::Figures(figures) => figures,
        }
    }
}

impl<'de> Deserialize<'de> for InstrumentSetting {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // By hand, so that the message says what is allowed.
        deserializer.deserialize_any(NameOrFigures)
    }
}

/// Names of the instruments whose figures are known.
pub fn instruments() -> Vec<&'static str> {
    INSTRUMENTS.iter().map(|known| known.name).collect()
}

struct NameOrFigures;

impl<'de> Visitor<'de> for NameOrFigures {
    type Value = InstrumentSetting;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of an instrument, or its figures, e.g. {constant_um: 10, per_metre_um: 2.5, coverage: 2}")
    }
    fn visit_str<E: de::Error>(self, name: &str) -> Result<InstrumentSetting, E> {
        let known = INSTRUMENTS.iter().find(|known| known.name == name);
        known.map(|known| InstrumentSetting::Named(known.name)).ok_or_else(|| {
            let names = instruments();
            let hint = did_you_mean(name, names.iter().copied());
            let names = names.join(", ");
            E::custom(format!(
                "unknown instrument `{name}`{hint}; allowed: {names}, or figures, e.g. {{constant_um: 10, per_metre_um: 2.5, coverage: 2}}"
            ))
        })
    }
    fn visit_map<A: MapAccess<'de>>(self, access: A) -> Result<InstrumentSetting, A::Error> {
        Instrument::deserialize(MapAccessDeserializer::new(access)).map(InstrumentSetting::Figures)
    }
}

impl JsonSchema for InstrumentSetting {
    fn schema_name() -> Cow<'static, str> {
        "InstrumentSetting".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let named = |known: &calib_numerics::robot::PublishedInstrument| {
            json_schema!({ "const": known.name, "description": known.source }).to_value()
        };
        let mut all: Vec<serde_json::Value> = INSTRUMENTS.iter().map(named).collect();
        all.push(generator.subschema_for::<Instrument>().to_value());
        json_schema!({
            "description": "The instrument by which points were measured: its name, or its figures. (constant + per_metre * range) / coverage is one sigma of every axis.",
            "anyOf": all,
        })
    }
}

/// What is wrong with how noise is stated: a standard deviation is stated once, as such or by an uncertainty; in files that are
/// joined by one of them.
pub(super) fn faults(settings: &Ingest, at: &mut Place) {
    if let Some(InstrumentSetting::Figures(figures)) = &settings.instrument
        && let Some(fault) = figures.fault()
    {
        at.at("instrument").fault(fault);
    }
    let appended = settings.join == Some(Join::Append {});
    let mut stated: BTreeMap<&str, &str> = BTreeMap::new();
    for (index, file) in settings.files.iter().enumerate() {
        if appended {
            stated.clear();
        }
        let numbers = file.columns.numbers();
        let direct = numbers.filter(|(declared, _)| declared.part == Part::Sigma);
        let direct = direct.map(|(declared, _)| (declared.setting, declared.setting));
        let by = file.columns.uncertainties();
        let by = by.flat_map(|(declared, _, sigmas, _)| {
            sigmas.iter().map(|sigma| (*sigma, declared.setting))
        });
        let mut twice: Vec<(&str, &str)> = Vec::new();
        for (sigma, setting) in direct.chain(by) {
            let other = stated.insert(sigma, setting);
            let other = other.filter(|other| *other != setting);
            twice.extend(other.map(|other| (setting, other)));
        }
        twice.dedup();
        for (setting, other) in twice {
            let mut at = at.at(format!("files[{index}].columns.{setting}"));
            at.fault(format!(
                "states the standard deviation that `{other}` states already; map one of them"
            ));
        }
    }
}

/// Where a row's point and its standard deviations are.
pub(super) struct NoiseSlots {
    point: [usize; 3],
    sigma: [usize; 3],
    instrument: Option<Instrument>,
}

impl NoiseSlots {
    pub(super) fn new(slots: &Slots, instrument: Option<InstrumentSetting>) -> Self {
        let places = |settings: [&str; 3]| settings.map(|setting| slots.of(setting).start);
        Self {
            point: places(["x", "y", "z"]),
            sigma: places(["sigma_x", "sigma_y", "sigma_z"]),
            instrument: instrument.map(InstrumentSetting::figures),
        }
    }

    /// The places of the standard deviations.
    pub(super) fn sigma(&self) -> [usize; 3] {
        self.sigma
    }

    /// Gives every measured axis of a row's point its standard deviation (m); where the least firm of them comes from.
    pub(super) fn fill(&self, values: &mut [f64]) -> SigmaSource {
        let point = Vector3::from(self.point.map(|place| values[place]));
        let whole = point.map(|axis| if axis.is_nan() { 0.0 } else { axis });
        let (figures, otherwise) = match self.instrument {
            Some(figures) => (figures, SigmaSource::Instrument),
            None => (START, SigmaSource::Inferred),
        };
        let (mut source, mut sigma) = (SigmaSource::Recorded, None);
        for (axis, place) in point.iter().zip(self.sigma) {
            if axis.is_nan() {
                values[place] = f64::NAN;
            } else if values[place].is_nan() || values[place] <= 0.0 {
                // None was recorded, or zero, which nothing measures to.
                values[place] = *sigma.get_or_insert_with(|| figures.sigma(&whole));
                source = source.max(otherwise);
            }
        }
        source
    }
}
