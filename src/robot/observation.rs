//! Measurements as the numerics see them: joint positions, measured points, and the circumstances of each.

use nalgebra::Vector3;

/// Measured points, struct of arrays; per-joint quantities row-major (`row * joints + joint`). SI; NaN where a row lacks a quantity.
#[derive(Debug, Clone, Default)]
pub struct Measurements {
    pub joints: usize,
    /// rad or m.
    pub q: Vec<f64>,
    /// Measured point, tracker frame, m.
    pub position: Vec<Vector3<f64>>,
    /// Standard deviation per axis, m.
    pub sigma: Vec<Vector3<f64>>,
    /// kg; 0 where nothing was said.
    pub payload: Vec<f64>,
    /// A.
    pub current: Option<Vec<f64>>,
}

impl Measurements {
    pub fn rows(&self) -> usize {
        self.position.len()
    }

    pub fn q(&self, row: usize) -> &[f64] {
        &self.q[row * self.joints..(row + 1) * self.joints]
    }

    pub fn current(&self, row: usize) -> Option<&[f64]> {
        self.current.as_ref().map(|all| &all[row * self.joints..(row + 1) * self.joints])
    }

    /// Length (m) of the one-sigma noise of a row: root of the summed variances.
    pub fn noise(&self, row: usize) -> f64 {
        self.sigma[row].norm()
    }
}

/// The tracker's point noise: (constant + per_metre * range) / coverage is one sigma per axis.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Instrument {
    /// Constant part of the stated noise, um.
    #[serde(default = "constant")]
    pub constant_um: f64,
    /// Part that grows with range, um per metre.
    #[serde(default = "per_metre")]
    pub per_metre_um: f64,
    /// How many sigmas the stated figures are.
    #[serde(default = "coverage")]
    pub coverage: f64,
}

// The tracker of the paper (Sec. 6): 10 um + 2.5 um/m, a 2-sigma figure.
fn constant() -> f64 {
    10.0
}
fn per_metre() -> f64 {
    2.5
}
fn coverage() -> f64 {
    2.0
}

impl Default for Instrument {
    fn default() -> Self {
        Self { constant_um: constant(), per_metre_um: per_metre(), coverage: coverage() }
    }
}

impl Instrument {
    /// One standard deviation per axis (m) at a point in the tracker's frame.
    pub fn sigma(&self, position: &Vector3<f64>) -> f64 {
        (self.constant_um + self.per_metre_um * position.norm()) * 1e-6 / self.coverage
    }

    /// What is wrong with the figures, if anything.
    pub fn fault(&self) -> Option<&'static str> {
        let fine = self.constant_um >= 0.0 && self.per_metre_um >= 0.0 && self.coverage > 0.0;
        let something = self.constant_um + self.per_metre_um > 0.0;
        (!fine || !something).then_some(
            "expected a noise above zero and a coverage above zero, e.g. {constant_um: 10, per_metre_um: 2.5, coverage: 2}",
        )
    }
}
