//! Torques of a moving arm whose truth is known: recordings of currents or torque sensors with concealed physics.
//!
//! `law` moves bodies, adds what they take about each axis, and holds what is concealed; `draw` draws a case of a seed, `family` an effect,
//! `record` measures it, writes the files and takes a case on other paths, `visible` says how much of each effect data can show.

mod draw;
mod family;
mod law;
mod record;
mod visible;

pub use crate::way::JointState;
pub use draw::TorqueCase;
pub use law::{Body, Machine};
pub use record::TorqueRows;
