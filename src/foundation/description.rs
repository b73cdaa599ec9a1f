//! The robot as plain data, in SI and at its zero pose in the base frame: the one thing that estimator and twin share.

use crate::units::Unit;
use std::collections::BTreeMap;

/// What a joint does along its axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis; position in rad.
    Revolute,
    /// Slides along its axis; position in m.
    Prismatic,
}

/// One joint and the body (link) that it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct JointDescription {
    /// As people and files call it.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Unit vector along the axis, zero pose, base frame.
    pub axis: [f64; 3],
    /// A point on the axis, m, zero pose, base frame.
    pub point: [f64; 3],
    /// Travel, rad or m.
    pub limits: Option<[f64; 2]>,
    /// Motor turns per turn of the joint; of one that slides, rad of the motor per m.
    pub reduction_ratio: Option<f64>,
    /// Torque at the motor per ampere, Nm/A.
    pub motor_constant: Option<f64>,
    /// Mass of the body moved by this joint, kg, and its centre, m, zero pose, base frame.
    pub mass: Option<f64>,
    /// Centre of mass of its link, m, base frame at the zero pose.
    pub centre: Option<[f64; 3]>,
    /// Friction that turns with the direction of motion, Nm at the joint (N of one that slides), where torques of the arm have shown it.
    pub coulomb: Option<f64>,
}

/// Joint `moved` turns by `ratio` times the angle of joint `by` (both from 0), as the controller believes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Joint that moves, from 0.
    pub moved: usize,
    /// Joint that moves it, from 0.
    pub by: usize,
    /// Travel of `moved` for each unit of travel of `by`.
    pub ratio: f64,
}

/// Moments of inertia about a body's centre of mass, kg m2, base axes at the zero pose: xx, xy, xz, yy, yz, zz (tensor elements).
pub type InertiaMoments = [f64; 6];

/// How far declared masses may be off without being a finding: one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassTolerance {
    /// Tolerance of a mass, as a share of it.
    pub mass: f64,
    /// Tolerance of each coordinate of a centre, m.
    pub centre: f64,
    /// Tolerance of an inertia, as a share of it.
    pub inertia: f64,
}

/// What is declared of the bodies beyond masses and centres, for an arm whose torques are simulated.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DeclaredInertias {
    /// Inertias of each link; empty, or one for each joint.
    pub links: Vec<Option<InertiaMoments>>,
    /// Inertia of the payload.
    pub payload: Option<InertiaMoments>,
    /// Tolerance of links, and of last link and payload together.
    pub tolerance: Option<MassTolerance>,
}

/// What of an arm is made with a tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Made {
    /// The length and offset of a link, m.
    Length,
    /// The tilt of an axis, rad.
    Axis,
    /// The zero of a joint, rad (of one that slides: m).
    Zero,
    /// Each coordinate of the tool point, m.
    Tool,
    /// A reduction ratio, as a share of it.
    Ratio,
    /// The ratio of a coupling.
    Coupling,
    /// The compliance of a joint, rad/Nm.
    Compliance,
}

impl Made {
    /// All with the names of robot files and the units in which tables hold them.
    pub const ALL: [(Self, &'static str, Unit); 7] = [
        (Self::Length, "length", Unit::Millimetre),
        (Self::Axis, "axis", Unit::Radian),
        (Self::Zero, "zero", Unit::Radian),
        (Self::Tool, "tool", Unit::Millimetre),
        (Self::Ratio, "ratio", Unit::One),
        (Self::Coupling, "coupling", Unit::One),
        (Self::Compliance, "compliance", Unit::RadianPerNewtonMetre),
    ];
}

/// A serial robot: joints from the base to the tool.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotDescription {
    /// As people and files call it.
    pub name: String,
    /// From base to tool.
    pub joints: Vec<JointDescription>,
    /// The measured point, m, zero pose, base frame.
    pub tool: [f64; 3],
    /// Orientation of the tool frame at the zero pose, row-major.
    pub tool_rotation: [[f64; 3]; 3],
    /// What the controller believes of joints that move each other.
    pub couplings: Vec<Coupling>,
    /// Rated payload, kg; a recording says how much of it was on in each row.
    pub payload_mass: f64,
    /// Centre of the payload, m, zero pose, base frame.
    pub payload_centre: [f64; 3],
    /// Acceleration of gravity in the base frame, m/s2.
    pub gravity: [f64; 3],
    /// Inertias of the bodies, as far as they are declared.
    pub inertias: DeclaredInertias,
    /// How far from nominal it is made where the file says so, one standard deviation, SI.
    pub tolerances: BTreeMap<Made, f64>,
}
