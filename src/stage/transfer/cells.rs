//! Where in the joint space a model was fitted: cells of every pair of joints.

use crate::robot::Measurements;
use std::collections::BTreeSet;

/// Cells of a joint's travel between its least and greatest position.
const CELLS: f64 = 8.0;

/// Cells of pairs of joints that rows lie in; a pose is visited where each of its pairs of joints lies in one of them or beside it.
pub(super) struct VisitedCells {
    /// Least position and width of a cell of each joint, rad or m.
    grid: Vec<[f64; 2]>,
    cells: BTreeSet<(usize, usize, i64, i64)>,
}

impl VisitedCells {
    /// The cells that some rows lie in.
    pub fn of(data: &Measurements, rows: &[usize]) -> Self {
        let joint = |joint: usize| {
            let range = rows.iter().map(|row| data.q(*row)[joint]);
            let [low, high] = range.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
                [low.min(q), high.max(q)]
            });
            [low, ((high - low) / CELLS).max(1e-3)]
        };
        let mut out = Self {
            grid: (0..data.joints).map(joint).collect(),
            cells: BTreeSet::new(),
        };
        for row in rows {
            let cell = out.cell(data.q(*row));
            out.cells
                .extend(pairs(cell.len()).map(|(a, b)| (a, b, cell[a], cell[b])));
        }
        out
    }

    /// Whether joints lie where rows lie.
    pub fn has(&self, q: &[f64]) -> bool {
        let cell = self.cell(q);
        let near = |cell: i64| cell - 1..=cell + 1;
        pairs(cell.len()).all(|(a, b)| {
            near(cell[a])
                .any(|one| near(cell[b]).any(|other| self.cells.contains(&(a, b, one, other))))
        })
    }

    fn cell(&self, q: &[f64]) -> Vec<i64> {
        q.iter()
            .zip(&self.grid)
            .map(|(q, [low, width])| ((q - low) / width).floor() as i64)
            .collect()
    }
}

fn pairs(joints: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..joints).flat_map(move |a| (a + 1..joints).map(move |b| (a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_that_no_row_reached_is_unvisited_though_each_joint_has_been_there() {
        let all = (0..64).map(|k| [f64::from(k % 8), f64::from(k / 8)]);
        let q: Vec<f64> = all
            .filter(|[one, other]| *one < 4.0 || *other < 4.0)
            .flatten()
            .collect();
        let data = Measurements {
            joints: 2,
            q,
            ..Measurements::default()
        };
        let rows: Vec<usize> = (0..data.rows()).collect();
        let visited = VisitedCells::of(&data, &rows);
        assert!(visited.has(&[1.0, 1.0]) && visited.has(&[6.5, 0.5]));
        assert!(!visited.has(&[6.5, 6.5]) && !visited.has(&[-3.0, 1.0]));
    }
}
