//! The robot as data, its import, its screws and its gravity torques.

pub mod description;
mod gravity;
pub mod import;
mod model;
mod observation;
mod travel;

pub use model::RobotModel;
pub use observation::{Instrument, Measurements};
pub use travel::Travel;
