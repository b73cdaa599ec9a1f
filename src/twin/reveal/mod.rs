//! Verdicts held against sealed truths: [`paper`] reads both, [`mark`] marks one case and whether the place was right, [`left_out`] marks a
//! diagnosis without the causes of its recording, `both_worlds` mixes these with the others, [`board`] counts, `text` prints the board.
//!
//! Nothing of the diagnosis is used: what it said is read as any reader of its JSON would.

pub mod board;
pub(crate) mod both_worlds;
pub mod left_out;
pub mod mark;
pub mod paper;
pub(crate) mod reliability;
pub(crate) mod share;
mod text;
