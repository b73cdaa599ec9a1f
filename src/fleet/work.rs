//! One robot: its plan, its key, its run and its record.

use super::Fleet;
use super::file::FleetRobot;
use super::ledger::{Ending, LATER, Ledger, RobotRecord, RobotTable};
use super::round::Round;
use crate::error::{Error, Result};
use crate::pipeline::{Observer, Plan, Purpose, RunOptions, Selection, Surroundings, run};
use crate::stage::STAGES;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Whoever watches a fleet: bars on a terminal, lines in a log.
pub trait Watcher: Sync {
    /// A worker (from 0) begins a robot.
    fn begins(&self, worker: usize, robot: &str);
    /// The robot's pipeline comes to a stage.
    fn stage(&self, worker: usize, stage: &str);
    /// The robot is recorded; `fresh` where this worker computed it.
    fn ends(&self, worker: usize, record: &RobotRecord, fresh: bool);
}

/// What a visit to a robot came to.
pub enum Visit {
    /// Its record stood already.
    Recorded(RobotRecord),
    /// It was computed now.
    Made(RobotRecord),
    /// Another living process has it in hand.
    Busy,
}

/// Where robots are computed.
pub struct Workshop<'a> {
    pub(crate) fleet: &'a Fleet,
    pub(crate) ledger: Ledger<'a>,
    /// Fresh for every run.
    pub(crate) surroundings: &'a (dyn Fn() -> Surroundings + Sync),
    /// E.g. the host.
    pub(crate) name: String,
    /// Where this process' own words go, among the fleet's logs.
    pub(crate) log: Option<String>,
    /// Threads inside one robot's run; no result depends on it.
    pub(crate) threads: usize,
    /// The round of a fleet's diagnosis that is computed; none where the whole pipeline is.
    pub(crate) round: Option<Round>,
}

/// Longer reasons are cut; the run's manifest has them whole.
const REASON: usize = 2000;

impl Workshop<'_> {
    /// The robot's plan with all that is set for it.
    pub(crate) fn plan(&self, robot: &FleetRobot) -> Result<Plan> {
        if let Some(reason) = &robot.unreadable {
            return Err(Error::data("", reason.clone()));
        }
        let mut plan = Plan::parse(
            &self.fleet.pipeline,
            self.fleet.text.clone(),
            &robot.sets,
            STAGES,
        )?;
        // Tables and documents of every robot have a folder of their own.
        plan.name = format!("{}.{}", self.fleet.name(), robot.handle());
        match &self.round {
            Some(round) => round.plan(plan, robot),
            None => Ok(plan),
        }
    }

    /// The plan, or why there is none, and the key of the robot's record.
    fn prepared(&self, robot: &FleetRobot) -> (Result<Plan>, String) {
        let plan = self
            .plan(robot)
            .and_then(|plan| plan.identity().map(|identity| (plan, identity)));
        let (plan, content) = match plan {
            Ok((plan, identity)) => (Ok(plan), identity),
            // With the reason mended it is another key.
            Err(error) => {
                let text = error.to_string();
                (Err(error), text)
            }
        };
        let whole = serde_json::json!([robot.name, content]).to_string();
        (plan, blake3::hash(whole.as_bytes()).to_hex().to_string())
    }

    /// The key of the robot's record.
    pub(crate) fn key(&self, robot: &FleetRobot) -> String {
        self.prepared(robot).1
    }

    /// The robot's record, where there is one for its settings and data as they are.
    pub(crate) fn record(&self, robot: &FleetRobot) -> Result<Option<RobotRecord>> {
        self.ledger.find(&self.prepared(robot).1)
    }

    /// Computes a robot unless it is recorded. Fails where the store does.
    pub(crate) fn visit(
        &self,
        robot: &FleetRobot,
        worker: usize,
        watcher: &dyn Watcher,
    ) -> Result<Visit> {
        let (plan, key) = self.prepared(robot);
        let standing = |ledger: &Ledger| {
            ledger
                .find(&key)
                .map(|found| found.filter(|record| record.exit_code != LATER))
        };
        if let Some(record) = standing(&self.ledger)? {
            watcher.ends(worker, &record, false);
            return Ok(Visit::Recorded(record));
        }
        let Some(claim) = self.ledger.claim(&key)? else {
            return Ok(Visit::Busy);
        };
        if let Some(record) = standing(&self.ledger)? {
            watcher.ends(worker, &record, false);
            return Ok(Visit::Recorded(record));
        }
        // What may work now is tried again.
        self.ledger.forget(&key)?;
        watcher.begins(worker, &robot.name);
        let record = self.compute(robot, plan, key, worker, watcher);
        let record = self.ledger.put(record)?;
        drop(claim);
        watcher.ends(worker, &record, true);
        Ok(Visit::Made(record))
    }

    fn compute(
        &self,
        robot: &FleetRobot,
        plan: Result<Plan>,
        key: String,
        worker: usize,
        watcher: &dyn Watcher,
    ) -> RobotRecord {
        let mut surroundings = (self.surroundings)();
        let begun = (surroundings.now)();
        let mut record = RobotRecord::blank(robot, key, &format!("{}/{worker}", self.name));
        record.log.clone_from(&self.log);
        let observer = Relay { worker, watcher };
        let options = RunOptions {
            selection: Selection::default(),
            jobs: self.threads,
            purpose: Purpose::Fleet,
        };
        let result = plan.and_then(|plan| {
            surroundings.run_id = self.ledger.store.reserve_run(&surroundings.run_id)?;
            record.run = Some(surroundings.run_id.clone());
            let body = || run(&plan, self.ledger.store, &options, &surroundings, &observer);
            catch_unwind(AssertUnwindSafe(body))
                .unwrap_or_else(|_| Err(Error::Bug("the run panicked".into())))
        });
        let ended = (surroundings.now)();
        record.wall_seconds = ended
            .duration_since(begun)
            .unwrap_or_default()
            .as_secs_f64();
        record.ended = jiff::Timestamp::try_from(ended)
            .map(|time| format!("{time:.3}"))
            .unwrap_or_default();
        match result {
            Ok(outcome) => {
                record.documents = outcome
                    .documents
                    .iter()
                    .filter_map(|path| path.file_name())
                    .map(|name| name.to_string_lossy().into_owned())
                    .collect();
                for stage in outcome.manifest.stages {
                    let made = stage.outputs.into_iter().map(|output| RobotTable {
                        stage: stage.id.clone(),
                        port: output.port,
                        kind: output.kind,
                        table: output.table,
                    });
                    record.tables.extend(made);
                }
            }
            Err(error) => {
                record.ending = match &error {
                    Error::Spec(_) | Error::Data(_) => Ending::Rejected,
                    Error::Store(_) | Error::Bug(_) => Ending::Failed,
                };
                // A setting that one robot's data do not bear is a fault of its data, as the pipeline serves others.
                record.exit_code = if record.ending == Ending::Rejected {
                    10
                } else {
                    error.exit_code()
                };
                record.reason = Some(error.to_string().chars().take(REASON).collect());
            }
        }
        record
    }
}

/// Passes on what a person sees of a robot among thousands: the stage it is at. The rest is in the run's manifest.
struct Relay<'a> {
    worker: usize,
    watcher: &'a dyn Watcher,
}

impl Observer for Relay<'_> {
    fn stage_begins(&self, id: &str, _uses: &str, _reason: &str) {
        self.watcher.stage(self.worker, id);
    }
}

/// A robot's linear algebra is shallow; this is what a main thread has.
const STACK: usize = 8 << 20;
/// Between two looks at robots that other processes have in hand.
const PAUSE: Duration = Duration::from_millis(200);

/// How robots are worked through.
pub(crate) struct WorkerOptions<'a> {
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
