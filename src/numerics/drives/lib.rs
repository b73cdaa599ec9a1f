//! Commands and responses of a simulated arm: which physics its simulation leaves out, without tracker and without torques.
//!
//! The simulation is rolled out along the commands; the residual is measured minus simulated angle. A cause is a change of the
//! simulation's physics; its columns are the responses of the linearised closed loop, and what is accepted goes into the simulation, which
//! is rolled out again. [`Drives`] is a problem of the one engine (`calib_engine`).

#![forbid(unsafe_code)]
// Matrices of joints are read by their indices, as the recursions are written.
#![allow(clippy::needless_range_loop)]
#![warn(missing_docs)]

#[cfg(test)]
mod against_mujoco;
mod answer;
mod around;
mod causes;
pub mod chain;
mod columns;
mod evidence;
pub mod excite;
mod fit;
mod independence;
mod key;
pub mod mjcf;
mod normal;
pub mod physics;
mod problem;
pub mod recording;
pub mod rollout;
mod sizes;
mod starts;
mod steps;

pub use answer::{DriveDiagnosis, DriveFinding, DriveNumber, DriveRival, JointError, diagnose};
pub use around::Around;
pub use causes::{CAUSES, Usual};
pub use fit::DriveFit;
pub use key::Key;
pub use problem::Drives;
