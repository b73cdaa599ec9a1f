//! The two documents of a case: the sealed truth, and what a diagnosis said (`calib diagnose --json`).

use serde::Deserialize;
use std::collections::BTreeSet;

/// An effect and its place.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
pub struct Name {
    pub(crate) effect: String,
    #[serde(rename = "where")]
    pub(crate) place: String,
}

/// A true number.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct Number {
    pub(crate) name: String,
    pub(crate) value: f64,
    #[serde(default)]
    pub(crate) unit: String,
    /// One standard deviation, if stated.
    #[serde(default)]
    pub(crate) sigma: Option<f64>,
}

/// A concealed cause.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Cause {
    pub effect: String,
    #[serde(rename = "where")]
    pub place: String,
    pub(crate) form: String,
    /// Made by a formula that the library is not expected to hold.
    #[serde(default)]
    pub(crate) strange: bool,
    /// False for what goes along with another cause: it may be named, or counted to that one.
    #[serde(default = "yes")]
    pub wanted: bool,
    /// Squared visible displacement over the noise's variance.
    #[serde(rename = "L")]
    pub(crate) strength: f64,
    /// What data cannot separate from it: as good as its own name and place.
    #[serde(default)]
    pub same: Vec<Name>,
    pub(crate) parameters: Vec<Number>,
}

fn yes() -> bool {
    true
}

/// How many points are to be fitted.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct Points {
    pub(crate) fit: usize,
}

/// Noise as it fell out, mm.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct NoiseSize {
    /// At the points to judge by.
    pub(crate) validate_rms_per_axis_mm: f64,
    /// What foreign effects do there beyond what the points to fit show of them.
    #[serde(default)]
    pub(crate) unseen_rms_per_axis_mm: f64,
}

/// The truth of a case; what it holds besides is not needed here.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Truth {
    pub case: String,
    /// `null`, `single`, `pair`, `open`.
    pub content: String,
    pub(crate) robot: String,
    /// Names that are right too.
    pub(crate) accepted: Vec<Name>,
    pub effects: Vec<Cause>,
    pub(crate) tampered: Vec<Name>,
    pub(crate) points: Points,
    /// Numbers that geometry amounts to.
    #[serde(default)]
    pub(crate) geometry_rank: usize,
    /// As it fell out, of recordings of points.
    #[serde(default)]
    pub(crate) noise: Option<NoiseSize>,
}

/// Errors of held-out points.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub(crate) struct Errors {
    /// rms, mm.
    #[serde(default)]
    pub(crate) validate_rms_mm: Option<f64>,
}

/// A finding as the diagnosis states it, or a rival of one.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct Finding {
    pub effect: String,
    #[serde(rename = "where")]
    pub place: String,
    #[serde(default)]
    pub parameters: Vec<Number>,
    /// Explanations that were not excluded.
    #[serde(default)]
    pub rivals: Vec<Finding>,
    /// That it is this effect at this place, and that it acts at this place.
    #[serde(default)]
    pub(crate) probability: Option<f64>,
    #[serde(default)]
    pub(crate) place_probability: Option<f64>,
}

/// What a diagnosis said.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Answer {
    pub(crate) verdict: String,
    #[serde(default)]
    pub(crate) before: Option<Errors>,
    #[serde(default)]
    pub(crate) after: Option<Errors>,
    /// The strongest first.
    pub(crate) findings: Vec<Finding>,
}

/// Effects and places of single links.
pub(crate) type Atoms = BTreeSet<(String, String)>;

/// One (effect, place) for each link of a run: `link 2-4` is links 2, 3 and 4.
pub(super) fn atoms(effect: &str, place: &str) -> Atoms {
    let run = place
        .strip_prefix("link ")
        .and_then(|tail| tail.split_once('-'));
    let ends = run.and_then(|(from, to)| Some((from.parse::<u8>().ok()?, to.parse::<u8>().ok()?)));
    match ends {
        Some((from, to)) => (from..=to)
            .map(|link| (effect.to_string(), format!("link {link}")))
            .collect(),
        None => BTreeSet::from([(effect.to_string(), place.to_string())]),
    }
}

/// What states an effect and its place.
macro_rules! named {
    ($($name:ident)+) => {
        $( impl $name {
            pub(super) fn atoms(&self) -> Atoms {
                atoms(&self.effect, &self.place)
            }
        } )+
    };
}
named! { Name Cause Finding }

impl Finding {
    /// What it may mean with which probability: itself and its rivals.
    pub(super) fn names(&self) -> impl Iterator<Item = (Option<f64>, Atoms)> {
        let all = std::iter::once(self).chain(&self.rivals);
        all.map(|one| (one.probability, one.atoms()))
    }
}

/// Those of several.
pub(super) fn all_atoms<'a>(names: impl IntoIterator<Item = &'a Name>) -> Atoms {
    names.into_iter().flat_map(Name::atoms).collect()
}
