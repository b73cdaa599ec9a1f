//! What training makes small: the mean squared error of a perceptron over rows and its weight decay, with the analytic gradient.
//!
//! Eq. 45 averaged over rows, `L = (1/n) (1/2 sum e^2 + decay/2 sum w^2)`, biases free; gradient by Eqs. 43-44. Outputs may be
//! joint motions: then `e = J y - target` with `J` of each row (Fig. 2 of Wang et al. 2020). Rows are evaluated in blocks, by the
//! widest instructions of those that the machine and the compiler know; the result is the same with any.

use super::perceptron::{
    BLOCK, BlockColumn, FARTHEST, LANES, LaneProduct, LayerSizes, OUTPUTS, dot, sum,
};
use crate::estimate::swarm::Objective;
use pulp::{Arch, Simd, WithSimd};

/// Scaled training rows in blocks.
#[derive(Debug, Clone, Default)]
pub struct Batch {
    rows: usize,
    /// Inputs of each block, a column per input.
    inputs: Vec<BlockColumn>,
    /// Largest size of each input.
    largest: Vec<f64>,
    /// Targets of each block, a column per axis.
    targets: Vec<BlockColumn>,
    /// What each output in turn does along each axis, block by block. Empty where outputs are the axes.
    ways: Vec<BlockColumn>,
}

impl Batch {
    /// Rows with inputs `x` (each of equal length) and targets `y`. Panics where the numbers of rows differ.
    pub fn new(x: &[Vec<f64>], y: &[[f64; OUTPUTS]]) -> Self {
        assert_eq!(x.len(), y.len(), "one target per row");
        let width = x.first().map_or(0, Vec::len);
        let largest = (0..width)
            .map(|i| x.iter().map(|x| x[i].abs()).fold(0.0, f64::max))
            .collect();
        Self {
            rows: x.len(),
            inputs: columns(x, width, |x, i| x[i]),
            largest,
            targets: columns(y, OUTPUTS, |y, k| y[k]),
            ways: Vec::new(),
        }
    }

    /// The same rows where output `j` of row `r` moves the point by `ways[r][j]`, in units of the targets.
    pub fn through(mut self, ways: &[Vec<[f64; OUTPUTS]>]) -> Self {
        assert_eq!(ways.len(), self.rows, "ways of each row");
        let width = OUTPUTS * ways.first().map_or(0, Vec::len);
        self.ways = columns(ways, width, |ways, at| ways[at / OUTPUTS][at % OUTPUTS]);
        self
    }

    /// How many rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }
}

/// `width` numbers of each row, as columns of blocks; rows that there are not are zero.
fn columns<T>(rows: &[T], width: usize, number: impl Fn(&T, usize) -> f64) -> Vec<BlockColumn> {
    let mut out = Vec::with_capacity(width * rows.len().div_ceil(BLOCK));
    for block in rows.chunks(BLOCK) {
        for at in 0..width {
            let mut column = [0.0; BLOCK];
            for (slot, row) in column.iter_mut().zip(block) {
                *slot = number(row, at);
            }
            out.push(column);
        }
    }
    out
}

/// Memory for one block of rows, reused so that the inner loop allocates nothing.
#[derive(Debug, Clone)]
pub struct LossBuffers {
    /// Weights and biases of the hidden layer times the activation's factor, and output weights, each column after column.
    hidden_weights: Vec<f64>,
    hidden_biases: Vec<f64>,
    output_weights: Vec<f64>,
    /// The largest exponent that each neuron can see.
    farthest: Vec<f64>,
    /// Activations, and the loss's derivative by their sums.
    hidden: Vec<BlockColumn>,
    delta: Vec<BlockColumn>,
    /// Outputs of the network, and the loss's derivative by them.
    outputs: Vec<BlockColumn>,
    back: Vec<BlockColumn>,
    /// `point - target` (the sign that makes the gradient plain) along each axis.
    errors: [BlockColumn; OUTPUTS],
}

impl LossBuffers {
    /// Buffers for a network of this shape.
    pub fn new(shape: LayerSizes) -> Self {
        let block = |count: usize| vec![[0.0; BLOCK]; count];
        Self {
            hidden_weights: vec![0.0; shape.inputs * shape.hidden],
            hidden_biases: vec![0.0; shape.hidden],
            output_weights: vec![0.0; shape.outputs * shape.hidden],
            farthest: vec![0.0; shape.hidden],
            hidden: block(shape.hidden),
            delta: block(shape.hidden),
            outputs: block(shape.outputs),
            back: block(shape.outputs),
            errors: [[0.0; BLOCK]; OUTPUTS],
        }
    }
}

/// A shape, the rows it is trained on and the decay: what is minimised.
#[derive(Debug, Clone, Copy)]
pub struct Loss<'a> {
    /// Sizes of the network's layers.
    pub shape: LayerSizes,
    /// Rows that it is fitted to.
    pub batch: &'a Batch,
    /// Weight of half the summed squared weights beside half the summed squared errors.
    pub decay: f64,
}

/// As the swarm sees it.
impl Objective for Loss<'_> {
    type Scratch = LossBuffers;
    fn scratch(&self) -> LossBuffers {
        LossBuffers::new(self.shape)
    }
    fn value(&self, x: &[f64], scratch: &mut LossBuffers) -> f64 {
        Loss::value(self, x, scratch)
    }
}

/// What is asked of a loss, as a piece of work: unlike a closure it is sure to be compiled for the instructions it is dispatched to.
struct Asked<'a> {
    loss: &'a Loss<'a>,
    parameters: &'a [f64],
    /// Where the gradient is to be written, if it is wanted.
    gradient: Option<&'a mut [f64]>,
    scratch: &'a mut LossBuffers,
}

impl WithSimd for Asked<'_> {
    type Output = [f64; OUTPUTS];
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; OUTPUTS] {
        self.loss
            .sums(simd, self.parameters, self.gradient, self.scratch)
    }
}

impl Loss<'_> {
    /// The loss; allocates nothing.
    pub fn value(&self, parameters: &[f64], scratch: &mut LossBuffers) -> f64 {
        let squares: f64 = self.mean_squares(parameters, scratch).iter().sum();
        0.5 * squares + 0.5 * self.decay * self.weight_squares(parameters) / self.batch.rows as f64
    }

    /// Mean squared error of each axis over the rows, without decay.
    pub fn mean_squares(&self, parameters: &[f64], scratch: &mut LossBuffers) -> [f64; OUTPUTS] {
        let sums = Arch::new().dispatch(Asked {
            loss: self,
            parameters,
            gradient: None,
            scratch,
        });
        sums.map(|sum| sum / self.batch.rows as f64)
    }

    /// The loss and the mean squared error of each axis; the loss's gradient is written to `gradient`. Allocates nothing.
    pub fn gradient(
        &self,
        parameters: &[f64],
        gradient: &mut [f64],
        scratch: &mut LossBuffers,
    ) -> (f64, [f64; OUTPUTS]) {
        let per_row = 1.0 / self.batch.rows as f64;
        let squares = Arch::new().dispatch(Asked {
            loss: self,
            parameters,
            gradient: Some(gradient),
            scratch,
        });
        for g in gradient.iter_mut() {
            *g *= per_row;
        }
        for range in [self.shape.hidden_weights(), self.shape.output_weights()] {
            for (g, w) in gradient[range.clone()].iter_mut().zip(&parameters[range]) {
                *g += self.decay * per_row * w;
            }
        }
        let loss = 0.5
            * per_row
            * (squares.iter().sum::<f64>() + self.decay * self.weight_squares(parameters));
        (loss, squares.map(|square| square * per_row))
    }

    fn weight_squares(&self, parameters: &[f64]) -> f64 {
        let squares = |weights: &[f64]| {
            let (whole, tail) = weights.as_chunks::<LANES>();
            // As many sums as there are lanes: one would wait for itself.
            let mut sums = [0.0; LANES];
            for weights in whole {
                for (sum, w) in sums.iter_mut().zip(weights) {
                    *sum += w * w;
                }
            }
            sums.iter().sum::<f64>() + tail.iter().map(|w| w * w).sum::<f64>()
        };
        squares(&parameters[self.shape.hidden_weights()])
            + squares(&parameters[self.shape.output_weights()])
    }

    /// Summed squared errors of each axis; the gradient of half their sum is written where it is wanted.
    #[inline(always)]
    fn sums<S: Simd>(
        &self,
        simd: S,
        parameters: &[f64],
        mut gradient: Option<&mut [f64]>,
        scratch: &mut LossBuffers,
    ) -> [f64; OUTPUTS] {
        if let Some(gradient) = gradient.as_deref_mut() {
            gradient.fill(0.0);
        }
        let tame = self.lay_out(parameters, scratch);
        let mut squares = [0.0; OUTPUTS];
        for block in 0..self.batch.rows.div_ceil(BLOCK) {
            let rows = BLOCK.min(self.batch.rows - block * BLOCK);
            let length = rows.next_multiple_of(LANES);
            self.forward(simd, parameters, block, length, tame, scratch);
            for (errors, square) in scratch.errors.iter_mut().zip(&mut squares) {
                // Rows that there are not have no error.
                errors[rows..length].fill(0.0);
                *square += dot(simd, &errors[..length], &errors[..length]);
            }
            if let Some(gradient) = gradient.as_deref_mut() {
                self.back(simd, parameters, block, length, gradient, scratch);
            }
        }
        squares
    }

    /// Puts the weights where the products want them; whether no exponent of any row can be too far for the activation.
    #[inline(always)]
    fn lay_out(&self, parameters: &[f64], scratch: &mut LossBuffers) -> bool {
        let LayerSizes {
            inputs,
            hidden,
            outputs,
            activation,
        } = self.shape;
        let factor = activation.factor();
        let biases = scratch
            .hidden_biases
            .iter_mut()
            .zip(&parameters[self.shape.hidden_biases()]);
        for ((bias, parameter), farthest) in biases.zip(&mut scratch.farthest) {
            *bias = factor * parameter;
            *farthest = bias.abs();
        }
        let weights = &parameters[self.shape.hidden_weights()];
        let columns = scratch
            .hidden_weights
            .chunks_exact_mut(hidden)
            .zip(&self.batch.largest);
        for (i, (column, largest)) in columns.enumerate() {
            for ((slot, weight), farthest) in column
                .iter_mut()
                .zip(weights[i..].iter().step_by(inputs))
                .zip(&mut scratch.farthest)
            {
                *slot = factor * weight;
                *farthest += slot.abs() * largest;
            }
        }
        let weights = &parameters[self.shape.output_weights()];
        for (h, column) in scratch.output_weights.chunks_exact_mut(outputs).enumerate() {
            for (slot, weight) in column.iter_mut().zip(weights[h..].iter().step_by(hidden)) {
                *slot = *weight;
            }
        }
        scratch.farthest.iter().all(|farthest| *farthest < FARTHEST)
    }

    /// Activations, outputs and errors of the first `length` rows of a block.
    #[inline(always)]
    fn forward<S: Simd>(
        &self,
        simd: S,
        parameters: &[f64],
        block: usize,
        length: usize,
        tame: bool,
        scratch: &mut LossBuffers,
    ) {
        let inputs = self.shape.inputs;
        let columns = &self.batch.inputs[block * inputs..(block + 1) * inputs];
        let first = LaneProduct {
            biases: &scratch.hidden_biases,
            weights: &scratch.hidden_weights,
            columns,
            length,
        };
        first.write(simd, &mut scratch.hidden);
        for exponents in &mut scratch.hidden {
            let exponents = &mut exponents[..length];
            if !tame {
                exponents
                    .iter_mut()
                    .for_each(|t| *t = t.clamp(-FARTHEST, FARTHEST));
            }
            self.shape.activation.apply(exponents);
        }
        let biases = &parameters[self.shape.output_biases()];
        let second = LaneProduct {
            biases,
            weights: &scratch.output_weights,
            columns: &scratch.hidden,
            length,
        };
        second.write(simd, &mut scratch.outputs);
        let targets = &self.batch.targets[block * OUTPUTS..(block + 1) * OUTPUTS];
        for (k, (errors, targets)) in scratch.errors.iter_mut().zip(targets).enumerate() {
            let pairs = errors[..length].iter_mut().zip(targets);
            if self.batch.ways.is_empty() {
                for ((e, target), y) in pairs.zip(&scratch.outputs[k]) {
                    *e = y - target;
                }
                continue;
            }
            for (e, target) in pairs {
                *e = -target;
            }
            for (j, outputs) in scratch.outputs.iter().enumerate() {
                for ((e, y), way) in errors[..length]
                    .iter_mut()
                    .zip(outputs)
                    .zip(self.way(block, j, k))
                {
                    *e += y * way;
                }
            }
        }
    }

    /// Adds the block's share of the gradient, from its errors.
    #[inline(always)]
    fn back<S: Simd>(
        &self,
        simd: S,
        parameters: &[f64],
        block: usize,
        length: usize,
        gradient: &mut [f64],
        scratch: &mut LossBuffers,
    ) {
        let LayerSizes {
            inputs,
            hidden,
            activation,
            ..
        } = self.shape;
        for (j, back) in scratch.back.iter_mut().enumerate() {
            if self.batch.ways.is_empty() {
                back[..length].copy_from_slice(&scratch.errors[j][..length]);
            } else {
                back[..length].fill(0.0);
                for (k, errors) in scratch.errors.iter().enumerate() {
                    for ((d, e), way) in back[..length]
                        .iter_mut()
                        .zip(errors)
                        .zip(self.way(block, j, k))
                    {
                        *d += e * way;
                    }
                }
            }
            gradient[self.shape.output_biases().start + j] += sum(simd, &back[..length]);
        }
        let weights = self.shape.output_weights();
        // Row after row of the output weights is column after column of what leads back.
        let product = LaneProduct {
            biases: &[],
            weights: &parameters[weights.clone()],
            columns: &scratch.back,
            length,
        };
        product.write(simd, &mut scratch.delta);
        let columns = &self.batch.inputs[block * inputs..(block + 1) * inputs];
        for (h, (values, delta)) in scratch.hidden.iter().zip(&mut scratch.delta).enumerate() {
            let (values, delta) = (&values[..length], &mut delta[..length]);
            for (j, back) in scratch.back.iter().enumerate() {
                gradient[weights.start + j * hidden + h] += dot(simd, &back[..length], values);
            }
            activation.slope(delta, values);
            gradient[hidden * inputs + h] += sum(simd, delta);
            for (i, column) in columns.iter().enumerate() {
                gradient[h * inputs + i] += dot(simd, delta, &column[..length]);
            }
        }
    }

    /// What output `j` does along axis `k`, of the rows of a block.
    #[inline(always)]
    fn way(&self, block: usize, j: usize, k: usize) -> &BlockColumn {
        &self.batch.ways[(block * self.shape.outputs + j) * OUTPUTS + k]
    }
}
