//! Runs after the integration tests and lists those that had nothing to test: the real recordings beside the repository are missing.

#![expect(clippy::print_stdout, reason = "its list is its result")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

fn main() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("skipped");
    let notes = fs::read_dir(&folder).into_iter().flatten().flatten();
    let mut lines = BTreeSet::new();
    for note in notes {
        let test = note.file_name().to_string_lossy().replace(' ', "::");
        let why = fs::read_to_string(note.path()).unwrap_or_default();
        lines.extend(why.lines().map(|why| format!("  {test}: {why}\n")));
    }
    let _ = fs::remove_dir_all(folder);
    match lines.len() {
        0 => println!("\nnothing was skipped"),
        _ => println!(
            "\nskipped, for want of what they need:\n{}",
            lines.into_iter().collect::<String>()
        ),
    }
}
