//! The robot as data, its import, its screws and its gravity torques.

mod bound;
pub mod description;
pub mod import;
mod measurements;
mod model;
mod posture;
mod readings;
mod rows;
mod setup;
mod travel;

pub use bound::Bound;
pub use measurements::{Instrument, Measurements};
pub use model::RobotModel;
pub use posture::{Carried, LoadCorrection, Posture};
pub use readings::{Named, Reading, Readings};
pub use rows::{DhRow, DhTable};
pub use setup::{Anchor, MeasurementSetup, Target};
pub use travel::Travel;
