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
pub const STILL: f64 = 2e-5;

/// Whether all joints are closer than `limit`.
pub fn near(a: &[f64], b: &[f64], limit: f64) -> bool {
    a.iter().zip(b).all(|(x, y)| (x - y).abs() < limit)
}

/// Groups of rows whose joints are closer than `limit` to those of the group's first row; by first rows, rows ascending.
/// `same` says what else two rows of a group share.
pub fn grouped<'a>(
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
