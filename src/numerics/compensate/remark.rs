//! What is wrong with a command, and how people are told.

use super::CorrectionUncertainty;
use crate::robot::{Unmeasured, numbered};
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
