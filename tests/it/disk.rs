//! A disk that refuses: the run says what to do, keeps what is finished and goes on when it can.

use crate::answer::{has, root};
use std::path::Path;
use std::process::{Command, Output};

fn pipeline() -> std::path::PathBuf {
    root("tests/it/resume/pipeline.yaml")
}
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Files may grow to so many blocks of 512 bytes; writing more fails as on a full disk.
#[cfg(unix)]
fn run_within(blocks: u32, store: &Path) -> Output {
    let script = format!(
        "trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" run \"$1\" --quiet --json --store \"$2\""
    );
    let mut shell = Command::new("sh");
    shell
        .args(["-c", &script, env!("CARGO_BIN_EXE_calib")])
        .arg(pipeline())
        .arg(store)
        .output()
        .unwrap()
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_said_so_and_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store");
    for blocks in [8, 32, 48] {
        let full = run_within(blocks, &store);
        assert_eq!(
            full.status.code(),
            Some(75),
            "{blocks} blocks: {}",
            text(&full.stderr)
        );
        let printed = text(&full.stderr);
        has(&printed, ["free some space there", "--store DIR"]);
        let failure: serde_json::Value = serde_json::from_slice(&full.stdout).unwrap();
        assert_eq!(
            (&failure["status"], &failure["exit_code"]),
            (&"failed".into(), &75.into())
        );
    }
    let after = Command::new(env!("CARGO_BIN_EXE_calib"))
        .arg("run")
        .arg(pipeline())
        .arg("--store")
        .arg(&store)
        .output()
        .unwrap();
    assert!(after.status.success(), "{}", text(&after.stderr));
    has(&text(&after.stderr), "robot     cached");
    let left: Vec<_> = std::fs::read_dir(store.join("tmp"))
        .unwrap()
        .flatten()
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// /sys takes no files from anybody.
#[cfg(target_os = "linux")]
#[test]
fn a_read_only_place_for_the_store_is_said_so() {
    let store = Path::new("/sys/calib-store");
    let refused = Command::new(env!("CARGO_BIN_EXE_calib"))
        .arg("run")
        .arg(pipeline())
        .arg("--store")
        .arg(store)
        .output()
        .unwrap();
    assert_eq!(refused.status.code(), Some(75));
    let printed = text(&refused.stderr);
    has(
        &printed,
        [
            "/sys/calib-store: cannot make the folder",
            "choose another with --store DIR",
        ],
    );
}
