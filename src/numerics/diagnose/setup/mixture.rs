//! Two set-ups in one recording: rows of two robots, or of one whose base, tool or tracker was changed on the way, read as one.

use super::placement::{Placement, place};
use super::words::mm;
use crate::criteria::setup::{BETTER, FAR, FEWEST, MIXED_ROUNDS, MIXED_SHARE};
use crate::error::counted;
use crate::setup::placement::PointPairs;
use crate::statistics::nearest as quantile;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Ranges of rows that are listed.
const LISTED: usize = 4;

/// Rows of a recording, from 0, by the set-up that they belong to, and what each leaves.
pub(super) struct TwoSetups {
    rows: [Vec<usize>; 2],
    placed: [Placement; 2],
    /// Within what the one placement and both together have most points, m.
    before: f64,
    pub(crate) left: f64,
}

impl TwoSetups {
    /// The two set-ups of pairs, beside their one placement; none where two do not explain what it leaves.
    pub(crate) fn of(pairs: &PointPairs, one: &Placement) -> Option<Self> {
        let found = starts(pairs, one)
            .into_iter()
            .filter_map(|start| dealt(pairs, start, most(&one.off)));
        let best = found.min_by(|a, b| a.left.total_cmp(&b.left))?;
        // Two placements have twice the numbers of one.
        (2.0 * *BETTER * best.left < best.before).then_some(best)
    }

    /// All rows of a recording, of which `numbers` are those of the pairs, by the placement that has them nearest.
    pub(crate) fn with_all_rows(self, all: &PointPairs, numbers: &[usize]) -> Self {
        let numbered = |part: Vec<usize>| part.into_iter().map(|k| numbers[k]).collect();
        let rows = nearest(all, &self.placed).map(numbered);
        Self { rows, ..self }
    }

    /// What is wrong and what to do; rows count from 1.
    pub(crate) fn words(&self) -> String {
        let [one, other] = &self.placed;
        let (base, tool) = (one.base_apart(other), one.tool_apart(other));
        let lists = self
            .rows
            .each_ref()
            .map(|rows| format!("{} ({})", listed(rows), counted(rows.len(), "row")));
        format!(
            "two set-ups are in one recording: rows {} belong to one, rows {} to the other, whose base stands {} from that of the first and \
             whose tool point {}; placed as one the nominal robot has nine points in ten within {}, placed as two within {}. Remedy: read each as a \
             recording of its own, with a stage `ingest` each; where the base or the tool was moved on the way, measure again from there",
            lists[0],
            lists[1],
            mm(base),
            mm(tool),
            mm(self.before),
            mm(self.left)
        )
    }
}

/// Whether so many rows lie farther off than `limit` (m) that they may be a set-up of their own.
pub(super) fn is_in_parts(off: &[f64], limit: f64) -> bool {
    off.iter().filter(|off| **off > limit).count() >= fewest(off.len())
}

fn fewest(rows: usize) -> usize {
    FEWEST.max((*MIXED_SHARE * rows as f64) as usize)
}

/// Nine lengths in ten are no more than this.
fn most(lengths: &[f64]) -> f64 {
    quantile(&mut lengths.to_vec(), 1.0 - *MIXED_SHARE).unwrap_or(f64::INFINITY)
}

/// Where rows might part: in stretches, in turn, or by where one placement misses them, in the tracker's frame and the tool's.
fn starts(pairs: &PointPairs, one: &Placement) -> Vec<Vec<bool>> {
    let rows = pairs.rows();
    let mut out: Vec<Vec<bool>> = (1..8)
        .map(|part| (0..rows).map(|row| 8 * row < part * rows).collect())
        .collect();
    out.push((0..rows).map(|row| row % 2 == 0).collect());
    // The rows that one placement has, and those that it leaves to another.
    let near = one.off.iter().map(|off| *off <= *FAR * one.left);
    out.push(near.collect());
    let [missed, turned] = one.missed(pairs);
    out.extend([missed, turned].iter().map(|all| along_most(all)));
    out
}

/// Whether vectors point along the direction in which they differ most.
fn along_most(all: &[Vector3<f64>]) -> Vec<bool> {
    let mean = all.iter().sum::<Vector3<f64>>() / all.len().max(1) as f64;
    let apart = all.iter().map(|one| one - mean);
    let spread: Matrix3<f64> = apart.clone().map(|one| one * one.transpose()).sum();
    let axes = SymmetricEigen::new(spread);
    let along = axes.eigenvectors.column(axes.eigenvalues.imax());
    apart.map(|one| one.dot(&along) > 0.0).collect()
}

fn nearest(pairs: &PointPairs, placed: &[Placement; 2]) -> [Vec<usize>; 2] {
    let [one, other] = placed.each_ref().map(|placed| {
        let [missed, _] = placed.missed(pairs);
        missed
            .iter()
            .map(|missed| missed.norm())
            .collect::<Vec<f64>>()
    });
    (0..pairs.rows())
        .partition::<Vec<usize>, _>(|row| one[*row] <= other[*row])
        .into()
}

fn dealt(pairs: &PointPairs, first: Vec<bool>, before: f64) -> Option<TwoSetups> {
    let fewest = fewest(pairs.rows());
    let mut rows: [Vec<usize>; 2] = (0..pairs.rows())
        .partition::<Vec<usize>, _>(|row| first[*row])
        .into();
    for _ in 0..*MIXED_ROUNDS {
        if rows.iter().any(|part| part.len() < fewest) {
            return None;
        }
        let placed = rows.each_ref().map(|part| place(&pairs.only(part), None));
        let next = nearest(pairs, &placed);
        if next == rows {
            let off = placed.iter().flat_map(|one| one.off.iter().copied());
            let off: Vec<f64> = off.collect();
            return Some(TwoSetups {
                rows,
                before,
                left: most(&off),
                placed,
            });
        }
        rows = next;
    }
    None
}

/// Rows from 1 as ranges: `1 to 36`, `1, 3, 5, ...`.
fn listed(rows: &[usize]) -> String {
    let mut ranges: Vec<[usize; 2]> = Vec::new();
    for row in rows {
        match ranges.last_mut() {
            Some(last) if last[1] + 1 == *row => last[1] = *row,
            _ => ranges.push([*row, *row]),
        }
    }
    let words = |[from, to]: &[usize; 2]| match from == to {
        true => (from + 1).to_string(),
        false => format!("{} to {}", from + 1, to + 1),
    };
    let more = if ranges.len() > LISTED { ", ..." } else { "" };
    let shown = ranges.iter().take(LISTED).map(words);
    format!("{}{more}", shown.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_listed_as_ranges() {
        assert_eq!(listed(&[0, 1, 2, 7]), "1 to 3, 8");
        assert_eq!(listed(&[0, 2, 4, 6, 8, 10]), "1, 3, 5, 7, ...");
    }
}
