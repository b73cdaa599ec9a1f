//! Many robots through one pipeline: FLEET.yaml -> roster -> one record a robot in the store -> tables and a page.
//!
//! A robot is done when its record is in the store, whoever computed it: threads of this process (`work`) or tasks of a
//! cluster (`cluster`). Names of robots are data: they become hashes in paths and never reach a shell.

mod cause_answers;
mod cause_sums;
pub(crate) mod causes;
pub(crate) mod cluster;
mod earlier;
pub mod file;
pub(crate) mod ledger;
pub(crate) mod roster;
pub(crate) mod round;
mod sources;
pub(crate) mod tables;
pub(crate) mod work;

pub use file::{FleetFile, FleetRobot, Groups};
pub use ledger::{Ending, Ledger, RobotRecord};
pub use roster::Roster;
pub use work::{Visit, Watcher, Workshop};

use crate::error::Result;
use crate::store::Store;
use std::path::{Path, PathBuf};

/// A fleet whose file is sound and whose robots are known.
pub(crate) struct Fleet {
    /// As it was read.
    pub(crate) file: FleetFile,
    /// The pipeline's YAML, where it lies.
    pub(crate) pipeline: PathBuf,
    pub(crate) text: String,
    pub(crate) roster: Roster,
}

impl Fleet {
    /// Reads FLEET.yaml and finds its robots; fails with every fault at once. A large recording table is parted into the store.
    pub(crate) fn load(path: &Path, store: &Store) -> Result<Self> {
        let (file, tree) = FleetFile::load(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let pipeline = folder.join(&file.pipeline);
        let text = file::pipeline_text(path, &tree, &pipeline)?;
        let roster = Roster::gather(path, &file, &tree, store)?;
        let mut fleet = Self {
            file,
            pipeline,
            text,
            roster,
        };
        let ledger = Ledger::new(store, &fleet.file.name);
        fleet.look_back(&ledger)?;
        Ok(fleet)
    }

    /// As the file states it.
    pub(crate) fn name(&self) -> &str {
        &self.file.name
    }
}
