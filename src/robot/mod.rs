//! The robot as data, its import, its screws and its gravity torques.

mod bound;
pub mod description;
mod gauging;
pub mod import;
mod measured;
mod model;
mod observation;
mod posture;
mod rows;
mod travel;

pub use bound::Bound;
pub use gauging::{Anchor, Gauging, Target};
pub use measured::{Distance, Distances, Named, Turns};
pub use model::RobotModel;
pub use observation::{Instrument, Measurements};
pub use posture::{Carried, LoadCorrection, Posture};
pub use rows::{Row, Rows};
pub use travel::Travel;
