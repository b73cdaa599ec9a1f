//! What a recording measures with: targets on the tool, each with its own seat, and anchors in the cell that distances go to.

use crate::spatial::Pose;
use nalgebra::Vector3;

/// A reflector, ball or frame on the tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// As the recording calls it; empty where it has no name.
    pub name: String,
    /// Where it is believed to sit, zero pose, base frame.
    pub seat: Pose,
    /// Whether its orientation is measured too.
    pub oriented: bool,
}

/// The far end of a draw-wire or ballbar.
#[derive(Debug, Clone, PartialEq)]
pub struct Anchor {
    /// As the recording calls it; empty where it has no name.
    pub name: String,
    /// Where it is believed to be, tracker frame, m.
    pub place: Vector3<f64>,
}

/// Targets and anchors, each by the order of names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeasurementSetup {
    /// None: the robot's tool point is what is measured.
    pub targets: Vec<Target>,
    /// Fixed ends of distances.
    pub anchors: Vec<Anchor>,
}

impl MeasurementSetup {
    /// The number of a target by its name.
    pub fn target(&self, name: &str) -> Option<usize> {
        self.targets.iter().position(|target| target.name == name)
    }

    /// The number of an anchor by its name.
    pub fn anchor(&self, name: &str) -> Option<usize> {
        self.anchors.iter().position(|anchor| anchor.name == name)
    }
}
