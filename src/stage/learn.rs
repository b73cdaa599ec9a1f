//! `learn`: what corrects best what the identified model leaves over, if anything does (Wang et al. 2020, section 5, and rivals).
//!
//! Cross-validation within the training rows compares the rivals, "no correction" among them; the best is kept if its gain is clear,
//! else the table `network` stays empty and the prediction is what it was. The table `corrections` says how all of them did.
//! Outside the region of its training rows a correction fades to zero.

use crate::error::{Error, Place, Result, counted};
use crate::estimate::network::correction::features;
use crate::estimate::network::rivals::{RivalComparison, RivalContest, fits, learn};
use crate::estimate::network::{
    Activation, JudgedRival, OUTPUTS, Phase, Recipe, Rival, TrainingSamples, TrainingStart,
    TrainingStep, compare,
};
use crate::statistics::nearest;
use crate::table::{
    Corrections, CorrectionsRow, Network, Prediction, PredictionRow, Recording, Split, Training,
    TrainingRow,
};
use crate::{Context, Stage};
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
/// Rows times iterations that the networks of a fold may cost: long recordings have fewer iterations, but not below [`FOLD_ITERATIONS`].
const FOLD_WORK: usize = 1_000_000;
const FOLD_ITERATIONS: usize = 60;

/// Settings of `learn`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Learn {
    /// Sets of the split to train on.
    pub on: Vec<String>,
    /// What is compared; "no correction" always is.
    pub rivals: Vec<RivalSetting>,
    /// Where the training of networks starts, each a rival.
    pub starts: Vec<StartSetting>,
    /// What networks and the Gaussian process see.
    pub inputs: Inputs,
    /// Whether they also see the payload; the recording must have it in every row to train on.
    pub payload: bool,
    /// Neurons of the hidden layer.
    pub hidden: usize,
    /// Activation of the hidden layer.
    pub activation: Activation,
    /// Beetles of the swarm that finds where the gradient training starts.
    pub beetles: usize,
    /// Generations of the swarm.
    pub generations: usize,
    /// Most iterations of the gradient training.
    pub iterations: usize,
    /// Weight decay: half of it times the squared weights stands beside half the squared standardised errors of all rows. Chosen by
    /// cross-validation if not given.
    pub decay: Option<f64>,
    /// Share of the training rows that a network keeps back to stop in time, below 0.5. With the decay chosen by cross-validation the
    /// rows are worth more in training than kept back, hence 0.
    pub keep_back: f64,
    /// Folds of the cross-validation.
    pub folds: usize,
}

impl Default for Learn {
    fn default() -> Self {
        Self {
            on: vec!["fit".into()],
            rivals: vec![
                RivalSetting::Ridge,
                RivalSetting::GaussianProcess,
                RivalSetting::Mlp,
            ],
            starts: vec![StartSetting::Random, StartSetting::Bso],
            inputs: Inputs::Joints,
            payload: false,
            hidden: 12,
            activation: Activation::Sigmoid,
            beetles: 50,
            generations: 200,
            iterations: 200,
            decay: None,
            keep_back: 0.0,
            folds: 5,
        }
    }
}

/// A kind of correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RivalSetting {
    /// Harmonics of the joints, alone and two by two, along the tracker's axes.
    Ridge,
    /// A smooth function of the inputs with a length for each.
    GaussianProcess,
    /// A network with one hidden layer, a displacement of the point as its output.
    Mlp,
}

/// Where the training of networks starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StartSetting {
    /// Anywhere.
    Random,
    /// At what a beetle swarm found, as in the paper.
    Bso,
}

impl From<StartSetting> for TrainingStart {
    fn from(setting: StartSetting) -> Self {
        match setting {
            StartSetting::Random => Self::Random,
            StartSetting::Bso => Self::Swarm,
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

crate::stage! {
    Learn, "learn", 9, "learns the residual of the model: compares several corrections, and keeps the best only where it helps",
        LearnReads {
            recording: Recording,
            split: Split,
            prediction: Prediction,
        } -> LearnWrites {
            network: Network,
            corrections: Corrections,
            training: Training,
            prediction: Prediction,
        }
}

impl Stage for Learn {
    fn faults(&self, at: &mut Place) {
        crate::must_name_sets(&self.on, "learn", at);
        at.at("hidden").whole(self.hidden, 1..=200);
        at.at("beetles").whole(self.beetles, 1..=1000);
        at.at("generations").whole(self.generations, 0..=10_000);
        at.at("iterations").whole(self.iterations, 1..=10_000);
        at.at("folds").whole(self.folds, 2..=20);
        at.at("rivals").must(
            !self.rivals.is_empty(),
            "expected at least one of ridge, gaussian_process, mlp",
        );
        let trains = self.rivals.contains(&RivalSetting::Mlp);
        at.at("starts").must(
            !(self.starts.is_empty() && trains),
            "expected at least one of random, bso",
        );
        let (share, decay) = (self.keep_back, self.decay.unwrap_or_default());
        at.at("keep_back").must(
            (0.0..0.5).contains(&share),
            format!("expected a share from 0 to below 0.5, not {share}"),
        );
        at.at("decay").must(
            (0.0..=1e6).contains(&decay),
            format!("expected a number from 0 to 1e6, e.g. 1, not {decay}"),
        );
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        crate::on(&self.on)
    }

    fn run(&self, reads: LearnReads, context: &Context) -> Result<LearnWrites> {
        let LearnReads {
            recording,
            split,
            prediction,
        } = reads;
        let sequence = prediction.0.iter().map(|row| row.sequence);
        if !sequence.eq(recording.sequence.iter().copied()) {
            let message = "does not belong to this recording: their sequence numbers differ";
            return Err(Error::data("table prediction", message));
        }
        let mut rows = split.rows(&recording, &self.on)?;
        // What is learnt are displacements of points: rows of fewer axes or of distances have none.
        let asked = rows.len();
        rows.retain(|row| recording.point(*row).is_some());
        if rows.is_empty() && asked > 0 {
            let message = format!(
                "learn corrects points: none of the {asked} rows to learn from measured a whole point (x, y, z)"
            );
            return Err(Error::data("table recording", message));
        }
        let sources = self.sources(&recording, &rows)?;
        let near = within_reach(&prediction, &rows, context);
        let samples = TrainingSamples {
            sources: near.iter().map(|row| sources[*row].clone()).collect(),
            residual: near
                .iter()
                .map(|row| residual(&prediction.0[*row]))
                .collect(),
        };
        let (network, corrections, training) = self.learn(&samples, &recording.prismatic, context);
        let prediction = corrected(&prediction, &network, &recording, &sources, &rows, context)?;
        Ok(LearnWrites {
            prediction,
            network,
            corrections,
            training,
        })
    }
}

impl Learn {
    /// Joints of each row, and the payload where all training rows have it: it bounds where the correction is valid even where the
    /// networks do not see it.
    fn sources(&self, recording: &Recording, trained: &[usize]) -> Result<Vec<Vec<f64>>> {
        let is_whole = |column: &&Vec<f64>| trained.iter().all(|row| column[*row].is_finite());
        let payload = recording.payload.as_ref().filter(is_whole);
        if payload.is_none() && self.payload {
            let message = "the recording has no payload in some of the rows to train on";
            return Err(Error::data("with.payload", message));
        }
        let source = |row: usize| {
            let payload = payload.map(|payload| payload[row]);
            recording.q(row).iter().copied().chain(payload).collect()
        };
        Ok((0..recording.rows()).map(source).collect())
    }

    fn recipe(&self, prismatic: &[bool], context: &Context) -> Recipe {
        Recipe {
            joints: prismatic.len(),
            features: features(prismatic, self.inputs == Inputs::SinCos, self.payload),
            hidden: self.hidden,
            activation: self.activation,
            start: TrainingStart::Random,
            beetles: self.beetles,
            generations: self.generations,
            iterations: self.iterations,
            decay: 1.0,
            keep_back: self.keep_back,
            seed: context.seed,
            jobs: context.jobs,
        }
    }

    /// The correction as a table (empty if none helps), the rivals, and the course of a network's training.
    fn learn(
        &self,
        samples: &TrainingSamples,
        prismatic: &[bool],
        context: &Context,
    ) -> (Network, Corrections, Training) {
        let rows = samples.rows();
        if rows < FEWEST {
            context.warn(format!(
                "only {} to learn from, at least {FEWEST} are needed: no correction",
                counted(rows, "row")
            ));
            return Default::default();
        }
        let contest = self.contest(rows, prismatic, context);
        context
            .services
            .begin("comparing corrections", Some(fits(&contest) as u64), "fits");
        let comparison = compare(samples, &contest, &|done, what| {
            context.services.advance(done as u64, what)
        });
        let kept = &comparison.judged[comparison.chosen];
        context
            .services
            .begin("learning", Some(self.generations as u64 + 1), "generations");
        let learnt = learn(samples, &contest, kept, &mut |generation| {
            context.services.advance(
                generation.index as u64 + 1,
                &format!("best {:.4}", generation.best),
            );
        });
        let corrections = comparison_table(context.id, &contest, &comparison, learnt.is_some());
        context.note(sentence(&comparison, learnt.is_some()));
        match learnt {
            Some((correction, course)) => (
                Network::of(&correction, prismatic),
                corrections,
                history(context.id, course),
            ),
            None => (Network::default(), corrections, Training::default()),
        }
    }

    fn contest<'a>(
        &self,
        rows: usize,
        prismatic: &'a [bool],
        context: &Context,
    ) -> RivalContest<'a> {
        let recipe = self.recipe(prismatic, context);
        let trial = Recipe {
            generations: self.generations.min(FOLD_GENERATIONS),
            iterations: (FOLD_WORK / rows).max(FOLD_ITERATIONS).min(self.iterations),
            ..recipe.clone()
        };
        let mut rivals: Vec<Rival> = Vec::new();
        for rival in &self.rivals {
            let starts = self.starts.iter().map(|start| (*start).into());
            let these = match rival {
                RivalSetting::Ridge => vec![Rival::Ridge],
                RivalSetting::GaussianProcess => vec![Rival::Process],
                RivalSetting::Mlp => starts.map(Rival::Network).collect(),
            };
            for rival in these {
                if !rivals.contains(&rival) {
                    rivals.push(rival);
                }
            }
        }
        RivalContest {
            rivals,
            prismatic,
            recipe,
            trial,
            decays: self.decay.map_or(DECAYS.to_vec(), |decay| vec![decay]),
            folds: self.folds,
        }
    }
}

/// The rows whose residual is not absurdly far off.
fn within_reach(prediction: &Prediction, rows: &[usize], context: &Context) -> Vec<usize> {
    let mut errors: Vec<f64> = rows.iter().map(|row| prediction.0[*row].error_mm).collect();
    let limit = FAR * nearest(&mut errors, 0.5).unwrap_or(f64::INFINITY);
    let is_near = |row: &PredictionRow| row.error_mm <= limit && !row.suspect;
    let near = rows.iter().copied();
    let near: Vec<usize> = near.filter(|row| is_near(&prediction.0[*row])).collect();
    if near.len() < rows.len() {
        context.note(format!(
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

/// What the comparison comes to, for the person who waits.
pub fn sentence(comparison: &RivalComparison, learnt: bool) -> String {
    let tell = |judged: &JudgedRival| {
        let name = judged.rival.map_or("none", Rival::name);
        format!("{name} {:.3} mm", judged.mean() * 1e3)
    };
    let all: Vec<String> = comparison.judged.iter().map(tell).collect();
    let kept = comparison.judged[comparison.chosen].rival;
    let what = match kept.filter(|_| learnt) {
        None => "no correction was kept".to_string(),
        Some(rival) => format!("`{}` was kept", rival.name()),
    };
    format!(
        "{what}; cross-validated error on its own training rows: {}",
        all.join(", ")
    )
}

/// How the learned corrections compare, a row each.
pub fn comparison_table(
    step: &str,
    contest: &RivalContest,
    comparison: &RivalComparison,
    learnt: bool,
) -> Corrections {
    let chosen = if learnt { comparison.chosen } else { 0 };
    let best = &comparison.judged[chosen];
    let before = comparison.judged[0].mean() * 1e3;
    let row = |(j, judged): (usize, &JudgedRival)| {
        let behind = (judged.mean() - best.mean()) * 1e3;
        let (gain, sigma) = (judged.gain * 1e3, judged.sigma * 1e3);
        let reason = match judged.rival {
            None if j == chosen => "nothing that was tried helps clearly".to_string(),
            None => format!("a correction gains {:.3} mm", best.gain * 1e3),
            Some(_) if j == chosen => {
                format!("smallest error of those that help: gains {gain:.3} +- {sigma:.3} mm")
            }
            Some(_) if !judged.helps() => {
                format!("does not help clearly: gains {gain:.3} +- {sigma:.3} mm")
            }
            Some(_) => format!(
                "{behind:.3} mm behind {}",
                best.rival.map_or("none", Rival::name)
            ),
        };
        CorrectionsRow {
            step: step.into(),
            rival: judged.rival.map_or("none", Rival::name).into(),
            chosen: j == chosen,
            reason,
            before_mm: before,
            mean_mm: Some(judged.mean() * 1e3),
            rms_mm: Some(judged.rms() * 1e3),
            max_mm: Some(judged.max() * 1e3),
            gain_mm: Some(gain),
            gain_sigma_mm: Some(sigma),
            numbers: judged.numbers as i64,
            evaluations: judged.evaluations as i64,
            hidden: judged.decay.map(|_| contest.recipe.hidden as i64),
            decay: judged.decay,
        }
    };
    let mut rows: Vec<CorrectionsRow> = comparison.judged.iter().enumerate().map(row).collect();
    let untried = contest.rivals.iter().filter(|rival| {
        let mut judged = comparison.judged.iter();
        judged.all(|judged| judged.rival != Some(**rival))
    });
    rows.extend(untried.map(|rival| CorrectionsRow {
        step: step.into(),
        rival: rival.name().into(),
        chosen: false,
        reason: "it could not be fitted to these rows".into(),
        before_mm: before,
        ..CorrectionsRow::default()
    }));
    Corrections(rows)
}

/// The course of a training as a table.
pub fn history(step: &str, course: Vec<TrainingStep>) -> Training {
    let rows = course.into_iter().map(|record| TrainingRow {
        step: step.into(),
        phase: match record.phase {
            Phase::Swarm => "swarm".into(),
            Phase::Gradient => "gradient".into(),
        },
        member: i64::from(record.phase == Phase::Gradient),
        generation: record.index as i64,
        best: record.best,
        train_rms_mm: record.train_rms * 1e3,
        check_rms_mm: record.check_rms.map(|rms| rms * 1e3),
        evaluations: record.evaluations as i64,
    });
    Training(rows.collect())
}

/// Every prediction with the correction; rows that were trained on are no longer held out.
pub fn corrected(
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
        let Some(correction) = &correction else {
            continue;
        };
        let applied = correction.at(sources);
        outside += usize::from(applied.share == 0.0);
        fading += usize::from(applied.share > 0.0 && applied.share < 1.0);
        let [x, y, z] = applied.delta.map(|value| value * 1e3);
        (row.x_mm, row.y_mm, row.z_mm) = (row.x_mm + x, row.y_mm + y, row.z_mm + z);
        (row.dx_mm, row.dy_mm, row.dz_mm) = (row.dx_mm - x, row.dy_mm - y, row.dz_mm - z);
        row.error_mm =
            (row.dx_mm * row.dx_mm + row.dy_mm * row.dy_mm + row.dz_mm * row.dz_mm).sqrt();
        // Cross-validation was of the model without a correction, whichever rows the correction learned from.
        (row.fold_error_mm, row.block_error_mm) = (None, None);
    }
    for row in trained {
        rows[*row].held_out = false;
    }
    if fading + outside > 0 {
        context.note(format!(
            "{} of {} rows lie outside the region (joints, payload) that the correction saw: it fades out on {fading} and is silent on {outside}",
            fading + outside,
            rows.len()
        ));
    }
    Ok(Prediction(rows))
}
