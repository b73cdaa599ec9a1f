//! What something unknown depends on and how, in words and numbers.

use super::thermal_growth::Warmth;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What an unknown motion depends on, and how.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Signature {
    /// A smooth function of a joint position.
    Angle { by: usize, low: f64, high: f64 },
    /// A bump around a joint position.
    Bump { centre_rad: f64, width_rad: f64 },
    /// One level below a joint position, another above it.
    Step { centre_rad: f64, width_rad: f64 },
    /// A hinge: nothing up to a joint position, then in proportion.
    Hinge { by: usize, from_rad: f64, upwards: bool },
    /// A sine of another joint's angle.
    Periodic { by: usize, order: u32 },
    /// Products of sines and cosines of two angles.
    Product { a: usize, b: usize },
    /// A smooth function of two joint positions.
    Surface { a: usize, b: usize, a_range: [f64; 2], b_range: [f64; 2] },
    /// A slow sine in time, of its place or of its orientation.
    Sway {
        period_s: f64,
        #[serde(default)]
        turns: bool,
    },
    /// A smooth function of time.
    Time { start_s: f64, end_s: f64 },
    /// One way in time, by a power of it.
    Creep { start_s: f64, end_s: f64, power: f64 },
    /// With temperature or warm-up.
    Warming(Warmth),
    /// Other on either side: a seat with play, by which side of an axis of the tool (0 to 2, zero pose) hangs down.
    Side { axis: usize },
    /// With the direction of gravity as the tool sees it: a mounting that yields.
    Sag,
    /// Differs where a payload is carried.
    Payload { above_kg: f64 },
}

impl fmt::Display for Signature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Angle { by, .. } => write!(f, "function of q{}", by + 1),
            Self::Bump { centre_rad, width_rad } => {
                write!(f, "local bump at {:.1} deg, width {:.1} deg", centre_rad.to_degrees(), width_rad.to_degrees())
            }
            Self::Step { centre_rad, width_rad } => {
                write!(f, "step at {:.1} deg within {:.1} deg", centre_rad.to_degrees(), width_rad.to_degrees())
            }
            Self::Hinge { by, from_rad, upwards } => {
                let side = if *upwards { "above" } else { "below" };
                write!(f, "grows with q{} {side} {:.1} deg, nothing on the other side", by + 1, from_rad.to_degrees())
            }
            Self::Periodic { by, order } => write!(f, "periodic in q{}, {order} a turn", by + 1),
            Self::Product { a, b } => write!(f, "product of functions of q{} and q{}", a + 1, b + 1),
            Self::Surface { a, b, .. } => write!(f, "function of q{} and q{}", a + 1, b + 1),
            // Whether the period is in seconds only the recording knows.
            Self::Sway { turns, .. } => write!(f, "{} slowly", if *turns { "rocks" } else { "sways" }),
            Self::Time { .. } => f.write_str("function of time"),
            Self::Creep { power, .. } if (power - 1.0).abs() < 0.3 => f.write_str("creeps steadily with time"),
            Self::Creep { power, .. } => {
                write!(f, "creeps with time, {} and {0}", if *power > 1.0 { "faster" } else { "slower" })
            }
            Self::Warming(_) => f.write_str("goes with the warm-up"),
            Self::Side { axis } => {
                let name = ["x", "y", "z"].get(*axis).unwrap_or(&"z");
                write!(f, "other on either side of its {name}: which one hangs down decides, as where a seat has play")
            }
            Self::Sag => f.write_str("goes with the direction in which it hangs, as where a mounting yields"),
            Self::Payload { .. } => f.write_str("differs with the payload"),
        }
    }
}
