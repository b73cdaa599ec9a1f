//! `learn`: neural networks for what the identified model leaves over (Wang et al. 2020, section 5).
//!
//! Joints -> position residual, by networks started by a beetle swarm and trained by gradient. Cross-validation within the training
//! rows decides the decay and whether the correction is kept at all: if the gain is not clear, the table `network` stays empty and
//! the prediction is what it was. Outside the range of its training rows the correction fades to zero.

use crate::error::{Error, Fault, Result};
use crate::estimate::network::correction::features;
use crate::estimate::network::{Activation, Course, OUTPUTS, Phase, Recipe, Samples, Verdict, judge, train};
use crate::stage::{Context, Stage, reads, writes};
use crate::table::{Network, Prediction, PredictionRow, Recording, Split, Training, TrainingRow};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Fewest rows to learn from: fewer say nothing in cross-validation.
const FEWEST: usize = 30;
/// Rows whose residual is so many times the median are mistakes in the recording, not what a smooth correction is for.
const FAR: f64 = 6.0;
/// Decays to choose from.
const DECAYS: [f64; 5] = [0.1, 0.3, 1.0, 3.0, 10.0];
/// Generations of the swarm in each fold of the cross-validation: the start matters less there than the time.
const FOLD_GENERATIONS: usize = 40;
/// Rows times iterations times networks that the cross-validation may cost: about 20 s on one core in the dev profile. Long
/// recordings have fewer networks per fold, then fewer iterations, but not below [`FOLD_ITERATIONS`].
const FOLD_WORK: usize = 20_000_000;
const FOLD_ITERATIONS: usize = 60;

/// Settings of `learn`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Learn {
    /// Sets of the split to train on.
    pub on: Vec<String>,
    /// What the networks see.
    pub inputs: Inputs,
    /// Whether they also see the payload; the recording must have it in every row to train on.
    pub payload: bool,
    /// Neurons of the hidden layer.
    pub hidden: usize,
    /// Activation of the hidden layer.
    pub activation: ActivationSetting,
    /// Networks whose mean is the correction.
    pub ensemble: usize,
    /// Beetles of the swarm that finds where the gradient training starts.
    pub beetles: usize,
    /// Generations of the swarm.
    pub generations: usize,
    /// Most iterations of the gradient training.
    pub iterations: usize,
    /// Weight decay: half of it times the squared weights stands beside half the squared standardised errors of all rows. Chosen by
    /// cross-validation if not given.
    pub decay: Option<f64>,
    /// Share of the training rows that each network keeps back to stop in time, below 0.5. With the decay chosen by cross-validation the
    /// rows are worth more in training than kept back, hence 0.
    pub keep_back: f64,
    /// Folds of the cross-validation.
    pub folds: usize,
}

impl Default for Learn {
    fn default() -> Self {
        Self {
            on: vec!["fit".into()],
            inputs: Inputs::Joints,
            payload: false,
            hidden: 12,
            activation: ActivationSetting::Sigmoid,
            ensemble: 8,
            beetles: 50,
            generations: 200,
            iterations: 200,
            decay: None,
            keep_back: 0.0,
            folds: 5,
        }
    }
}

/// What the networks see of each joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Inputs {
    /// Its position, as in the paper.
    Joints,
    /// Sine and cosine of its angle; the position of a prismatic joint.
    SinCos,
}

/// Activation of the hidden layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ActivationSetting {
    /// `1 / (1 + exp(-x))`, as in the paper.
    Sigmoid,
    /// `tanh(x)`.
    Tanh,
}

reads! {
    /// Input ports of [`Learn`].
    pub struct LearnReads {
        recording: Recording,
        split: Split,
        prediction: Prediction,
    }
}

writes! {
    /// Output ports of [`Learn`].
    pub struct LearnWrites {
        network: Network,
        training: Training,
        prediction: Prediction,
    }
}

impl Stage for Learn {
    const NAME: &'static str = "learn";
    const SUMMARY: &'static str = "learns what the model leaves over, and keeps the correction only where it helps";
    const IMPLEMENTATION: u32 = 3;
    type Reads = LearnReads;
    type Writes = LearnWrites;

    fn check(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.on.is_empty() {
            faults.push(Fault::new("on", "expected at least one set, e.g. [learn]"));
        }
        let counts = [
            ("hidden", self.hidden, 1, 200),
            ("ensemble", self.ensemble, 1, 100),
            ("beetles", self.beetles, 1, 1000),
            ("generations", self.generations, 0, 10_000),
            ("iterations", self.iterations, 1, 10_000),
            ("folds", self.folds, 2, 20),
        ];
        for (name, value, least, most) in counts {
            if !(least..=most).contains(&value) {
                faults.push(Fault::new(name, format!("expected a whole number from {least} to {most}, not {value}")));
            }
        }
        if !(0.0..0.5).contains(&self.keep_back) {
            faults.push(Fault::new("keep_back", format!("expected a share from 0 to below 0.5, not {}", self.keep_back)));
        }
        if let Some(decay) = self.decay
            && !(0.0..=1e6).contains(&decay)
        {
            faults.push(Fault::new("decay", format!("expected a number from 0 to 1e6, e.g. 1, not {decay}")));
        }
        faults
    }

    fn run(&self, reads: LearnReads, context: &Context) -> Result<LearnWrites> {
        let LearnReads { recording, split, prediction } = reads;
        if !prediction.0.iter().map(|row| row.sequence).eq(recording.sequence.iter().copied()) {
            return Err(Error::data("table prediction", "it belongs to another recording than the one beside it"));
        }
        let rows = split.rows(&recording, &self.on)?;
        let sources = self.sources(&recording, &rows)?;
        let near = within_reach(&prediction, &rows, context);
        let samples = Samples {
            sources: near.iter().map(|row| sources[*row].clone()).collect(),
            residual: near.iter().map(|row| residual(&prediction.0[*row])).collect(),
        };
        let (network, training) = self.learn(&samples, &recording.prismatic, context);
        Ok(LearnWrites { prediction: corrected(&prediction, &network, &recording, &sources, &rows, context)?, network, training })
    }
}

impl Learn {
    /// Joints of each row, and the payload where all training rows have it: it bounds where the correction is valid even where the
    /// networks do not see it.
    fn sources(&self, recording: &Recording, trained: &[usize]) -> Result<Vec<Vec<f64>>> {
        let mut sources: Vec<Vec<f64>> = (0..recording.rows()).map(|row| recording.q(row).to_vec()).collect();
        let payload = recording.payload.as_ref().filter(|column| trained.iter().all(|row| column[*row].is_finite()));
        match payload {
            Some(payload) => sources.iter_mut().zip(payload).for_each(|(row, value)| row.push(*value)),
            None if self.payload => {
                return Err(Error::data("with.payload", "the recording has no payload in some of the rows to train on"));
            }
            None => (),
        }
        Ok(sources)
    }

    fn recipe(&self, prismatic: &[bool], context: &Context) -> Recipe {
        Recipe {
            joints: prismatic.len(),
            features: features(prismatic, self.inputs == Inputs::SinCos, self.payload),
            hidden: self.hidden,
            activation: match self.activation {
                ActivationSetting::Sigmoid => Activation::Sigmoid,
                ActivationSetting::Tanh => Activation::Tanh,
            },
            beetles: self.beetles,
            generations: self.generations,
            iterations: self.iterations,
            decay: 1.0,
            members: self.ensemble,
            keep_back: self.keep_back,
            seed: context.seed,
            jobs: context.jobs,
        }
    }

    /// The correction as a table (empty if it does not help) and the course of its training.
    fn learn(&self, samples: &Samples, prismatic: &[bool], context: &Context) -> (Network, Training) {
        let services = context.services;
        if samples.rows() < FEWEST {
            services
                .warn(format!("{} rows are too few to learn from, at least {FEWEST} are needed: no correction", samples.rows()));
            return (Network::default(), Training::default());
        }
        let recipe = self.recipe(prismatic, context);
        let decays = self.decay.map_or(DECAYS.to_vec(), |decay| vec![decay]);
        let generations = self.generations.min(FOLD_GENERATIONS);
        let affordable = FOLD_WORK / (samples.rows() * decays.len() * self.folds);
        let members = (affordable / self.iterations).clamp(1, 3.min(self.ensemble));
        let iterations = affordable.max(FOLD_ITERATIONS).min(self.iterations);
        let trial = Recipe { generations, members, iterations, ..recipe.clone() };
        let total = self.folds * (generations + 1) + self.generations + 1;
        services.begin("training the network", Some(total as u64), "generations");
        let verdict = judge(samples, &trial, &decays, self.folds, |fold, generation| {
            let done = fold * (generations + 1) + generation.index + 1;
            services
                .advance(done as u64, &format!("cross-validation {} of {}, best {:.4}", fold + 1, self.folds, generation.best));
        });
        if !verdict.helps() {
            services.note(format!("the network was not kept: {}", sentence(&verdict)));
            return (Network::default(), Training::default());
        }
        let recipe = Recipe { decay: verdict.decay, ..recipe };
        let before = self.folds * (generations + 1);
        let (correction, course) = train(samples, &recipe, |generation| {
            services.advance((before + generation.index + 1) as u64, &format!("best {:.4}", generation.best));
        });
        services.note(format!("the network was kept: {}, decay {}", sentence(&verdict), verdict.decay));
        (Network::of(&correction, prismatic), history(context.id, course))
    }
}

fn sentence(verdict: &Verdict) -> String {
    format!("cross-validated error {:.3} -> {:.3} mm on its own training rows", verdict.before * 1e3, verdict.after * 1e3)
}

/// The rows whose residual is not absurdly far off.
fn within_reach(prediction: &Prediction, rows: &[usize], context: &Context) -> Vec<usize> {
    let mut errors: Vec<f64> = rows.iter().map(|row| prediction.0[*row].error_mm).collect();
    errors.sort_by(f64::total_cmp);
    let limit = FAR * errors.get(errors.len() / 2).copied().unwrap_or(f64::INFINITY);
    let near: Vec<usize> =
        rows.iter().copied().filter(|row| prediction.0[*row].error_mm <= limit && !prediction.0[*row].suspect).collect();
    if near.len() < rows.len() {
        context.services.note(format!(
            "{} of {} rows are not learnt from: their error is over {limit:.3} mm, {FAR} times the median, or they are suspects",
            rows.len() - near.len(),
            rows.len()
        ));
    }
    near
}

/// Residual of a row, m.
fn residual(row: &PredictionRow) -> [f64; OUTPUTS] {
    [row.dx_mm, row.dy_mm, row.dz_mm].map(|value| value * 1e-3)
}

/// Every prediction with the correction; rows that were trained on are no longer held out.
fn corrected(
    prediction: &Prediction,
    network: &Network,
    recording: &Recording,
    sources: &[Vec<f64>],
    trained: &[usize],
    context: &Context,
) -> Result<Prediction> {
    // Read back from its table, so that whoever applies the table later gets these very numbers.
    let correction = network.correction(&recording.prismatic)?;
    let mut rows = prediction.0.clone();
    let (mut fading, mut outside) = (0, 0);
    for (row, sources) in rows.iter_mut().zip(sources) {
        row.step = context.id.into();
        let Some(correction) = &correction else { continue };
        let applied = correction.at(sources);
        outside += usize::from(applied.share == 0.0);
        fading += usize::from(applied.share > 0.0 && applied.share < 1.0);
        let [x, y, z] = applied.delta.map(|value| value * 1e3);
        (row.x_mm, row.y_mm, row.z_mm) = (row.x_mm + x, row.y_mm + y, row.z_mm + z);
        (row.dx_mm, row.dy_mm, row.dz_mm) = (row.dx_mm - x, row.dy_mm - y, row.dz_mm - z);
        row.error_mm = (row.dx_mm * row.dx_mm + row.dy_mm * row.dy_mm + row.dz_mm * row.dz_mm).sqrt();
    }
    for row in trained {
        rows[*row].held_out = false;
    }
    if fading + outside > 0 {
        context.services.note(format!(
            "{} of {} rows lie outside the joint range or payload that the network saw: it fades out on {fading} and is silent on {outside}",
            fading + outside,
            rows.len()
        ));
    }
    Ok(Prediction(rows))
}

fn history(step: &str, course: Vec<Course>) -> Training {
    let rows = course.into_iter().map(|record| TrainingRow {
        step: step.into(),
        phase: match record.phase {
            Phase::Swarm => "swarm".into(),
            Phase::Gradient => "gradient".into(),
        },
        member: record.member as i64,
        generation: record.index as i64,
        best: record.best,
        train_rms_mm: record.train_rms * 1e3,
        check_rms_mm: record.check_rms.map(|rms| rms * 1e3),
        evaluations: record.evaluations as i64,
    });
    Training(rows.collect())
}
