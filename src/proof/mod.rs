//! The proof of a diagnosis: sets of concealed recordings written and sealed, and diagnoses held against the truth once it is opened.

mod concealed_set;
mod marks;
mod recorded;
mod seal;
mod set;

pub use concealed_set::ConcealedSet;
pub use marks::{LEFT_OUT, board, single_cause, write_scoreboard};
pub use recorded::recorded;
pub use seal::{RECORDINGS, SEAL, SEALED, Seal};
pub use set::{conceal, vacant};
