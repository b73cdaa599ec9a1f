//! `calib excite`: which motion to record for torques, or which commands to send to drives, before anything is recorded.

use super::poses::{Ranges, ranges};
use crate::cli::surroundings::cores;
use crate::cli::{emit, emit_json, put};
use crate::error::{Error, Result};
use crate::excitation::{DriveCommandRequest, MotionRequest, exciting_commands, exciting_motion};
use clap::Args;
use std::path::PathBuf;

/// Propose a motion from which torques tell most of masses and friction.
///
/// A Fourier series of each joint that starts and stops at rest, within range, speed and acceleration; a particle swarm makes its information
/// on base parameters, viscous and Coulomb friction greatest (D-optimal). Reported before anything is recorded: the condition number, the standard
/// deviation expected of each parameter, both compared with those of random motions within the same limits, and what the motion will not determine.
/// The file has time_s, q1_deg .., dq1_deg_s .., ddq1_deg_s2 .. in even steps.
///
/// With --mjcf commands for simulated drives instead, of which only position and speed are limited: slow reversals, sines, ramps, holds, and another
/// motion that judges; reported is what each part shows. The file has time_s, traj, use, part, cmd1_rad ..; with columns of
/// measured angles, q1_rad .., it is the recording that `diagnose_drives` reads.
///
/// SELF-COLLISION IS NOT CHECKED, nor collision with the cell or torque limits: drive the motion slowly first.
#[derive(Args)]
#[command(after_help = EXCITE_EXAMPLES)]
pub(super) struct ExciteArguments {
    /// The robot file: calib's YAML, or a practice robot.json
    #[arg(
        value_name = "ROBOT",
        required_unless_present = "mjcf",
        conflicts_with = "mjcf"
    )]
    robot: Option<PathBuf>,
    /// The URDF that the robot file refers to
    #[arg(long, value_name = "FILE", requires = "robot")]
    urdf: Option<PathBuf>,
    /// Commands for the drives of this MJCF instead
    #[arg(long, value_name = "FILE", conflicts_with_all = ["harmonics", "acceleration", "noise", "generations", "jobs"])]
    mjcf: Option<PathBuf>,
    /// Its joints, in the order of the chain; without it the first that are one
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', requires = "mjcf")]
    joints: Vec<String>,
    /// Where every part of the commands begins and ends, one number or one a joint, deg; without it the middle of the range
    #[arg(
        long,
        value_name = "DEG,..",
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "mjcf"
    )]
    home: Option<Vec<f64>>,
    /// Length of the motion, s [default: 20, of commands 90]
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Rows a second
    #[arg(long, value_name = "HZ", default_value_t = 100.0)]
    rate: f64,
    /// Sines of each joint; the slowest lasts ten seconds or less
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u8).range(2..=12))]
    harmonics: u8,
    /// Joint ranges instead of the robot file's, in its counting, deg
    #[arg(long, value_name = "MIN:MAX,..", allow_hyphen_values = true, value_parser = ranges)]
    limits: Option<Ranges>,
    /// Part of each joint's travel left free at either end, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 2.0)]
    margin: f64,
    /// Greatest speed of the joints, one number or one a joint, deg/s
    #[arg(
        long,
        value_name = "DEG_S,..",
        value_delimiter = ',',
        default_value = "60"
    )]
    speed: Vec<f64>,
    /// Greatest acceleration of the joints, one number or one a joint, deg/s2
    #[arg(
        long,
        value_name = "DEG_S2,..",
        value_delimiter = ',',
        default_value = "180"
    )]
    acceleration: Vec<f64>,
    /// Standard deviation of the torque of a row, white, one number or one a joint, Nm
    #[arg(long, value_name = "NM,..", value_delimiter = ',', default_value = "1")]
    noise: Vec<f64>,
    /// Generations of the search, of 40 motions each
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    generations: u16,
    /// The same seed gives the same motion
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Worker threads; no result depends on it [default: all cores]
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Writes the motion to this file, delimited text
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Prints one JSON document on stdout, with the motion or the commands
    #[arg(long)]
    json: bool,
}

const EXCITE_EXAMPLES: &str = "Examples:
  calib excite robot.yaml --speed 90 --acceleration 300 --out motion.csv
  calib excite robot.json --seconds 40 --rate 250 --noise 2,4,3,0.8,0.6,0.4 --seed 7 --out motion.csv
  calib excite robot.yaml --limits -90:90,-60:60,-60:60,-90:90,-90:90,-90:90 --json
  calib excite --mjcf so101.xml --rate 50 --speed 90 --margin 15 --out commands.csv";

/// s of a motion, and of commands.
const SECONDS: [f64; 2] = [20.0, 90.0];

impl ExciteArguments {
    pub(crate) fn run(&self) -> Result<()> {
        if !(0.0..=45.0).contains(&self.margin) {
            let message = format!("expected 0 to 45 percent, found {}", self.margin);
            return Err(Error::spec("--margin", message));
        }
        let limits = self.limits.as_ref().map(|limits| limits.0.clone());
        let (csv, document, text) = match (&self.robot, &self.mjcf) {
            (_, Some(mjcf)) => {
                let proposal = exciting_commands(&DriveCommandRequest {
                    mjcf: mjcf.clone(),
                    joints: self.joints.clone(),
                    seconds: self.seconds.unwrap_or(SECONDS[1]),
                    rate: self.rate,
                    limits,
                    margin: self.margin,
                    home: self.home.clone(),
                    speed: self.speed.clone(),
                    seed: self.seed,
                })?;
                (proposal.csv(), proposal.document(), proposal.text())
            }
            (robot, None) => {
                let proposal = exciting_motion(&MotionRequest {
                    robot: robot.clone().unwrap_or_default(),
                    urdf: self.urdf.clone(),
                    seconds: self.seconds.unwrap_or(SECONDS[0]),
                    rate: self.rate,
                    harmonics: usize::from(self.harmonics),
                    limits,
                    margin: self.margin,
                    speed: self.speed.clone(),
                    acceleration: self.acceleration.clone(),
                    noise: self.noise.clone(),
                    generations: usize::from(self.generations),
                    seed: self.seed,
                    jobs: self.jobs.map_or_else(cores, usize::from),
                })?;
                (proposal.csv(), proposal.document(), proposal.text())
            }
        };
        if let Some(out) = &self.out {
            put(Some(out), csv)?;
        }
        if self.json {
            emit_json(&document)
        } else {
            emit(&text)
        }
    }
}
