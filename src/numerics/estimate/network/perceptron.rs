//! A multilayer perceptron with one hidden layer and linear outputs: where its parameters lie, and its outputs at one row.
//!
//! `y_k = b_k + sum_h w_kh f(b_h + sum_i w_hi x_i)` (Eq. 41), `f` the sigmoid of Eq. 42 or tanh. Parameters lie flat: hidden weights
//! (row per neuron), hidden biases, output weights (row per output), output biases.

use super::activation::Activation;
use std::ops::Range;

/// Axes of the position residual, and outputs of a network that does not go through the Jacobian.
pub const OUTPUTS: usize = 3;

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
