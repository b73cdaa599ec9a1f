//! Effects of the whole arm that every calibration identifies: where base, targets and anchors are, joint zeros, ratios and couplings
//! (Eq. 14), and geometry of the links.

use super::motion::MOTION;
use super::{ArmState, Deflection, Effect, ParameterSpec, Place, names};
use crate::description::Made;
use crate::robot::{Anchor, Measurements, RobotModel, Shape, Target};
use crate::spatial::{Pose, Twist, screw};
use crate::units::Unit;
use nalgebra::{Matrix3, Vector3};

/// m and rad: a target that the recording places.
const PLACED: f64 = 0.05;
/// m: a link's length and offset are off by this, or by so much of its length where that is more.
const LENGTH: f64 = 0.5e-3;
const LENGTH_BY_LENGTH: f64 = 0.3e-3;

/// One standard deviation of how far from nominal a robot is made, SI: as its file says, else as arms of this kind are; long links
/// are off by more.
pub fn tolerance(robot: &RobotModel, made: Made) -> f64 {
    let usual = match made {
        Made::Length => LENGTH,
        Made::Axis => 0.5e-3,
        Made::Zero | Made::Tool => 3e-3,
        // A quotient of tooth counts is off by what the measurement of its turns is.
        Made::Ratio => 1e-4,
        Made::Coupling => 3e-4,
        Made::Compliance => 1e-5,
    };
    let stated = robot.description().tolerances.get(&made);
    stated.copied().unwrap_or(usual)
}

/// What the names of parameters of an effect begin with, of something that has a name or not.
fn prefix(effect: &str, name: &str) -> String {
    match name {
        "" => format!("{effect}."),
        name => format!("{effect}.{name}."),
    }
}

/// `anchor`: what is measured from is elsewhere: the far end of a draw-wire or ballbar, a socket, a plane, a sphere. It moves no point.
///
/// Parameters of a point are x, y, z, tracker axes; of a plane `offset` along its normal and the turns `rx`, `ry` of that; of a sphere its
/// centre and `radius`.
#[derive(Debug, Clone, Copy)]
pub struct AnchorShift;

impl AnchorShift {
    /// What the names of an anchor's parameters begin with, dot included.
    pub fn prefix(anchor: &str) -> String {
        prefix(names::ANCHOR, anchor)
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
                    tolerance: 1.0,
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

/// `base_frame`: where the robot's base stands in the tracker's frame; six parameters about the base origin, tracker axes.
///
/// Corrections to a starting pose: exp of the twist, given in tracker axes, applied in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct BasePlacement {
    start: Pose,
}

impl BasePlacement {
    /// Corrections from a start; all zero there.
    pub fn new(start: Pose) -> Self {
        Self { start }
    }

    /// The base pose after corrections `p` (m, rad).
    pub(crate) fn pose(&self, p: &[f64]) -> Pose {
        let mut twist = Twist::zeros();
        for (parameter, value) in p.iter().enumerate() {
            twist += self.direction(parameter) * *value;
        }
        self.start * Pose::exp(&twist)
    }

    fn direction(&self, parameter: usize) -> Twist {
        let local: Vector3<f64> = self.start.rotation.row(parameter % 3).transpose();
        let mut twist = Twist::zeros();
        twist
            .fixed_rows_mut::<3>(if parameter < 3 { 0 } else { 3 })
            .copy_from(&local);
        twist
    }
}

impl Effect for BasePlacement {
    fn name(&self) -> &'static str {
        names::BASE_FRAME
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let axes = MOTION.into_iter().map(|(axis, unit, _)| ParameterSpec {
            name: format!("base_frame.{axis}"),
            place: Place::Base,
            unit,
            tolerance: if unit == Unit::Radian { 1.0 } else { 10.0 },
        });
        axes.collect()
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn deflect(&self, _robot: &RobotModel, _state: &ArmState, p: &[f64], out: &mut Deflection) {
        for parameter in 0..6 {
            out.shift(parameter, p, 0, self.direction(parameter));
        }
    }
}

/// `tool_offset`: the measured point sits elsewhere on the tool; three parameters a target, base axes at the zero pose.
///
/// Where its orientation is measured too, three more turn a target about where it is mounted.
#[derive(Debug, Clone, Copy)]
pub struct ToolOffset;

/// How many parameters a target has.
fn width(target: &Target) -> usize {
    if target.oriented { 6 } else { 3 }
}

impl ToolOffset {
    /// What the names of a target's parameters begin with, dot included.
    pub fn prefix(target: &str) -> String {
        prefix(names::TOOL_OFFSET, target)
    }
}

impl Effect for ToolOffset {
    fn name(&self) -> &'static str {
        names::TOOL_OFFSET
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let targets: Vec<(&str, usize)> = match robot.setup().targets.as_slice() {
            [] => vec![("", 3)],
            targets => targets
                .iter()
                .map(|target| (target.name.as_str(), width(target)))
                .collect(),
        };
        let stated = tolerance(robot, Made::Tool);
        let all = targets.into_iter().flat_map(|(name, width)| {
            MOTION[..width]
                .iter()
                .map(move |(axis, unit, _)| ParameterSpec {
                    name: format!("{}{axis}", Self::prefix(name)),
                    place: Place::Tool,
                    unit: *unit,
                    // Where the recording places a target, nothing else says where it is.
                    tolerance: match name.is_empty() && *unit == Unit::Millimetre {
                        true => stated,
                        false => PLACED,
                    },
                })
        });
        all.collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let targets = &robot.setup().targets;
        let number = state.target(robot);
        if number.is_none() && !targets.is_empty() {
            return;
        }
        let first: usize = targets
            .iter()
            .take(number.unwrap_or_default())
            .map(width)
            .sum();
        for axis in 0..3 {
            out.shift(first + axis, p, robot.joints(), Twist::ith(axis, 1.0));
        }
        if let Some(target) = number
            .and_then(|number| targets.get(number))
            .filter(|target| target.oriented)
        {
            for axis in 0..3 {
                let turn = screw(&Vector3::ith(axis, 1.0), &target.mounting.translation);
                out.shift(first + 3 + axis, p, robot.joints(), turn);
            }
        }
    }
}

/// A parameter of each joint.
fn of_joints(
    effect: &str,
    robot: &RobotModel,
    tolerance: f64,
    unit: impl Fn(usize) -> Unit,
) -> Vec<ParameterSpec> {
    let spec = |joint: usize| ParameterSpec {
        name: format!("{effect}.j{}", joint + 1),
        place: Place::Joint(joint),
        unit: unit(joint),
        tolerance,
    };
    (0..robot.joints()).map(spec).collect()
}

/// Zero error of joint N, theta_i0 of Eq. 14; one parameter a joint.
pub(super) struct JointOffset;

impl Effect for JointOffset {
    fn name(&self) -> &'static str {
        names::JOINT_OFFSET
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let zero = tolerance(robot, Made::Zero);
        of_joints(names::JOINT_OFFSET, robot, zero, |joint| {
            if robot.is_revolute(joint) {
                Unit::Radian
            } else {
                Unit::Millimetre
            }
        })
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
        let ratio = tolerance(robot, Made::Ratio);
        of_joints(names::REDUCTION_RATIO, robot, ratio, |_| Unit::One)
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
        let tolerance = tolerance(robot, Made::Coupling);
        let spec = |place: Place| ParameterSpec {
            name: format!("coupling_ratio.{}", place.tag()),
            place,
            unit: Unit::One,
            tolerance,
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

/// Covariance of where each joint's axis stands against the one before, m2, base axes at the zero pose. What moves an axis along itself moves
/// the next one, and has no parameter of its own: it is handed on.
fn length_variances(robot: &RobotModel) -> Vec<Matrix3<f64>> {
    let mut handed_on = Matrix3::zeros();
    let each = (0..robot.joints()).map(|joint| {
        let before = match joint {
            0 => robot.point(joint),
            _ => robot.point(joint - 1),
        };
        let length = (robot.point(joint) - before).norm();
        let stated = robot.description().tolerances.contains_key(&Made::Length);
        let by_length = if stated {
            0.0
        } else {
            LENGTH_BY_LENGTH * length
        };
        let tolerance = tolerance(robot, Made::Length).max(by_length);
        // Where the first axis stands is a matter of the base.
        let made = if joint == 0 {
            0.0
        } else {
            tolerance * tolerance
        };
        let all = Matrix3::from_diagonal_element(made) + handed_on;
        handed_on = match robot.is_revolute(joint) {
            true => {
                let axis = robot.axis(joint);
                axis * axis.transpose() * axis.dot(&(all * axis))
            }
            false => all,
        };
        all
    });
    each.collect()
}

impl Effect for LinkGeometry {
    fn name(&self) -> &'static str {
        names::LINK_GEOMETRY
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let mut out = Vec::new();
        let tilts = tolerance(robot, Made::Axis);
        for (link, lengths) in length_variances(robot).iter().enumerate().skip(1) {
            for (axis, tilt, twist) in directions(robot, link) {
                let along = twist.fixed_rows::<3>(0).into_owned();
                let length = along.dot(&(lengths * along)).sqrt();
                let letter = ['x', 'y', 'z'][axis];
                out.push(ParameterSpec {
                    name: format!(
                        "link_geometry.l{link}.{}{letter}",
                        if tilt { "r" } else { "" }
                    ),
                    place: Place::Links(link - 1, link - 1),
                    unit: if tilt { Unit::Radian } else { Unit::Millimetre },
                    tolerance: if tilt { tilts } else { length },
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
