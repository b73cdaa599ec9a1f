//! The proof of a diagnosis: sets of concealed recordings written and sealed, and diagnoses held against the truth once it is opened.

mod marks;
mod set;

pub use marks::{LEFT_OUT, board, single_cause, write_scoreboard};
pub use set::{RECORDINGS, SEAL, SEALED, Seal, conceal, recorded, vacant};
