//! What the user believes of the arm that moves: axes, masses, tolerances, in the base frame at zero pose, SI.

use nalgebra::{Matrix3, Point3, Vector3};

/// Mass, centre and inertia of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// kg.
    pub mass: f64,
    /// m, base frame at zero pose.
    pub centre: Point3<f64>,
    /// kg m^2 about the centre, base axes at zero pose.
    pub inertia: Matrix3<f64>,
}

/// How far declared inertials may be off without being a finding: one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertialTolerance {
    /// Tolerance of a mass, as a share of it.
    pub mass_relative: f64,
    /// Tolerance of each coordinate of a centre, m.
    pub centre: f64,
    /// Tolerance of an inertia, as a share of its largest diagonal element.
    pub inertia_relative: f64,
}

/// The declared arm.
#[derive(Debug, Clone, PartialEq)]
pub struct DynamicArm {
    /// Unit vectors of the joint axes, length n.
    pub axes: Vec<Vector3<f64>>,
    /// A point on each axis, m, length n.
    pub points: Vec<Point3<f64>>,
    /// Whether a joint slides instead of turning, length n.
    pub prismatic: Vec<bool>,
    /// The tool point, m.
    pub tool: Point3<f64>,
    /// Bodies of the links, length n; `None` where nothing is declared: then the base parameters are identified.
    pub links: Option<Vec<Inertial>>,
    /// The declared payload; `None` for none.
    pub payload: Option<Inertial>,
    /// m/s^2, base frame: (0, 0, -9.81) for an arm on the floor.
    pub gravity: Vector3<f64>,
    /// Turns of the motor per turn of the joint, length n.
    pub ratio: Vec<f64>,
    /// Pairs (moved, by) of joints, from 0, whose gears are known to be coupled.
    pub coupled: Vec<(usize, usize)>,
    /// Tolerance of links, and of last link and payload together.
    pub tolerance: InertialTolerance,
}

impl DynamicArm {
    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.axes.len()
    }
}
