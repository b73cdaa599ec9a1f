//! `calib tag`: names for runs.

use super::emit;
use super::surroundings::open_store;
use crate::error::{Error, Result};
use crate::pipeline::find_run;
use clap::Args;
use std::path::PathBuf;

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

pub(super) fn main(arguments: &TagArguments) -> Result<()> {
    let store = open_store(arguments.store.as_deref())?;
    if let Some(name) = &arguments.delete {
        return match store.tags()?.contains_key(name) {
            true => store.untag(name),
            false => Err(Error::spec("--delete", format!("no tag `{name}`"))),
        };
    }
    match (&arguments.run, &arguments.name) {
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
