//! What identifications share: the choice of load, and what they hand back (model, course, visibility, residuals).

use crate::effect::Load;
use crate::estimate::{Fitted, Model, Screening, Suspect};
use crate::robot::{Measurements, RobotModel};
use crate::stage::{Context, screened};
use crate::table::{Fit, Observability, Parameters, Prediction, Recording, Split, Suspects};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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

crate::stage::writes! {
    /// Output ports of `identify` and `stiffness`.
    pub struct Identified {
        parameters: Parameters,
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
    /// Rows that an earlier step was fitted to.
    pub seen_before: &'a [bool],
    /// Geometric rank: found and expected.
    pub geometry: Option<(usize, usize)>,
}

impl Identified {
    /// Tables of a finished fit, and its notes for the person.
    pub fn of(context: &Context, model: &Model, fitted: &Fitted, fitting: &Fitting) -> Self {
        let step = context.id;
        let mut held_out: Vec<bool> = fitting.seen_before.iter().map(|seen| !seen).collect();
        for row in fitting.asked {
            held_out[*row] = false;
        }
        // Of a fit on top of another only the last parameters' uncertainty is known, which would flatter.
        let covariance = fitted.covariance.as_ref().filter(|_| fitting.earlier.is_none());
        note(context, model, fitted, fitting);
        screened::note(context, fitting.screening, fitting.recording);
        let Screening { suspects, .. } = fitting.screening;
        let aside = suspects.iter().filter(|suspect| !suspect.used()).map(|Suspect { row, .. }| *row);
        Self {
            parameters: Parameters::of(step, model, fitted, fitting.held, fitting.earlier),
            fit: Fit::of(step, fitted),
            observability: Observability::of(step, fitted, fitting.geometry),
            prediction: Prediction::of(step, model, fitting.data, fitting.recording, fitting.split, &held_out, covariance)
                .with_suspects(aside),
            suspects: Suspects::of(step, fitting.screening, fitting.recording, fitting.split),
        }
    }
}

fn note(context: &Context, model: &Model, fitted: &Fitted, fitting: &Fitting) {
    let services = context.services;
    let free = fitted.singular.len();
    let asked = fitted.singular_all.len();
    services.note(format!(
        "{} points, {free} of {asked} parameters estimated, {} after {} iterations",
        fitting.rows.len(),
        fitted.stop.name(),
        fitted.course.len().saturating_sub(1),
    ));
    if let Some((rank, expected)) = fitting.geometry
        && rank < expected
    {
        services
            .note(format!("the data see {rank} of the {expected} geometric parameters of this arm: {}", why_not(&model.robot)));
    }
    if 3 * fitting.rows.len() < 2 * free {
        services.warn(format!("{} points are few for {free} parameters: take at least {free}", fitting.rows.len()));
    }
    let noise: f64 = fitting.rows.iter().map(|row| fitting.data.noise(*row)).sum::<f64>() / fitting.rows.len() as f64;
    let noise_axis = noise / 3f64.sqrt();
    if fitted.unmodelled > noise_axis {
        services.note(format!(
            "{:.3} mm per axis is left beyond the instrument's {:.3} mm: this model does not explain it",
            fitted.unmodelled * 1e3,
            noise_axis * 1e3
        ));
    }
    if fitted.downweighted > 0 {
        services.note(format!("{} rows stand far off and count less", fitted.downweighted));
    }
}

/// A measured point closer to the last axis than this (m) says next to nothing about that axis.
const NEAR_AXIS: f64 = 5e-3;

fn why_not(robot: &RobotModel) -> String {
    let last = robot.joints() - 1;
    let arm = robot.home().translation - robot.point(last);
    let distance = arm.cross(robot.axis(last)).norm();
    if robot.is_revolute(last) && distance < NEAR_AXIS {
        format!("the measured point lies {:.1} mm off the axis of joint {}", distance * 1e3, last + 1)
    } else {
        "some joints hardly move, or only together".into()
    }
}
