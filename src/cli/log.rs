//! `calib log`: the runs of a store, the last first.
//!
//! `calib show`: one run, or one stage of it, in full.
//!
//! `calib lineage`: where a table comes from, down to the raw files.
//!
//! `calib explain`: why a stage ran, or did not.
//!
//! What keeps a store in order: `calib tag` names runs, `calib verify` hashes everything again (exit code 1 where something is not what
//! was written), `calib gc` takes away tables that no kept run needs.

use crate::audit::{explain, kept_actions, lineage};
use crate::cli::surroundings::{bucket, default_store, now, open_store};
use crate::cli::{emit, emit_json};
use crate::diff::table_hash;
use crate::error::{Error, Result};
use crate::pipeline::{Manifest, RunStatus, StageStatus, find_run};
use crate::store::{Store, Verification};
use crate::summary::{self, status};
use crate::text::filled;
use clap::Args;
use minijinja::context;
use minijinja::value::Serde;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// List the runs, the last first: when, what for, which pipeline, how it ended.
///
/// A `run` is a complete one: `calib run` with the tables of every stage. A `partial` one stopped short of that by --only or --until, `failed`
/// and `unfinished` ones did not end; `compensate`, `export`, `diagnose`, `simulate` and `fleet` ran what that verb needed.
#[derive(Args)]
#[command(after_help = "Examples:
  calib log
  calib log --pipeline sr210d --limit 5

Other commands take a run by its id, the beginning or end of its id, a tag, HEAD for the\nlast complete run, or HEAD~2 for the complete run two before that.")]
pub(super) struct LogArguments {
    /// Runs of this pipeline only
    #[arg(long, value_name = "NAME")]
    pipeline: Option<String>,
    /// Runs to show; 0 shows all
    #[arg(long, value_name = "N", default_value_t = 20)]
    limit: usize,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl LogArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let tags = store.tags()?;
        // Where there is none, or a manifest is damaged, the list says so in its lines.
        let head = find_run(&store, "HEAD").ok();
        let (mut text, mut rows, mut shown) = (String::new(), Vec::new(), 0);
        let is_other = |manifest: &Manifest| {
            let name = self.pipeline.as_ref();
            name.is_some_and(|name| name != &manifest.pipeline.name)
        };
        for run in store.runs()?.into_iter().rev() {
            if self.limit > 0 && shown == self.limit {
                text.push_str("older ones: --limit 0\n");
                break;
            }
            let on_run = tags.iter().filter(|(_, tagged)| **tagged == run);
            let on_run: Vec<&str> = on_run.map(|(tag, _)| tag.as_str()).collect();
            let is_head = head.as_ref() == Some(&run);
            match Manifest::of(&store, &run) {
                Ok(manifest) if is_other(&manifest) => continue,
                Ok(manifest) => {
                    let names = is_head.then_some("HEAD").into_iter();
                    let names: Vec<&str> = names.chain(on_run.iter().copied()).collect();
                    let [executed, cached] = counts(&store, &manifest);
                    text.push_str(&line(&manifest, [executed, cached], &names));
                    rows.push(json!({
                        "run": run, "started": manifest.started, "what": manifest.what(), "pipeline": manifest.pipeline.name,
                        "status": manifest.status, "wall_seconds": manifest.wall_seconds, "executed": executed, "cached": cached,
                        "tags": on_run, "head": is_head, "error": manifest.error,
                    }));
                }
                Err(error) => {
                    text.push_str(&format!("{run}  {error}\n"));
                    rows.push(json!({ "run": run, "status": "unreadable", "error": error.to_string(), "tags": on_run }));
                }
            }
            shown += 1;
        }
        if self.json {
            return emit_json(&rows);
        }
        emit(if shown == 0 { "no runs\n" } else { &text })
    }
}

fn line(manifest: &Manifest, [executed, cached]: [usize; 2], tags: &[&str]) -> String {
    let status = status(manifest);
    let seconds = manifest
        .wall_seconds
        .map(|seconds| format!("  {seconds:.1} s"));
    let tags = (!tags.is_empty()).then(|| format!("  [{}]", tags.join(", ")));
    let [seconds, tags] = [seconds, tags].map(Option::unwrap_or_default);
    let (run, started, what) = (&manifest.run_id, &manifest.started, manifest.what());
    let name = &manifest.pipeline.name;
    format!(
        "{run}  {started:.16}  {what:10}  {name}  {status}, {executed} run, {cached} cached{seconds}{tags}\n"
    )
}

/// How many stages were executed, and how many cached. The manifest of a run that did not end is older than its events.
fn counts(store: &Store, manifest: &Manifest) -> [usize; 2] {
    let events = if manifest.status == RunStatus::Running {
        store.events(&manifest.run_id)
    } else {
        Vec::new()
    };
    [StageStatus::Executed, StageStatus::Cached].map(|status| {
        let has_ended = |event: &&serde_json::Value| {
            event["event"] == "ends" && event["detail"]["status"] == json!(status)
        };
        let stages = manifest.stages.iter();
        let noted = stages.filter(|stage| stage.status == status).count();
        noted.max(events.iter().filter(has_ended).count())
    })
}

/// Show a run: its pipeline, what was overridden, who ran it where, and every stage; or one stage with its inputs and tables.
#[derive(Args)]
#[command(after_help = "Examples:
  calib show HEAD
  calib show HEAD~1/geometry
  calib show released --json > manifest.json
  calib show released --yaml > as_it_was_run.yaml")]
pub(super) struct ShowArguments {
    /// A run, as `calib log` names it, or RUN/STAGE
    #[arg(value_name = "RUN[/STAGE]", default_value = "HEAD")]
    run: String,
    /// Prints the run's YAML as it was read, comments included
    #[arg(long, conflicts_with = "json")]
    yaml: bool,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints the manifest as it is
    #[arg(long)]
    json: bool,
}

impl ShowArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let (run, stage) = match self.run.split_once('/') {
            Some((run, stage)) => (run, Some(stage)),
            None => (self.run.as_str(), None),
        };
        let run = find_run(&store, run)?;
        let manifest = Manifest::of(&store, &run)?;
        let Some(id) = stage else {
            return match (self.yaml, self.json) {
                (true, _) => emit(&manifest.pipeline.text),
                (_, true) => emit_json(&store.manifest(&run)?),
                _ => emit(&summary::run(&manifest)),
            };
        };
        let Some(stage) = manifest.stage(id) else {
            let ids = manifest.stages.iter().map(|stage| stage.id.as_str());
            let ids = ids.collect::<Vec<_>>().join(", ");
            let message = format!("run {run} has no such stage; its stages: {ids}");
            return Err(Error::spec(format!("stage {id}"), message));
        };
        if self.json {
            return emit_json(stage);
        }
        emit(&summary::stage(stage))
    }
}

/// Trace a table: the stage and run that made it, its settings, its input tables, theirs, down to the raw files.
#[derive(Args)]
#[command(after_help = "Examples:
  calib lineage .calib/tables/sr210d/validate.statistics.parquet
  calib lineage HEAD/stiffness/parameters
  calib lineage 4f2a90c1")]
pub(super) struct LineageArguments {
    /// A table's file, RUN/STAGE/PORT, or the beginning of its content hash
    #[arg(value_name = "TABLE")]
    table: String,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl LineageArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let node = lineage(&store, &hash(&store, &self.table)?)?;
        if self.json {
            return emit_json(&node);
        }
        emit(&filled(
            include_str!("lineage.txt"),
            context! { of => Serde(node) },
        ))
    }
}

fn hash(store: &Store, table: &str) -> Result<String> {
    if Path::new(table).is_file() {
        let found = table_hash(Path::new(table))?;
        return found
            .ok_or_else(|| Error::spec(table, "carries no content hash: calib did not write it"));
    }
    let parts: Vec<&str> = table.split('/').collect();
    let [run, stage, port] = parts[..] else {
        return Ok(table.into());
    };
    let manifest = Manifest::of(store, &find_run(store, run)?)?;
    let output = manifest
        .stage(stage)
        .and_then(|stage| stage.outputs.iter().find(|output| output.port == port));
    let unknown = || {
        let id = &manifest.run_id;
        let message =
            format!("run {id} has no such table; calib show {run}/{stage} lists a stage's");
        Error::spec(table, message)
    };
    Ok(output.ok_or_else(unknown)?.table.table_hash.to_string())
}

/// Explain why a stage ran, or did not: which part of what it depends on changed since the run before.
#[derive(Args)]
#[command(after_help = "Examples:
  calib explain stiffness
  calib explain stiffness --run HEAD~3

Whether a stage would run now, and why: calib run PIPELINE --dry-run")]
pub(super) struct ExplainArguments {
    /// The stage's id
    stage: String,
    /// The run to explain
    #[arg(long, value_name = "RUN", default_value = "HEAD")]
    run: String,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl ExplainArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let explanation = explain(&store, &find_run(&store, &self.run)?, &self.stage)?;
        if self.json {
            return emit_json(&explanation);
        }
        emit(&summary::explanation(&explanation))
    }
}

/// Take away tables that no run needs: neither a tagged one nor the last ones of any pipeline. Manifests always stay.
///
/// Never runs by itself, never while a run is in flight, and leaves everything that is younger than the grace period.
#[derive(Args)]
#[command(after_help = "Examples:
  calib gc --dry-run
  calib gc --keep-runs 3 --grace-hours 1")]
pub(super) struct GcArguments {
    /// Complete runs of every pipeline whose tables are kept, and as many others since; tagged ones always are
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    keep_runs: u32,
    /// Keeps what was written within this many hours
    #[arg(long, value_name = "HOURS", default_value_t = 24)]
    grace_hours: u32,
    /// Says what would go, and takes nothing
    #[arg(long, short = 'n')]
    dry_run: bool,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl GcArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let keep = kept_actions(
            &store,
            usize::try_from(self.keep_runs).unwrap_or(usize::MAX),
        )?;
        let grace = Duration::from_secs(u64::from(self.grace_hours) * 3600);
        let before = now().checked_sub(grace).unwrap_or(std::time::UNIX_EPOCH);
        let sweep = store.sweep(&keep, before, self.dry_run)?;
        if self.json {
            return emit_json(&sweep);
        }
        let about =
            context! { of => Serde(sweep), dry_run => self.dry_run, hours => self.grace_hours };
        emit(&filled(include_str!("sweep.txt"), about))
    }
}

/// Name a run: a name stands for it everywhere, and `calib gc` keeps its tables.
#[derive(Args)]
#[command(after_help = "Examples:
  calib tag HEAD released
  calib tag
  calib tag --delete released")]
pub(super) struct TagArguments {
    /// The run, as `calib log` names it; without it, all tags are listed
    #[arg(requires = "name")]
    run: Option<String>,
    /// Its name from now on
    name: Option<String>,
    /// Takes a name away; the run stays
    #[arg(long, value_name = "NAME", conflicts_with = "run")]
    delete: Option<String>,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
}

impl TagArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        if let Some(name) = &self.delete {
            return match store.tags()?.contains_key(name) {
                true => store.untag(name),
                false => Err(Error::spec("--delete", format!("no tag `{name}`"))),
            };
        }
        match (&self.run, &self.name) {
            (Some(run), Some(name)) => {
                let run = find_run(&store, run)?;
                let before = store.tag(name, &run)?.filter(|before| *before != run);
                let was = before.map_or_else(String::new, |before| format!(", was run {before}"));
                emit(&format!("{name} is run {run}{was}\n"))
            }
            _ => emit(
                &store
                    .tags()?
                    .iter()
                    .map(|(name, run)| format!("{name}  {run}\n"))
                    .collect::<String>(),
            ),
        }
    }
}

/// Verify a store: read and rehash every table, record, manifest, event and tag; find what was damaged or edited.
#[derive(Args)]
#[command(after_help = "Examples:
  calib verify
  calib verify --store /srv/cell7/.calib --json

Exit codes: 0 all is as it was written; 1 something is not; 2 wrong usage; 75 the disk refuses.")]
pub(super) struct VerifyArguments {
    /// The store [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl VerifyArguments {
    pub(crate) fn run(&self) -> Result<u8> {
        let root = self.store.clone().unwrap_or_else(default_store);
        if bucket(&root).is_none() && !root.is_dir() {
            return Err(Error::spec(
                root.display().to_string(),
                "no store here; name one with --store DIR",
            ));
        }
        let found = match open_store(Some(&root)) {
            Ok(store) => store.verify()?,
            // The format file itself may be what was damaged.
            Err(Error::Store(fault)) => Verification {
                faults: vec![fault],
                ..Verification::default()
            },
            Err(other) => return Err(other),
        };
        if self.json {
            emit_json(&found)?;
        } else {
            emit(&filled(
                include_str!("verification.txt"),
                context! { of => Serde(&found) },
            ))?;
        }
        Ok(u8::from(!found.faults.is_empty()))
    }
}
