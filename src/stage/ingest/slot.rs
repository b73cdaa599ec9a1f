//! Where the quantities of a row live in its list of numbers.

use super::layout::JointColumns;
use crate::units::Quantity;

/// Where the quantities of a row live in its list of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Slot {
    Time,
    Payload,
    Temperature,
    Position(usize),
    Sigma(usize),
    Q(usize),
    Current(usize),
    Direction(usize),
    /// Numbers of the orientation in the file's convention.
    Turn(usize),
    SigmaTurn,
    Distance,
    SigmaDistance,
    Simulated(usize),
    Velocity(usize),
}

impl Slot {
    /// Numbers in a row of a robot with so many joints.
    pub(super) fn count(joints: usize) -> usize {
        19 + 4 * joints
    }
    pub(super) fn index(self, joints: usize) -> usize {
        match self {
            Self::Time => 0,
            Self::Payload => 1,
            Self::Temperature => 2,
            Self::Position(axis) => 3 + axis,
            Self::Sigma(axis) => 6 + axis,
            Self::Q(joint) => 9 + joint,
            Self::Current(joint) => 9 + joints + joint,
            Self::Direction(joint) => 9 + 2 * joints + joint,
            Self::Turn(number) => 9 + 3 * joints + number,
            Self::SigmaTurn => 13 + 3 * joints,
            Self::Distance => 14 + 3 * joints,
            Self::SigmaDistance => 15 + 3 * joints,
            Self::Simulated(axis) => 16 + 3 * joints + axis,
            Self::Velocity(joint) => 19 + 3 * joints + joint,
        }
    }
}

/// Columns that are mapped for every joint.
pub(super) struct PerJoint<'a> {
    /// The setting.
    pub name: &'static str,
    pub columns: &'a JointColumns,
    /// For positions and velocities that of a revolute joint.
    pub quantity: Quantity,
    pub slot: fn(usize) -> Slot,
}

impl PerJoint<'_> {
    /// The quantity of a prismatic joint, where it is another than a revolute one's.
    pub(super) fn linear(&self) -> Option<Quantity> {
        match self.quantity {
            Quantity::Angle => Some(Quantity::Length),
            Quantity::AngularRate => Some(Quantity::LinearRate),
            _ => None,
        }
    }
}
