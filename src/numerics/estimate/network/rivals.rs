//! Which correction helps most, if any? Decided by cross-validation within the training rows, before anything else sees the result.
//!
//! Rows are judged by corrections that did not see their pose. Folds are made of runs of neighbouring poses, each with all its targets,
//! since a recording's neighbours are alike and a row must not be predicted from its twin. "No correction" is a rival: it stays unless the gain is clear.

use super::correction::{Body, Correction};
use super::process::Process;
use super::region::{Region, TrainingSamples};
use super::ridge::Ridge;
use super::training::{Phase, Recipe, TrainingStart, TrainingStep, dressed, train};
use crate::estimate::swarm::Generation;
use crate::estimate::threads::in_order;
use std::sync::Mutex;

/// Runs of neighbouring poses per fold.
const RUNS: usize = 4;
/// The mean gain must exceed so many of its standard errors: several rivals are tried, and neighbouring poses are alike.
const CLEAR: f64 = 3.0;

/// What may be learnt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rival {
    /// Harmonics of the joints along the axes of the tracker's frame.
    Ridge,
    /// A Gaussian process of the networks' inputs.
    Process,
    /// A multilayer perceptron whose outputs move the point along the axes, by where its training starts.
    Network(TrainingStart),
}

impl Rival {
    /// As tables hold it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ridge => "ridge",
            Self::Process => "gaussian_process",
            Self::Network(TrainingStart::Random) => "mlp_random",
            Self::Network(TrainingStart::Swarm) => "mlp_bso",
        }
    }

    fn is_network(self) -> bool {
        matches!(self, Self::Network(_))
    }
}

/// What is compared.
#[derive(Debug, Clone)]
pub struct RivalContest<'a> {
    /// What is compared.
    pub rivals: Vec<Rival>,
    /// Whether each joint slides.
    pub prismatic: &'a [bool],
    /// How the kept correction is trained.
    pub recipe: Recipe,
    /// How networks are trained in each fold.
    pub trial: Recipe,
    /// Decays of networks to choose from, with random starts.
    pub decays: Vec<f64>,
    /// Parts of the cross-validation.
    pub folds: usize,
}

/// What the cross-validation says of one rival.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedRival {
    /// `None`: no correction.
    pub rival: Option<Rival>,
    /// Length of what is left of each row, m.
    pub(crate) left: Vec<f64>,
    /// Mean gain over no correction and its standard error, m.
    pub gain: f64,
    /// Standard error of the mean gain, m.
    pub sigma: f64,
    /// Numbers of one correction, and evaluations of a loss for it; both of the first fold.
    pub numbers: usize,
    /// Evaluations of the loss in training.
    pub evaluations: u64,
    /// Decay of a network.
    pub decay: Option<f64>,
}

impl JudgedRival {
    /// m.
    pub fn mean(&self) -> f64 {
        mean(&self.left)
    }
    /// m.
    pub fn rms(&self) -> f64 {
        (self.left.iter().map(|e| e * e).sum::<f64>() / self.left.len().max(1) as f64).sqrt()
    }
    /// m.
    pub fn max(&self) -> f64 {
        self.left.iter().copied().fold(0.0, f64::max)
    }
    /// Whether the gain is clearly positive.
    pub fn helps(&self) -> bool {
        self.rival.is_some() && self.gain > CLEAR * self.sigma
    }
}

/// Everything learnt from the samples: the rivals as judged, and the number of the one to keep (0: no correction).
#[derive(Debug, Clone, PartialEq)]
pub struct RivalComparison {
    /// Every rival with its cross-validated errors.
    pub judged: Vec<JudgedRival>,
    /// Position of the one that is kept; 0 is no correction.
    pub chosen: usize,
}

/// What a fit of one fold leaves of the rows of that fold.
struct Done {
    left: Vec<(usize, f64)>,
    numbers: usize,
    evaluations: u64,
}

impl RivalContest<'_> {
    /// Everything that is fitted in each fold at first: rivals without a choice, and networks from a random start by decay.
    fn first(&self) -> Vec<(Rival, f64)> {
        let plain = self.rivals.iter().filter(|rival| !rival.is_network());
        let mut entered: Vec<(Rival, f64)> = plain.map(|rival| (*rival, 0.0)).collect();
        if self.rivals.iter().any(|rival| rival.is_network()) {
            let network = Rival::Network(TrainingStart::Random);
            entered.extend(self.decays.iter().map(|decay| (network, *decay)));
        }
        entered
    }

    /// Whether a network that a swarm starts is a rival.
    fn swarms(&self) -> bool {
        self.rivals.contains(&Rival::Network(TrainingStart::Swarm))
    }
}

/// How many fits [`compare`] makes.
pub fn fits(contest: &RivalContest) -> usize {
    (contest.first().len() + usize::from(contest.swarms())) * contest.folds
}

/// Judges all rivals in the contest's folds; `observe` sees how many fits are done, and of which rival the last was.
///
/// Panics with fewer than two folds or rows.
pub fn compare(
    samples: &TrainingSamples,
    contest: &RivalContest,
    observe: &(dyn Fn(usize, &str) + Sync),
) -> RivalComparison {
    let folds = contest.folds;
    assert!(
        folds >= 2 && samples.rows() >= 2,
        "something to choose from"
    );
    let done = Mutex::new(0);
    let poses = samples.poses();
    let before: Vec<f64> = samples.residual.iter().map(|r| length(*r)).collect();
    // Every entry in all folds; none where it cannot be fitted to one of them.
    let judged = |entered: &[(Rival, f64)]| -> Vec<Option<JudgedRival>> {
        let fitted = in_order(contest.recipe.jobs, entered.len() * folds, |t| {
            let ((rival, decay), fold) = (entered[t / folds], t % folds);
            let result = tried(rival, decay, fold, samples, &poses, contest);
            let mut done = done.lock().expect("no fit panics");
            *done += 1;
            let mean = result.as_ref().map_or(f64::NAN, |r| {
                r.left.iter().map(|left| left.1).sum::<f64>() / r.left.len() as f64
            });
            let (name, part, mm) = (rival.name(), fold + 1, mean * 1e3);
            observe(
                *done,
                &format!("{name}, part {part} of {folds}: {mm:.4} mm"),
            );
            result
        });
        let entered = entered.iter().zip(fitted.chunks(folds));
        entered
            .map(|((rival, decay), fitted)| {
                let decay = rival.is_network().then_some(*decay);
                together(*rival, decay, fitted, &before, &poses)
            })
            .collect()
    };
    let mut others: Vec<JudgedRival> = judged(&contest.first()).into_iter().flatten().collect();
    let is_network = |judged: &&JudgedRival| judged.rival.is_some_and(Rival::is_network);
    let networks = others.iter().filter(is_network);
    let best = networks
        .min_by(|a, b| a.mean().total_cmp(&b.mean()))
        .cloned();
    others.retain(|judged| !is_network(&judged));
    if let Some(best) = best {
        let decay = best.decay.unwrap_or_default();
        others.extend(
            contest
                .rivals
                .contains(&Rival::Network(TrainingStart::Random))
                .then_some(best),
        );
        if contest.swarms() {
            let swarm = (Rival::Network(TrainingStart::Swarm), decay);
            others.extend(judged(&[swarm]).into_iter().flatten());
        }
    }
    let nothing = JudgedRival {
        rival: None,
        left: before.clone(),
        gain: 0.0,
        sigma: 0.0,
        numbers: 0,
        evaluations: 0,
        decay: None,
    };
    let judged: Vec<JudgedRival> = std::iter::once(nothing).chain(others).collect();
    let helping = (0..judged.len()).filter(|j| judged[*j].helps());
    let chosen = helping
        .min_by(|a, b| judged[*a].mean().total_cmp(&judged[*b].mean()))
        .unwrap_or(0);
    RivalComparison { judged, chosen }
}

/// The rival learnt from all samples, with the course of a network's training. `None` where it cannot be fitted.
pub fn learn(
    samples: &TrainingSamples,
    contest: &RivalContest,
    judged: &JudgedRival,
    observe: &mut dyn FnMut(&Generation),
) -> Option<(Correction, Vec<TrainingStep>)> {
    let recipe = Recipe {
        decay: judged.decay.unwrap_or_default(),
        ..contest.recipe.clone()
    };
    let (mut correction, course) = fit(judged.rival?, samples, contest, recipe, observe)?;
    correction.left = judged.rms() / 3.0_f64.sqrt();
    Some((correction, course))
}

fn fit(
    rival: Rival,
    samples: &TrainingSamples,
    contest: &RivalContest,
    recipe: Recipe,
    observe: &mut dyn FnMut(&Generation),
) -> Option<(Correction, Vec<TrainingStep>)> {
    let body = match rival {
        Rival::Network(start) => {
            let recipe = Recipe { start, ..recipe };
            return Some(train(samples, &recipe, observe));
        }
        Rival::Ridge => Body::Ridge(Ridge::fit(samples, contest.prismatic, recipe.seed)?),
        Rival::Process => {
            let (dress, x, y) = dressed(samples, &recipe.features);
            Body::Process(dress, Process::fit(&x, &y)?)
        }
    };
    let correction = Correction {
        body,
        region: Region::of(&samples.sources, recipe.joints),
        left: 0.0,
    };
    Some((correction, Vec::new()))
}

/// A rival learnt without a fold, and what it leaves there; `poses`: that of each row.
fn tried(
    rival: Rival,
    decay: f64,
    fold: usize,
    samples: &TrainingSamples,
    poses: &[usize],
    contest: &RivalContest,
) -> Option<Done> {
    let count = poses.iter().max()? + 1;
    let (inside, outside): (Vec<usize>, Vec<usize>) = (0..samples.rows())
        .partition(|row| poses[*row] * contest.folds * RUNS / count % contest.folds != fold);
    let recipe = Recipe {
        seed: contest.trial.seed ^ (fold as u64 + 1),
        decay,
        jobs: 1,
        ..contest.trial.clone()
    };
    let training = samples.pick(&inside);
    let (correction, course) = fit(rival, &training, contest, recipe, &mut |_| {})?;
    let left = |row: &usize| {
        let (delta, residual) = (
            correction.at(&samples.sources[*row]).delta,
            samples.residual[*row],
        );
        let off = std::array::from_fn(|k| residual[k] - delta[k]);
        (*row, length(off))
    };
    let last_of = |phase| course.iter().rfind(|step| step.phase == phase);
    let phases = [Phase::Swarm, Phase::Gradient].into_iter();
    Some(Done {
        left: outside.iter().map(left).collect(),
        numbers: correction.numbers(),
        evaluations: phases
            .filter_map(last_of)
            .map(|step| step.evaluations)
            .sum(),
    })
}

/// All folds of one rival; `None` where one could not be fitted.
fn together(
    rival: Rival,
    decay: Option<f64>,
    folds: &[Option<Done>],
    before: &[f64],
    poses: &[usize],
) -> Option<JudgedRival> {
    let mut left = before.to_vec();
    for fold in folds {
        for (row, value) in &fold.as_ref()?.left {
            left[*row] = *value;
        }
    }
    let first = folds.first()?.as_ref()?;
    let pairs = before.iter().zip(&left);
    let gains: Vec<f64> = pairs.map(|(before, left)| before - left).collect();
    let gain = mean(&gains);
    // Targets of one pose are moved together: the gain's scatter is that of poses.
    let mut off = vec![0.0; poses.iter().max()? + 1];
    let rows = poses.iter().zip(&gains);
    rows.for_each(|(pose, error)| off[*pose] += error - gain);
    let (count, rows) = (off.len() as f64, gains.len() as f64);
    let squares = off.iter().map(|off| off * off).sum::<f64>();
    Some(JudgedRival {
        rival: Some(rival),
        left,
        gain,
        sigma: (squares * count / (count - 1.0).max(1.0)).sqrt() / rows,
        numbers: first.numbers,
        evaluations: first.evaluations,
        decay,
    })
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
