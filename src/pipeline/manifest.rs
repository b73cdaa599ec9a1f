//! The audit record of one run, written when it starts, between stages where a second of work went into them, and at the end.
//!
//! Runs by the names that people give them. `HEAD` is the last complete run: the tables of every stage, for the sake of the run itself.

use super::overrides::Override;
use super::plan::Selection;
use crate::error::{Error, Result, counted, nearest};
use crate::store::{ActionId, FileHash, Link, StageKey, Store, TableRef};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Bumped when older readers can no longer understand a manifest.
const MANIFEST_FORMAT: u32 = 1;

/// What the engine cannot know by itself: who runs it, where and when.
#[derive(Debug, Clone)]
pub struct Surroundings {
    pub(crate) tool: Tool,
    pub(crate) host: Host,
    /// Who ran it, where that is known and wanted.
    pub(crate) user: Option<String>,
    /// Variables that calib and its libraries look at, where they are set.
    pub(crate) environment: BTreeMap<String, String>,
    /// As it was typed, word by word.
    pub(crate) command_line: Vec<String>,
    pub(crate) now: fn() -> std::time::SystemTime,
    /// Bytes that this process had in use at most, where that is known.
    pub(crate) peak_memory: fn() -> Option<u64>,
    /// A fresh id for a run.
    pub(crate) run_id: String,
}

/// The program that ran.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Tool {
    /// `calib`.
    pub(crate) name: String,
    pub(crate) version: String,
    pub(crate) target: String,
    /// Revision of the sources; it and `rustc` are known where whoever built it said so (`CALIB_REVISION`, `CALIB_RUSTC`).
    #[serde(default)]
    pub(crate) revision: Option<String>,
    /// Version of the compiler.
    #[serde(default)]
    pub(crate) rustc: Option<String>,
}

/// The machine that ran.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Host {
    pub(crate) name: String,
    pub(crate) os: String,
    pub(crate) architecture: String,
    /// That the process may use.
    pub(crate) cores: usize,
}

/// The record of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Manifest {
    manifest_format: u32,
    /// ULID: ids sort by time.
    pub(crate) run_id: String,
    /// What the run was for.
    #[serde(default)]
    pub(crate) purpose: Purpose,
    /// The run that ended last before this one, with the seal of its manifest.
    pub(crate) previous: Option<Link>,
    /// How it ended, or that it has not.
    pub(crate) status: RunStatus,
    /// What went wrong, where the status says so.
    pub(crate) error: Option<String>,
    pub(crate) pipeline: PipelineRecord,
    /// Given on the command line.
    pub(crate) overrides: Vec<Override>,
    pub(crate) tool: Tool,
    pub(crate) host: Host,
    /// Who, where that is known.
    pub(crate) user: Option<String>,
    /// Variables that may change speed, never results.
    pub(crate) environment: BTreeMap<String, String>,
    /// As it was typed, word by word.
    pub(crate) command_line: Vec<String>,
    pub(crate) seed: u64,
    pub(crate) jobs: usize,
    /// RFC 3339, UTC.
    pub(crate) started: String,
    /// RFC 3339, UTC.
    pub(crate) ended: Option<String>,
    pub(crate) wall_seconds: Option<f64>,
    /// The most memory that the whole process had in use up to the end of this run.
    #[serde(default)]
    pub(crate) peak_memory_bytes: Option<u64>,
    /// In the order of the pipeline.
    pub stages: Vec<StageReport>,
}

/// How a run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunStatus {
    /// Running, or killed.
    Running,
    /// Every selected stage is done.
    Done,
    /// A stage failed.
    Failed,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct PipelineRecord {
    pub(crate) name: String,
    pub(crate) file: String,
    /// Hash of the YAML file's bytes.
    pub(crate) blake3: String,
    pub(crate) text: String,
    /// With variables and overrides filled in.
    pub(crate) resolved: serde_json::Value,
}

/// How a stage stands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StageStatus {
    /// Its tables were there already.
    Cached,
    /// Its work was done in this run.
    Executed,
    /// Its work ended with an error.
    Failed,
    /// Outside of what was selected, or never reached.
    #[default]
    NotRun,
}

/// One stage's report: its state, keys and tables.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct StageReport {
    pub(crate) id: String,
    pub(crate) uses: String,
    pub(crate) implementation: u32,
    pub(crate) status: StageStatus,
    pub(crate) reason: Option<String>,
    /// The key of its record.
    pub(crate) action: Option<ActionId>,
    /// The components of `action`.
    pub(crate) key: Option<StageKey>,
    pub(crate) inputs: Vec<InputRecord>,
    /// Raw files that it read.
    pub(crate) files: Vec<FileRecord>,
    /// Tables that it wrote.
    pub outputs: Vec<OutputRecord>,
    pub(crate) notes: Vec<String>,
    pub(crate) warnings: Vec<String>,
    /// Duration of the execution, also where it was an earlier run's.
    pub(crate) wall_seconds: Option<f64>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct InputRecord {
    pub(crate) port: String,
    /// `stage.port` that wrote it.
    pub(crate) from: String,
    #[serde(flatten)]
    pub(crate) table: TableRef,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct FileRecord {
    pub(crate) place: String,
    /// As text: what is not UTF-8 in it stands there as U+FFFD.
    pub(crate) path: String,
    pub(crate) bytes: u64,
    pub(crate) modified: Option<String>,
    pub(crate) blake3: FileHash,
}

/// A table that a stage wrote.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct OutputRecord {
    /// On which it was written.
    pub(crate) port: String,
    /// The name of its schema.
    pub kind: String,
    /// Where people find it, as text: what is not UTF-8 in it stands there as U+FFFD.
    pub(crate) path: Option<String>,
    /// Where it is.
    #[serde(flatten)]
    pub table: TableRef,
}

impl Manifest {
    /// The manifest of a run in the store.
    pub fn of(store: &Store, run: &str) -> Result<Self> {
        let value = store.manifest(run)?;
        serde_json::from_value(value).map_err(|e| {
            Error::store(
                format!("run {run}"),
                format!("not a manifest that this calib reads: {e}"),
            )
        })
    }

    /// Whether this is a run of `calib run` that has the tables of every stage.
    pub(crate) fn is_complete(&self) -> bool {
        let has = |stage: &StageReport| {
            matches!(stage.status, StageStatus::Cached | StageStatus::Executed)
        };
        self.purpose == Purpose::Run
            && self.status == RunStatus::Done
            && self.stages.iter().all(has)
    }

    /// Kind of run as it is listed; only a `run` can be HEAD.
    pub(crate) fn what(&self) -> &'static str {
        match (self.purpose, self.status) {
            (Purpose::Compensate, _) => "compensate",
            (Purpose::Diagnose, _) => "diagnose",
            (Purpose::Export, _) => "export",
            (Purpose::Simulate, _) => "simulate",
            (Purpose::Fleet, _) => "fleet",
            (Purpose::Run, RunStatus::Running) => "unfinished",
            (Purpose::Run, RunStatus::Failed) => "failed",
            (Purpose::Run, RunStatus::Done) if self.is_complete() => "run",
            (Purpose::Run, RunStatus::Done) => "partial",
        }
    }

    /// The report of a stage by its id.
    pub fn stage(&self, id: &str) -> Option<&StageReport> {
        self.stages.iter().find(|stage| stage.id == id)
    }

    /// The tables of a kind, in pipeline order.
    pub(crate) fn tables<'o>(&'o self, kind: &'o str) -> impl Iterator<Item = &'o OutputRecord> {
        self.stages
            .iter()
            .flat_map(|stage| &stage.outputs)
            .filter(move |output| output.kind == kind)
    }

    pub(super) fn new(
        plan: &super::plan::Plan,
        surroundings: &Surroundings,
        options: &RunOptions,
        started: String,
    ) -> Self {
        let pending = |stage: &super::plan::PlannedStage| StageReport {
            id: stage.id.clone(),
            uses: stage.entry.name.into(),
            implementation: stage.entry.implementation,
            ..StageReport::default()
        };
        Self {
            manifest_format: MANIFEST_FORMAT,
            run_id: surroundings.run_id.clone(),
            purpose: options.purpose,
            previous: None,
            status: RunStatus::Running,
            error: None,
            pipeline: PipelineRecord {
                name: plan.name.clone(),
                file: plan.file.display().to_string(),
                blake3: blake3::hash(plan.text.as_bytes()).to_hex().to_string(),
                text: plan.text.clone(),
                resolved: plan.resolved.clone(),
            },
            overrides: plan.overrides.clone(),
            tool: surroundings.tool.clone(),
            host: surroundings.host.clone(),
            user: surroundings.user.clone(),
            environment: surroundings.environment.clone(),
            command_line: surroundings.command_line.clone(),
            seed: plan.seed,
            jobs: options.jobs,
            started,
            ended: None,
            wall_seconds: None,
            peak_memory_bytes: None,
            stages: plan.stages.iter().map(pending).collect(),
        }
    }
}

/// The run that a person means: an id, the beginning or end of one, a tag, `HEAD` for the last complete one, `HEAD~2` for the complete
/// one two before it.
pub fn find_run(store: &Store, text: &str) -> Result<String> {
    let runs = store.runs()?;
    let nothing = |message: String| Err(Error::spec(format!("run {text}"), message));
    let Some(newest) = runs.last() else {
        return nothing(format!("the store {} has no runs", store.name()));
    };
    if let Some(back) = text.strip_prefix("HEAD") {
        let back = match back.strip_prefix('~') {
            Some("") => Some(1),
            Some(count) => count.parse::<usize>().ok(),
            None => back.is_empty().then_some(0),
        };
        let Some(back) = back else {
            return nothing("expected HEAD or HEAD~N".into());
        };
        return match complete(store, &runs, back)? {
            Ok(run) => Ok(run),
            Err(0) => nothing(format!(
                "the store has no complete run of `calib run`; the last run of all is {newest}, `calib log` shows it"
            )),
            Err(count) => nothing(format!(
                "the store has {} of `calib run`",
                counted(count, "complete run")
            )),
        };
    }
    if let Some(run) = store.tags()?.remove(text) {
        return Ok(run);
    }
    let wanted = text.to_uppercase();
    let found: Vec<&String> = runs
        .iter()
        .filter(|id| id.starts_with(&wanted) || id.ends_with(&wanted))
        .collect();
    match found.as_slice() {
        [run] if !text.is_empty() => Ok((*run).clone()),
        [] => {
            let tags = store.tags()?;
            let hint = nearest(text, tags.keys().map(String::as_str)).map_or_else(
                || ";".into(),
                |near| format!("; did you mean the tag `{near}`?"),
            );
            nothing(format!("no such run or tag{hint} `calib log` lists them"))
        }
        several => nothing(format!(
            "the ids of {} runs begin or end like this; give more of the id",
            several.len()
        )),
    }
}

/// The complete run `back` before the last, or how many complete runs there are. A damaged manifest on the way is refused: nobody knows
/// whether its run counts.
fn complete(store: &Store, runs: &[String], back: usize) -> Result<Result<String, usize>> {
    let mut count = 0;
    for run in runs.iter().rev().filter(|run| store.has_manifest(run)) {
        let manifest = Manifest::of(store, run).map_err(|error| {
            Error::store(
                format!("run {run}"),
                format!(
                    "cannot be read, so that HEAD is not known; name a run by its id ({error})"
                ),
            )
        })?;
        if manifest.is_complete() {
            if count == back {
                return Ok(Ok(run.clone()));
            }
            count += 1;
        }
    }
    Ok(Err(count))
}

/// The last run of `calib diagnose` after a run, by its id.
pub fn later_diagnosis(store: &Store, run: &str) -> Option<String> {
    let runs = store.runs().ok()?.into_iter().rev();
    let mut later = runs.take_while(|id| id.as_str() > run);
    later.find(|id| {
        let is_it = |manifest: Manifest| {
            manifest.purpose == Purpose::Diagnose && manifest.status == RunStatus::Done
        };
        Manifest::of(store, id).is_ok_and(is_it)
    })
}

/// What a run was made for. The manifests of older versions do not say; theirs count as runs of their own.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// `calib run`: for the sake of all its tables.
    #[default]
    Run,
    /// For what the verb needs of the pipeline, which may be a part.
    Compensate,
    /// `calib diagnose`.
    Diagnose,
    /// `calib export`.
    Export,
    /// `calib simulate`.
    Simulate,
    /// One robot of a fleet.
    Fleet,
}

/// How to run a plan.
#[derive(Debug, Clone)]
pub struct RunOptions {
    pub(crate) selection: Selection,
    /// Worker threads; no result depends on it.
    pub(crate) jobs: usize,
    pub(crate) purpose: Purpose,
}
