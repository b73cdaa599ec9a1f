//! `calib verify`: everything in a store rehashed; exit code 1 where something is not what was written.

use super::surroundings::{bucket, default_store, open_store};
use super::{complain, emit, emit_json};
use crate::error::{Error, Result, counted};
use crate::store::Verification;
use clap::Args;
use std::path::PathBuf;

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

pub(super) fn main(arguments: &VerifyArguments) -> u8 {
    execute(arguments).unwrap_or_else(|error| complain(&error))
}

fn execute(arguments: &VerifyArguments) -> Result<u8> {
    let root = arguments.store.clone().unwrap_or_else(default_store);
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
    if arguments.json {
        emit_json(&found)?;
    } else {
        emit(&text(&found))?;
    }
    Ok(u8::from(!found.faults.is_empty()))
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
