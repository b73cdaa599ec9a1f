//! A simulated recording as the files that a user of that robot would have, and beside them every true number.

use crate::description::RobotDescription;
use crate::table::{Recording, Truth};
use crate::twin::folder::{self, Decimals, Log};
use std::collections::BTreeMap;

/// 1e-9 deg is 0.00005 um at 3 m.
const DECIMALS: Decimals = Decimals {
    angle: 9,
    length: 9,
    time: 2,
};
/// Decimals for a moving arm: a microsecond counts.
const MOVING: Decimals = Decimals {
    time: 6,
    ..DECIMALS
};

/// The files by their names; of an arm that `moves` times are finer. Fails with a sentence where the layout cannot hold the robot.
pub fn recorded(
    robot: &RobotDescription,
    recording: Recording,
    truth: &Truth,
    moves: bool,
) -> Result<Vec<(String, String)>, String> {
    let decimals = if moves { MOVING } else { DECIMALS };
    let description = folder::robot(robot)?;
    let touched = touched(&recording);
    let log = log(recording, moves);
    let mut numbers = "name,effect,where,unit,value\n".to_string();
    for row in &truth.0 {
        numbers.push_str(&format!(
            "{},{},{},{},{}\n",
            row.name, row.effect, row.place, row.unit, row.value
        ));
    }
    let own = |name: &str, text: String| (name.to_string(), text);
    let mut files = vec![own("robot.json", description), own("truth.csv", numbers)];
    if touched.is_empty() {
        files.extend([
            own("controller.csv", log.controller(decimals)),
            own("tracker.csv", log.tracker(decimals)),
        ]);
    }
    files.extend(touched);
    Ok(files)
}

/// The joints of a recording at each fixture, rad (m of a prismatic joint), a file without a header under the fixture's name.
fn touched(recording: &Recording) -> BTreeMap<String, String> {
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    for row in 0..recording.rows() {
        if let Some(name) = recording.contact(row) {
            let joints: Vec<String> = recording
                .q(row)
                .iter()
                .map(|q| format!("{q:.12}"))
                .collect();
            files
                .entry(format!("{name}.csv"))
                .or_default()
                .push_str(&(joints.join(",") + "\n"));
        }
    }
    files
}

/// The recording as a log; what is not known in a row of it is 0, which the twin never leaves unknown.
fn log(recording: Recording, at_once: bool) -> Log {
    let rows = recording.rows();
    Log {
        joints: recording.joints,
        time_s: recording.time,
        usage: recording
            .usage
            .into_iter()
            .map(Option::unwrap_or_default)
            .collect(),
        payload_kg: recording.payload.unwrap_or_else(|| vec![0.0; rows]),
        q: recording.q,
        current: recording.current,
        direction: recording.direction,
        velocity: recording.velocity,
        at_once,
        temperature_c: recording.temperature,
        position: recording.position,
        id: recording.point_id,
    }
}
