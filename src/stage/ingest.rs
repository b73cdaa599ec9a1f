//! `ingest`: from raw files (text, workbooks, columns) to one recording; what is not used goes to `rejected` with file, line and reason.
//!
//! Every file is read once (`rows`), row by row: bytes to records (`raw`), records to quantities or the reason why not (`row`). What all rows
//! together say is decided (`pair`, `verdict`), then rows are written (`write`). Per file, accepted + rejected = read.

mod apart;
mod arm;
mod bind;
mod check;
mod columns;
mod external;
mod later;
mod mapped;
mod motion;
mod noise;
mod pair;
mod reading;
mod refusal;
mod row;
mod rows;
mod stretch;
mod torques;
mod turns;
mod verdict;
mod write;

pub use apart::{ClocksApart, clocks_apart};
pub use columns::Columns;
pub use columns::{Axis, Duplicates, FileLayout, Join, LimitPolicy, WideTargets};
pub use later::LaterFiles;
pub use mapped::{
    ColumnRef, ConventionColumns, CountColumn, CoupledColumn, JointColumns, NameMatch,
    ScalarColumn, TextColumn, UncertaintyColumn, last_number,
};
pub use motion::VelocitySettings;
pub use noise::{InstrumentSetting, instruments};
pub use reading::FileKind;
pub use reading::{TableLayout, records};
pub use stretch::{clock_seconds, is_clock_time};
pub use torques::{IngestTorques, IngestTorquesReads, IngestTorquesWrites, TorqueSide};

use pair::Measurement;

use crate::error::{Error, Place, Result};
use crate::table::{Intake, JointConventions, Recording, Rejected, Robot};
use crate::units::Unit;
use crate::{Context, RawFile, Stage, StreamedTable};
use calib_numerics::robot::{CountedCoupling, JointConvention};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Reads raw files into a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ingest {
    /// The raw files; the first one leads: its order is that of the recording.
    pub files: Vec<FileLayout>,
    /// Files of later measurements in the same layout, e.g. of another day: joined among themselves, then appended.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub later: Vec<LaterFiles>,
    /// How several files belong together.
    #[serde(default)]
    pub join: Option<Join>,
    /// What becomes of rows whose point id occurs more than once in a file.
    #[serde(default)]
    pub duplicates: Duplicates,
    /// What becomes of rows with a joint beyond the robot's limits.
    #[serde(default)]
    pub limits: LimitPolicy,
    /// Axes of the points that were measured at all, e.g. `[z]` for a dial gauge on a plate; without it all three, unless
    /// orientations or distances are mapped. The others are not mapped; of those listed a cell may be blank where its column is
    /// `optional`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<Vec<Axis>>,
    /// By what points were measured, for rows that record no standard deviation: a name, e.g. `leica_at960`, or figures, e.g.
    /// `{constant_um: 10, per_metre_um: 2.5, coverage: 2}`. With neither, noise is not known: points are
    /// weighted by an assumed one, and every figure that rests on it says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instrument: Option<InstrumentSetting>,
    /// The arm moves while it is measured: joint velocities follow from the joints over time where no columns give them. `motion: {}`
    /// takes the usual settings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<VelocitySettings>,
    /// A file of which more than this share of rows is rejected is an error.
    #[serde(default = "half")]
    pub max_rejected_fraction: f64,
}

fn half() -> f64 {
    0.5
}

crate::stage! {
    Ingest, "ingest", 9, "reads raw files into a recording, and lists every rejected row with its reason",
        IngestReads {
            robot: Robot,
        } -> IngestWrites {
            recording: StreamedTable<Recording>,
            rejected: StreamedTable<Rejected>,
            intake: Intake,
            convention: JointConventions,
        }
}

impl Stage for Ingest {
    fn faults(&self, at: &mut Place) {
        check::faults(self, at);
    }
    fn files(&self) -> Vec<(String, RawFile)> {
        let first = named_files(&self.files);
        let later = self.later.iter().enumerate().flat_map(|(set, later)| {
            let files = later.files.iter().enumerate();
            files.map(move |(index, file)| (format!("later[{set}].files[{index}]"), file.clone()))
        });
        first.chain(later).collect()
    }
    fn look(&self, reads: Option<IngestReads>, context: &Context) -> Result<Option<IngestWrites>> {
        let (all, robot) = (self.measurements(), reads.map(|reads| reads.robot));
        let layouts = all.iter().flat_map(|one| &one.files);
        reading::headers(layouts, robot.as_ref(), self.limits, context).map(|()| None)
    }
    fn run(&self, reads: IngestReads, context: &Context) -> Result<IngestWrites> {
        Error::if_spec(self.check())?;
        let arm = arm::RobotJoints::of(&reads.robot)?;
        let measurements = self.measurements();
        let mut read = Vec::new();
        for settings in &measurements {
            let mut files = rows::read(settings, &arm, context)?;
            let partners = pair::decide(&mut files, settings, arm.slots.time);
            let one = Measurement {
                settings,
                arm: &arm,
                files,
                partners,
                names: &[],
            };
            verdict::judge(&one, context)?;
            read.push(one);
        }
        verdict::no_copies(&read)?;
        let files = read.iter().flat_map(|one| &one.files);
        let names = names(files.map(|rows| rows.label.as_str()));
        for (one, names) in read.iter_mut().zip(names.chunks(self.files.len().max(1))) {
            one.names = names;
        }
        let gaps: Vec<Option<f64>> = self.later.iter().map(LaterFiles::gap).collect();
        let (recording, rejected) = write::write(&read, &gaps, &names, context)?;
        let convention = JointConventions::of(&self.convention(&arm), &arm.prismatic);
        Ok(IngestWrites {
            recording,
            rejected,
            intake: intake(&read, &names, context),
            convention,
        })
    }
}

impl Ingest {
    /// Whether rows of the other files belong to rows of the first.
    fn is_joined(&self) -> bool {
        !matches!(self.join, None | Some(Join::Append {}))
    }
    fn is_joined_by_time(&self) -> bool {
        matches!(self.join, Some(Join::Time { .. }))
    }

    /// How the file that holds the joints counts them.
    fn convention(&self, arm: &arm::RobotJoints) -> JointConvention {
        let Some(joints) = self.files.iter().find_map(|file| file.columns.joint("q")) else {
            return JointConvention::of_the_robot_file(arm.joints());
        };
        let zero = |joint: usize| {
            let unit = match arm.prismatic[joint] {
                true => joints.linear_unit.as_deref(),
                false => joints.unit.as_deref(),
            };
            Some(Unit::parse(unit?)?.to_si(*joints.zero.get(joint)?))
        };
        let all = || 0..arm.joints();
        let sign = all().map(|joint| joints.sign.get(joint).copied().unwrap_or(1.0));
        let zero = all().map(|joint| zero(joint).unwrap_or(0.0));
        let coupled = joints.coupled.iter().map(|one| CountedCoupling {
            joint: one.joint - 1,
            by: one.by - 1,
            ratio: one.ratio,
        });
        JointConvention::new(sign.collect(), zero.collect(), coupled.collect())
    }
}

/// The files of layouts, each with its path below `with`.
fn named_files(files: &[FileLayout]) -> impl Iterator<Item = (String, RawFile)> {
    let files = files.iter().enumerate();
    files.map(|(index, file)| (format!("files[{index}].file"), file.file.clone()))
}

/// The files' own names, made different where two are the same: a folder is no part of a table.
fn names<'a>(labels: impl Iterator<Item = &'a str>) -> Vec<String> {
    let file_name = |label: &str| {
        Path::new(label)
            .file_name()
            .map_or_else(|| label.into(), |name| name.to_string_lossy().into_owned())
    };
    let all: Vec<String> = labels.map(file_name).collect();
    let mut names: Vec<String> = Vec::with_capacity(all.len());
    for name in &all {
        // Another file may be called like a numbered one.
        let mut numbered = (2..).map(|number| format!("{name} ({number})"));
        let is_new = |other: &String| !all.contains(other) && !names.contains(other);
        let name = match names.contains(name) {
            true => numbered.find(is_new).unwrap_or_default(),
            false => name.clone(),
        };
        names.push(name);
    }
    names
}

fn intake(read: &[Measurement], names: &[String], context: &Context) -> Intake {
    let files = read.iter().flat_map(|one| &one.files).zip(names);
    let row = |(rows, name): (&rows::FileRows, &String)| {
        let counts = [rows.count() as u64, rows.count_used()];
        reading::intake(name, rows.lines, counts, context)
    };
    Intake(files.map(row).collect())
}
