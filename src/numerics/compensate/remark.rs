//! The answer to a target: a command, what is known of it, and what is wrong with it.

use super::{
    Chain, Circumstance, CorrectionUncertainty, IdentifiedArm, Nominal, PositionUncertainty,
    Uncertainty,
};
use crate::description::RobotDescription;
use crate::robot::{Measurements, Unmeasured, numbered};
use rayon::prelude::*;
use std::fmt;

/// What is wrong with a command.
#[derive(Debug, Clone, PartialEq)]
pub enum Remark {
    /// How far the point stays away, m, where the orientation is not all that fails.
    NotReached(Option<f64>),
    /// The nominal robot has no joints there in the posture that is stated.
    OtherPosture,
    /// By how much the orientation is off, rad.
    Turned(f64),
    /// Joints, from 0.
    BeyondLimits(Vec<usize>),
    /// Outside of what was measured.
    BeyondMeasured(Unmeasured),
    /// Correction and its uncertainty (m, 95 %), and the finding that most of it comes from.
    Uncertain(f64, f64, Option<String>),
    /// A finding that is used beyond what was fitted, and over what.
    BeyondFitted(String, String),
    /// Findings that depend on what no target states.
    NotStated(Vec<String>),
    /// The share of the learned correction that applies.
    Faded(f64),
    /// Beyond a limit: no joints are written.
    Refused(String),
    /// Beyond a limit, and written because someone insisted.
    Insisted(String),
}

impl Remark {
    /// That a correction is doubtful, where it is.
    pub(super) fn of_certainty(certainty: &CorrectionUncertainty) -> Option<Self> {
        let uncertain = || {
            Self::Uncertain(
                certainty.correction,
                certainty.u95,
                certainty.finding.clone(),
            )
        };
        certainty.is_doubtful().then(uncertain)
    }

    /// Which findings a target uses beyond what was fitted.
    pub(super) fn beyond(certainty: &CorrectionUncertainty) -> impl Iterator<Item = Self> {
        certainty
            .beyond
            .iter()
            .map(|(finding, variable)| Self::BeyondFitted(finding.clone(), variable.clone()))
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotReached(Some(off)) => write!(f, "not reached, {:.3} mm off", off * 1e3),
            Self::NotReached(None) => f.write_str("not reached"),
            Self::OtherPosture => f.write_str("not reached in the posture that is stated"),
            Self::Turned(turn) => write!(f, "orientation off by {:.4} deg", turn.to_degrees()),
            Self::BeyondLimits(joints) => write!(f, "joint {} beyond its limits", numbered(joints)),
            Self::BeyondMeasured(what) => what.fmt(f),
            Self::Uncertain(correction, u95, finding) => {
                write!(
                    f,
                    "the correction of {:.3} mm is uncertain by {:.3} mm",
                    correction * 1e3,
                    u95 * 1e3
                )?;
                finding
                    .as_ref()
                    .map_or(Ok(()), |finding| write!(f, ", most of it by {finding}"))
            }
            Self::BeyondFitted(finding, variable) => {
                write!(f, "{finding} beyond the {variable} that was fitted")
            }
            Self::NotStated(findings) => {
                write!(
                    f,
                    "{} without what no target states (moves before it, other circumstances)",
                    findings.join(", ")
                )
            }
            Self::Faded(share) => write!(f, "learned correction applies by {:.0} %", 100.0 * share),
            Self::Refused(reason) => write!(f, "refused: {reason}"),
            Self::Insisted(reason) => write!(f, "written because of --force: {reason}"),
        }
    }
}

/// A command and what is known of it, SI.
#[derive(Debug, Clone)]
pub struct CorrectedCommand {
    /// As the controller counts its joints, rad or m. None where the target is not reached: no joints are better than wrong ones.
    pub q: Option<Vec<f64>>,
    /// How far the uncorrected command would be off by the model.
    pub uncorrected: f64,
    /// How far the uncorrected command would turn the tool away by the model, rad.
    pub(crate) turn: f64,
    /// Distance from the wanted point that the model leaves, m.
    pub residual: f64,
    /// Steps of the solution.
    pub iterations: usize,
    /// Uncertainty of the point that is reached; none where the model has no covariance.
    pub uncertainty: Option<PositionUncertainty>,
    /// How certain its correction is along its own direction; none where the model has no covariance.
    pub(crate) certainty: Option<CorrectionUncertainty>,
    /// What is wrong with it.
    pub remarks: Vec<Remark>,
}

impl CorrectedCommand {
    /// What is wrong with it, in words; empty if nothing.
    pub fn remark(&self) -> String {
        self.remarks
            .iter()
            .map(Remark::to_string)
            .collect::<Vec<_>>()
            .join("; ")
    }
}

/// The joints, from 0, that a command takes out of their limits.
pub(crate) fn beyond_limits(robot: &RobotDescription, q: &[f64]) -> Vec<usize> {
    let limits = robot.joints.iter().map(|joint| joint.limits);
    let outside = |q: f64, limits: Option<[f64; 2]>| {
        limits.is_some_and(|[lower, upper]| q < lower || q > upper)
    };
    (0..)
        .zip(q.iter().zip(limits))
        .filter(|(_, (q, limits))| outside(**q, *limits))
        .map(|(joint, _)| joint)
        .collect()
}

/// An error that is this share of the stated uncertainty (95 %) refutes it, but once in six times.
const REFUTED: f64 = 0.1;

/// A remark for each of `rows`, in their order; none where the model holds, nor where the measured point shows that it does: within a tenth of what
/// would be uncertain.
pub fn doubts(
    arm: &IdentifiedArm,
    uncertainty: &Uncertainty,
    data: &Measurements,
    rows: &[usize],
) -> Vec<Option<Remark>> {
    let asked = rows.par_iter().map_init(
        || {
            let model = arm.model();
            let scratch = model.stack.scratch(&model.robot);
            (arm.reach(), Nominal::new(&model.robot), scratch)
        },
        |(reach, nominal, scratch), row| {
            reach.under(&Circumstance::of_row(data, *row));
            let q = data.q(*row);
            let off =
                arm.base().rotation * (reach.place(q).translation - nominal.place(q).translation);
            let certainty = uncertainty.of_correction(reach, q, &off);
            let measured = data.point(*row);
            let error =
                measured.map(|point| (point - arm.model().place(data, *row, scratch).point).norm());
            let refuted = error.is_some_and(|error| error < REFUTED * certainty.u95);
            Remark::of_certainty(&certainty).filter(|_| !refuted)
        },
    );
    asked.collect()
}
