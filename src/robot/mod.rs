//! The robot as data, its import, its screws and its gravity torques.

pub mod description;
pub mod import;
mod model;
mod observation;
mod posture;
mod rows;
mod travel;

pub use model::RobotModel;
pub use observation::{Instrument, Measurements};
pub use posture::{Burden, Carried, Posture};
pub use rows::{Row, Rows};
pub use travel::Travel;
