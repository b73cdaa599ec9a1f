//! Effects of the whole arm that every calibration identifies: joint zeros, ratios and couplings (Eq. 14), and geometry of the links.

use super::{ArmState, Deflection, Effect, ParameterSpec, Place, names};
use crate::robot::{Measurements, RobotModel};
use crate::spatial::{Twist, screw};
use crate::units::Unit;

/// Zero error of joint N, theta_i0 of Eq. 14; one parameter a joint.
pub(super) struct JointOffset;

impl Effect for JointOffset {
    fn name(&self) -> &'static str {
        names::JOINT_OFFSET
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        (0..robot.joints())
            .map(|j| ParameterSpec {
                name: format!("joint_offset.j{}", j + 1),
                place: Place::Joint(j),
                unit: if robot.is_revolute(j) {
                    Unit::Radian
                } else {
                    Unit::Millimetre
                },
                prior_sigma: 0.02,
            })
            .collect()
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn deflect(&self, robot: &RobotModel, _state: &ArmState, p: &[f64], out: &mut Deflection) {
        for joint in 0..robot.joints() {
            out.turn(joint, p, joint, 1.0);
        }
    }
}

/// Output angle scaled by k_i; the parameter is k_i - 1.
///
/// Eq. 14 with the erratum: d theta_i = (k_i - 1)(theta_i - sum_j c_ij theta_j) + sum_j c_ij (k_j - 1) theta_j, c the nominal
/// coupling that the controller already corrects for.
pub(super) struct ReductionRatio;

impl Effect for ReductionRatio {
    fn name(&self) -> &'static str {
        names::REDUCTION_RATIO
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        (0..robot.joints())
            .map(|j| ParameterSpec {
                name: format!("reduction_ratio.j{}", j + 1),
                place: Place::Joint(j),
                unit: Unit::One,
                prior_sigma: 0.01,
            })
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let couplings = &robot.description().couplings;
        for joint in 0..robot.joints() {
            let coupled: f64 = couplings
                .iter()
                .filter(|c| c.moved == joint)
                .map(|c| c.ratio * state.q[c.by])
                .sum();
            out.turn(joint, p, joint, state.q[joint] - coupled);
        }
        for coupling in couplings.iter().filter(|c| c.ratio != 0.0) {
            out.turn(
                coupling.by,
                p,
                coupling.moved,
                coupling.ratio * state.q[coupling.by],
            );
        }
    }
}

/// Joint B moves with joint A by more than the controller believes, h of Eq. 14 times k_A: one parameter for each coupling that the robot
/// file declares.
pub(super) struct DeclaredCouplings;

impl Effect for DeclaredCouplings {
    fn name(&self) -> &'static str {
        names::COUPLING_RATIO
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let couplings = robot.description().couplings.iter();
        let spec = |place: Place| ParameterSpec {
            name: format!("coupling_ratio.{}", place.tag()),
            place,
            unit: Unit::One,
            prior_sigma: 0.01,
        };
        couplings
            .map(|coupling| spec(Place::Coupled(coupling.by, coupling.moved)))
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for (parameter, coupling) in robot.description().couplings.iter().enumerate() {
            out.turn(parameter, p, coupling.moved, state.q[coupling.by]);
        }
    }

    fn missing(&self, robot: &RobotModel, _data: &Measurements) -> Option<String> {
        robot
            .description()
            .couplings
            .is_empty()
            .then(|| "the robot file declares no couplings".to_string())
    }
}

/// Link N (between joints N and N+1) has another length or twist: joint N+1 and all beyond it are displaced.
///
/// Two displacements and two tilts perpendicular to the axis of joint N+1, about its point; together with `base_frame`,
/// `joint_offset` and `tool_offset` this is complete (rank 4R + 2P + 3) and free of the singularity of parallel axes.
pub(super) struct LinkGeometry;

/// The parameters of link `link` (from 1): base axis (from 0), whether it is a tilt, twist.
fn directions(robot: &RobotModel, link: usize) -> impl Iterator<Item = (usize, bool, Twist)> {
    let shifts = robot
        .is_revolute(link)
        .then(|| robot.normals(link))
        .into_iter()
        .flatten();
    let shifts = shifts.map(|(axis, d)| (*axis, false, Twist::new(d.x, d.y, d.z, 0.0, 0.0, 0.0)));
    shifts.chain(
        robot
            .normals(link)
            .iter()
            .map(move |(axis, d)| (*axis, true, screw(d, robot.point(link)))),
    )
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
                    name: format!(
                        "link_geometry.l{link}.{}{letter}",
                        if tilt { "r" } else { "" }
                    ),
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
