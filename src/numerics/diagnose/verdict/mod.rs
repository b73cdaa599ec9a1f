//! The verdict: what the last round's causes are called, how probable that is, and what is explained by them.

mod conclude;
mod findings;
mod not_observable;
mod windup;

pub(crate) use conclude::conclude;
pub(crate) use findings::LastRound;
pub use not_observable::other_means;
