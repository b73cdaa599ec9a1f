//! A multilayer perceptron with one hidden layer and linear outputs, its loss over rows and the gradient of that.
//!
//! `y_k = b_k + sum_h w_kh f(b_h + sum_i w_hi x_i)` (Eq. 41), `f` the sigmoid of Eq. 42 or tanh. Parameters lie flat: hidden weights
//! (row per neuron), hidden biases, output weights (row per output), output biases.

use crate::estimate::factor::axpy;
use std::ops::Range;

/// Axes of the position residual, and outputs of a network.
pub const OUTPUTS: usize = 3;

/// Numbers of neurons; the parameters are kept apart from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LayerSizes {
    /// Width of the input layer.
    pub inputs: usize,
    /// Neurons.
    pub hidden: usize,
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
        start..start + OUTPUTS * self.hidden
    }
    /// Their place among the parameters.
    pub fn output_biases(&self) -> Range<usize> {
        let start = self.output_weights().end;
        start..start + OUTPUTS
    }
    /// Outputs for a single row of scaled inputs.
    pub fn at(&self, parameters: &[f64], x: &[f64]) -> [f64; OUTPUTS] {
        let mut hidden = vec![0.0; self.hidden];
        self.forward(parameters, x, &mut hidden)
    }

    /// Outputs of a row; the activations are written to `hidden`.
    fn forward(&self, parameters: &[f64], x: &[f64], hidden: &mut [f64]) -> [f64; OUTPUTS] {
        let weights = parameters[self.hidden_weights()].chunks_exact(self.inputs);
        let neurons = hidden.iter_mut().zip(&parameters[self.hidden_biases()]);
        for ((value, bias), weights) in neurons.zip(weights) {
            *value = self.activation.value(bias + dot(weights, x));
        }
        let out = &parameters[self.output_weights()];
        let biases = &parameters[self.output_biases()];
        std::array::from_fn(|k| biases[k] + dot(&out[k * self.hidden..][..self.hidden], hidden))
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

impl Activation {
    /// Its value at z.
    fn value(self, z: f64) -> f64 {
        match self {
            Self::Sigmoid => 1.0 / (1.0 + (-z).exp()),
            Self::Tanh => z.tanh(),
        }
    }

    /// Its derivative, from its value: Eq. 43 for the sigmoid.
    fn slope(self, value: f64) -> f64 {
        match self {
            Self::Sigmoid => value * (1.0 - value),
            Self::Tanh => 1.0 - value * value,
        }
    }
}

/// What training makes small: Eq. 45 averaged over rows, `L = (1/n) (1/2 sum e^2 + decay/2 sum w^2)`, biases free.
#[derive(Debug, Clone, Copy)]
pub struct Loss<'a> {
    /// Sizes of the network's layers.
    pub shape: LayerSizes,
    /// Scaled inputs of each row.
    pub x: &'a [Vec<f64>],
    /// Scaled targets of each row.
    pub y: &'a [[f64; OUTPUTS]],
    /// Weight of half the summed squared weights relative to half the summed squared errors.
    pub decay: f64,
}

impl Loss<'_> {
    /// The loss.
    pub fn value(&self, parameters: &[f64]) -> f64 {
        self.with_decay(self.mean_squares(parameters), parameters)
    }

    /// Mean squared error of each axis over the rows, without decay.
    pub fn mean_squares(&self, parameters: &[f64]) -> [f64; OUTPUTS] {
        self.errors(parameters, |_, _, _| {})
    }

    /// The loss and the mean squared error of each axis; the loss's gradient (Eqs. 43-44) is written to `gradient`.
    pub fn gradient(&self, parameters: &[f64], gradient: &mut [f64]) -> (f64, [f64; OUTPUTS]) {
        let (shape, per_row) = (self.shape, 1.0 / self.y.len() as f64);
        let (inputs, neurons) = (shape.inputs, shape.hidden);
        let out = &parameters[shape.output_weights()];
        gradient.fill(0.0);
        let squares = self.errors(parameters, |x, hidden, errors| {
            let errors = errors.map(|error| per_row * error);
            for (k, error) in errors.into_iter().enumerate() {
                gradient[shape.output_biases().start + k] += error;
                let start = shape.output_weights().start + k * neurons;
                axpy(error, hidden, &mut gradient[start..start + neurons]);
            }
            for (h, value) in hidden.iter().enumerate() {
                let back: f64 = (0..OUTPUTS).map(|k| errors[k] * out[k * neurons + h]).sum();
                let back = back * shape.activation.slope(*value);
                gradient[shape.hidden_biases().start + h] += back;
                axpy(back, x, &mut gradient[h * inputs..(h + 1) * inputs]);
            }
        });
        for weights in [shape.hidden_weights(), shape.output_weights()] {
            let weights = (&parameters[weights.clone()], &mut gradient[weights]);
            axpy(self.decay * per_row, weights.0, weights.1);
        }
        (self.with_decay(squares, parameters), squares)
    }

    /// Mean squared error of each axis; `each` sees inputs, activations and errors (output minus target) of every row.
    fn errors(
        &self,
        parameters: &[f64],
        mut each: impl FnMut(&[f64], &[f64], [f64; OUTPUTS]),
    ) -> [f64; OUTPUTS] {
        let mut hidden = vec![0.0; self.shape.hidden];
        let mut squares = [0.0; OUTPUTS];
        for (x, y) in self.x.iter().zip(self.y) {
            let outputs = self.shape.forward(parameters, x, &mut hidden);
            let errors: [f64; OUTPUTS] = std::array::from_fn(|k| outputs[k] - y[k]);
            for (square, error) in squares.iter_mut().zip(errors) {
                *square += error * error;
            }
            each(x, &hidden, errors);
        }
        squares.map(|square| square / self.y.len() as f64)
    }

    fn with_decay(&self, squares: [f64; OUTPUTS], parameters: &[f64]) -> f64 {
        let weights = [self.shape.hidden_weights(), self.shape.output_weights()];
        let decay: f64 = weights
            .map(|weights| dot(&parameters[weights.clone()], &parameters[weights]))
            .iter()
            .sum();
        0.5 * (squares.iter().sum::<f64>() + self.decay * decay / self.y.len() as f64)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
