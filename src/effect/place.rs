//! Where an effect sits, in the words of the interface: `joint 3`, `joint 4->5`, `link 2-4`, `base`, `tool`, `tracker`, `recording`.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A place on the arm or around it; joints and links count from 0 here and from 1 in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Place {
    Base,
    Joint(usize),
    /// The second joint moves with the first.
    Coupled(usize, usize),
    /// First and last of neighbouring links; link k is the body that joint k moves.
    Links(usize, usize),
    Tool,
    Tracker,
    Recording,
    /// The far end of a draw-wire or ballbar.
    Anchor,
}

impl Place {
    /// How many places of this kind an arm has.
    pub fn count(&self, joints: usize) -> usize {
        match self {
            Self::Joint(_) | Self::Coupled(..) => joints,
            Self::Links(..) => joints.saturating_sub(1).max(1),
            _ => 1,
        }
    }

    /// As it stands in parameter names: `j3`, `j4_j5`, `l2`, `l2_4`, `base`.
    pub fn tag(&self) -> String {
        match self {
            Self::Joint(joint) => format!("j{}", joint + 1),
            Self::Coupled(by, moved) => format!("j{}_j{}", by + 1, moved + 1),
            Self::Links(first, last) if first == last => format!("l{}", first + 1),
            Self::Links(first, last) => format!("l{}_{}", first + 1, last + 1),
            other => other.to_string(),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Base => f.write_str("base"),
            Self::Joint(joint) => write!(f, "joint {}", joint + 1),
            Self::Coupled(by, moved) => write!(f, "joint {}->{}", by + 1, moved + 1),
            Self::Links(first, last) if first == last => write!(f, "link {}", first + 1),
            Self::Links(first, last) => write!(f, "link {}-{}", first + 1, last + 1),
            Self::Tool => f.write_str("tool"),
            Self::Tracker => f.write_str("tracker"),
            Self::Recording => f.write_str("recording"),
            Self::Anchor => f.write_str("anchor"),
        }
    }
}
