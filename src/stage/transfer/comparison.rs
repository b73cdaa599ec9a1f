//! A carried model compared with its geometry alone, carried likewise: everywhere, and where the joints had been and had not.

use crate::error::counted;
use crate::robot::Measurements;
use nalgebra::Vector3;
use std::collections::BTreeSet;

/// Beyond this the difference is not that of two ways to place a base.
const WORSE: f64 = 1.02;
/// Fewer points say nothing.
const FEWEST: usize = 5;

/// Errors of some points, mm.
struct CarriedErrors {
    mean: f64,
    rms: f64,
    largest: f64,
}

impl CarriedErrors {
    fn of(data: &Measurements, predicted: &[Vector3<f64>], rows: &[usize]) -> Self {
        let errors = || {
            rows.iter()
                .map(|row| data.points.residual(*row, &predicted[*row]).norm() * 1e3)
        };
        let count = rows.len().max(1) as f64;
        Self {
            mean: errors().sum::<f64>() / count,
            rms: (errors().map(|error| error * error).sum::<f64>() / count).sqrt(),
            largest: errors().fold(0.0, f64::max),
        }
    }

    fn words(&self) -> String {
        format!("mean {:.3}, largest {:.3} mm", self.mean, self.largest)
    }

    fn is_worse(&self, than: &Self) -> bool {
        self.rms > WORSE * than.rms || self.mean > WORSE * than.mean
    }
}

/// The same points by both.
struct Compared {
    points: usize,
    whole: CarriedErrors,
    geometry: CarriedErrors,
}

impl Compared {
    fn words(&self) -> String {
        format!("{} against {}", self.whole.words(), self.geometry.words())
    }
}

/// Rows of whole points: held-out ones judge and never choose.
pub(super) struct ComparedRows {
    pub(crate) choose: Vec<usize>,
    pub(crate) judge: Vec<usize>,
}

/// Both models at the points that judge them.
pub(super) struct Comparison {
    chosen_by: Compared,
    all: Compared,
    /// In cells of the joint space that the model was fitted in, and outside of them; none where that is not known.
    parts: Option<[Compared; 2]>,
}

impl Comparison {
    /// By predictions of the carried model and of its geometry.
    pub fn of(
        data: &Measurements,
        rows: &ComparedRows,
        [whole, geometry]: [&[Vector3<f64>]; 2],
        visited: Option<&VisitedCells>,
    ) -> Self {
        let compared = |rows: &[usize]| Compared {
            points: rows.len(),
            whole: CarriedErrors::of(data, whole, rows),
            geometry: CarriedErrors::of(data, geometry, rows),
        };
        let parts = visited.map(|visited| {
            let (inside, outside): (Vec<usize>, Vec<usize>) = rows
                .judge
                .iter()
                .partition(|row| visited.has(data.q(**row)));
            [compared(&inside), compared(&outside)]
        });
        Self {
            chosen_by: compared(&rows.choose),
            all: compared(&rows.judge),
            parts,
        }
    }

    /// Whether the geometry alone is better at the points that choose.
    pub(crate) fn is_worse(&self) -> bool {
        self.chosen_by.points > 0 && self.chosen_by.whole.is_worse(&self.chosen_by.geometry)
    }

    /// Whether it is better at the points that judge.
    pub(crate) fn is_worse_where_judged(&self) -> bool {
        self.all.points > 0 && self.all.whole.is_worse(&self.all.geometry)
    }

    /// Whether it is better where the joints had not been.
    pub(crate) fn is_worse_outside(&self) -> bool {
        let outside = self.parts.as_ref().map(|[_, outside]| outside);
        outside.is_some_and(|outside| {
            outside.points >= FEWEST && outside.whole.is_worse(&outside.geometry)
        })
    }

    /// Both, with their figures.
    pub(crate) fn words(&self) -> String {
        let Compared {
            points,
            whole,
            geometry,
        } = &self.all;
        let mut text = format!(
            "the carried model leaves {} at {} of this recording, the geometry alone, carried likewise, {}",
            whole.words(),
            counted(*points, "point"),
            geometry.words()
        );
        let part = |part: &Compared| match part.points {
            0 => "none".to_string(),
            points => format!("{}, {}", counted(points, "point"), part.words()),
        };
        if let Some([inside, outside]) = &self.parts {
            text += &format!(
                " (visited cells of the joint space: {}; unvisited: {})",
                part(inside),
                part(outside)
            );
        }
        text
    }
}

/// Cells of a joint's travel between its least and greatest position.
const CELLS: f64 = 8.0;

/// Cells of pairs of joints that rows lie in; a pose is visited where each of its pairs of joints lies in one of them or next to one.
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
    pub(crate) fn has(&self, q: &[f64]) -> bool {
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
