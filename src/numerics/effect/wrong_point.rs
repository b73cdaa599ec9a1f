//! `outlier` and `mislabelled_point`: single wrong points, and points under each other's name; the screening of the fit finds them.

use super::{Cause, CauseDescription, names};

/// A fault of single rows.
pub struct WrongPoint(&'static CauseDescription);

/// Single wrong points.
pub const OUTLIER: WrongPoint = WrongPoint(&CauseDescription {
    name: names::OUTLIER,
    place: "recording",
    formula: "single wrong points",
    size: "any",
    confounded: "-",
    needs: "-",
});

/// Points under each other's name.
pub const MISLABELLED_POINT: WrongPoint = WrongPoint(&CauseDescription {
    name: names::MISLABELLED_POINT,
    place: "recording",
    formula: "points that carry each other's name",
    size: "any",
    confounded: "-",
    needs: "-",
});

impl Cause for WrongPoint {
    fn about(&self) -> &'static CauseDescription {
        self.0
    }

    fn is_of_the_measurement(&self) -> bool {
        true
    }

    fn is_separable_by_poses(&self) -> bool {
        false
    }
}
