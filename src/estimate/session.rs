//! Rows with the model fitted to them.

use super::fit::Fitted;
use super::model::Model;
use crate::robot::Measurements;

/// A recording with the model fitted to some of its rows.
#[derive(Clone, Copy)]
pub struct Session<'a> {
    pub data: &'a Measurements,
    pub rows: &'a [usize],
    pub model: &'a Model,
    pub fitted: &'a Fitted,
}
