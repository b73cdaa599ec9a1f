//! `anchor`: what is measured from is elsewhere: the far end of a draw-wire or ballbar, a socket, a plane, a sphere. It moves no point.
//!
//! Parameters of a point are x, y, z, tracker axes; of a plane `offset` along its normal and the turns `rx`, `ry` of that; of a sphere its
//! centre and `radius`.

use super::{ArmState, Deflection, Effect, ParameterSpec, Place, names};
use crate::robot::{Anchor, RobotModel, Shape};
use crate::units::Unit;
use nalgebra::Vector3;

/// Where things are that distances go to and that a target is brought to.
#[derive(Debug, Clone, Copy)]
pub struct AnchorShift;

impl AnchorShift {
    /// What the names of an anchor's parameters begin with, dot included.
    pub fn prefix(anchor: &str) -> String {
        if anchor.is_empty() {
            format!("{}.", names::ANCHOR)
        } else {
            format!("{}.{anchor}.", names::ANCHOR)
        }
    }

    /// Endings of the names of an anchor's parameters.
    pub(crate) fn endings(shape: &Shape) -> &'static [&'static str] {
        match shape {
            Shape::Point => &["x", "y", "z"],
            Shape::Plane(_) => &["offset", "rx", "ry"],
            Shape::Sphere(_) => &["x", "y", "z", "radius"],
        }
    }
}

impl Effect for AnchorShift {
    fn name(&self) -> &'static str {
        names::ANCHOR
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let anchors = robot.setup().anchors.iter();
        let all = anchors.flat_map(|anchor| {
            Self::endings(&anchor.shape)
                .iter()
                .map(move |ending| ParameterSpec {
                    name: format!("{}{ending}", Self::prefix(&anchor.name)),
                    place: Place::Anchor,
                    unit: if matches!(*ending, "rx" | "ry") {
                        Unit::Radian
                    } else {
                        Unit::Millimetre
                    },
                    prior_sigma: 1.0,
                })
        });
        all.collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let setup = robot.setup();
        let Some((number, anchor)) = state
            .anchor(robot)
            .and_then(|number| Some((number, setup.anchors.get(number)?)))
        else {
            return;
        };
        let first = setup.first_of_anchor(number);
        if let Shape::Plane(normal) = &anchor.shape {
            out.move_anchor(first, p, *normal);
            out.tilt_anchor(first + 1, p, normal, &Anchor::across(normal));
            return;
        }
        for axis in 0..3 {
            out.move_anchor(first + axis, p, Vector3::ith(axis, 1.0));
        }
        if let Shape::Sphere(_) = anchor.shape {
            out.grow_anchor(first + 3, p);
        }
    }
}
