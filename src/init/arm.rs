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
    pub(crate) fn of(request: &InitRequest) -> Result<Self> {
        let file = request.folder.join("robot.yaml");
        if file.exists() {
            return Self::there(request, &file);
        }
        let Some(urdf) = request.urdf else {
            return Self::to_start_from(
                request.robot.unwrap_or(RobotFileKind::Typical(&TYPICAL[0])),
            );
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
        let sliding_joints = counted(sliding.len(), "joint");
        Ok(Self {
            text: None,
            joints: sliding.len(),
            sliding,
            counting: read.about.counting(),
            notes: Vec::new(),
            other: (
                "robot.yaml",
                format!(
                    "{label} has {sliding_joints}, the recording {{}}; put the robot of the recording there"
                ),
            ),
        })
    }

    fn to_start_from(kind: RobotFileKind) -> Result<Self> {
        let (joints, name) = (kind.joints()?, kind.name());
        Ok(Self {
            text: Some(kind.text().into()),
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
            let name = &self.stated[column];
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
        let numeric = (0..self.stated.len()).filter(|column| self.sheet.is_numeric(*column));
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
            let unit = self.stated[best[0]].unit_of(&["Nm"]);
            let effort = self.stated[best[0]]
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
            let unit = self.stated[best[0]].unit_of(&["A", "mA"]);
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
            let is_stated = |unit: &str| self.stated[best[0]].words.iter().any(|word| word == unit);
            let named = is_stated("deg") || is_stated("rad");
            let unit = if is_stated("deg") || (degrees && !named) {
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
        let trajectories = |column: &usize| lists(TRAJECTORIES, &self.stated[*column].stem());
        let trajectories: Vec<usize> = (0..self.stated.len()).filter(trajectories).collect();
        self.map("trajectory", &trajectories, None, None);
    }

    fn drive(&mut self, quantity: &'static str, rows: &[Vec<usize>], unit: &str, check: Vec<&str>) {
        let checks = check.into_iter().map(String::from);
        self.propose_joints(quantity, rows, Some(unit), checks, quantity);
    }
}

/// What a robot file starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RobotFileKind {
    /// A typical arm, whose numbers are to be replaced.
    Typical(&'static TypicalArm),
    /// An arm of the library, as it is.
    Arm(&'static LibraryArm),
}

/// A robot file with the numbers of a typical arm.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct TypicalArm {
    pub(crate) name: &'static str,
    pub(crate) help: &'static str,
    pub(crate) text: &'static str,
}

/// The first is that of `calib init` without `--robot`.
pub(crate) const TYPICAL: &[TypicalArm] = &[
    TypicalArm {
        name: "spherical6",
        help: "Six joints, the last three axes meet in a point (most industrial arms)",
        text: include_str!("robots/spherical6.yaml"),
    },
    TypicalArm {
        name: "offset6",
        help: "Six joints, offset wrist (most cobots)",
        text: include_str!("robots/offset6.yaml"),
    },
    TypicalArm {
        name: "seven",
        help: "Seven joints, alternating axes",
        text: include_str!("robots/seven.yaml"),
    },
    TypicalArm {
        name: "dh6",
        help: "Six joints as a table of DH parameters",
        text: include_str!("robots/dh6.yaml"),
    },
];

impl RobotFileKind {
    /// By its name on the command line.
    pub(crate) fn find(name: &str) -> Option<Self> {
        let typical = TYPICAL.iter().find(|arm| arm.name == name);
        let library = || LibraryArm::find(name).map(Self::Arm);
        typical.map(Self::Typical).or_else(library)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Typical(arm) => arm.name,
            Self::Arm(arm) => arm.name,
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::Typical(arm) => arm.text,
            Self::Arm(arm) => arm.text,
        }
    }

    fn joints(self) -> Result<usize> {
        match self {
            Self::Typical(arm) => Ok(arm.text.matches("\n  - {name: ").count()),
            Self::Arm(arm) => Ok(arm.read()?.robot.joints.len()),
        }
    }

    /// How the arm's controller counts its joints, as settings of `q`, where it differs from the robot file.
    fn counting(self) -> Result<Option<String>> {
        match self {
            Self::Typical(_) => Ok(None),
            Self::Arm(arm) => Ok(arm.read()?.about.counting()),
        }
    }
}

/// A robot file on a URDF.
fn of_urdf(base: &str, tip: &str) -> String {
    let text = include_str!("robots/urdf.yaml").replace("$base", &quoted(base));
    text.replace("$tip", &quoted(tip))
}
