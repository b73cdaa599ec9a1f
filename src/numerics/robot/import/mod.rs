//! Robot files -> [`RobotDescription`]: calib's own YAML (screws, DH, modified DH, or a URDF beside it) and the practice layout.
//!
//! Every format ends in one chain at the zero pose in the base frame. All faults of a file are reported at once, each with
//! its line and its path (`robot.yaml:12:5: joints[2].limits`, counted from 0 as in the YAML), a URDF with its line alone.

pub use calib::read as read_calib;
pub use case::read as read_case;
pub use inertia::impossible_inertia;
pub use urdf::{UrdfOutline, controller_base, outline as urdf_outline};

use crate::description::{InertiaMoments, JointKind, RobotDescription};
use crate::robot::{Bound, CountedCoupling};
use crate::spatial::Pose;
use crate::units::Unit;
use nalgebra::{Isometry3, Point3, Vector3};

mod calib;
mod case;
mod inertia;
mod kinematics;
mod place;
mod tolerances;
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

impl<'a> RobotFileText<'a> {
    /// A content under the name by which messages call it.
    pub fn new(label: &'a str, text: &'a str) -> Self {
        Self { label, text }
    }
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
    /// The frame in which its kinematics end, zero pose, base frame, m; none where they know no such frame (screws).
    pub flange: Option<Pose>,
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

impl ChainJoint {
    /// A joint of which the format knows no more.
    fn new(kind: JointKind, axis: Vector3<f64>, point: Point3<f64>) -> Self {
        Self {
            name: None,
            kind,
            axis,
            point,
            limits: None,
            frame: None,
            body: None,
        }
    }
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
fn gravity(value: DocumentNode) -> [f64; 3] {
    let gravity = value.vector();
    let size = Vector3::from(gravity).norm();
    if size != 0.0 && !size.is_nan() && !GRAVITY_RANGE.contains(&size) {
        value.fault(format!(
            "is {size} m/s2 long; expected about 9.81 m/s2, or [0, 0, 0] for none"
        ));
    }
    gravity
}

/// The map `about` of a robot file: where its numbers are from, and how its maker's controller counts joints. Nothing is computed from it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// As the maker publishes it, m.
    pub reach: Option<f64>,
    /// Where the numbers are from.
    pub(crate) sources: Vec<String>,
    /// What is left out or differs between sources, a sentence each.
    pub(crate) notes: Vec<String>,
    /// Joints that the controller reports with a part of another one, as `coupled` of `ingest` has them.
    pub coupled: Vec<CountedCoupling>,
}

impl About {
    /// What the settings of `ingest` must state of the controller's counting, as settings of `q`; none where it counts as the robot file does.
    pub fn counting(&self) -> Option<String> {
        let one = |c: &CountedCoupling| {
            format!(
                "{{joint: {}, by: {}, ratio: {}}}",
                c.joint + 1,
                c.by + 1,
                c.ratio
            )
        };
        let all: Vec<String> = self.coupled.iter().map(one).collect();
        (!all.is_empty()).then(|| format!("coupled: [{}]", all.join(", ")))
    }
}

fn about(value: DocumentNode, joints: usize, length: Unit) -> About {
    if value.given().is_none() {
        return About::default();
    }
    let value = value.map(&["reach", "sources", "notes", "counting"]);
    let texts = |key: &str| {
        let list = value.opt(key);
        let texts = list.iter().flat_map(DocumentNode::items);
        texts.map(|text| text.text()).collect()
    };
    let coupled = value.opt("counting").map_or_else(Vec::new, |counting| {
        let list = counting.map(&["coupled"]).get("coupled").items();
        list.into_iter()
            .filter_map(|one| coupling(one, joints))
            .collect()
    });
    let reach = value
        .opt("reach")
        .map(|reach| reach.sized(Bound::Length, length));
    About {
        reach,
        sources: texts("sources"),
        notes: texts("notes"),
        coupled,
    }
}

fn coupling(value: DocumentNode, joints: usize) -> Option<CountedCoupling> {
    let value = value.map(&["joint", "by", "ratio"]);
    let ratio = value.get("ratio").sized(Bound::Factor, Unit::One);
    Some(CountedCoupling {
        joint: value.get("joint").joint(joints)?,
        by: value.get("by").joint(joints)?,
        ratio,
    })
}
