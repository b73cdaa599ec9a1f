//! Rows that are copies of another under a new id: one measurement, which must not be fitted and held out at once.

use crate::error::counted;
use crate::table::Recording;
use std::collections::BTreeMap;

/// Copies that are named.
const NAMED: usize = 3;

/// Rows (second) whose joints and measured point are those of an earlier row (first) to the last digit.
pub(super) fn copied_rows(recording: &Recording) -> Vec<(usize, usize)> {
    let mut first: BTreeMap<(Vec<u64>, Option<&str>), usize> = BTreeMap::new();
    let mut copies = Vec::new();
    for row in 0..recording.rows() {
        let Some(point) = recording.point(row) else {
            continue;
        };
        let values = recording
            .q(row)
            .iter()
            .chain(&point)
            .map(|value| value.to_bits())
            .collect();
        let target = recording
            .target
            .as_ref()
            .and_then(|all| all[row].as_deref());
        match first.entry((values, target)) {
            std::collections::btree_map::Entry::Occupied(earlier) => {
                copies.push((*earlier.get(), row))
            }
            std::collections::btree_map::Entry::Vacant(place) => {
                place.insert(row);
            }
        }
    }
    copies
}

/// What is said of them; none where there are none.
pub(super) fn remark(copies: &[(usize, usize)], recording: &Recording) -> Option<String> {
    let id = |row: usize| recording.point_id[row].as_str();
    let named: Vec<String> = copies
        .iter()
        .take(NAMED)
        .map(|(one, copy)| format!("{} is {}", id(*copy), id(*one)))
        .collect();
    let more = if copies.len() > NAMED { ", ..." } else { "" };
    let (rows, repeat) = (
        counted(copies.len(), "row"),
        if copies.len() == 1 {
            "repeats"
        } else {
            "repeat"
        },
    );
    (!copies.is_empty()).then(|| {
        format!(
            "{rows} {repeat} another row's joints and point to the last digit under an id of their own ({}{more}): copies, which look like \
             perfect repeatability. They are in one set with that row; take them out of the file",
            named.join(", ")
        )
    })
}
