//! A payload column that is mapped and not filled: rows without a number count as 0 kg, which is rarely what the arm carried.

use crate::table::Recording;

/// What is said where cells of the column are empty.
pub(super) fn blank_payload(recording: &Recording) -> Option<String> {
    let payload = recording.payload.as_ref()?;
    let rows = payload.len();
    let empty = payload.iter().filter(|mass| !mass.is_finite()).count();
    let which = match empty {
        0 => return None,
        all if all == rows => format!("all {rows} rows"),
        some => format!("{some} of {rows} rows"),
    };
    Some(format!(
        "the payload column is empty in {which}, and 0 kg is assumed there: where the arm carried anything, what its weight does is \
         attributed to another cause. Fill the column in, or give `payload` a value in `ingest`"
    ))
}
