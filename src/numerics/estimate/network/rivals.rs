//! Which correction helps most, if any? Decided by cross-validation within the training rows, before anything else sees the result.
//!
//! Rows are judged by corrections that did not see their pose. Folds are made of runs of neighbouring poses, each with all its targets,
//! since a recording's neighbours are alike and a row must not be predicted from its twin. "No correction" is a rival: it stays unless the gain is clear.

use super::arm::ScrewArm;
use super::basis::{BasisTerm, curves, harmonics};
use super::correction::{Body, Correction};
use super::linear::Linear;
use super::process::Process;
use super::region::{Region, TrainingSamples};
use super::training::{Recipe, TrainingStart, TrainingStep, dressed, train};
use crate::estimate::swarm::{Algorithm, Generation};
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
    /// Joint curves, small motions of links and wind-up by weight, through the Jacobian.
    Curves,
    /// Multilayer perceptrons whose outputs move the point along the axes, by where their training starts.
    Network(TrainingStart),
    /// Multilayer perceptrons whose outputs are joint motions, through the Jacobian.
    JointNetwork(TrainingStart),
}

/// Kinds of networks: each has its decay and size of hidden layer chosen for itself, with random starts.
const KINDS: [fn(TrainingStart) -> Rival; 2] = [Rival::Network, Rival::JointNetwork];

impl Rival {
    /// As tables hold it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ridge => "ridge",
            Self::Process => "gaussian_process",
            Self::Curves => "curves",
            Self::Network(TrainingStart::Random) => "mlp_random",
            Self::Network(TrainingStart::Swarm(algorithm)) => match algorithm {
                Algorithm::Bas => "mlp_bas",
                Algorithm::Bso => "mlp_bso",
                Algorithm::Pso => "mlp_pso",
                Algorithm::Ga => "mlp_ga",
                Algorithm::Abc => "mlp_abc",
            },
            Self::JointNetwork(TrainingStart::Random) => "mlp_joints_random",
            Self::JointNetwork(TrainingStart::Swarm(algorithm)) => match algorithm {
                Algorithm::Bas => "mlp_joints_bas",
                Algorithm::Bso => "mlp_joints_bso",
                Algorithm::Pso => "mlp_joints_pso",
                Algorithm::Ga => "mlp_joints_ga",
                Algorithm::Abc => "mlp_joints_abc",
            },
        }
    }

    /// Whether it needs the arm.
    pub fn goes_through_the_jacobian(self) -> bool {
        matches!(self, Self::Curves | Self::JointNetwork(_))
    }

    fn start(self) -> Option<TrainingStart> {
        match self {
            Self::Network(start) | Self::JointNetwork(start) => Some(start),
            _ => None,
        }
    }

    fn is_of(self, kind: fn(TrainingStart) -> Self) -> bool {
        self.start().is_some_and(|start| kind(start) == self)
    }
}

/// What is compared.
#[derive(Debug, Clone)]
pub struct RivalContest<'a> {
    /// What is compared.
    pub rivals: Vec<Rival>,
    /// What joint curves and joint networks go through; without it they are no rivals.
    pub arm: Option<&'a ScrewArm>,
    /// Whether each joint slides.
    pub prismatic: &'a [bool],
    /// How the kept correction is trained.
    pub recipe: Recipe,
    /// How networks are trained in each fold.
    pub trial: Recipe,
    /// Decays and sizes of the hidden layer to choose from, with random starts.
    pub decays: Vec<f64>,
    /// Numbers of neurons to compare.
    pub hidden: Vec<usize>,
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
    /// Hidden neurons and decay of networks.
    pub settings: Option<(usize, f64)>,
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

/// How many fits [`compare`] makes.
pub fn fits(contest: &RivalContest) -> usize {
    let grids = KINDS.iter().filter(|kind| contest.has(**kind)).count();
    (contest.rivals.len() + grids * contest.decays.len() * contest.hidden.len()) * contest.folds
}

impl RivalContest<'_> {
    /// Whether networks of a kind take part, from whatever start.
    fn has(&self, kind: fn(TrainingStart) -> Rival) -> bool {
        self.rivals.iter().any(|rival| rival.is_of(kind))
    }
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
    let judged = |entered: &[(Rival, Recipe)]| -> Vec<Option<JudgedRival>> {
        let fitted = in_order(contest.recipe.jobs, entered.len() * folds, |t| {
            let ((rival, recipe), fold) = (&entered[t / folds], t % folds);
            let result = tried(*rival, recipe, fold, samples, &poses, contest);
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
            .map(|((rival, recipe), fitted)| {
                let settings = (recipe.hidden, recipe.decay);
                let settings = rival.start().is_some().then_some(settings);
                together(*rival, settings, fitted, &before, &poses)
            })
            .collect()
    };
    let trial = Recipe {
        jobs: 1,
        ..contest.trial.clone()
    };
    let rivals = contest.rivals.iter();
    let mut entered: Vec<(Rival, Recipe)> = rivals.map(|rival| (*rival, trial.clone())).collect();
    for kind in KINDS.into_iter().filter(|kind| contest.has(*kind)) {
        let settings = contest
            .hidden
            .iter()
            .flat_map(|hidden| contest.decays.iter().map(move |decay| (*hidden, *decay)));
        let grid: Vec<(Rival, Recipe)> = settings
            .map(|(hidden, decay)| (kind(TrainingStart::Random), trial.sized(hidden, decay)))
            .collect();
        let errors: Vec<f64> = judged(&grid)
            .iter()
            .map(|row| row.as_ref().map_or(f64::NAN, JudgedRival::mean))
            .collect();
        if let Some(best) = (0..grid.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b])) {
            let of_kind = entered.iter_mut().filter(|(rival, _)| rival.is_of(kind));
            of_kind.for_each(|(_, recipe)| *recipe = grid[best].1.clone());
        }
    }
    let nothing = JudgedRival {
        rival: None,
        left: before.clone(),
        gain: 0.0,
        sigma: 0.0,
        numbers: 0,
        evaluations: 0,
        settings: None,
    };
    let others = judged(&entered).into_iter().flatten();
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
    let recipe = match judged.settings {
        Some((hidden, decay)) => contest.recipe.sized(hidden, decay),
        None => contest.recipe.clone(),
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
    let linear = |arm, groups: Vec<Vec<BasisTerm>>| {
        Some(Body::Linear(Linear::fit(
            samples,
            arm,
            &groups,
            recipe.seed,
        )?))
    };
    let body = match rival {
        Rival::Network(start) | Rival::JointNetwork(start) => {
            let through = match rival {
                Rival::JointNetwork(_) => Some(contest.arm?.clone()),
                _ => None,
            };
            let recipe = Recipe {
                start,
                through,
                ..recipe
            };
            return Some(train(samples, &recipe, observe));
        }
        Rival::Ridge => linear(None, harmonics(contest.prismatic))?,
        Rival::Curves => linear(contest.arm, curves(contest.arm?, samples.rows()))?,
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
    recipe: &Recipe,
    fold: usize,
    samples: &TrainingSamples,
    poses: &[usize],
    contest: &RivalContest,
) -> Option<Done> {
    let count = poses.iter().max()? + 1;
    let (inside, outside): (Vec<usize>, Vec<usize>) = (0..samples.rows())
        .partition(|row| poses[*row] * contest.folds * RUNS / count % contest.folds != fold);
    let recipe = Recipe {
        seed: recipe.seed ^ (fold as u64 + 1),
        ..recipe.clone()
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
    // A course counts up within each member, and the swarm's is member 0.
    let members = course.chunk_by(|a, b| a.member == b.member);
    Some(Done {
        left: outside.iter().map(left).collect(),
        numbers: correction.numbers(),
        evaluations: members.map(|one| one[one.len() - 1].evaluations).sum(),
    })
}

/// All folds of one rival; `None` where one could not be fitted.
fn together(
    rival: Rival,
    settings: Option<(usize, f64)>,
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
        settings,
    })
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
