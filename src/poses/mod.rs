//! Which poses to measure, before anything is measured: the best for all parameters together, for telling two effects apart, or for
//! telling a finding of a run from its rival. What is asked comes in, poses and what they promise go out.

mod apart;
mod drive;
mod proposal;
mod recorded;
mod show;
mod site;
mod sockets;

pub use apart::{RunStage, apart};
pub use drive::{Drive, fault, write};
pub use proposal::{RobotFiles, is_known, proposal};
pub use sockets::{SocketProposal, places, sockets};

use crate::estimate::choose::{Aim, DesignRequest};
use std::path::PathBuf;

/// What is asked for, in the units of the command line.
#[derive(Debug, Clone)]
pub struct PoseRequest {
    /// How many poses.
    pub count: usize,
    /// Random poses to choose from.
    pub candidates: usize,
    /// The same seed gives the same poses.
    pub seed: u64,
    /// Effects to tell; none: all that `identify` estimates.
    pub effects: Vec<String>,
    /// Joint ranges instead of the robot file's, deg or mm.
    pub limits: Option<Vec<[f64; 2]>>,
    /// Part of each joint's travel left free at either end, percent.
    pub margin: f64,
    /// Where the measured point may be, mm: x, y, z.
    pub bounds: Option<Vec<[f64; 2]>>,
    /// mm.
    pub floor: Option<f64>,
    /// kg; none: 0, or those of the run.
    pub payloads: Vec<f64>,
    /// Standard deviation per axis of a measured point, mm.
    pub sigma: Option<f64>,
    /// The file that the poses go to.
    pub out: Option<PathBuf>,
}

/// Poses and what they promise.
pub trait PoseAnswer {
    /// None where no pose helps.
    fn drive(&self) -> Option<Drive<'_>>;
    /// For a person.
    fn text(&self) -> String;
    /// For a program.
    fn document(&self) -> serde_json::Value;
    /// What a person must not overlook, a sentence each.
    fn warnings(&self) -> &[String] {
        &[]
    }
}

/// `sigma` in m.
fn wish(request: &PoseRequest, aim: Aim, sigma: f64) -> DesignRequest {
    DesignRequest {
        aim,
        count: request.count,
        candidates: request.candidates,
        sigma,
        seed: request.seed,
    }
}
