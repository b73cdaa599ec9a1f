//! What all files of a measurement give and decide together: which rows are used, and what belongs to which.

use super::Ingest;
use super::arm::RobotJoints;
use super::held::HeldRows;
use super::layout::Join;
use super::pair::{FileDecision, NONE};
use super::refusal::{Reason, RowRefusal};
use super::row::RecordedRow;
use super::scan::Scan;
use crate::observation::{KINDS, Part};

/// What all files give and decide together.
pub(super) struct JoinDecisions<'a> {
    pub(crate) settings: &'a Ingest,
    pub(crate) arm: &'a RobotJoints,
    pub(crate) scans: &'a [Scan],
    pub(crate) decisions: &'a [FileDecision],
    /// Names of the files in tables.
    pub(crate) names: &'a [String],
}

impl JoinDecisions<'_> {
    /// Files whose rows are those of the recording: of joined ones the first.
    pub(super) fn leading(&self) -> usize {
        let joined = self
            .decisions
            .iter()
            .any(|decision| !decision.partners.is_empty());
        if joined { 1 } else { self.scans.len() }
    }
    /// Why a usable row is not used after all, if so.
    pub(super) fn outcome(
        &self,
        index: usize,
        decision: &FileDecision,
        row: &RecordedRow,
    ) -> Result<(), RowRefusal> {
        if let Some(twin) = u32::try_from(row.number)
            .ok()
            .and_then(|number| decision.twins.get(&number))
        {
            let there = if twin.file as usize == index {
                String::new()
            } else {
                format!(" of {}", self.name(twin.file as usize))
            };
            return Err(if twin.copied {
                let detail = format!(
                    "a copy of line {}{there}: the same id, the same values",
                    twin.line
                );
                RowRefusal {
                    reason: Reason::DuplicateRow,
                    detail,
                }
            } else {
                let detail = format!(
                    "point id `{}` also stands on line {}{there}",
                    row.id, twin.line
                );
                RowRefusal {
                    reason: Reason::DuplicateId,
                    detail,
                }
            });
        }
        if decision.is_whole(row.number as usize) {
            return Ok(());
        }
        let lacks = |partner: &Vec<u32>| {
            partner
                .get((row.number - 1) as usize)
                .is_none_or(|partner| *partner == NONE)
        };
        let other = decision.partners.iter().position(lacks).unwrap_or_default();
        let other = if index == 0 {
            self.name(other + 1)
        } else {
            self.name(0)
        };
        Err(RowRefusal {
            reason: Reason::Unmatched,
            detail: self.without_partner(other, index, row),
        })
    }
    /// The data row of file `file` that is part of a row of file `index`.
    pub(super) fn number(
        &self,
        file: usize,
        index: usize,
        row: &RecordedRow,
        decision: &FileDecision,
    ) -> Option<u64> {
        if file == index {
            return Some(row.number);
        }
        let partner = decision
            .partners
            .get(file.checked_sub(1)?)?
            .get((row.number - 1) as usize)?;
        (*partner != NONE).then_some(u64::from(*partner))
    }
    /// The rows of the other files that belong to a row of the first, and where they are.
    pub(super) fn partners(
        &self,
        row: &RecordedRow,
        decision: &FileDecision,
    ) -> impl Iterator<Item = (usize, &HeldRows)> {
        decision
            .partners
            .iter()
            .zip(self.scans.iter().skip(1))
            .filter_map(|(partner, scan)| {
                let number = partner.get((row.number - 1) as usize)?.checked_sub(1)?;
                Some((number as usize, &scan.held))
            })
    }
    /// When file `file` recorded its part of a row of the first file, s by the first one's clock.
    fn moment(&self, file: usize, row: &RecordedRow, decision: &FileDecision) -> Option<f64> {
        let time = self.arm.slots.time;
        let Some(Join::Time { offset_s, .. }) = &self.settings.join else {
            return None;
        };
        if file == 0 {
            return row.values.get(time).copied();
        }
        let held = &self.scans.get(file)?.held;
        let slot = held.places.iter().position(|slot| *slot == time)?;
        let at = (self.number(file, 0, row, decision)? as usize - 1) * held.places.len() + slot;
        Some(held.values.get(at)? - if file == 1 { *offset_s } else { 0.0 })
    }
    /// How much later (s) than its joints the point of a row was measured.
    pub(super) fn later(
        &self,
        moving: usize,
        row: &RecordedRow,
        decision: &FileDecision,
    ) -> Option<f64> {
        // Asked of every row.
        if !matches!(self.settings.join, Some(Join::Time { .. })) {
            return None;
        }
        let values = || KINDS.iter().flat_map(|kind| kind.columns(Part::Value));
        let files = &self.settings.files;
        let point = files
            .iter()
            .position(|file| values().any(|column| file.has(column.setting)))?;
        let later = self.moment(point, row, decision)? - self.moment(moving, row, decision)?;
        Some(later).filter(|later| later.is_finite())
    }
    /// The targets that were seen in a wide row of file `index`, or in its partner: which, from 1, by name, where. None for other rows.
    pub(super) fn points(
        &self,
        index: usize,
        row: &RecordedRow,
        decision: &FileDecision,
    ) -> Option<Vec<(i64, &String, [f64; 3])>> {
        let files = &self.settings.files;
        let wide = |file: &usize| {
            files
                .get(*file)
                .is_some_and(|layout| layout.targets.is_some())
        };
        let file = if decision.partners.is_empty() {
            Some(index).filter(wide)
        } else {
            (0..files.len()).find(wide)
        }?;
        let names = files.get(file)?.targets.as_ref()?.columns.keys();
        let points = if file == index {
            row.points.as_slice()
        } else {
            let at = (self.number(file, index, row, decision)? as usize - 1) * names.len();
            self.scans
                .get(file)?
                .held
                .points
                .get(at..at + names.len())?
        };
        let seen = names
            .zip(points)
            .zip(1..)
            .filter(|((_, point), _)| !point[0].is_nan());
        Some(seen.map(|((name, point), at)| (at, name, *point)).collect())
    }
    fn name(&self, index: usize) -> &str {
        self.names.get(index).map_or("", String::as_str)
    }
    /// A row of file `index` has no partner in the file named `other`, or that none in a third.
    fn without_partner(&self, other: &str, index: usize, row: &RecordedRow) -> String {
        let other = if index > 0 && self.names.len() > 2 {
            format!("{other} (joined to all files)")
        } else {
            other.into()
        };
        match &self.settings.join {
            Some(Join::Id {}) => format!("no usable row of {other} has the point id `{}`", row.id),
            Some(Join::Time { tolerance_s, .. }) => {
                let time = row
                    .values
                    .get(self.arm.slots.time)
                    .copied()
                    .unwrap_or(f64::NAN);
                format!("{other} has no row within {tolerance_s} s of {time} s")
            }
            _ => format!("data row {} of {other} is missing or rejected", row.number),
        }
    }
}
