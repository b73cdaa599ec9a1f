//! Duplicates within a file, and partners across several: every other file is joined to the first.

use super::held::{FileIds, NamedRow};
use super::layout::{Duplicates, Join};
use super::scan::Scan;
use std::collections::BTreeMap;

/// No partner.
pub(super) const NONE: u32 = u32::MAX;

/// Where the other row with the same id stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Twin {
    pub(crate) file: u32,
    pub(crate) line: u32,
    /// That row has the same values too, and is used.
    pub(crate) copied: bool,
}

/// What the files together decide about the usable rows of one of them.
#[derive(Default)]
pub(super) struct FileDecision {
    /// Rows given up as duplicates, by data row.
    pub(crate) twins: BTreeMap<u32, Twin>,
    /// For a join, the data row of each other file for each data row of the first, from 1; [`NONE`] where there is none. For the
    /// others that of the first alone, [`NONE`] also where that lacks another partner. Empty without a join.
    pub(crate) partners: Vec<Vec<u32>>,
}

impl FileDecision {
    /// Whether a data row, from 1, has all its partners.
    pub(crate) fn is_whole(&self, number: usize) -> bool {
        let row = number.wrapping_sub(1);
        self.partners
            .iter()
            .all(|partner| partner.get(row).is_some_and(|partner| *partner != NONE))
    }
}

/// Decides for all files. Files that continue each other share their ids.
pub(super) fn decide(
    scans: &[Scan],
    join: Option<&Join>,
    duplicates: Duplicates,
) -> Vec<FileDecision> {
    let mut decisions: Vec<FileDecision> = scans.iter().map(|_| FileDecision::default()).collect();
    let ids: Vec<(usize, &FileIds)> = scans.iter().map(|scan| &scan.ids).enumerate().collect();
    if let Some(Join::Append {}) | None = join {
        single(&ids, duplicates, &mut decisions);
        return decisions;
    }
    ids.chunks(1)
        .for_each(|one| single(one, duplicates, &mut decisions));
    let ([first, others @ ..], [one, decisions_of_others @ ..]) = (scans, decisions.as_mut_slice())
    else {
        return decisions;
    };
    for (index, (second, other)) in others.iter().zip(decisions_of_others.iter()).enumerate() {
        let pairs = match join {
            Some(Join::Id {}) => by_id((&first.ids, one), (&second.ids, other)),
            Some(Join::Time {
                tolerance_s,
                offset_s,
            }) => {
                let times =
                    |scan: &Scan, decision: &FileDecision, offset: f64| -> Vec<(f64, u32)> {
                        let rows = scan
                            .times
                            .iter()
                            .filter(|(_, number)| !decision.twins.contains_key(number));
                        rows.map(|(time, number)| (time - offset, *number))
                            .collect()
                    };
                // What comes third was made of the first, and has its clock.
                let offset = if index == 0 { *offset_s } else { 0.0 };
                by_time(
                    times(first, one, 0.0),
                    times(second, other, offset),
                    *tolerance_s,
                )
            }
            _ => {
                let usable = |scan: &Scan, decision: &FileDecision, number: u32| {
                    scan.usable
                        .get(number as usize - 1)
                        .copied()
                        .unwrap_or(false)
                        && !decision.twins.contains_key(&number)
                };
                let rows = 1..=first.read.min(second.read) as u32;
                rows.filter(|n| usable(first, one, *n) && usable(second, other, *n))
                    .map(|n| (n, n))
                    .collect()
            }
        };
        let mut partner = vec![NONE; first.read as usize];
        for (a, b) in pairs {
            partner[a as usize - 1] = b;
        }
        one.partners.push(partner);
    }
    for (k, (second, other)) in others.iter().zip(decisions_of_others).enumerate() {
        let mut back = vec![NONE; second.read as usize];
        for number in (1..=first.read as usize).filter(|number| one.is_whole(*number)) {
            back[one.partners[k][number - 1] as usize - 1] = number as u32;
        }
        other.partners.push(back);
    }
    decisions
}

/// A row with its id, and the index of its file.
type IdentifiedRow<'i> = (&'i [u8], usize, NamedRow);

/// The rows that are left of a file, by id; of equal ids in the order of the file. Ids that count upwards are in this order already.
fn by_name<'i>(
    files: &[(usize, &'i FileIds)],
    is_left: impl Fn(&NamedRow) -> bool,
) -> Vec<IdentifiedRow<'i>> {
    let all = files.iter();
    let mut rows: Vec<IdentifiedRow> = all
        .flat_map(|(file, ids)| ids.rows().map(move |(id, row)| (id, *file, row)))
        .filter(|(.., row)| is_left(row))
        .collect();
    rows.sort_by_key(|(id, ..)| (id.len(), *id));
    rows
}

/// Leaves one row of each id, or none, of files by their index. Copies of one row are one row: they do not contradict each other.
fn single(files: &[(usize, &FileIds)], duplicates: Duplicates, decisions: &mut [FileDecision]) {
    if duplicates == Duplicates::Keep {
        return;
    }
    for same in by_name(files, |_| true).chunk_by(|a, b| a.0 == b.0) {
        let [(.., first), _, ..] = same else {
            continue;
        };
        let copies = same.iter().all(|(.., row)| row.content == first.content);
        let stays = match duplicates {
            Duplicates::Reject if !copies => None,
            Duplicates::Last => Some(same.len() - 1),
            _ => Some(0),
        };
        for (k, (_, file, row)) in same.iter().enumerate().filter(|(k, _)| Some(*k) != stays) {
            let other = stays.unwrap_or(if k == 0 { same.len() - 1 } else { 0 });
            let (_, file_of_other, twin) = &same[other];
            if let Some(decision) = decisions.get_mut(*file) {
                decision.twins.insert(
                    row.number,
                    Twin {
                        file: *file_of_other as u32,
                        line: twin.line,
                        copied: stays.is_some() && twin.content == row.content,
                    },
                );
            }
        }
    }
}

/// Pairs of rows with one id; every id once.
fn by_id(first: (&FileIds, &FileDecision), second: (&FileIds, &FileDecision)) -> Vec<(u32, u32)> {
    let [mine, theirs] = [first, second].map(|(ids, decision)| {
        by_name(&[(0, ids)], |row| !decision.twins.contains_key(&row.number))
    });
    let (mut pairs, mut others) = (Vec::new(), theirs.iter().peekable());
    for (id, _, row) in &mine {
        let key = (id.len(), *id);
        while others
            .next_if(|(other, ..)| (other.len(), *other) < key)
            .is_some()
        {}
        if let Some((.., partner)) = others.next_if(|(other, ..)| other == id) {
            pairs.push((row.number, partner.number));
        }
    }
    pairs
}

/// Pairs of rows that are each other's nearest in time, not further apart than the tolerance. Of equally near rows the
/// earlier in the file counts.
fn by_time(
    mut first: Vec<(f64, u32)>,
    mut second: Vec<(f64, u32)>,
    tolerance: f64,
) -> Vec<(u32, u32)> {
    let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    first.sort_unstable_by(order);
    second.sort_unstable_by(order);
    let towards = nearest(&first, &second);
    let back = nearest(&second, &first);
    let mut pairs = Vec::new();
    for (index, (time, number)) in first.iter().enumerate() {
        let Some(other) = towards.get(index).copied().flatten() else {
            continue;
        };
        let mutual = back.get(other).copied().flatten() == Some(index);
        if let (true, Some((their, partner))) = (mutual, second.get(other))
            // Clock arithmetic in floating point must not lose a row that lies on the tolerance.
            && (time - their).abs() <= tolerance + 1e-9 * (1.0 + time.abs())
        {
            pairs.push((*number, *partner));
        }
    }
    pairs
}

/// For each time of `from` the index of the nearest in `to`; both sorted.
fn nearest(from: &[(f64, u32)], to: &[(f64, u32)]) -> Vec<Option<usize>> {
    // Of equal times the first stands for all: clocks that stand still must not cost a search of all rows for each row.
    let heads: Vec<usize> = (0..to.len())
        .filter(|index| *index == 0 || to[index - 1].0 != to[*index].0)
        .collect();
    let mut start = 0;
    from.iter()
        .map(|(time, _)| {
            while heads.get(start).is_some_and(|head| to[*head].0 < *time) {
                start += 1;
            }
            let around = [start.checked_sub(1), Some(start)]
                .into_iter()
                .flatten()
                .filter_map(|index| heads.get(index).copied());
            around.min_by(|a, b| {
                (to[*a].0 - time)
                    .abs()
                    .total_cmp(&(to[*b].0 - time).abs())
                    .then(to[*a].1.cmp(&to[*b].1))
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::row::RecordedRow;
    use super::*;

    fn times(times: &[f64]) -> Vec<(f64, u32)> {
        times
            .iter()
            .zip(1..)
            .map(|(time, number)| (*time, number))
            .collect()
    }

    #[test]
    fn rows_pair_with_their_mutual_nearest_in_time_only() {
        let pairs = by_time(times(&[1.0, 2.0, 2.2, 9.0]), times(&[0.9, 2.15, 5.0]), 0.25);
        assert_eq!(pairs, [(1, 1), (3, 2)]);
        assert_eq!(by_time(times(&[1.0]), times(&[1.5]), 0.5), [(1, 1)]);
        assert_eq!(by_time(times(&[1.0]), times(&[1.6]), 0.5), []);
        assert_eq!(by_time(times(&[]), times(&[1.6]), 0.5), []);
    }

    #[test]
    fn clocks_that_stand_still_pair_one_row_in_linear_time() {
        let still = times(&vec![2.0e13; 200_000]);
        assert_eq!(by_time(still.clone(), still, 1.0), [(1, 1)]);
    }

    #[test]
    fn ids_find_each_other_in_any_order() {
        let ids = |names: &[&str]| {
            let mut ids = FileIds::default();
            for (name, number) in names.iter().zip(1..) {
                ids.push(
                    &RecordedRow {
                        id: (*name).into(),
                        number,
                        ..RecordedRow::default()
                    },
                    number,
                    "a.csv",
                )
                .unwrap();
            }
            ids
        };
        let pairs = |one: &[&str], other: &[&str]| {
            by_id(
                (&ids(one), &FileDecision::default()),
                (&ids(other), &FileDecision::default()),
            )
        };
        assert_eq!(
            pairs(&["A", "B", "C", "D"], &["X", "A", "B", "D", "C"]),
            [(1, 2), (2, 3), (3, 5), (4, 4)]
        );
        assert_eq!(pairs(&["A", "Q", "B"], &["A", "B", "C"]), [(1, 1), (3, 2)]);
        assert_eq!(pairs(&["A"], &[]), []);
    }
}
