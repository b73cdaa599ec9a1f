//! One stage executed: its tables loaded, its body run on the worker threads, its products handed back.

use super::place;
use super::run_state::{self, RunState};
use super::services::{Interrupted, Observer, StageServices};
use crate::error::{Error, Result};
use crate::stage::{Context, InputTable, Output, StoredTable};
use crate::store::frame::Frame;
use crate::store::{Account, FinishedFile, PendingTable, PublishedTable, Store, TableRef};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::OnceLock;

/// Where a stage is executed.
pub(super) struct ExecutionSite<'a> {
    pub store: &'a Store,
    pub threads: &'a rayon::ThreadPool,
    pub observer: &'a dyn Observer,
    pub run: &'a str,
}

/// Runs the body of a stage; what it told the person goes into `account`. A panic is a bug with the stage's name.
pub(super) fn stage(
    state: &RunState,
    index: usize,
    place: &ExecutionSite,
    account: &mut Account,
) -> Result<Vec<(String, PendingTable)>> {
    let stage = &state.plan.stages[index];
    let inputs = load(state, index, place.store)?;
    let services = StageServices::new(&stage.id, Some(place.store), &stage.files, place.observer);
    let context = Context {
        id: &stage.id,
        seed: state.seed(index),
        jobs: place.threads.current_num_threads(),
        services: &services,
    };
    let body = || place.threads.install(|| stage.stage.run(inputs, &context));
    let outputs = catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
        if panic.is::<Interrupted>() {
            return Err(Error::store(&stage.id, "was interrupted: run it again"));
        }
        Err(Error::Bug(format!(
            "stage {} panicked: {}",
            stage.id,
            panic_message(&*panic)
        )))
    });
    let lines = services.lines();
    (account.notes, account.warnings) = (lines.notes, lines.warnings);
    let outputs = outputs.map_err(|error| place::placed(error, state.plan, &stage.id))?;
    if outputs.len() != stage.outputs.len() {
        return Err(Error::Bug(format!(
            "stage {} gave {} tables for {} ports",
            stage.id,
            outputs.len(),
            stage.outputs.len()
        )));
    }
    stage
        .outputs
        .iter()
        .zip(outputs)
        .map(|(port, output)| {
            let (kind, product) = match output {
                Output::Frame(frame) => (frame.kind(), PendingTable::Frame(frame)),
                Output::Streamed(streamed) => {
                    let file = streamed.handle.downcast::<FinishedFile>();
                    let file = file.map_err(|_| {
                        Error::Bug(format!(
                            "stage {}: a sink that is not the engine's",
                            stage.id
                        ))
                    })?;
                    (streamed.kind, PendingTable::File(*file))
                }
            };
            if kind != port.kind {
                return Err(Error::Bug(format!(
                    "stage {}: a table of {kind} on port {}",
                    stage.id, port.name
                )));
            }
            Ok((port.name.to_string(), product))
        })
        .collect()
}

/// A table that a stage reads chunk by chunk.
struct LongTable {
    table: PublishedTable,
    /// All of it, where that is no more than a chunk: it is decoded once.
    whole: OnceLock<Frame>,
}

/// Rows of a table that is held whole once it was read.
const SHORT: usize = 1 << 16;

impl StoredTable for LongTable {
    fn rows(&self) -> usize {
        self.table.rows()
    }
    fn frame(&self) -> Result<Frame> {
        self.table.frame()
    }
    fn chunks(&self, take: &mut dyn FnMut(&Frame) -> Result<()>) -> Result<()> {
        if self.rows() > SHORT {
            return self.table.chunks(take);
        }
        if let Some(whole) = self.whole.get() {
            return take(whole);
        }
        let whole = self.frame()?;
        take(self.whole.get_or_init(|| whole))
    }
}

fn load(state: &RunState, index: usize, store: &Store) -> Result<Vec<Vec<(String, InputTable)>>> {
    let stages = &state.plan.stages;
    let inputs = stages[index].inputs.iter();
    inputs
        .map(|input| {
            let tables = input.from.iter().map(|origin| {
                let from = &stages[origin.stage];
                let tables = state.tables[origin.stage].as_ref();
                let tables = tables
                    .ok_or_else(|| Error::Bug(format!("stage {} has no tables yet", from.id)))?;
                let table = run_state::table(tables, from, origin.port)?;
                let input: InputTable = match input.port.chunked {
                    true => Box::new(LongTable {
                        table: store.published(table)?,
                        whole: OnceLock::new(),
                    }),
                    false => Box::new(store.load(table)?),
                };
                Ok((from.id.clone(), input))
            });
            tables.collect()
        })
        .collect()
}

/// Writes the documents of a table to where people find them.
pub(super) fn documents(store: &Store, pipeline: &str, table: &TableRef) -> Result<Vec<PathBuf>> {
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
