//! The local engine: threads of this process, each with one robot in hand, so that memory is bounded by their number.

use super::ledger::{Ending, RobotRecord};
use super::work::{Visit, Watcher, Workshop};
use crate::error::{Error, Result};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// A robot's linear algebra is shallow; this is what a main thread has.
const STACK: usize = 8 << 20;
/// Between two looks at robots that other processes have in hand.
const PAUSE: Duration = Duration::from_millis(200);

/// How robots are worked through.
pub(crate) struct WorkerOptions<'a> {
    /// Robots at once.
    pub(crate) workers: usize,
    /// Stops at the first robot that is not done.
    pub(crate) fail_fast: bool,
    /// Whether to stop after the robots in hand.
    pub(crate) stop: &'a (dyn Fn() -> bool + Sync),
}

/// What came of it, in the order of the roster; nothing where the work was stopped before.
pub(crate) struct FleetResults {
    /// In the order of the roster; none where a robot was not reached.
    pub(crate) records: Vec<Option<RobotRecord>>,
    /// Robots computed now.
    pub(crate) computed: usize,
}

/// Works through robots of the roster, by position. Fails where the store does; then all workers stop.
pub(crate) fn work(
    workshop: &Workshop,
    robots: &[usize],
    options: &WorkerOptions,
    watcher: &dyn Watcher,
) -> Result<FleetResults> {
    let roster = &workshop.fleet.roster.0;
    let slots: Vec<Mutex<Option<RobotRecord>>> = roster.iter().map(|_| Mutex::new(None)).collect();
    let (next, computed) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let halted = AtomicBool::new(false);
    let failure: Mutex<Option<Error>> = Mutex::new(None);
    let busy: Mutex<Vec<usize>> = Mutex::new(Vec::new());
    let over = || halted.load(Ordering::Relaxed) || (options.stop)();
    let visit = |index: usize, worker: usize| -> bool {
        let record = match workshop.visit(&roster[index], worker, watcher) {
            Ok(Visit::Recorded(record)) => record,
            Ok(Visit::Made(record)) => {
                computed.fetch_add(1, Ordering::Relaxed);
                record
            }
            Ok(Visit::Busy) => return false,
            Err(error) => {
                lock(&failure).get_or_insert(error);
                halted.store(true, Ordering::Relaxed);
                return true;
            }
        };
        if options.fail_fast && record.ending != Ending::Done {
            halted.store(true, Ordering::Relaxed);
        }
        *lock(&slots[index]) = Some(record);
        true
    };
    let one = |worker: usize| {
        while !over() {
            let Some(index) = robots.get(next.fetch_add(1, Ordering::Relaxed)) else {
                break;
            };
            if !visit(*index, worker) {
                lock(&busy).push(*index);
            }
        }
        // What others had in hand: their record, or the work where they died.
        while !over() {
            let Some(index) = lock(&busy).pop() else {
                break;
            };
            if !visit(index, worker) {
                lock(&busy).insert(0, index);
                std::thread::sleep(PAUSE);
            }
        }
    };
    std::thread::scope(|scope| -> Result<()> {
        let one = &one;
        for worker in 0..options.workers.clamp(1, robots.len().max(1)) {
            let failed = |error: String| Error::store("--jobs", error);
            // One for all of a worker's robots: every further thread would keep memory of its own.
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(workshop.threads)
                .stack_size(STACK)
                .thread_name(move |_| format!("worker {worker}"))
                .build()
                .map_err(|error| failed(error.to_string()))?;
            std::thread::Builder::new()
                .spawn_scoped(scope, move || pool.install(|| one(worker)))
                .map_err(|error| failed(error.to_string()))?;
        }
        Ok(())
    })?;
    // Records can be seen at once; the last of them are durable from here on.
    workshop.ledger.store.sync()?;
    if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let records = slots
        .into_iter()
        .map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner))
        .collect();
    Ok(FleetResults {
        records,
        computed: computed.into_inner(),
    })
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
