//! A measurement: its files, and which rows of them are one row of the recording.

use super::Ingest;
use super::arm::RobotJoints;
use super::layout::Join;
use super::pair::Partners;
use super::refusal::{Reason, RowRefusal};
use super::rows::{FileRows, GivenUp};
use crate::observation::{KINDS, Part};

/// All files of a measurement, as they were read, and what they decide together.
pub(super) struct Measurement<'a> {
    pub(crate) settings: &'a Ingest,
    pub(crate) arm: &'a RobotJoints,
    pub(crate) files: Vec<FileRows>,
    pub(crate) partners: Partners,
    pub(crate) names: &'a [String],
}

/// Rows of files that are one row of the recording: file and row, from 0, the first being the one that leads.
pub(super) type JoinedRow = [(usize, usize)];

impl Measurement<'_> {
    /// Files whose rows are those of the recording: of joined ones the first.
    pub(super) fn leading(&self) -> &[FileRows] {
        match self.settings.is_joined() {
            true => &self.files[..1],
            false => &self.files,
        }
    }
    /// The parts of a used row of a file that leads.
    pub(super) fn joined(&self, file: usize, row: usize) -> Vec<(usize, usize)> {
        let others = (1..).zip(&self.partners);
        let others = others.filter_map(|(file, partner)| Some((file, partner[row]?)));
        std::iter::once((file, row)).chain(others).collect()
    }
    /// Why row `row` of a file is not used although it can be.
    pub(super) fn refusal(&self, file: usize, row: usize, why: GivenUp) -> RowRefusal {
        let rows = &self.files[file];
        let id = rows.id(row);
        let (reason, detail) = match why {
            GivenUp::Duplicate {
                file: other,
                row: twin,
                copied,
            } => {
                let line = self.files[other].line(twin);
                let there = match other == file {
                    true => String::new(),
                    false => format!(" of {}", self.names[other]),
                };
                match copied {
                    true => (
                        Reason::DuplicateRow,
                        format!("a copy of line {line}{there}: the same id, the same values"),
                    ),
                    false => (
                        Reason::DuplicateId,
                        format!("point id `{id}` also stands on line {line}{there}"),
                    ),
                }
            }
            GivenUp::Unmatched { file: other } => {
                let mut other = self.names[other].clone();
                if file > 0 && self.names.len() > 2 {
                    other.push_str(" (joined to all files)");
                }
                let detail = match &self.settings.join {
                    Some(Join::Id {}) => {
                        format!("no usable row of {other} has the point id `{id}`")
                    }
                    Some(Join::Time { tolerance_s, .. }) => {
                        let time = rows.value(row, self.arm.slots.time);
                        format!("{other} has no row within {tolerance_s} s of {time} s")
                    }
                    _ => format!("data row {} of {other} is missing or rejected", row + 1),
                };
                (Reason::Unmatched, detail)
            }
        };
        RowRefusal { reason, detail }
    }
    /// How much later (s) than its joints, of the file `moving`, the point of a row was measured; none where files are not joined by time.
    pub(super) fn later(&self, moving: usize, joined: &JoinedRow) -> Option<f64> {
        let Some(Join::Time { offset_s, .. }) = &self.settings.join else {
            return None;
        };
        let values = || KINDS.iter().flat_map(|kind| kind.columns(Part::Value));
        let mut files = self.settings.files.iter();
        let point = files.position(|file| values().any(|column| file.has(column.setting)))?;
        // By the clock of the first file.
        let moment = |file: usize| {
            let (_, row) = joined.iter().find(|(part, _)| *part == file)?;
            let offset = if file == 1 { *offset_s } else { 0.0 };
            Some(self.files[file].value(*row, self.arm.slots.time) - offset)
        };
        Some(moment(point)? - moment(moving)?).filter(|later| later.is_finite())
    }
    /// The targets that were seen in a row where one of its files is wide: which, from 1, by name, where. None for other rows.
    pub(super) fn points(&self, joined: &JoinedRow) -> Option<Vec<(i64, &str, [f64; 3])>> {
        let (targets, points) = joined.iter().find_map(|(file, row)| {
            let targets = self.settings.files[*file].targets.as_ref()?;
            Some((targets, self.files[*file].points(*row)))
        })?;
        let all = (1..).zip(targets.columns.keys()).zip(points);
        let seen = all.filter(|(_, point)| !point[0].is_nan());
        Some(
            seen.map(|((at, name), point)| (at, name.as_str(), *point))
                .collect(),
        )
    }
}
