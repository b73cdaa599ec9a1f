//! Where a declared effect acts and what moves there, in the words of a declaration.

use crate::effect::{Axes, AxisPoint, Motion, Place, Polar};
use crate::units::{Quantity, Unit};

/// Where it may act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Seat {
    /// At one of the joints that turn.
    AnyJoint,
    /// At a link that has a length.
    AnyLink,
    Fixed(Place),
}

/// What moves there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moves {
    Angle,
    Axis { turning: bool },
    Growth,
    Frame(Axes),
    Reading(Polar),
}

/// Motions of each kind of place; the first is the usual one.
const OF_JOINTS: [(&str, Moves); 3] = [
    ("angle", Moves::Angle),
    ("axis", Moves::Axis { turning: false }),
    ("turning_axis", Moves::Axis { turning: true }),
];
const OF_LINKS: [(&str, Moves); 1] = [("growth", Moves::Growth)];
const OF_FRAMES: [(&str, Moves); 3] = [
    ("displacement", Moves::Frame(Axes::Place)),
    ("rotation", Moves::Frame(Axes::Rotation)),
    ("both", Moves::Frame(Axes::Both)),
];
const OF_TRACKERS: [(&str, Moves); 6] = [
    ("displacement", Moves::Frame(Axes::Place)),
    ("rotation", Moves::Frame(Axes::Rotation)),
    ("both", Moves::Frame(Axes::Both)),
    ("azimuth", Moves::Reading(Polar::Azimuth)),
    ("elevation", Moves::Reading(Polar::Elevation)),
    ("range", Moves::Reading(Polar::Range)),
];
pub(crate) const PLACES: &str = "joint, joint 3, link, link 2, link 2-4, base, tool, tracker";

impl Seat {
    /// The place of these words.
    pub fn read(text: &str) -> Option<Self> {
        Some(match text {
            "joint" => Self::AnyJoint,
            "link" => Self::AnyLink,
            "base" => Self::Fixed(Place::Base),
            "tool" => Self::Fixed(Place::Tool),
            "tracker" => Self::Fixed(Place::Tracker),
            other => match other.parse().ok()? {
                place @ Place::Joint(_) if other.starts_with("joint ") => Self::Fixed(place),
                place @ Place::Links(first, last)
                    if other.starts_with("link ") && first <= last =>
                {
                    Self::Fixed(place)
                }
                _ => return None,
            },
        })
    }

    /// What may move there; the first is the usual one.
    pub(crate) fn allowed(self) -> &'static [(&'static str, Moves)] {
        match self {
            Self::AnyJoint | Self::Fixed(Place::Joint(_)) => &OF_JOINTS,
            Self::AnyLink | Self::Fixed(Place::Links(..)) => &OF_LINKS,
            Self::Fixed(Place::Tracker) => &OF_TRACKERS,
            Self::Fixed(_) => &OF_FRAMES,
        }
    }

    pub(crate) fn is_joint(self) -> bool {
        matches!(self, Self::AnyJoint | Self::Fixed(Place::Joint(_)))
    }
}

impl Moves {
    pub(crate) fn at(self, place: Place) -> Option<Motion> {
        Some(match (self, place) {
            (Self::Angle, Place::Joint(joint)) => Motion::Joint { joint },
            (Self::Axis { turning }, Place::Joint(joint)) => Motion::Axis {
                joint,
                about: None,
                turning,
                at: AxisPoint::Own,
            },
            (Self::Growth, Place::Links(first, last)) => Motion::Links { first, last },
            (Self::Frame(axes), Place::Base) => Motion::Base { axes },
            (Self::Frame(axes), Place::Tool) => Motion::Tool { axes },
            (Self::Frame(axes), Place::Tracker) => Motion::Tracker { axes },
            (Self::Reading(reading), Place::Tracker) => Motion::Instrument { reading },
            _ => return None,
        })
    }

    /// The unit that coefficients have where none is stated; none where they have several.
    pub(crate) fn unit(self) -> Option<Unit> {
        Some(match self {
            Self::Angle | Self::Axis { .. } | Self::Frame(Axes::Rotation) => Unit::Radian,
            Self::Reading(Polar::Azimuth | Polar::Elevation) => Unit::Radian,
            Self::Frame(Axes::Place) | Self::Reading(Polar::Range) => Unit::Millimetre,
            Self::Growth => Unit::One,
            Self::Frame(Axes::Both) => return None,
        })
    }

    /// What a coefficient may be in.
    pub(crate) fn quantities(self) -> &'static [Quantity] {
        use Quantity::*;
        match self {
            Self::Angle => &[
                Angle,
                Length,
                Number,
                Compliance,
                CurrentCompliance,
                Trailing,
            ],
            Self::Axis { .. } | Self::Frame(Axes::Rotation) => {
                &[Angle, Number, Compliance, CurrentCompliance]
            }
            Self::Reading(Polar::Azimuth | Polar::Elevation) => &[Angle, Number],
            Self::Frame(Axes::Place) | Self::Reading(Polar::Range) => &[Length, Number],
            Self::Growth => &[Number],
            Self::Frame(Axes::Both) => &[],
        }
    }
}
