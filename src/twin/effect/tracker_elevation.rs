//! The head of the tracker: its vertical index is off, it sags, its vertical circle is eccentric, or its transit axis is tilted.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::matrix::Vector;
use crate::polar::Polar;
use crate::statics::Row;
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Errors of the angles by the elevation.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
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

impl Act for TrackerElevation {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn sight(&self, _row: &Row, _memory: f64, point: Vector) -> Vector {
        let seen = Polar::of(point);
        let circle = self.circle_arcsec * (seen.elevation + self.phase_deg.to_radians()).sin();
        let elevation = seen.elevation + ARCSEC * (self.index_arcsec + self.sag_arcsec * seen.elevation.cos() + circle);
        let azimuth = seen.azimuth + ARCSEC * self.transit_arcsec * seen.elevation.tan();
        Polar { azimuth, elevation, ..seen }.point()
    }
    fn scale(&mut self, by: f64) {
        for size in [&mut self.index_arcsec, &mut self.sag_arcsec, &mut self.circle_arcsec, &mut self.transit_arcsec] {
            *size *= by;
        }
    }
    fn truth(&self) -> Vec<TrueValue> {
        let value = |name: &str, value| true_value("tracker_elevation", "tracker", "tracker".into(), name, "arcsec", value);
        vec![
            value("index", self.index_arcsec),
            value("sag", self.sag_arcsec),
            value("circle", self.circle_arcsec),
            value("transit", self.transit_arcsec),
        ]
    }
}
