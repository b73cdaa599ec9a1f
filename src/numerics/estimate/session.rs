//! Rows with the model fitted to them.

use super::fit::Fitted;
use super::model::Model;
use crate::robot::Measurements;

/// A recording with the model fitted to some of its rows.
#[derive(Clone, Copy)]
pub struct Session<'a> {
    /// The recording.
    pub data: &'a Measurements,
    /// Rows that are fitted.
    pub rows: &'a [usize],
    /// As it was fitted.
    pub model: &'a Model,
    /// How the fit went.
    pub fitted: &'a Fitted,
}
