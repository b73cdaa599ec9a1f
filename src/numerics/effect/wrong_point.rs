//! `outlier` and `mislabelled_point`: single wrong points, and points under each other's name; the screening of the fit finds them.

use super::{Cause, CauseDescription, names};

pub struct Outlier;

impl Cause for Outlier {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: names::OUTLIER,
            place: "recording",
            formula: "single wrong points",
            size: "any",
            confounded: "-",
            needs: "-",
            of_the_measurement: true,
            separable_by_poses: false,
            ..CauseDescription::PLAIN
        }
    }
}

pub struct MislabelledPoint;

impl Cause for MislabelledPoint {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: names::MISLABELLED_POINT,
            place: "recording",
            formula: "points that carry each other's name",
            size: "any",
            confounded: "-",
            needs: "-",
            of_the_measurement: true,
            separable_by_poses: false,
            ..CauseDescription::PLAIN
        }
    }
}
