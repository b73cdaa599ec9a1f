//! Parameters as people know them: where base, targets and anchors stand, and of all others the change from nominal.

use super::model::Model;
use crate::effect::names;
use crate::robot::{Anchor, Shape, Target};
use crate::spatial::{Pose, Twist};
use nalgebra::Vector3;

impl Model {
    /// Nominal and present value of a parameter of the stack, SI.
    pub fn standing(&self, parameter: usize) -> (f64, f64) {
        let change = (0.0, self.x.get(parameter).copied().unwrap_or_default());
        let found = self
            .stack
            .effects()
            .find(|(_, range)| range.contains(&parameter));
        let Some((effect, range)) = found else {
            return change;
        };
        let number = parameter - range.start;
        match effect.name() {
            names::BASE_FRAME => (
                component(self.stack.base(), number),
                component(&self.base(), number),
            ),
            names::ANCHOR => self.anchored(number).unwrap_or(change),
            names::TOOL_OFFSET => self.mounting(number, &self.x[range]).unwrap_or(change),
            _ => change,
        }
    }

    /// The `number`-th parameter of anchors at the start and now: a coordinate or a radius; of a plane its distance from the origin
    /// along its normal, or a tilt of that.
    fn anchored(&self, number: usize) -> Option<(f64, f64)> {
        let setup = self.robot.setup();
        let anchor_number = (0..setup.anchors.len())
            .rev()
            .find(|anchor_number| setup.first_of_anchor(*anchor_number) <= number)?;
        let axis = number - setup.first_of_anchor(anchor_number);
        let anchor = setup.anchors.get(anchor_number)?;
        let now = self.standing_anchor(anchor_number)?;
        match (anchor.shape, now.shape) {
            (Shape::Plane(before), Shape::Plane(normal)) if axis == 0 => {
                Some((before.dot(&anchor.place), normal.dot(&now.place)))
            }
            (Shape::Plane(before), Shape::Plane(normal)) => Some((
                Anchor::tilts(&before)[axis - 1],
                Anchor::tilts(&normal)[axis - 1],
            )),
            (Shape::Sphere(before), Shape::Sphere(radius)) if axis == 3 => Some((before, radius)),
            _ => Some((anchor.place[axis], now.place[axis])),
        }
    }

    /// The `number`-th parameter of targets with corrections `x`; none where the tool point is what is measured.
    fn mounting(&self, number: usize, x: &[f64]) -> Option<(f64, f64)> {
        let mut first = 0;
        for target in &self.robot.setup().targets {
            let width = if target.oriented { 6 } else { 3 };
            if number < first + width {
                let corrected = corrected(target, x.get(first..first + width)?);
                let axis = number - first;
                return Some((
                    self.beside_tool(&target.mounting, axis),
                    self.beside_tool(&corrected, axis),
                ));
            }
            first += width;
        }
        None
    }

    /// x, y, z from the tool point (m), or a component of the rotation vector from the tool frame (rad), base axes at the zero pose.
    fn beside_tool(&self, mounting: &Pose, axis: usize) -> f64 {
        let home = self.robot.home();
        component(
            &Pose::new(
                mounting.rotation * home.rotation.transpose(),
                mounting.translation - home.translation,
            ),
            axis,
        )
    }
}

/// The mounting after corrections as `tool_offset` makes them.
fn corrected(target: &Target, x: &[f64]) -> Pose {
    let mut twist = Twist::zeros();
    for (axis, value) in x.iter().enumerate() {
        if axis < 3 {
            twist[axis] += value;
        } else {
            twist +=
                crate::spatial::screw(&Vector3::ith(axis - 3, 1.0), &target.mounting.translation)
                    * *value;
        }
    }
    Pose::exp(&twist) * target.mounting
}

/// x, y, z (m) or a component of the rotation vector (rad).
fn component(pose: &Pose, axis: usize) -> f64 {
    if axis < 3 {
        pose.translation[axis]
    } else {
        pose.rotation_vector()[axis - 3]
    }
}
