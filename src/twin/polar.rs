//! A point as a tracker measures it: range, azimuth about its standing axis z from x, elevation above its horizon.

use super::matrix::{self, Vector};

/// m and rad, in the tracker's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Polar {
    /// m.
    pub(crate) range: f64,
    /// rad.
    pub(crate) azimuth: f64,
    /// rad.
    pub(crate) elevation: f64,
}

impl Polar {
    /// The range and the angles of a point as the instrument sees it, m.
    pub(crate) fn of(point: Vector) -> Polar {
        let level = point[0].hypot(point[1]);
        Polar {
            range: matrix::norm(point),
            azimuth: point[1].atan2(point[0]),
            elevation: point[2].atan2(level),
        }
    }

    /// The point, m.
    pub(crate) fn point(self) -> Vector {
        let (level, height) = (
            self.range * self.elevation.cos(),
            self.range * self.elevation.sin(),
        );
        [
            level * self.azimuth.cos(),
            level * self.azimuth.sin(),
            height,
        ]
    }
}
