//! Where an effect sits, in the words of the interface: `joint 3`, `joint 4->5`, `link 2-4`, `base`, `tool`, `tracker`, `recording`, `arm`.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A place on the arm or around it; joints and links count from 0 here and from 1 in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Place {
    /// The robot's base.
    Base,
    /// A joint, from 0.
    Joint(usize),
    /// The second joint moves with the first.
    Coupled(usize, usize),
    /// First and last of neighbouring links; link k is the body that joint k moves.
    Links(usize, usize),
    /// The tool and the target on it.
    Tool,
    /// The instrument and its stand.
    Tracker,
    /// The measurement itself: rows, clocks, names.
    Recording,
    /// The far end of a draw-wire or ballbar.
    Anchor,
    /// The whole arm, wherever it is touched.
    Arm,
}

impl Place {
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
            Self::Arm => f.write_str("arm"),
        }
    }
}

impl FromStr for Place {
    type Err = ();

    /// Reads what its text or [`Place::tag`] wrote.
    fn from_str(text: &str) -> Result<Self, ()> {
        let one = |number: &str| number.parse::<usize>().ok()?.checked_sub(1);
        let two = |first: &str, second: &str| Some((one(first)?, one(second)?));
        let links = |numbers: &str, between: char| match numbers.split_once(between) {
            Some((first, last)) => two(first, last).map(|(first, last)| Self::Links(first, last)),
            None => one(numbers).map(|link| Self::Links(link, link)),
        };
        let joints = |numbers: &str, between: &str| match numbers.split_once(between) {
            Some((by, moved)) => two(by, moved).map(|(by, moved)| Self::Coupled(by, moved)),
            None => one(numbers).map(Self::Joint),
        };
        let whole = [
            Self::Base,
            Self::Tool,
            Self::Tracker,
            Self::Recording,
            Self::Anchor,
            Self::Arm,
        ];
        if let Some(place) = whole.into_iter().find(|place| place.to_string() == text) {
            return Ok(place);
        }
        let words = || {
            text.strip_prefix("joint ")
                .map(|numbers| joints(numbers, "->"))
        };
        let words = words().or_else(|| {
            text.strip_prefix("link ")
                .map(|numbers| links(numbers, '-'))
        });
        let tag = || text.strip_prefix('j').map(|numbers| joints(numbers, "_j"));
        let tag = || tag().or_else(|| text.strip_prefix('l').map(|numbers| links(numbers, '_')));
        words.or_else(tag).flatten().ok_or(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_read_from_its_words_and_from_its_tag() {
        let all = [
            (Place::Base, "base", "base"),
            (Place::Joint(1), "joint 2", "j2"),
            (Place::Joint(11), "joint 12", "j12"),
            (Place::Coupled(3, 4), "joint 4->5", "j4_j5"),
            (Place::Links(2, 2), "link 3", "l3"),
            (Place::Links(1, 3), "link 2-4", "l2_4"),
            (Place::Tool, "tool", "tool"),
            (Place::Tracker, "tracker", "tracker"),
            (Place::Recording, "recording", "recording"),
            (Place::Anchor, "anchor", "anchor"),
            (Place::Arm, "arm", "arm"),
        ];
        for (place, words, tag) in all {
            assert_eq!((words.parse(), tag.parse()), (Ok(place), Ok(place)));
            assert_eq!(
                (place.to_string().as_str(), place.tag().as_str()),
                (words, tag)
            );
        }
        for text in [
            "",
            "joint",
            "joint 0",
            "j0",
            "j-1",
            "joint 2 ",
            "link 2->3",
            "Joint 2",
            "j2_3",
            "l2_l3",
            "elbow",
        ] {
            assert_eq!(text.parse::<Place>(), Err(()), "{text}");
        }
    }
}
