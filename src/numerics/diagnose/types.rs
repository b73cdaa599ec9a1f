//! What a diagnosis is asked, and what it answers.

use crate::effect::{DeclaredCause, EffectDeclaration, Form, ParameterEstimate, Place, names};
use crate::estimate::{Fitted, Folds, Model, Screening};
use crate::observation::Dimension;
use crate::robot::{Measurements, NoiseBasis, RobotModel};
use std::borrow::Cow;
use std::sync::Arc;

/// What is to be diagnosed.
pub struct Question<'a> {
    /// The nominal arm, with its targets.
    pub robot: &'a RobotModel,
    /// All rows of the recording.
    pub data: &'a Measurements,
    /// Rows to fit, ascending.
    pub fit: &'a [usize],
    /// Rows that are predicted in the end and choose nothing, ascending; empty if none are held out.
    pub validate: &'a [usize],
    /// The number of the set that each row belongs to.
    pub set: &'a [usize],
    /// By what ln of the prior odds of rare causes against common ones is multiplied: 1 as the library believes, 0 all alike.
    pub prior_weight: f64,
    /// Prior probability that what acts somewhere is no cause of the list, above 0 and below 1: its odds scale those of all cells without a
    /// name but for products.
    pub open_world: f64,
    /// Names that are not given: the cells of these causes stay and are `unknown`; of the base model, causes that are not fitted.
    pub without: &'a [String],
    /// Effects that the user declares: cells beside those of the library.
    pub declared: &'a [Arc<DeclaredCause>],
    /// Whether the points stand beside an outside simulation: what moves them says nothing of the robot file.
    pub beside_simulation: bool,
    /// What other robots of the model say of cells; empty where nothing is known of any.
    pub known: &'a [KnownCell],
    /// The seed of the folds.
    pub seed: u64,
}

/// A cell of which other robots say how usual and how large it is.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownCell {
    /// Key of the cell.
    pub cell: String,
    /// Probability that a robot has it.
    pub probability: f64,
    /// The smallest and largest usual rms motion at the tool, m.
    pub between: [f64; 2],
}

/// One joint repeatability (rad) and what it rests on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointRepeatability {
    /// rad; 0 where none shows.
    pub sigma: f64,
    /// Repeats of a target in a pose that it rests on; with few it is taken from the residual.
    pub repeats: usize,
}

/// How well a finding stands; of torques, lengths are Nm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Evidence {
    /// Fall of the squared residual beside all other findings by direction that the rows could show, in variances of the noise.
    pub f_statistic: f64,
    /// Chance that noise gives as much to this form alone: the search among many is in the probabilities, not in this.
    pub p_value: f64,
    /// Twice ln of the evidence for it beside all others, without prior odds; of what has no cell (a latency, a push) by its gain less ln of the rows
    /// for each number, which it tends to.
    pub delta_bic: f64,
    /// `None` of positions. Of torques: fall of the rms error of held-out rows over all joints when what is left is fitted again (left as it
    /// is for wrong masses, for which tolerances would bend); `None` where none are held out.
    pub heldout_gain: Option<f64>,
    /// Rms of the whole effect over the recording, m.
    pub effect_rms: f64,
    /// Fall of the whitened squared residual; of torques counted by effective rows.
    pub gain: f64,
}

/// Another explanation, which these data cannot separate.
#[derive(Debug, Clone, PartialEq)]
pub struct RivalCause {
    /// Canonical name of the cause.
    pub effect: Cow<'static, str>,
    /// Where it acts.
    pub place: Place,
    /// Twice ln of the posterior odds of the finding against it.
    pub delta_bic: f64,
    /// That it is this cause and not the finding's, see [`Probabilities`].
    pub probability: f64,
}

/// How probable it is that a finding is what it is called, the other findings taken as they stand: its cell, all that do much of the same and
/// nothing are weighed. With those of its rivals, `name` and `none` add up to one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Probabilities {
    /// That it is the named effect at the named place.
    pub name: f64,
    /// That it acts at the named place, whatever it is.
    pub place: f64,
    /// That it is neither what it is called nor any of the rivals.
    pub none: f64,
}

impl Probabilities {
    /// Of sums that rounding may carry beyond 0 or 1.
    pub fn new(name: f64, place: f64, none: f64) -> Self {
        let [name, place, none] = [name, place, none].map(|value| value.clamp(0.0, 1.0));
        Self { name, place, none }
    }
}

/// A cause of what the base model leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Canonical name of the cause, or [`SETUP`].
    pub effect: Cow<'static, str>,
    /// Where it acts.
    pub place: Place,
    /// The finding in a sentence, with its size.
    pub statement: String,
    /// Fitted numbers, in units that people read.
    pub parameters: Vec<ParameterEstimate>,
    /// None for faults of single rows.
    pub evidence: Option<Evidence>,
    /// Explanations that these data do not exclude, the closest first.
    pub rivals: Vec<RivalCause>,
    /// Probabilities of its name and its place.
    pub probabilities: Probabilities,
    /// Joint (from 0) and range (rad) over which it holds, for joint errors.
    pub valid: Option<(usize, [f64; 2])>,
    /// By which the model is rebuilt.
    pub forms: Vec<Form>,
}

/// A formula for what a finding without a name does, as an effect that may be declared.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedForm {
    /// Position of the finding.
    pub finding: usize,
    /// The formula, ready to be declared.
    pub declaration: EffectDeclaration,
    /// Parts of its formulas and a coefficient each.
    pub price: usize,
    /// Rms (m) of fitted rows under fits that did not see their pose, with the formula.
    pub folds: f64,
    /// The same with the finding as it is.
    pub curve: f64,
    /// The same without both; none where no fit without them is near.
    pub without: Option<f64>,
    /// The cheapest that is as good as the best.
    pub chosen: bool,
    /// Shape numbers, then coefficients.
    pub numbers: Vec<ParameterEstimate>,
}

/// What a wrong set-up is called.
pub const SETUP: &str = "setup";

impl Finding {
    /// A fault of the recording, no physics.
    pub(crate) fn of_recording(effect: &str, statement: String, probability: f64) -> Self {
        Self {
            effect: Cow::Owned(effect.into()),
            place: Place::Recording,
            statement,
            parameters: Vec::new(),
            evidence: None,
            rivals: Vec::new(),
            probabilities: Probabilities::new(probability, probability, 1.0 - probability),
            valid: None,
            forms: Vec::new(),
        }
    }

    /// Whether it is a cause on the arm, its mounting or the instrument; else a fault of the recording, which has no evidence.
    pub(crate) fn is_physics(&self) -> bool {
        self.evidence.is_some() && (self.place != Place::Recording || self.effect == names::UNKNOWN)
    }
}

/// The likeliest of all cells at a place, or of a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct ExplainedShare {
    /// `place` or `variable`.
    pub by: &'static str,
    /// E.g. `joint 3`, `link 2-4`; `q3`, `load of joint 2`, `time` (`row` where none was recorded).
    pub name: String,
    /// Share of the squared residual that the base model leaves, in standard deviations.
    pub share: f64,
    /// How many numbers its curve has.
    pub parameters: usize,
    /// Twice ln of its posterior odds: positive where it is likelier than nothing.
    pub delta_bic: f64,
    /// The name of the cell.
    pub effect: Cow<'static, str>,
}

/// A cell of the table of causes: a place, and the kind of variable that something there follows.
#[derive(Debug, Clone, PartialEq)]
pub struct ExplainedCell {
    /// Where it acts.
    pub place: Place,
    /// E.g. `own angle`, `load`, `time`; `constant` of what follows nothing.
    pub follows: &'static str,
    /// Rms motion at the tool of what the likeliest cause there explains of the residual: m, or rad where no row measured a length.
    pub explains: f64,
    /// Twice ln of its posterior odds: positive where it is likelier than nothing.
    pub delta_bic: f64,
    /// The name of the likeliest cause there.
    pub effect: Cow<'static, str>,
}

/// What a sine and a cosine of an order explain of the residual.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectrumLine {
    /// From 0.
    pub joint: usize,
    /// Whether the order is per turn of the motor.
    pub motor: bool,
    /// Periods per turn of the joint.
    pub order: u32,
    /// Share of the squared residual.
    pub share: f64,
}

/// Where a residual sits.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Located {
    /// Places, then variables; largest shares first.
    pub shares: Vec<ExplainedShare>,
    /// By place and kind of variable.
    pub cells: Vec<ExplainedCell>,
    /// By joint, motor and order.
    pub spectrum: Vec<SpectrumLine>,
}

/// What the data say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VerdictKind {
    /// The findings bring the held-out error down to the noise.
    Explained,
    /// Only noise is left, and there is no finding.
    NothingMissing,
    /// Something is left that no finding explains.
    Unexplained,
    /// Too few rows were fitted.
    NotAsked,
    /// Units, signs, orders, frames or the robot file are wrong: no physics was asked.
    WrongSetup,
}

impl VerdictKind {
    /// As tables and JSON hold it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::NothingMissing => "nothing_missing",
            Self::Unexplained => "unexplained",
            Self::NotAsked => "not_asked",
            Self::WrongSetup => "wrong_setup",
        }
    }
}

/// Sizes of errors: m, or rad where no length was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorLengths {
    /// m or rad.
    pub mean: f64,
    /// m or rad.
    pub rms: f64,
    /// m or rad.
    pub max: f64,
}

impl ErrorLengths {
    /// The errors of some rows; `None` where none of them has any.
    pub(crate) fn of(sizes: &[Option<f64>], rows: &[usize]) -> Option<Self> {
        Self::of_lengths(
            &rows
                .iter()
                .filter_map(|row| sizes[*row])
                .collect::<Vec<_>>(),
        )
    }

    /// The errors of lengths, m, or of angles, rad; `None` where there are none.
    pub(crate) fn of_lengths(lengths: &[f64]) -> Option<Self> {
        let count = lengths.len() as f64;
        (count > 0.0).then(|| Self {
            mean: lengths.iter().sum::<f64>() / count,
            rms: (lengths.iter().map(|e| e * e).sum::<f64>() / count).sqrt(),
            max: lengths.iter().copied().fold(0.0, f64::max),
        })
    }
}

/// The outcome of a diagnosis.
pub struct Diagnosis {
    /// What the sizes of its errors, noise and findings are: lengths (m), or angles (rad) where no row to fit measured a length.
    pub dimension: Dimension,
    /// The answer in one word.
    pub verdict: VerdictKind,
    /// The verdict in a sentence, with what its noise rests on.
    pub statement: String,
    /// What the noise rests on.
    pub noise_basis: NoiseBasis,
    /// Length of the noise of a row, rms, m.
    pub noise_floor: f64,
    /// Errors without the findings at held-out rows (at the fitted ones where none are held out), suspects apart.
    pub before: Option<ErrorLengths>,
    /// The same with the findings.
    pub after: Option<ErrorLengths>,
    /// Whether the errors are of held-out rows.
    pub held_out: bool,
    /// Errors of the fitted rows (`kept`) under fits without their poses, which choose nothing.
    pub folds: Option<Folds>,
    /// Strongest first.
    pub findings: Vec<Finding>,
    /// Formulas for findings without a name, those of a finding cheapest first.
    pub formulas: Vec<ClosedForm>,
    /// Whether the recording has a clock; else times in the model count rows from 0.
    pub clock: bool,
    /// Rows that no smooth model can follow.
    pub screening: Screening,
    /// What these data cannot show, a sentence each.
    pub not_observable: Vec<String>,
    /// What is left looks like, where it is not noise.
    pub signature: Option<String>,
    /// What to measure next, a sentence each.
    pub next_measurements: Vec<String>,
    /// Rms length of what is left at fitted rows, m.
    pub leftover_rms: f64,
    /// Reduced chi-square of the fitted rows; 1 for noise alone.
    pub chi_square: f64,
    /// Probability that no cell is there, of what the base model leaves.
    pub gate_first: Option<f64>,
    /// Probability that no further cell is there, beside all findings.
    pub gate_last: Option<f64>,
    /// Repeatability of the joints, as the recording shows it.
    pub repeatability: JointRepeatability,
    /// Where the residual sits before and after the findings.
    pub located_before: Located,
    /// What each place and variable could still explain with the findings.
    pub located_after: Located,
    /// The corrected model and its fit.
    pub model: Model,
    /// How the last fit went.
    pub fitted: Fitted,
    /// Rows that were fitted.
    pub kept: Vec<usize>,
}
