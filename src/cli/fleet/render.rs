//! `calib fleet render`: the job files of a run, to submit by hand.

use super::super::emit;
use super::super::surroundings::surroundings;
use super::cluster::ClusterArguments;
use super::{FleetLocation, records, run, workshop};
use crate::error::{Error, Result};
use crate::fleet::{Fleet, cluster};
use clap::{Args, ValueEnum};
use std::ffi::OsString;

/// Print the job files for the robots that have no record yet, and submit nothing.
#[derive(Args)]
#[command(after_help = "Examples:
  calib fleet render FLEET.yaml --engine slurm --store /shared/store > jobs.sh
  calib fleet render FLEET.yaml --engine k8s --store /store --image calib:0.2 --claim robots > job.yaml")]
pub(super) struct RenderArguments {
    #[command(flatten)]
    place: FleetLocation,
    #[arg(long, value_enum)]
    engine: Scheduler,
    #[command(flatten)]
    cluster: ClusterArguments,
    /// Container image of calib
    #[arg(
        long,
        value_name = "IMAGE",
        default_value = "calib",
        help_heading = "Cluster"
    )]
    image: String,
    /// Persistent volume claim that holds the store and the recordings
    #[arg(
        long,
        value_name = "NAME",
        default_value = "calib",
        help_heading = "Cluster"
    )]
    claim: String,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Scheduler {
    /// Scripts for sbatch
    Slurm,
    /// An Indexed Job of Kubernetes (experimental)
    K8s,
}

pub(super) fn main(arguments: &RenderArguments, command_line: &[OsString]) -> Result<()> {
    let store = arguments.place.store()?;
    let fleet = Fleet::load(&arguments.place.fleet, &store)?;
    let fresh = || surroundings(command_line);
    let workshop = workshop(&fleet, &store, &fresh);
    let mut note = run::note(&fleet, &arguments.place, &fresh().run_id)?;
    let missing: Vec<usize> = (0..)
        .zip(records(&workshop)?)
        .filter(|(_, record)| record.is_none())
        .map(|(k, _)| k)
        .collect();
    if missing.is_empty() {
        return Err(Error::spec(
            fleet.name(),
            "every robot is recorded: nothing to submit",
        ));
    }
    note.tasks = arguments.cluster.tasks(&missing);
    let options = arguments.cluster.options(store.root())?;
    let text: String = match arguments.engine {
        Scheduler::Slurm => {
            note.engine = "slurm".into();
            cluster::slurm(&note, &options)?
                .into_iter()
                .map(|script| script.text)
                .collect()
        }
        Scheduler::K8s => {
            note.engine = "k8s".into();
            cluster::kubernetes(&note, &options, &arguments.image, &arguments.claim)
        }
    };
    // The tasks find their robots there.
    workshop.ledger.put_run(&note)?;
    let folder = cluster::logs(&options.store, fleet.name());
    std::fs::create_dir_all(&folder)
        .map_err(|error| Error::store(folder.display().to_string(), error.to_string()))?;
    emit(&text)
}
