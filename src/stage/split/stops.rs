//! Rows of a recording that belong together: the targets of one stop, the repeats of one pose.

use crate::robot::pose_groups::{NEAR, SAME, near};
use crate::table::Recording;
use std::ops::Range;

/// Rows one by one, or where targets are named, all that were measured one after the other in a pose.
pub(super) fn stops(recording: &Recording) -> Vec<Range<usize>> {
    let mut stops: Vec<Range<usize>> = Vec::new();
    for row in 0..recording.rows() {
        let joins = |stop: &Range<usize>| {
            let Some(targets) = &recording.target else {
                return false;
            };
            let new = stop.clone().all(|other| targets[other] != targets[row]);
            new && near(recording.q(stop.start), recording.q(row), NEAR)
        };
        match stops.last_mut() {
            Some(last) if joins(last) => last.end = row + 1,
            _ => stops.push(row..row + 1),
        }
    }
    stops
}

/// Stretches of neighbouring rows with the same joints, the targets of a pose together.
pub(super) fn poses(recording: &Recording) -> Vec<Range<usize>> {
    let mut poses: Vec<Range<usize>> = Vec::new();
    for stop in stops(recording) {
        let (named, joints) = (stop.len() > 1, recording.q(stop.start));
        let limit = if named { NEAR } else { SAME };
        match poses.last_mut() {
            Some(last) if near(recording.q(last.start), joints, limit) => last.end = stop.end,
            _ => poses.push(stop),
        }
    }
    poses
}
