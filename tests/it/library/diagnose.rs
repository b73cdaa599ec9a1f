use calib::api::{Diagnosis, Options, Recording, Robot, diagnose};
use calib::error::Result;

/// What the rigid model of an arm leaves out: every fourth pose is held out, and only judges in the end.
pub fn missing_physics(robot: &Robot, recording: &Recording) -> Result<Diagnosis> {
    let found = diagnose(robot, recording, &Options::with(serde_json::json!({})))?;
    eprintln!("{}", found.summary.text(""));
    Ok(found)
}
