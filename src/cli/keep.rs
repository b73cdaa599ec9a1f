//! What keeps a store in order: `calib tag` names runs, `calib verify` hashes everything again (exit code 1 where something is not what
//! was written), `calib gc` takes away tables that no kept run needs.

use super::surroundings::{bucket, default_store, now, open_store};
use super::{emit, emit_json};
use crate::audit::kept_actions;
use crate::error::{Error, Result, counted};
use crate::pipeline::find_run;
use crate::store::Verification;
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

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
    pub fn run(&self) -> Result<()> {
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
        let verb = if self.dry_run {
            "would remove"
        } else {
            "removed"
        };
        let mut text = format!(
            "{verb} {} and {}, {:.1} MB; kept: {}\n",
            counted(sweep.objects, "table"),
            counted(sweep.actions, "action record"),
            sweep.bytes as f64 / 1e6,
            counted(sweep.kept_objects, "table")
        );
        if sweep.young > 0 {
            text.push_str(&format!(
                "kept only because younger than {}: {}\n",
                counted(self.grace_hours, "hour"),
                counted(sweep.young, "file")
            ));
        }
        emit(&text)
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
    pub fn run(&self) -> Result<()> {
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
#[command(
    after_help = "Exit codes: 0 all is as it was written; 1 something is not; 2 wrong usage; 75 the disk refuses."
)]
pub(super) struct VerifyArguments {
    /// The store [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl VerifyArguments {
    pub fn run(&self) -> Result<u8> {
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
            emit(&text(&found))?;
        }
        Ok(u8::from(!found.faults.is_empty()))
    }
}

fn text(found: &Verification) -> String {
    const SHOWN: usize = 50; // a store that is damaged all over need not be listed
    let mut text: String = found
        .faults
        .iter()
        .take(SHOWN)
        .map(|fault| format!("{fault}\n"))
        .collect();
    if found.faults.len() > SHOWN {
        text.push_str(&format!("and {} more\n", found.faults.len() - SHOWN));
    }
    text.push_str(&format!(
        "{} ({:.1} MB), {}, {}, {}, {} for people: ",
        counted(found.objects, "table"),
        found.bytes as f64 / 1e6,
        counted(found.actions, "action record"),
        counted(found.runs, "run"),
        counted(found.tags, "tag"),
        counted(found.copies, "copy")
    ));
    text.push_str(&match found.faults.len() {
        0 => "all as they were written\n".to_string(),
        faults => format!("{}\n", counted(faults, "fault")),
    });
    text
}
