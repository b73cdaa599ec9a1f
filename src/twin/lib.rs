//! The twin: recordings of a robot whose truth is known, made by other mathematics than the estimator's.
//!
//! Plain 4x4 arrays, link by link transforms, statics by summing forces over bodies, effects by their physical definition. It shares
//! the robot's description with the rest and nothing else, else the tool would mark its own homework.
//! Adding an effect: a row in `effect/` and a line in [`effect::Physical`].

#![forbid(unsafe_code)]

pub mod arm;
pub mod conceal;
pub mod drive;
pub mod effect;
pub mod folder;
pub mod lists;
pub mod matrix;
pub mod memory;
pub mod noise;
pub mod plan;
pub mod recorder;
pub mod reveal;
pub mod torque;
pub mod touch;
pub mod tracker;
pub mod truth;
pub mod way;
