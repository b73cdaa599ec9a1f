//! The numerics of calib, up to estimation: no files, no frames, no terminal. The crate `calib` hands its modules on and has the map;
//! `calib-diagnose` and `calib-dynamics` are made of them.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_foundation::{description, statistics, units};

pub use calib_foundation::{error, figures};

pub mod criteria;
pub mod yaml;

pub mod spatial;

pub mod robot;

pub mod effect;

pub mod observation;

pub mod estimate;

pub mod compensate;
