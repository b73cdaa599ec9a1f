//! Hypotheses over one residual: their columns beside the base model, sets of them estimated, and forms tried beside a set.
//!
//! Sets are ascending lists of positions in the pool.

mod beside;
mod cholesky;
mod hypotheses;
mod linear;

pub(crate) use beside::Beside;
pub(crate) use hypotheses::HypothesisSet;
pub(crate) use linear::{dot, orthonormal, project};
