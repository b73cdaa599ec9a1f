//! The robot as data, its import, its screws and its gravity torques.

mod bound;
pub mod import;
mod instrument;
mod joint_convention;
mod library;
mod measurements;
mod memories;
mod memory;
mod model;
pub mod pose_groups;
mod posture;
mod readings;
mod rows;
mod sequence;
mod setup;
mod travel;
mod visited;

pub use bound::{Bound, ONE_AND_A_HALF_TURNS};
pub use instrument::{INSTRUMENTS, Instrument, NoiseBasis, PublishedInstrument, START, SigmaSource};
pub use joint_convention::{CountedCoupling, JointConvention};
pub use library::{LIBRARY, LibraryArm};
pub use measurements::Measurements;
pub use memories::Memories;
pub use memory::Memory;
pub use model::RobotModel;
pub use posture::{Carried, LoadCorrection, Posture};
pub use readings::{Named, Reading, Readings};
pub use rows::{DhRow, DhTable};
pub use sequence::Sequence;
pub use setup::{Anchor, MeasurementSetup, Shape, Target};
pub use travel::Travel;
pub(crate) use visited::numbered;
pub use visited::{Unmeasured, Visited};
