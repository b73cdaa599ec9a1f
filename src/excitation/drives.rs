//! Commands for the drives of a simulated arm, as a file that `diagnose_drives` reads once columns of measured angles are added.

use super::one_a_joint;
use crate::drives::excite::{CommandRequest, Commanding, commands};
use crate::error::{Error, Fault, Result};
use crate::init::chain;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

/// For which arm commands are wanted, and within which limits; angles in deg. A list of one number holds for all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveCommandRequest {
    /// The MJCF that is simulated.
    pub mjcf: PathBuf,
    /// Joints of it, in the order of the chain; empty: the first that are one.
    pub joints: Vec<String>,
    /// s.
    pub seconds: f64,
    /// Commands a second.
    pub rate: f64,
    /// Joint ranges instead of the MJCF's.
    pub limits: Option<Vec<[f64; 2]>>,
    /// Part of each joint's travel left free at either end, percent.
    pub margin: f64,
    /// Where every part begins and ends; `None`: the middle of the range.
    pub home: Option<Vec<f64>>,
    /// deg/s, of the commands.
    pub speed: Vec<f64>,
    /// The same seed gives the same commands.
    pub seed: u64,
}

/// Commands for an arm.
pub struct CommandsProposal {
    /// The file of the arm.
    mjcf: String,
    /// Joints, in the order of the columns.
    pub joints: Vec<String>,
    /// The request, SI.
    pub request: CommandRequest,
    /// The commands.
    pub commands: Commanding,
}

/// What no single recording shows, a sentence each.
const UNSEEN: [&str; 2] = [
    "warm-up over minutes: send the same commands again when the joints are warm",
    "payload apart from the last link: send them with and without it",
];

/// Commands by which most causes are seen. Fails with the faults of the request.
pub fn exciting_commands(wanted: &DriveCommandRequest) -> Result<CommandsProposal> {
    let (arm, all, _) = chain(&wanted.mjcf, &wanted.joints)?;
    let n = arm.joints.len();
    let mjcf = wanted.mjcf.display().to_string();
    let mut faults = Vec::new();
    let degrees = 1f64.to_radians();
    let speed = one_a_joint("--speed", &wanted.speed, degrees, n, &mut faults);
    let range: Vec<[f64; 2]> = match &wanted.limits {
        Some(limits) if limits.len() == n => {
            limits.iter().map(|one| one.map(f64::to_radians)).collect()
        }
        Some(limits) => {
            let message = format!(
                "has {} ranges, the chain {n} joints: {}",
                limits.len(),
                all.join(", ")
            );
            faults.push(Fault::new("--limits", message));
            Vec::new()
        }
        None => {
            let without = arm.joints.iter().filter(|joint| joint.range.is_none());
            let without: Vec<&str> = without.map(|joint| joint.name.as_str()).collect();
            if !without.is_empty() {
                let message = format!(
                    "no range of {}: give --limits MIN:MAX,.. in deg",
                    without.join(", ")
                );
                faults.push(Fault::new(&mjcf, message));
            }
            arm.joints.iter().filter_map(|joint| joint.range).collect()
        }
    };
    let inside = |[least, most]: [f64; 2]| {
        let left = 0.01 * wanted.margin * (most - least);
        [least + left, most - left]
    };
    let range: Vec<[f64; 2]> = range.into_iter().map(inside).collect();
    let home = match &wanted.home {
        Some(home) => one_a_joint("--home", home, degrees, n, &mut faults),
        None => range
            .iter()
            .map(|[least, most]| 0.5 * (least + most))
            .collect(),
    };
    Error::if_spec(faults)?;
    let request = CommandRequest {
        rate: wanted.rate,
        seconds: wanted.seconds,
        range,
        home,
        speed,
        seed: wanted.seed,
    };
    let commands = commands(&request).map_err(super::as_options)?;
    Ok(CommandsProposal {
        mjcf,
        joints: arm.joints.into_iter().map(|joint| joint.name).collect(),
        request,
        commands,
    })
}

impl CommandsProposal {
    /// The commands as `diagnose_drives` reads them: time_s, traj, use, part, cmd1_rad ..; a row is a command, held until the next.
    pub fn csv(&self) -> String {
        let n = self.joints.len();
        let head = (1..=n).map(|joint| format!(",cmd{joint}_rad"));
        let mut text = format!("time_s,traj,use,part{}\n", head.collect::<String>());
        for (k, part) in self.commands.parts.iter().enumerate() {
            let judges = k + 1 == self.commands.parts.len();
            let usage = if judges { "validate" } else { "fit" };
            for row in part.rows.clone() {
                let time = row as f64 * self.commands.period;
                let _ = write!(text, "{time:.6},{},{usage},{}", k + 1, part.name);
                for angle in &self.commands.command[n * row..n * (row + 1)] {
                    let _ = write!(text, ",{angle:.7}");
                }
                text.push('\n');
            }
        }
        text
    }

    /// What is sent when, and what for.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{}: {:.1} s at {:.0} Hz for {}\n",
            self.mjcf,
            self.request.seconds,
            self.request.rate,
            self.joints.join(", ")
        );
        let time = |row: usize| row as f64 * self.commands.period;
        for part in &self.commands.parts {
            let _ = writeln!(
                text,
                "{:>6.1} to {:>5.1} s  {:<6} {}",
                time(part.rows.start),
                time(part.rows.end),
                part.name,
                part.shows
            );
        }
        for line in UNSEEN {
            let _ = writeln!(text, "will not show: {line}");
        }
        text
    }

    /// The same as one JSON document, with the commands, a list of joints a row.
    pub(crate) fn document(&self) -> Value {
        let parts = self.commands.parts.iter().map(|part| {
            json!({ "name": part.name, "shows": part.shows, "rows": [part.rows.start, part.rows.end] })
        });
        json!({
            "robot": self.mjcf, "joints": self.joints, "seconds": self.request.seconds, "rate_hz": self.request.rate,
            "seed": self.request.seed, "home_rad": self.request.home, "range_rad": self.request.range, "speed_rad_s": self.request.speed,
            "parts": parts.collect::<Vec<_>>(), "will_not_show": UNSEEN,
            "command_rad": self.commands.command.chunks(self.joints.len()).collect::<Vec<_>>(),
        })
    }
}
