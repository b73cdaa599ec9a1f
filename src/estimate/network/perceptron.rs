//! A multilayer perceptron with one hidden layer and linear outputs, evaluated over blocks of rows.
//!
//! `y_k = b_k + sum_h w_kh f(b_h + sum_i w_hi x_i)` (Eq. 41), `f` the sigmoid of Eq. 42 or tanh; the loss is Eq. 45 averaged over
//! rows plus weight decay, `L = (1/n) (1/2 sum e^2 + decay/2 sum w^2)`, biases free. Its gradient is analytic (Eqs. 43-44).
//! Parameters lie flat: hidden weights (row per neuron), hidden biases, output weights (row per output), output biases.

use std::ops::Range;

/// Outputs of every network here: the three axes of the position residual.
pub const OUTPUTS: usize = 3;
/// Rows evaluated together: what a core's first cache holds for all neurons at once.
const BLOCK: usize = 64;

/// The activation of the hidden layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    Sigmoid,
    Tanh,
}

impl Activation {
    pub fn value(self, z: f64) -> f64 {
        match self {
            Self::Sigmoid => 1.0 / (1.0 + (-z).exp()),
            Self::Tanh => 2.0 / (1.0 + (-2.0 * z).exp()) - 1.0,
        }
    }
    /// The derivative, from the value: Eq. 43 for the sigmoid.
    fn slope(self, value: f64) -> f64 {
        match self {
            Self::Sigmoid => value * (1.0 - value),
            Self::Tanh => 1.0 - value * value,
        }
    }
}

/// Numbers of neurons; the parameters are kept apart from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    pub inputs: usize,
    pub hidden: usize,
    pub activation: Activation,
}

impl Shape {
    pub fn parameters(&self) -> usize {
        self.output_biases().end
    }
    pub fn hidden_weights(&self) -> Range<usize> {
        0..self.hidden * self.inputs
    }
    pub fn hidden_biases(&self) -> Range<usize> {
        let start = self.hidden_weights().end;
        start..start + self.hidden
    }
    pub fn output_weights(&self) -> Range<usize> {
        let start = self.hidden_biases().end;
        start..start + OUTPUTS * self.hidden
    }
    pub fn output_biases(&self) -> Range<usize> {
        let start = self.output_weights().end;
        start..start + OUTPUTS
    }
    /// Outputs for a single row of scaled inputs.
    pub fn at(&self, parameters: &[f64], x: &[f64]) -> [f64; OUTPUTS] {
        let weights = &parameters[self.hidden_weights()];
        let biases = &parameters[self.hidden_biases()];
        let out = &parameters[self.output_weights()];
        let mut y = [0.0; OUTPUTS];
        y.copy_from_slice(&parameters[self.output_biases()]);
        for h in 0..self.hidden {
            let row = &weights[h * self.inputs..(h + 1) * self.inputs];
            let a = self.activation.value(biases[h] + row.iter().zip(x).map(|(w, x)| w * x).sum::<f64>());
            for (k, y) in y.iter_mut().enumerate() {
                *y += out[k * self.hidden + h] * a;
            }
        }
        y
    }
}

/// Scaled training rows, a column per input and per output.
#[derive(Debug, Clone, Default)]
pub struct Batch {
    rows: usize,
    inputs: Vec<f64>,
    targets: Vec<f64>,
}

impl Batch {
    /// Rows with inputs `x` (each of equal length) and targets `y`. Panics where the numbers of rows differ.
    pub fn new(x: &[Vec<f64>], y: &[[f64; OUTPUTS]]) -> Self {
        assert_eq!(x.len(), y.len(), "one target per row");
        let rows = x.len();
        let width = x.first().map_or(0, Vec::len);
        let mut inputs = vec![0.0; rows * width];
        let mut targets = vec![0.0; rows * OUTPUTS];
        for (r, (x, y)) in x.iter().zip(y).enumerate() {
            for (i, value) in x.iter().enumerate() {
                inputs[i * rows + r] = *value;
            }
            for (k, value) in y.iter().enumerate() {
                targets[k * rows + r] = *value;
            }
        }
        Self { rows, inputs, targets }
    }
    pub fn rows(&self) -> usize {
        self.rows
    }
}

/// Memory for one block of rows, reused so that the inner loop allocates nothing.
#[derive(Debug, Clone)]
pub struct Scratch {
    /// Activations, a row of `BLOCK` per neuron.
    hidden: Vec<f64>,
    /// Errors `y - target` (the sign that makes the gradient plain), a row of `BLOCK` per output.
    errors: Vec<f64>,
    delta: Vec<f64>,
}

impl Scratch {
    pub fn new(shape: Shape) -> Self {
        Self { hidden: vec![0.0; shape.hidden * BLOCK], errors: vec![0.0; OUTPUTS * BLOCK], delta: vec![0.0; BLOCK] }
    }
}

/// A shape, the rows it is trained on and the decay: what is minimised.
#[derive(Debug, Clone, Copy)]
pub struct Loss<'a> {
    pub shape: Shape,
    pub batch: &'a Batch,
    /// Weight of half the summed squared weights beside half the summed squared errors.
    pub decay: f64,
}

impl Loss<'_> {
    /// The loss; allocates nothing.
    pub fn value(&self, parameters: &[f64], scratch: &mut Scratch) -> f64 {
        let squares: f64 = self.mean_squares(parameters, scratch).iter().sum();
        0.5 * squares + 0.5 * self.decay * self.weight_squares(parameters) / self.batch.rows as f64
    }

    /// Mean squared error of each output over the rows, without decay.
    pub fn mean_squares(&self, parameters: &[f64], scratch: &mut Scratch) -> [f64; OUTPUTS] {
        let mut sums = [0.0; OUTPUTS];
        for start in (0..self.batch.rows).step_by(BLOCK) {
            let length = BLOCK.min(self.batch.rows - start);
            self.forward(parameters, start, length, scratch);
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum += scratch.errors[k * BLOCK..k * BLOCK + length].iter().map(|e| e * e).sum::<f64>();
            }
        }
        sums.map(|sum| sum / self.batch.rows as f64)
    }

    /// The loss and the mean squared error of each output; the loss's gradient is written to `gradient`. Allocates nothing.
    pub fn gradient(&self, parameters: &[f64], gradient: &mut [f64], scratch: &mut Scratch) -> (f64, [f64; OUTPUTS]) {
        let Shape { inputs, hidden, activation } = self.shape;
        let per_row = 1.0 / self.batch.rows as f64;
        gradient.fill(0.0);
        let mut squares = [0.0; OUTPUTS];
        for start in (0..self.batch.rows).step_by(BLOCK) {
            let length = BLOCK.min(self.batch.rows - start);
            self.forward(parameters, start, length, scratch);
            let out = self.shape.output_weights().start;
            for (k, square) in squares.iter_mut().enumerate() {
                let errors = &scratch.errors[k * BLOCK..k * BLOCK + length];
                *square += dot(errors, errors);
                gradient[self.shape.output_biases().start + k] += errors.iter().sum::<f64>();
            }
            for h in 0..hidden {
                let a = &scratch.hidden[h * BLOCK..h * BLOCK + length];
                let delta = &mut scratch.delta[..length];
                delta.fill(0.0);
                for k in 0..OUTPUTS {
                    let e = &scratch.errors[k * BLOCK..k * BLOCK + length];
                    let w = parameters[out + k * hidden + h];
                    gradient[out + k * hidden + h] += dot(e, a);
                    for (d, e) in delta.iter_mut().zip(e) {
                        *d += w * e;
                    }
                }
                for (d, a) in delta.iter_mut().zip(a) {
                    *d *= activation.slope(*a);
                }
                gradient[hidden * inputs + h] += delta.iter().sum::<f64>();
                for i in 0..inputs {
                    gradient[h * inputs + i] += dot(delta, self.column(i, start, length));
                }
            }
        }
        for g in gradient.iter_mut() {
            *g *= per_row;
        }
        for range in [self.shape.hidden_weights(), self.shape.output_weights()] {
            for (g, w) in gradient[range.clone()].iter_mut().zip(&parameters[range]) {
                *g += self.decay * per_row * w;
            }
        }
        let loss = 0.5 * per_row * (squares.iter().sum::<f64>() + self.decay * self.weight_squares(parameters));
        (loss, squares.map(|square| square * per_row))
    }

    fn column(&self, i: usize, start: usize, length: usize) -> &[f64] {
        &self.batch.inputs[i * self.batch.rows + start..i * self.batch.rows + start + length]
    }

    fn weight_squares(&self, parameters: &[f64]) -> f64 {
        [self.shape.hidden_weights(), self.shape.output_weights()]
            .into_iter()
            .map(|range| parameters[range].iter().map(|w| w * w).sum::<f64>())
            .sum()
    }

    /// Activations and errors of the rows `start..start + length`.
    fn forward(&self, parameters: &[f64], start: usize, length: usize, scratch: &mut Scratch) {
        let Shape { inputs, hidden, activation } = self.shape;
        let out = self.shape.output_weights().start;
        for k in 0..OUTPUTS {
            let bias = parameters[self.shape.output_biases().start + k];
            let from = k * self.batch.rows + start;
            let targets = &self.batch.targets[from..from + length];
            for (e, target) in scratch.errors[k * BLOCK..].iter_mut().zip(targets) {
                *e = bias - target;
            }
        }
        for h in 0..hidden {
            let a = &mut scratch.hidden[h * BLOCK..h * BLOCK + length];
            a.fill(parameters[hidden * inputs + h]);
            for i in 0..inputs {
                let w = parameters[h * inputs + i];
                for (a, x) in a.iter_mut().zip(self.column(i, start, length)) {
                    *a += w * x;
                }
            }
            for a in a.iter_mut() {
                *a = activation.value(*a);
            }
            for k in 0..OUTPUTS {
                let w = parameters[out + k * hidden + h];
                for (e, a) in scratch.errors[k * BLOCK..].iter_mut().zip(a.iter()) {
                    *e += w * a;
                }
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
