//! calib from arrays: a robot and a recording, and what the stages of a pipeline make of them, in memory.
//!
//! Nothing is computed here: the stages `split`, `identify` and `diagnose` run with the settings and defaults of a pipeline, so that equal
//! arrays give equal numbers to the last digit. Arrays are row-major and carry their units in their names: `_rad`, `_mm`, `_kg`, `_c`,
//! `_s`; the position of a joint that slides is in mm. Rows count from 0 in errors, joints from 1.

mod model;
mod recording;
mod robot;
mod run;

pub(crate) use model::usual_options;
pub use model::{Compensated, Diagnosis, Identified, Model, Options, diagnose, identify};
pub use recording::{Poses, Recording, Sigma};
pub use robot::Robot;
pub use run::{CalibRun, ProposedPoses, RunRequest, propose_poses, run};
