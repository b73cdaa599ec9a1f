//! From the table back to the correction, or what is wrong with it.

use super::{
    MILLI, Network, Numbers, activation_name, coefficient_unit, feature_unit, index, map_name,
    place, source_unit,
};
use crate::error::{Error, Result, counted};
use crate::estimate::network::arm::{Hinge, ScrewArm};
use crate::estimate::network::basis::{BasisTerm, OutputMotion, Wave};
use crate::estimate::network::correction::{
    Body, Correction, Feature, JointMotion, Map, NetworkScaling, Networks, Scaling,
};
use crate::estimate::network::linear::Linear;
use crate::estimate::network::process::Process;
use crate::estimate::network::region::{Jointly, Region, Valid};
use crate::estimate::network::{Activation, LayerSizes, OUTPUTS};
use std::collections::BTreeMap;

impl Network {
    /// The correction that the rows hold, of whatever kind, or none where there are no rows; [`Correction::at`] applies it.
    ///
    /// `prismatic` says which joints are. Fails where a number is missing or stands twice.
    pub fn correction(&self, prismatic: &[bool]) -> Result<Option<Correction>> {
        if self.0.is_empty() {
            return Ok(None);
        }
        let numbers = Numbers::new(&self.0)?;
        let region = region(&numbers, prismatic)?;
        let sources = region.ranges.len();
        let body = if numbers.has("coefficient") {
            Body::Linear(linear(&numbers, sources)?)
        } else if numbers.has("signal") {
            let dress = dress(&numbers, prismatic, sources)?;
            let process = process(&numbers, dress.features.len())?;
            Body::Process(dress, process)
        } else {
            let dress = dress(&numbers, prismatic, sources)?;
            let networks = networks(&numbers, dress.features.len(), prismatic)?;
            Body::Networks(dress, networks)
        };
        Ok(Some(Correction {
            body,
            region,
            left: numbers.shared("left", 0)? / MILLI,
        }))
    }
}

fn region(numbers: &Numbers, prismatic: &[bool]) -> Result<Region> {
    let range = |source: usize| -> Result<Valid> {
        let bound = |part: &str| {
            Ok::<f64, Error>(numbers.shared(part, source + 1)? / source_unit(source, prismatic))
        };
        Ok(Valid {
            lower: bound("valid_lower")?,
            upper: bound("valid_upper")?,
            margin: bound("valid_margin")?,
        })
    };
    let ranges = (0..numbers.count("valid_lower"))
        .map(range)
        .collect::<Result<Vec<Valid>>>()?;
    let joints = numbers.count("joint_mean");
    if joints > ranges.len() {
        return Err(Error::data("network", "more joints than sources"));
    }
    let mut jointly = None;
    if joints > 0 {
        let mean = |j: usize| Ok(numbers.shared("joint_mean", j + 1)? / source_unit(j, prismatic));
        let factor = |i: usize, j: usize| {
            Ok(numbers.of(0, "joint_factor", [0, i + 1, j + 1])? * source_unit(j, prismatic))
        };
        jointly = Some(Jointly {
            mean: (0..joints).map(mean).collect::<Result<_>>()?,
            factor: (0..joints)
                .map(|i| (0..=i).map(|j| factor(i, j)).collect())
                .collect::<Result<_>>()?,
            limit: numbers.shared("joint_limit", 0)?,
            margin: numbers.shared("joint_margin", 0)?,
        });
    }
    Ok(Region { ranges, jointly })
}

fn dress(numbers: &Numbers, prismatic: &[bool], sources: usize) -> Result<NetworkScaling> {
    let mut features = BTreeMap::new();
    for map in [Map::Value, Map::Sin, Map::Cos] {
        for ((_, to, from), _) in numbers.all(map_name(map)) {
            features.insert(
                to,
                Feature {
                    source: index(from, 1)?,
                    map,
                },
            );
        }
    }
    let features: Vec<Feature> = features.into_values().collect();
    if features.is_empty() || features.iter().any(|feature| feature.source >= sources) {
        return Err(Error::data("network", "an input without a valid range"));
    }
    let scaling = |what: &str, to: usize, unit: f64| -> Result<Scaling> {
        let scale = numbers.shared(&format!("{what}_scale"), to)? / unit;
        Ok(Scaling {
            mean: numbers.shared(&format!("{what}_mean"), to)? / unit,
            scale,
        })
    };
    let inputs = features
        .iter()
        .enumerate()
        .map(|(i, f)| scaling("input", i + 1, feature_unit(*f, prismatic)));
    let inputs = inputs.collect::<Result<Vec<Scaling>>>()?;
    let outputs = [
        scaling("output", 1, MILLI)?,
        scaling("output", 2, MILLI)?,
        scaling("output", 3, MILLI)?,
    ];
    Ok(NetworkScaling {
        features,
        inputs,
        outputs,
    })
}

fn networks(numbers: &Numbers, inputs: usize, prismatic: &[bool]) -> Result<Networks> {
    let activation = [Activation::Sigmoid, Activation::Tanh]
        .into_iter()
        .find(|a| numbers.has(activation_name(*a)));
    let activation =
        activation.ok_or_else(|| Error::data("network", "neither `sigmoid` nor `tanh`"))?;
    let mut joints = None;
    if numbers.has("joint_scale") {
        let arm = arm(numbers)?;
        let scale = |joint: usize| {
            Ok(numbers.shared("joint_scale", joint + 1)? / source_unit(joint, prismatic))
        };
        let scales = (0..arm.hinges.len())
            .map(scale)
            .collect::<Result<Vec<f64>>>()?;
        if scales.len() != prismatic.len() {
            let message = format!(
                "motions of {}, of a robot that has {}",
                counted(scales.len(), "joint"),
                prismatic.len()
            );
            return Err(Error::data("network", message));
        }
        joints = Some(JointMotion { arm, scales });
    }
    let outputs = joints
        .as_ref()
        .map_or(OUTPUTS, |motion: &JointMotion| motion.scales.len());
    // The first member's biases are those of the hidden layer and of the outputs.
    let hidden = numbers.first_member("bias").saturating_sub(outputs);
    let shape = LayerSizes {
        inputs,
        hidden,
        outputs,
        activation,
    };
    let member = |member: usize| -> Result<Vec<f64>> {
        let value = |index: usize| {
            let (part, place) = place(shape, index);
            numbers.of(member, part, place)
        };
        (0..shape.parameters()).map(value).collect()
    };
    Ok(Networks {
        shape,
        joints,
        members: (1..=numbers.members("bias"))
            .map(member)
            .collect::<Result<_>>()?,
    })
}

fn process(numbers: &Numbers, inputs: usize) -> Result<Process> {
    let lengths = (0..inputs)
        .map(|i| numbers.of(0, "length", [0, 0, i + 1]))
        .collect::<Result<Vec<f64>>>()?;
    let rows = numbers.count("row") / inputs.max(1);
    let row = |r: usize| {
        (0..inputs)
            .map(|i| numbers.of(0, "row", [0, r + 1, i + 1]))
            .collect::<Result<Vec<f64>>>()
    };
    let rows = (0..rows).map(row).collect::<Result<Vec<_>>>()?;
    let alpha = (0..rows.len())
        .map(|r| numbers.row("alpha", r + 1))
        .collect::<Result<Vec<_>>>()?;
    Process::remember(
        lengths,
        numbers.shared("signal", 0)?,
        numbers.shared("noise", 0)?,
        rows,
        alpha,
    )
    .ok_or_else(|| Error::data("network", "the rows of the process depend on each other"))
}

fn linear(numbers: &Numbers, sources: usize) -> Result<Linear> {
    let arm = if numbers.has("tool") {
        Some(arm(numbers)?)
    } else {
        None
    };
    let joints = arm
        .as_ref()
        .map_or(sources, |arm| arm.hinges.len().min(sources));
    let within = |value: i64, count: usize| -> Result<usize> {
        let found = index(value, 1)?;
        if found < count {
            Ok(found)
        } else {
            Err(Error::data(
                "network",
                format!("no joint, body or axis {value}"),
            ))
        }
    };
    let mut terms: BTreeMap<i64, BasisTerm> = BTreeMap::new();
    for part in ["along", "turn", "shift", "tilt"] {
        for ((layer, to, from), _) in numbers.all(part) {
            let station = index(layer, 0)?;
            if station > joints {
                return Err(Error::data("network", format!("no station {station}")));
            }
            let way = match part {
                "along" => OutputMotion::Along(within(from, 3)?),
                "turn" => OutputMotion::Turn(within(from, joints)?),
                "shift" => OutputMotion::Shift(station, within(from, 3)?),
                _ => OutputMotion::Tilt(station, within(from, 3)?),
            };
            terms.insert(
                to,
                BasisTerm {
                    way,
                    waves: Vec::new(),
                },
            );
        }
    }
    for part in ["sin", "cos", "value", "torque"] {
        for ((layer, to, from), _) in numbers.all(part) {
            let joint = within(from, joints)?;
            let wave = match part {
                "sin" => Wave::Sin(joint, index(layer, 0)?),
                "cos" => Wave::Cos(joint, index(layer, 0)?),
                "value" => Wave::Value(joint),
                _ => Wave::Torque(joint, within(layer, joints)?),
            };
            let term = terms.get_mut(&to).ok_or_else(|| {
                Error::data("network", format!("a wave of term {to}, which is none"))
            })?;
            term.waves.push(wave);
        }
    }
    let terms: Vec<BasisTerm> = terms.into_values().collect();
    let coefficient = |member: usize, t: usize, term: &BasisTerm| {
        Ok::<f64, Error>(numbers.of(member, "coefficient", [0, t + 1, 0])? / coefficient_unit(term))
    };
    let member = |member: usize| {
        terms
            .iter()
            .enumerate()
            .map(|(t, term)| coefficient(member, t, term))
            .collect::<Result<_>>()
    };
    let members = (1..=numbers.members("coefficient"))
        .map(member)
        .collect::<Result<Vec<Vec<f64>>>>()?;
    Ok(Linear {
        arm,
        members,
        noise: numbers.shared("terms_noise", 0)? / MILLI,
        terms,
    })
}

fn arm(numbers: &Numbers) -> Result<ScrewArm> {
    let hinge = |j: usize| -> Result<Hinge> {
        let slides = numbers.shared("slides", j + 1)? != 0.0;
        let point: [f64; 3] = numbers.row("point", j + 1)?;
        Ok(Hinge {
            axis: numbers.row("axis", j + 1)?,
            point: point.map(|value| value / MILLI),
            slides,
        })
    };
    let hinges = (0..numbers.count("slides"))
        .map(hinge)
        .collect::<Result<Vec<Hinge>>>()?;
    let tool: [f64; 3] = numbers.row("tool", 0)?;
    Ok(ScrewArm {
        hinges,
        tool: tool.map(|value| value / MILLI),
        down: numbers.row("down", 0)?,
    })
}
