//! `outlier` and `mislabelled_point`: single wrong points, and points under each other's name; the screening of the fit finds them.

use super::{Cause, about, names};

pub struct Outlier;

impl Cause for Outlier {
    about! {
        name: names::OUTLIER,
        place: "recording",
        formula: "single wrong points",
        size: "any",
        confounded: "-",
        needs: "-",
        of_the_measurement: true,
        separable_by_poses: false,
    }
}

pub struct MislabelledPoint;

impl Cause for MislabelledPoint {
    about! {
        name: names::MISLABELLED_POINT,
        place: "recording",
        formula: "points that carry each other's name",
        size: "any",
        confounded: "-",
        needs: "-",
        of_the_measurement: true,
        separable_by_poses: false,
    }
}
