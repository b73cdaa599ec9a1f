//! The two documents of a case: the sealed truth, and what a diagnosis said (`calib diagnose --json`).

use serde::Deserialize;
use std::collections::BTreeSet;

/// An effect and its place.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
pub struct Name {
    pub effect: String,
    #[serde(rename = "where")]
    pub place: String,
}

/// A true number.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Number {
    pub name: String,
    pub value: f64,
    #[serde(default)]
    pub unit: String,
    #[serde(default)]
    pub sigma: Option<f64>,
}

/// A concealed cause.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Cause {
    pub effect: String,
    #[serde(rename = "where")]
    pub place: String,
    pub form: String,
    /// Made by a formula that the library is not expected to hold.
    #[serde(default)]
    pub strange: bool,
    /// False for what goes along with another cause: it may be named, or counted to that one.
    #[serde(default = "yes")]
    pub wanted: bool,
    /// Squared visible displacement over the noise's variance.
    #[serde(rename = "L")]
    pub strength: f64,
    pub visible_rms_mm: f64,
    pub parameters: Vec<Number>,
}

fn yes() -> bool {
    true
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Points {
    pub fit: usize,
    pub validate: usize,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct NoiseSize {
    pub fit_rms_per_axis_mm: f64,
    pub validate_rms_per_axis_mm: f64,
}

/// The truth of a case; what it holds besides is not needed here.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Truth {
    pub case: String,
    /// `null`, `single`, `pair`, `open`.
    pub content: String,
    pub family: String,
    pub robot: String,
    pub accepted: Vec<Name>,
    pub effects: Vec<Cause>,
    /// Faults of the recording itself.
    pub tampered: Vec<Name>,
    pub points: Points,
    pub geometry_rank: usize,
    pub noise: NoiseSize,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Errors {
    #[serde(default)]
    pub validate_rms_mm: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Finding {
    pub effect: String,
    #[serde(rename = "where")]
    pub place: String,
    #[serde(default)]
    pub parameters: Vec<Number>,
    #[serde(default)]
    pub rivals: Vec<Rival>,
    /// That it is this effect at this place, and that it acts at this place.
    #[serde(default)]
    pub probability: Option<f64>,
    #[serde(default)]
    pub place_probability: Option<f64>,
}

/// Another explanation of a finding.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Rival {
    pub effect: String,
    #[serde(rename = "where")]
    pub place: String,
    #[serde(default)]
    pub probability: Option<f64>,
}

/// What a diagnosis said.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Answer {
    pub verdict: String,
    #[serde(default)]
    pub before: Option<Errors>,
    #[serde(default)]
    pub after: Option<Errors>,
    pub findings: Vec<Finding>,
}

/// Effects and places of single links.
pub type Atoms = BTreeSet<(String, String)>;

/// One (effect, place) for each link of a run: `link 2-4` is links 2, 3 and 4.
pub(super) fn atoms(effect: &str, place: &str) -> Atoms {
    let run = place.strip_prefix("link ").and_then(|rest| rest.split_once('-'));
    let ends = run.and_then(|(from, to)| Some((from.parse::<u8>().ok()?, to.parse::<u8>().ok()?)));
    match ends {
        Some((from, to)) => (from..=to).map(|link| (effect.to_string(), format!("link {link}"))).collect(),
        None => BTreeSet::from([(effect.to_string(), place.to_string())]),
    }
}
