//! `diagnose_drives`: which physics the simulation of commanded joints lacks, from commands and measured angles alone.

mod reading;
mod recorded;

pub use reading::short;

use crate::drives::chain::{Bodies, Chain};
use crate::drives::mjcf::{self, MjcfArm, MjcfText};
use crate::drives::physics::{Joint, Physics};
use crate::drives::{CAUSES, Drives, diagnose};
use crate::dynamics::InertialTolerance;
use crate::engine::Options;
use crate::error::{Error, Fault, Place, Result, did_you_mean, listed};
use crate::raw::{DecimalMark, Delimiter, TextLayout};
use crate::table::{
    DriveCourse, DriveSimulation, DriveVerdict, FindingNumbers, Findings, JointDrives, Rivals,
    VerdictSentences,
};
use crate::{Context, RawFile, Stage};
use recorded::Source;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

// Bytes: a million rows of six joints are 200 MB.
const MOST_BYTES: u64 = 1 << 30;

/// Causes a joint at most.
const MOST_A_JOINT: usize = 3;
/// Cells of one name and place that are tried: load friction by the drive's torque or by the gear's, waves of two lengths.
const FORMS: usize = 2;
/// Trials that are fitted to the end before one joins: limits and friction that sticks are far from linear.
const LAST: usize = 2;

/// Settings of `diagnose_drives`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiagnoseDrives {
    /// The robot as it is simulated, an MJCF.
    pub robot: RawFile,
    /// Files that the MJCF includes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub includes: Vec<RawFile>,
    /// Gains, limits, encoders and the rate of the commands, JSON: `command_rate_hz`, `joints: [{joint, kp, kd, kd_on, torque_limit_nm,
    /// encoder_rad, noise_rad}]`, `inertia_tolerance: {mass_rel, com_mm, inertia_rel}`.
    pub drives: RawFile,
    /// Commands and measured angles over time, a table of any kind (CSV, Parquet with lists, npz, workbook); or a list of such recordings, which are fitted together. A pattern stands for all files
    /// that match.
    pub recording: DriveRecordings,
    /// The commands of one recording, where they are in a file of their own on the same clock: each holds until the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commands: Option<RawFile>,
    /// How recordings of text are written; without it commas stand between fields, and a header on the first line.
    #[serde(default, skip_serializing_if = "DriveText::is_default")]
    pub text: DriveText,
    /// Columns of the recording.
    #[serde(default)]
    pub columns: DriveColumns,
    /// Labels of `usage` to fit; all other rows judge.
    #[serde(default = "crate::fit_set")]
    pub on: Vec<String>,
    /// Rows that judge of those that would be fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hold_out: Option<DriveHoldOut>,
    /// Causes that are not tried and never named.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
}

/// One recording or several.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a file, or a list of files or of `{file: ..., commands: ..., usage: ...}`"
)]
pub enum DriveRecordings {
    /// A file.
    One(RawFile),
    /// Files, each with trajectories of its own.
    Several(Vec<DriveRecording>),
}

/// One of several recordings.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a file, or `{file: ..., commands: ..., usage: ...}`"
)]
pub enum DriveRecording {
    /// A file.
    File(RawFile),
    /// A file, and what is known of it.
    Described(DescribedRecording),
}

/// A recording with its commands and its use.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DescribedRecording {
    /// Commands and measured angles.
    file: RawFile,
    /// The commands, where they are in a file of their own on the same clock; of a pattern, its stars stand for what those of `file` do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    commands: Option<RawFile>,
    /// What it is for, where it has no column that says so: `validate` is not fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    usage: Option<String>,
}

/// Which rows judge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum DriveHoldOut {
    /// Windows of so many seconds of each trajectory are fitted and held out in turn; the simulation runs through them.
    Windows(f64),
    /// So large a share at the end of each trajectory, between 0 and 1.
    Last(f64),
}

/// Columns of a recording of drives; `{j}` stands for the joint, from 1, `{name}` for its name, also without `_joint` at its end. A column
/// without either holds lists, whose first numbers are those of the joints.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DriveColumns {
    /// Time.
    pub time: String,
    /// Its unit.
    pub time_unit: ClockUnit,
    /// What tells trajectories apart; without such a column all is one.
    pub trajectory: String,
    /// What rows are for; without such a column it is the file's `usage`, or all are fitted.
    pub usage: String,
    /// Commanded angles.
    pub command: String,
    /// Measured angles.
    pub angle: String,
    /// Unit of both.
    pub unit: AngleUnit,
}

impl Default for DriveColumns {
    fn default() -> Self {
        Self {
            time: "time_s".into(),
            time_unit: ClockUnit::S,
            trajectory: "traj".into(),
            usage: "use".into(),
            command: "cmd{j}_rad".into(),
            angle: "q{j}_rad".into(),
            unit: AngleUnit::Rad,
        }
    }
}

/// How a recording of text is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DriveText {
    /// What stands between fields: one ASCII character, `tab`, or `whitespace` (any run of blanks and tabs).
    pub delimiter: String,
    /// The decimal mark of the numbers.
    pub decimal: DecimalMark,
    /// Lines to skip above the header.
    pub skip: u64,
    /// Lines to skip between header and data, e.g. a row of units.
    pub skip_below_header: u64,
    /// Lines that begin with this text are skipped, e.g. `#`.
    pub comment: Option<String>,
}

impl Default for DriveText {
    fn default() -> Self {
        Self {
            delimiter: ",".into(),
            decimal: DecimalMark::Point,
            skip: 0,
            skip_below_header: 0,
            comment: None,
        }
    }
}

impl DriveText {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }

    fn layout(&self) -> Result<TextLayout> {
        let delimiter = Delimiter::parse(&self.delimiter);
        Ok(TextLayout {
            delimiter: delimiter.ok_or_else(|| Error::Bug("an unchecked delimiter".into()))?,
            comment: self.comment.clone(),
            header_in_comment: false,
            skip: self.skip,
        })
    }
}

/// A unit of angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AngleUnit {
    /// Radians.
    Rad,
    /// Degrees.
    Deg,
    /// From -100 to 100 over the joint's range: of the robot file, or `range_rad` of the drives file.
    Percent,
    /// Steps of the encoder, `encoder_rad` each, of which `zero_count` of the drives file (0) is 0 rad.
    Counts,
}

/// A unit of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClockUnit {
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
}

impl ClockUnit {
    fn seconds(self) -> f64 {
        match self {
            Self::S => 1.0,
            Self::Ms => 1e-3,
            Self::Us => 1e-6,
            Self::Ns => 1e-9,
        }
    }
}

crate::stage! {
    DiagnoseDrives, "diagnose_drives", 13, "names the physics that the simulation of commanded joints lacks, from commands and angles",
        DiagnoseDrivesReads {} -> DiagnoseDrivesWrites {
            verdict: DriveVerdict,
            sentences: VerdictSentences,
            findings: Findings,
            numbers: FindingNumbers,
            rivals: Rivals,
            joints: JointDrives,
            simulation: DriveSimulation,
            course: DriveCourse,
        }
}

/// What `drives.json` says; further fields are not read.
#[derive(Deserialize)]
struct DriveFile {
    command_rate_hz: f64,
    joints: Vec<DriveOfJoint>,
    inertia_tolerance: Option<ToleranceFile>,
}

#[derive(Deserialize)]
struct DriveOfJoint {
    joint: String,
    kp: Option<f64>,
    kd: Option<f64>,
    kd_on: Option<DampedSpeed>,
    torque_limit_nm: Option<f64>,
    encoder_rad: f64,
    #[serde(default)]
    noise_rad: f64,
    /// From .. to, which are -100 and 100 per cent.
    range_rad: Option<[f64; 2]>,
    /// Count of the encoder at 0 rad.
    #[serde(default)]
    zero_count: f64,
}

#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum DampedSpeed {
    Error,
    Speed,
}

#[derive(Deserialize)]
struct ToleranceFile {
    mass_rel: f64,
    com_mm: f64,
    inertia_rel: f64,
}

impl Stage for DiagnoseDrives {
    fn faults(&self, at: &mut Place) {
        crate::must_name_sets(&self.on, "fit", at);
        let names: Vec<&str> = CAUSES.iter().map(|cause| &*cause.name).collect();
        for (k, name) in self.without.iter().enumerate() {
            let known = names.contains(&name.as_str());
            let hint = did_you_mean(name, names.iter().copied());
            let message = format!("no cause `{name}`{hint} (causes: {})", listed(&names));
            at.at(format!("without[{k}]")).must(known, message);
        }
        at.at("text").at("delimiter").must(
            Delimiter::parse(&self.text.delimiter).is_some(),
            "allowed: one ASCII character, `tab` or `whitespace`",
        );
        let one = self.columns.command == self.columns.angle;
        let sources = self.sources();
        let apart = |source: &Source| source.commands.is_some();
        at.at("columns").at("angle").must(
            !one || sources.iter().all(apart),
            "is the column of the commands, too; allowed: another column, or `commands`, a file of their own",
        );
        at.at("recording")
            .must(!sources.is_empty(), "no file; name at least one");
        let several = matches!(self.recording, DriveRecordings::Several(_));
        at.at("commands").must(
            !several || self.commands.is_none(),
            "is of one recording; of several name the commands of each: `recording: [{file: ..., commands: ...}]`",
        );
        match self.hold_out {
            Some(DriveHoldOut::Windows(s)) => at
                .at("hold_out.windows")
                .must(s > 0.0 && s.is_finite(), "allowed: above 0, s"),
            Some(DriveHoldOut::Last(share)) => at
                .at("hold_out.last")
                .must(share > 0.0 && share < 1.0, "allowed: above 0 and below 1"),
            None => {}
        }
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        let one = [("robot", &self.robot), ("drives", &self.drives)];
        let one = one.map(|(name, file)| (name.to_string(), file.clone()));
        let includes = self.includes.iter().enumerate();
        let includes = includes.map(|(k, file)| (format!("includes[{k}]"), file.clone()));
        let sources = self.sources().into_iter();
        let files = sources.flat_map(|source| [Some(source.file), source.commands]);
        let files = files.flatten().map(|(place, file)| (place, file.clone()));
        one.into_iter().chain(files).chain(includes).collect()
    }

    fn run(&self, _reads: DiagnoseDrivesReads, context: &Context) -> Result<DiagnoseDrivesWrites> {
        let (arm, mut drives) = self.problem(context)?;
        drives.without.clone_from(&self.without);
        let options = Options {
            most: MOST_A_JOINT * drives.recording.joints(),
            forms: FORMS,
            last: LAST,
            ..Options::default()
        };
        let diagnosis = diagnose(
            &drives,
            &options,
            context.searching("looking for what the simulation lacks"),
        );
        Ok(DiagnoseDrivesWrites {
            verdict: DriveVerdict::of(context.id, &diagnosis),
            sentences: VerdictSentences::of(context.id, &[]),
            findings: Findings::of_drives(&diagnosis),
            numbers: FindingNumbers::of_drives(&diagnosis),
            rivals: Rivals::of_drives(&diagnosis),
            joints: JointDrives::of(&diagnosis),
            simulation: DriveSimulation::of(&arm, &drives, &diagnosis),
            course: DriveCourse::of(&drives.recording, &diagnosis),
        })
    }
}

impl DiagnoseDrives {
    fn problem(&self, context: &Context) -> Result<(MjcfArm, Drives)> {
        let (label, text) =
            context.text(&self.drives, "a JSON of gains and encoders", MOST_BYTES)?;
        let file: DriveFile = serde_json::from_str(&text).map_err(|error| {
            let place = format!("{label}:{}", error.line());
            Error::spec(place, format!("{error}; expected `command_rate_hz`, and `joints` with `joint`, `kp`, `kd`, `encoder_rad` each"))
        })?;
        if !(file.command_rate_hz > 0.0 && file.command_rate_hz.is_finite()) {
            return Err(Error::spec(
                format!("{label}: command_rate_hz"),
                "allowed: above 0",
            ));
        }
        let names: Vec<String> = file
            .joints
            .iter()
            .map(|joint| joint.joint.clone())
            .collect();
        let includes: Result<Vec<(String, String)>> = self
            .includes
            .iter()
            .map(|file| context.text(file, "an MJCF", MOST_BYTES))
            .collect();
        let includes = includes?;
        let includes: Vec<MjcfText> = includes
            .iter()
            .map(|(label, text)| MjcfText { label, text })
            .collect();
        let (robot, text) = context.text(&self.robot, "an MJCF", MOST_BYTES)?;
        let arm = mjcf::read(
            MjcfText {
                label: &robot,
                text: &text,
            },
            &includes,
            &names,
        )?;
        arm.notes.iter().for_each(|note| context.note(note));
        let joints = joints(&label, &file, &arm)?;
        let reference: Vec<f64> = arm.joints.iter().map(|joint| joint.reference).collect();
        let links = arm
            .arm
            .links
            .clone()
            .ok_or_else(|| Error::Bug("an MJCF without links".into()))?;
        let physics = Physics {
            joints,
            bodies: Bodies {
                links,
                gravity: arm.arm.gravity,
            },
            tool: arm.arm.tool,
            hold: 0.0,
            sag: 0.0,
        };
        let tolerance = file
            .inertia_tolerance
            .as_ref()
            .map_or(arm.arm.tolerance, |stated| InertialTolerance {
                mass_relative: stated.mass_rel,
                centre: 1e-3 * stated.com_mm,
                inertia_relative: stated.inertia_rel,
            });
        let recording = self.recorded(&file, &arm, context)?;
        let chain = Chain::new(&arm.arm, &reference);
        Ok((arm, Drives::new(chain, physics, recording, tolerance)))
    }
}

/// Joints with their drives, as the robot file and the drives file say.
fn joints(label: &str, file: &DriveFile, arm: &MjcfArm) -> Result<Vec<Joint>> {
    let mut faults = Vec::new();
    let joints = file.joints.iter().zip(&arm.joints).enumerate();
    let joints = joints
        .map(|(k, (drive, joint))| {
            let mut place = |key: &str, message: &str| faults.push(Fault::new(format!("{label}: joints[{k}].{key}"), message));
            let servo = joint.servo;
            let kp = drive.kp.or(servo.map(|servo| servo.kp)).unwrap_or_else(|| {
                place("kp", "is missing, and the robot file has no position actuator of this joint; state it in Nm/rad");
                1.0
            });
            let kd = drive.kd.or(servo.map(|servo| servo.kd)).unwrap_or_default();
            let limit = drive.torque_limit_nm.or(servo.map(|servo| servo.limit)).unwrap_or(f64::INFINITY);
            for (key, value, allowed) in [("kp", kp, "allowed: above 0"), ("torque_limit_nm", limit, "allowed: above 0"), ("encoder_rad", drive.encoder_rad + drive.noise_rad, "allowed: above 0, or with a noise above 0")] {
                if value.is_nan() || value <= 0.0 {
                    place(key, allowed);
                }
            }
            if kd.is_nan() || kd < 0.0 {
                place("kd", "allowed: 0 and above");
            }
            Joint {
                kp,
                kd,
                kd_on_error: drive.kd_on == Some(DampedSpeed::Error),
                limit,
                damping: joint.damping,
                friction: joint.friction,
                armature: joint.armature,
                spring: [joint.stiffness, joint.spring_reference],
                ..Joint::default()
            }
        })
        .collect();
    Error::if_spec(faults)?;
    Ok(joints)
}
