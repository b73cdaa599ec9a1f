//! Orders in which points and joints of two files are joined wrongly: shifted, reversed, or one of them sorted by name as text.

use super::pairs::{PointPairs, median};
use crate::criteria::setup::{FARTHEST, LONG, SHIFTS, SORTED};
use nalgebra::Vector3;

/// How the points stand beside the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RowOrder {
    /// The point of a row stands so many rows further on.
    Shifted(i64),
    Reversed,
    /// The points are sorted by name as text (1, 10, 11, 2), the joints are not; names count from `first`.
    PointsByText {
        first: usize,
    },
    /// The other way round.
    JointsByText {
        first: usize,
    },
}

impl RowOrder {
    /// Those that these rows, in their order, may be in.
    pub(crate) fn all(pairs: &PointPairs) -> Vec<Self> {
        let mut out = likely_shifts(pairs);
        out.push(Self::Reversed);
        if pairs.rows() >= *SORTED {
            out.extend(
                [1, 0]
                    .into_iter()
                    .flat_map(|first| [Self::PointsByText { first }, Self::JointsByText { first }]),
            );
        }
        out
    }

    /// The row of the point that belongs to the joints of each of `count` rows.
    pub(crate) fn partners(self, count: usize) -> Vec<usize> {
        let by_text = |first: usize| {
            let mut names: Vec<usize> = (first..first + count).collect();
            names.sort_by_key(usize::to_string);
            names
                .into_iter()
                .map(move |name| name - first)
                .collect::<Vec<usize>>()
        };
        match self {
            Self::Shifted(by) => (0..count)
                .map(|row| (row as i64 + by).rem_euclid(count.max(1) as i64) as usize)
                .collect(),
            Self::Reversed => (0..count).rev().collect(),
            Self::JointsByText { first } => by_text(first),
            Self::PointsByText { first } => {
                let mut out = vec![0; count];
                by_text(first)
                    .into_iter()
                    .enumerate()
                    .for_each(|(row, name)| out[name] = row);
                out
            }
        }
    }
}

/// The shifts by which the steps from point to point are most like those of the nominal arm: a rigid motion does not change them.
fn likely_shifts(pairs: &PointPairs) -> Vec<RowOrder> {
    let (robot, count) = (pairs.robot, pairs.rows());
    let model: Vec<Vector3<f64>> = (0..count)
        .map(|row| robot.forward(pairs.q(row)).translation)
        .collect();
    let (model, measured) = (steps(&model), steps(&pairs.points));
    let likeness = |shift: usize| {
        (0..count)
            .map(|row| model[row] * measured[(row + shift) % count])
            .sum::<f64>()
    };
    let tried = (1..count).filter(|shift| *shift.min(&(count - shift)) <= *FARTHEST);
    let mut all: Vec<(f64, usize)> = tried.map(|shift| (likeness(shift), shift)).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let signed = |shift: usize| {
        if 2 * shift > count {
            shift as i64 - count as i64
        } else {
            shift as i64
        }
    };
    all.into_iter()
        .take(*SHIFTS)
        .map(|(_, shift)| RowOrder::Shifted(signed(shift)))
        .collect()
}

/// Distances from each point to the next, the first being next to the last, less their mean.
fn steps(points: &[Vector3<f64>]) -> Vec<f64> {
    let next = points.iter().cycle().skip(1);
    let lengths: Vec<f64> = points
        .iter()
        .zip(next)
        .map(|(a, b)| (b - a).norm())
        .collect();
    let limit = *LONG * median(&lengths);
    let lengths: Vec<f64> = lengths
        .into_iter()
        .map(|length| length.min(limit))
        .collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
    lengths.into_iter().map(|length| length - mean).collect()
}

#[cfg(test)]
mod tests {
    use super::RowOrder;

    #[test]
    fn partners_undo_the_sorting_of_one_file() {
        // Sorted as text, 1 to 12 stand as 1, 10, 11, 12, 2, ..., 9.
        let points = RowOrder::PointsByText { first: 1 }.partners(12);
        assert_eq!(points, [0, 4, 5, 6, 7, 8, 9, 10, 11, 1, 2, 3]);
        let joints = RowOrder::JointsByText { first: 1 }.partners(12);
        assert_eq!(joints, [0, 9, 10, 11, 1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(RowOrder::Shifted(-1).partners(4), [3, 0, 1, 2]);
        assert_eq!(RowOrder::Reversed.partners(3), [2, 1, 0]);
    }
}
