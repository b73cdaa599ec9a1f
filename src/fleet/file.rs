//! FLEET.yaml, typed: which robots go through which pipeline, with what settings of their own.

use crate::error::{Error, Fault, Result};
use crate::pipeline::{Override, misnamed, sort_by_place, trouble_at, unreadable_text};
use crate::raw;
use crate::report::PageLanguage;
use crate::yaml::{self, Node, Trouble, typed};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The format of the file that this version reads.
const FORMAT: u64 = 1;

/// A fleet: one pipeline, many robots.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "calib fleet")]
pub struct FleetFile {
    /// Format of this file: 1.
    pub(crate) calib: u64,
    /// Name of the fleet, e.g. of a plant and its campaign; part of the paths of its tables.
    pub(crate) name: String,
    /// The pipeline's YAML file, relative to this one.
    pub(crate) pipeline: PathBuf,
    /// Variables and settings of the pipeline for all robots, as `--set`: `{seed: 7, split.n: 4}`.
    #[serde(default)]
    pub(crate) set: BTreeMap<String, Value>,
    /// What is known of all robots.
    #[serde(default)]
    pub(crate) groups: Groups,
    /// Where the robots come from.
    pub robots: Vec<RobotSource>,
    /// Robots that differ from the others; later entries win.
    #[serde(default)]
    pub(crate) overrides: Vec<Exception>,
    /// An earlier fleet of the same robots, done in the same store: changes since then are tested.
    #[serde(default)]
    pub previous: Option<Previous>,
    /// What an earlier fleet in the same store says of parameters, as priors.
    #[serde(default)]
    pub(crate) prior: Option<PriorFrom>,
    /// Language of the fleet's pages: `en` or `de`; that of the robots' own is their pipeline's.
    #[serde(default)]
    pub(crate) language: PageLanguage,
}

/// What distinguishes robots in tables and pools.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Groups {
    /// Model of the robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) model: Option<String>,
    /// Where it stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) plant: Option<String>,
    /// Date of the measurement, e.g. 2026-10-01.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) campaign: Option<String>,
}

impl Groups {
    /// These, and where they are silent the other's.
    pub(super) fn or(&self, other: &Self) -> Self {
        let first = |a: &Option<String>, b: &Option<String>| a.clone().or_else(|| b.clone());
        Self {
            model: first(&self.model, &other.model),
            plant: first(&self.plant, &other.plant),
            campaign: first(&self.campaign, &other.campaign),
        }
    }
}

/// Robots: exactly one of `folders`, `list` and `recording`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotSource {
    /// One folder a robot, as a pattern, relative to this file or absolute: `recordings/*`. The folder's name is the robot's.
    #[serde(default)]
    pub(crate) folders: Option<String>,
    /// CSV or Parquet with the columns `robot`, and if wanted `folder`, `model`, `plant`, `campaign`, `set.TARGET` (a value as in
    /// `set`) and `path.TARGET` (a file relative to the list).
    #[serde(default)]
    pub(crate) list: Option<PathBuf>,
    /// One CSV or Parquet table with the rows of all robots.
    #[serde(default)]
    pub(crate) recording: Option<PathBuf>,
    /// The column of `recording` that names the robot.
    #[serde(default = "robot_id")]
    pub(crate) by: String,
    /// The pipeline's variable that takes the folder, or the robot's part of the recording.
    #[serde(default)]
    pub(crate) variable: Option<String>,
    /// What is known of these robots.
    #[serde(default)]
    pub(crate) groups: Groups,
    /// Variables and settings of the pipeline for these robots.
    #[serde(default)]
    pub(crate) set: BTreeMap<String, Value>,
}

/// Robots that differ from the others.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Exception {
    /// Names; `*` stands for anything.
    pub(crate) robots: Vec<String>,
    /// Labels by which robots are grouped.
    #[serde(default)]
    pub(crate) groups: Groups,
    /// Overrides of the pipeline.
    #[serde(default)]
    pub(crate) set: BTreeMap<String, Value>,
}

/// The campaign before this one.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Previous {
    /// Name of the earlier fleet.
    pub(crate) fleet: String,
    /// The id of this pipeline's stage `compare`.
    #[serde(default = "compare")]
    pub stage: String,
    /// Chance of a false flag in the whole fleet, shared by all robots and parameters.
    #[serde(default = "five_percent")]
    pub(crate) alpha: f64,
}

/// Priors of a stage from an earlier fleet.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PriorFrom {
    /// Name of the earlier fleet.
    pub(crate) fleet: String,
    /// The stage of this pipeline that takes the priors, with a setting `prior`; its namesake there gives them.
    pub(crate) stage: String,
    /// Whose values are taken.
    pub(crate) by: PriorBy,
    /// Effects that it speaks of, by canonical name; of `causes` none.
    #[serde(default)]
    pub(crate) effects: Vec<String>,
}

/// Whose parameters make a prior.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum PriorBy {
    /// The robot's own.
    Robot,
    /// Mean and spread over all robots of the same `groups.model`, with the robot's own left out.
    Model,
    /// Causes that `calib fleet diagnose` found in the robots of the same `groups.model`: how usual and how large each is in the
    /// other robots, for a stage `diagnose`.
    Causes,
}

fn robot_id() -> String {
    "robot_id".into()
}
fn compare() -> String {
    "compare".into()
}
fn five_percent() -> f64 {
    0.05
}

impl FleetFile {
    /// Reads the file; fails with every fault at once.
    pub fn load(path: &Path) -> Result<(Self, Node)> {
        let label = path.display().to_string();
        let text = raw::text(path).map_err(|error| Error::spec(&label, unreadable_text(&error)))?;
        let (tree, mut troubles) = yaml::parse(&text);
        if let Some(tree) = tree {
            match typed::<Self>(&tree) {
                Ok(file) => {
                    troubles.extend(file.check(&tree));
                    if troubles.is_empty() {
                        return Ok((file, tree));
                    }
                }
                Err(more) => troubles.extend(more),
            }
        }
        Err(faulty(&label, troubles))
    }

    /// What types cannot express.
    fn check(&self, tree: &Node) -> Vec<Trouble> {
        let mut troubles = Vec::new();
        let mut fault =
            |path: &str, message: String| troubles.push(trouble_at(tree, path, message));
        if self.calib != FORMAT {
            fault(
                "calib",
                format!(
                    "format {} is not known to this calib, which reads {FORMAT}",
                    self.calib
                ),
            );
        }
        if let Some(message) = misnamed(&self.name) {
            fault("name", message);
        }
        if self.robots.is_empty() {
            fault(
                "robots",
                "expected at least one of `- folders:`, `- list:` and `- recording:`".into(),
            );
        }
        for (index, source) in self.robots.iter().enumerate() {
            let given = [
                source.folders.is_some(),
                source.list.is_some(),
                source.recording.is_some(),
            ];
            if given.iter().filter(|given| **given).count() != 1 {
                fault(
                    &format!("robots[{index}]"),
                    "expected exactly one of `folders`, `list` and `recording`".into(),
                );
            }
            if source.recording.is_some() && source.variable.is_none() {
                let message = "missing: the variable of the pipeline that takes a robot's part of the recording";
                fault(&format!("robots[{index}].variable"), message.into());
            }
        }
        if let Some(prior) = &self.prior
            && prior.effects.is_empty() != (prior.by == PriorBy::Causes)
        {
            let message =
                "expected names of effects for `by: robot` and `by: model`, none for `by: causes`";
            fault("prior.effects", message.into());
        }
        if let Some(previous) = &self.previous {
            if !(previous.alpha > 0.0 && previous.alpha < 1.0) {
                fault(
                    "previous.alpha",
                    "expected a significance level between 0 and 1, e.g. 0.05".into(),
                );
            }
            if previous.fleet == self.name {
                fault(
                    "previous.fleet",
                    "is this fleet itself; give every campaign a name of its own".into(),
                );
            }
        }
        troubles
    }
}

/// The text of the pipeline, or the place in FLEET.yaml that names it.
pub(super) fn pipeline_text(path: &Path, tree: &Node, pipeline: &Path) -> Result<String> {
    raw::text(pipeline).map_err(|error| {
        let message = format!(
            "`{}`: {} (relative to this file)",
            pipeline.display(),
            unreadable_text(&error)
        );
        let trouble = trouble_at(tree, "pipeline", message);
        Error::Spec(vec![trouble.fault(&path.display().to_string())])
    })
}

/// All faults of the file, in its order.
pub(super) fn faulty(label: &str, mut troubles: Vec<Trouble>) -> Error {
    sort_by_place(&mut troubles);
    let faults: Vec<Fault> = troubles
        .into_iter()
        .map(|trouble| trouble.fault(label))
        .collect();
    Error::Spec(faults)
}

/// The JSON Schema of FLEET.yaml, for editors.
pub fn json_schema() -> String {
    let schema = SchemaSettings::draft07()
        .into_generator()
        .into_root_schema_for::<FleetFile>()
        .to_value();
    serde_json::to_string_pretty(&schema).expect("a schema is plain data") + "\n"
}

/// One robot. Its name is data from outside: never a path, never a command.
#[derive(Debug, Clone)]
pub struct FleetRobot {
    /// Unique in the fleet.
    pub(crate) name: String,
    /// Its labels.
    pub(crate) groups: Groups,
    /// Later ones win.
    pub(crate) sets: Vec<Override>,
    /// Why its data cannot be reached at all.
    pub(crate) unreadable: Option<String>,
}

impl FleetRobot {
    pub(super) fn new(name: String) -> Self {
        Self {
            name,
            groups: Groups::default(),
            sets: Vec::new(),
            unreadable: None,
        }
    }

    /// A name for paths: letters and digits of the robot's name, then its hash.
    pub(crate) fn handle(&self) -> String {
        let kept = self
            .name
            .chars()
            .filter(char::is_ascii_alphanumeric)
            .take(24)
            .collect::<String>();
        let hash = blake3::hash(self.name.as_bytes()).to_hex();
        if kept.is_empty() {
            hash[..16].to_string()
        } else {
            format!("{kept}-{}", &hash[..16])
        }
    }

    /// Sets a path or another text.
    pub(super) fn set_text(&mut self, target: &str, text: &str) {
        self.sets.push(Override {
            target: target.into(),
            value: quoted(text),
        });
    }
    pub(super) fn set_values(&mut self, values: &BTreeMap<String, Value>) {
        self.sets
            .extend(values.iter().map(|(target, value)| Override {
                target: target.clone(),
                value: written(value),
            }));
    }
}

/// Text as YAML, whatever is in it.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            ' '..='~' => out.push(c),
            c => out.push_str(&format!("\\U{:08X}", u32::from(c))),
        }
    }
    out.push('"');
    out
}

/// A value as YAML on one line.
fn written(value: &Value) -> String {
    match value {
        Value::String(text) => quoted(text),
        Value::Array(items) => format!(
            "[{}]",
            items.iter().map(written).collect::<Vec<_>>().join(", ")
        ),
        Value::Object(map) => {
            let entry =
                |(key, value): (&String, &Value)| format!("{}: {}", quoted(key), written(value));
            format!(
                "{{{}}}",
                map.iter().map(entry).collect::<Vec<_>>().join(", ")
            )
        }
        plain => plain.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_survives_the_way_through_yaml() {
        for text in [
            "r'1\"",
            "a\nb",
            "$(reboot)",
            "../x",
            "# no: [comment",
            "\u{85}\u{2028}\u{1f916}",
            "",
            "null",
            "1e3",
            "tab\there",
        ] {
            let (node, troubles) = crate::yaml::parse(&quoted(text));
            assert!(troubles.is_empty(), "{text:?}: {troubles:?}");
            assert_eq!(node.and_then(|node| node.text()).as_deref(), Some(text));
        }
    }
}
