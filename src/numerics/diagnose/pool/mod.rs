//! The pool of hypotheses over one residual: their columns beside the base model, sets of them estimated, and what others would add.
//!
//! Sets are ascending lists of positions in the pool.

mod beside;
mod cached;
mod cholesky;
mod conditional;
mod criterion;
mod earlier;
mod hypotheses;
mod linear;
mod solve;

pub(crate) use beside::Beside;
pub(crate) use cached::CachedHypotheses;
pub(crate) use conditional::Conditional;
pub(crate) use earlier::EarlierPool;
pub(crate) use hypotheses::HypothesisSet;
pub(crate) use linear::{dot, orthonormal, project};
pub(crate) use solve::Solution;
