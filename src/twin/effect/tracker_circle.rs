//! The tracker's horizontal circle sits off its axis, or is no circle: its azimuth errs with its azimuth.

use super::{Act, Motion, State, effect, sine_and_cosine};
use crate::matrix::Vector;
use crate::polar::Polar;
use crate::statics::Row;
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is wrong with the circle, with amplitude `a` and phase `p`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Circle {
    /// `a sin(azimuth + p)`: a small eccentricity.
    Eccentric,
    /// `a sin(2 azimuth + p)`: a circle bent to an ellipse, or one read at two sides.
    Elliptic,
    /// The direction from a centre `a` radii off the axis, by the arctangent.
    OffCentre,
}

effect! {
    /// Error of the azimuth.
    pub struct TrackerCircle {
        /// Which circle.
        pub circle: Circle,
        /// arcsec.
        pub amplitude_arcsec: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "tracker_circle" of "tracker" "tracker", scaled by amplitude_arcsec, |self| {
        let order = if self.circle == Circle::Elliptic { 2.0 } else { 1.0 };
        sine_and_cosine(order, "arcsec", self.amplitude_arcsec, self.phase_deg)
    }
}

impl Act for TrackerCircle {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn sight(&self, _row: &Row, _memory: f64, point: Vector) -> Vector {
        let seen = Polar::of(point);
        let (size, phase) = (self.amplitude_arcsec * ARCSEC, self.phase_deg.to_radians());
        let azimuth = match self.circle {
            Circle::Eccentric => seen.azimuth + size * (seen.azimuth + phase).sin(),
            Circle::Elliptic => seen.azimuth + size * (2.0 * seen.azimuth + phase).sin(),
            Circle::OffCentre => {
                let (sine, cosine) = seen.azimuth.sin_cos();
                (sine + size * phase.sin()).atan2(cosine - size * phase.cos())
            }
        };
        Polar { azimuth, ..seen }.point()
    }
}
