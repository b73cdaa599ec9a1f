//! `calib compensate --torque`: the torques that a planned motion needs by the identified model.

use super::emit;
use crate::dynamics::{JointRange, NeededTorques};
use crate::error::{Error, Result, counted};
use crate::identified::{IdentifiedModel, IdentifiedTorques};
use crate::raw;
use crate::targets::{Trajectory, unwritten, whole};
use std::io::{Read, Write};
use std::path::Path;

/// Beyond the greatest speed or acceleration of the recording by more than this share, torques are extrapolated.
const BEYOND: f64 = 1.02;
/// rad: the same of positions.
const ASIDE: f64 = 0.02;

/// What is asked.
pub(super) struct FeedForward<'a> {
    /// `-`: stdin.
    pub motion: &'a Path,
    pub out: Option<&'a Path>,
    /// s from when the arm began to move; none: it is warm.
    pub since_start: Option<f64>,
    pub quiet: bool,
}

pub(super) fn feed_forward(asked: &FeedForward, identified: &IdentifiedModel) -> Result<()> {
    let Some(torques) = &identified.torques else {
        let message =
            "the model has no torques: put `- uses: diagnose_torques` after `ingest_torques`, or name such a stage with --step";
        return Err(Error::spec("--torque", message));
    };
    let (place, text) = read(asked.motion)?;
    let mut trajectory = Trajectory::read(&place, &text, &identified.robot)?;
    trajectory.motion.since_start = asked.since_start;
    let needed = torques.model.needed(&torques.arm, &trajectory.motion)?;
    let remarks = remarks(&torques.model.range, &trajectory.motion.position, &needed);
    let written = trajectory.written(&needed, torques.per_ampere.as_deref(), &remarks);
    match asked.out {
        Some(out) => whole(out, |mut file| file.write_all(written.as_bytes()).map_err(|error| unwritten(out, &error)))?,
        None => emit(&written)?,
    }
    let outside = remarks.iter().filter(|remark| !remark.is_empty()).count();
    let mut told = String::new();
    if !asked.quiet {
        told.push_str(&said(torques, &trajectory, remarks.len()));
    }
    if outside > 0 {
        let rows = counted(remarks.len(), "row");
        told.push_str(&format!(
            "warning: {outside} of {rows} lie beyond the motion that the model was seen in (column `remark`)\n"
        ));
    }
    let _ = std::io::stderr().write_all(told.as_bytes());
    Ok(())
}

fn read(motion: &Path) -> Result<(String, String)> {
    let place = if motion.as_os_str() == "-" { "stdin".to_string() } else { motion.display().to_string() };
    let bytes = if motion.as_os_str() == "-" {
        let mut bytes = Vec::new();
        std::io::stdin().read_to_end(&mut bytes).map(|_| bytes)
    } else {
        raw::bytes(motion)
    };
    let bytes = bytes.map_err(|error| Error::spec(&place, format!("cannot be read: {error}")))?;
    let text = String::from_utf8(bytes).map_err(|_| Error::data(&place, "is no text in UTF-8"))?;
    Ok((place, text))
}

/// What the person must know, a line each.
fn said(torques: &IdentifiedTorques, trajectory: &Trajectory, rows: usize) -> String {
    let derived = match (&trajectory.motion.velocity, &trajectory.motion.acceleration) {
        (Some(_), Some(_)) => "velocities and accelerations as given",
        (Some(_), None) => "accelerations by differences of positions, after the low-pass of the recording",
        (None, Some(_)) => "velocities by differences of positions, after the low-pass of the recording",
        (None, None) => "velocities and accelerations by differences of positions, after the low-pass of the recording",
    };
    let warm = torques.model.terms.iter().any(|term| term.effect == "warmup_friction");
    let warm = match (warm, trajectory.motion.since_start) {
        (true, None) => "friction is that of a warm arm (--since-start says how long ago it began to move)\n",
        _ => "",
    };
    let currents =
        if torques.per_ampere.is_some() { ", currents by the declared reduction ratios and motor constants" } else { "" };
    let left: String = torques.of_the_recording.iter().map(|statement| format!("not fed forward: {statement}\n")).collect();
    format!(
        "model: {}\n{}: {derived}\ntorques as the drives or sensors of the recording state them, payload as it was there{currents}\n{warm}{left}",
        torques.origin,
        counted(rows, "row")
    )
}

/// Of each row, where it is beyond the recording; empty elsewhere.
fn remarks(range: &[JointRange], position: &[f64], needed: &NeededTorques) -> Vec<String> {
    let n = range.len();
    let of_row = |row: usize| {
        let mut parts = Vec::new();
        for (joint, seen) in range.iter().enumerate() {
            let (at, number) = (n * row + joint, joint + 1);
            if position[at] < seen.position[0] - ASIDE || position[at] > seen.position[1] + ASIDE {
                parts.push(format!("joint {number} where it was not recorded"));
            }
            if needed.velocity[at].abs() > BEYOND * seen.speed {
                parts.push(format!("joint {number} faster than recorded"));
            }
            if needed.acceleration[at].abs() > BEYOND * seen.acceleration {
                parts.push(format!("joint {number} accelerates more than recorded"));
            }
        }
        parts.join("; ").replace(',', " ")
    };
    (0..position.len() / n).map(of_row).collect()
}
