//! A trained correction: networks with one hidden layer, their scaling, inputs and valid range.

use crate::error::{Error, Result};
use crate::estimate::network::correction::{Correction, Feature, Map, Scaling, Valid};
use crate::estimate::network::{Activation, Shape};
use std::collections::BTreeMap;

crate::table::rows! { "network",
    /// Numbers of the networks, one a row; key (`member`, `part`, `layer`, `to`, `from`). No rows: no correction.
    ///
    /// Joints and payload are sources: joint `j` is `j`, the payload one more than the number of joints.
    pub struct Network of NetworkRow {
        /// The network from 1; 0 for what all networks share.
        member: i64,
        /// `weight`, `bias`; shared: `input_value`, `input_sin`, `input_cos` (of source `from`), `input_mean`, `input_scale`,
        /// `output_mean`, `output_scale`, `valid_lower`, `valid_upper`, `valid_margin` (of source `to`; the correction is gone one
        /// margin beyond the range), `sigmoid`, `tanh`.
        part: String,
        layer: i64,
        to: i64,
        from: i64,
        /// Dimensionless for weights and biases; else in the unit of what it scales: mm, rad or kg.
        value: f64,
    }
}

/// mm per m.
const MILLI: f64 = 1e3;

impl Network {
    /// The table of a correction; `prismatic` says which sources are lengths.
    pub fn of(correction: &Correction, prismatic: &[bool]) -> Self {
        let mut rows = Vec::new();
        let mut put = |member: usize, part: &str, layer: usize, to: usize, from: usize, value: f64| {
            let number = |n: usize| i64::try_from(n).expect("a small number");
            rows.push(NetworkRow {
                member: number(member),
                part: part.into(),
                layer: number(layer),
                to: number(to),
                from: number(from),
                value,
            });
        };
        let shape = correction.shape;
        put(0, activation_name(shape.activation), 0, 0, 0, 1.0);
        for (i, (feature, scaling)) in correction.features.iter().zip(&correction.inputs).enumerate() {
            let unit = unit_of(*feature, prismatic);
            put(0, map_name(feature.map), 0, i + 1, feature.source + 1, 1.0);
            put(0, "input_mean", 0, i + 1, 0, scaling.mean * unit);
            put(0, "input_scale", 0, i + 1, 0, scaling.scale * unit);
        }
        for (k, scaling) in correction.outputs.iter().enumerate() {
            put(0, "output_mean", 0, k + 1, 0, scaling.mean * MILLI);
            put(0, "output_scale", 0, k + 1, 0, scaling.scale * MILLI);
        }
        for (source, valid) in correction.valid.iter().enumerate() {
            let unit = unit_of(Feature { source, map: Map::Value }, prismatic);
            put(0, "valid_lower", 0, source + 1, 0, valid.lower * unit);
            put(0, "valid_upper", 0, source + 1, 0, valid.upper * unit);
            put(0, "valid_margin", 0, source + 1, 0, valid.margin * unit);
        }
        for (m, parameters) in correction.members.iter().enumerate() {
            for (index, value) in parameters.iter().enumerate() {
                let (part, layer, to, from) = place(shape, index);
                put(m + 1, part, layer, to, from, *value);
            }
        }
        Self(rows)
    }

    /// The correction that the rows hold, or none where there are no rows. Fails where a number is missing or stands twice.
    pub fn correction(&self, prismatic: &[bool]) -> Result<Option<Correction>> {
        if self.0.is_empty() {
            return Ok(None);
        }
        let mut numbers = BTreeMap::new();
        for row in &self.0 {
            let key = (row.member, row.part.as_str(), row.layer, row.to, row.from);
            if numbers.insert(key, row.value).is_some() {
                return Err(Error::data("network", format!("{key:?} stands twice")));
            }
        }
        let count = |part: &str| self.0.iter().filter(|row| row.part == part).count();
        let shared = |part: &str, to: usize| number(&numbers, 0, part, 0, to, 0);
        let activation = [Activation::Sigmoid, Activation::Tanh].into_iter().find(|a| count(activation_name(*a)) == 1);
        let activation = activation.ok_or_else(|| Error::data("network", "neither `sigmoid` nor `tanh`"))?;
        let maps = [Map::Value, Map::Sin, Map::Cos];
        let mut features = BTreeMap::new();
        for row in &self.0 {
            if let Some(map) = maps.into_iter().find(|map| map_name(*map) == row.part) {
                let source = usize::try_from(row.from - 1).map_err(|_| Error::data("network", "an input without a source"))?;
                features.insert(row.to, Feature { source, map });
            }
        }
        let features: Vec<Feature> = features.into_values().collect();
        let valid = (0..count("valid_lower"))
            .map(|source| {
                let unit = unit_of(Feature { source, map: Map::Value }, prismatic);
                let bound = |part: &str| Ok::<f64, Error>(shared(part, source + 1)? / unit);
                Ok(Valid { lower: bound("valid_lower")?, upper: bound("valid_upper")?, margin: bound("valid_margin")? })
            })
            .collect::<Result<Vec<Valid>>>()?;
        if features.is_empty() || features.iter().any(|feature| feature.source >= valid.len()) {
            return Err(Error::data("network", "an input without a valid range"));
        }
        let scaling = |what: &str, to: usize, unit: f64| -> Result<Scaling> {
            let scale = shared(&format!("{what}_scale"), to)? / unit;
            Ok(Scaling { mean: shared(&format!("{what}_mean"), to)? / unit, scale })
        };
        let inputs = features.iter().enumerate().map(|(i, f)| scaling("input", i + 1, unit_of(*f, prismatic)));
        let inputs = inputs.collect::<Result<Vec<Scaling>>>()?;
        let outputs = [scaling("output", 1, MILLI)?, scaling("output", 2, MILLI)?, scaling("output", 3, MILLI)?];
        let hidden = self.0.iter().filter(|row| row.member == 1 && row.part == "bias" && row.layer == 1).count();
        let shape = Shape { inputs: features.len(), hidden, activation };
        let last = self.0.iter().map(|row| row.member).max().unwrap_or(0);
        let members = (1..=last)
            .map(|member| {
                (0..shape.parameters())
                    .map(|index| {
                        let (part, layer, to, from) = place(shape, index);
                        number(&numbers, member, part, layer, to, from)
                    })
                    .collect()
            })
            .collect::<Result<Vec<Vec<f64>>>>()?;
        Ok(Some(Correction { shape, features, inputs, outputs, valid, members }))
    }
}

type Numbers<'a> = BTreeMap<(i64, &'a str, i64, i64, i64), f64>;

fn number(numbers: &Numbers, member: i64, part: &str, layer: usize, to: usize, from: usize) -> Result<f64> {
    let key = (member, part, layer as i64, to as i64, from as i64);
    numbers.get(&key).copied().ok_or_else(|| Error::data("network", format!("no row {key:?}")))
}

/// Where parameter `index` stands in the table: part, layer, to, from.
fn place(shape: Shape, index: usize) -> (&'static str, usize, usize, usize) {
    if shape.hidden_weights().contains(&index) {
        ("weight", 1, index / shape.inputs + 1, index % shape.inputs + 1)
    } else if shape.hidden_biases().contains(&index) {
        ("bias", 1, index - shape.hidden_biases().start + 1, 0)
    } else if shape.output_weights().contains(&index) {
        let index = index - shape.output_weights().start;
        ("weight", 2, index / shape.hidden + 1, index % shape.hidden + 1)
    } else {
        ("bias", 2, index - shape.output_biases().start + 1, 0)
    }
}

/// Stored per SI: a length is stored in mm, everything else as it is.
fn unit_of(feature: Feature, prismatic: &[bool]) -> f64 {
    let length = feature.map == Map::Value && prismatic.get(feature.source).copied().unwrap_or(false);
    if length { MILLI } else { 1.0 }
}

fn map_name(map: Map) -> &'static str {
    match map {
        Map::Value => "input_value",
        Map::Sin => "input_sin",
        Map::Cos => "input_cos",
    }
}

fn activation_name(activation: Activation) -> &'static str {
    match activation {
        Activation::Sigmoid => "sigmoid",
        Activation::Tanh => "tanh",
    }
}
