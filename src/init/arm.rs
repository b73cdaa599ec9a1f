//! The arm that a recording is of: a file that is there already, a URDF, or a kind to start from.

use crate::description::JointKind;
use crate::error::{Error, Result, counted};
use crate::init::InitRequest;
use crate::init::columns::{Choice, ExaminedFile};
use crate::init::names::{
    CURRENTS, NAMED_JOINTS, Name, TORQUES, TRAJECTORIES, VELOCITIES, WANTED, lists, numbered,
};
use crate::raw;
use crate::robot::LibraryArm;
use crate::robot::import::{
    Imported, RobotFileText, UrdfOutline, read_calib, read_case, urdf_outline,
};
use crate::yaml::quoted;
use std::path::Path;

/// What recordings and pipeline must know of the arm.
pub(super) struct StartingArm {
    /// Text of its robot file; none where the folder has one.
    pub(crate) text: Option<String>,
    /// The file, as settings of the stage `robot`.
    pub(crate) file: &'static RobotFile,
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

/// A robot file of a folder.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct RobotFile {
    /// Its name.
    pub(crate) name: &'static str,
    /// As settings of the stage `robot`.
    settings: &'static str,
}

/// The file that is written, and that is used where it is there.
pub(crate) static ROBOT_YAML: RobotFile = RobotFile {
    name: "robot.yaml",
    settings: "file: robot.yaml",
};
/// What simulations and the folders of `pipelines/case` and `pipelines/dynamics` have in its place.
static ROBOT_JSON: RobotFile = RobotFile {
    name: "robot.json",
    settings: "file: robot.json, format: case",
};

impl StartingArm {
    /// Fails where a file cannot be read, or is there and another arm is asked for.
    pub(crate) fn of(request: &InitRequest) -> Result<Self> {
        for file in [&ROBOT_YAML, &ROBOT_JSON] {
            if request.folder.join(file.name).exists() {
                return Self::there(request, file);
            }
        }
        let Some(urdf) = request.urdf else {
            return Self::to_start_from(request.robot.unwrap_or(&TYPICAL[0].0));
        };
        let (label, text) = read(urdf)?;
        let UrdfOutline {
            base,
            sliding,
            notes,
        } = urdf_outline(file_text(&label, &text), request.tip)?;
        let other = format!(
            "the chain from `{base}` to `{}` has {}, the recording {{}}; name the last link that moves, or one fixed to it",
            request.tip,
            counted(sliding.len(), "joint")
        );
        Ok(Self {
            text: Some(of_urdf(&base, request.tip)),
            file: &ROBOT_YAML,
            joints: sliding.len(),
            sliding,
            counting: None,
            notes,
            other: ("--tip", other),
        })
    }

    fn there(request: &InitRequest, file: &'static RobotFile) -> Result<Self> {
        let (label, text) = read(&request.folder.join(file.name))?;
        let is_yaml = *file == ROBOT_YAML;
        if request.robot.is_some() || (request.urdf.is_some() && !is_yaml) {
            return Err(Error::spec(
                label,
                "is already there and would be used: leave out --robot and --urdf, or move the file away",
            ));
        }
        let urdf = request.urdf.map(read).transpose()?;
        let urdf = urdf.as_ref().map(|(label, text)| file_text(label, text));
        let read: Imported = match is_yaml {
            true => read_calib(file_text(&label, &text), urdf)?,
            false => read_case(file_text(&label, &text))?,
        };
        let joints = read.robot.joints.iter();
        let sliding: Vec<bool> = joints
            .map(|joint| joint.kind == JointKind::Prismatic)
            .collect();
        let other = format!(
            "{label} has {}, the recording {{}}; put the robot of the recording there",
            counted(sliding.len(), "joint")
        );
        Ok(Self {
            text: None,
            file,
            joints: sliding.len(),
            sliding,
            counting: read.about.counting(),
            notes: Vec::new(),
            other: (file.name, other),
        })
    }

    fn to_start_from(arm: &LibraryArm) -> Result<Self> {
        let read = arm.read()?;
        let joints = read.robot.joints.len();
        let other = format!(
            "{} has {}, the recording {{}}; choose another kind",
            arm.name,
            counted(joints, "joint")
        );
        Ok(Self {
            text: Some(arm.text.into()),
            file: &ROBOT_YAML,
            joints,
            sliding: Vec::new(),
            counting: read.about.counting(),
            notes: Vec::new(),
            other: ("--robot", other),
        })
    }

    /// Settings of the stage `robot`, with the URDF that a robot file refers to.
    pub(crate) fn settings(&self, urdf: &str) -> String {
        format!("{{{}{urdf}}}", self.file.settings)
    }

    /// Fails unless a recording has as many joints.
    pub(crate) fn agrees(&self, joints: usize) -> Result<()> {
        let (place, message) = &self.other;
        let message = message.replace("{}", &joints.to_string());
        let agrees = joints == self.joints;
        agrees
            .then_some(())
            .ok_or_else(|| Error::spec(*place, message))
    }
}

fn file_text<'t>(label: &'t str, text: &'t str) -> RobotFileText<'t> {
    RobotFileText { label, text }
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
const EXPECTED: &str =
    "by its name what the controller's own model expects; is it the measured torque at the joint?";
const MODELLED: &str = "what the controller's own model expects: what it lacks is looked for; leave the line out to hold the declared masses against the torques";
const BY_CONSTANTS: &str =
    "a torque by reduction_ratio and motor_constant (Nm/A) of each joint in the robot file";
const EFFORT: &str = "drivers of ROS state torques or motor currents as effort";

/// A robot file whose measured point needs no look: no torque depends on it.
pub(super) fn without_point(text: &str) -> String {
    let line = |line: &str| match line.split_once("   # REPLACE") {
        Some((tool, _)) if tool.starts_with("tool:") => tool.to_string(),
        _ => line.to_string(),
    };
    text.lines().map(|one| line(one) + "\n").collect()
}

/// Whether the recordings are of torques: each has times, joints, and what drives them, and none has points. Then they are mapped as such.
pub(super) fn of_torques(found: &mut [ExaminedFile]) -> bool {
    let driven = |file: &ExaminedFile, listed| !file.by_joint(listed).is_empty();
    let fits = |file: &ExaminedFile| {
        let moves = file.has("q") && file.has("time") && !file.has("x");
        moves && (file.has("torque") || driven(file, TORQUES) || driven(file, CURRENTS))
    };
    let all = !found.is_empty() && found.iter().all(fits);
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
        let joint = self.get("q").map(|joints| joints.choices[0].columns[0]);
        let own = joint.and_then(|column| Some(self.stated[column].joint()?.1));
        // Numbers of motors on a bus begin anywhere.
        let joints = self.get("q").into_iter();
        let joints = joints.flat_map(|joints| &joints.choices[0].columns);
        let numbers: Vec<usize> = joints
            .filter_map(|column| Some(self.stated[*column].joint()?.1))
            .collect();
        let on_bus = |(key, number): (String, usize)| match own {
            Some(first) if first > 1 && numbers.len() == count => {
                let place = numbers.iter().position(|one| *one == number);
                Some((key, place? + 1))
            }
            _ => Some((key, number)),
        };
        let part = |column: usize| {
            let (name, joints) = (&self.stated[column], NAMED_JOINTS[2]);
            let stem = name.stem();
            match joints.iter().position(|joint| stem.contains(joint)) {
                Some(joint) => Some((stem.replace(joints[joint], "#"), joint)),
                // One joint has no number, or that of its motor on a bus.
                None if count == 1 => match name.joint() {
                    Some((key, number)) if own == Some(number) => Some((key, 0)),
                    numbered => Some(numbered.unwrap_or((stem, 0))),
                },
                None => name.joint().and_then(on_bus),
            }
        };
        let has = |key: &str, list| key.split(['_', '#']).any(|word| lists(list, word));
        let is_meant = |key: &str| {
            let mut others = others.iter().filter(|other| **other != listed);
            has(key, listed) && !others.any(|other| has(key, other))
        };
        let numeric = (0..self.stated.len()).filter(|column| self.sheet.is_numeric(*column));
        let parts = numeric.filter_map(|column| Some((column, part(column)?)));
        let runs = numbered(parts.filter(|(_, (key, _))| is_meant(key)));
        let mut rows: Vec<(bool, Vec<usize>)> = runs
            .into_iter()
            .filter(|(_, run)| run.len() >= count)
            .map(|(key, run)| (has(&key, WANTED), run[..count].to_vec()))
            .collect();
        rows.sort();
        rows.into_iter().map(|(_, run)| run).collect()
    }

    fn drives(&mut self) {
        // Columns without a header are mapped by their values.
        if self.has("torque") {
            return;
        }
        self.mappings
            .retain(|mapping| WITH_TORQUES.contains(&mapping.quantity));
        let [torques, currents, velocities] =
            [TORQUES, CURRENTS, VELOCITIES].map(|listed| self.by_joint(listed));
        let wanted = |name: &Name| name.words.iter().any(|word| lists(WANTED, word));
        let wanted: Vec<bool> = self.stated.iter().map(wanted).collect();
        let is_wanted = |columns: &Vec<usize>| wanted[columns[0]];
        // What a controller expects is no measurement, where it says what it measured.
        let mut measured = currents.iter().chain(&torques);
        let is_measured = measured.any(|columns| !is_wanted(columns));
        let (modelled, torques): (Vec<Vec<usize>>, Vec<Vec<usize>>) = torques
            .into_iter()
            .partition(|columns| is_measured && is_wanted(columns));
        if let Some(best) = modelled.first() {
            let is_stated = self.stated[best[0]].unit_of(&["Nm"]).is_some();
            self.drive("simulated", &modelled, "Nm", is_stated, Some(MODELLED));
        }
        let joints = self.get("q").map(|joints| &joints.choices[0].lines[0]);
        let degrees = joints.is_some_and(|line| line.contains("unit: deg"));
        if let Some(best) = torques.first() {
            let name = &self.stated[best[0]];
            let is_stated = name.unit_of(&["Nm"]).is_some();
            let effort = name.words.iter().any(|word| word.starts_with("effort"));
            let more = match (effort, is_wanted(best)) {
                (true, _) => EFFORT,
                (false, true) => EXPECTED,
                (false, false) => OF_MOTORS,
            };
            self.drive("torque", &torques, "Nm", is_stated, Some(more));
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
                unit.is_some(),
                Some(BY_CONSTANTS),
            );
            if !torques.is_empty() {
                self.drop("current", "torques are mapped; one of the two is used");
            }
        }
        if let Some(best) = velocities.first() {
            let has = |unit: &str| self.stated[best[0]].words.iter().any(|word| word == unit);
            let is_stated = has("deg") || has("rad");
            let unit = match has("deg") || (degrees && !is_stated) {
                true => "deg/s",
                false => "rad/s",
            };
            self.drive("velocity", &velocities, unit, is_stated, None);
        }
        let trajectories = |column: &usize| lists(TRAJECTORIES, &self.stated[*column].stem());
        let trajectories: Vec<usize> = (0..self.stated.len()).filter(trajectories).collect();
        self.map("trajectory", &trajectories, None, None);
    }

    fn drive(
        &mut self,
        quantity: &'static str,
        rows: &[Vec<usize>],
        unit: &str,
        is_stated: bool,
        more: Option<&str>,
    ) {
        let unstated = (!is_stated).then_some("the unit");
        let checks = unstated.into_iter().chain(more).map(String::from);
        self.propose_joints(quantity, rows, Some(unit), checks, quantity);
    }
}

macro_rules! typical {
    ($($name:literal $help:literal;)+) => {
        /// Robot files with the numbers of typical arms, which are to be replaced, each with its line of help. The first is that of `calib init`
        /// without `--robot`.
        pub(crate) const TYPICAL: &[(LibraryArm, &str)] =
            &[$((LibraryArm { name: $name, text: include_str!(concat!("robots/", $name, ".yaml")) }, $help)),+];
    };
}

typical! {
    "spherical6" "Six joints, the last three axes meet in a point (most industrial arms)";
    "offset6" "Six joints, offset wrist (most cobots)";
    "seven" "Seven joints, alternating axes";
    "dh6" "Six joints as a table of DH parameters";
}

/// The typical arm of that name.
pub(crate) fn typical(name: &str) -> Option<&'static LibraryArm> {
    TYPICAL
        .iter()
        .map(|(arm, _)| arm)
        .find(|arm| arm.name == name)
}

/// A robot file on a URDF.
fn of_urdf(base: &str, tip: &str) -> String {
    let text = include_str!("robots/urdf.yaml").replace("$base", &quoted(base));
    text.replace("$tip", &quoted(tip))
}
