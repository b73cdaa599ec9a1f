//! The head of the tracker: its vertical index is off, it sags, its vertical circle is eccentric, or its transit axis is tilted.

use super::{Act, Motion, State, effect};
use crate::matrix::Vector;
use crate::polar::Polar;
use crate::statics::Row;
use crate::truth::ARCSEC;

effect! {
    /// Errors of the angles by the elevation.
    #[derive(Default)]
    #[serde(default)]
    pub struct TrackerElevation {
        /// Every elevation is too large by this, arcsec.
        pub index_arcsec: f64,
        /// The elevation by this times its cosine, arcsec: the weight of the head.
        pub sag_arcsec: f64,
        /// The elevation by this times `sin(elevation + phase)`, arcsec.
        pub circle_arcsec: f64,
        /// Phase at zero, deg.
        pub phase_deg: f64,
        /// The azimuth by this times the tangent of the elevation, arcsec: the transit axis is not square to the standing one.
        pub transit_arcsec: f64,
    }
    "tracker_elevation" of "tracker" "tracker", scaled by index_arcsec sag_arcsec circle_arcsec transit_arcsec, |self| [
        ("index", "arcsec", self.index_arcsec),
        ("sag", "arcsec", self.sag_arcsec),
        ("circle", "arcsec", self.circle_arcsec),
        ("transit", "arcsec", self.transit_arcsec),
    ]
}

impl Act for TrackerElevation {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn sight(&self, _row: &Row, _memory: f64, point: Vector) -> Vector {
        let seen = Polar::of(point);
        let circle = self.circle_arcsec * (seen.elevation + self.phase_deg.to_radians()).sin();
        let elevation = seen.elevation
            + ARCSEC * (self.index_arcsec + self.sag_arcsec * seen.elevation.cos() + circle);
        let azimuth = seen.azimuth + ARCSEC * self.transit_arcsec * seen.elevation.tan();
        Polar {
            azimuth,
            elevation,
            ..seen
        }
        .point()
    }
}
