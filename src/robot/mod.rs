//! The robot as data, its import, its screws and its gravity torques.

mod bound;
pub mod description;
mod gauging;
pub mod import;
mod measurements;
mod model;
mod posture;
mod readings;
mod rows;
mod travel;

pub use bound::Bound;
pub use gauging::{Anchor, Gauging, Target};
pub use measurements::{Instrument, Measurements};
pub use model::RobotModel;
pub use posture::{Carried, LoadCorrection, Posture};
pub use readings::{Named, Reading, Readings};
pub use rows::{DhRow, DhTable};
pub use travel::Travel;
