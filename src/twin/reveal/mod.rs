//! Verdicts held against sealed truths: [`paper`] reads both, [`mark`] marks one case with the whole list of causes and without those of the recording,
//! `stated` its stated numbers and probabilities, [`board`] counts.
//!
//! Nothing of the diagnosis is used: what it stated is read as any reader of its JSON would.

pub mod board;
pub mod mark;
pub mod paper;
pub(crate) mod stated;
