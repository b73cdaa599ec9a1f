//! `ingest_torques`: from raw files of an arm that moves to one table of motion, in one reading and in chunks.
//!
//! Rows keep their order. A stretch of the table is a trajectory without a gap of the clock; per file, accepted + rejected = read.

use crate::error::{Error, Fault, Place, Result, counted};
use crate::ingest::arm::RobotJoints;
use crate::ingest::columns::{FileLayout, LimitPolicy};
use crate::ingest::reading::{OpenedFile, STRIDE};
use crate::ingest::refusal::{
    Reason, RefusalCounts, Rejections, RowRefusal, beginning, refuse, tally,
};
use crate::ingest::row::RecordedRow;
use crate::ingest::rows::NO_ROW;
use crate::ingest::stretch::Stretches;
use crate::ingest::turns::TurnCounter;
use crate::ingest::{check, reading};
use crate::table::{ArmMotion, Intake, IntakeRow, Rejected, Robot, RobotRow, Table};
use crate::{Context, RawFile, Sink, Stage, StreamedTable, torque_per_ampere};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Reads recordings of joint torques or motor currents of a moving arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IngestTorques {
    /// The raw files, each with all quantities; one continues the other. `q`, `time`, and one of `torque` and `current` are needed;
    /// `simulated`, `trajectory`, `usage`, `velocity` and `temperature` are used where they are mapped.
    pub files: Vec<FileLayout>,
    /// On which side of the gears `torque` is stated.
    #[serde(default)]
    pub torque_side: TorqueSide,
    /// What becomes of rows with a joint beyond the robot's limits.
    #[serde(default)]
    pub limits: LimitPolicy,
    /// A file of which more than this share of rows is rejected is an error.
    #[serde(default = "few")]
    pub max_rejected_fraction: f64,
}

/// On which side of the gears a torque is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TorqueSide {
    /// What moves the link.
    #[default]
    Joint,
    /// The torque of the motor: times the reduction ratio it is the joint's.
    Motor,
}

fn few() -> f64 {
    0.05
}

/// Quantities that a recording of torques may have.
const USED: &str = "q, time, torque, current, simulated, trajectory, usage, velocity, temperature";
/// Rows of the table in memory at once.
const CHUNK: usize = 1 << 16;
/// More labels than these are no labels: another column is mapped.
const MOST_LABELS: usize = 100;

crate::stage! {
    IngestTorques, "ingest_torques", 3, "reads joint positions with torques or motor currents of an arm that moves",
        IngestTorquesReads {
            robot: Robot,
        } -> IngestTorquesWrites {
            motion: StreamedTable<ArmMotion>,
            rejected: StreamedTable<Rejected>,
            intake: Intake,
        }
}

impl Stage for IngestTorques {
    fn faults(&self, at: &mut Place) {
        at.at("files")
            .must(!self.files.is_empty(), "no file; name at least one");
        let possible = (0.0..=1.0).contains(&self.max_rejected_fraction);
        at.at("max_rejected_fraction")
            .must(possible, "allowed: 0 to 1");
        for (index, file) in self.files.iter().enumerate() {
            let at = &mut at.at(format!("files[{index}]"));
            check::file(file, at);
            let at = &mut at.at("columns");
            for name in file.names() {
                let is_used = USED.split(", ").any(|used| used == name);
                let message = format!("is not used of a recording of torques; allowed: {USED}");
                at.at(name).must(is_used, message);
            }
            let drive = (
                file.has("torque") || file.has("current"),
                "torque or current",
            );
            let needed = [(file.has("q"), "q"), (file.has("time"), "time"), drive];
            let missing = needed.into_iter().filter(|(has, _)| !has);
            let missing: Vec<&str> = missing.map(|(_, name)| name).collect();
            if !missing.is_empty() {
                at.fault(format!("not mapped: {}", missing.join(", ")));
            }
        }
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        super::named_files(&self.files).collect()
    }

    fn look(
        &self,
        reads: Option<IngestTorquesReads>,
        context: &Context,
    ) -> Result<Option<IngestTorquesWrites>> {
        let robot = reads.map(|reads| reads.robot);
        let in_current = |file: &FileLayout| file.has("current") && !file.has("torque");
        if let Some(robot) = &robot
            && self.files.iter().any(in_current)
            && let Err(missing) = torque_per_ampere(&robot.to_description()?)
        {
            context.warn(missing.to_string());
        }
        reading::headers(self.files.iter(), robot.as_ref(), self.limits, context).map(|()| None)
    }

    fn run(&self, reads: IngestTorquesReads, context: &Context) -> Result<IngestTorquesWrites> {
        Error::if_spec(self.check())?;
        let arm = RobotJoints::of(&reads.robot)?;
        let labels = self
            .files
            .iter()
            .map(|file| file.file.0.display().to_string());
        let labels: Vec<String> = labels.collect();
        let names = super::names(labels.iter().map(String::as_str));
        let mut rejected = Rejections::new(&names, context)?;
        let mut rows = MotionRows::new(self, &reads.robot, &arm, context)?;
        let mut intake = Vec::new();
        for (layout, name) in self.files.iter().zip(&names) {
            intake.push(rows.file(layout, name, &mut rejected, context)?);
        }
        Ok(IngestTorquesWrites {
            motion: rows.finish(context)?,
            rejected: rejected.finish()?,
            intake: Intake(intake),
        })
    }
}

/// The table of motion, chunk by chunk.
struct MotionRows<'a> {
    settings: &'a IngestTorques,
    arm: &'a RobotJoints,
    sink: Box<dyn Sink + 'a>,
    chunk: ArmMotion,
    written: i64,
    stretches: Stretches,
    turns: TurnCounter<'a>,
    last_stretch: Option<i64>,
    /// The first row in the chunk of the present stretch.
    stretch_begins: usize,
    /// What a motor-side torque is multiplied by, a joint each.
    ratio: Vec<f64>,
    /// Which of `current` and `torque` the files have; the first file decides.
    signal: Option<&'static str>,
    channels: Vec<TorqueChannel>,
    /// Places of usage and trajectory among the texts of a row.
    usage: usize,
    trajectory: usize,
}

impl<'a> MotionRows<'a> {
    fn new(
        settings: &'a IngestTorques,
        robot: &Robot,
        arm: &'a RobotJoints,
        context: &Context<'a>,
    ) -> Result<Self> {
        let is_joint = |row: &&RobotRow| row.kind == "revolute" || row.kind == "prismatic";
        let joints = robot.0.iter().filter(is_joint);
        let ratio = joints.map(|row| match (settings.torque_side, row.reduction_ratio) {
            (TorqueSide::Joint, _) => Ok(1.0),
            (TorqueSide::Motor, Some(ratio)) => Ok(ratio),
            (TorqueSide::Motor, None) => {
                let message =
                    format!("joint {} has no reduction ratio; `torque_side: motor` needs it in the robot file", row.body);
                Err(Error::data("with.torque_side", message))
            }
        });
        let place = |name: &str| {
            let place = arm.slots.texts().iter().position(|text| *text == name);
            place.unwrap_or(usize::MAX)
        };
        Ok(Self {
            settings,
            arm,
            sink: context.services.sink(ArmMotion::KIND)?,
            chunk: ArmMotion::default(),
            written: 0,
            stretches: Stretches::default(),
            turns: TurnCounter::new(arm),
            last_stretch: None,
            stretch_begins: 0,
            ratio: ratio.collect::<Result<_>>()?,
            signal: None,
            channels: vec![TorqueChannel::default(); arm.joints()],
            usage: place("usage"),
            trajectory: place("trajectory"),
        })
    }

    fn file(
        &mut self,
        layout: &FileLayout,
        name: &str,
        rejected: &mut Rejections,
        context: &Context,
    ) -> Result<IntakeRow> {
        let source = context.services.open(&layout.file)?;
        let size = source.size;
        let mut open = OpenedFile::open(source, layout, self.arm, self.settings.limits)?;
        let (label, services) = (open.label.clone(), context.services);
        for remark in open.remarks() {
            context.note(format!("{label}: {remark}"));
        }
        services.begin(&format!("reading {label}"), size, "bytes");
        self.agree(&open, &label)?;
        self.stretches.begin();
        let (mut refused, mut accepted) = (RefusalCounts::new(), 0);
        while let Some(judged) = open.next()? {
            match judged.and_then(|()| self.complete(&open.row)) {
                Ok(()) => {
                    self.push(&open.row, &label, context)?;
                    accepted += 1;
                }
                Err(refusal) => {
                    tally(&mut refused, open.row.line, &refusal);
                    let begin = beginning(open.text());
                    rejected.push(refusal.rejected(name, open.row.line, "", &begin))?;
                }
            }
            if open.row.number.is_multiple_of(STRIDE) {
                services.advance(open.bytes(), "");
            }
        }
        let read = open.row.number;
        context.warn_each(open.loss());
        self.few_rejected(&label, read, accepted, &refused)?;
        let counts = [read, accepted];
        Ok(reading::intake(name, open.lines(), counts, context))
    }

    /// Every file has the same quantities: one of currents and torques, and the same other ones.
    fn agree(&mut self, open: &OpenedFile, label: &str) -> Result<()> {
        let given = open.binding().slots();
        let has = |setting: &str| given.contains(&self.arm.slots.of(setting).start);
        let wrong = |message: String| Err(Error::data(label, message));
        let signal = match (has("torque"), has("current")) {
            (true, false) => "torque",
            (false, true) => "current",
            (true, true) => {
                return wrong(
                    "has torques and currents; map one of them: the other would not be used".into(),
                );
            }
            (false, false) => {
                let lacks = open.binding().missing.join("; ");
                return wrong(format!(
                    "has neither torques nor motor currents of the joints: {lacks}"
                ));
            }
        };
        let first = *self.signal.get_or_insert(signal);
        if first != signal {
            return wrong(format!(
                "holds {signal}s, the files before hold {first}s; allowed: the same in each"
            ));
        }
        if self.written == 0 && self.chunk.rows() == 0 {
            self.chunk.velocity = has("velocity").then(Vec::new);
            self.chunk.simulated = has("simulated").then(Vec::new);
            self.chunk.temperature = has("temperature").then(Vec::new);
        }
        for (name, first) in [
            ("velocity", self.chunk.velocity.is_some()),
            ("simulated", self.chunk.simulated.is_some()),
            ("temperature", self.chunk.temperature.is_some()),
        ] {
            if first != has(name) {
                let which = if has(name) { "has" } else { "lacks" };
                return wrong(format!(
                    "{which} the quantity `{name}`, other than the files before"
                ));
            }
        }
        Ok(())
    }

    /// Refuses a row without the torque of a joint: columns may be missing, cells may not.
    fn complete(&self, row: &RecordedRow) -> Result<(), RowRefusal> {
        let signal = self.signal.unwrap_or("torque");
        let blank = |what: &str| {
            let mut values = self.values(row, what).iter();
            let joint = values.position(|value| value.is_nan())?;
            Some(format!("the {what} of joint {} is blank", joint + 1))
        };
        let has_velocity = self.chunk.velocity.is_some();
        let velocity = || has_velocity.then(|| blank("velocity")).flatten();
        let has_simulated = self.chunk.simulated.is_some();
        let simulated = || has_simulated.then(|| blank("simulated")).flatten();
        let is_timed = row.values.get(self.arm.slots.time);
        let time = || {
            is_timed
                .filter(|time| time.is_nan())
                .map(|_| "time is blank".into())
        };
        match blank(signal)
            .or_else(velocity)
            .or_else(simulated)
            .or_else(time)
        {
            Some(detail) => refuse(Reason::Blank, detail),
            None => Ok(()),
        }
    }

    fn values<'r>(&self, row: &'r RecordedRow, setting: &str) -> &'r [f64] {
        let values = row.values.get(self.arm.slots.of(setting));
        values.unwrap_or_default()
    }

    fn push(&mut self, row: &RecordedRow, label: &str, context: &Context) -> Result<()> {
        let faulty = |message: String| Error::data(format!("{label}:{}", row.line), message);
        let [q, velocity, simulated, temperature] =
            ["q", "velocity", "simulated", "temperature"].map(|setting| self.values(row, setting));
        let signal = self.values(row, self.signal.unwrap_or("torque"));
        let time = row.values.get(self.arm.slots.time).copied();
        let time = time.unwrap_or(f64::NAN);
        let trajectory = row.texts.get(self.trajectory).map_or("", String::as_str);
        let stretch = self.stretches.next(trajectory, time, q, row.line);
        let stretch = stretch.map_err(faulty)?;
        context.warn_each(self.stretches.warning(label));
        for (channel, value) in self.channels.iter_mut().zip(signal) {
            channel.push(*value);
        }
        let chunk = &mut self.chunk;
        let goes_on = self.last_stretch == Some(stretch);
        if !goes_on {
            self.stretch_begins = chunk.rows();
        }
        self.last_stretch = Some(stretch);
        let (begins, end) = (self.stretch_begins * q.len(), chunk.q.len());
        chunk.q.extend_from_slice(q);
        let (before, here) = chunk.q.split_at_mut(end);
        let before = &mut before[begins..];
        self.turns.next(row.line, goes_on, here, before);
        chunk.time.push(time);
        chunk.trajectory.push(stretch);
        if self.signal == Some("current") {
            let all = chunk.current.get_or_insert_default();
            all.extend_from_slice(signal);
        } else {
            let joint_side = signal.iter().zip(&self.ratio);
            let joint_side = joint_side.map(|(torque, ratio)| torque * ratio);
            chunk.torque.get_or_insert_default().extend(joint_side);
        }
        for (all, more) in [
            (&mut chunk.velocity, velocity),
            (&mut chunk.simulated, simulated),
            (&mut chunk.temperature, temperature),
        ] {
            all.iter_mut().for_each(|all| all.extend_from_slice(more));
        }
        let usage = row.texts.get(self.usage).map_or("", String::as_str);
        let known = chunk.usages.iter().position(|known| known == usage);
        let usage = match (usage.is_empty(), known) {
            (true, _) => None,
            (false, Some(known)) => Some(known as u16),
            (false, None) if chunk.usages.len() >= MOST_LABELS => {
                let message = format!(
                    "`usage` has more than {MOST_LABELS} labels; allowed: such as fit and validate"
                );
                return Err(faulty(message));
            }
            (false, None) => {
                chunk.usages.push(usage.into());
                Some((chunk.usages.len() - 1) as u16)
            }
        };
        chunk.usage.push(usage);
        self.written += 1;
        chunk.sequence.push(self.written);
        if chunk.rows() >= CHUNK {
            self.flush()
        } else {
            Ok(())
        }
    }

    fn flush(&mut self) -> Result<()> {
        let next = ArmMotion {
            usages: self.chunk.usages.clone(),
            velocity: self.chunk.velocity.as_ref().map(|_| Vec::new()),
            simulated: self.chunk.simulated.as_ref().map(|_| Vec::new()),
            temperature: self.chunk.temperature.as_ref().map(|_| Vec::new()),
            ..ArmMotion::default()
        };
        let mut full = std::mem::replace(&mut self.chunk, next);
        self.stretch_begins = 0;
        full.joints = self.arm.joints();
        full.prismatic.clone_from(&self.arm.prismatic);
        self.sink.push(full.to_frame()?)
    }

    fn few_rejected(
        &self,
        label: &str,
        read: u64,
        accepted: u64,
        refused: &RefusalCounts,
    ) -> Result<()> {
        let share = self.settings.max_rejected_fraction;
        if read == 0 {
            return Err(Error::data(label, NO_ROW));
        }
        if accepted > 0 && (read - accepted) as f64 <= share * read as f64 {
            return Ok(());
        }
        let worst = refused.values().max_by_key(|count| count.rows);
        let (line, why) = worst.map_or((0, ""), |count| {
            (count.first_line, count.first_detail.as_str())
        });
        let message = format!(
            "{} of {read} rows are rejected, allowed: up to {} % (`max_rejected_fraction`); the first: {why}",
            read - accepted,
            share * 100.0
        );
        Err(Error::data(format!("{label}:{line}"), message))
    }

    fn finish(mut self, context: &Context) -> Result<StreamedTable<ArmMotion>> {
        let (signal, rows) = (self.signal.unwrap_or("torque"), self.written);
        let named = (1..)
            .zip(&self.channels)
            .map(|(joint, channel)| (format!("{signal} of joint {joint}"), channel));
        let named: Vec<(String, &TorqueChannel)> = named.collect();
        let dead = named.iter().filter_map(|(name, channel)| {
            let value = channel.constant()?;
            let message = format!("the {name} is {value} in each of {rows} rows: a dead channel");
            Some(Fault::new(format!("table motion, {name}"), message))
        });
        Error::if_data(dead.collect())?;
        for (name, channel) in &named {
            let clipped = channel.clipped();
            context.warn_each(clipped.map(|clipped| format!("the {name} {clipped}: saturated?")));
        }
        context.warn_each(self.turns.remarks());
        if self.chunk.rows() > 0 || self.written == 0 {
            self.flush()?;
        }
        context.note(format!(
            "{} of {signal}s, {}",
            counted(self.written, "row"),
            counted(self.stretches.count(), "stretch")
        ));
        Ok(StreamedTable::new(self.sink.finish()?))
    }
}

/// Rows one after the other at the largest value that are no chance.
const RUN: u64 = 5;
/// Share of rows in such runs that is worth a word.
const SHARE: f64 = 0.002;
/// Fewer rows say nothing of a column.
const FEWEST: u64 = 100;

/// One end of a channel's range.
#[derive(Debug, Clone, Copy, Default)]
struct End {
    value: Option<f64>,
    /// Rows at it one after the other, now.
    run: u64,
    /// Rows in runs that are no chance.
    held: u64,
}

impl End {
    /// `beyond` where the value lies further out than the end so far.
    fn push(&mut self, value: f64, beyond: bool) {
        if beyond {
            *self = Self {
                value: Some(value),
                run: 1,
                held: 0,
            };
        } else if self.value == Some(value) {
            self.run += 1;
            self.held += match self.run {
                RUN => RUN,
                run if run > RUN => 1,
                _ => 0,
            };
        } else {
            self.run = 0;
        }
    }
}

/// The torque or current of one joint, row by row.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TorqueChannel {
    rows: u64,
    low: End,
    high: End,
}

impl TorqueChannel {
    pub(super) fn push(&mut self, value: f64) {
        self.rows += 1;
        let is_low = self.low.value.is_none_or(|low| value < low);
        let is_high = self.high.value.is_none_or(|high| value > high);
        self.low.push(value, is_low);
        self.high.push(value, is_high);
    }

    /// The one value of a channel that never changes.
    pub(super) fn constant(&self) -> Option<f64> {
        let is_one = self.low.value == self.high.value && self.rows >= FEWEST;
        self.low.value.filter(|_| is_one)
    }

    /// Where it stands at the ends of its range, in words.
    pub(super) fn clipped(&self) -> Option<String> {
        let held = self.low.held + self.high.held;
        let (low, high, rows) = (self.low.value?, self.high.value?, self.rows);
        let stands = held as f64 > SHARE * rows as f64 && rows >= FEWEST;
        stands.then(|| {
            format!("stands at {low} or {high}, the ends of its range, for {held} of {rows} rows")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::TorqueChannel;

    fn of(values: impl Iterator<Item = f64>) -> TorqueChannel {
        let mut channel = TorqueChannel::default();
        values.for_each(|value| channel.push(value));
        channel
    }

    #[test]
    fn a_channel_that_is_cut_off_says_so_and_a_sine_does_not() {
        let sine = |k: i32| 10.0 * (0.05 * f64::from(k)).sin();
        assert_eq!(of((0..2000).map(sine)).clipped(), None);
        let cut = of((0..2000).map(|k| sine(k).clamp(-8.0, 8.0)))
            .clipped()
            .expect("two fifths of the rows are cut off");
        assert!(cut.starts_with("stands at -8 or 8"), "{cut}");
        assert_eq!(
            [
                of((0..200).map(|_| 0.25)).constant(),
                of((0..200).map(sine)).constant()
            ],
            [Some(0.25), None]
        );
    }
}
