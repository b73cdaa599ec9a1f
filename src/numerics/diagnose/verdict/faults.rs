//! Findings that are no physics of the arm: rows that no model can follow, logs that are apart.

use super::last_round::LastRound;
use crate::criteria::screen::{BULK, MISTAKES};
use crate::criteria::words::FAULT;
use crate::diagnose::types::{Finding, Probabilities};
use crate::effect::{Place, names};
use crate::error::counted;
use crate::estimate::{Screening, Suspect, SuspectKind};

/// Joints and points of all rows that are so many rows apart.
pub(super) fn rows_apart(offset: i64, last: &LastRound) -> Finding {
    let rows = counted(offset.unsigned_abs() as usize, "row");
    let how = if offset < 0 { "ahead of" } else { "behind" };
    let text = format!(
        "the joints of a point are {rows} {how} it: join the two logs again, nothing else can be diagnosed before"
    );
    of_the_recording(names::JOINT_LOG_LAG, text, last)
}

/// Whether more rows are set aside by the model alone than mistakes are: missing physics may show most there.
pub(super) fn stand_out_in_number(screening: &Screening, rows: usize) -> bool {
    let far = |s: &&Suspect| is_by_the_model_alone(s) && s.statistic > screening.reach;
    let many = screening
        .suspects
        .iter()
        .filter(far)
        .count()
        .saturating_sub(*MISTAKES);
    many as f64 > (1.0 - *BULK) * rows as f64
}

/// Whether nothing but the model speaks against a row that is set aside.
fn is_by_the_model_alone(suspect: &Suspect) -> bool {
    suspect.kind == SuspectKind::Outlier && !suspect.corroborated
}

/// Rows of the recording that no model can follow, as findings; `unknown` is a row that the found causes cannot foretell. Where physics is
/// left, a row that only the model speaks against may be where that shows most.
pub(super) fn faults(
    last: &LastRound,
    unknown: Option<usize>,
    something_left: bool,
) -> Vec<Finding> {
    let screening = &last.state.screening;
    // What has no other explanation than that it is far out must be farther than this noise reaches.
    let far = |s: &Suspect| s.kind != SuspectKind::Outlier || s.statistic > screening.reach;
    let of = |kinds: fn(SuspectKind) -> bool| -> Vec<usize> {
        let own = screening
            .suspects
            .iter()
            .filter(|s| !s.used() && kinds(s.kind) && Some(s.row) != unknown);
        own.filter(|s| far(s) && !(something_left && is_by_the_model_alone(s)))
            .map(|s| s.row + 1)
            .collect()
    };
    let list = |rows: &[usize]| {
        let named: Vec<String> = rows.iter().take(20).map(usize::to_string).collect();
        let more = rows.len().saturating_sub(20);
        let noun = if rows.len() == 1 { "row" } else { "rows" };
        format!(
            "{noun} {}{}",
            named.join(", "),
            if more > 0 {
                format!(" and {more} more")
            } else {
                String::new()
            }
        )
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
        let text = format!(
            "joints and points are rows apart in the recording: {}",
            list(&shifted)
        );
        out.push(of_the_recording(names::JOINT_LOG_LAG, text, last));
    }
    let wrong = of(|kind| {
        matches!(
            kind,
            SuspectKind::Outlier | SuspectKind::UnitSlip(_) | SuspectKind::Zero
        )
    });
    if !wrong.is_empty() {
        out.push(of_the_recording(
            names::OUTLIER,
            format!("single wrong points: {}", list(&wrong)),
            last,
        ));
    }
    out
}

/// A fault of the recording; without its name where that is not to be given.
fn of_the_recording(effect: &'static str, statement: String, last: &LastRound) -> Finding {
    let effect = if last.excludes(effect) {
        names::UNKNOWN
    } else {
        effect
    };
    Finding {
        effect,
        place: Place::Recording,
        statement,
        parameters: Vec::new(),
        evidence: None,
        rivals: Vec::new(),
        probabilities: Probabilities {
            name: *FAULT,
            place: *FAULT,
            none: 1.0 - *FAULT,
        },
        valid: None,
        forms: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_more_than_mistakes_beyond_three_and_one_in_fifty_if_only_the_model_speaks_against_them()
     {
        let suspect = |row, corroborated, statistic| {
            let kind = SuspectKind::Outlier;
            Suspect {
                row,
                kind,
                partner: None,
                size: 1e-3,
                statistic,
                corroborated,
            }
        };
        let many = |count: usize, corroborated, statistic, rows| {
            let suspects = (0..count)
                .map(|row| suspect(row, corroborated, statistic))
                .collect();
            stand_out_in_number(
                &Screening {
                    suspects,
                    reach: 10.0,
                    ..Screening::default()
                },
                rows,
            )
        };
        assert!(
            many(8, false, 20.0, 100) && !many(3, false, 20.0, 50) && !many(8, false, 20.0, 1000)
        );
        assert!(!many(8, true, 20.0, 100) && !many(8, false, 5.0, 100));
    }
}
