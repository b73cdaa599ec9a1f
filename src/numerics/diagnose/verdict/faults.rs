//! Findings that are no physics of the arm: rows that no model can follow, logs that are apart.

use super::last_round::LastRound;
use crate::criteria::screen::{BULK, MISTAKES};
use crate::diagnose::types::{Finding, Probabilities};
use crate::effect::{Place, names};
use crate::error::counted;
use crate::estimate::{Suspect, SuspectKind};

/// Joints and points of all rows that are so many rows apart.
pub(super) fn rows_apart(offset: i64, last: &LastRound) -> Finding {
    let rows = counted(offset.unsigned_abs() as usize, "row");
    let how = if offset < 0 { "ahead of" } else { "behind" };
    let text =
        format!("the joints of a point are {rows} {how} it: join the two logs again, nothing else can be diagnosed before");
    of_the_recording(names::JOINT_LOG_LAG, text, last)
}

/// Rows of the recording that no model can follow, as findings; `unknown` is a row that the found causes cannot foretell. Where physics is
/// left, or too many rows stand out, one that only the model speaks against may be where physics shows most.
pub(super) fn faults(last: &LastRound, unknown: Option<usize>, something_left: bool) -> Vec<Finding> {
    let screening = &last.judged.state.screening;
    // What has no other explanation than that it is far out must be farther than this noise reaches.
    let far = |s: &Suspect| s.kind != SuspectKind::Outlier || s.statistic > screening.reach;
    let alone = |s: &&Suspect| s.kind == SuspectKind::Outlier && !s.used() && !s.corroborated;
    let many = screening.suspects.iter().filter(alone).count().saturating_sub(*MISTAKES) as f64;
    let doubted = something_left || many > (1.0 - *BULK) * last.survey.data.rows() as f64;
    let of = |kinds: fn(SuspectKind) -> bool| -> Vec<usize> {
        let own = screening.suspects.iter().filter(|s| !s.used() && kinds(s.kind) && Some(s.row) != unknown);
        own.filter(|s| far(s) && !(doubted && alone(s))).map(|s| s.row + 1).collect()
    };
    let list = |rows: &[usize]| {
        let named: Vec<String> = rows.iter().take(20).map(usize::to_string).collect();
        let more = rows.len().saturating_sub(20);
        let noun = if rows.len() == 1 { "row" } else { "rows" };
        format!("{noun} {}{}", named.join(", "), if more > 0 { format!(" and {more} more") } else { String::new() })
    };
    let mut out = Vec::new();
    let swapped = of(|kind| matches!(kind, SuspectKind::Exchanged | SuspectKind::Mislabelled));
    if !swapped.is_empty() {
        out.push(of_the_recording(
            names::MISLABELLED_POINT,
            format!("points carry another point's name: {}", list(&swapped)),
            last,
        ));
    }
    let shifted = of(|kind| matches!(kind, SuspectKind::ShiftedBlock(_)));
    if !shifted.is_empty() {
        let text = format!("joints and points are rows apart in the recording: {}", list(&shifted));
        out.push(of_the_recording(names::JOINT_LOG_LAG, text, last));
    }
    let wrong = of(|kind| matches!(kind, SuspectKind::Outlier | SuspectKind::UnitSlip(_) | SuspectKind::Zero));
    if !wrong.is_empty() {
        out.push(of_the_recording(names::OUTLIER, format!("single wrong points: {}", list(&wrong)), last));
    }
    out
}

/// A fault of the recording; without its name where that is not to be given.
fn of_the_recording(effect: &'static str, statement: String, last: &LastRound) -> Finding {
    let effect = if last.excludes(effect) { names::UNKNOWN } else { effect };
    Finding {
        effect,
        place: Place::Recording,
        statement,
        parameters: Vec::new(),
        evidence: None,
        rivals: Vec::new(),
        probabilities: Probabilities::default(),
        valid: None,
        forms: Vec::new(),
    }
}
