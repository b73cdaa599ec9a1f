//! A bearing whose axis tilts as the joint turns.

use super::{Act, Motion, State, effect};
use crate::matrix;
use crate::truth::ARCSEC;

effect! {
    /// Tilt of the axis by `amplitude cos(order q + phase)` about one direction across it and `ellipse` times the sine about the other,
    /// seen from the body that carries the joint.
    pub struct AxisWobble {
        /// From 1.
        pub joint: usize,
        /// Periods per turn of the joint.
        pub order: f64,
        /// arcsec.
        pub amplitude_arcsec: f64,
        /// Second half axis per first: 0 swings in one plane, 1 goes round.
        #[serde(default)]
        pub ellipse: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "axis_wobble" at joint, scaled by amplitude_arcsec,
    |self| [(format!("amplitude{}", self.order), "arcsec", self.amplitude_arcsec)]
}

impl Act for AxisWobble {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.joint - 1;
        let axis = state.arm.links[index].axis;
        // The base direction that lies farthest from the axis makes the pair across it.
        let aside = if axis[0].abs() < 0.7 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 0.0, 1.0]
        };
        let first = matrix::cross(axis, aside);
        let first = matrix::scale(first, 1.0 / matrix::norm(first));
        let second = matrix::cross(axis, first);
        let (sine, cosine) =
            (self.order * state.row.command[index] + self.phase_deg.to_radians()).sin_cos();
        let size = self.amplitude_arcsec * ARCSEC;
        let tilt = matrix::add(
            matrix::scale(first, size * cosine),
            matrix::scale(second, size * self.ellipse * sine),
        );
        let tilt = matrix::turn_by(tilt);
        if index == 0 {
            let foot = state.arm.foot;
            let about = matrix::times(&tilt, &matrix::shift(matrix::scale(foot, -1.0)));
            motion.base = matrix::times(&motion.base, &matrix::times(&matrix::shift(foot), &about));
        } else {
            motion.link_end[index - 1] = matrix::times(&motion.link_end[index - 1], &tilt);
        }
    }
}
