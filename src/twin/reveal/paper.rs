//! The two documents of a case: the sealed truth, and what a diagnosis said (`calib diagnose --json`).

use serde::Deserialize;
use std::collections::BTreeSet;

/// An effect and its place.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
pub struct Name {
    /// Canonical name.
    pub effect: String,
    /// In the words of the interface.
    #[serde(rename = "where")]
    pub place: String,
}

/// A true number.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Number {
    /// Name of the parameter.
    pub name: String,
    /// In `unit`.
    pub value: f64,
    /// Symbol.
    #[serde(default)]
    pub unit: String,
    /// One standard deviation, if stated.
    #[serde(default)]
    pub sigma: Option<f64>,
}

/// A concealed cause.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Cause {
    /// Canonical name.
    pub effect: String,
    /// In the words of the interface.
    #[serde(rename = "where")]
    pub place: String,
    /// The word for its form.
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
    /// What data cannot separate from it: as good as its own name and place.
    #[serde(default)]
    pub same: Vec<Name>,
    /// Its true numbers.
    pub parameters: Vec<Number>,
}

fn yes() -> bool {
    true
}

/// How many points.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Points {
    /// To fit.
    pub fit: usize,
    /// To judge by.
    pub validate: usize,
}

/// Noise as it fell out, mm.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct NoiseSize {
    /// At the points to fit.
    pub fit_rms_per_axis_mm: f64,
    /// At the points to judge by.
    pub validate_rms_per_axis_mm: f64,
    /// What foreign effects do there beyond what the points to fit show of them.
    #[serde(default)]
    pub unseen_rms_per_axis_mm: f64,
}

/// The truth of a case; what it holds besides is not needed here.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Truth {
    /// Name of the recording.
    pub case: String,
    /// `null`, `single`, `pair`, `open`.
    pub content: String,
    /// Family of its effect.
    pub family: String,
    /// Its kind.
    pub robot: String,
    /// Names that are right too.
    pub accepted: Vec<Name>,
    /// What was concealed.
    pub effects: Vec<Cause>,
    /// Faults of the recording itself.
    pub tampered: Vec<Name>,
    /// How many points.
    pub points: Points,
    /// Numbers that geometry amounts to.
    #[serde(default)]
    pub geometry_rank: usize,
    /// As it fell out, of recordings of points.
    #[serde(default)]
    pub noise: Option<NoiseSize>,
}

/// Errors of held-out points.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Errors {
    /// rms, mm.
    #[serde(default)]
    pub validate_rms_mm: Option<f64>,
}

/// A finding as the diagnosis states it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Finding {
    /// Canonical name.
    pub effect: String,
    /// In the words of the interface.
    #[serde(rename = "where")]
    pub place: String,
    /// Fitted numbers.
    #[serde(default)]
    pub parameters: Vec<Number>,
    /// Explanations that were not excluded.
    #[serde(default)]
    pub rivals: Vec<Rival>,
    /// That it is this effect at this place, and that it acts at this place.
    #[serde(default)]
    pub probability: Option<f64>,
    /// Probability of the place.
    #[serde(default)]
    pub place_probability: Option<f64>,
}

/// Another explanation of a finding.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Rival {
    /// Canonical name.
    pub effect: String,
    /// In the words of the interface.
    #[serde(rename = "where")]
    pub place: String,
    /// Probability of this rival.
    #[serde(default)]
    pub probability: Option<f64>,
}

/// What a diagnosis said.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Answer {
    /// As it was given.
    pub verdict: String,
    /// Errors of the base model.
    #[serde(default)]
    pub before: Option<Errors>,
    /// With the findings.
    #[serde(default)]
    pub after: Option<Errors>,
    /// The strongest first.
    pub findings: Vec<Finding>,
}

/// Effects and places of single links.
pub type Atoms = BTreeSet<(String, String)>;

/// One (effect, place) for each link of a run: `link 2-4` is links 2, 3 and 4.
pub(super) fn atoms(effect: &str, place: &str) -> Atoms {
    let run = place
        .strip_prefix("link ")
        .and_then(|rest| rest.split_once('-'));
    let ends = run.and_then(|(from, to)| Some((from.parse::<u8>().ok()?, to.parse::<u8>().ok()?)));
    match ends {
        Some((from, to)) => (from..=to)
            .map(|link| (effect.to_string(), format!("link {link}")))
            .collect(),
        None => BTreeSet::from([(effect.to_string(), place.to_string())]),
    }
}
