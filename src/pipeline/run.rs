//! The run: every stage in order; what is already done is taken as it is, the rest is executed and published.

use super::manifest::{
    FileRecord, InputRecord, Manifest, OutputRecord, Purpose, RunOptions, RunStatus, StageReport,
    StageStatus, Surroundings,
};
use super::plan::{Plan, Selected};
use super::run_state::{self, KeyState, RunState};
use super::services::{Interrupted, Observer, StageServices, label};
use super::{look, overrides, spec::trouble_at};
use crate::error::{Error, Fault, Result};
use crate::stage::{Context, InputTable, Output, Port, Streamed};
use crate::store::key::canonical;
use crate::store::{Account, ActionRecord, Lookup, PendingTable, Run, StageKey, Store, TableRef};
use crate::yaml;
use serde_json::json;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::SystemTime;

/// Seconds of work that are made durable together: more than a group of syncs costs, less than one would mind doing again.
const GROUP: f64 = 1.0;

/// A run that went through.
pub struct CompletedRun {
    pub(crate) manifest: Manifest,
    /// Reports and other documents, where people find them.
    pub(crate) documents: Vec<PathBuf>,
}

impl CompletedRun {
    /// Whether every stage was cached.
    pub(crate) fn nothing_done(&self) -> bool {
        self.manifest
            .stages
            .iter()
            .all(|stage| stage.status == StageStatus::Cached)
    }
}

/// Runs a plan; whatever happens, the run's manifest says how far it came.
pub fn run(
    plan: &Plan,
    store: &Store,
    options: &RunOptions,
    surroundings: &Surroundings,
    observer: &dyn Observer,
) -> Result<CompletedRun> {
    let selected = options.selection.of(plan)?;
    // Who calls on so many threads as are wanted has made them for many runs.
    let is_among_them =
        rayon::current_thread_index().is_some() && rayon::current_num_threads() == options.jobs;
    let threads = (!is_among_them)
        .then(|| {
            let builder = rayon::ThreadPoolBuilder::new().num_threads(options.jobs);
            let pool = builder.build();
            pool.map_err(|e| Error::store("--jobs", e.to_string()))
        })
        .transpose()?;
    let begun = (surroundings.now)();
    let mut manifest = Manifest::new(plan, surroundings, options, rfc3339(begun));
    manifest.previous = store.last_ended()?;
    manifest.run_id = store.reserve_run(&manifest.run_id)?;
    let record = store.begin_run(&manifest.run_id, &manifest)?;
    let before = manifest
        .previous
        .as_ref()
        .filter(|_| options.purpose != Purpose::Fleet);
    let before = before.and_then(|link| Manifest::of(store, &link.run).ok());
    let before = before.filter(|before| before.pipeline.name == plan.name);
    let mut running = Running {
        state: RunState::new(plan),
        store,
        selected,
        now: surroundings.now,
        threads,
        observer,
        manifest,
        record,
        documents: Vec::new(),
        before,
        at_risk: 0.0,
    };
    let result = (0..plan.stages.len()).try_for_each(|index| running.stage(index));
    let Running {
        mut manifest,
        record,
        documents,
        ..
    } = running;
    let ended = (surroundings.now)();
    manifest.ended = Some(rfc3339(ended));
    manifest.wall_seconds = Some(seconds(begun, ended));
    manifest.peak_memory_bytes = (surroundings.peak_memory)();
    manifest.status = if result.is_ok() {
        RunStatus::Done
    } else {
        RunStatus::Failed
    };
    manifest.error = result.as_ref().err().map(ToString::to_string);
    let finished = store.finish_run(record, &manifest, options.purpose == Purpose::Fleet);
    // The first error is the one that explains the others.
    result.and(finished)?;
    Ok(CompletedRun {
        manifest,
        documents,
    })
}

struct Running<'a> {
    state: RunState<'a>,
    store: &'a Store,
    selected: Selected,
    now: fn() -> SystemTime,
    threads: Option<rayon::ThreadPool>,
    observer: &'a dyn Observer,
    manifest: Manifest,
    record: Run,
    documents: Vec<PathBuf>,
    /// The run of this pipeline before this one.
    before: Option<Manifest>,
    /// Seconds of work that a power cut would lose; a killed process loses none.
    at_risk: f64,
}

impl Running<'_> {
    /// Whether this is one run of thousands, which are made durable together and whose history nobody asks for.
    fn among_many(&self) -> bool {
        self.manifest.purpose == Purpose::Fleet
    }

    fn stage(&mut self, index: usize) -> Result<()> {
        let plan = self.state.plan;
        let inside = self.selected.stages.contains(&index);
        let key = match self.state.key(index)? {
            KeyState::Known(key) => key,
            KeyState::Pending(_) if !inside => return Ok(()),
            KeyState::Pending(on) => {
                let (id, on) = (&plan.stages[index].id, &plan.stages[on].id);
                let message = format!(
                    "stage `{id}` reads from `{on}`, which is not cached and was not selected: select it too"
                );
                return Err(Error::spec("--only, --from", message));
            }
        };
        let report = &mut self.manifest.stages[index];
        report.action = Some(key.id());
        report.key = Some(key.clone());
        let forced = self.selected.forces(index);
        let found = self.store.action(&key)?;
        match found {
            Lookup::Done(record) if !forced => return self.cached(index, *record),
            _ if !inside => return Ok(()),
            _ => {}
        }
        let reason = match self.among_many() {
            true => "a robot of a fleet".into(),
            false => look::why(self.store, plan, &key, &found, forced)?,
        };
        let id = &plan.stages[index].id;
        let mut waiting = |holder: Option<u32>| {
            let holder = holder.map_or_else(String::new, |process| format!(" (process {process})"));
            let what = format!("waiting for another run that does the same{holder}");
            self.observer.waits(id, &what);
        };
        let claim = run_state::claim(self.store, &key.id(), &mut waiting);
        if let (false, Lookup::Done(record)) = (forced, self.store.action(&key)?) {
            return self.cached(index, *record);
        }
        let result = self.execute(index, key, reason);
        drop(claim);
        if result.is_err() {
            self.manifest.stages[index].status = StageStatus::Failed;
        }
        result
    }

    fn cached(&mut self, index: usize, record: ActionRecord) -> Result<()> {
        self.manifest.stages[index].status = StageStatus::Cached;
        self.settle(index, record)
    }

    fn execute(&mut self, index: usize, key: StageKey, reason: String) -> Result<()> {
        // Another run may have been waited for since the files were hashed.
        self.state.unchanged(index)?;
        let stage = &self.state.plan.stages[index];
        self.observer
            .stage_begins(&stage.id, stage.entry.name, &reason);
        if let Some(seconds) = self.expected(index) {
            self.observer.expects(&stage.id, seconds);
        }
        let started = (self.now)();
        self.event("begins", index, serde_json::json!({ "reason": reason }))?;
        self.manifest.stages[index].reason = Some(reason);
        let mut account = Account {
            run: self.manifest.run_id.clone(),
            started: rfc3339(started),
            ..Default::default()
        };
        let products = self.products(index, &mut account)?;
        let ended = (self.now)();
        account.ended = rfc3339(ended);
        account.wall_seconds = seconds(started, ended);
        self.state.unchanged(index)?;
        let published = self.store.publish(&key, products, account.clone())?;
        self.manifest.stages[index].status = StageStatus::Executed;
        if let Some(conflict) = published.conflict {
            self.observer.warn(&stage.id, &conflict);
            self.manifest.stages[index].warnings.push(conflict);
        }
        // The record of an equal earlier result may stand; the report is of this execution.
        self.at_risk += account.wall_seconds;
        self.settle(
            index,
            ActionRecord {
                account,
                ..published.record
            },
        )?;
        if self.at_risk < GROUP || self.among_many() {
            return Ok(());
        }
        self.at_risk = 0.0;
        self.store.sync()?;
        self.store.write_manifest(&self.record, &self.manifest)
    }

    /// Seconds that a stage is expected to take, from its time in the run before in proportion to the rows that it reads; nothing where that run was of
    /// another pipeline, or took none.
    fn expected(&self, index: usize) -> Option<f64> {
        let stage = &self.state.plan.stages[index];
        let is_it = |old: &&StageReport| old.id == stage.id && old.uses == stage.entry.name;
        let before = self.before.as_ref()?.stages.iter().find(is_it)?;
        let rows = |inputs: &[InputRecord]| inputs.iter().map(|input| input.table.rows).max();
        let now = rows(&self.inputs(index).ok()?);
        let more = match (rows(&before.inputs), now) {
            (Some(then), Some(now)) if then > 0 => now as f64 / then as f64,
            _ => 1.0,
        };
        before.wall_seconds.map(|seconds| seconds * more)
    }

    /// Takes the tables of a stage that is done into the plan, the manifest and the human paths.
    fn settle(&mut self, index: usize, record: ActionRecord) -> Result<()> {
        let plan = self.state.plan;
        let stage = &plan.stages[index];
        let mut outputs = Vec::new();
        for (port, output) in stage.outputs.iter().enumerate() {
            let table = run_state::table(&record.tables, stage, port)?;
            let path = self
                .store
                .expose(&plan.name, &stage.id, output.name, table)?;
            if output.kind == "document" {
                self.documents
                    .extend(documents(self.store, &plan.name, table)?);
            }
            outputs.push(OutputRecord {
                port: output.name.into(),
                kind: output.kind.into(),
                path: Some(path.display().to_string()),
                table: table.clone(),
            });
        }
        let inputs = self.inputs(index)?;
        let files = self.files(index)?;
        let report = &mut self.manifest.stages[index];
        (report.inputs, report.files, report.outputs) = (inputs, files, outputs);
        report.wall_seconds = Some(record.account.wall_seconds);
        report.notes = record.account.notes;
        report.warnings.splice(0..0, record.account.warnings);
        self.state.tables[index] = Some(record.tables);
        let status = serde_json::json!({ "status": self.manifest.stages[index].status });
        self.event("ends", index, status)?;
        self.observer.stage_ends(&self.manifest.stages[index]);
        Ok(())
    }

    /// Runs the body of a stage; its messages go into `account`. A panic is a bug with the stage's name.
    fn products(&self, index: usize, account: &mut Account) -> Result<Vec<(String, PendingTable)>> {
        let plan = self.state.plan;
        let stage = &plan.stages[index];
        let inputs = self.loaded(index)?;
        let services = StageServices::new(&stage.id, Some(self.store), &stage.files, self.observer);
        let context = Context {
            id: &stage.id,
            seed: self.state.seed(index),
            jobs: self.manifest.jobs,
            services: &services,
        };
        let run = || stage.stage.run(inputs, &context);
        let body = || match &self.threads {
            Some(threads) => threads.install(run),
            None => run(),
        };
        let bug = |what: String| Error::Bug(format!("stage {}{what}", stage.id));
        let outputs = catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
            if panic.is::<Interrupted>() {
                return Err(Error::store(&stage.id, "was interrupted: run it again"));
            }
            Err(bug(format!(" panicked: {}", panic_message(&*panic))))
        });
        let lines = services.lines();
        (account.notes, account.warnings) = (lines.notes, lines.warnings);
        let outputs = outputs.map_err(|error| placed(error, plan, &stage.id))?;
        if outputs.len() != stage.outputs.len() {
            let ports = stage.outputs.len();
            let message = format!(" gave {} tables for {ports} ports", outputs.len());
            return Err(bug(message));
        }
        let product = |(port, output): (&Port, Output)| {
            let (kind, product) = match output {
                Output::Frame(frame) => (frame.kind(), PendingTable::Frame(frame)),
                Output::Streamed(Streamed { kind, file }) => {
                    let other = || bug(": a sink that is not the engine's".into());
                    (kind, PendingTable::File(file.ok_or_else(other)?))
                }
            };
            if kind != port.kind {
                return Err(bug(format!(": a table of {kind} on port {}", port.name)));
            }
            Ok((port.name.to_string(), product))
        };
        stage.outputs.iter().zip(outputs).map(product).collect()
    }

    /// The tables of every input port of a stage.
    fn loaded(&self, index: usize) -> Result<Vec<Vec<(String, InputTable)>>> {
        let stages = &self.state.plan.stages;
        let inputs = stages[index].inputs.iter().map(|input| {
            let tables = input.from.iter().map(|origin| {
                let from = &stages[origin.stage];
                let tables = self.state.tables[origin.stage].as_ref();
                let tables = tables
                    .ok_or_else(|| Error::Bug(format!("stage {} has no tables yet", from.id)))?;
                let table = run_state::table(tables, from, origin.port)?;
                let input = match input.port.chunked {
                    true => InputTable::Stored(self.store.published(table)?),
                    false => InputTable::Frame(self.store.load(table)?),
                };
                Ok((from.id.clone(), input))
            });
            tables.collect()
        });
        inputs.collect()
    }

    fn inputs(&self, index: usize) -> Result<Vec<InputRecord>> {
        let stages = &self.state.plan.stages;
        let mut records = Vec::new();
        for input in &stages[index].inputs {
            for origin in &input.from {
                let from = &stages[origin.stage];
                let Some(tables) = &self.state.tables[origin.stage] else {
                    continue;
                };
                records.push(InputRecord {
                    port: input.port.name.into(),
                    from: format!("{}.{}", from.id, from.outputs[origin.port].name),
                    table: run_state::table(tables, from, origin.port)?.clone(),
                });
            }
        }
        Ok(records)
    }

    fn files(&mut self, index: usize) -> Result<Vec<FileRecord>> {
        let mut records = Vec::new();
        for file in &self.state.plan.stages[index].files {
            let metadata = std::fs::metadata(&file.path).ok();
            // Of a folder of parts all of them.
            let bounds = crate::raw::source(&file.path)
                .and_then(|mut source| source.bounds())
                .unwrap_or_default();
            records.push(FileRecord {
                place: file.place.clone(),
                path: file.path.display().to_string(),
                bytes: bounds.last().copied().unwrap_or_default(),
                modified: metadata
                    .and_then(|metadata| metadata.modified().ok())
                    .map(rfc3339),
                blake3: self.state.hash(&file.path)?,
            });
        }
        Ok(records)
    }

    fn event(&mut self, event: &str, index: usize, more: serde_json::Value) -> Result<()> {
        let stage = &self.state.plan.stages[index].id;
        let time = rfc3339((self.now)());
        self.record.append_event(
            &serde_json::json!({ "time": time, "event": event, "stage": stage, "detail": more }),
        )
    }
}

fn rfc3339(time: SystemTime) -> String {
    jiff::Timestamp::try_from(time)
        .map(|time| format!("{time:.3}"))
        .unwrap_or_default()
}
fn seconds(from: SystemTime, to: SystemTime) -> f64 {
    to.duration_since(from).unwrap_or_default().as_secs_f64()
}

/// Writes the documents of a table to where people find them.
fn documents(store: &Store, pipeline: &str, table: &TableRef) -> Result<Vec<PathBuf>> {
    let frame = store.load(table)?;
    let names = frame.read::<String>("name")?;
    let contents = frame.read::<String>("content")?;
    names
        .iter()
        .zip(&contents)
        .map(|(name, content)| store.expose_document(pipeline, name, content.as_bytes()))
        .collect()
}

fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("without a message")
}

/// The same error with line, path and stage of each setting: `with.n` of `split` becomes `p.yaml:36:26: stages[2].with.n`.
fn placed(mut error: Error, plan: &Plan, id: &str) -> Error {
    if let Error::Spec(faults) | Error::Data(faults) = &mut error {
        for fault in faults {
            if let Some(placed) = one(fault, plan, id) {
                *fault = placed;
            }
        }
    }
    error
}

/// None where the fault is not in a setting.
fn one(fault: &Fault, plan: &Plan, id: &str) -> Option<Fault> {
    let place = fault
        .place
        .strip_prefix(id)
        .and_then(|tail| tail.strip_prefix('.'))
        .unwrap_or(&fault.place);
    if place != "with" && !place.starts_with("with.") {
        return None;
    }
    let mut tree = yaml::parse(&plan.text).0?;
    overrides::apply(&mut tree, &plan.overrides);
    let ids = overrides::stage_ids(&tree);
    let index = ids.iter().position(|name| name == id)?;
    let path = format!("stages[{index}].{place}");
    let message = format!("stage `{id}`: {}", fault.message);
    Some(trouble_at(&tree, &path, message).fault(&plan.file.display().to_string()))
}

impl Plan {
    /// The hash of everything that the plan's tables depend on, as 64 hex digits. Reads every input file; fails where one cannot
    /// be read.
    pub(crate) fn identity(&self) -> Result<String> {
        let mut state = RunState::new(self);
        let mut stages = Vec::new();
        for stage in &self.stages {
            let mut files = Vec::new();
            for file in &stage.files {
                files.push(json!([
                    file.place,
                    label(&file.path),
                    state.hash(&file.path)?
                ]));
            }
            let origins = stage.inputs.iter().map(|input| {
                let from: Vec<_> = input
                    .from
                    .iter()
                    .map(|origin| (origin.stage, origin.port))
                    .collect();
                (input.port.name, from)
            });
            stages.push(json!({
                "id": stage.id, "stage": stage.entry.name, "implementation": stage.entry.implementation,
                "settings": stage.stage.settings(), "files": files, "reads": origins.collect::<Vec<_>>(),
            }));
        }
        let whole = json!({ "seed": self.seed, "stages": stages });
        Ok(blake3::hash(canonical(&whole).as_bytes())
            .to_hex()
            .to_string())
    }
}
