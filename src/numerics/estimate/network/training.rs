//! From samples to a network: a beetle swarm (Fig. 3 of Wang et al. 2020) or chance finds the start, gradient descent finishes it.

use super::correction::{Body, Correction, Feature, NetworkScaling, Scaling};
use super::descent::{DescentIteration, descend};
use super::perceptron::{Activation, LayerSizes, Loss, OUTPUTS};
use super::region::{Region, TrainingSamples};
use crate::estimate::swarm::{Algorithm, Budget, Generation, SearchBox};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Rows on which the swarm judges at most, so that its cost does not grow with the recording: enough for a start.
const SWARM_ROWS: usize = 256;
/// Beetles search weights in -1..1: with standardised inputs no neuron is saturated there.
const SWARM_BOUND: f64 = 1.0;

/// Where the gradient training starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrainingStart {
    /// Weights drawn evenly from the box that the swarm searches.
    Random,
    /// The best of a beetle swarm.
    Swarm,
}

/// How to train.
#[derive(Debug, Clone)]
pub struct Recipe {
    /// How many of the sources are joints; one more is the payload.
    pub joints: usize,
    /// Inputs, in order.
    pub features: Vec<Feature>,
    /// Neurons.
    pub hidden: usize,
    /// Activation of the hidden layer.
    pub activation: Activation,
    /// Where the gradient descent begins.
    pub start: TrainingStart,
    /// Members of the swarm.
    pub beetles: usize,
    /// Generations of the swarm.
    pub generations: usize,
    /// Most iterations of the gradient training.
    pub iterations: usize,
    /// Weight decay.
    pub decay: f64,
    /// Share of the rows kept back from the training to stop it early.
    pub keep_back: f64,
    /// Seed of start and swarm.
    pub seed: u64,
    /// Threads; the result does not depend on them.
    pub jobs: usize,
}

/// Which part of the training a record is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// The swarm looks for a start.
    Swarm,
    /// The gradient goes on from there.
    Gradient,
}

/// One generation or iteration of the training.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingStep {
    /// Which part of the training.
    pub phase: Phase,
    /// Generation or iteration, from 0.
    pub index: usize,
    /// Lowest loss so far.
    pub best: f64,
    /// Root of the mean squared length of the error on the training rows, m, and on the rows kept back.
    pub train_rms: f64,
    /// At rows that it is not fitted to, m.
    pub check_rms: Option<f64>,
    /// Evaluations of the loss so far.
    pub evaluations: u64,
}

/// Trains on all samples; `observe` sees each generation of the swarm. Panics without samples or features.
pub fn train(
    samples: &TrainingSamples,
    recipe: &Recipe,
    observe: &mut dyn FnMut(&Generation),
) -> (Correction, Vec<TrainingStep>) {
    assert!(
        samples.rows() > 0 && !recipe.features.is_empty(),
        "something to learn from"
    );
    let (dress, x, y) = dressed(samples, &recipe.features);
    let shape = LayerSizes {
        inputs: recipe.features.len(),
        hidden: recipe.hidden,
        activation: recipe.activation,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(recipe.seed);
    let bounds = SearchBox::cube(shape.parameters(), -SWARM_BOUND, SWARM_BOUND);
    // Root of the mean squared length, m, from mean squares of the scaled outputs.
    let rms = |squares: [f64; OUTPUTS]| {
        let axes = squares.iter().zip(&dress.outputs);
        axes.map(|(s, o)| s * o.scale * o.scale).sum::<f64>().sqrt()
    };
    let mut course: Vec<TrainingStep> = Vec::new();
    let start = match recipe.start {
        TrainingStart::Random => bounds.random(&mut rng),
        TrainingStart::Swarm => {
            let (drawn, _) = draw(&mut rng, y.len(), SWARM_ROWS.min(y.len()));
            let (x, few) = picked(&x, &y, &drawn);
            let loss = Loss {
                shape,
                x: &x,
                y: &few,
                decay: recipe.decay * few.len() as f64 / y.len() as f64,
            };
            let budget = Budget {
                generations: recipe.generations,
                evaluations: None,
                target: None,
                seed: rng.random(),
                jobs: recipe.jobs,
            };
            let judge = |x: &[f64]| loss.value(x);
            let each = |generation: &Generation, best: &[f64]| {
                observe(generation);
                course.push(TrainingStep {
                    phase: Phase::Swarm,
                    index: generation.index,
                    best: generation.best,
                    train_rms: rms(loss.mean_squares(best)),
                    check_rms: None,
                    evaluations: generation.evaluations,
                });
            };
            let found = Algorithm::Bso.minimise(recipe.beetles, &judge, &bounds, &budget, each);
            found.position
        }
    };
    // A stream of its own, so that it does not depend on how much the start drew.
    let mut rng = ChaCha8Rng::seed_from_u64(recipe.seed);
    rng.set_stream(1);
    let back = (recipe.keep_back * y.len() as f64).round() as usize;
    let (kept_back, trained) = draw(&mut rng, y.len(), back.min(y.len() - 1));
    let (kept_back, trained) = (picked(&x, &y, &kept_back), picked(&x, &y, &trained));
    let [check, train] = [&kept_back, &trained].map(|(x, y)| Loss {
        shape,
        x,
        y,
        decay: recipe.decay,
    });
    let descent = descend(
        |x, gradient| train.gradient(x, gradient),
        |x| (!check.y.is_empty()).then(|| check.mean_squares(x)),
        start,
        recipe.iterations,
    );
    course.extend(
        descent
            .history
            .into_iter()
            .map(|i: DescentIteration| TrainingStep {
                phase: Phase::Gradient,
                index: i.index,
                best: i.loss,
                train_rms: rms(i.train),
                check_rms: i.check.map(rms),
                evaluations: i.evaluations,
            }),
    );
    let correction = Correction {
        body: Body::Network(dress, shape, descent.parameters),
        region: Region::of(&samples.sources, recipe.joints),
        left: 0.0,
    };
    (correction, course)
}

/// Standardised inputs and outputs with their scaling.
pub(super) fn dressed(
    samples: &TrainingSamples,
    features: &[Feature],
) -> (NetworkScaling, Vec<Vec<f64>>, Vec<[f64; OUTPUTS]>) {
    let inputs = features
        .iter()
        .map(|f| Scaling::of(samples.sources.iter().map(move |row| f.of(row))))
        .collect();
    let outputs: [Scaling; OUTPUTS] =
        std::array::from_fn(|k| Scaling::of(samples.residual.iter().map(move |r| r[k])));
    let dress = NetworkScaling {
        features: features.to_vec(),
        inputs,
        outputs,
    };
    let x = samples.sources.iter().map(|row| dress.scaled(row));
    let scaled = |r: &[f64; OUTPUTS]| std::array::from_fn(|k| outputs[k].scaled(r[k]));
    let (x, y) = (x.collect(), samples.residual.iter().map(scaled).collect());
    (dress, x, y)
}

fn picked(
    x: &[Vec<f64>],
    y: &[[f64; OUTPUTS]],
    rows: &[usize],
) -> (Vec<Vec<f64>>, Vec<[f64; OUTPUTS]>) {
    (
        rows.iter().map(|row| x[*row].clone()).collect(),
        rows.iter().map(|row| y[*row]).collect(),
    )
}

/// Draws `count` of `rows` rows without putting back: those drawn and the others, each in ascending order.
fn draw(rng: &mut ChaCha8Rng, rows: usize, count: usize) -> (Vec<usize>, Vec<usize>) {
    let mut order: Vec<usize> = (0..rows).collect();
    for i in 0..count {
        let j = rng.random_range(i..rows);
        order.swap(i, j);
    }
    let mut others = order.split_off(count);
    order.sort_unstable();
    others.sort_unstable();
    (order, others)
}
