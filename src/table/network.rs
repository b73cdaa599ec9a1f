//! A learned correction of any kind (a network, a Gaussian process, or ridge on harmonics), its scaling, inputs and valid region.
//!
//! What a correction consists of stands in the rows of [`marks`] and is found again by [`shaped`]; [`visit`] names every number of it
//! once, for writing and for reading. A number that is missing or stands twice refuses the table.

use super::{Network, NetworkRow};
use crate::error::{Error, Result};
use crate::estimate::network::correction::{
    Body, Correction, Feature, Map, NetworkScaling, Scaling,
};
use crate::estimate::network::process::Process;
use crate::estimate::network::region::{Jointly, Region, Valid};
use crate::estimate::network::ridge::{Ridge, Term, Wave};
use crate::estimate::network::{Activation, LayerSizes, OUTPUTS};
use std::collections::BTreeMap;

/// mm per m.
const MILLI: f64 = 1e3;

const MAPS: [(Map, &str); 3] = [
    (Map::Value, "input_value"),
    (Map::Sin, "input_sin"),
    (Map::Cos, "input_cos"),
];

const ACTIVATIONS: [(Activation, &str); 2] =
    [(Activation::Sigmoid, "sigmoid"), (Activation::Tanh, "tanh")];

/// Member (0: shared), part, and layer, to, from.
type Key = (usize, &'static str, [usize; 3]);

/// What is done with a number, whose stored value is `unit` times as large.
type Each<'a> = dyn FnMut(Key, f64, &mut f64) -> Result<()> + 'a;

impl Network {
    /// The table of a correction; `prismatic` says which sources are lengths.
    pub fn of(correction: &Correction, prismatic: &[bool]) -> Self {
        let mut rows = Vec::new();
        let mut put = |(member, part, place): Key, value: f64| {
            let number = |n: usize| i64::try_from(n).expect("a small number");
            let [layer, to, from] = place.map(number);
            rows.push(NetworkRow {
                member: number(member),
                part: part.into(),
                layer,
                to,
                from,
                value,
            });
        };
        marks(&correction.body, |part, place| put((0, part, place), 1.0));
        let mut write = |key: Key, unit: f64, value: &mut f64| {
            put(key, *value * unit);
            Ok(())
        };
        visit(&mut correction.clone(), prismatic, &mut write).expect("every number has a place");
        Self(rows)
    }

    /// The correction that the rows hold, of whatever kind, or none where there are no rows; [`Correction::at`] applies it.
    ///
    /// `prismatic` says which joints are. Fails where a number is missing or stands twice.
    pub fn correction(&self, prismatic: &[bool]) -> Result<Option<Correction>> {
        if self.0.is_empty() {
            return Ok(None);
        }
        let numbers = Numbers::new(&self.0)?;
        let mut correction = shaped(&numbers)?;
        let mut read = |key: Key, unit: f64, value: &mut f64| {
            *value = numbers.of(key)? / unit;
            Ok(())
        };
        visit(&mut correction, prismatic, &mut read)?;
        if let Body::Process(_, process) = &mut correction.body {
            let Process { rows, alpha, .. } = process;
            let (rows, alpha) = (std::mem::take(rows), std::mem::take(alpha));
            let lengths = std::mem::take(&mut process.lengths);
            *process = Process::remember(lengths, process.signal, process.noise, rows, alpha)
                .ok_or_else(|| fault("the rows of the process depend on each other"))?;
        }
        Ok(Some(correction))
    }
}

fn fault(message: impl Into<String>) -> Error {
    Error::data("network", message.into())
}

/// Every number of a correction with its place and unit: a length is stored in mm, everything else in SI.
fn visit(correction: &mut Correction, prismatic: &[bool], each: &mut Each) -> Result<()> {
    let source_unit = |source: usize| match prismatic.get(source) {
        Some(true) => MILLI,
        _ => 1.0,
    };
    each((0, "left", [0, 0, 0]), MILLI, &mut correction.left)?;
    for (source, valid) in correction.region.ranges.iter_mut().enumerate() {
        let (place, unit) = ([0, source + 1, 0], source_unit(source));
        each((0, "valid_lower", place), unit, &mut valid.lower)?;
        each((0, "valid_upper", place), unit, &mut valid.upper)?;
        each((0, "valid_margin", place), unit, &mut valid.margin)?;
    }
    if let Some(jointly) = &mut correction.region.jointly {
        each((0, "joint_limit", [0, 0, 0]), 1.0, &mut jointly.limit)?;
        each((0, "joint_margin", [0, 0, 0]), 1.0, &mut jointly.margin)?;
        for (i, (mean, factor)) in jointly.mean.iter_mut().zip(&mut jointly.factor).enumerate() {
            each((0, "joint_mean", [0, i + 1, 0]), source_unit(i), mean)?;
            for (j, value) in factor.iter_mut().enumerate() {
                *value /= source_unit(j);
                each((0, "joint_factor", [0, i + 1, j + 1]), 1.0, value)?;
                *value *= source_unit(j);
            }
        }
    }
    match &mut correction.body {
        Body::Network(scaling, shape, parameters) => {
            visit_scaling(scaling, source_unit, each)?;
            for (index, value) in parameters.iter_mut().enumerate() {
                let (part, place) = place(*shape, index);
                each((1, part, place), 1.0, value)?;
            }
        }
        Body::Process(scaling, process) => {
            visit_scaling(scaling, source_unit, each)?;
            each((0, "signal", [0, 0, 0]), 1.0, &mut process.signal)?;
            each((0, "noise", [0, 0, 0]), 1.0, &mut process.noise)?;
            visit_row("length", 0, 1.0, &mut process.lengths, each)?;
            for (r, (row, alpha)) in process.rows.iter_mut().zip(&mut process.alpha).enumerate() {
                visit_row("row", r + 1, 1.0, row, each)?;
                visit_row("alpha", r + 1, 1.0, alpha, each)?;
            }
        }
        Body::Ridge(ridge) => {
            each((0, "terms_noise", [0, 0, 0]), MILLI, &mut ridge.noise)?;
            for (m, member) in ridge.members.iter_mut().enumerate() {
                for (t, value) in member.iter_mut().flatten().enumerate() {
                    each((m + 1, "coefficient", [0, t + 1, 0]), MILLI, value)?;
                }
            }
        }
    }
    Ok(())
}

/// Values in a row of an array, `from` 1, 2, ...
fn visit_row(
    part: &'static str,
    to: usize,
    unit: f64,
    values: &mut [f64],
    each: &mut Each,
) -> Result<()> {
    let mut values = values.iter_mut().enumerate();
    values.try_for_each(|(k, value)| each((0, part, [0, to, k + 1]), unit, value))
}

fn visit_scaling(
    scaling: &mut NetworkScaling,
    source_unit: impl Fn(usize) -> f64,
    each: &mut Each,
) -> Result<()> {
    for (i, (feature, input)) in scaling.features.iter().zip(&mut scaling.inputs).enumerate() {
        let unit = match feature.map {
            Map::Value => source_unit(feature.source),
            Map::Sin | Map::Cos => 1.0,
        };
        each((0, "input_mean", [0, i + 1, 0]), unit, &mut input.mean)?;
        each((0, "input_scale", [0, i + 1, 0]), unit, &mut input.scale)?;
    }
    for (k, output) in scaling.outputs.iter_mut().enumerate() {
        each((0, "output_mean", [0, k + 1, 0]), MILLI, &mut output.mean)?;
        each((0, "output_scale", [0, k + 1, 0]), MILLI, &mut output.scale)?;
    }
    Ok(())
}

/// Where parameter `index` of a network stands in the table: part, and layer, to, from.
fn place(shape: LayerSizes, index: usize) -> (&'static str, [usize; 3]) {
    let weight = |layer, index: usize, width| {
        let place = [layer, index / width + 1, index % width + 1];
        ("weight", place)
    };
    if shape.hidden_weights().contains(&index) {
        weight(1, index, shape.inputs)
    } else if shape.hidden_biases().contains(&index) {
        ("bias", [1, index - shape.hidden_biases().start + 1, 0])
    } else if shape.output_weights().contains(&index) {
        weight(2, index - shape.output_weights().start, shape.hidden)
    } else {
        ("bias", [2, index - shape.output_biases().start + 1, 0])
    }
}

/// What a correction consists of, apart from its numbers: part, and layer, to, from.
fn marks(body: &Body, mut mark: impl FnMut(&'static str, [usize; 3])) {
    match body {
        Body::Network(scaling, ..) | Body::Process(scaling, _) => {
            for (i, feature) in scaling.features.iter().enumerate() {
                mark(name(&MAPS, feature.map), [0, i + 1, feature.source + 1]);
            }
        }
        Body::Ridge(ridge) => {
            for (t, term) in ridge.terms.iter().enumerate() {
                for axis in 0..OUTPUTS {
                    let to = OUTPUTS * t + axis + 1;
                    mark("along", [0, to, axis + 1]);
                    for wave in term {
                        let (part, layer, joint) = match *wave {
                            Wave::Sin(joint, order) => ("sin", order, joint),
                            Wave::Cos(joint, order) => ("cos", order, joint),
                            Wave::Value(joint) => ("value", 0, joint),
                        };
                        mark(part, [layer, to, joint + 1]);
                    }
                }
            }
        }
    }
    if let Body::Network(_, shape, _) = body {
        mark(name(&ACTIVATIONS, shape.activation), [0, 0, 0]);
    }
}

fn name<T: PartialEq>(names: &[(T, &'static str)], value: T) -> &'static str {
    let found = names.iter().find(|(one, _)| *one == value);
    found.expect("a name for each").1
}

/// A correction of the shape that the rows have, its numbers still zero.
fn shaped(numbers: &Numbers) -> Result<Correction> {
    let nothing = Valid {
        lower: 0.0,
        upper: 0.0,
        margin: 0.0,
    };
    let (sources, joints) = (numbers.count("valid_lower"), numbers.count("joint_mean"));
    if joints > sources {
        return Err(fault("more joints than sources"));
    }
    numbers.hold(joints.saturating_mul(joints + 1) / 2)?;
    let jointly = (joints > 0).then(|| Jointly {
        mean: vec![0.0; joints],
        factor: (1..=joints).map(|width| vec![0.0; width]).collect(),
        limit: 0.0,
        margin: 0.0,
    });
    let body = if numbers.has("coefficient") {
        Body::Ridge(ridge(numbers, sources)?)
    } else {
        let scaling = scaling(numbers, sources)?;
        let inputs = scaling.features.len();
        if numbers.has("signal") {
            let rows = numbers.count("row") / inputs;
            let (blank, alpha) = (vec![vec![0.0; inputs]; rows], vec![[0.0; OUTPUTS]; rows]);
            let process = Process::remember(vec![1.0; inputs], 1.0, 1.0, blank, alpha);
            Body::Process(
                scaling,
                process.expect("a matrix of noise alone is not singular"),
            )
        } else {
            network(scaling, numbers)?
        }
    };
    Ok(Correction {
        body,
        region: Region {
            ranges: vec![nothing; sources],
            jointly,
        },
        left: 0.0,
    })
}

fn scaling(numbers: &Numbers, sources: usize) -> Result<NetworkScaling> {
    let mut features = BTreeMap::new();
    for (map, part) in MAPS {
        for (_, to, from) in numbers.shared(part) {
            let source = index(from, 1)?;
            features.insert(to, Feature { source, map });
        }
    }
    let features: Vec<Feature> = features.into_values().collect();
    if features.is_empty() || features.iter().any(|feature| feature.source >= sources) {
        return Err(fault("an input without a valid range"));
    }
    let nothing = Scaling {
        mean: 0.0,
        scale: 0.0,
    };
    Ok(NetworkScaling {
        inputs: vec![nothing; features.len()],
        outputs: [nothing; OUTPUTS],
        features,
    })
}

fn network(scaling: NetworkScaling, numbers: &Numbers) -> Result<Body> {
    let activation = ACTIVATIONS.iter().find(|(_, name)| numbers.has(name));
    let (activation, _) = activation.ok_or_else(|| fault("neither `sigmoid` nor `tanh`"))?;
    let count = numbers.members("bias");
    if count != 1 {
        return Err(fault(format!(
            "{count} networks where one is read: learn anew"
        )));
    }
    let shape = LayerSizes {
        inputs: scaling.features.len(),
        // The biases are those of the hidden layer and of the outputs.
        hidden: numbers.of_member(1, "bias").saturating_sub(OUTPUTS),
        activation: *activation,
    };
    numbers.hold(shape.parameters())?;
    Ok(Body::Network(scaling, shape, vec![0.0; shape.parameters()]))
}

/// Terms stand one an axis: `to` counts the axes of each in turn.
fn ridge(numbers: &Numbers, joints: usize) -> Result<Ridge> {
    let within = |value: i64| {
        let joint = index(value, 1)?;
        let known = (joint < joints).then_some(joint);
        known.ok_or_else(|| fault(format!("no joint {value}")))
    };
    let axes = numbers.shared("along");
    let axis = |t: i64| (0, t + 1, t % OUTPUTS as i64 + 1);
    let in_turn = axes.iter().zip(0..).all(|(at, t)| *at == axis(t));
    if !axes.len().is_multiple_of(OUTPUTS) || !in_turn {
        return Err(fault("`along` is not three axes for each term"));
    }
    let mut terms: Vec<Term> = vec![Vec::new(); axes.len() / OUTPUTS];
    for part in ["sin", "cos", "value"] {
        for (layer, to, from) in numbers.shared(part) {
            let (joint, order) = (within(from)?, index(layer, 0)?);
            let wave = match part {
                "sin" => Wave::Sin(joint, order),
                "cos" => Wave::Cos(joint, order),
                _ => Wave::Value(joint),
            };
            let at = index(to, 1)?;
            let term = terms.get_mut(at / OUTPUTS);
            let term = term.ok_or_else(|| fault(format!("a wave of term {to}, which is none")))?;
            if at % OUTPUTS == 0 {
                term.push(wave);
            }
        }
    }
    let members = numbers.members("coefficient");
    numbers.hold(members.saturating_mul(axes.len()))?;
    Ok(Ridge {
        members: vec![vec![[0.0; OUTPUTS]; terms.len()]; members],
        noise: 0.0,
        terms,
    })
}

/// Layer, to, from.
type Place = (i64, i64, i64);

/// Values by part and member.
struct Numbers<'a>(BTreeMap<(&'a str, i64), BTreeMap<Place, f64>>);

impl<'a> Numbers<'a> {
    /// Fails where a key stands twice.
    fn new(rows: &'a [NetworkRow]) -> Result<Self> {
        let mut parts: BTreeMap<(&str, i64), BTreeMap<Place, f64>> = BTreeMap::new();
        for row in rows {
            let place = (row.layer, row.to, row.from);
            let part = parts.entry((&row.part, row.member)).or_default();
            if part.insert(place, row.value).is_some() {
                let (part, member) = (&row.part, row.member);
                return Err(fault(format!(
                    "`{part}` {place:?} of member {member} stands twice"
                )));
            }
        }
        Ok(Self(parts))
    }

    fn has(&self, part: &str) -> bool {
        self.0.keys().any(|(name, _)| *name == part)
    }

    /// How many members have such a part.
    fn members(&self, part: &str) -> usize {
        let members = self.0.keys().filter(|(name, _)| *name == part);
        members.filter(|(_, member)| *member > 0).count()
    }

    /// Places of all shared rows of a part.
    fn shared(&self, part: &str) -> Vec<Place> {
        let places = self.0.get(&(part, 0)).into_iter().flatten();
        places.map(|(place, _)| *place).collect()
    }

    /// Fails where so many numbers cannot be there: nothing is made room for that a table only claims.
    fn hold(&self, count: usize) -> Result<()> {
        let all: usize = self.0.values().map(BTreeMap::len).sum();
        let missing = || fault(format!("{count} numbers are needed, {all} are there"));
        (count <= all).then_some(()).ok_or_else(missing)
    }

    fn count(&self, part: &str) -> usize {
        self.of_member(0, part)
    }

    /// How many numbers of a part a member has.
    fn of_member(&self, member: i64, part: &str) -> usize {
        self.0.get(&(part, member)).map_or(0, BTreeMap::len)
    }

    /// A number; fails where it is missing.
    fn of(&self, (member, part, [layer, to, from]): Key) -> Result<f64> {
        let place = (layer as i64, to as i64, from as i64);
        let numbers = self.0.get(&(part, member as i64));
        let found = numbers.and_then(|numbers| numbers.get(&place));
        found
            .copied()
            .ok_or_else(|| fault(format!("no `{part}` {place:?} of member {member}")))
    }
}

/// A number of the table that counts from `least`, from 0; fails below.
fn index(value: i64, least: i64) -> Result<usize> {
    usize::try_from(value - least).map_err(|_| fault(format!("{value} counts from {least}")))
}
