//! Rows of which one in a fit makes the others no test: those of a pose, and neighbours on a path, where rows are dense along a motion.

use crate::robot::Measurements;
use crate::robot::pose_groups::{NEAR, grouped};

/// Poses are one to a fit where all joints are closer than so many times what a joint comes back to: logs of encoders scatter on both sides.
const APART: f64 = 3.0;
/// Neighbours are closer than this share of how far poses lie about their mean: a hundredth or two along a path, more than one at random.
const DENSE: f64 = 0.12;
/// Fewer poses in a row are no path.
const FEWEST: usize = 20;

/// Rows dealt into units.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Units {
    /// Rows of each unit, ascending; units in the order of their first rows.
    pub all: Vec<Vec<usize>>,
    /// Units that are stretches of a path.
    pub stretches: usize,
    /// Rows in these.
    pub rows_on_path: usize,
}

impl Units {
    /// Poses alone, also along a path.
    pub fn poses(data: &Measurements, rows: &[usize], same: impl Fn(usize, usize) -> bool) -> Self {
        Self {
            all: grouped(rows, |row| data.q(row), APART * NEAR, same),
            ..Self::default()
        }
    }

    /// Of some rows; all that follows a path is cut into about so many `stretches`, none of them across a jump. `same` says what else two rows
    /// of a pose share.
    pub fn of(
        data: &Measurements,
        rows: &[usize],
        stretches: usize,
        same: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let poses = grouped(rows, |row| data.q(row), APART * NEAR, same);
        let runs = runs(data, &poses);
        let on_path: usize = runs.iter().map(Vec::len).sum();
        let mut taken = vec![false; poses.len()];
        let mut all = Vec::new();
        let mut rows_on_path = 0;
        for run in &runs {
            let pieces = (run.len() * stretches).div_ceil(on_path).max(1);
            for stretch in run.chunks(run.len().div_ceil(pieces)) {
                let mut unit = Vec::new();
                for pose in stretch {
                    if !std::mem::replace(&mut taken[*pose], true) {
                        unit.extend_from_slice(&poses[*pose]);
                    }
                }
                unit.sort_unstable();
                rows_on_path += unit.len();
                all.push(unit);
            }
        }
        all.retain(|unit| !unit.is_empty());
        let stretches = all.len();
        let alone = poses.into_iter().zip(taken).filter(|(_, taken)| !taken);
        all.extend(alone.map(|(pose, _)| pose));
        all.sort_unstable_by_key(|unit| unit.first().copied());
        Self {
            all,
            stretches,
            rows_on_path,
        }
    }

    /// Whether most rows follow a path.
    pub fn follow_a_path(&self) -> bool {
        let rows: usize = self.all.iter().map(Vec::len).sum();
        2 * self.rows_on_path > rows
    }

    /// What was kept together, in words; none where every row is a unit.
    pub fn words(&self) -> Option<String> {
        let rows: usize = self.all.iter().map(Vec::len).sum();
        match self.stretches {
            _ if self.all.len() == rows => None,
            0 => Some(format!(
                "rows of a pose stay together: {rows} rows, {} poses",
                self.all.len()
            )),
            count => Some(format!(
                "{} rows follow a path, on which neighbours know each other: they are dealt in {count} stretches",
                self.rows_on_path
            )),
        }
    }
}

/// Poses that follow each other densely in the order of measurement, each run with its poses in that order.
fn runs(data: &Measurements, poses: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut measured: Vec<(usize, usize)> = poses
        .iter()
        .enumerate()
        .flat_map(|(pose, rows)| rows.iter().map(move |row| (data.rank_in_time(*row), pose)))
        .collect();
    measured.sort_unstable();
    let mut stops: Vec<usize> = measured.into_iter().map(|(_, pose)| pose).collect();
    stops.dedup();
    let q = |pose: usize| data.q(poses[pose][0]);
    let mut mean = vec![0.0; data.joints];
    for stop in &stops {
        let each = mean.iter_mut().zip(q(*stop));
        each.for_each(|(mean, q)| *mean += q / stops.len() as f64);
    }
    let square =
        |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
    let spread = stops
        .iter()
        .map(|stop| square(q(*stop), &mean))
        .sum::<f64>();
    let dense = DENSE * DENSE * spread / stops.len().max(1) as f64;
    let near = |a: &usize, b: &usize| square(q(*a), q(*b)) < dense;
    stops
        .chunk_by(near)
        .filter(|run| {
            let mut different = run.to_vec();
            different.sort_unstable();
            different.dedup();
            different.len() >= FEWEST
        })
        .map(<[usize]>::to_vec)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    fn recording(poses: &[Vec<f64>]) -> Measurements {
        Measurements {
            joints: 6,
            q: poses.concat(),
            payload: vec![0.0; poses.len()],
            ..Measurements::default()
        }
    }

    fn at_random(count: usize) -> Vec<Vec<f64>> {
        let mut dice = ChaCha8Rng::seed_from_u64(3);
        let mut pose = || (0..6).map(|_| dice.random::<f64>() * 3.0).collect();
        (0..count).map(|_| pose()).collect()
    }

    fn along(count: usize, from: f64) -> Vec<Vec<f64>> {
        let turn = |k: usize| from + k as f64 / count as f64 * 6.0;
        let pose = |k: usize| (0..6).map(|j| (turn(k) + f64::from(j)).sin()).collect();
        (0..count).map(pose).collect()
    }

    fn units(poses: &[Vec<f64>]) -> Units {
        let data = recording(poses);
        let rows: Vec<usize> = (0..poses.len()).collect();
        Units::of(&data, &rows, 12, |_, _| true)
    }

    #[test]
    fn shots_of_a_pose_are_one_unit_wherever_they_stand_and_encoders_scatter() {
        let mut dice = ChaCha8Rng::seed_from_u64(4);
        let poses = at_random(30);
        let mut shot = |k: usize| -> Vec<f64> {
            let mut noise = || (dice.random::<f64>() - 0.5) * 1.2e-3;
            poses[k % 30].iter().map(|q| q + noise()).collect()
        };
        let shots: Vec<Vec<f64>> = (0..90).map(&mut shot).collect();
        let found = units(&shots);
        assert_eq!((found.all.len(), found.stretches), (30, 0));
        assert!((0..30).all(|k| found.all[k] == [k, k + 30, k + 60]));
    }

    #[test]
    fn neighbours_on_a_path_are_stretches_and_poses_at_random_are_not() {
        let found = units(&along(500, 0.0));
        assert!((11..=13).contains(&found.all.len()) && found.follow_a_path());
        assert!(
            found
                .all
                .iter()
                .all(|unit| unit.windows(2).all(|w| w[0] + 1 == w[1]))
        );
        let found = units(&at_random(200));
        assert_eq!((found.all.len(), found.stretches), (200, 0));
    }

    #[test]
    fn a_stretch_ends_where_the_path_does_and_a_pause_is_one_pose() {
        let mut poses = along(100, 0.0);
        poses.extend(vec![poses[99].clone(); 300]);
        // Between the poses of before: one that comes again later is one with them.
        poses.extend(along(100, 3.03));
        let found = units(&poses);
        assert!(found.follow_a_path());
        let pause = found.all.iter().find(|unit| unit.contains(&150)).unwrap();
        assert!((99..400).all(|row| pause.contains(&row)), "{pause:?}");
        assert!(pause.iter().all(|row| *row < 400));
        assert!((10..=14).contains(&found.all.len()));
    }
}
