//! What a set of concealed recordings is drawn from: points that were measured, or torques of an arm that moves.

use crate::twin::conceal::design::Design;
use crate::twin::torque::TorqueDesign;

/// What a set is drawn from.
#[derive(Debug, Clone, PartialEq)]
pub enum ConcealedSet {
    /// Points that were measured.
    Positions(Box<Design>),
    /// Torques of an arm that moves.
    Torques(TorqueDesign),
}

impl ConcealedSet {
    /// Recordings in it.
    pub fn cases(&self) -> usize {
        match self {
            Self::Positions(design) => design.cases,
            Self::Torques(design) => design.cases,
        }
    }
}
