//! What effects add to the arm in one row.

use super::matrix::{self, IDENTITY, Matrix, Vector};
use super::truth::ARCSEC;

/// A share of a rigid step: a shift (um) after a rotation vector (arcsec).
pub(crate) fn step(shift_um: Vector, turn_arcsec: Vector, share: f64) -> Matrix {
    let moved = matrix::shift(matrix::scale(shift_um, 1e-6 * share));
    matrix::times(
        &moved,
        &matrix::turn_by(matrix::scale(turn_arcsec, ARCSEC * share)),
    )
}

/// What effects do to the arm.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Motion of the tracker's frame.
    pub(crate) tracker: Matrix,
    /// Motion of the base, base frame.
    pub(crate) base: Matrix,
    /// Added to each joint, rad or m.
    pub joint: Vec<f64>,
    /// Motion of each link's far end, in the frame of the link, about that end.
    pub(crate) link_end: Vec<Matrix>,
    /// Shift of the measured point, last link's frame, m.
    pub(crate) tool: Vector,
    /// What turns each joint besides gravity, Nm: springs and hoses. The gear carries it too.
    pub(crate) load: Vec<f64>,
    /// What each motor carries besides gravity, Nm at the joint.
    pub(crate) motor_torque: Vec<f64>,
}

impl Motion {
    /// No motion of an arm with so many joints.
    pub fn none(joints: usize) -> Motion {
        Motion {
            tracker: IDENTITY,
            base: IDENTITY,
            joint: vec![0.0; joints],
            link_end: vec![IDENTITY; joints],
            tool: [0.0; 3],
            load: vec![0.0; joints],
            motor_torque: vec![0.0; joints],
        }
    }

    /// Moves the base about a point of it, m.
    pub(crate) fn move_base(&mut self, pivot: Vector, by: &Matrix) {
        let about = matrix::times(by, &matrix::shift(matrix::scale(pivot, -1.0)));
        self.base = matrix::times(&self.base, &matrix::times(&matrix::shift(pivot), &about));
    }

    /// Moves the far end of a link (from 0), in its frame.
    pub(crate) fn move_end(&mut self, link: usize, by: &Matrix) {
        self.link_end[link] = matrix::times(&self.link_end[link], by);
    }

    /// Moves the axis of a joint (from 0), seen from the body that carries it; the first stands on the base, at its foot.
    pub(crate) fn move_axis(&mut self, foot: Vector, joint: usize, by: &Matrix) {
        match joint.checked_sub(1) {
            Some(link) => self.move_end(link, by),
            None => self.move_base(foot, by),
        }
    }

    /// The largest difference of any number, rad, m or Nm; the motors' torque does not move the arm.
    pub(crate) fn distance(&self, other: &Motion) -> f64 {
        let apart = |a: &Matrix, b: &Matrix| {
            a.as_flattened()
                .iter()
                .zip(b.as_flattened())
                .map(|(x, y)| (x - y).abs())
                .fold(0.0, f64::max)
        };
        let joints = self
            .joint
            .iter()
            .zip(&other.joint)
            .map(|(a, b)| (a - b).abs());
        let links = self
            .link_end
            .iter()
            .zip(&other.link_end)
            .map(|(a, b)| apart(a, b));
        let loads = self
            .load
            .iter()
            .zip(&other.load)
            .map(|(a, b)| (a - b).abs());
        let frames = [
            apart(&self.base, &other.base),
            apart(&self.tracker, &other.tracker),
        ];
        joints
            .chain(links)
            .chain(loads)
            .chain(frames)
            .fold(matrix::norm(matrix::minus(self.tool, other.tool)), f64::max)
    }
}
