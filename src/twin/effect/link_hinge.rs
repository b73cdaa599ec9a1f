//! A link that gives way at its middle, as a casting with a weak flange does.

use super::{Act, Motion, State, effect};
use crate::matrix;

effect! {
    /// An elastic hinge halfway along the link, soft about both directions across it.
    pub struct LinkHinge {
        /// From 1: the body moved by joint N.
        pub link: usize,
        /// Rotation per moment at the middle, rad/Nm.
        pub rad_per_nm: f64,
    }
    "link_compliance" at link, scaled by rad_per_nm, |self| [("middle", "rad/Nm", self.rad_per_nm)]
}

impl Act for LinkHinge {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let frame = &state.posture.frames[index];
        let span = state.arm.links[index].span;
        let length = matrix::norm(span);
        if length == 0.0 {
            return;
        }
        let along = matrix::scale(span, 1.0 / length);
        let half = matrix::scale(span, 0.5);
        let (_, moment) = state.loads.wrench(index + 1, matrix::place(frame, half));
        let moment = matrix::see(frame, moment);
        let across = matrix::minus(moment, matrix::scale(along, matrix::dot(moment, along)));
        let turned = matrix::turn_by(matrix::scale(across, self.rad_per_nm));
        let back = matrix::times(&turned, &matrix::shift(half));
        let end = matrix::times(&matrix::shift(matrix::scale(half, -1.0)), &back);
        motion.link_end[index] = matrix::times(&motion.link_end[index], &end);
    }
}
