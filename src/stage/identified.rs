//! What identifications share: the choice of load, and what they hand back (model, course, visibility, residuals).

use crate::Context;
use crate::doubtful::{self, FittedRows, KnownModel, advice, suspicion};
use crate::effect::Load;
use crate::error::{Result, counted, listed};
use crate::estimate::{CONFLICT, Covariance, ParameterStatus, Session, beyond_tolerance};
use crate::observation::noise;
use crate::settings::{FoldSetting, note_repeats};
use crate::table::{
    CovarianceTable, Fit, FitContext, Observability, Parameters, Prediction, Recording, Split,
    Suspects,
};
use calib_numerics::robot::{Measurements, NoiseBasis, RobotModel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What stands in for a joint's load.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadSetting {
    /// From the masses of the robot file.
    #[default]
    Gravity,
    /// From the motor currents of the recording.
    Current,
}

impl From<LoadSetting> for Load {
    fn from(setting: LoadSetting) -> Self {
        match setting {
            LoadSetting::Gravity => Load::GravityTorque,
            LoadSetting::Current => Load::MotorCurrent,
        }
    }
}

/// Declares the settings of an identification: the stage's own, and those that all share.
macro_rules! identification {
    ($(#[$doc:meta])* pub struct $name:ident { $($field:tt)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($field)*
            /// Parameters to estimate, by name, and only these; `*` stands for anything, e.g. `[base_frame.*, reduction_ratio.j2]`.
            #[serde(default)]
            pub free: Option<Vec<String>>,
            /// Parameters to hold, by name; `*` stands for anything, e.g. `reduction_ratio.*`.
            #[serde(default)]
            pub hold: Vec<String>,
            /// What is known of parameters beforehand, by name: `{link_geometry.*: {sigma: 0.1}}`, in the unit of the table
            /// `parameters`; of several patterns that match the longest counts.
            #[serde(default)]
            pub prior: std::collections::BTreeMap<String, crate::settings::PriorSetting>,
            /// Between which values parameters may change from nominal, by name: `{reduction_ratio.*: [-5e-4, 5e-4]}`, in the unit of
            /// the table `parameters`.
            #[serde(default)]
            pub bounds: std::collections::BTreeMap<String, [f64; 2]>,
            /// What winds the joints up: gravity torque of the robot's masses, or motor currents.
            #[serde(default)]
            pub load: crate::identified::LoadSetting,
            /// Whether rows that no smooth model can follow (exchanged, slipped, lost, shifted, gross) are set aside and listed.
            #[serde(default = "crate::yes")]
            pub screen: bool,
            /// How well joints come back to a pose: `measured` from poses that the recording returns to, `ignored`, or
            /// `{arcsec: 3}`.
            #[serde(default)]
            pub repeatability: crate::settings::Repeatability,
            /// Cross-validation: the fit is repeated without each of so many parts of its poses, drawn at random, and again without
            /// each contiguous stretch; 0 for none, `n` without each pose in turn.
            #[serde(default)]
            pub folds: crate::settings::FoldSetting,
        }

        impl $name {
            fn parameter_set(&self) -> crate::settings::ParameterSet<'_> {
                crate::settings::ParameterSet {
                    free: self.free.as_deref(),
                    hold: &self.hold,
                    prior: &self.prior,
                    bounds: &self.bounds,
                }
            }

            /// The fit of these candidates to the rows, weighted by the joints' repeatability.
            fn fit(
                &self,
                model: &crate::estimate::Model,
                candidates: &[usize],
                asked: &mut crate::identified::RowsToFit,
                context: &crate::Context,
            ) -> crate::doubtful::FittedRows {
                let crate::identified::RowsToFit { data, rows, .. } = asked;
                asked.repeatability = self.repeatability.apply(model, data, rows, context);
                let screened = self.screen.then_some(asked.split);
                crate::doubtful::fit_rows(model, data, rows, candidates, screened)
            }

            /// Faults of the settings that all identifications share; `example` names a set.
            fn shared_faults(&self, example: &str, at: &mut crate::error::Place) {
                self.parameter_set().faults(at);
                crate::must_name_sets(&self.on, example, at);
                self.folds.faults(at);
                self.repeatability.faults(at);
            }
        }
    };
}
pub(crate) use identification;

crate::table::writes! {
    /// Output ports of `identify`, `stiffness` and `transfer`.
    pub struct Identified {
        parameters: Parameters,
        covariance: CovarianceTable,
        fit: Fit,
        observability: Observability,
        prediction: Prediction,
        suspects: Suspects,
    }
}

/// Rows of a recording that are to be fitted.
pub struct RowsToFit<'a> {
    pub recording: &'a Recording,
    pub split: &'a Split,
    pub data: Measurements,
    pub rows: Vec<usize>,
    /// One standard deviation of every revolute joint that rows are weighted by, rad.
    pub repeatability: Option<f64>,
}

impl<'a> RowsToFit<'a> {
    /// Those of some sets.
    pub fn of(recording: &'a Recording, split: &'a Split, sets: &[String]) -> Result<Self> {
        Ok(Self {
            recording,
            split,
            data: recording.measurements(),
            rows: split.rows(recording, sets)?,
            repeatability: None,
        })
    }
}

/// A finished fit, and what a step says of it.
pub struct Fitting<'a> {
    pub asked: &'a RowsToFit<'a>,
    pub fit: &'a FittedRows,
    /// Parameters that the user holds.
    pub held: &'a [usize],
    pub folds: FoldSetting,
    pub earlier: Option<&'a Parameters>,
    /// Covariance of the earlier parameters.
    pub earlier_covariance: Option<&'a CovarianceTable>,
    /// Rows that an earlier step was fitted to.
    pub seen_before: Vec<bool>,
    /// Geometric rank: found and expected.
    pub geometry: Option<(usize, usize)>,
    /// What the model as a whole was identified by.
    pub measured: &'a Measurements,
    /// Rows at which the model may say that it does not hold; the arm was fitted to none of them.
    pub doubtful: Vec<usize>,
    /// Rows of places that none of them was fitted to, with what their errors are to be multiplied by: each has a part in its place.
    pub placed: BTreeMap<usize, f64>,
}

impl<'a> Fitting<'a> {
    /// A fit from the nominal robot.
    pub fn of(
        asked: &'a RowsToFit,
        fit: &'a FittedRows,
        held: &'a [usize],
        folds: FoldSetting,
    ) -> Self {
        let all = 0..asked.data.rows();
        Self {
            asked,
            fit,
            held,
            folds,
            earlier: None,
            earlier_covariance: None,
            seen_before: vec![false; all.len()],
            geometry: None,
            measured: &asked.data,
            doubtful: all
                .filter(|row| asked.rows.binary_search(row).is_err())
                .collect(),
            placed: BTreeMap::new(),
        }
    }

    /// The fitted rows with their model.
    pub fn session(&self) -> Session<'_> {
        self.fit.session(&self.asked.data)
    }
}

impl Identified {
    /// Tables of a finished fit, and its notes for the person.
    pub fn of(context: &Context, fitting: &Fitting) -> Self {
        let step = context.id;
        let session = fitting.session();
        let Session {
            data,
            rows,
            model,
            fitted,
        } = session;
        let RowsToFit {
            recording, split, ..
        } = *fitting.asked;
        let screening = &fitting.fit.screening;
        let mut held_out: Vec<bool> = fitting.seen_before.iter().map(|seen| !seen).collect();
        let asked = &fitting.asked.rows;
        asked.iter().for_each(|row| held_out[*row] = false);
        let covariance = CovarianceTable::of(model, fitted, fitting.earlier_covariance);
        // Of a fit on top of another without its covariance only the last parameters' uncertainty is known, which would flatter.
        let known = fitting.earlier.is_none() || fitting.earlier_covariance.is_some();
        let of_model = known.then(|| covariance.of_model(model)).flatten();
        note(context, fitting);
        if let Some(repeated) = &fitted.repeated {
            note_repeats(context, repeated);
        }
        doubtful::note_screened(context, screening, recording);
        let (folds, dropped) = fitting.folds.folds(&session, context);
        let errors = folds.iter().flat_map(|folds| {
            let errors = rows.iter().zip(folds.random.iter().zip(&folds.blocks));
            errors.filter(|(row, _)| !fitting.seen_before[**row])
        });
        let advice = advice(context, &session);
        let known = KnownModel {
            model,
            covariance: of_model.as_ref(),
            measured: fitting.measured,
        };
        let parameters = |covariance: &Option<Covariance>| {
            covariance.as_ref().map_or(0, |all| all.parameters().len())
        };
        let fit_context = FitContext {
            geometry: fitting.geometry,
            repeatability: fitting.asked.repeatability,
            folds: folds.as_ref().map(|folds| folds.count),
            unfolded: dropped,
            earlier: parameters(&of_model).saturating_sub(parameters(&fitted.covariance)),
        };
        let prediction = Prediction::of(
            step,
            model,
            data,
            recording,
            split,
            &held_out,
            of_model.as_ref(),
        )
        .with_places(&fitting.placed)
        .with_suspects(screening)
        .with_weights(rows, fitted)
        .with_folds(errors)
        .with_remarks(known.remarks(data, &fitting.doubtful));
        let points = rows.iter().map(|row| &prediction.0[*row]);
        let points = points.filter(|row| row.measured.is_none());
        let points = points.map(|row| [row.error_mm, row.noise_mm]);
        context.warn_each(suspicion(points, fitted.singular.len()));
        let parameters = Parameters::of(step, model, fitted, fitting.held, fitting.earlier);
        Self {
            parameters: parameters.with_advice(&advice),
            covariance,
            fit: Fit::of(step, fitted),
            observability: Observability::of(step, fitted, &fit_context),
            prediction,
            suspects: Suspects::of(step, screening, recording, split),
        }
    }
}

const SATURATED: &str = "; nothing is left to judge the fit by, and its standard deviations rest on the weights' noise alone";

fn note(context: &Context, fitting: &Fitting) {
    let Session {
        data,
        rows,
        model,
        fitted,
    } = fitting.session();
    let free = fitted.singular.len();
    let asked = fitted.singular_all.len();
    context.note(format!(
        "{}, {free} of {} determined, {} after {}",
        counted(rows.len(), "point"),
        counted(asked, "parameter"),
        fitted.stop.name(),
        counted(fitted.course.len().saturating_sub(1), "iteration"),
    ));
    if let Some((rank, expected)) = fitting.geometry
        && rank < expected
    {
        context.note(format!(
            "the data see {rank} of the {expected} geometric parameters of this arm: {}",
            why_not(&model.robot)
        ));
    }
    if fitted.values < 2 * free {
        let (points, parameters) = (counted(rows.len(), "point"), counted(free, "parameter"));
        let saturated = match fitted.values <= free {
            true => SATURATED,
            false => "",
        };
        context.warn(format!(
            "only {points} for {parameters}: take at least {free}{saturated}"
        ));
    }
    let noise: f64 = rows.iter().map(|row| noise(data, *row)).sum::<f64>() / rows.len() as f64;
    let noise_axis = noise / 3f64.sqrt();
    if fitted.excess_sigma > noise_axis {
        context.note(format!(
            "{:.3} mm per axis of residual beyond {} noise of {:.3} mm: this model does not explain it",
            fitted.excess_sigma * 1e3,
            if data.noise_basis == NoiseBasis::Inferred { "the inferred" } else { "the instrument's" },
            noise_axis * 1e3
        ));
    }
    if let Some(turn) = fitted.excess_sigma_angle.filter(|turn| *turn > ASKEW) {
        context.warn(format!(
            "measured orientations are {:.1} deg off the model's beyond their noise: does `ingest` name the convention of the file?",
            turn.to_degrees()
        ));
    }
    for (k, prior_check) in &fitted.prior_checks {
        let spec = &model.stack.specs()[*k];
        if let (Some((alone, sigma)), true) = (prior_check.without, prior_check.conflict > CONFLICT)
        {
            let show = |value: f64| format!("{:.4}", spec.unit.from_si(value));
            context.warn(format!(
                "{}: the prior says {} +- {} {unit}, the data say {} +- {} {unit}, {:.1} sigma apart: one of them is wrong",
                spec.name,
                show(prior_check.prior.mean),
                show(prior_check.prior.sigma),
                show(alone),
                show(sigma),
                prior_check.conflict,
                unit = spec.unit.symbol()
            ));
        }
    }
    let beyond = (0..model.x.len()).filter_map(|k| Some((k, beyond_tolerance(model, k)?)));
    let beyond: Vec<String> = beyond
        .map(|(k, times)| {
            let spec = &model.stack.specs()[k];
            let (value, unit) = (spec.unit.from_si(model.x[k]), spec.unit.symbol());
            match unit {
                "1" => format!("{} {value:+.4} ({times:.0} times)", spec.name),
                _ => format!("{} {value:+.4} {unit} ({times:.0} times)", spec.name),
            }
        })
        .collect();
    if !beyond.is_empty() {
        context.warn(format!(
            "beyond what arms are made to, by more than four of their tolerances: {}; a wrong number in the robot file (tool, zero, length), a collision, \
             or state `tolerances` there",
            listed(&beyond)
        ));
    }
    let specs = fitted.statuses.iter().zip(model.stack.specs());
    let stopped = specs.filter(|(status, _)| matches!(status, ParameterStatus::Bound(_)));
    let stopped: Vec<&str> = stopped.map(|(_, spec)| &*spec.name).collect();
    if !stopped.is_empty() {
        context.note(format!("stopped by their bounds: {}", stopped.join(", ")));
    }
    if !fitted.downweighted.is_empty() {
        context.note(downweighted(
            &fitted.downweighted,
            &fitting.asked.recording.point_id,
        ));
    }
}

/// How many rows count less than others, and which the least.
fn downweighted(weights: &BTreeMap<usize, f64>, names: &[String]) -> String {
    let mut least: Vec<(&usize, &f64)> = weights.iter().collect();
    least.sort_by(|a, b| a.1.total_cmp(b.1));
    let named = least.iter().take(NAMED);
    let named = listed(named.map(|(row, weight)| format!("{} to {weight:.2}", names[**row])));
    let more = if least.len() > NAMED { ", ..." } else { "" };
    let rows = counted(weights.len(), "row");
    format!("far off and down-weighted: {rows} ({named}{more})")
}

/// Down-weighted rows that are named.
const NAMED: usize = 3;

/// No arm is that far off in orientation (rad); angles read in another convention are.
const ASKEW: f64 = 0.02;

/// A measured point closer to the last axis than this (m) says next to nothing about that axis.
const NEAR_AXIS: f64 = 5e-3;

fn why_not(robot: &RobotModel) -> String {
    let last = robot.joints() - 1;
    let arm = robot.home().translation - robot.point(last);
    let distance = arm.cross(robot.axis(last)).norm();
    if robot.is_revolute(last) && distance < NEAR_AXIS {
        format!(
            "the measured point lies {:.1} mm off the axis of joint {}",
            distance * 1e3,
            last + 1
        )
    } else {
        "some joints hardly move, or only together".into()
    }
}
