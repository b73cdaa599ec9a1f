//! Torques of a moving arm whose truth is known: recordings of currents or torque sensors with concealed physics.
//!
//! [`rigid`] moves bodies and adds what they take about each axis, `path` moves the joints, `law` holds what is concealed, `draw` draws
//! a case of a seed, `family` an effect, `again` takes it on other paths, `record` measures it, `visible` says how much of each effect data can
//! show, `folder` writes the files.

mod draw;
mod family;
mod folder;
mod law;
mod path;
mod record;
pub mod rigid;
mod visible;

pub use draw::{TorqueCase, TorqueDesign};
pub use folder::TorqueFile;
pub use record::TorqueRows;
