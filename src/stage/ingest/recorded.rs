//! The quantities of one row.

use super::arm::RobotJoints;
use super::refusal::RowRefusal;
use crate::raw::shown;
use crate::table::RejectedRow;

/// Letters that are shown of a row that is not used.
const SHOWN: usize = 200;

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
}

impl RecordedRow {
    /// An empty one.
    pub(super) fn empty(arm: &RobotJoints) -> Self {
        let texts = vec![String::new(); arm.slots.texts().len()];
        Self {
            texts,
            values: vec![f64::NAN; arm.slots.count],
            ..Self::default()
        }
    }
    /// The row as one that is not used, of the file that tables call `name`; `text` is what stands there.
    pub(super) fn rejected(&self, name: &str, text: &[u8], refusal: RowRefusal) -> RejectedRow {
        RejectedRow {
            file: name.into(),
            line: self.line as i64,
            point_id: (!self.id.is_empty()).then(|| self.id.clone()),
            reason: refusal.reason.word().into(),
            detail: refusal.detail,
            text: shown(text).chars().take(SHOWN).collect(),
        }
    }
}
