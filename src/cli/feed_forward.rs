//! `calib compensate --torque`: the torques that a planned motion needs by the identified model.

use super::{note, put, readable};
use crate::dynamics::{JudgedRow, TorqueGate};
use crate::error::{Error, Fault, Result, counted};
use crate::identified::{IdentifiedModel, IdentifiedTorques};
use crate::raw;
use crate::stage::must_turn;
use crate::targets::Trajectory;
use std::io::Read;
use std::path::Path;

/// Faults of rows named of one file.
const LIMIT: usize = 20;

pub(super) struct FeedForward<'a> {
    /// `-`: stdin.
    pub(crate) motion: &'a Path,
    pub(crate) out: Option<&'a Path>,
    /// s from when the arm began to move; none: it is warm.
    pub(crate) since_start: Option<f64>,
    /// C, where the motion does not say it.
    pub(crate) temperature: Option<f64>,
    /// Nm, 95 %: the limit of a joint's uncertainty.
    pub(crate) max_uncertainty: Option<f64>,
    /// Whether uncertainties are written and judged.
    pub(crate) sigma: bool,
    pub(crate) force: bool,
    pub(crate) quiet: bool,
}

pub(super) fn feed_forward(asked: &FeedForward, identified: &IdentifiedModel) -> Result<()> {
    let Some(torques) = &identified.torques else {
        let message = "the model has no torques: put `- uses: diagnose_torques` after `ingest_torques`, or name such a stage with --step";
        return Err(Error::spec("--torque", message));
    };
    must_turn(&identified.robot, "feed-forward torques")?;
    let (place, text) = read(asked.motion)?;
    let mut trajectory = Trajectory::read(&place, &text, &identified.robot, asked.force)?;
    let motion = &mut trajectory.motion;
    motion.since_start = asked.since_start;
    if motion.temperature.is_none() {
        motion.temperature = asked
            .temperature
            .map(|temperature| vec![temperature; motion.time.len()]);
    }
    let mut needed = torques.model.needed(&torques.arm, &trajectory.motion)?;
    if !asked.sigma {
        needed.u95 = None;
    }
    let model = if asked.force {
        identified.refusals.clone()
    } else {
        Vec::new()
    };
    let gate = TorqueGate {
        uncertainty: asked.max_uncertainty,
        insisted: asked.force,
        model,
    };
    let judged = torques.model.judged(&trajectory.motion, &needed, &gate);
    let written = trajectory.written(&needed, torques.per_ampere.as_deref(), &judged);
    put(asked.out, written)?;
    let mut notes = if asked.quiet {
        String::new()
    } else {
        remarks_on(torques, &trajectory, judged.len())
    };
    if asked.sigma && needed.u95.is_none() {
        notes.push_str("warning: a table of parameters alone does not say how certain torques are: nothing is refused for it\n");
    }
    notes.push_str(&warnings(&judged));
    note(notes);
    refused(&judged, &trajectory, &place)
}

/// Whether something is so of a row.
type OfRow = fn(&JudgedRow) -> bool;

/// What is wrong with some rows, a sentence a line.
fn warnings(judged: &[JudgedRow]) -> String {
    let all: [(OfRow, &str); 3] = [
        (
            JudgedRow::is_beyond,
            "lie beyond the motion that the model was seen in",
        ),
        (
            JudgedRow::is_refused,
            "are less certain than allowed and have no torques; --force writes them all the same",
        ),
        (
            JudgedRow::is_insisted,
            "are refused and written because of --force",
        ),
    ];
    let rows = counted(judged.len(), "row");
    let line = |(is, what): (OfRow, &str)| {
        let count = judged.iter().filter(|row| is(row)).count();
        (count > 0).then(|| format!("warning: {count} of {rows} {what} (column `remark`)\n"))
    };
    all.into_iter().filter_map(line).collect()
}

/// Fails with the rows that have no torques, the first of them.
fn refused(judged: &[JudgedRow], trajectory: &Trajectory, place: &str) -> Result<()> {
    let rows = judged.iter().enumerate();
    let refused = rows.filter(|(_, row)| row.is_refused()).take(LIMIT);
    let fault = |(row, judged): (usize, &JudgedRow)| {
        let message = format!("{judged}: no torques are written");
        Fault::new(trajectory.place(row, place), message)
    };
    Error::if_data(refused.map(fault).collect())
}

fn read(motion: &Path) -> Result<(String, String)> {
    let (place, bytes) = if motion.as_os_str() == "-" {
        let mut bytes = Vec::new();
        let read = std::io::stdin().read_to_end(&mut bytes);
        (
            "stdin".to_string(),
            readable(Path::new("stdin"), read.map(|_| bytes))?,
        )
    } else {
        (
            motion.display().to_string(),
            readable(motion, raw::bytes(motion))?,
        )
    };
    let text = String::from_utf8(bytes).map_err(|_| Error::data(&place, "is no text in UTF-8"))?;
    Ok((place, text))
}

/// What the person must know, a line each.
fn remarks_on(torques: &IdentifiedTorques, trajectory: &Trajectory, rows: usize) -> String {
    let motion = &trajectory.motion;
    let derived = |what: &str| {
        format!("{what} by differences of positions, after the low-pass of the recording")
    };
    let derived = match (&motion.velocity, &motion.acceleration) {
        (Some(_), Some(_)) => "velocities and accelerations as given".into(),
        (Some(_), None) => derived("accelerations"),
        (None, Some(_)) => derived("velocities"),
        (None, None) => derived("velocities and accelerations"),
    };
    let warm = match (torques.model.follows_time(), motion.since_start) {
        (true, None) => {
            "torques that follow time are those of a warm arm (--since-start: how long ago it began to move)\n"
        }
        _ => "",
    };
    let currents = if torques.per_ampere.is_some() {
        ", currents by the declared reduction ratios and motor constants"
    } else {
        ""
    };
    let left: String = torques
        .of_the_recording
        .iter()
        .map(|statement| format!("not fed forward: {statement}\n"))
        .collect();
    format!(
        "model: {}\n{}: {derived}\ntorques as the drives or sensors of the recording state them, payload as it was there{currents}\n{warm}{left}",
        torques.origin,
        counted(rows, "row")
    )
}
