//! `calib gc`: takes away tables that no kept run needs; only when asked.

use super::surroundings::{now, open_store};
use super::{emit, emit_json};
use crate::audit::kept_actions;
use crate::error::{Result, counted};
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

pub(super) fn main(arguments: &GcArguments) -> Result<()> {
    let store = open_store(arguments.store.as_deref())?;
    let keep = kept_actions(
        &store,
        usize::try_from(arguments.keep_runs).unwrap_or(usize::MAX),
    )?;
    let grace = Duration::from_secs(u64::from(arguments.grace_hours) * 3600);
    let before = now().checked_sub(grace).unwrap_or(std::time::UNIX_EPOCH);
    let sweep = store.sweep(&keep, before, arguments.dry_run)?;
    if arguments.json {
        return emit_json(&sweep);
    }
    let verb = if arguments.dry_run {
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
            counted(arguments.grace_hours, "hour"),
            counted(sweep.young, "file")
        ));
    }
    emit(&text)
}
