//! A learned correction of any kind (networks, a Gaussian process, or linear terms), its scaling, inputs and valid region.
//!
//! The rows of a correction by their key: every number is there once, or the table is refused.

use super::{Network, NetworkRow};
use crate::error::{Error, Result};
use crate::estimate::network::arm::ScrewArm;
use crate::estimate::network::basis::{BasisTerm, OutputMotion, Wave};
use crate::estimate::network::correction::{Body, Correction, Feature, Map, NetworkScaling};
use crate::estimate::network::linear::Linear;
use crate::estimate::network::region::Region;
use crate::estimate::network::{Activation, LayerSizes};
use std::collections::BTreeMap;

mod reading;

/// mm per m.
const MILLI: f64 = 1e3;

impl Network {
    /// The table of a correction; `prismatic` says which sources are lengths.
    pub fn of(correction: &Correction, prismatic: &[bool]) -> Self {
        let mut table = Self(Vec::new());
        table.put(0, "left", [0, 0, 0], correction.left * MILLI);
        table.region(&correction.region, prismatic);
        match &correction.body {
            Body::Networks(dress, networks) => {
                table.dress(dress, prismatic);
                table.put(
                    0,
                    activation_name(networks.shape.activation),
                    [0, 0, 0],
                    1.0,
                );
                if let Some(motion) = &networks.joints {
                    table.arm(&motion.arm);
                    for (joint, scale) in motion.scales.iter().enumerate() {
                        table.put(
                            0,
                            "joint_scale",
                            [0, joint + 1, 0],
                            scale * source_unit(joint, prismatic),
                        );
                    }
                }
                for (m, parameters) in networks.members.iter().enumerate() {
                    for (index, value) in parameters.iter().enumerate() {
                        let (part, place) = place(networks.shape, index);
                        table.put(m + 1, part, place, *value);
                    }
                }
            }
            Body::Process(dress, process) => {
                table.dress(dress, prismatic);
                table.put(0, "signal", [0, 0, 0], process.signal);
                table.put(0, "noise", [0, 0, 0], process.noise);
                table.row("length", 0, 0, &process.lengths);
                for (r, (row, alpha)) in process.rows.iter().zip(&process.alpha).enumerate() {
                    table.row("row", 0, r + 1, row);
                    table.row("alpha", 0, r + 1, alpha);
                }
            }
            Body::Linear(linear) => table.linear(linear),
        }
        table
    }

    fn put(&mut self, member: usize, part: &str, place: [usize; 3], value: f64) {
        let number = |n: usize| i64::try_from(n).expect("a small number");
        let [layer, to, from] = place.map(number);
        self.0.push(NetworkRow {
            member: number(member),
            part: part.into(),
            layer,
            to,
            from,
            value,
        });
    }

    /// Values in a row of an array, `from` 1, 2, ...
    fn row(&mut self, part: &str, layer: usize, to: usize, values: &[f64]) {
        for (k, value) in values.iter().enumerate() {
            self.put(0, part, [layer, to, k + 1], *value);
        }
    }

    fn region(&mut self, region: &Region, prismatic: &[bool]) {
        for (source, valid) in region.ranges.iter().enumerate() {
            let unit = source_unit(source, prismatic);
            self.put(0, "valid_lower", [0, source + 1, 0], valid.lower * unit);
            self.put(0, "valid_upper", [0, source + 1, 0], valid.upper * unit);
            self.put(0, "valid_margin", [0, source + 1, 0], valid.margin * unit);
        }
        let Some(jointly) = &region.jointly else {
            return;
        };
        self.put(0, "joint_limit", [0, 0, 0], jointly.limit);
        self.put(0, "joint_margin", [0, 0, 0], jointly.margin);
        for (i, (mean, factor)) in jointly.mean.iter().zip(&jointly.factor).enumerate() {
            self.put(
                0,
                "joint_mean",
                [0, i + 1, 0],
                mean * source_unit(i, prismatic),
            );
            for (j, value) in factor.iter().enumerate() {
                self.put(
                    0,
                    "joint_factor",
                    [0, i + 1, j + 1],
                    value / source_unit(j, prismatic),
                );
            }
        }
    }

    fn dress(&mut self, dress: &NetworkScaling, prismatic: &[bool]) {
        for (i, (feature, scaling)) in dress.features.iter().zip(&dress.inputs).enumerate() {
            let unit = feature_unit(*feature, prismatic);
            self.put(
                0,
                map_name(feature.map),
                [0, i + 1, feature.source + 1],
                1.0,
            );
            self.put(0, "input_mean", [0, i + 1, 0], scaling.mean * unit);
            self.put(0, "input_scale", [0, i + 1, 0], scaling.scale * unit);
        }
        for (k, scaling) in dress.outputs.iter().enumerate() {
            self.put(0, "output_mean", [0, k + 1, 0], scaling.mean * MILLI);
            self.put(0, "output_scale", [0, k + 1, 0], scaling.scale * MILLI);
        }
    }

    fn linear(&mut self, linear: &Linear) {
        self.put(0, "terms_noise", [0, 0, 0], linear.noise * MILLI);
        if let Some(arm) = &linear.arm {
            self.arm(arm);
        }
        for (t, term) in linear.terms.iter().enumerate() {
            let (part, layer, from) = match term.way {
                OutputMotion::Along(axis) => ("along", 0, axis),
                OutputMotion::Turn(joint) => ("turn", 0, joint),
                OutputMotion::Shift(station, axis) => ("shift", station, axis),
                OutputMotion::Tilt(station, axis) => ("tilt", station, axis),
            };
            self.put(0, part, [layer, t + 1, from + 1], 1.0);
            for wave in &term.waves {
                let (part, layer, joint) = match *wave {
                    Wave::Sin(joint, order) => ("sin", order, joint),
                    Wave::Cos(joint, order) => ("cos", order, joint),
                    Wave::Value(joint) => ("value", 0, joint),
                    Wave::Torque(joint, body) => ("torque", body + 1, joint),
                };
                self.put(0, part, [layer, t + 1, joint + 1], 1.0);
            }
            for (m, member) in linear.members.iter().enumerate() {
                self.put(
                    m + 1,
                    "coefficient",
                    [0, t + 1, 0],
                    member[t] * coefficient_unit(term),
                );
            }
        }
    }

    fn arm(&mut self, arm: &ScrewArm) {
        for (j, hinge) in arm.hinges.iter().enumerate() {
            self.row("axis", 0, j + 1, &hinge.axis);
            self.row("point", 0, j + 1, &hinge.point.map(|value| value * MILLI));
            self.put(
                0,
                "slides",
                [0, j + 1, 0],
                if hinge.slides { 1.0 } else { 0.0 },
            );
        }
        self.row("tool", 0, 0, &arm.tool.map(|value| value * MILLI));
        self.row("down", 0, 0, &arm.down);
    }
}

/// Where parameter `index` of a network stands in the table: part, and layer, to, from.
fn place(shape: LayerSizes, index: usize) -> (&'static str, [usize; 3]) {
    if shape.hidden_weights().contains(&index) {
        (
            "weight",
            [1, index / shape.inputs + 1, index % shape.inputs + 1],
        )
    } else if shape.hidden_biases().contains(&index) {
        ("bias", [1, index - shape.hidden_biases().start + 1, 0])
    } else if shape.output_weights().contains(&index) {
        let index = index - shape.output_weights().start;
        (
            "weight",
            [2, index / shape.hidden + 1, index % shape.hidden + 1],
        )
    } else {
        ("bias", [2, index - shape.output_biases().start + 1, 0])
    }
}

/// Stored per SI: a length is stored in mm, everything else as it is.
fn source_unit(source: usize, prismatic: &[bool]) -> f64 {
    if prismatic.get(source).copied().unwrap_or(false) {
        MILLI
    } else {
        1.0
    }
}

fn feature_unit(feature: Feature, prismatic: &[bool]) -> f64 {
    if feature.map == Map::Value {
        source_unit(feature.source, prismatic)
    } else {
        1.0
    }
}

/// Shifts are stored in mm, turns in rad; per m of torque or travel where a wave is one.
fn coefficient_unit(term: &BasisTerm) -> f64 {
    if matches!(term.way, OutputMotion::Along(_) | OutputMotion::Shift(..)) {
        MILLI
    } else {
        1.0
    }
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

type NumberKey = (i64, i64, i64);

/// Values by part, then by member, and layer, to, from.
pub(super) struct Numbers<'a>(BTreeMap<&'a str, BTreeMap<i64, BTreeMap<NumberKey, f64>>>);

impl<'a> Numbers<'a> {
    /// Fails where a key stands twice.
    pub fn new(rows: &'a [NetworkRow]) -> Result<Self> {
        let mut parts: BTreeMap<&str, BTreeMap<i64, BTreeMap<NumberKey, f64>>> = BTreeMap::new();
        for row in rows {
            let part = parts
                .entry(&row.part)
                .or_default()
                .entry(row.member)
                .or_default();
            if part
                .insert((row.layer, row.to, row.from), row.value)
                .is_some()
            {
                let place = (row.layer, row.to, row.from);
                return Err(Error::data(
                    "network",
                    format!(
                        "`{}` {place:?} of member {} stands twice",
                        row.part, row.member
                    ),
                ));
            }
        }
        Ok(Self(parts))
    }

    pub(crate) fn has(&self, part: &str) -> bool {
        self.0.contains_key(part)
    }

    /// Highest number of a member that has such a part.
    pub(crate) fn members(&self, part: &str) -> usize {
        let last = self
            .0
            .get(part)
            .and_then(|members| members.keys().next_back().copied());
        last.and_then(|last| usize::try_from(last).ok())
            .unwrap_or(0)
    }

    /// All shared rows of a part: layer, to, from and value.
    pub fn all(&self, part: &str) -> impl Iterator<Item = (NumberKey, f64)> {
        self.0
            .get(part)
            .and_then(|members| members.get(&0))
            .into_iter()
            .flatten()
            .map(|(place, value)| (*place, *value))
    }

    pub(crate) fn count(&self, part: &str) -> usize {
        self.all(part).count()
    }

    /// Numbers of a part that the first member has.
    pub(crate) fn first_member(&self, part: &str) -> usize {
        self.0
            .get(part)
            .and_then(|members| members.get(&1))
            .map_or(0, BTreeMap::len)
    }

    /// A number; fails where it is missing.
    pub fn of(&self, member: usize, part: &str, [layer, to, from]: [usize; 3]) -> Result<f64> {
        let place = (layer as i64, to as i64, from as i64);
        let found = self
            .0
            .get(part)
            .and_then(|members| members.get(&(member as i64))?.get(&place));
        found.copied().ok_or_else(|| {
            Error::data(
                "network",
                format!("no `{part}` {place:?} of member {member}"),
            )
        })
    }

    /// A shared number of entry `to`.
    pub(crate) fn shared(&self, part: &str, to: usize) -> Result<f64> {
        self.of(0, part, [0, to, 0])
    }

    /// Shared numbers of entry `to`, `from` 1 to `N`.
    pub(crate) fn row<const N: usize>(&self, part: &str, to: usize) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for (k, value) in values.iter_mut().enumerate() {
            *value = self.of(0, part, [0, to, k + 1])?;
        }
        Ok(values)
    }
}

/// A number of the table that counts from `least`, from 0; fails below.
pub(super) fn index(value: i64, least: i64) -> Result<usize> {
    usize::try_from(value - least)
        .map_err(|_| Error::data("network", format!("{value} counts from {least}")))
}
