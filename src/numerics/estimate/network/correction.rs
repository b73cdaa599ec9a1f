//! A learned correction and how it applies: the one function by which any kind of it is ever used.
//!
//! Inside the region that the training saw it is what was learnt; outside, sources are held at its edge and it fades to nothing
//! (see [`Region`]).

use super::perceptron::{LayerSizes, OUTPUTS};
use super::process::Process;
use super::region::Region;
use super::ridge::Ridge;

/// How an input comes from a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Map {
    /// As it is.
    Value,
    /// Its sine.
    Sin,
    /// Its cosine.
    Cos,
}

/// One input. Sources are the joints (rad or m, from 0), then the payload (kg).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Feature {
    /// Number of the source.
    pub source: usize,
    /// What is made of it.
    pub map: Map,
}

impl Feature {
    /// Its value for the sources of a row.
    pub fn of(&self, sources: &[f64]) -> f64 {
        let value = sources[self.source];
        match self.map {
            Map::Value => value,
            Map::Sin => value.sin(),
            Map::Cos => value.cos(),
        }
    }
}

/// The inputs for a robot: each joint as it is, or revolute joints as sine and cosine; then, if wanted, the payload.
pub fn features(prismatic: &[bool], sin_cos: bool, payload: bool) -> Vec<Feature> {
    let mut features = Vec::new();
    for (source, prismatic) in prismatic.iter().enumerate() {
        if sin_cos && !prismatic {
            features.extend([Map::Sin, Map::Cos].map(|map| Feature { source, map }));
        } else {
            features.push(Feature {
                source,
                map: Map::Value,
            });
        }
    }
    if payload {
        features.push(Feature {
            source: prismatic.len(),
            map: Map::Value,
        });
    }
    features
}

/// Linear scaling: `scaled = (value - mean) / scale`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// Mean of the training rows.
    pub mean: f64,
    /// Standard deviation of the training rows.
    pub scale: f64,
}

impl Scaling {
    /// Standardises the values; a column that does not vary keeps its unit.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count().max(1) as f64;
        let mean = values.clone().sum::<f64>() / count;
        let scale = (values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / count).sqrt();
        Self {
            mean,
            scale: if scale > 1e-12 { scale } else { 1.0 },
        }
    }
    /// (value - mean) / scale.
    pub(crate) fn scaled(&self, value: f64) -> f64 {
        (value - self.mean) / self.scale
    }
}

/// Inputs and outputs with their scaling.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkScaling {
    /// Inputs, in order.
    pub features: Vec<Feature>,
    /// Scaling of each input.
    pub inputs: Vec<Scaling>,
    /// m.
    pub outputs: [Scaling; OUTPUTS],
}

impl NetworkScaling {
    /// Standardised inputs at `sources`.
    pub(crate) fn scaled(&self, sources: &[f64]) -> Vec<f64> {
        self.features
            .iter()
            .zip(&self.inputs)
            .map(|(f, scaling)| scaling.scaled(f.of(sources)))
            .collect()
    }
    /// Outputs in m.
    fn worn(&self, y: [f64; OUTPUTS]) -> [f64; 3] {
        std::array::from_fn(|k| self.outputs[k].mean + self.outputs[k].scale * y[k])
    }
    /// Root of the mean squared scale of the outputs, m.
    fn size(&self) -> f64 {
        (self.outputs.iter().map(|o| o.scale * o.scale).sum::<f64>() / OUTPUTS as f64).sqrt()
    }
}

/// What was learnt.
#[derive(Debug, Clone, PartialEq)]
pub enum Body {
    /// A network with one hidden layer and its parameters.
    Network(NetworkScaling, LayerSizes, Vec<f64>),
    /// A Gaussian process.
    Process(NetworkScaling, Process),
    /// A sum of terms.
    Ridge(Ridge),
}

/// A learned correction with everything that is needed to apply it. Positions in m, tracker frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// What computes the displacement.
    pub body: Body,
    /// Where it holds, and how it fades out beyond.
    pub region: Region,
    /// What is left of held-out rows, per axis, m: root mean square in cross-validation.
    pub left: f64,
}

/// A correction as it applies at one pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AppliedCorrection {
    /// What to add to the predicted position, m.
    pub delta: [f64; 3],
    /// 1 inside the valid region, 0 where nothing is known and `delta` is zero, between on the margin.
    pub share: f64,
    /// Standard deviation per axis of what is left, m; `None` outside the region, where nothing is known of it.
    pub spread: Option<f64>,
}

impl Correction {
    /// The correction at `sources` (joints in rad or m, then payload in kg where it was known in training).
    ///
    /// A source that is missing or no number counts as outside the region: no correction.
    pub fn at(&self, sources: &[f64]) -> AppliedCorrection {
        let share = self.region.share(sources);
        if share == 0.0 {
            return AppliedCorrection {
                delta: [0.0; 3],
                share: 0.0,
                spread: None,
            };
        }
        let (whole, doubt) = self.inside(&self.region.held(sources));
        let spread = (share == 1.0).then(|| doubt.hypot(self.left));
        AppliedCorrection {
            delta: whole.map(|value| share * value),
            share,
            spread,
        }
    }

    /// The correction within the region, and how far it is in doubt per axis, m.
    fn inside(&self, sources: &[f64]) -> ([f64; 3], f64) {
        match &self.body {
            Body::Ridge(ridge) => ridge.at(sources),
            Body::Process(dress, process) => {
                let (y, doubt) = process.at(&dress.scaled(sources));
                (dress.worn(y), doubt * dress.size())
            }
            Body::Network(dress, shape, parameters) => (
                dress.worn(shape.at(parameters, &dress.scaled(sources))),
                0.0,
            ),
        }
    }

    /// Numbers that were learnt.
    pub(crate) fn numbers(&self) -> usize {
        match &self.body {
            Body::Ridge(ridge) => OUTPUTS * ridge.terms.len(),
            Body::Process(_, process) => process.lengths.len() + 2 + OUTPUTS * process.rows.len(),
            Body::Network(_, _, parameters) => parameters.len(),
        }
    }
}
