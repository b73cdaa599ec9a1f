//! `tracker_scale`: all distances are longer by a share; link lengths absorb it, so that no points of the arm ever show it.

use super::{Cause, about};

pub struct TrackerScale;

impl Cause for TrackerScale {
    about! {
        name: "tracker_scale",
        place: "tracker",
        formula: "all distances are longer by a share",
        size: "1 to 20 um/m",
        confounded: "link_geometry, which absorbs it",
        needs: "a scale bar: points of the arm never show it",
        of_the_measurement: true,
    }
}
