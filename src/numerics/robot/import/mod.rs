//! Robot files -> [`RobotDescription`]: calib's own YAML (screws, DH, modified DH, or a URDF beside it) and the practice layout.
//!
//! Every format ends in one chain at the zero pose in the base frame. All faults of a file are reported at once, each with
//! its line and its path (`robot.yaml:12:5: joints[2].limits`, counted from 0 as in the YAML), a URDF with its line alone.

pub use about::About;
pub use calib::read as read_calib;
pub use case::read as read_case;
pub use inertia::impossible_inertia;
pub use urdf::{UrdfOutline, outline as urdf_outline};

use crate::description::{InertiaMoments, JointKind, RobotDescription};
use nalgebra::{Isometry3, Point3, Vector3};

mod about;
mod calib;
mod case;
mod dh;
mod inertia;
mod place;
mod screws;
mod urdf;

use place::DocumentNode;

/// A file's content and the name by which messages call it.
#[derive(Debug, Clone, Copy)]
pub struct RobotFileText<'a> {
    /// Names the text in errors.
    pub label: &'a str,
    /// YAML, URDF or JSON.
    pub text: &'a str,
}

/// A robot and what its reader wants to tell the person, e.g. keys that were not used.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The robot as it is described.
    pub robot: RobotDescription,
    /// What a person should know of how it was read, a sentence each.
    pub notes: Vec<String>,
    /// What the file says of itself.
    pub about: About,
}

/// What every kinematic format is converted to: joints and frames at the zero pose in the base frame, SI.
struct FrameChain {
    joints: Vec<ChainJoint>,
    /// The frame in which the file's `tool` is given: the base for screws, the last link or tip otherwise.
    tip: Isometry3<f64>,
    /// What a person should know of how it was read.
    notes: Vec<String>,
}

struct ChainJoint {
    name: Option<String>,
    kind: JointKind,
    axis: Vector3<f64>,
    point: Point3<f64>,
    /// rad or m.
    limits: Option<[f64; 2]>,
    /// The frame of the moved link; none where the format knows no link frames.
    frame: Option<Isometry3<f64>>,
    /// The moved body where the format knows it.
    body: Option<ChainBody>,
}

/// Mass, kg, centre, and moments about it in base axes where all parts of the body state them.
struct ChainBody {
    mass: f64,
    centre: Point3<f64>,
    inertia: Option<InertiaMoments>,
}

/// m/s2, downwards along z, where a file says nothing.
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];
/// m/s2; no robot works where gravity is outside (zero, for "none", is allowed): it catches mm/s2 and g.
const GRAVITY_RANGE: std::ops::Range<f64> = 1.0..30.0;

/// Gravity of a file, m/s2, base frame.
fn gravity(value: &DocumentNode) -> [f64; 3] {
    let gravity = value.vector();
    let size = Vector3::from(gravity).norm();
    if size != 0.0 && !size.is_nan() && !GRAVITY_RANGE.contains(&size) {
        value.fault(format!(
            "is {size} m/s2 long; expected about 9.81 m/s2, or [0, 0, 0] for none"
        ));
    }
    gravity
}
