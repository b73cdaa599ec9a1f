//! What is refused though it can be computed: torques of which the model is less certain than they differ from those of the declared arm.
//! One who insists gets them all the same, with a remark that says so.

use super::feed_forward::{NeededTorques, PlannedMotion};
use super::model::{JointRange, TorqueModel};
use std::fmt;

/// Beyond the greatest speed, acceleration or load of the recording by more than this share, torques are extrapolated.
const BEYOND: f64 = 1.02;
/// rad: the same of positions.
const ASIDE: f64 = 0.02;
/// K: the same of temperatures.
const WARMER: f64 = 1.0;
/// So many times what is usual in the recorded motion an uncertainty is worth a remark, however small the correction; twice as much is refused.
const USUAL: f64 = 3.0;
/// Share of the correction above which an uncertainty is worth a remark.
const HALF: f64 = 0.5;

/// The limit, and whether a person insists on what it refuses.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TorqueGate {
    /// 95 % uncertainty of a joint's torque, Nm. `None`: the size of the correction itself, or six times what is usual in the recorded
    /// motion where that is more.
    pub uncertainty: Option<f64>,
    /// Rows beyond the limit are written all the same, with a remark.
    pub insisted: bool,
    /// Why the model itself is refused, where someone insisted on it: every row says so.
    pub model: Vec<String>,
}

/// What is to be said of a row. Joints count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum TorqueRemark {
    /// A joint where, or faster than, or under more load than it was recorded, in words.
    BeyondRecorded(usize, &'static str),
    /// Colder or warmer than recorded: C, and the nearest that was.
    Temperature(f64, f64),
    /// Joint, correction and its uncertainty, Nm.
    Uncertain(usize, f64, f64),
    /// Beyond the limit: no torques are written.
    Refused(String),
    /// Beyond the limit, and written because someone insisted.
    Insisted(String),
}

impl fmt::Display for TorqueRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BeyondRecorded(joint, what) => write!(f, "joint {} {what}", joint + 1),
            Self::Temperature(at, known) if at < known => {
                write!(
                    f,
                    "colder than recorded: {at:.1} C, the recording begins at {known:.1} C"
                )
            }
            Self::Temperature(at, known) => write!(
                f,
                "warmer than recorded: {at:.1} C, the recording ends at {known:.1} C"
            ),
            Self::Uncertain(joint, correction, u95) => {
                write!(
                    f,
                    "joint {}: the correction of {correction:.3} Nm is uncertain by {u95:.3} Nm",
                    joint + 1
                )
            }
            Self::Refused(reason) => write!(f, "refused: {reason}"),
            Self::Insisted(reason) => write!(f, "written because of --force: {reason}"),
        }
    }
}

/// The remarks of a row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JudgedRow(pub Vec<TorqueRemark>);

impl JudgedRow {
    /// Whether no torques are to be written.
    pub fn is_refused(&self) -> bool {
        self.0
            .iter()
            .any(|remark| matches!(remark, TorqueRemark::Refused(_)))
    }

    /// Whether it was written because someone insisted.
    pub fn is_insisted(&self) -> bool {
        self.0
            .iter()
            .any(|remark| matches!(remark, TorqueRemark::Insisted(_)))
    }

    /// Whether it lies outside of what the recording visited.
    pub fn is_beyond(&self) -> bool {
        let beyond = |remark: &TorqueRemark| {
            matches!(
                remark,
                TorqueRemark::BeyondRecorded(..) | TorqueRemark::Temperature(..)
            )
        };
        self.0.iter().any(beyond)
    }
}

impl fmt::Display for JudgedRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0
            .iter()
            .enumerate()
            .try_for_each(|(k, remark)| write!(f, "{}{remark}", if k == 0 { "" } else { "; " }))
    }
}

impl TorqueModel {
    /// What is to be said of each row of a motion, and which are refused.
    pub fn judged(
        &self,
        motion: &PlannedMotion,
        needed: &NeededTorques,
        gate: &TorqueGate,
    ) -> Vec<JudgedRow> {
        (0..motion.time.len())
            .map(|row| self.judged_row(motion, needed, gate, row))
            .collect()
    }

    fn judged_row(
        &self,
        motion: &PlannedMotion,
        needed: &NeededTorques,
        gate: &TorqueGate,
        row: usize,
    ) -> JudgedRow {
        let n = self.joints();
        let mut remarks: Vec<TorqueRemark> = gate
            .model
            .iter()
            .cloned()
            .map(TorqueRemark::Insisted)
            .collect();
        let mut reason = None;
        for (joint, seen) in self.range.iter().enumerate() {
            let at = n * row + joint;
            remarks.extend(
                seen.outside(motion, needed, at)
                    .map(|what| TorqueRemark::BeyondRecorded(joint, what)),
            );
            let Some(u95) = needed.u95.as_ref().map(|all| all[at]) else {
                continue;
            };
            let size = needed.correction[at].abs();
            if u95.is_nan() || u95 > (HALF * size).max(USUAL * seen.usual) {
                remarks.push(TorqueRemark::Uncertain(joint, size, u95));
            }
            let limit = gate
                .uncertainty
                .unwrap_or_else(|| size.max(2.0 * USUAL * seen.usual));
            if reason.is_none() && (u95.is_nan() || u95 > limit) {
                reason = Some(format!(
                    "joint {}: the correction of {size:.3} Nm is uncertain by {u95:.3} Nm, at most {limit:.3} Nm allowed (--max-uncertainty)",
                    joint + 1
                ));
            }
        }
        remarks.extend(self.outside_temperature(motion, row));
        let verdict = if gate.insisted {
            TorqueRemark::Insisted
        } else {
            TorqueRemark::Refused
        };
        remarks.extend(reason.map(verdict));
        JudgedRow(remarks)
    }

    fn outside_temperature(&self, motion: &PlannedMotion, row: usize) -> Option<TorqueRemark> {
        let at = motion.temperature.as_ref().map(|all| all[row])?;
        let [least, greatest] = self.temperature?;
        let known = at.clamp(least, greatest);
        ((at - known).abs() > WARMER).then_some(TorqueRemark::Temperature(at, known))
    }
}

impl JointRange {
    /// What of a joint's row is outside of what was recorded.
    fn outside(
        &self,
        motion: &PlannedMotion,
        needed: &NeededTorques,
        at: usize,
    ) -> impl Iterator<Item = &'static str> {
        let [least, greatest] = self.position;
        let all = [
            (
                !(least - ASIDE..=greatest + ASIDE).contains(&motion.position[at]),
                "where it was not recorded",
            ),
            (
                needed.velocity[at].abs() > BEYOND * self.speed,
                "faster than recorded",
            ),
            (
                needed.acceleration[at].abs() > BEYOND * self.acceleration,
                "accelerates more than recorded",
            ),
            (
                needed.load[at].abs() > BEYOND * self.load,
                "under more load than recorded",
            ),
        ];
        all.into_iter()
            .filter(|(outside, _)| *outside)
            .map(|(_, what)| what)
    }
}
