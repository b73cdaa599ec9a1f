//! Duplicates within a file, and partners across several: every other file is joined to the first.

use crate::ingest::Ingest;
use crate::ingest::arm::RobotJoints;
use crate::ingest::columns::{Duplicates, Join};
use crate::ingest::refusal::{Reason, RowRefusal};
use crate::ingest::rows::{FileRows, GivenUp};
use crate::observation::{KINDS, Part};
use std::collections::{BTreeSet, HashMap};

/// By file but the first, the row that belongs to each row of the first. Empty without a join.
pub(super) type Partners = Vec<Vec<Option<usize>>>;

/// Gives up duplicates and rows without partners. Ids count within their file; of files that continue each other copies are one row.
pub(super) fn decide(files: &mut [FileRows], settings: &Ingest, time: usize) -> Partners {
    let joined = settings.is_joined();
    let count = files.len();
    for file in 0..count {
        for (row, duplicate) in duplicates(files, file, settings.duplicates) {
            files[file].given_up.insert(row, duplicate);
        }
    }
    if !joined && settings.duplicates != Duplicates::Keep {
        for (file, row, copy) in copies(files) {
            files[file].given_up.insert(row, copy);
        }
    }
    let Some((first, others)) = files.split_first_mut().filter(|_| joined) else {
        return Vec::new();
    };
    let mut partners = Partners::new();
    for (index, other) in others.iter().enumerate() {
        let times = |rows: &FileRows, offset: f64| -> Vec<(f64, usize)> {
            let used = rows.usable().filter(|row| rows.is_used(*row));
            used.map(|row| (rows.value(row, time) - offset, row))
                .collect()
        };
        let pairs = match &settings.join {
            Some(Join::Time {
                tolerance_s,
                offset_s,
            }) => {
                // What comes third was made of the first, and has its clock.
                let offset = if index == 0 { *offset_s } else { 0.0 };
                by_time(times(first, 0.0), times(other, offset), *tolerance_s)
            }
            Some(Join::Id {}) => by_id(first, other),
            _ => {
                let both = |row: &usize| first.is_used(*row) && other.is_used(*row);
                let rows = (0..first.count()).filter(both);
                rows.map(|row| (row, row)).collect()
            }
        };
        let mut partner = vec![None; first.count()];
        for (a, b) in pairs {
            partner[a] = Some(b);
        }
        partners.push(partner);
    }
    let lonely = |row: usize| partners.iter().position(|partner| partner[row].is_none());
    for row in 0..first.count() {
        if let Some(other) = lonely(row).filter(|_| first.is_used(row)) {
            first
                .given_up
                .insert(row, GivenUp::Unmatched { file: other + 1 });
        }
    }
    for (other, partner) in others.iter_mut().zip(&partners) {
        let rows = (0..first.count()).filter(|row| first.is_used(*row));
        let matched: BTreeSet<usize> = rows.filter_map(|row| partner[row]).collect();
        for row in (0..other.count()).filter(|row| !matched.contains(row)) {
            if other.is_used(row) {
                other.given_up.insert(row, GivenUp::Unmatched { file: 0 });
            }
        }
    }
    partners
}

/// All rows of each id of a file but one, or all. Copies of one row are one row: they do not contradict each other.
fn duplicates(files: &[FileRows], file: usize, duplicates: Duplicates) -> Vec<(usize, GivenUp)> {
    let mut given_up = Vec::new();
    if duplicates == Duplicates::Keep {
        return given_up;
    }
    let all = &files[file];
    let mut rows: Vec<(&str, usize)> = all.usable().map(|row| (all.id(row), row)).collect();
    rows.retain(|(id, _)| !id.is_empty());
    // Ids that count upwards are in this order already.
    rows.sort_by_key(|(id, _)| (id.len(), *id));
    let of_one_id = rows.chunk_by(|a, b| a.0 == b.0);
    for same in of_one_id.filter(|same| same.len() > 1) {
        let copies = |k: usize, other: usize| all.says_same(same[k].1, all, same[other].1);
        let stays = match duplicates {
            Duplicates::Reject if !(1..same.len()).all(|k| copies(k, 0)) => None,
            Duplicates::Last => Some(same.len() - 1),
            _ => Some(0),
        };
        for (k, (_, row)) in same.iter().enumerate().filter(|(k, _)| Some(*k) != stays) {
            let other = stays.unwrap_or(if k == 0 { same.len() - 1 } else { 0 });
            let why = GivenUp::Duplicate {
                file,
                row: same[other].1,
                copied: stays.is_some() && copies(k, other),
            };
            given_up.push((*row, why));
        }
    }
    given_up
}

/// Rows that an earlier file has too, with the same id and the same values; in every file an id is used once.
fn copies(files: &[FileRows]) -> Vec<(usize, usize, GivenUp)> {
    let mut seen: HashMap<&str, Vec<(usize, usize)>> = HashMap::new();
    let mut out = Vec::new();
    for (file, rows) in files.iter().enumerate() {
        for row in rows.usable().filter(|row| rows.is_used(*row)) {
            if rows.id(row).is_empty() {
                continue;
            }
            let earlier = seen.entry(rows.id(row)).or_default();
            let mut twins = earlier.iter();
            match twins.find(|(other, twin)| rows.says_same(row, &files[*other], *twin)) {
                Some((other, twin)) => {
                    let (other, twin) = (*other, *twin);
                    let why = GivenUp::Duplicate {
                        file: other,
                        row: twin,
                        copied: true,
                    };
                    out.push((file, row, why));
                }
                None => earlier.push((file, row)),
            }
        }
    }
    out
}

/// Pairs of rows with one id; every id stands once in a file.
fn by_id(first: &FileRows, second: &FileRows) -> Vec<(usize, usize)> {
    fn used(rows: &FileRows) -> impl Iterator<Item = usize> {
        let used = rows.usable();
        used.filter(move |row| rows.is_used(*row) && !rows.id(*row).is_empty())
    }
    let others: HashMap<&str, usize> = used(second).map(|row| (second.id(row), row)).collect();
    let pair = |row: usize| Some((row, *others.get(first.id(row))?));
    used(first).filter_map(pair).collect()
}

/// Pairs of rows that are each other's nearest in time, not further apart than the tolerance. Of equally near rows the
/// earlier in the file counts.
fn by_time(
    mut first: Vec<(f64, usize)>,
    mut second: Vec<(f64, usize)>,
    tolerance: f64,
) -> Vec<(usize, usize)> {
    let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    first.sort_unstable_by(order);
    second.sort_unstable_by(order);
    let (towards, back) = (nearest(&first, &second), nearest(&second, &first));
    let pair = |(index, (time, row)): (usize, &(f64, usize))| {
        let other = towards[index].filter(|other| back[*other] == Some(index))?;
        let (their, partner) = second[other];
        // Clock arithmetic in floating point must not lose a row that lies on the tolerance.
        let near = (time - their).abs() <= tolerance + 1e-9 * (1.0 + time.abs());
        near.then_some((*row, partner))
    };
    first.iter().enumerate().filter_map(pair).collect()
}

/// For each time of `from` the index of the nearest in `to`; both sorted.
fn nearest(from: &[(f64, usize)], to: &[(f64, usize)]) -> Vec<Option<usize>> {
    // Of equal times the first stands for all: clocks that stand still must not cost a search of all rows for each row.
    let is_head = |index: &usize| *index == 0 || to[index - 1].0 != to[*index].0;
    let heads: Vec<usize> = (0..to.len()).filter(is_head).collect();
    let mut start = 0;
    let nearest = |(time, _): &(f64, usize)| {
        while heads.get(start).is_some_and(|head| to[*head].0 < *time) {
            start += 1;
        }
        let around = &heads[start.saturating_sub(1)..heads.len().min(start + 1)];
        let apart = |index: usize| (to[index].0 - time).abs();
        around.iter().copied().min_by(|a, b| {
            let nearer = apart(*a).total_cmp(&apart(*b));
            nearer.then(to[*a].1.cmp(&to[*b].1))
        })
    };
    from.iter().map(nearest).collect()
}

/// All files of a measurement, as they were read, and what they decide together.
pub(super) struct Measurement<'a> {
    pub settings: &'a Ingest,
    pub arm: &'a RobotJoints,
    pub files: Vec<FileRows>,
    pub partners: Partners,
    pub names: &'a [String],
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
                let mut line = self.files[other].line(twin).to_string();
                if other != file {
                    line.push_str(&format!(" of {}", self.names[other]));
                }
                if copied {
                    let detail = format!("a copy of line {line}: the same id, the same values");
                    (Reason::DuplicateRow, detail)
                } else {
                    let detail = format!("point id `{id}` also stands on line {line}");
                    (Reason::DuplicateId, detail)
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
        RowRefusal::new(reason, detail)
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
        let named = seen.map(|((at, name), point)| (at, name.as_str(), *point));
        Some(named.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(times: &[f64]) -> Vec<(f64, usize)> {
        times
            .iter()
            .zip(1..)
            .map(|(time, row)| (*time, row))
            .collect()
    }

    #[test]
    fn clocks_that_stand_still_pair_one_row_in_linear_time() {
        let still = times(&vec![2.0e13; 200_000]);
        assert_eq!(by_time(still.clone(), still, 1.0), [(1, 1)]);
    }
}
