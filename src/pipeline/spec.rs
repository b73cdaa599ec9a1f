//! The pipeline's YAML, typed: every stage with its settings and files, or every fault with its place.

use super::overrides::{self, Override};
use crate::error::{Fault, instead};
use crate::stage::{ErasedStage, StageEntry};
use crate::yaml::{self, Mark, Node, Trouble, YamlValue, typed};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The format of the YAML that this version reads.
pub(crate) const FORMAT: u64 = 1;

/// A pipeline as far as it could be read.
#[derive(Default)]
pub(super) struct Draft {
    pub(crate) name: String,
    pub(crate) seed: u64,
    pub(crate) stages: Vec<StageDraft>,
    /// The YAML with variables and overrides filled in.
    pub(crate) resolved: serde_json::Value,
    /// Faults of the command line.
    pub(crate) faults: Vec<Fault>,
    /// Faults of the file, with their places.
    pub(crate) troubles: Vec<Trouble>,
}

pub(super) struct StageDraft {
    pub(crate) id: String,
    pub(crate) mark: Mark,
    /// Nothing where `uses` names no stage.
    pub(crate) entry: Option<&'static StageEntry>,
    /// Nothing where the settings are faulty.
    pub(crate) stage: Option<Box<dyn ErasedStage>>,
    pub(crate) files: Vec<InputFile>,
    /// Sets of the split that the settings name.
    pub(crate) sets: Vec<NamedSet>,
    /// Wishes for the wiring: port -> names of stages.
    pub(crate) reads: BTreeMap<String, PortSources>,
}

/// Stages that a port is to be read from, as the YAML names them.
pub(super) struct PortSources {
    pub(crate) mark: Mark,
    pub(crate) names: Vec<String>,
}

/// A set of the split, where the settings of a stage name it.
pub(super) struct NamedSet {
    /// Below `with`.
    pub(crate) place: String,
    pub(crate) mark: Mark,
    pub(crate) name: String,
    /// By the YAML itself, not by a default.
    pub(crate) given: bool,
}

/// A raw input file of a stage.
#[derive(Debug, Clone)]
pub struct InputFile {
    /// Where it stands below `with`.
    pub(crate) place: String,
    pub(crate) path: PathBuf,
    /// As the YAML, or `--set`, names it.
    pub named: PathBuf,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    dead_code,
    reason = "named so that other keys are faults; read from the tree"
)]
struct Head {
    calib: u64,
    name: String,
    #[serde(default)]
    seed: u64,
    #[serde(default)]
    variables: BTreeMap<String, IgnoredAny>,
    stages: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    dead_code,
    reason = "named so that other keys are faults; read from the tree"
)]
struct StageHead {
    #[serde(default)]
    id: Option<String>,
    uses: String,
    #[serde(default)]
    with: Option<BTreeMap<String, IgnoredAny>>,
    #[serde(default)]
    reads: Option<BTreeMap<String, IgnoredAny>>,
}

/// Reads `text`, the content of the YAML `file`; relative paths in it start at the folder of the file.
pub(super) fn read(
    file: &Path,
    text: &str,
    sets: &[Override],
    stages: &'static [StageEntry],
) -> Draft {
    let (tree, mut troubles) = yaml::parse(text);
    let mut draft = Draft::default();
    let Some(mut tree) = tree else {
        return Draft { troubles, ..draft };
    };
    let (variables, faults) = overrides::apply(&mut tree, sets);
    if let Err(more) = typed::<Head>(&tree) {
        troubles.extend(more);
    }
    troubles.extend(check_head(&tree));
    draft.name = tree.get("name").and_then(Node::text).unwrap_or_default();
    draft.seed = tree
        .get("seed")
        .and_then(|seed| typed(seed).ok())
        .unwrap_or_default();

    let mut known = BTreeSet::new();
    if let Some(YamlValue::List(items)) = tree.at_mut("stages").map(|list| &mut list.value) {
        for (index, item) in items.iter_mut().enumerate() {
            let path = format!("stages[{index}]");
            let unfilled = overrides::substitute(item, &path, &variables);
            let (stage, more) = read_stage(file, item, stages);
            // What else is wrong with a value that holds no value yet is not known.
            let more = more
                .into_iter()
                .map(|trouble| trouble.at(item.mark).below(&path));
            let more =
                more.filter(|trouble| unfilled.iter().all(|other| other.path != trouble.path));
            troubles.extend(more.collect::<Vec<_>>());
            troubles.extend(unfilled);
            if !stage.id.is_empty() && !known.insert(stage.id.clone()) {
                let message = format!(
                    "two stages have the id `{}`; give one of them another `id`",
                    stage.id
                );
                troubles.push(Trouble::new(message).at(item.mark).below(&path));
            }
            draft.stages.push(stage);
        }
    }
    let infinite = non_finite(&tree);
    troubles.retain(|trouble| infinite.iter().all(|other| other.path != trouble.path));
    troubles.extend(infinite);
    draft.resolved = json(&tree);
    Draft {
        faults,
        troubles,
        ..draft
    }
}

impl Draft {
    /// All faults, those of the file in its order; nothing where it is sound.
    pub(crate) fn all_faults(&mut self, file: &str) -> Vec<Fault> {
        sort_by_place(&mut self.troubles);
        let mut seen = BTreeSet::new();
        let mut faults = std::mem::take(&mut self.faults);
        let troubles = self
            .troubles
            .drain(..)
            .filter(|trouble| seen.insert((trouble.path.clone(), trouble.message.clone())));
        faults.extend(troubles.map(|trouble| trouble.fault(file)));
        faults
    }
}

/// Troubles in the order of the file.
pub(crate) fn sort_by_place(troubles: &mut [Trouble]) {
    troubles.sort_by_key(|trouble| match trouble.mark {
        Some(Mark::Line { line, column }) => (line, column),
        _ => (u64::MAX, 0),
    });
}

/// Why there is no text of YAML in a file.
pub(crate) fn unreadable_text(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        std::io::ErrorKind::InvalidData => "not a text file: expected YAML in UTF-8".into(),
        _ => error.to_string(),
    }
}

/// A fault of what stands at a path of a tree, or would stand there.
pub(crate) fn trouble_at(tree: &Node, path: &str, message: impl Into<String>) -> Trouble {
    Trouble::new(message)
        .at(tree.nearest_mark(path))
        .below(path)
}

fn check_head(tree: &Node) -> Vec<Trouble> {
    let mut troubles = Vec::new();
    let mut fault = |key: &str, message| troubles.push(trouble_at(tree, key, message));
    match tree.get("calib").map(|node| &node.value) {
        Some(YamlValue::Integer(format)) if *format == i128::from(FORMAT) => {}
        Some(YamlValue::Integer(format)) => fault(
            "calib",
            format!("format {format} is not known to this calib, which reads {FORMAT}"),
        ),
        _ => {}
    }
    if let Some(name) = tree.get("name").and_then(Node::text)
        && let Some(message) = misnamed(&name)
    {
        fault("name", message);
    }
    if tree
        .get("stages")
        .is_some_and(|stages| matches!(&stages.value, YamlValue::List(items) if items.is_empty()))
    {
        fault("stages", "expected at least one stage".into());
    }
    troubles
}

/// Most letters of an id or a name.
const LONGEST: usize = 64;

/// Why an id or a name cannot be a part of paths, if so.
pub(crate) fn misnamed(name: &str) -> Option<String> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphanumeric()) || !name.chars().all(allowed) {
        return Some(format!(
            "`{name}`: expected letters, digits, `-` and `_`, starting with a letter or digit"
        ));
    }
    let letters = name.len();
    (letters > LONGEST).then(|| format!("`{name}`: {letters} letters; allowed: up to {LONGEST}"))
}

fn read_stage(
    file: &Path,
    node: &Node,
    registry: &'static [StageEntry],
) -> (StageDraft, Vec<Trouble>) {
    let mut troubles = typed::<StageHead>(node).err().unwrap_or_default();
    let uses = node.get("uses").and_then(Node::text);
    let id = node
        .get("id")
        .and_then(Node::text)
        .or_else(|| uses.clone())
        .unwrap_or_default();
    if !id.is_empty()
        && node.get("id").is_some()
        && let Some(message) = misnamed(&id)
    {
        troubles.push(trouble_at(node, "id", message));
    }
    let entry = uses
        .as_ref()
        .and_then(|name| registry.iter().find(|entry| entry.name == name));
    if let (Some(name), None) = (&uses, entry) {
        let names: Vec<&str> = registry.iter().map(|entry| entry.name).collect();
        let message = format!("unknown stage `{name}`{}", instead(name, &names));
        troubles.push(trouble_at(node, "uses", message));
    }
    let mut draft = StageDraft {
        id,
        mark: node.mark,
        entry,
        stage: None,
        files: Vec::new(),
        sets: Vec::new(),
        reads: BTreeMap::new(),
    };
    for (port, mark, wish) in node.get("reads").map(Node::entries).unwrap_or_default() {
        let path = format!("reads.{port}");
        match stage_names(wish) {
            Some(names) => drop(
                draft
                    .reads
                    .insert(port.clone(), PortSources { mark: *mark, names }),
            ),
            None => troubles.push(
                Trouble::new("expected the id of a stage, or a list of ids")
                    .at(wish.mark)
                    .below(&path),
            ),
        }
    }
    if let Some(entry) = entry {
        let with = match node.get("with") {
            Some(with) if !matches!(with.value, YamlValue::Null) => with.clone(),
            _ => Node::empty_map(node.mark),
        };
        if matches!(with.value, YamlValue::Map(_)) {
            let (stage, files, mut more) = type_settings(file, with.clone(), entry);
            more.iter_mut().for_each(moved);
            let named = |(place, name): (String, String)| {
                let (mark, given) = (with.nearest_mark(&place), with.at(&place).is_some());
                NamedSet {
                    place: format!("with.{place}"),
                    mark,
                    name,
                    given,
                }
            };
            draft.sets = stage
                .iter()
                .flat_map(|stage| stage.sets_named())
                .map(named)
                .collect();
            (draft.stage, draft.files) = (stage, files);
            troubles.extend(more.into_iter().map(|trouble| trouble.below("with")));
        }
    }
    (draft, troubles)
}

fn stage_names(wish: &Node) -> Option<Vec<String>> {
    match &wish.value {
        YamlValue::Text(name) => Some(vec![name.clone()]),
        YamlValue::List(items) => items.iter().map(Node::text).collect(),
        _ => None,
    }
}

/// Says where a setting went that stages no longer have.
fn moved(trouble: &mut Trouble) {
    if trouble.path == "tracker" && trouble.is_unknown_key() {
        trouble.message =
            "the instrument's noise belongs to the recording: state it once, as `instrument` of the stage `ingest`, e.g. \
                           `instrument: leica_at960` or `instrument: {constant_um: 10, per_metre_um: 2.5, coverage: 2}`"
                .into();
    }
}

type Typed = (Option<Box<dyn ErasedStage>>, Vec<InputFile>, Vec<Trouble>);

/// Types the settings of a stage and finds its files.
fn type_settings(file: &Path, mut with: Node, entry: &StageEntry) -> Typed {
    let folder = file.parent().unwrap_or(Path::new(""));
    let unnamed = overrides::expand(&mut with, folder);
    if !unnamed.is_empty() {
        return (None, Vec::new(), unnamed);
    }
    let stage = match (entry.parse)(&with) {
        Ok(stage) => stage,
        Err(troubles) => return (None, Vec::new(), troubles),
    };
    let mut troubles: Vec<Trouble> = stage
        .check()
        .into_iter()
        .map(|fault| trouble_at(&with, &fault.place, fault.message))
        .collect();
    let mut files = Vec::new();
    for (place, raw) in stage.files() {
        let overridden = with.at(&place).is_some_and(|node| node.overridden);
        let path = if overridden {
            raw.0.clone()
        } else {
            folder.join(&raw.0)
        };
        let mark = with.nearest_mark(&place);
        let text = Node {
            overridden,
            ..Node::new(YamlValue::Text(path.to_string_lossy().into_owned()), mark)
        };
        let wrong = unreadable(&path)
            .into_iter()
            .chain(with.put(&place, text).err());
        troubles.extend(wrong.map(|message| Trouble::new(message).at(mark).below(&place)));
        files.push(InputFile {
            place,
            path,
            named: raw.0,
        });
    }
    if !troubles.is_empty() || files.is_empty() {
        return (troubles.is_empty().then_some(stage), files, troubles);
    }
    // Once more, with the paths as they are to be opened.
    match (entry.parse)(&with) {
        Ok(stage) => (Some(stage), files, troubles),
        Err(troubles) => (None, files, troubles),
    }
}

fn unreadable(path: &Path) -> Option<String> {
    let shown = path.display();
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => crate::raw::source(path)
            .err()
            .map(|error| format!("`{shown}` {error}")),
        Ok(_) => None,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Some(format!(
            "no such file: `{shown}` (paths are relative to the YAML file; those given by --set to the working directory)"
        )),
        Err(error) => Some(format!("`{shown}` cannot be read: {error}")),
    }
}

fn non_finite(tree: &Node) -> Vec<Trouble> {
    let mut troubles = Vec::new();
    tree.walk("", &mut |path, node| {
        if let YamlValue::Float(value) = node.value
            && !value.is_finite()
        {
            let found = node.raw.clone().unwrap_or_else(|| value.to_string());
            troubles.push(
                Trouble::new(format!("expected a finite number; found {found}"))
                    .at(node.mark)
                    .below(path),
            );
        }
    });
    troubles
}

fn json(node: &Node) -> serde_json::Value {
    use serde_json::Value as Json;
    match &node.value {
        YamlValue::Null => Json::Null,
        YamlValue::Bool(value) => Json::Bool(*value),
        YamlValue::Integer(value) => match (u64::try_from(*value), i64::try_from(*value)) {
            (Ok(value), _) => value.into(),
            (_, Ok(value)) => value.into(),
            _ => value.to_string().into(),
        },
        YamlValue::Float(value) => (*value).into(),
        YamlValue::Text(text) => text.clone().into(),
        YamlValue::List(items) => Json::Array(items.iter().map(json).collect()),
        YamlValue::Map(entries) => Json::Object(
            entries
                .iter()
                .map(|(key, _, value)| (key.clone(), json(value)))
                .collect(),
        ),
    }
}
