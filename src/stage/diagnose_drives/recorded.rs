//! The recordings of drives: rows of each file, commands of a file of their own, and which rows judge.

use super::reading::{self, Rows};
use super::{AngleUnit, DiagnoseDrives, DriveFile, DriveHoldOut, DriveRecording, DriveRecordings};
use crate::drives::mjcf::MjcfArm;
use crate::drives::recording::{PAUSE, Recording, Trajectory, without_pauses};
use crate::error::{Error, Fault, Result, counted};
use crate::{Context, RawFile};

/// A recording's files, each with its place below `with`.
pub(super) struct Source<'a> {
    pub(super) file: (String, &'a RawFile),
    pub(super) commands: Option<(String, &'a RawFile)>,
    usage: Option<&'a str>,
}

impl DiagnoseDrives {
    /// Where the recordings are.
    pub(super) fn sources(&self) -> Vec<Source<'_>> {
        let all = match &self.recording {
            DriveRecordings::One(file) => {
                let commands = self.commands.as_ref();
                return vec![Source {
                    file: ("recording".into(), file),
                    commands: commands.map(|commands| ("commands".into(), commands)),
                    usage: None,
                }];
            }
            DriveRecordings::Several(all) => all.iter().enumerate(),
        };
        all.map(|(k, one)| match one {
            DriveRecording::File(file) => Source {
                file: (format!("recording[{k}]"), file),
                commands: None,
                usage: None,
            },
            DriveRecording::Described(one) => {
                let commands = one.commands.as_ref();
                Source {
                    file: (format!("recording[{k}].file"), &one.file),
                    commands: commands
                        .map(|commands| (format!("recording[{k}].commands"), commands)),
                    usage: one.usage.as_deref(),
                }
            }
        })
        .collect()
    }

    /// All recordings, one after the other.
    pub(super) fn recorded(
        &self,
        file: &DriveFile,
        arm: &MjcfArm,
        context: &Context,
    ) -> Result<Recording> {
        let units = self.units(file, arm)?;
        let sources = self.sources();
        let mut whole: Option<Recording> = None;
        let mut labels = Vec::new();
        for source in &sources {
            let (label, part) = self.part(file, source, &units, context)?;
            part.check(&label)?;
            labels.push(label);
            match &mut whole {
                None => whole = Some(part),
                Some(whole) => whole.append(&part),
            }
        }
        let recording = whole.ok_or_else(|| Error::spec("with.recording", "no file"))?;
        let label = match labels.as_slice() {
            [one] => one.clone(),
            [first, .., last] => format!("{first} .. {last}"),
            [] => String::new(),
        };
        if !recording.held_out.contains(&false) {
            let to_fit = self.on.join(", ");
            let message = format!("no row of {label} is left to fit; to fit: {to_fit}");
            return Err(Error::data("with.on", message));
        }
        let rests = recording.check_motion(&label)?;
        rests.iter().for_each(|rests| context.warn(rests));
        Ok(recording)
    }

    /// One recording.
    fn part(
        &self,
        file: &DriveFile,
        source: &Source,
        units: &[[f64; 2]],
        context: &Context,
    ) -> Result<(String, Recording)> {
        let names: Vec<String> = file.joints.iter().map(|one| one.joint.clone()).collect();
        let columns = &self.columns;
        let [command, angle] = [columns.command.as_str(), columns.angle.as_str()];
        let (label, mut rows, commands) = match &source.commands {
            None => {
                let wanted = [command, angle];
                let (label, mut rows) =
                    reading::rows(source.file.1, self, &names, &wanted, context)?;
                let commands = rows.values.remove(0);
                (label, rows, commands)
            }
            Some((_, sent)) => self.with_commands(source.file.1, sent, &names, context)?,
        };
        let scaled = |values: Vec<f64>| -> Vec<f64> {
            let units = units.iter().cycle();
            let values = values.into_iter().zip(units);
            values
                .map(|(value, [by, zero])| by * value + zero)
                .collect()
        };
        let mut held_out = vec![false; rows.time.len()];
        for (range, usage) in &rows.usages {
            let usage = usage.as_deref().or(source.usage);
            let judges = usage.is_some_and(|usage| !self.on.iter().any(|on| on == usage));
            held_out[range.clone()].fill(judges);
        }
        let period = 1.0 / file.command_rate_hz;
        let runs = without_pauses(&rows.time, &rows.runs, period);
        if runs.len() > rows.runs.len() {
            context.warn(format!(
                "{label}: {} of more than {PAUSE} s in the stamps; a trajectory begins anew after each",
                counted(runs.len() - rows.runs.len(), "pause")
            ));
        }
        rows.runs = runs;
        for range in &rows.runs {
            self.hold_out(&rows.time, range, &mut held_out);
        }
        // A clock that falls back begins anew: an episode is a recording of its own.
        let mut began = rows.time.first().copied().unwrap_or_default();
        let mut last = began;
        let time = &rows.time;
        let trajectory = |rows: &std::ops::Range<usize>| {
            if time[rows.start] < last {
                began = time[rows.start];
            }
            last = time[rows.end - 1];
            Trajectory {
                rows: rows.clone(),
                began,
            }
        };
        let trajectories = rows.runs.iter().map(trajectory).collect();
        let recording = Recording {
            angle: scaled(rows.values.remove(0)),
            command: scaled(commands),
            trajectories,
            time: rows.time,
            held_out,
            period,
            encoder: file.joints.iter().map(|joint| joint.encoder_rad).collect(),
            noise: file.joints.iter().map(|joint| joint.noise_rad).collect(),
        };
        Ok((label, recording))
    }

    /// Of each joint the angle of a unit, and that of 0, rad.
    fn units(&self, file: &DriveFile, arm: &MjcfArm) -> Result<Vec<[f64; 2]>> {
        let mut faults = Vec::new();
        let joints = file.joints.iter().zip(&arm.joints).enumerate();
        let of = |(k, (drive, joint)): (
            usize,
            (&super::DriveOfJoint, &crate::drives::mjcf::MjcfJoint),
        )| {
            match self.columns.unit {
                AngleUnit::Rad => [1.0, 0.0],
                AngleUnit::Deg => [1f64.to_radians(), 0.0],
                AngleUnit::Counts => [drive.encoder_rad, -drive.encoder_rad * drive.zero_count],
                AngleUnit::Percent => {
                    let range = drive.range_rad.or(joint.range);
                    let [low, high] = range.unwrap_or_else(|| {
                        let place = format!("{}: joints[{k}].range_rad", drive.joint);
                        let message = "is missing, and the robot file states no range of this joint; per cent are of [from, to], rad";
                        faults.push(Fault::new(place, message));
                        [0.0, 1.0]
                    });
                    // From -100 to 100.
                    [0.005 * (high - low), 0.5 * (low + high)]
                }
            }
        };
        let units = joints.map(of).collect();
        Error::if_spec(faults)?;
        Ok(units)
    }

    /// Rows of the angles with the commands that hold in them, which are in a file of their own.
    fn with_commands(
        &self,
        angles: &RawFile,
        sent: &RawFile,
        names: &[String],
        context: &Context,
    ) -> Result<(String, Rows, Vec<f64>)> {
        let columns = &self.columns;
        let wanted = [columns.command.as_str()];
        let (place, mut sent) = reading::rows(sent, self, names, &wanted, context)?;
        let wanted = [columns.angle.as_str()];
        let (label, mut rows) = reading::rows(angles, self, names, &wanted, context)?;
        reading::must_rise(&place, &sent.time)?;
        let (held, before) = reading::held(&sent.time, &rows.time);
        let beyond = rows.time.last() > sent.time.last();
        if before > rows.time.len() / 2 {
            let message = format!(
                "its first command is sent at {} s, after half of the {} angles of {label}; both clocks are one, in `time_unit`",
                sent.time.first().copied().unwrap_or_default(),
                rows.time.len()
            );
            return Err(Error::data(&place, message));
        }
        if before > 0 {
            context.note(format!(
                "{label}: {before} rows before the first command are not used"
            ));
            rows.skip(before, names.len());
        }
        if beyond {
            context.note(format!(
                "{place}: its last command is held until {label} ends"
            ));
        }
        let n = names.len();
        let values = sent.values.remove(0);
        let of_row = |row: &usize| values[row * n..(row + 1) * n].to_vec();
        let commands = held[before..].iter().flat_map(of_row).collect();
        Ok((label, rows, commands))
    }

    /// Rows of a trajectory that judge by `hold_out`.
    fn hold_out(&self, time: &[f64], rows: &std::ops::Range<usize>, held_out: &mut [bool]) {
        let since = |row: usize| time[row] - time[rows.start];
        let last = since(rows.end - 1);
        let judges = |row: usize| match self.hold_out {
            None => false,
            // Stamps of a window's first row may differ in the last digits.
            Some(DriveHoldOut::Windows(s)) => ((since(row) + 1e-6) / s).floor() % 2.0 == 1.0,
            Some(DriveHoldOut::Last(share)) => since(row) > (1.0 - share) * last,
        };
        for row in rows.clone().filter(|row| judges(*row)) {
            held_out[row] = true;
        }
    }
}
