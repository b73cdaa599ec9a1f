//! The verdict: what the last round's causes are called, how probable that is, and what is explained by them.

mod conclude;
mod faults;
mod findings;
mod last_round;
mod not_observable;

pub(crate) use conclude::conclude;
pub(crate) use last_round::LastRound;
pub use not_observable::other_means;
