//! Torques of a moving arm whose truth is known: recordings of currents or torque sensors with concealed physics.
//!
//! `law` moves bodies, adds what they take about each axis, and holds what is concealed; `path` moves the joints, `draw` draws a case of a
//! seed, `family` an effect, `record` measures it, `visible` says how much of each effect data can show, `folder` writes the files and takes a
//! case on other paths.

mod draw;
mod family;
mod folder;
mod law;
mod path;
mod record;
mod visible;

pub use crate::way::JointState;
pub use draw::TorqueCase;
pub use law::{Body, Machine};
pub use record::TorqueRows;
