//! Rigid motions: poses, twists, exponential, left Jacobian.
//!
//! Twists are ordered (v; w) and frames read left to right: `base_tool = base_flange * flange_tool`. Formulas: Lynch and Park,
//! Modern Robotics, ch. 3; Barfoot, State Estimation for Robotics, ch. 7.

mod pose;
mod twist;

pub use pose::Pose;
pub use twist::{Twist, hat, left_jacobian, screw};
