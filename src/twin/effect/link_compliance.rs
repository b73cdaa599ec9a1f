//! A link as a uniform elastic beam, clamped at its joint and loaded at its far end by the weight of everything beyond.
//!
//! Under an end force F and an end moment M a cantilever of length L turns by `M L/EI + F L^2/(2 EI)` and moves by
//! `M L^2/(2 EI) + F L^3/(3 EI)` across its axis; along its axis a moment twists it by `M L/GJ`.

use super::{Act, Motion, State, effect};
use crate::matrix;

effect! {
    /// The beam between joint N and joint N+1.
    pub struct LinkCompliance {
        /// From 1: the body moved by joint N.
        pub link: usize,
        /// Rotation of the end per end moment across the beam, L/EI, rad/Nm.
        pub bending_rad_per_nm: f64,
        /// Rotation of the end per moment along the beam, L/GJ, rad/Nm.
        #[serde(default)]
        pub torsion_rad_per_nm: f64,
    }
    "link_compliance" at link, scaled by bending_rad_per_nm torsion_rad_per_nm,
    |self| [("bending", "rad/Nm", self.bending_rad_per_nm), ("torsion", "rad/Nm", self.torsion_rad_per_nm)]
}

impl Act for LinkCompliance {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let frame = &state.posture.frames[index];
        let span = state.arm.links[index].span;
        let length = matrix::norm(span);
        if length == 0.0 {
            return;
        }
        let along = matrix::scale(span, 1.0 / length);
        let (force, moment) = state.loads.wrench(index + 1, matrix::place(frame, span));
        let (force, moment) = (matrix::see(frame, force), matrix::see(frame, moment));
        let twist = matrix::dot(moment, along);
        let across = matrix::minus(moment, matrix::scale(along, twist));
        // `along x F` is the moment of the end force per unit of arm, so it bends the same way as `across`.
        let by_force = matrix::scale(matrix::cross(along, force), length);
        let soft = self.bending_rad_per_nm;
        let bend = matrix::add(
            matrix::scale(across, soft),
            matrix::scale(by_force, soft / 2.0),
        );
        let lean = matrix::add(
            matrix::scale(across, soft / 2.0),
            matrix::scale(by_force, soft / 3.0),
        );
        let moved = matrix::scale(matrix::cross(lean, along), length);
        let turned = matrix::add(bend, matrix::scale(along, self.torsion_rad_per_nm * twist));
        let end = matrix::times(&matrix::shift(moved), &matrix::turn_by(turned));
        motion.link_end[index] = matrix::times(&motion.link_end[index], &end);
    }
}
