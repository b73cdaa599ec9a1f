//! The arm that a recording is of: a file that is there already, a URDF, or a kind to start from.
//!
//! What drives say of joints while the arm moves: torques or motor currents, velocities; and whether recordings are of them.
//!
//! Robot files to start from: typical arms, every number of which the user replaces.

use crate::description::JointKind;
use crate::error::{Error, Result, counted};
use crate::init::InitRequest;
use crate::init::columns::{Choice, ExaminedFile};
use crate::init::names::{
    CURRENTS, NAMED_JOINTS, TORQUES, TRAJECTORIES, VELOCITIES, WANTED, lists, numbered,
};
use crate::raw;
use crate::robot::LibraryArm;
use crate::robot::import::{RobotFileText, UrdfOutline, read_calib, urdf_outline};
use crate::yaml::quoted;
use std::path::Path;

/// What recordings and pipeline must know of the arm.
pub(super) struct StartingArm {
    /// Text of its robot file; none where the folder has one.
    pub(crate) text: Option<String>,
    pub(crate) joints: usize,
    /// Which of them slide, where one does.
    pub(crate) sliding: Vec<bool>,
    /// How its controller counts joints, as settings of `q`.
    pub(crate) counting: Option<String>,
    /// What a person should know of the robot, a sentence each.
    pub(crate) notes: Vec<String>,
    /// Where another number of joints is said, and how.
    other: (&'static str, String),
}

impl StartingArm {
    /// Fails where a file cannot be read, or is there and another arm is asked for.
    pub fn of(request: &InitRequest) -> Result<Self> {
        let file = request.folder.join("robot.yaml");
        if file.exists() {
            return Self::there(request, &file);
        }
        let Some(urdf) = request.urdf else {
            return Self::to_start_from(request.robot.unwrap_or(KINDS[0]));
        };
        let (label, text) = read(urdf)?;
        let UrdfOutline {
            base,
            sliding,
            notes,
        } = urdf_outline(
            RobotFileText {
                label: &label,
                text: &text,
            },
            request.tip,
        )?;
        let chain = format!(
            "the chain from `{base}` to `{}` has {}",
            request.tip,
            counted(sliding.len(), "joint")
        );
        Ok(Self {
            text: Some(of_urdf(&base, request.tip)),
            joints: sliding.len(),
            sliding,
            counting: None,
            notes,
            other: (
                "--tip",
                format!(
                    "{chain}, the recording {{}}; name the last link that moves, or one fixed to it"
                ),
            ),
        })
    }

    fn there(request: &InitRequest, file: &Path) -> Result<Self> {
        let (label, text) = read(file)?;
        if request.robot.is_some() {
            return Err(Error::spec(
                label,
                "is already there and would be used: leave out --robot, or move the file away",
            ));
        }
        let urdf = request.urdf.map(read).transpose()?;
        let urdf = urdf
            .as_ref()
            .map(|(label, text)| RobotFileText { label, text });
        let read = read_calib(
            RobotFileText {
                label: &label,
                text: &text,
            },
            urdf,
        )?;
        let sliding: Vec<bool> = read
            .robot
            .joints
            .iter()
            .map(|joint| joint.kind == JointKind::Prismatic)
            .collect();
        let own = counted(sliding.len(), "joint");
        Ok(Self {
            text: None,
            joints: sliding.len(),
            sliding,
            counting: read.about.counting(),
            notes: Vec::new(),
            other: (
                "robot.yaml",
                format!(
                    "{label} has {own}, the recording {{}}; put the robot of the recording there"
                ),
            ),
        })
    }

    fn to_start_from(kind: RobotFileKind) -> Result<Self> {
        let (joints, name) = (kind.joints()?, kind.name());
        Ok(Self {
            text: Some(kind.text()),
            joints,
            sliding: Vec::new(),
            counting: kind.counting()?,
            notes: Vec::new(),
            other: (
                "--robot",
                format!(
                    "{name} has {}, the recording {{}}; choose another kind",
                    counted(joints, "joint")
                ),
            ),
        })
    }

    /// Fails unless a recording has as many joints.
    pub(crate) fn agrees(&self, joints: usize) -> Result<()> {
        let (place, message) = &self.other;
        if joints == self.joints {
            Ok(())
        } else {
            Err(Error::spec(
                *place,
                message.replace("{}", &joints.to_string()),
            ))
        }
    }
}

fn read(path: &Path) -> Result<(String, String)> {
    let label = path.display().to_string();
    let text =
        raw::text(path).map_err(|error| Error::spec(&label, format!("cannot be read: {error}")))?;
    Ok((label, text))
}

/// What a recording of torques is read of, besides torques, currents and velocities.
const WITH_TORQUES: [&str; 4] = ["time", "q", "usage", "temperature"];
const OF_MOTORS: &str =
    "is it the torque at the joint? if at the motor: `torque_side: motor` next to `files`";
const EFFORT: &str = "drivers of ROS state torques or motor currents as effort";

/// Whether the recordings are of torques: each has times, joints, and what drives them, and none has points. Then they are mapped as such.
pub(super) fn of_torques(found: &mut [ExaminedFile]) -> bool {
    let driven = |file: &ExaminedFile| {
        !file.by_joint(TORQUES).is_empty() || !file.by_joint(CURRENTS).is_empty()
    };
    let moves = |file: &ExaminedFile| {
        file.get("x").is_none() && file.get("q").is_some() && file.get("time").is_some()
    };
    let all = !found.is_empty() && found.iter().all(|file| moves(file) && driven(file));
    if all {
        found.iter_mut().for_each(ExaminedFile::drives);
    }
    all
}

impl ExaminedFile {
    /// Columns of so many numbers as there are joints, under a name with one of these words; those that were measured first.
    fn by_joint(&self, listed: &str) -> Vec<Vec<usize>> {
        let Some(count) = self.get("q").map(|joints| joints.choices[0].columns.len()) else {
            return Vec::new();
        };
        let others = [TORQUES, CURRENTS, VELOCITIES];
        let part = |column: usize| {
            let name = &self.said[column];
            let named = || {
                let (stem, joints) = (name.stem(), NAMED_JOINTS[2]);
                let joint = joints.iter().position(|joint| stem.contains(joint))?;
                Some((stem.replace(joints[joint], "#"), joint))
            };
            named().or_else(|| name.joint())
        };
        let has = |key: &str, list| key.split(['_', '#']).any(|word| lists(list, word));
        let is_meant = |key: &str| {
            let mut others = others.iter().filter(|other| **other != listed);
            has(key, listed) && !others.any(|other| has(key, other))
        };
        let numeric = (0..self.said.len()).filter(|column| self.sheet.is_numeric(*column));
        let parts = numeric.filter_map(|column| Some((column, part(column)?)));
        let runs = numbered(parts.filter(|(_, (key, _))| is_meant(key))).into_iter();
        let mut rows: Vec<(bool, Vec<usize>)> = runs
            .filter(|(_, run)| run.len() >= count)
            .map(|(key, run)| (has(&key, WANTED), run[..count].to_vec()))
            .collect();
        rows.sort();
        rows.into_iter().map(|(_, run)| run).collect()
    }

    fn drives(&mut self) {
        self.mappings
            .retain(|mapping| WITH_TORQUES.contains(&mapping.quantity));
        let [torques, currents, velocities] =
            [TORQUES, CURRENTS, VELOCITIES].map(|listed| self.by_joint(listed));
        let degrees = self
            .get("q")
            .is_some_and(|joints| joints.choices[0].lines[0].contains("unit: deg"));
        if let Some(best) = torques.first() {
            let unit = self.said[best[0]].unit_of(&["Nm"]);
            let effort = self.said[best[0]]
                .words
                .iter()
                .any(|word| word.starts_with("effort"));
            let check = [
                unit.is_none().then_some("the unit"),
                Some(if effort { EFFORT } else { OF_MOTORS }),
            ];
            self.drive(
                "torque",
                &torques,
                "Nm",
                check.into_iter().flatten().collect(),
            );
            if let (true, Some(mapping)) = (effort, self.mappings.last_mut()) {
                let as_current = |line: &String| {
                    line.replacen("torque:", "current:", 1)
                        .replace("unit: Nm", "unit: A")
                };
                let lines = mapping.choices[0].lines.iter().map(as_current).collect();
                mapping.choices.push(Choice::of(lines, best.clone()));
            }
        }
        if let Some(best) = currents.first() {
            let unit = self.said[best[0]].unit_of(&["A", "mA"]);
            self.drive(
                "current",
                &currents,
                unit.unwrap_or("A"),
                unit.is_none().then_some("the unit").into_iter().collect(),
            );
            if !torques.is_empty() {
                self.drop("current", "torques are mapped; one of the two is used");
            }
        }
        if let Some(best) = velocities.first() {
            let said = |unit: &str| self.said[best[0]].words.iter().any(|word| word == unit);
            let named = said("deg") || said("rad");
            let unit = if said("deg") || (degrees && !named) {
                "deg/s"
            } else {
                "rad/s"
            };
            self.drive(
                "velocity",
                &velocities,
                unit,
                (!named).then_some("the unit").into_iter().collect(),
            );
        }
        let trajectories = |column: &usize| lists(TRAJECTORIES, &self.said[*column].stem());
        let trajectories: Vec<usize> = (0..self.said.len()).filter(trajectories).collect();
        self.map("trajectory", &trajectories, None, None);
    }

    fn drive(&mut self, quantity: &'static str, rows: &[Vec<usize>], unit: &str, check: Vec<&str>) {
        let checks = check.into_iter().map(String::from);
        self.propose_joints(quantity, rows, Some(unit), checks, quantity);
    }
}

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
