//! The recordings of drives: rows of each file, commands of a file of their own, and which rows judge.

use super::reading::{self, Rows, Sheet};
use super::{
    AngleUnit, DiagnoseDrives, DriveFile, DriveHoldOut, DriveRecording, DriveRecordings, MOST_BYTES,
};
use crate::drives::recording::{Recording, Trajectory};
use crate::error::{Error, Result};
use crate::stage::{Context, RawFile};

const WHAT: &str = "a CSV of commands and angles";

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
    pub(super) fn recorded(&self, file: &DriveFile, context: &Context) -> Result<Recording> {
        let sources = self.sources();
        let mut whole: Option<Recording> = None;
        let mut labels = Vec::new();
        for source in &sources {
            let (label, part) = self.part(file, source, context)?;
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
        recording.check_motion(&label)?;
        Ok(recording)
    }

    /// One recording.
    fn part(
        &self,
        file: &DriveFile,
        source: &Source,
        context: &Context,
    ) -> Result<(String, Recording)> {
        let (label, text) = context.text(source.file.1, WHAT, MOST_BYTES)?;
        let names: Vec<String> = file.joints.iter().map(|one| one.joint.clone()).collect();
        let sheet = Sheet {
            label: &label,
            text: &text,
        };
        let columns = &self.columns;
        let [command, angle] = [columns.command.as_str(), columns.angle.as_str()];
        let (mut rows, commands) = match &source.commands {
            None => {
                let mut rows = reading::rows(&sheet, columns, &names, &[command, angle])?;
                let commands = rows.values.remove(0);
                (rows, commands)
            }
            Some((_, sent)) => self.with_commands(&sheet, sent, &names, context)?,
        };
        let by = match columns.unit {
            AngleUnit::Rad => 1.0,
            AngleUnit::Deg => 1f64.to_radians(),
        };
        let scaled = |values: Vec<f64>| values.into_iter().map(|value| by * value).collect();
        let began = rows.time.first().copied().unwrap_or_default();
        let mut held_out = vec![false; rows.time.len()];
        for (range, usage) in &rows.usages {
            let usage = usage.as_deref().or(source.usage);
            let judges = usage.is_some_and(|usage| !self.on.iter().any(|on| on == usage));
            held_out[range.clone()].fill(judges);
        }
        for range in &rows.runs {
            self.hold_out(&rows.time, range, &mut held_out);
        }
        let trajectory = |rows: &std::ops::Range<usize>| Trajectory {
            rows: rows.clone(),
            began,
        };
        let recording = Recording {
            angle: scaled(rows.values.remove(0)),
            command: scaled(commands),
            trajectories: rows.runs.iter().map(trajectory).collect(),
            time: rows.time,
            held_out,
            period: 1.0 / file.command_rate_hz,
            encoder: file.joints.iter().map(|joint| joint.encoder_rad).collect(),
            noise: file.joints.iter().map(|joint| joint.noise_rad).collect(),
        };
        Ok((label, recording))
    }

    /// Rows of the angles with the commands that hold in them, which are in a file of their own.
    fn with_commands(
        &self,
        sheet: &Sheet,
        sent: &RawFile,
        names: &[String],
        context: &Context,
    ) -> Result<(Rows, Vec<f64>)> {
        let label = sheet.label;
        let (place, text) = context.text(sent, WHAT, MOST_BYTES)?;
        let sheet_of_commands = Sheet {
            label: &place,
            text: &text,
        };
        let columns = &self.columns;
        let mut sent = reading::rows(
            &sheet_of_commands,
            columns,
            names,
            &[columns.command.as_str()],
        )?;
        let mut rows = reading::rows(sheet, columns, names, &[columns.angle.as_str()])?;
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
        Ok((rows, commands))
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
