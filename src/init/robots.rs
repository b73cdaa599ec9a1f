//! Robot files to start from: typical arms, every number of which the user replaces.

use crate::error::Result;
use crate::robot::LibraryArm;
use crate::yaml::quoted;

/// Kinds of arms that a robot file starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotFileKind {
    Spherical6,
    Offset6,
    Seven,
    Dh6,
    Arm(&'static LibraryArm),
}

/// Typical arms, in the order of the help.
pub const KINDS: [RobotFileKind; 4] = [
    RobotFileKind::Spherical6,
    RobotFileKind::Offset6,
    RobotFileKind::Seven,
    RobotFileKind::Dh6,
];

impl RobotFileKind {
    /// The typical arm or the arm of the library that is called so.
    pub(crate) fn find(name: &str) -> Option<Self> {
        let typical = KINDS.into_iter().find(|kind| kind.name() == name);
        typical.or_else(|| LibraryArm::find(name).map(Self::Arm))
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Spherical6 => "spherical6",
            Self::Offset6 => "offset6",
            Self::Seven => "seven",
            Self::Dh6 => "dh6",
            Self::Arm(arm) => arm.name,
        }
    }

    pub(crate) fn help(self) -> &'static str {
        match self {
            Self::Spherical6 => {
                "Six joints, the last three axes meet in a point (most industrial arms)"
            }
            Self::Offset6 => "Six joints, offset wrist (most cobots)",
            Self::Seven => "Seven joints, alternating axes",
            Self::Dh6 => "Six joints as a table of DH parameters",
            Self::Arm(_) => "A common arm, as its maker and public models describe it",
        }
    }

    /// How many. Fails with the faults of a file of the library, which would be a fault of calib.
    pub(crate) fn joints(self) -> Result<usize> {
        match self {
            Self::Arm(arm) => Ok(arm.read()?.robot.joints.len()),
            Self::Seven => Ok(7),
            _ => Ok(6),
        }
    }

    /// What `ingest` must be told of how the arm's controller counts joints, as settings of `q`.
    pub(super) fn counting(self) -> Result<Option<String>> {
        match self {
            Self::Arm(arm) => Ok(arm.read()?.about.counting()),
            _ => Ok(None),
        }
    }

    pub(super) fn text(self) -> String {
        let (kinematics, tool) = match self {
            Self::Arm(arm) => return arm.text.to_string(),
            Self::Spherical6 => (SPHERICAL6, "{point: [1854, 50, 1340]}"),
            Self::Offset6 => (OFFSET6, "{point: [-1184.3, -300, 11.6]}"),
            Self::Seven => (SEVEN, "{point: [60, 30, 1300]}"),
            Self::Dh6 => (DH6, "{point: [60, 0, 30]}"),
        };
        let where_given = if self == Self::Dh6 {
            "in the last frame"
        } else {
            "at the zero pose, base frame"
        };
        let mut out = format!(
            "{HEAD}{kinematics}tool: {tool}       # REPLACE: the measured point, {where_given}; off the last axis, else that joint cannot be seen\njoints:                           # REPLACE limits; reduction_ratio (motor turns per turn) only if known\n"
        );
        for joint in 1..=if self == Self::Seven { 7 } else { 6 } {
            out.push_str(&format!("  - {{name: A{joint}, limits: [-170, 170]}}\n"));
        }
        out + LINKS + PAYLOAD
    }
}

/// The robot file beside a URDF.
pub(super) fn of_urdf(base: &str, tip: &str) -> String {
    format!(
        "{HEAD}  urdf: {{base: {}, tip: {}}}     # CHECK: first and last link of the chain\ntool: {{point: [0, 0, 0]}}           # REPLACE: the measured point in the tip link's frame\n{URDF_LINKS}{PAYLOAD}",
        quoted(base),
        quoted(tip)
    )
}

const HEAD: &str =
    "# The robot as its data sheet describes it; calib identifies how the real one differs.
calib_robot: 1
name: my robot                    # REPLACE
units: {length: mm, angle: deg}   # of this file
kinematics:
";

const SPHERICAL6: &str =
    "  screws:                         # REPLACE: axis and a point on it, zero pose (all joints at 0), base frame
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, -1, 0], point: [312, 0, 0]}
    - {axis: [0, -1, 0], point: [312, 0, 1075]}
    - {axis: [1, 0, 0], point: [0, 0, 1310]}
    - {axis: [0, -1, 0], point: [1594, 0, 1310]}
    - {axis: [1, 0, 0], point: [0, 0, 1310]}
";
const OFFSET6: &str =
    "  screws:                         # REPLACE: axis and a point on it, zero pose (all joints at 0), base frame
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, -1, 0], point: [0, 0, 127.3]}
    - {axis: [0, -1, 0], point: [-612, 0, 127.3]}
    - {axis: [0, -1, 0], point: [-1184.3, 0, 127.3]}
    - {axis: [0, 0, -1], point: [-1184.3, -163.9, 127.3]}
    - {axis: [0, -1, 0], point: [-1184.3, -163.9, 11.6]}
";
const SEVEN: &str = "  screws:                         # REPLACE: axis and a point on it, zero pose (all joints at 0), base frame
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, 1, 0], point: [0, 0, 340]}
    - {axis: [0, 0, 1], point: [0, 0, 540]}
    - {axis: [0, -1, 0], point: [0, 0, 740]}
    - {axis: [0, 0, 1], point: [0, 0, 940]}
    - {axis: [0, 1, 0], point: [0, 0, 1140]}
    - {axis: [0, 0, 1], point: [0, 0, 1266]}
";
const DH6: &str = "  dh:                             # REPLACE: Rz(theta) Tz(d) Tx(a) Rx(alpha); `mdh` takes Craig's table
    - {theta: 0, d: 0, a: 312, alpha: 90}
    - {theta: 90, d: 0, a: 1075, alpha: 0}
    - {theta: 0, d: 0, a: 235, alpha: 90}
    - {theta: 0, d: 1282, a: 0, alpha: -90}
    - {theta: 0, d: 0, a: 0, alpha: 90}
    - {theta: 0, d: 260, a: 0, alpha: 0}
";

const URDF_LINKS: &str = "links:                            # CHECK: masses and centres are those of the URDF's <inertial>; where it has none, a line for each joint
#   - {mass: 340, centre: [150, 0, -120]}   # without them what weight does (wind-up, bending) is not in the model
";
const LINKS: &str = "links:                            # REPLACE: a line for each joint, kg and centre of the body that it moves, as below; null where not known
#   - {mass: 340, centre: [150, 0, -120]}   # without them what weight does (wind-up, bending) is not in the model
";
const PAYLOAD: &str = "# payload: {mass: 210, offset: [140, -30, 10]}     # rated, kg; from the tool point to its centre
";
