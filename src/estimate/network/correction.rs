//! A trained correction and the range in which it may be applied.
//!
//! Inside the range that the training saw, the correction is the mean of its networks. Outside, the inputs are held at the edge and
//! the correction fades: by the smoothstep `s^2 (3 - 2 s)`, `s = 1 - distance/margin`, per source, multiplied over the sources,
//! so that it is zero one margin beyond.

use super::perceptron::{OUTPUTS, Shape};

/// The margin as a share of the range that was seen.
const MARGIN: f64 = 0.1;
/// The margin where a joint hardly moved, rad or m.
const LEAST_MARGIN: f64 = 0.01;

/// How an input comes from a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Map {
    Value,
    Sin,
    Cos,
}

/// One input of the network. Sources are the joints (rad or m, from 0), then the payload (kg).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Feature {
    pub source: usize,
    pub map: Map,
}

impl Feature {
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
            features.push(Feature { source, map: Map::Value });
        }
    }
    if payload {
        features.push(Feature { source: prismatic.len(), map: Map::Value });
    }
    features
}

/// Linear scaling: `scaled = (value - mean) / scale`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    pub mean: f64,
    pub scale: f64,
}

impl Scaling {
    /// Standardises the values; a column that does not vary keeps its unit.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count().max(1) as f64;
        let mean = values.clone().sum::<f64>() / count;
        let scale = (values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / count).sqrt();
        Self { mean, scale: if scale > 1e-12 { scale } else { 1.0 } }
    }
    pub fn scaled(&self, value: f64) -> f64 {
        (value - self.mean) / self.scale
    }
}

/// The range of a source that the training saw, and how far beyond it the correction is gone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Valid {
    pub lower: f64,
    pub upper: f64,
    pub margin: f64,
}

impl Valid {
    /// The range of a joint's positions, rad or m.
    pub fn joint(values: impl Iterator<Item = f64> + Clone) -> Self {
        Self::of(values, |_| LEAST_MARGIN)
    }
    /// The range of a payload, kg: what a load does is proportional to it, so a tenth of the load is as near as a tenth of the range.
    pub fn payload(values: impl Iterator<Item = f64> + Clone) -> Self {
        Self::of(values, |heaviest| MARGIN * heaviest.max(1.0))
    }
    fn of(values: impl Iterator<Item = f64> + Clone, least: impl Fn(f64) -> f64) -> Self {
        let lower = values.clone().fold(f64::INFINITY, f64::min);
        let upper = values.fold(f64::NEG_INFINITY, f64::max);
        Self { lower, upper, margin: (MARGIN * (upper - lower)).max(least(upper)) }
    }
    /// 1 inside, 0 from one margin outside on.
    fn share(&self, value: f64) -> f64 {
        let outside = (self.lower - value).max(value - self.upper).max(0.0);
        let s = (1.0 - outside / self.margin).max(0.0);
        s * s * (3.0 - 2.0 * s)
    }
}

/// An ensemble of equal networks with everything that is needed to apply it. Positions in m, tracker frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    pub shape: Shape,
    pub features: Vec<Feature>,
    pub inputs: Vec<Scaling>,
    pub outputs: [Scaling; OUTPUTS],
    /// By source: the joints, and the payload where it was known in training, be it an input or not.
    pub valid: Vec<Valid>,
    /// Parameters of each network.
    pub members: Vec<Vec<f64>>,
}

/// A correction as it applies at one pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Applied {
    /// What to add to the predicted position, m.
    pub delta: [f64; 3],
    /// 1 inside the valid range, 0 where nothing is known and `delta` is zero, between on the margin.
    pub share: f64,
}

impl Correction {
    /// The correction at `sources` (joints in rad or m, then payload in kg where it was known in training).
    ///
    /// A source that is missing or no number counts as outside the range: no correction.
    pub fn at(&self, sources: &[f64]) -> Applied {
        let nothing = Applied { delta: [0.0; 3], share: 0.0 };
        if sources.len() < self.valid.len() || sources.iter().take(self.valid.len()).any(|v| !v.is_finite()) {
            return nothing;
        }
        let share: f64 = self.valid.iter().zip(sources).map(|(valid, value)| valid.share(*value)).product();
        if share == 0.0 || self.members.is_empty() {
            return nothing;
        }
        let held: Vec<f64> = self.valid.iter().zip(sources).map(|(v, value)| value.clamp(v.lower, v.upper)).collect();
        let x: Vec<f64> = self.features.iter().zip(&self.inputs).map(|(f, scaling)| scaling.scaled(f.of(&held))).collect();
        let mut sum = [0.0; OUTPUTS];
        for member in &self.members {
            for (sum, y) in sum.iter_mut().zip(self.shape.at(member, &x)) {
                *sum += y;
            }
        }
        let count = self.members.len() as f64;
        let mut delta = [0.0; 3];
        for ((delta, sum), scaling) in delta.iter_mut().zip(sum).zip(&self.outputs) {
            *delta = share * (scaling.mean + scaling.scale * sum / count);
        }
        Applied { delta, share }
    }
}
