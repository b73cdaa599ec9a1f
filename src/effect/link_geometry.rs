//! `link_geometry`: link N (between joints N and N+1) has another length or twist: joint N+1 and all beyond it are displaced.
//!
//! Two displacements and two tilts perpendicular to the axis of joint N+1, about its point; together with `base_frame`,
//! `joint_offset` and `tool_offset` this is complete (rank 4R + 2P + 3) and free of the singularity of parallel axes.

use super::{ArmState, Deflection, Effect, ParameterSpec};
use crate::robot::RobotModel;
use crate::spatial::{Twist, screw};
use crate::units::Unit;
use nalgebra::Vector3;

#[derive(Debug, Clone, Copy)]
pub struct LinkGeometry;

/// A parameter of link `link` (from 1): its axis letter, whether it is a tilt, and its twist.
fn directions(robot: &RobotModel, link: usize) -> Vec<(char, bool, Twist)> {
    let (axis, point) = (robot.axis(link), robot.point(link));
    // The two base axes least along the joint's axis, made perpendicular to it.
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs()));
    let mut chosen = [order[0], order[1]];
    chosen.sort_unstable();
    let perpendicular = chosen.map(|k| {
        let mut unit = Vector3::zeros();
        unit[k] = 1.0;
        let direction: Vector3<f64> = unit - axis * axis[k];
        (['x', 'y', 'z'][k], direction.normalize())
    });
    let mut out = Vec::with_capacity(4);
    if robot.is_revolute(link) {
        out.extend(perpendicular.iter().map(|(letter, d)| (*letter, false, Twist::new(d.x, d.y, d.z, 0.0, 0.0, 0.0))));
    }
    out.extend(perpendicular.iter().map(|(letter, d)| (*letter, true, screw(d, point))));
    out
}

impl Effect for LinkGeometry {
    fn name(&self) -> &'static str {
        "link_geometry"
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let mut out = Vec::new();
        for link in 1..robot.joints() {
            for (letter, tilt, _) in directions(robot, link) {
                out.push(ParameterSpec {
                    name: format!("link_geometry.l{link}.{}{letter}", if tilt { "r" } else { "" }),
                    place: format!("link {link}"),
                    unit: if tilt { Unit::Radian } else { Unit::Millimetre },
                    prior_sigma: 5e-3, // 5 mm, 5 mrad
                });
            }
        }
        out
    }

    fn deflect(&self, robot: &RobotModel, _state: &ArmState, p: &[f64], out: &mut Deflection) {
        let mut parameter = 0;
        for link in 1..robot.joints() {
            for (_, _, twist) in directions(robot, link) {
                out.shift(parameter, p, link, twist);
                parameter += 1;
            }
        }
    }
}
