//! What is in force where a target is reached: the frame in which it stands, the tool that goes there, the load that is carried.

use super::flow::JoinedState;
use crate::spatial::Pose;

/// What a program makes of a frame, a tool or a load.
#[derive(Debug, Clone)]
pub(super) enum Setting<T> {
    /// It sets none.
    Unset,
    /// The value, and how people find where it is set.
    Known(T, String),
    /// Why the text does not say.
    Open(String),
}

/// A tool by its name and, where that is declared, its frame at the flange (m).
#[derive(Debug, Clone)]
pub(super) struct ToolInForce {
    pub name: String,
    pub frame: Option<Pose>,
}

/// At a motion.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InForce {
    /// In the robot's base, m.
    pub base: Setting<Pose>,
    pub tool: Setting<ToolInForce>,
    /// kg; none where its declaration does not say.
    pub load: Setting<Option<f64>>,
}

impl PartialEq for ToolInForce {
    /// Two tools of one frame are one, whatever their names.
    fn eq(&self, other: &Self) -> bool {
        match (&self.frame, &other.frame) {
            (Some(own), Some(others)) => own == others,
            _ => self.name == other.name,
        }
    }
}

impl<T: PartialEq> PartialEq for Setting<T> {
    /// By value: where it is set makes no difference.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Unset, Self::Unset) => true,
            (Self::Known(own, _), Self::Known(others, _)) => own == others,
            (Self::Open(own), Self::Open(others)) => own == others,
            _ => false,
        }
    }
}

impl<T: Clone + PartialEq> JoinedState for Setting<T> {
    fn joined(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Open(_), _) => self.clone(),
            (_, Self::Open(_)) => other.clone(),
            (Self::Known(own, at), Self::Known(others, also)) if own != others => Self::Open(
                format!("differs between the ways to this target: {at} and {also}; expected one"),
            ),
            (Self::Known(_, at), Self::Unset) | (Self::Unset, Self::Known(_, at)) => {
                Self::Open(format!(
                    "is set on some of the ways to this target alone, by {at}; expected on all"
                ))
            }
            _ => self.clone(),
        }
    }
}

impl JoinedState for InForce {
    fn joined(&self, other: &Self) -> Self {
        Self {
            base: self.base.joined(&other.base),
            tool: self.tool.joined(&other.tool),
            load: self.load.joined(&other.load),
        }
    }
}

impl InForce {
    /// Where nothing is set.
    pub const NOTHING: Self = Self {
        base: Setting::Unset,
        tool: Setting::Unset,
        load: Setting::Unset,
    };

    /// Where nothing is known, for one reason.
    pub fn open(why: &str) -> Self {
        let why = || why.to_string();
        Self {
            base: Setting::Open(why()),
            tool: Setting::Open(why()),
            load: Setting::Open(why()),
        }
    }
}
