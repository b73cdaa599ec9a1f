//! The target as the instrument sees it: azimuth about its standing axis, elevation above its horizon, range; and what an error of each
//! does to the point.
//!
//! The instrument stands at the origin of the recording's frame, its standing axis along z.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// One of the three numbers that an instrument reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Polar {
    /// About the instrument's standing axis, rad.
    Azimuth,
    /// Above its horizon, rad.
    Elevation,
    /// m.
    Range,
}

/// Where a target is, seen from the instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// rad.
    pub(crate) azimuth: f64,
    /// rad.
    pub(crate) elevation: f64,
    /// m.
    pub(crate) range: f64,
}

impl Sight {
    /// Where an instrument sees a point of its frame, m.
    pub fn of(point: &Vector3<f64>) -> Self {
        let level = point.x.hypot(point.y);
        Self {
            azimuth: libm::atan2(point.y, point.x),
            elevation: libm::atan2(point.z, level),
            range: point.norm(),
        }
    }

    /// By how much the point moves (m) where a reading grows by 1 (rad, m).
    pub(crate) fn moved(&self, reading: Polar) -> Vector3<f64> {
        let ((sa, ca), (se, ce)) = (libm::sincos(self.azimuth), libm::sincos(self.elevation));
        match reading {
            Polar::Azimuth => Vector3::new(-sa, ca, 0.0) * (self.range * ce),
            Polar::Elevation => Vector3::new(-se * ca, -se * sa, ce) * self.range,
            Polar::Range => Vector3::new(ce * ca, ce * sa, se),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_moves_the_point_as_polar_coordinates_say() {
        let point = |[azimuth, elevation, range]: [f64; 3]| {
            let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
            Vector3::new(ce * ca, ce * sa, se) * range
        };
        let (at, step) = ([2.1, -0.4, 3.7], 1e-6);
        let sight = Sight::of(&point(at));
        assert!(
            (sight.azimuth - at[0]).abs()
                + (sight.elevation - at[1]).abs()
                + (sight.range - at[2]).abs()
                < 1e-12
        );
        for (k, reading) in [Polar::Azimuth, Polar::Elevation, Polar::Range]
            .into_iter()
            .enumerate()
        {
            let [mut more, mut less] = [at; 2];
            (more[k], less[k]) = (at[k] + step, at[k] - step);
            let expected = (point(more) - point(less)) / (2.0 * step);
            assert!(
                (sight.moved(reading) - expected).norm() < 1e-8,
                "{reading:?}"
            );
        }
    }
}
