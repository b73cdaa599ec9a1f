//! A multilayer perceptron with one hidden layer and linear outputs: where its parameters lie, and its outputs at one row.
//!
//! `y_k = b_k + sum_h w_kh f(b_h + sum_i w_hi x_i)` (Eq. 41), `f` the sigmoid of Eq. 42 or tanh. Parameters lie flat: hidden weights
//! (row per neuron), hidden biases, output weights (row per output), output biases.

use pulp::Simd;
use std::f64::consts::{LN_2, LOG2_E};
use std::ops::Range;

/// Axes of the position residual, and outputs of a network that does not go through the Jacobian.
pub const OUTPUTS: usize = 3;

/// Root mean square of what values are off a mean, all axes together.
pub(super) fn scatter(values: &[[f64; OUTPUTS]], mean: &[f64; OUTPUTS]) -> f64 {
    let pairs = values.iter().flatten().zip(mean.iter().cycle());
    let squares: f64 = pairs.map(|(value, mean)| (value - mean).powi(2)).sum();
    (squares / (OUTPUTS * values.len().max(1)) as f64).sqrt()
}

/// Numbers of neurons; the parameters are kept apart from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LayerSizes {
    /// Width of the input layer.
    pub inputs: usize,
    /// Neurons.
    pub hidden: usize,
    /// Width of the output layer.
    pub outputs: usize,
    /// Activation of the hidden layer.
    pub activation: Activation,
}

impl LayerSizes {
    /// How many weights and biases.
    pub fn parameters(&self) -> usize {
        self.output_biases().end
    }
    /// Their place among the parameters, a row of inputs for each neuron.
    pub fn hidden_weights(&self) -> Range<usize> {
        0..self.hidden * self.inputs
    }
    /// Their place among the parameters.
    pub fn hidden_biases(&self) -> Range<usize> {
        let start = self.hidden_weights().end;
        start..start + self.hidden
    }
    /// Their place among the parameters, a row of neurons for each output.
    pub fn output_weights(&self) -> Range<usize> {
        let start = self.hidden_biases().end;
        start..start + self.outputs * self.hidden
    }
    /// Their place among the parameters.
    pub fn output_biases(&self) -> Range<usize> {
        let start = self.output_weights().end;
        start..start + self.outputs
    }
    /// Outputs for a single row of scaled inputs.
    pub fn at(&self, parameters: &[f64], x: &[f64]) -> Vec<f64> {
        let weights = &parameters[self.hidden_weights()];
        let biases = &parameters[self.hidden_biases()];
        let out = &parameters[self.output_weights()];
        let mut y = parameters[self.output_biases()].to_vec();
        for h in 0..self.hidden {
            let row = &weights[h * self.inputs..(h + 1) * self.inputs];
            let a = self
                .activation
                .value(row.iter().zip(x).fold(biases[h], |sum, (w, x)| sum + w * x));
            for (k, y) in y.iter_mut().enumerate() {
                *y += out[k * self.hidden + h] * a;
            }
        }
        y
    }
}

/// Activation of the hidden layer.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "ActivationSetting")]
pub enum Activation {
    /// `1 / (1 + exp(-x))`, as in the paper.
    Sigmoid,
    /// `tanh(x)`.
    Tanh,
}

/// Exponents beyond it make a sigmoid 0 or 1, while powers of 2 up to it are finite, also multiplied by `E` and `O`.
pub(super) const FARTHEST: f64 = 1000.0;
/// Added to a number of less than 2^51 it leaves that number, rounded and with a double's bias of the exponent, in the last bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0 + 1023.0;
/// Where a double has its exponent.
const EXPONENT: u32 = 52;
/// Coefficients of `E` (even powers of `f`) and `O` (odd ones): 30240 + 15120 x + 3360 x^2 + 420 x^3 + 30 x^4 + x^5 at `x = f ln 2`,
/// divided by that of `f^5`.
const EVEN: [f64; 3] = [
    30240.0 / (LN_2 * LN_2 * LN_2 * LN_2 * LN_2),
    3360.0 / (LN_2 * LN_2 * LN_2),
    30.0 / LN_2,
];
const ODD: [f64; 2] = [15120.0 / (LN_2 * LN_2 * LN_2 * LN_2), 420.0 / (LN_2 * LN_2)];

/// `1 / (1 + 2^t)` for `t` within [`FARTHEST`].
#[inline(always)]
fn sigmoid(t: f64) -> f64 {
    let rounded = t + ROUNDER;
    let f = t - (rounded - ROUNDER);
    let square = f * f;
    let odd = f * (ODD[0] + square * (ODD[1] + square));
    let even = EVEN[0] + square * (EVEN[1] + square * EVEN[2]);
    let power = f64::from_bits(rounded.to_bits() << EXPONENT);
    let below = even - odd;
    below / (below + power * (even + odd))
}

impl Activation {
    /// What a hidden neuron's sum is multiplied by to be the exponent `t` of [`Activation::apply`].
    pub(super) fn factor(self) -> f64 {
        match self {
            Self::Sigmoid => -LOG2_E,
            Self::Tanh => -2.0 * LOG2_E,
        }
    }

    /// Its value at z.
    pub fn value(self, z: f64) -> f64 {
        let mut value = [(z * self.factor()).clamp(-FARTHEST, FARTHEST)];
        self.apply(&mut value);
        value[0]
    }

    /// Every exponent, none beyond [`FARTHEST`], replaced by the value of the activation.
    #[inline(always)]
    pub(super) fn apply(self, exponents: &mut [f64]) {
        match self {
            Self::Sigmoid => {
                for t in exponents {
                    *t = sigmoid(*t);
                }
            }
            Self::Tanh => {
                for t in exponents {
                    *t = 2.0 * sigmoid(*t) - 1.0;
                }
            }
        }
    }

    /// Multiplies `delta` by the derivative, from the values: Eq. 43 for the sigmoid.
    #[inline(always)]
    pub(super) fn slope(self, delta: &mut [f64], values: &[f64]) {
        match self {
            Self::Sigmoid => {
                for (d, a) in delta.iter_mut().zip(values) {
                    *d *= a * (1.0 - a);
                }
            }
            Self::Tanh => {
                for (d, a) in delta.iter_mut().zip(values) {
                    *d *= 1.0 - a * a;
                }
            }
        }
    }
}

/// Rows that are worked on together, and partial sums of a scalar product.
pub(super) const LANES: usize = 8;
/// Rows of a block: what a core's first cache holds for all neurons at once.
pub(super) const BLOCK: usize = 16 * LANES;
/// A number of each row of a block.
pub(super) type BlockColumn = [f64; BLOCK];

/// Rows of the small matrix that are worked on together: what sixteen registers hold with room for their factors.
const TILE: usize = 4;

/// A small matrix and the columns that it is multiplied by.
#[derive(Clone, Copy)]
pub(super) struct LaneProduct<'a> {
    /// Added to each row of the product; zero where it is empty.
    pub(crate) biases: &'a [f64],
    /// The matrix, column after column.
    pub(crate) weights: &'a [f64],
    pub(crate) columns: &'a [BlockColumn],
    /// Rows of each column to work on.
    pub(crate) length: usize,
}

impl LaneProduct<'_> {
    /// Writes `out[m] = biases[m] + sum_k weights[m, k] columns[k]`, summed in this order.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(&self, simd: S, out: &mut [BlockColumn]) {
        let (mut m, count) = (0, out.len());
        while m < count {
            match count - m {
                1 => self.tile::<S, 1>(simd, m, out),
                2 => self.tile::<S, 2>(simd, m, out),
                3 => self.tile::<S, 3>(simd, m, out),
                _ => self.tile::<S, TILE>(simd, m, out),
            }
            m += TILE;
        }
    }

    /// `M` columns of the product from `first` on.
    #[inline(always)]
    fn tile<S: Simd, const M: usize>(&self, simd: S, first: usize, out: &mut [BlockColumn]) {
        let vectors = LANES / S::F64_LANES;
        let mut start = [simd.splat_f64s(0.0); M];
        for (start, bias) in start.iter_mut().zip(self.biases.iter().skip(first)) {
            *start = simd.splat_f64s(*bias);
        }
        let count = out.len();
        let Some(out) = out[first..].first_chunk_mut::<M>() else {
            return;
        };
        for row in (0..self.length).step_by(LANES) {
            // Only the first `vectors` of each are used, a number that is known when this is compiled for a machine.
            let mut sums = start.map(|start| [start; LANES]);
            for (weights, column) in self.weights.chunks_exact(count).zip(self.columns) {
                let Some(weights) = weights[first..].first_chunk::<M>() else {
                    return;
                };
                let column = S::as_simd_f64s(&column[row..row + LANES]).0;
                for (sums, weight) in sums.iter_mut().zip(weights) {
                    let weight = simd.splat_f64s(*weight);
                    for v in 0..vectors {
                        sums[v] = simd.add_f64s(sums[v], simd.mul_f64s(weight, column[v]));
                    }
                }
            }
            for (out, sums) in out.iter_mut().zip(&sums) {
                S::as_mut_simd_f64s(&mut out[row..row + LANES])
                    .0
                    .copy_from_slice(&sums[..vectors]);
            }
        }
    }
}

/// `a . b`: element `i` goes to partial sum `i % LANES`, and these are added by halves.
#[inline(always)]
pub(super) fn dot<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    let vectors = LANES / S::F64_LANES;
    let mut sums = [simd.splat_f64s(0.0); LANES];
    let (a, b) = (S::as_simd_f64s(a).0, S::as_simd_f64s(b).0);
    for (a, b) in a.chunks_exact(vectors).zip(b.chunks_exact(vectors)) {
        for v in 0..vectors {
            sums[v] = simd.add_f64s(sums[v], simd.mul_f64s(a[v], b[v]));
        }
    }
    by_halves::<S>(&sums[..vectors])
}

/// The sum of `a` in the order of [`dot`].
#[inline(always)]
pub(super) fn sum<S: Simd>(simd: S, a: &[f64]) -> f64 {
    let vectors = LANES / S::F64_LANES;
    let mut sums = [simd.splat_f64s(0.0); LANES];
    for a in S::as_simd_f64s(a).0.chunks_exact(vectors) {
        for v in 0..vectors {
            sums[v] = simd.add_f64s(sums[v], a[v]);
        }
    }
    by_halves::<S>(&sums[..vectors])
}

#[inline(always)]
fn by_halves<S: Simd>(sums: &[S::f64s]) -> f64 {
    let mut lanes = [0.0; LANES];
    S::as_mut_simd_f64s(&mut lanes).0.copy_from_slice(sums);
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}
