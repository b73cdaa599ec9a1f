//! `calib robots`: the library of common arms.

use super::emit;
use crate::error::Result;
use crate::robot::{LIBRARY, LibraryArm};
use crate::units::Unit;
use clap::Args;

/// List the arms that `calib init` starts from, or print the robot file of one.
#[derive(Args)]
#[command(after_help = "Examples:
  calib robots
  calib robots ur10e
  calib init cell7 --data measurements.csv --robot ur10e")]
pub(super) struct RobotsArguments {
    /// One arm by its name: its robot file, with sources
    #[arg(value_name = "NAME")]
    name: Option<String>,
}

pub(super) fn main(arguments: &RobotsArguments) -> Result<()> {
    let Some(name) = &arguments.name else {
        return emit(&list()?);
    };
    emit(LibraryArm::named(name)?.text)
}

/// One line an arm.
fn list() -> Result<String> {
    let mut out = format!(
        "{:<16} {:<40} {:>6} {:>9}  {}\n",
        "name", "arm", "joints", "reach mm", "in the file"
    );
    for arm in LIBRARY {
        let read = arm.read()?;
        let reach = read.about.reach.map_or_else(
            || "-".into(),
            |reach| Unit::Millimetre.from_si(reach).round().to_string(),
        );
        let mut holds = Vec::new();
        if read.robot.joints.iter().any(|joint| joint.mass.is_some()) {
            holds.push("masses");
        }
        if read.about.counting().is_some() {
            holds.push("coupled counting");
        }
        let joints = read.robot.joints.len();
        out.push_str(
            format!(
                "{:<16} {:<40} {joints:>6} {reach:>9}  {}",
                arm.name,
                read.robot.name,
                holds.join(", ")
            )
            .trim_end(),
        );
        out.push('\n');
    }
    Ok(out)
}
