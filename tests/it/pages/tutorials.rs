//! The tutorials: every command in them is run, and answers what stands below it.

use super::blocks::{fenced, root};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the commands of a tutorial in an empty folder that sees the pipelines, one block after the other, and compares the lines below a block
/// with what it printed.
fn followed(page: &str) {
    let text = fs::read_to_string(root().join("pipelines/tutorials").join(page)).expect("a page");
    let folder = tempfile::tempdir().expect("a folder");
    let (bin, desk) = (folder.path().join("bin"), folder.path().join("desk"));
    for folder in [&bin, &desk] {
        fs::create_dir(folder).expect("a folder");
    }
    let link = |from: &Path, to: &Path| std::os::unix::fs::symlink(from, to).expect("a link");
    link(Path::new(env!("CARGO_BIN_EXE_calib")), &bin.join("calib"));
    link(&root().join("pipelines"), &desk.join("pipelines"));
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", bin.display());
    let (mut printed, mut compared) = (String::new(), 0);
    for block in fenced(&text) {
        let lines = block.lines.join("\n");
        match block.kind {
            "sh" => {
                let output = Command::new("sh")
                    .args(["-e", "-c", &lines])
                    .current_dir(&desk)
                    .env("PATH", &path)
                    .output()
                    .expect("a shell");
                let errors = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{page}: {lines}\n{errors}");
                printed = String::from_utf8_lossy(&output.stdout).into_owned();
            }
            "text" => {
                for line in block.lines {
                    assert!(
                        printed.contains(line),
                        "{page}: `{line}` is not in\n{printed}"
                    );
                    compared += 1;
                }
            }
            other => panic!("{page}: a block of kind `{other}`"),
        }
    }
    assert!(compared > 2, "{page} shows nothing of what comes");
}

#[test]
fn the_tutorial_of_the_tracker_leads_to_a_certificate_and_corrected_targets() {
    followed("tracker.md");
}

#[test]
fn the_tutorial_of_torques_leads_to_friction_in_a_simulation() {
    followed("torques.md");
}

#[test]
fn the_tutorial_of_drives_leads_to_a_simulation_with_what_was_found() {
    followed("drives.md");
}
