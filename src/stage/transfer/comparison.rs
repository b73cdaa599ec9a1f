//! A carried model beside its geometry alone, carried likewise: everywhere, and where the joints had been and had not.

use super::cells::VisitedCells;
use crate::error::counted;
use crate::robot::Measurements;
use nalgebra::Vector3;

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
    pub choose: Vec<usize>,
    pub judge: Vec<usize>,
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
    pub fn is_worse(&self) -> bool {
        self.chosen_by.points > 0 && self.chosen_by.whole.is_worse(&self.chosen_by.geometry)
    }

    /// Whether it is better at the points that judge.
    pub fn is_worse_where_judged(&self) -> bool {
        self.all.points > 0 && self.all.whole.is_worse(&self.all.geometry)
    }

    /// Whether it is better where the joints had not been.
    pub fn is_worse_outside(&self) -> bool {
        let outside = self.parts.as_ref().map(|[_, outside]| outside);
        outside.is_some_and(|outside| {
            outside.points >= FEWEST && outside.whole.is_worse(&outside.geometry)
        })
    }

    /// Both, with their figures.
    pub fn words(&self) -> String {
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
