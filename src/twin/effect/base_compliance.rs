//! The foundation tilts under the overturning moment of the whole arm about its foot.

use super::{Act, Motion, State, effect};
use crate::matrix::{self, Vector};

effect! {
    /// A base on elastic anchors: soft about both horizontal axes, stiff about the vertical one.
    pub struct BaseCompliance {
        /// Tilt about base x and y per moment, rad/Nm.
        pub rad_per_nm: [f64; 2],
        /// The point about which it tilts, base frame, mm.
        #[serde(default)]
        pub pivot_mm: Vector,
    }
    "base_compliance" of "base" "base", scaled by rad_per_nm,
    |self| [("x", "rad/Nm", self.rad_per_nm[0]), ("y", "rad/Nm", self.rad_per_nm[1])]
}

impl Act for BaseCompliance {
    fn act(&self, state: &State, motion: &mut Motion) {
        let pivot = matrix::scale(self.pivot_mm, 1e-3);
        let (_, moment) = state.loads.wrench(0, pivot);
        let tilt = [
            self.rad_per_nm[0] * moment[0],
            self.rad_per_nm[1] * moment[1],
            0.0,
        ];
        let about = matrix::times(
            &matrix::turn_by(tilt),
            &matrix::shift(matrix::scale(pivot, -1.0)),
        );
        motion.base = matrix::times(&motion.base, &matrix::times(&matrix::shift(pivot), &about));
    }
}
