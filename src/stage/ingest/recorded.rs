//! The quantities of one row.

use super::arm::RobotJoints;
use super::bind::Binding;

/// The quantities of one row; reused from row to row.
#[derive(Default)]
pub(super) struct RecordedRow {
    /// Number of the data row in its file, from 1.
    pub number: u64,
    pub line: u64,
    /// Empty where there is none.
    pub id: String,
    /// By [`Slots::texts`]; empty where there is none.
    ///
    /// [`Slots::texts`]: super::slots::Slots::texts
    pub texts: Vec<String>,
    pub sequence: Option<i64>,
    /// SI, by the places of the arm's slots; NaN where missing.
    pub values: Vec<f64>,
    /// The point of each target of a wide row, SI; NaN where it was not seen.
    pub points: Vec<[f64; 3]>,
    /// The first joint beyond its limits, from 0.
    pub beyond: Option<usize>,
    /// The first revolute joint beyond one and a half turns, from 0, and its angle, rad; also where the row is refused.
    pub turned: Option<(usize, f64)>,
    /// Nothing stands in any of its fields.
    pub is_blank: bool,
    /// Hashes of its id, and of all else that it says; 0 where they were not asked for.
    pub key: (u64, u32),
    pub content: u64,
}

impl RecordedRow {
    /// An empty one of a file.
    pub(super) fn of(binding: &Binding, arm: &RobotJoints) -> Self {
        let texts = vec![String::new(); binding.texts.len()];
        Self { texts, values: vec![f64::NAN; arm.slots.count], ..Self::default() }
    }
}
