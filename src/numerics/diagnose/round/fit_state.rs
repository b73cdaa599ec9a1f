//! The model between rounds, and how it is fitted anew with other causes.

use super::noise::{JointSpread, PredictedRows, RepeatPairs};
use super::stretches::{CorrelationChange, PathCorrelation, follow_a_path, lasts};
use crate::criteria::noise::{ESTIMATES, REPEATS, SETTLED, STRETCHES as DENSE_STRETCHES};
use crate::criteria::search::SIGNIFICANT;
use crate::diagnose::types::{JointRepeatability, Question};
use crate::diagnose::whitened::AutocorrelatedNoise;
use crate::effect::{
    Effect, EffectContext, EffectStack, Form, Load, arm_effect, identified, names,
};
use crate::estimate::{
    ErrorScale, Fitted, Known, Model, ParameterStatus, Prior, Screening, Session, Units, align,
    fit_screened,
};
use crate::robot::{Measurements, RobotModel};
use std::ops::Range;

/// A model with causes, fitted.
pub(crate) struct FitState {
    pub(crate) model: Model,
    pub(crate) fitted: Fitted,
    pub(crate) screening: Screening,
    pub(crate) causes: Vec<EstimatedCause>,
    /// Where in the model's parameters those of each cause are.
    pub(crate) ranges: Vec<Range<usize>>,
}

impl FitState {
    /// The rows with the model fitted to them.
    pub(crate) fn session<'a>(&'a self, fitter: &'a Fitter) -> Session<'a> {
        Session {
            data: &fitter.data,
            rows: &self.screening.kept,
            model: &self.model,
            fitted: &self.fitted,
        }
    }

    /// Whether most of what the model leaves at rows of one pose is the same at all of them: the mean square between poses exceeds that within
    /// by more than the number of rows of a pose.
    pub(crate) fn shots_share_errors(&self) -> bool {
        self.fitted.repeated.as_ref().is_some_and(|repeated| {
            let more = repeated.freedom as f64 / (3 * repeated.poses.max(1)) as f64;
            repeated
                .lack_of_fit
                .is_some_and(|(ratio, chance)| ratio > 2.0 + more && chance <= *SIGNIFICANT)
        })
    }

    /// Whether any of its causes follows time.
    pub(crate) fn follows_time(&self) -> bool {
        self.causes.iter().any(|cause| cause.form.follows_time())
    }

    /// The squared size of some causes together in their uncertainty, a mean over as many numbers as the rows show of them; 0 where none of
    /// these is estimated, none where there is no covariance.
    pub(crate) fn square_size(&self, causes: &[usize]) -> Option<f64> {
        let (mut free, mut shown) = (Vec::new(), 0.0);
        for i in causes {
            for (k, prior) in self.ranges[*i].clone().zip(&self.causes[*i].priors) {
                if let ParameterStatus::Free(sigma) = self.fitted.statuses[k] {
                    free.push(k);
                    shown += (1.0 - (sigma / prior.sigma).powi(2)).max(0.0);
                }
            }
        }
        if free.is_empty() {
            return Some(0.0);
        }
        let values: Vec<f64> = free.iter().map(|k| self.model.x[*k]).collect();
        let square = self.fitted.covariance.as_ref()?.distance(&free, &values)?;
        Some(square / shown.max(1.0))
    }
}

/// A cause with its coefficients, and what is known of them beforehand.
#[derive(Clone)]
pub(crate) struct EstimatedCause {
    pub(crate) form: Form,
    pub(crate) coefficients: Vec<f64>,
    pub(crate) priors: Vec<Prior>,
}

/// What fits stay the same in: the recording with its noise, and what of the base model is estimated.
pub(crate) struct Fitter<'a> {
    pub(crate) question: &'a Question<'a>,
    /// The recording; its spread is what the joints' repeatability makes of each row.
    pub(crate) data: Measurements,
    /// Unit in which errors of rows are compared and stated.
    pub(crate) scale: ErrorScale,
    /// How many parameters the base model has; they come first.
    base: usize,
    pub(crate) repeatability: JointRepeatability,
    /// What a deviation of the joints makes of every row's readings.
    spread: JointSpread,
    /// What repeats show of the joints' repeatability, rad: nothing of it rests on a residual.
    repeated: f64,
    /// Whether shots of a standing arm showed the instrument's noise to be other than stated: of the joints they say nothing then.
    scaled: bool,
    /// Whether the repeatability is that of a residual, or of what a settled model leaves between returns.
    asked: bool,
    /// Autocorrelated noise of standing points; none where it is white.
    pub(crate) correlated: Option<AutocorrelatedNoise>,
    /// How often that was learned.
    estimated: usize,
    /// Correlation of rows along a path.
    on_path: PathCorrelation,
    /// Whether the rows to fit follow a path: neighbours know each other, and stretches judge what is found.
    pub(crate) dense: bool,
    /// Whether no row is set aside: where many stand out, it may be the model that is wrong.
    keeps_all: bool,
}

impl<'a> Fitter<'a> {
    /// The base model fitted, with the noise that repeats show; with all rows until causes are found, or with those that belong.
    pub(crate) fn start(question: &'a Question<'a>, keeps_all: bool) -> (Self, FitState) {
        let mut fitter = Self {
            question,
            data: question.data.clone(),
            scale: ErrorScale::of(question.data, question.fit),
            base: 0,
            repeatability: JointRepeatability::default(),
            spread: JointSpread::default(),
            repeated: 0.0,
            scaled: false,
            asked: false,
            correlated: None,
            estimated: 0,
            on_path: PathCorrelation::Unasked,
            dense: Units::of(question.data, question.fit, *DENSE_STRETCHES, |_, _| true)
                .follow_a_path(),
            keeps_all,
        };
        let base = base_model(question.robot, &fitter.data, question.fit, question.without);
        fitter.base = base.x.len();
        let mut now = fitter.fit(&base, Vec::new());
        fitter.spread = JointSpread::of(&now.model, &fitter.data);
        let kept = &now.screening.kept;
        let lasts = lasts(&now.model, &fitter.data, kept);
        let pairs = RepeatPairs::of(&fitter.data, kept);
        let shown = pairs.noise(fitter.rows_by(&now.model), lasts);
        fitter.repeatability = shown.joints;
        fitter.scaled = shown.scale != 1.0;
        if fitter.scaled {
            let sigmas = fitter.data.points.sigma.iter_mut();
            sigmas.for_each(|sigma| *sigma *= shown.scale);
            let returns = RepeatPairs::returns(&fitter.data, kept);
            let rows = fitter.rows_by(&now.model);
            let by_returns = returns.map_or(0.0, |pairs| pairs.repeatability(rows).sigma);
            fitter.repeatability.sigma = fitter.repeatability.sigma.max(by_returns);
        }
        fitter.repeated = fitter.repeatability.sigma;
        if fitter.repeatability.sigma > 0.0 || fitter.scaled {
            fitter
                .spread
                .put(&mut fitter.data, fitter.repeatability.sigma);
            now = fitter.fit(&base, Vec::new());
        }
        (fitter, now)
    }

    /// The rows as a model has them.
    fn rows_by<'b>(&'b self, model: &'b Model) -> PredictedRows<'b> {
        PredictedRows {
            model,
            data: &self.data,
            spread: &self.spread,
        }
    }

    /// Repeats that say how well the joints repeat; none where they are too few, or the arm stood between them.
    fn repeats(&self, rows: &[usize]) -> Option<RepeatPairs> {
        match self.scaled {
            true => RepeatPairs::returns(&self.data, rows),
            false => {
                (self.repeatability.repeats >= *REPEATS).then(|| RepeatPairs::of(&self.data, rows))
            }
        }
    }

    /// Whether the joints' repeatability rests on what a model leaves.
    pub(crate) fn infers_repeatability(&self, rows: &[usize]) -> bool {
        self.repeatability.sigma > self.repeated && self.repeats(rows).is_none()
    }

    /// The parameters of the base model, by their positions in every model of this recording.
    pub(crate) fn base(&self) -> Vec<usize> {
        (0..self.base).collect()
    }

    /// How well the joints repeat (rad) by what is left of a residual without structure, if that is news: it is asked once, and where
    /// repeats are too few to tell. Where the arm was elsewhere between repeats, by what the model leaves between those.
    pub(crate) fn noise_left_by(&self, settled: &FitState) -> Option<f64> {
        let kept = &settled.screening.kept;
        let pairs = self.repeats(kept);
        if self.asked || pairs.as_ref().is_some_and(|pairs| !pairs.are_returns) {
            return None;
        }
        let rows = self.rows_by(&settled.model);
        let other = match pairs {
            Some(pairs) => pairs.repeatability(rows).sigma,
            None => rows.repeatability(&settled.fitted, kept),
        };
        let now = self.repeatability.sigma;
        ((other - now).abs() > *SETTLED * other.max(now)).then_some(other)
    }

    /// Takes the noise that a residual showed.
    pub(crate) fn learn(&mut self, sigma: f64) {
        self.asked = true;
        self.repeatability.sigma = sigma;
        self.spread.put(&mut self.data, sigma);
    }

    /// Whether the autocorrelation may still be estimated: not of a moving arm, and not for ever.
    pub(crate) fn may_estimate_correlation(&self, settled: &FitState) -> bool {
        self.estimated < *ESTIMATES && !self.data.in_motion(&settled.screening.kept)
    }

    /// Whether causes that do not follow time are searched by themselves: rows follow a path, and something looks correlated.
    pub(crate) fn causes_of_the_arm_first(&self) -> bool {
        self.on_path == PathCorrelation::CausesFirst
    }

    /// Takes the autocorrelation that a residual showed, and returns the causes to go on with: none, but on a path those that do not follow
    /// time. On a path it is not believed before these have been searched by themselves.
    pub(crate) fn take_correlation(
        &mut self,
        change: &CorrelationChange,
        settled: &FitState,
    ) -> Vec<EstimatedCause> {
        match self.on_path {
            PathCorrelation::Unasked
                if change.noise.is_some() && follow_a_path(&self.data, &settled.screening.kept) =>
            {
                self.on_path = PathCorrelation::CausesFirst;
                return Vec::new();
            }
            PathCorrelation::CausesFirst => self.on_path = PathCorrelation::Decided,
            PathCorrelation::Unasked | PathCorrelation::Decided => {}
        }
        self.correlated = change.noise;
        self.estimated += 1;
        let mut kept = settled.causes.clone();
        kept.retain(|cause| change.keeps_causes && !cause.form.follows_time());
        kept
    }

    /// From now on rows that no model follows are set aside.
    pub(crate) fn set_aside(&mut self) {
        self.keeps_all = false;
    }

    /// The base effects of `from` with other causes, which start at their coefficients, fitted to the rows that belong.
    pub(crate) fn fit(&self, from: &Model, causes: Vec<EstimatedCause>) -> FitState {
        let (start, ranges) = with_causes(from, &causes);
        let candidates: Vec<usize> = (0..start.x.len()).collect();
        let set = (!self.keeps_all).then_some(self.question.set);
        let (model, fitted, screening) =
            fit_screened(&start, &self.data, self.question.fit, &candidates, set);
        let estimated = |(cause, range): (EstimatedCause, &Range<usize>)| EstimatedCause {
            coefficients: model.x[range.clone()].to_vec(),
            ..cause
        };
        let causes = causes.into_iter().zip(&ranges).map(estimated).collect();
        FitState {
            model,
            fitted,
            screening,
            causes,
            ranges,
        }
    }
}

/// Effects that the user's simulation has.
pub const BASE: [&str; 6] = [
    names::BASE_FRAME,
    names::TOOL_OFFSET,
    names::JOINT_OFFSET,
    names::LINK_GEOMETRY,
    names::REDUCTION_RATIO,
    names::COUPLING_RATIO,
];

/// The base model at its start, less the corrections that the user excludes.
fn base_model(
    robot: &RobotModel,
    data: &Measurements,
    rows: &[usize],
    without: &[String],
) -> Model {
    let setting = EffectContext {
        base: align(robot, data, rows),
        load: Load::GravityTorque,
    };
    let effects: Vec<Box<dyn Effect>> = identified()
        .filter(|cause| {
            BASE.contains(&cause.name())
                || (cause.name() == names::ANCHOR && !robot.setup().anchors.is_empty())
        })
        .filter(|cause| !without.iter().any(|name| name == cause.name()))
        .filter_map(|cause| cause.arm_effect(&setting))
        .filter(|effect| effect.missing(robot, data).is_none())
        .collect();
    Model::nominal(
        robot.clone(),
        EffectStack::new(robot, setting.base, effects),
    )
}

/// The effects of the whole arm in `from` as they stand, then causes at their coefficients, and where the parameters of these are.
pub(crate) fn with_causes(from: &Model, causes: &[EstimatedCause]) -> (Model, Vec<Range<usize>>) {
    // The base starts where it was found, so that its correction is too small to matter to what else moves it.
    let setting = EffectContext {
        base: from.base(),
        load: Load::GravityTorque,
    };
    let base = || {
        from.stack
            .effects()
            .filter(|(effect, _)| effect.form().is_none())
    };
    let again = base().filter_map(|(effect, _)| arm_effect(effect.name(), &setting));
    let forms = causes
        .iter()
        .map(|cause| Box::new(cause.form.clone()) as Box<dyn Effect>);
    let stack = EffectStack::new(&from.robot, setting.base, again.chain(forms).collect());
    let mut model = Model::nominal(from.robot.clone(), stack);
    let stack = model.stack.clone();
    for ((effect, range), (_, found)) in stack
        .effects()
        .zip(base())
        .filter(|((effect, _), _)| effect.name() != names::BASE_FRAME)
    {
        debug_assert!(effect.form().is_none());
        model.x[range.clone()].copy_from_slice(&from.x[found.clone()]);
        model.tolerances[range].copy_from_slice(&from.tolerances[found]);
    }
    let ranges: Vec<Range<usize>> = stack
        .effects()
        .filter(|(effect, _)| effect.form().is_some())
        .map(|(_, range)| range)
        .collect();
    for (cause, range) in causes.iter().zip(&ranges) {
        model.x[range.clone()].copy_from_slice(&cause.coefficients);
        let priors = range.clone().zip(&cause.priors);
        model.known.extend(priors.map(|(k, prior)| {
            (
                k,
                Known {
                    prior: Some(*prior),
                    bounds: None,
                },
            )
        }));
    }
    (model, ranges)
}
