//! `calib simulate torques`: recordings of torques of moving arms with hidden physics, and their truth apart.

use super::super::{emit, emit_json};
use crate::error::{Error, Fault, Result, counted};
use crate::proof::{RECORDINGS, vacant};
use crate::twin::torque::{TorqueCase, TorqueDesign, TorqueFile};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Where the truth is.
const TRUTH: &str = "truth";

/// Make recordings of joint torques or motor currents of moving arms, with hidden friction, masses, gears and contacts.
///
/// DIR/recordings/CASE holds what a user has: robot.json and recording.csv. DIR/truth/CASE holds what is hidden (truth.json) and what a
/// diagnosis is asked for (want.json). Torques are made by other mathematics than those of `diagnose_torques`.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate torques --out blind --seed 7 --cases 40
  calib diagnose pipelines/dynamics/pipeline.yaml --set case=blind/recordings/torque_000")]
pub(super) struct TorquesArguments {
    /// The folder to make; it must not exist, or be empty
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// The same seed gives the same recordings
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Recordings to make
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=9999))]
    cases: u32,
    /// Share of recordings without any effect
    #[arg(long, value_name = "SHARE", default_value_t = 0.2)]
    nulls: f64,
    /// Share of effects in another form than the usual formula
    #[arg(long, value_name = "SHARE", default_value_t = 0.5)]
    other_forms: f64,
    /// Effects beside viscous and Coulomb friction, at most
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(0..=5))]
    most: u8,
    /// Seconds of a recording: 55 % are to fit, the rest judges
    #[arg(long, value_name = "S", default_value_t = 48.0)]
    seconds: f64,
    /// Rows a second
    #[arg(long, value_name = "HZ", default_value_t = 100.0)]
    rate: f64,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

pub(super) fn main(arguments: &TorquesArguments) -> Result<()> {
    let shares = [("--nulls", arguments.nulls), ("--other-forms", arguments.other_forms)];
    let wrong = shares.into_iter().filter(|(_, share)| !(0.0..=1.0).contains(share));
    let mut faults: Vec<Fault> =
        wrong.map(|(option, share)| Fault::new(option, format!("{share} is no share; allowed: 0 to 1"))).collect();
    for (option, value, [least, most]) in
        [("--seconds", arguments.seconds, [16.0, 3600.0]), ("--rate", arguments.rate, [20.0, 5000.0])]
    {
        if !(least..=most).contains(&value) {
            faults.push(Fault::new(option, format!("{value}; allowed: {least} to {most}")));
        }
    }
    if !faults.is_empty() {
        return Err(Error::Spec(faults));
    }
    vacant(&arguments.out)?;
    let design = TorqueDesign {
        seed: arguments.seed,
        nulls: arguments.nulls,
        other_forms: arguments.other_forms,
        most: usize::from(arguments.most),
        seconds: arguments.seconds,
        rate: arguments.rate,
    };
    for number in 0..arguments.cases as usize {
        let case = TorqueCase::draw(&design, number);
        write(&arguments.out.join(RECORDINGS).join(&case.name), &case.recording())?;
        write(&arguments.out.join(TRUTH).join(&case.name), &case.truth())?;
    }
    let recordings = arguments.out.join(RECORDINGS);
    if arguments.json {
        return emit_json(&json!({ "cases": arguments.cases, "recordings": recordings }));
    }
    emit(&format!("{}: {}\n", counted(u64::from(arguments.cases), "recording"), recordings.display()))
}

fn write(folder: &Path, files: &[TorqueFile]) -> Result<()> {
    let failed = |path: &Path, error: &std::io::Error| Error::store(path.display().to_string(), error.to_string());
    std::fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    for (name, text) in files {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|error| failed(&path, &error))?;
    }
    Ok(())
}
