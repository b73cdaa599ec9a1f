//! The identified model for other programs, one file per format. A format carries rigid geometry or less: what it leaves out stands in it.

mod body;
mod controller;
mod dh;
mod dynamics;
mod friction;
mod json;
mod mark;
mod model;
mod rigid;
mod ur_kinematics;
mod xacro;

pub use mark::Belonging;
pub use model::Export;

use crate::error::Result;

/// A way to write the model down.
pub(crate) struct Format {
    /// What `--format` calls it.
    pub(crate) name: &'static str,
    /// What it is, in one line.
    pub(crate) help: &'static str,
    /// How lines begin that say whence it is, and may differ between exports of one model: comments, where it has some.
    pub(crate) comment: &'static str,
    /// What it holds of identified torques.
    pub(crate) carries: CarriedTorques,
    /// The whole file, which begins with `Export::head` or has its mark elsewhere. Fails where the format cannot hold this arm at all.
    pub(crate) text: fn(&Export) -> Result<String>,
}

/// What a format holds of identified torques.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CarriedTorques {
    /// None of it.
    Nothing,
    /// Inertials, and these causes at joints.
    Causes(&'static [&'static str]),
    /// All.
    All,
}

/// All formats, in the order of the help.
pub(crate) const FORMATS: &[Format] = &[
    rigid::URDF,
    xacro::XACRO,
    ur_kinematics::UR_KINEMATICS,
    dh::DH,
    dh::MDH,
    json::JSON,
    rigid::MJCF,
    rigid::SDF,
    controller::CONTROLLER,
    dynamics::DYNAMICS,
];
