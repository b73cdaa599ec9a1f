//! What identifications share: the choice of load, and what they hand back (model, course, visibility, residuals).

use crate::effect::Load;
use crate::error::counted;
use crate::estimate::{CONFLICT, Fitted, Model, ParameterStatus, Screening, Session, Suspect};
use crate::observation::noise;
use crate::robot::{Measurements, NoiseBasis, RobotModel};
use crate::stage::advice::advice;
use crate::stage::doubtful::KnownModel;
use crate::stage::folding::FoldSetting;
use crate::stage::{Context, computed, repeated, screened};
use crate::table::{
    CovarianceTable, Fit, FitContext, Observability, Parameters, Prediction, Recording, Split,
    Suspects,
};
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
    ($(#[$doc:meta])* pub struct $name:ident { $($own:tt)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($own)*
            /// Parameters to estimate, by name, and only these; `*` stands for anything, e.g. `[base_frame.*, reduction_ratio.j2]`.
            #[serde(default)]
            pub free: Option<Vec<String>>,
            /// Parameters to hold, by name; `*` stands for anything, e.g. `reduction_ratio.*`.
            #[serde(default)]
            pub hold: Vec<String>,
            /// What is known of parameters beforehand, by name: `{link_geometry.*: {sigma: 0.1}}`, in the unit of the table
            /// `parameters`; of several patterns that match the longest counts.
            #[serde(default)]
            pub prior: std::collections::BTreeMap<String, crate::stage::parameter_set::PriorSetting>,
            /// Between which values parameters may change from nominal, by name: `{reduction_ratio.*: [-5e-4, 5e-4]}`, in the unit of
            /// the table `parameters`.
            #[serde(default)]
            pub bounds: std::collections::BTreeMap<String, [f64; 2]>,
            /// What winds the joints up: gravity torque of the robot's masses, or motor currents.
            #[serde(default)]
            pub load: crate::stage::identified::LoadSetting,
            /// Whether rows that no smooth model can follow (exchanged, slipped, lost, shifted, gross) are set aside and listed.
            #[serde(default = "crate::stage::identified::yes")]
            pub screen: bool,
            /// How well joints come back to a pose: `measured` from poses that the recording returns to, `ignored`, or
            /// `{arcsec: 3}`.
            #[serde(default)]
            pub repeatability: crate::stage::repeated::Repeatability,
            /// Cross-validation: the fit is repeated without each of so many parts of its poses, drawn at random, and again without
            /// each contiguous stretch; 0 for none, `n` without each pose in turn.
            #[serde(default)]
            pub folds: crate::stage::folding::FoldSetting,
        }

        impl $name {
            fn parameter_set(&self) -> crate::stage::parameter_set::ParameterSet<'_> {
                crate::stage::parameter_set::ParameterSet {
                    free: self.free.as_deref(),
                    hold: &self.hold,
                    prior: &self.prior,
                    bounds: &self.bounds,
                }
            }

            /// Faults of the settings that all identifications share; `example` names a set.
            fn shared_faults(&self, example: &str) -> Vec<crate::error::Fault> {
                let mut faults = self.parameter_set().faults();
                faults.extend(crate::stage::no_set(&self.on, example));
                faults.extend(self.folds.fault());
                faults.extend(self.repeatability.fault());
                faults
            }
        }
    };
}
pub(crate) use identification;

pub(crate) fn yes() -> bool {
    true
}

crate::stage::writes! {
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

/// The inputs that both kinds of identification share.
pub struct Fitting<'a> {
    pub data: &'a Measurements,
    pub recording: &'a Recording,
    pub split: &'a Split,
    /// Rows to fit, before any was set aside.
    pub asked: &'a [usize],
    /// Rows that were fitted.
    pub rows: &'a [usize],
    pub screening: &'a Screening,
    /// Parameters that the user holds.
    pub held: &'a [usize],
    pub earlier: Option<&'a Parameters>,
    /// Covariance of the earlier parameters.
    pub earlier_covariance: Option<&'a CovarianceTable>,
    /// Rows that an earlier step was fitted to.
    pub seen_before: &'a [bool],
    /// Geometric rank: found and expected.
    pub geometry: Option<(usize, usize)>,
    /// One standard deviation of every revolute joint that rows are weighted by, rad.
    pub repeatability: Option<f64>,
    /// Parts of a cross-validation.
    pub folds: FoldSetting,
    /// What the model as a whole was identified by.
    pub measured: &'a Measurements,
    /// Rows at which the model may say that it does not hold; the arm was fitted to none of them.
    pub doubtful: Vec<usize>,
    /// Rows of places that none of them was fitted to, with what their errors are to be multiplied by: each has a part in its place.
    pub placed: &'a BTreeMap<usize, f64>,
}

impl Identified {
    /// Tables of a finished fit, and its notes for the person.
    pub fn of(context: &Context, model: &Model, fitted: &Fitted, fitting: &Fitting) -> Self {
        let step = context.id;
        let mut held_out: Vec<bool> = fitting.seen_before.iter().map(|seen| !seen).collect();
        for row in fitting.asked {
            held_out[*row] = false;
        }
        let covariance = CovarianceTable::of(model, fitted, fitting.earlier_covariance);
        // Of a fit on top of another without its covariance only the last parameters' uncertainty is known, which would flatter.
        let known = fitting.earlier.is_none() || fitting.earlier_covariance.is_some();
        let of_model = if known {
            covariance.of_model(model)
        } else {
            None
        };
        note(context, model, fitted, fitting);
        if let Some(repeated) = &fitted.repeated {
            repeated::note(context, repeated);
        }
        screened::note(context, fitting.screening, fitting.recording);
        let Screening { suspects, .. } = fitting.screening;
        let aside = suspects
            .iter()
            .filter(|suspect| !suspect.used())
            .map(|Suspect { row, .. }| *row);
        let (folds, dropped) = fitting.folds.folds(
            &Session {
                data: fitting.data,
                rows: fitting.rows,
                model,
                fitted,
            },
            context,
        );
        let unseen = |(row, _): &(&usize, _)| !fitting.seen_before[**row];
        let errors = folds.iter().flat_map(|folds| {
            fitting
                .rows
                .iter()
                .zip(folds.random.iter().zip(&folds.blocks))
                .filter(unseen)
        });
        let advice = advice(context, model, fitting.data, fitting.rows, fitted);
        let known = KnownModel {
            model,
            covariance: of_model.as_ref(),
            measured: fitting.measured,
        };
        let beside = FitContext {
            geometry: fitting.geometry,
            repeatability: fitting.repeatability,
            folds: folds.as_ref().map(|folds| folds.count),
            unfolded: dropped,
            earlier: of_model.as_ref().map_or(0, |all| {
                all.parameters().len()
                    - fitted
                        .covariance
                        .as_ref()
                        .map_or(0, |own| own.parameters().len())
            }),
        };
        let prediction = Prediction::of(
            step,
            model,
            fitting.data,
            fitting.recording,
            fitting.split,
            &held_out,
            of_model.as_ref(),
        )
        .with_places(fitting.placed)
        .with_suspects(aside)
        .with_weights(fitting.rows, fitted)
        .with_folds(errors)
        .with_remarks(known.remarks(fitting.data, &fitting.doubtful));
        let fitted_points = fitting
            .rows
            .iter()
            .map(|row| &prediction.0[*row])
            .filter(|row| row.measured.is_none());
        let suspicion = computed::suspicion(
            fitted_points.map(|row| [row.error_mm, row.noise_mm]),
            fitted.singular.len(),
        );
        suspicion
            .into_iter()
            .for_each(|line| context.services.warn(line));
        Self {
            parameters: Parameters::of(step, model, fitted, fitting.held, fitting.earlier)
                .with_advice(&advice),
            covariance,
            fit: Fit::of(step, fitted),
            observability: Observability::of(step, fitted, &beside),
            prediction,
            suspects: Suspects::of(step, fitting.screening, fitting.recording, fitting.split),
        }
    }
}

fn note(context: &Context, model: &Model, fitted: &Fitted, fitting: &Fitting) {
    let services = context.services;
    let free = fitted.singular.len();
    let asked = fitted.singular_all.len();
    services.note(format!(
        "{}, {free} of {} estimated, {} after {}",
        counted(fitting.rows.len(), "point"),
        counted(asked, "parameter"),
        fitted.stop.name(),
        counted(fitted.course.len().saturating_sub(1), "iteration"),
    ));
    if let Some((rank, expected)) = fitting.geometry
        && rank < expected
    {
        services.note(format!(
            "the data see {rank} of the {expected} geometric parameters of this arm: {}",
            why_not(&model.robot)
        ));
    }
    if fitted.values < 2 * free {
        let (points, parameters) = (
            counted(fitting.rows.len(), "point"),
            counted(free, "parameter"),
        );
        let saturated = match fitted.values <= free {
            true => {
                "; nothing is left to judge the fit by, and its standard deviations rest on the weights' noise alone"
            }
            false => "",
        };
        services.warn(format!(
            "only {points} for {parameters}: take at least {free}{saturated}"
        ));
    }
    let noise: f64 = fitting
        .rows
        .iter()
        .map(|row| noise(fitting.data, *row))
        .sum::<f64>()
        / fitting.rows.len() as f64;
    let noise_axis = noise / 3f64.sqrt();
    if fitted.excess_sigma > noise_axis {
        services.note(format!(
            "{:.3} mm per axis of residual beyond {} noise of {:.3} mm: this model does not explain it",
            fitted.excess_sigma * 1e3,
            if fitting.data.noise_basis == NoiseBasis::Inferred { "the inferred" } else { "the instrument's" },
            noise_axis * 1e3
        ));
    }
    if let Some(turn) = fitted.excess_sigma_angle.filter(|turn| *turn > ASKEW) {
        services.warn(format!(
            "measured orientations are {:.1} deg off the model's beyond their noise: does `ingest` name the convention of the file?",
            turn.to_degrees()
        ));
    }
    for (k, prior_check) in &fitted.prior_checks {
        let spec = &model.stack.specs()[*k];
        if let (Some((alone, sigma)), true) = (prior_check.without, prior_check.conflict > CONFLICT)
        {
            let show = |value: f64| format!("{:.4}", spec.unit.from_si(value));
            services.warn(format!(
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
    let stopped: Vec<&str> = (0..fitted.statuses.len())
        .filter(|k| matches!(fitted.statuses[*k], ParameterStatus::Bound(_)))
        .map(|k| model.stack.specs()[k].name.as_str())
        .collect();
    if !stopped.is_empty() {
        services.note(format!("stopped by their bounds: {}", stopped.join(", ")));
    }
    if !fitted.downweighted.is_empty() {
        services.note(downweighted(
            &fitted.downweighted,
            &fitting.recording.point_id,
        ));
    }
}

/// How many rows count less than others, and which the least.
fn downweighted(weights: &BTreeMap<usize, f64>, names: &[String]) -> String {
    let mut least: Vec<(&usize, &f64)> = weights.iter().collect();
    least.sort_by(|a, b| a.1.total_cmp(b.1));
    let named: Vec<String> = least
        .iter()
        .take(NAMED)
        .map(|(row, weight)| format!("{} to {weight:.2}", names[**row]))
        .collect();
    let more = if least.len() > NAMED { ", ..." } else { "" };
    format!(
        "far off and down-weighted: {} ({}{more})",
        counted(weights.len(), "row"),
        named.join(", ")
    )
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
