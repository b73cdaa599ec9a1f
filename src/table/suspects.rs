//! Rows that no smooth model can follow, by name and kind: set aside, and never silently dropped.

use super::{Suspects, SuspectsRow};
use crate::estimate::{Screening, Suspect, SuspectKind};
use crate::table::{Recording, Split};

impl Suspects {
    /// What a screen found in this recording.
    pub fn of(step: &str, screening: &Screening, recording: &Recording, split: &Split) -> Self {
        let id = |row: usize| recording.point_id[row].as_str();
        let row = |suspect: &Suspect| SuspectsRow {
            sequence: recording.sequence[suspect.row],
            point_id: id(suspect.row).into(),
            set: split.0[suspect.row].set.clone(),
            step: step.into(),
            kind: name(suspect.kind).into(),
            partner_sequence: suspect.partner.map(|row| recording.sequence[row]),
            size_mm: suspect.size * 1e3,
            statistic: suspect.statistic,
            used: suspect.used(),
            remark: remark(suspect, suspect.partner.map(id)),
        };
        Self(screening.suspects.iter().map(row).collect())
    }
}

fn name(kind: SuspectKind) -> &'static str {
    match kind {
        SuspectKind::Exchanged => "exchanged",
        SuspectKind::Mislabelled => "mislabelled",
        SuspectKind::ShiftedBlock(_) => "shifted_block",
        SuspectKind::UnitSlip(_) => "unit_slip",
        SuspectKind::Zero => "zero",
        SuspectKind::Outlier => "outlier",
        SuspectKind::Event => "event",
    }
}

fn remark(suspect: &Suspect, partner: Option<&str>) -> String {
    let partner = partner.unwrap_or("another row");
    let far = format!("{:.3} mm from where its joints put it", suspect.size * 1e3);
    match suspect.kind {
        SuspectKind::Exchanged => {
            format!("{far}; with the points of {partner} and this row swapped, both fit")
        }
        SuspectKind::Mislabelled => format!("{far}, and where the joints of {partner} put it"),
        SuspectKind::ShiftedBlock(offset) => {
            format!(
                "{far}, and where the joints of {partner} put it, like its neighbours: points and joints are {offset:+} rows apart"
            )
        }
        SuspectKind::UnitSlip(factor) => format!("the point is {}: another unit?", slip(factor)),
        SuspectKind::Zero => "the point is the tracker's origin: a lost beam?".into(),
        SuspectKind::Outlier => {
            format!("{far}, and no mistake of the recording explains where it is")
        }
        SuspectKind::Event => {
            format!(
                "{far}, like its neighbours: something happened that the model does not know, so the row is kept"
            )
        }
    }
}

/// E.g. `25.4 times too far`.
pub(crate) fn slip(factor: f64) -> String {
    let digits = |factor: f64| format!("{factor:.1}").trim_end_matches(".0").to_string();
    if factor > 1.0 {
        format!("{} times too far", digits(factor))
    } else {
        format!("{} times too near", digits(1.0 / factor))
    }
}
