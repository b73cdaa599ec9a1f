//! From samples to networks: a swarm (Fig. 3) or chance finds the starts, gradient descent finishes them, their mean is used.
//!
//! All swarms may spend what a beetle swarm of the recipe's size does. Work is capped: the swarm judges beetles on at most [`SWARM_ROWS`] rows, so its cost does not grow with the recording.

use super::arm::ScrewArm;
use super::correction::{
    Body, Correction, Feature, JointMotion, NetworkScaling, Networks, Scaling,
};
use super::descent::{DescentIteration, descend};
use super::loss::{Batch, Loss, LossBuffers};
use super::perceptron::{Activation, LayerSizes, OUTPUTS};
use super::region::{Region, TrainingSamples};
use crate::estimate::swarm::{Algorithm, Budget, Generation, SearchBox};
use crate::estimate::threads::in_order;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Rows on which the swarm judges: drawn once, enough for a start.
pub(crate) const SWARM_ROWS: usize = 256;
/// Beetles search weights in -1..1: with standardised inputs no neuron is saturated there.
const SWARM_BOUND: f64 = 1.0;

/// Where the gradient training starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrainingStart {
    /// Weights drawn evenly from the box that swarms search.
    Random,
    /// By a swarm of networks.
    Swarm(Algorithm),
}

/// How to train.
#[derive(Debug, Clone)]
pub struct Recipe {
    /// How many of the sources are joints; one more is the payload.
    pub joints: usize,
    /// Inputs, in order.
    pub features: Vec<Feature>,
    /// Outputs are motions of this arm's joints (Fig. 2 of the paper); without it, of the point.
    pub through: Option<ScrewArm>,
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
    /// Networks whose mean is the correction.
    pub members: usize,
    /// Share of the rows kept back from each member's training to stop it early.
    pub keep_back: f64,
    /// Seed of start and swarm.
    pub seed: u64,
    /// Threads; the result does not depend on them.
    pub jobs: usize,
}

impl Recipe {
    /// The same with so many neurons and this decay.
    pub(super) fn sized(&self, hidden: usize, decay: f64) -> Self {
        Self {
            hidden,
            decay,
            ..self.clone()
        }
    }
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
    /// From 1; the swarm serves all members and has 0.
    pub member: usize,
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
    let prepared = Prepared::new(samples, recipe);
    let (starts, mut course) = prepared.starts(observe);
    let trained = in_order(recipe.jobs, recipe.members, |m| {
        prepared.member(m, starts[m % starts.len()].clone())
    });
    let mut members = Vec::with_capacity(recipe.members);
    for (parameters, history) in trained {
        members.push(parameters);
        course.extend(history);
    }
    let networks = Networks {
        shape: prepared.shape,
        joints: prepared.joints,
        members,
    };
    let correction = Correction {
        body: Body::Networks(prepared.dress, networks),
        region: prepared.region,
        left: 0.0,
    };
    (correction, course)
}

/// Rows scaled and ready to be learnt.
struct Prepared<'a> {
    recipe: &'a Recipe,
    shape: LayerSizes,
    x: Vec<Vec<f64>>,
    y: Vec<[f64; OUTPUTS]>,
    joints: Option<JointMotion>,
    /// What each output does to the point at each row, in units of the scaled targets; empty without joints.
    ways: Vec<Vec<[f64; OUTPUTS]>>,
    dress: NetworkScaling,
    region: Region,
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
    let x = samples
        .sources
        .iter()
        .map(|row| dress.scaled(row))
        .collect();
    let y = samples
        .residual
        .iter()
        .map(|r| std::array::from_fn(|k| outputs[k].scaled(r[k])))
        .collect();
    (dress, x, y)
}

/// Joint motions of such sizes that each alone would make the residual's root mean square, which is given too, m.
fn motion(samples: &TrainingSamples, arm: &ScrewArm) -> (JointMotion, f64) {
    let count = (OUTPUTS * samples.rows()) as f64;
    let squares = |values: &[[f64; OUTPUTS]]| {
        values
            .iter()
            .flatten()
            .map(|value| value * value)
            .sum::<f64>()
    };
    let size = (squares(&samples.residual) / count).sqrt();
    let size = if size > 1e-12 { size } else { 1.0 };
    let mut motion = JointMotion {
        arm: arm.clone(),
        scales: vec![1.0; arm.hinges.len()],
    };
    let mut levers = vec![0.0; motion.scales.len()];
    for q in &samples.sources {
        for (lever, way) in levers.iter_mut().zip(motion.ways(q)) {
            *lever += squares(&[way]);
        }
    }
    // A joint whose axis goes through the point moves nothing, whatever its scale.
    let scale = |lever: f64| {
        if lever > 1e-18 {
            size / (lever / count).sqrt()
        } else {
            0.0
        }
    };
    motion.scales = levers.into_iter().map(scale).collect();
    (motion, size)
}

impl<'a> Prepared<'a> {
    fn new(samples: &TrainingSamples, recipe: &'a Recipe) -> Self {
        let (mut dress, x, mut y) = dressed(samples, &recipe.features);
        let joints = recipe.through.as_ref().map(|arm| motion(samples, arm));
        let mut ways = Vec::new();
        if let Some((motion, size)) = &joints {
            // Lengths are compared, so all axes have one scale.
            dress.outputs = [Scaling {
                mean: 0.0,
                scale: *size,
            }; OUTPUTS];
            y = samples
                .residual
                .iter()
                .map(|r| r.map(|value| value / size))
                .collect();
            let scaled = |way: [f64; OUTPUTS]| way.map(|value| value / size);
            ways = samples
                .sources
                .iter()
                .map(|q| motion.ways(q).into_iter().map(scaled).collect())
                .collect();
        }
        let outputs = joints
            .as_ref()
            .map_or(OUTPUTS, |(motion, _)| motion.scales.len());
        let shape = LayerSizes {
            inputs: recipe.features.len(),
            hidden: recipe.hidden,
            outputs,
            activation: recipe.activation,
        };
        let joints = joints.map(|(motion, _)| motion);
        Self {
            recipe,
            shape,
            x,
            y,
            joints,
            ways,
            dress,
            region: Region::of(&samples.sources, recipe.joints),
        }
    }

    /// Where members start, best first, and the course of the swarm; chance has none.
    fn starts(&self, observe: &mut dyn FnMut(&Generation)) -> (Vec<Vec<f64>>, Vec<TrainingStep>) {
        let mut rng = self.rng(0);
        let bounds = SearchBox::cube(self.shape.parameters(), -SWARM_BOUND, SWARM_BOUND);
        match self.recipe.start {
            TrainingStart::Random => (
                (0..self.recipe.members)
                    .map(|_| bounds.random(&mut rng))
                    .collect(),
                Vec::new(),
            ),
            TrainingStart::Swarm(algorithm) => self.swarm(algorithm, &bounds, &mut rng, observe),
        }
    }

    fn swarm(
        &self,
        algorithm: Algorithm,
        bounds: &SearchBox,
        rng: &mut ChaCha8Rng,
        observe: &mut dyn FnMut(&Generation),
    ) -> (Vec<Vec<f64>>, Vec<TrainingStep>) {
        let rows = if self.y.len() > SWARM_ROWS {
            draw(rng, self.y.len(), SWARM_ROWS).0
        } else {
            (0..self.y.len()).collect()
        };
        let batch = self.batch(&rows);
        let loss = Loss {
            shape: self.shape,
            batch: &batch,
            decay: self.recipe.decay * rows.len() as f64 / self.y.len() as f64,
        };
        let mut scratch = LossBuffers::new(self.shape);
        let mut course: Vec<TrainingStep> = Vec::new();
        // A lone beetle knows one place: each member has a search of its own, at a share of the cost.
        let searches = if algorithm == Algorithm::Bas {
            self.recipe.members
        } else {
            1
        };
        let spent = Algorithm::Bso.evaluations(self.recipe.beetles, self.recipe.generations)
            / searches as u64;
        let mut starts = Vec::new();
        for search in 0..searches {
            let budget = Budget {
                generations: algorithm.generations(self.recipe.beetles, spent),
                evaluations: Some(spent),
                target: None,
                seed: rng.random(),
                jobs: self.recipe.jobs,
            };
            let outcome = algorithm.minimise(
                self.recipe.beetles,
                &loss,
                bounds,
                &budget,
                |generation, best| {
                    if search > 0 {
                        return;
                    }
                    observe(generation);
                    let train_rms = match course.last() {
                        Some(last) if last.best == generation.best => last.train_rms,
                        _ => self.rms(loss.mean_squares(best, &mut scratch)),
                    };
                    course.push(TrainingStep {
                        phase: Phase::Swarm,
                        member: 0,
                        index: generation.index,
                        best: generation.best,
                        train_rms,
                        check_rms: None,
                        evaluations: generation.evaluations,
                    });
                },
            );
            starts.extend(outcome.elite.into_iter().map(|(_, position)| position));
        }
        (starts, course)
    }

    /// Trains member `m` (from 0) from `start`.
    fn member(&self, m: usize, start: Vec<f64>) -> (Vec<f64>, Vec<TrainingStep>) {
        let mut rng = self.rng(1 + m as u64);
        let back = (self.recipe.keep_back * self.y.len() as f64).round() as usize;
        let (kept_back, trained) = draw(&mut rng, self.y.len(), back.min(self.y.len() - 1));
        let batch = self.batch(&trained);
        let check = self.batch(&kept_back);
        let loss = |batch| Loss {
            shape: self.shape,
            batch,
            decay: self.recipe.decay,
        };
        let train = loss(&batch);
        let check = (check.rows() > 0).then(|| loss(&check));
        let (mut scratch, mut check_scratch) =
            (LossBuffers::new(self.shape), LossBuffers::new(self.shape));
        let descent = descend(
            |x, gradient| train.gradient(x, gradient, &mut scratch),
            |x| check.map(|check| check.mean_squares(x, &mut check_scratch)),
            start,
            self.recipe.iterations,
        );
        let course = |i: DescentIteration| TrainingStep {
            phase: Phase::Gradient,
            member: m + 1,
            index: i.index,
            best: i.loss,
            train_rms: self.rms(i.train),
            check_rms: i.check.map(|squares| self.rms(squares)),
            evaluations: i.evaluations,
        };
        (
            descent.parameters,
            descent.history.into_iter().map(course).collect(),
        )
    }

    /// A stream of its own for each purpose, so that none depends on how much another drew.
    fn rng(&self, stream: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.recipe.seed);
        rng.set_stream(stream);
        rng
    }

    fn batch(&self, rows: &[usize]) -> Batch {
        let x: Vec<Vec<f64>> = rows.iter().map(|r| self.x[*r].clone()).collect();
        let y: Vec<[f64; OUTPUTS]> = rows.iter().map(|r| self.y[*r]).collect();
        let batch = Batch::new(&x, &y);
        if self.ways.is_empty() {
            return batch;
        }
        let ways: Vec<_> = rows.iter().map(|r| self.ways[*r].clone()).collect();
        batch.through(&ways)
    }

    /// Root of the mean squared length, m, from mean squares of the scaled outputs.
    fn rms(&self, squares: [f64; OUTPUTS]) -> f64 {
        squares
            .iter()
            .zip(&self.dress.outputs)
            .map(|(s, o)| s * o.scale * o.scale)
            .sum::<f64>()
            .sqrt()
    }
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
