//! Which poses to measure, before anything is measured: the best for all parameters together, for telling two effects apart, or for
//! telling a finding of a run from its rival. What is asked comes in, poses and what they promise go out.

mod apart;
mod drive;
mod proposal;
mod site;
mod sockets;

pub use apart::{RunStage, apart};
pub use drive::{Drive, fault, write};
pub use proposal::proposal;
pub use sockets::{places, sockets};

use crate::effect::identified;
use crate::error::{Fault, instead};
use crate::estimate::choose::{Aim, DesignRequest};
use serde::Deserialize;
use std::cmp::Ordering::Less;
use std::path::PathBuf;

/// What is asked for, in the units of the command line.
#[derive(Debug, Clone, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseRequest {
    pub(crate) count: usize,
    /// Random poses to choose from.
    pub(crate) candidates: usize,
    /// The same seed gives the same poses.
    pub(crate) seed: u64,
    /// Effects to tell; none: all that `identify` estimates.
    pub(crate) effects: Vec<String>,
    /// Joint ranges instead of the robot file's, deg or mm.
    pub limits: Option<Vec<[f64; 2]>>,
    /// Part of each joint's travel left free at either end, percent.
    pub(crate) margin: f64,
    /// Where the measured point may be, mm: x, y, z.
    #[serde(rename = "box")]
    pub(crate) bounds: Option<Vec<[f64; 2]>>,
    /// mm.
    pub(crate) floor: Option<f64>,
    /// kg; none: 0, or those of the run.
    #[serde(rename = "payload")]
    pub(crate) payloads: Vec<f64>,
    /// Standard deviation per axis of a measured point, mm.
    pub(crate) sigma: Option<f64>,
    /// The file that the poses go to.
    #[serde(skip)]
    pub(crate) out: Option<PathBuf>,
}

/// The defaults of `calib poses`.
impl Default for PoseRequest {
    fn default() -> Self {
        Self {
            count: 50,
            candidates: 1000,
            seed: 1,
            effects: Vec::new(),
            limits: None,
            margin: 2.0,
            bounds: None,
            floor: None,
            payloads: Vec::new(),
            sigma: None,
            out: None,
        }
    }
}

impl PoseRequest {
    /// Faults that need no robot; `pair` are two effects to separate, or none. Places are options of `calib poses`.
    pub(crate) fn faults(&self, pair: &[String]) -> Vec<Fault> {
        let known: Vec<&str> = identified().map(|cause| cause.name()).collect();
        let mut faults = Vec::new();
        let mut fault = |place: &str, message: String| faults.push(Fault::new(place, message));
        for (option, names) in [("--effects", &self.effects[..]), ("--separate", pair)] {
            for name in names.iter().filter(|name| !proposal::is_known(name)) {
                let other = instead(name, &known);
                fault(option, format!("unknown effect `{name}`{other}"));
            }
        }
        if !matches!(pair.len(), 0 | 2) {
            let message = "expected two effects, or a run whose findings have rivals (--run)";
            fault("--separate", message.into());
        }
        for (option, count, most) in [
            ("--count", self.count, 2000),
            ("--candidates", self.candidates, 1_000_000),
        ] {
            if !(1..=most).contains(&count) {
                fault(option, format!("expected 1 to {most}, found {count}"));
            }
        }
        for (option, ranges) in [("--limits", &self.limits), ("--box", &self.bounds)] {
            let mut ranges = ranges.iter().flatten();
            if let Some([from, to]) = ranges.find(|[from, to]| from.partial_cmp(to) != Some(Less)) {
                let message = format!("{from}:{to} is empty; expected MIN:MAX with MIN below MAX");
                fault(option, message);
            }
        }
        if let [a, b] = pair {
            if a == b {
                let message = format!("expected two different effects, found `{a}` twice");
                fault("--separate", message);
            }
            let chosen = |name: &String| self.effects.is_empty() || self.effects.contains(name);
            for name in pair.iter().filter(|name| !chosen(name)) {
                let message = format!("`{name}` is named by --separate but not here: add it");
                fault("--effects", message);
            }
        }
        let masses = self.payloads.iter();
        for mass in masses.filter(|mass| !(mass.is_finite() && **mass >= 0.0)) {
            let message = format!("expected masses of 0 or more, kg, found {mass}");
            fault("--payload", message);
        }
        let sigma = self.sigma;
        if let Some(sigma) = sigma.filter(|sigma| !(sigma.is_finite() && *sigma > 0.0)) {
            let message = format!("expected a length above 0, mm, found {sigma}");
            fault("--sigma", message);
        }
        if !(0.0..=45.0).contains(&self.margin) {
            let message = format!("expected 0 to 45 percent, found {}", self.margin);
            fault("--margin", message);
        }
        if let Some(bounds) = self.bounds.as_ref().filter(|bounds| bounds.len() != 3) {
            let message = format!("expected three ranges, x, y, z, found {}", bounds.len());
            fault("--box", message);
        }
        faults
    }
}

/// Poses and what they promise.
pub struct PoseAnswer {
    /// None where no pose helps.
    pub drive: Option<Drive>,
    /// As people read it.
    pub text: String,
    /// As programs do.
    pub document: serde_json::Value,
    /// What a person must not overlook, a sentence each.
    pub warnings: Vec<String>,
}

/// What every proposal ends with.
fn closing(request: &PoseRequest) -> String {
    let text = "self-collision and collision with the cell are not checked: drive the poses slowly first\n";
    match &request.out {
        Some(path) => format!("{text}poses: {}\n", path.display()),
        None => format!("{text}no file was written: give --out poses.csv (or .parquet)\n"),
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
