//! `link_geometry`: link N (between joints N and N+1) has another length or twist: joint N+1 and all beyond it are displaced.
//!
//! Two displacements and two tilts perpendicular to the axis of joint N+1, about its point; together with `base_frame`,
//! `joint_offset` and `tool_offset` this is complete (rank 4R + 2P + 3) and free of the singularity of parallel axes.

use super::{ArmState, Cause, Deflection, Effect, ParameterSpec, Place, about, names};
use crate::robot::RobotModel;
use crate::spatial::{Twist, screw};
use crate::units::Unit;

#[derive(Debug, Clone, Copy)]
pub struct LinkGeometry;

/// The parameters of link `link` (from 1): base axis (from 0), whether it is a tilt, twist.
fn directions(robot: &RobotModel, link: usize) -> impl Iterator<Item = (usize, bool, Twist)> {
    let shifts = robot.is_revolute(link).then(|| robot.normals(link)).into_iter().flatten();
    let shifts = shifts.map(|(axis, d)| (*axis, false, Twist::new(d.x, d.y, d.z, 0.0, 0.0, 0.0)));
    shifts.chain(robot.normals(link).iter().map(move |(axis, d)| (*axis, true, screw(d, robot.point(link)))))
}

impl Cause for LinkGeometry {
    about! {
        name: names::LINK_GEOMETRY,
        place: "link",
        formula: "lengths and tilts between two axes",
        size: "0.1 to 1 mm, 0.1 to 1 mrad",
        confounded: "joint_offset, tool_offset",
        needs: "-",
        arm_effect: Some(|_| Box::new(LinkGeometry)),
    }
}

impl Effect for LinkGeometry {
    fn name(&self) -> &'static str {
        names::LINK_GEOMETRY
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let mut out = Vec::new();
        for link in 1..robot.joints() {
            for (axis, tilt, _) in directions(robot, link) {
                let letter = ['x', 'y', 'z'][axis];
                out.push(ParameterSpec {
                    name: format!("link_geometry.l{link}.{}{letter}", if tilt { "r" } else { "" }),
                    place: Place::Links(link - 1, link - 1),
                    unit: if tilt { Unit::Radian } else { Unit::Millimetre },
                    prior_sigma: 5e-3, // 5 mm, 5 mrad
                });
            }
        }
        out
    }

    fn is_constant(&self) -> bool {
        true
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
