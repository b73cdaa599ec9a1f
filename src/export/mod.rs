//! The identified model for other programs, one file per format. A format carries rigid geometry or less: what it leaves out stands in it.

mod body;
mod controller;
mod deviation;
mod dh;
mod dynamics;
mod friction;
mod json;
mod mjcf;
mod model;
mod urdf;
mod xml;

pub use model::Export;

use crate::error::Result;

/// A way to write the model down.
pub trait Format: Sync {
    /// What `--format` calls it.
    fn name(&self) -> &'static str;
    /// What it is, in one line.
    fn help(&self) -> &'static str;
    /// The whole file. Fails where the format cannot hold this arm at all.
    fn text(&self, export: &Export) -> Result<String>;
    /// What it holds of identified torques.
    fn carries(&self) -> CarriedTorques {
        CarriedTorques::Nothing
    }
}

/// What a format holds of identified torques.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CarriedTorques {
    /// None of it.
    Nothing,
    /// Inertials, and these causes at joints.
    Causes(&'static [&'static str]),
    /// All.
    All,
}

/// All formats, in the order of the help.
pub const FORMATS: &[&dyn Format] =
    &[&urdf::Urdf, &dh::Dh, &dh::Mdh, &json::Json, &mjcf::Mjcf, &controller::Controller, &dynamics::Dynamics];
