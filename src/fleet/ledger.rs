//! The result of every robot, in the store: the only truth about which are done, whoever computed them.
//!
//! `fleets/<fleet>/records/ab/<key>.json`, put if absent; `claims/` are locks of the living, on which no result depends;
//! `runs/<id>.json` is the roster of a run, for the tasks of a cluster and for later campaigns; `cancelled.json` names a run.

use super::file::{FleetRobot, Groups};
use super::round::Round;
use crate::error::Result;
use crate::store::frame::Frame;
use crate::store::{Account, Claim, KEY_FORMAT, PendingTable, StageKey, Store, TableRef};
use crate::table::Table;
use calib_foundation::named;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// Bumped when older records can no longer be understood.
const RECORD_FORMAT: u32 = 1;
/// Exit code of what may work later.
pub(crate) const LATER: u8 = 75;

named! {
    /// How it ended for a robot.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Ending {
        /// All stages are done.
        #[default]
        Done "done",
        /// Its data are at fault: the same data will be rejected again.
        Rejected "rejected",
        /// The machine, or calib itself.
        Failed "failed",
    }
}

/// A table of a robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RobotTable {
    pub(crate) stage: String,
    /// On which it was written.
    pub(crate) port: String,
    /// The name of its schema.
    pub(crate) kind: String,
    #[serde(flatten)]
    pub(crate) table: TableRef,
}

/// Result of a robot.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotRecord {
    pub(crate) record_format: u32,
    pub(crate) robot: String,
    /// Hash of the robot's name, settings and data.
    pub(crate) key: String,
    pub(crate) ending: Ending,
    /// As `calib run` would have ended.
    pub(crate) exit_code: u8,
    /// Why it is not done.
    pub(crate) reason: Option<String>,
    /// The run in `runs/`, with all that was said; none where the plan could not be made.
    pub(crate) run: Option<String>,
    /// Host or node, and thread.
    pub(crate) worker: String,
    /// What the cluster's task said, among the fleet's logs.
    #[serde(default)]
    pub(crate) log: Option<String>,
    /// RFC 3339, UTC.
    pub(crate) ended: String,
    /// From start to end.
    pub(crate) wall_seconds: f64,
    /// That its run wrote or took.
    pub(crate) tables: Vec<RobotTable>,
    /// Name of the robot's folder among the documents.
    pub(crate) handle: String,
    pub(crate) documents: Vec<String>,
}

impl RobotRecord {
    /// The last table of a kind.
    pub(crate) fn last(&self, kind: &str) -> Option<&TableRef> {
        self.tables
            .iter()
            .rfind(|made| made.kind == kind)
            .map(|made| &made.table)
    }
    /// The table of a kind that a stage wrote.
    pub(crate) fn of_stage(&self, stage: &str, kind: &str) -> Option<&TableRef> {
        self.tables
            .iter()
            .rfind(|made| made.stage == stage && made.kind == kind)
            .map(|made| &made.table)
    }
    pub(super) fn blank(robot: &FleetRobot, key: String, worker: &str) -> Self {
        Self {
            record_format: RECORD_FORMAT,
            robot: robot.name.clone(),
            key,
            worker: worker.into(),
            handle: robot.handle(),
            ..Self::default()
        }
    }
}

/// One run of a fleet, as its tasks and later campaigns need it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RunNote {
    pub(crate) run: String,
    pub(crate) fleet: String,
    /// `local` or `slurm`.
    pub(crate) engine: String,
    /// Absolute, so that other hosts find it.
    pub(crate) file: PathBuf,
    /// In the order of the roster.
    pub(crate) robots: Vec<Member>,
    /// Robots of every task of a cluster, by position.
    #[serde(default)]
    pub(crate) tasks: Vec<Vec<usize>>,
    /// Ids of the cluster's jobs.
    #[serde(default)]
    pub(crate) jobs: Vec<String>,
    /// The round of a fleet's diagnosis that it computes; none where it is the whole pipeline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) round: Option<Round>,
}

/// A robot of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Member {
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) groups: Groups,
    /// Key of its record, once there is one.
    #[serde(default)]
    pub(crate) key: Option<String>,
}

/// The records of one fleet.
pub struct Ledger<'a> {
    pub(crate) store: &'a Store,
    pub(crate) fleet: String,
}

impl<'a> Ledger<'a> {
    /// The records of a fleet in a store.
    pub(crate) fn new(store: &'a Store, fleet: &str) -> Self {
        Self {
            store,
            fleet: fleet.into(),
        }
    }

    fn records<'p>(&'p self, key: &'p str) -> [&'p str; 4] {
        [
            "fleets",
            &self.fleet,
            "records",
            key.get(..2).unwrap_or("00"),
        ]
    }
    fn runs(&self) -> [&str; 3] {
        ["fleets", &self.fleet, "runs"]
    }

    /// The record of a key; one that is torn, or whose tables are gone, is none.
    pub(crate) fn find(&self, key: &str) -> Result<Option<RobotRecord>> {
        let record: Option<RobotRecord> = self
            .store
            .note(&self.records(key), &format!("{key}.json"))?;
        let whole = |record: &RobotRecord| {
            let there = |made: &RobotTable| {
                fs::metadata(self.store.object_path(&made.table))
                    .is_ok_and(|metadata| metadata.len() == made.table.bytes)
            };
            record.record_format == RECORD_FORMAT && record.tables.iter().all(there)
        };
        Ok(record.filter(whole))
    }

    /// Records a robot's result; the record that stands is handed back, be it another's.
    pub(crate) fn put(&self, record: RobotRecord) -> Result<RobotRecord> {
        let (place, name) = (self.records(&record.key), format!("{}.json", record.key));
        if self.store.put_note_once(&place, &name, &record)? {
            return Ok(record);
        }
        match self.find(&record.key)? {
            Some(standing) => Ok(standing),
            None => self
                .store
                .put_note(&place, &name, &record)
                .map(|()| record.clone()),
        }
    }

    /// Reads a table of a record; none where the record has none.
    pub(super) fn load<T: Table>(&self, table: Option<&TableRef>) -> Result<Option<T>> {
        table
            .map(|table| T::from_frame(&self.store.load(table)?))
            .transpose()
    }

    /// Publishes tables of the whole fleet and its page, which people then find; by the note a sweep knows that they are needed, and a later
    /// fleet finds them.
    pub(super) fn publish(
        &self,
        (stage, implementation): (&str, u32),
        settings: Value,
        frames: Vec<(&str, Frame)>,
        note: &str,
        (page, html): (&str, &str),
    ) -> Result<(Vec<PathBuf>, PathBuf)> {
        let key = StageKey {
            key_format: KEY_FORMAT,
            id: stage.into(),
            stage: stage.into(),
            implementation,
            settings,
            reads: BTreeMap::new(),
            files: BTreeMap::new(),
            schemas: BTreeMap::new(),
            seed: 0,
        };
        let product = |(port, frame): (&str, Frame)| (port.into(), PendingTable::Frame(frame));
        let products = frames.into_iter().map(product).collect();
        let published = self.store.publish(&key, products, Account::default())?;
        let made = &published.record;
        let expose = |(port, table): (&String, &TableRef)| {
            self.store.expose(&self.fleet, stage, port, table)
        };
        let tables = made.tables.iter().map(expose).collect::<Result<_>>()?;
        let content = json!({ "action": made.id, "tables": made.tables });
        self.store
            .put_note(&["fleets", &self.fleet], note, &content)?;
        let page = self
            .store
            .expose_document(&self.fleet, page, html.as_bytes())?;
        self.store.sync()?;
        Ok((tables, page))
    }

    /// Takes a record away, so that the robot is computed again.
    pub(crate) fn forget(&self, key: &str) -> Result<()> {
        self.store
            .drop_note(&self.records(key), &format!("{key}.json"))
    }

    /// The right to compute a robot; none while another living process has it.
    pub(super) fn claim(&self, key: &str) -> Result<Option<Claim>> {
        let place = ["fleets", &self.fleet, "claims"];
        let path = self.store.place_of_note(&place, &format!("{key}.lock"))?;
        Ok(Claim::take(&path))
    }

    /// Keeps what a run of the fleet is about.
    pub(crate) fn put_run(&self, note: &RunNote) -> Result<()> {
        self.store
            .put_note(&self.runs(), &format!("{}.json", note.run), note)
    }

    /// The run of an id, or the latest.
    pub fn run(&self, id: Option<&str>) -> Result<Option<RunNote>> {
        let name = match id {
            Some(id) => Some(format!("{id}.json")),
            None => {
                let folder = self.store.place_of_note(&self.runs()[..2], "runs")?;
                let entries = fs::read_dir(folder).into_iter().flatten().flatten();
                // Ids sort by time.
                entries
                    .filter_map(|entry| entry.file_name().into_string().ok())
                    .filter(|name| name.ends_with(".json"))
                    .max()
            }
        };
        let Some(name) = name else { return Ok(None) };
        self.store.note(&self.runs(), &name)
    }

    /// Keeps the roster with the keys of its records, for status and later campaigns.
    pub(crate) fn close(&self, note: &RunNote) -> Result<()> {
        self.store
            .put_note(&["fleets", &self.fleet], "roster.json", note)
    }
    /// The roster as the last run left it.
    pub(crate) fn closed(&self) -> Result<Option<RunNote>> {
        self.store.note(&["fleets", &self.fleet], "roster.json")
    }

    /// Asks the workers of a run to stop after the robots that they have in hand.
    pub(crate) fn cancel(&self, run: &str) -> Result<()> {
        self.store.put_note(
            &["fleets", &self.fleet],
            "cancelled.json",
            &serde_json::json!({ "run": run }),
        )
    }
    /// Whether a run was asked to stop.
    pub(crate) fn cancelled(&self, run: &str) -> bool {
        let place = ["fleets", &self.fleet];
        let note = self.store.note::<Value>(&place, "cancelled.json");
        note.ok().flatten().is_some_and(|note| note["run"] == run)
    }
}
