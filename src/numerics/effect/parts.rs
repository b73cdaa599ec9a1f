//! What a finding is in the fitted model, and how large a cause may be that is not found.

use super::{EffectStack, Form, Place};
use crate::robot::{Measurements, RobotModel};
use crate::units::Unit;

/// A finding in the fitted model.
#[derive(Clone, Copy)]
pub struct FittedForms<'a> {
    /// The arm of the model.
    pub robot: &'a RobotModel,
    /// Its effects.
    pub stack: &'a EffectStack,
    /// Its parameters, SI.
    pub x: &'a [f64],
    /// All rows of the recording.
    pub data: &'a Measurements,
    /// Fitted rows, ascending.
    pub rows: &'a [usize],
    /// What the finding is called.
    pub called: &'static str,
    /// What makes it up.
    pub forms: &'a [Form],
}

/// What a finding is in the fitted model, where that says more than its own numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelledFinding {
    /// What a mechanic is told, without its size at the tool.
    pub sentence: String,
    /// The cause, at its place, that does the same in these data.
    pub same: (&'static str, Place),
}

/// A size that a cause may have where it is not found, since geometry takes up most of what it does on a short or slow path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HiddenSize {
    /// What would be off; its place where that is not named.
    pub subject: Option<&'static str>,
    /// What that may do, as in `may trail`.
    pub may: &'static str,
    /// Less is no cause to measure again, SI.
    pub least: f64,
    /// In which people read it.
    pub unit: Unit,
}
