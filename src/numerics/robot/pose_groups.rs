//! Rows of one pose, by their joints: the same to the last digit, or as near as joints come back to where they were.
//!
//! Between near poses the arm of the robot file moves the point by J dq; with lengths and axes good to a thousandth the difference of
//! two measured points less that motion is off by less than a micrometre, so that they are repeats of each other.

use std::collections::BTreeMap;

/// Joint positions (rad or m) closer than this are one command: below any controller's resolution.
pub const SAME: f64 = 1e-9;
/// Joint positions (0.03 deg in rad; m) closer than this are one pose: a joint comes back to it, or rests in it, to less.
pub const NEAR: f64 = 5.3e-4;
/// Between logs of a joint (rad or m) closer than this it has not moved: what encoders of a halted arm show.
pub(crate) const STILL: f64 = 2e-5;

/// Whether all joints are closer than `limit`.
pub fn near(a: &[f64], b: &[f64], limit: f64) -> bool {
    a.iter().zip(b).all(|(x, y)| (x - y).abs() < limit)
}

/// Groups of rows whose joints are closer than `limit` to those of the group's first row; by first rows, rows ascending.
/// `same` says what else two rows of a group share.
pub(crate) fn grouped<'a>(
    rows: &[usize],
    q: impl Fn(usize) -> &'a [f64],
    limit: f64,
    same: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<usize>> {
    // On a line askew to all joints near poses are near, and few others: also of a grid.
    let along = |row: usize| {
        q(row)
            .iter()
            .zip(1..)
            .map(|(value, k)| value * weight(k))
            .sum::<f64>()
    };
    let reach = limit * q_len(rows, &q).map_or(0.0, |joints| (1..=joints).map(weight).sum());
    let mut sorted: Vec<(f64, usize)> = rows.iter().map(|row| (along(*row), *row)).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let place: BTreeMap<usize, usize> = sorted
        .iter()
        .enumerate()
        .map(|(at, (_, row))| (*row, at))
        .collect();
    let mut taken = vec![false; sorted.len()];
    let mut groups = Vec::new();
    for (row, at) in place {
        if std::mem::replace(&mut taken[at], true) {
            continue;
        }
        let mut group = vec![row];
        let middle = sorted[at].0;
        let below = (0..at).rev().take_while(|k| middle - sorted[*k].0 <= reach);
        let above = (at + 1..sorted.len()).take_while(|k| sorted[*k].0 - middle <= reach);
        for k in below.chain(above) {
            let other = sorted[k].1;
            if !taken[k] && same(row, other) && near(q(row), q(other), limit) {
                taken[k] = true;
                group.push(other);
            }
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// Multiples of the golden ratio, between a half and one and a half.
fn weight(k: usize) -> f64 {
    0.5 + (k as f64 * 0.618_033_988_749_895).fract()
}

fn q_len<'a>(rows: &[usize], q: &impl Fn(usize) -> &'a [f64]) -> Option<usize> {
    rows.first().map(|row| q(*row).len())
}

/// Rows by time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sequence {
    rows: Vec<usize>,
    /// Place of each row by time.
    places: Vec<usize>,
}

/// Rows are in no order of time where more than one step in so many goes back in time: clocks that were set anew do so a few times.
const BACK: usize = 10;
/// Fewer steps back are those of a file of one target after the other, where by time so many fewer stops are made.
const STOPS: f64 = 0.7;

impl Sequence {
    /// The order of rows whose `time` (s, of each) is far from their order in the file; none where they follow each other, or two
    /// recordings do whose clocks begin anew. `near` says whether two rows are of one pose.
    pub fn by_time(time: &[f64], near: impl Fn(usize, usize) -> bool) -> Option<Self> {
        let back = time.windows(2).filter(|pair| pair[1] < pair[0]).count();
        if back == 0 || time.iter().any(|time| !time.is_finite()) {
            return None;
        }
        let mut rows: Vec<usize> = (0..time.len()).collect();
        rows.sort_by(|a, b| time[*a].total_cmp(&time[*b]));
        let stops = |order: &[usize]| {
            1 + order
                .windows(2)
                .filter(|pair| !near(pair[0], pair[1]))
                .count()
        };
        let fewer = || (stops(&rows) as f64) < STOPS * stops(&Vec::from_iter(0..time.len())) as f64;
        if BACK * back <= time.len() && !fewer() {
            return None;
        }
        let mut places = vec![0; rows.len()];
        rows.iter()
            .enumerate()
            .for_each(|(place, row)| places[*row] = place);
        Some(Self { rows, places })
    }

    /// The row at a place of the order.
    pub(crate) fn row(&self, place: usize) -> usize {
        self.rows[place]
    }

    /// The place of a row.
    pub(crate) fn rank_in_time(&self, row: usize) -> usize {
        self.places[row]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_poses_are_one_and_others_are_not() {
        let all = [
            [0.1, 2.0],
            [0.1 + 4e-4, 2.0 - 4e-4],
            [0.1 + 4e-4, 2.0 + 6e-4],
            [1.0, 2.0],
            [0.1, 2.0],
        ];
        let rows: Vec<usize> = (0..all.len()).collect();
        let groups = |limit: f64| grouped(&rows, |row| &all[row][..], limit, |_, _| true);
        assert_eq!(groups(NEAR), [vec![0, 1, 4], vec![2], vec![3]]);
        assert_eq!(groups(SAME), [vec![0, 4], vec![1], vec![2], vec![3]]);
        let apart = grouped(
            &rows,
            |row| &all[row][..],
            NEAR,
            |a, b| (a == 4) == (b == 4),
        );
        assert_eq!(apart, [vec![0, 1], vec![2], vec![3], vec![4]]);
    }
}

#[cfg(test)]
mod sequence_tests {
    use super::*;

    #[test]
    fn rows_by_name_have_an_order_of_measurement_and_clocks_that_begin_anew_do_not() {
        let by_name = [50.0, 10.0, 40.0, 0.0, 20.0, 30.0];
        let sequence = Sequence::by_time(&by_name, |_, _| false).expect("an order");
        assert_eq!(
            (0..6).map(|place| sequence.row(place)).collect::<Vec<_>>(),
            [3, 1, 4, 5, 2, 0]
        );
        assert_eq!(
            (0..6)
                .map(|row| sequence.rank_in_time(row))
                .collect::<Vec<_>>(),
            [5, 1, 4, 0, 2, 3]
        );
        let in_order: Vec<f64> = (0..40).map(f64::from).collect();
        let twice: Vec<f64> = in_order.iter().chain(&in_order).copied().collect();
        for time in [&in_order, &twice, &[f64::NAN; 40].to_vec()] {
            assert_eq!(Sequence::by_time(time, |_, _| false), None);
        }
    }

    #[test]
    fn targets_one_after_the_other_are_brought_together_where_they_are_of_one_pose() {
        let time: Vec<f64> = (0..3)
            .flat_map(|target| (0..30).map(move |pose| f64::from(60 * pose + 10 * target)))
            .collect();
        let sequence = Sequence::by_time(&time, |a, b| a % 30 == b % 30).expect("an order");
        assert_eq!(
            (0..6).map(|place| sequence.row(place)).collect::<Vec<_>>(),
            [0, 30, 60, 1, 31, 61]
        );
        assert_eq!(Sequence::by_time(&time, |_, _| false), None);
    }
}
