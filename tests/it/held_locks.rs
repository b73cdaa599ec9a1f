//! Locks of a store in a test's own hands: a run that needs one of them stands still there, however busy the machine is.

use serde_json::Value;
use std::fs::{self, File};
use std::path::Path;
use std::process::Child;
use std::time::Duration;

/// Held until it is dropped.
pub struct Held {
    _file: File,
}

/// Takes the lock of an action (`--json` does not name it: see [`actions_of`]); runs wait before that stage.
pub fn action(store: &Path, action: &str) -> Held {
    take(store, &store.join("locks"), action)
}

/// Takes the claim on a robot of a fleet by the key of its record; runs do the other robots and then wait.
pub fn robot(store: &Path, fleet: &str, key: &str) -> Held {
    take(store, &store.join("fleets").join(fleet).join("claims"), key)
}

fn take(store: &Path, folder: &Path, name: &str) -> Held {
    fs::create_dir_all(folder).unwrap();
    let format = store.join("format.json");
    if !format.exists() {
        // A folder with anything in it is a store only with this.
        fs::write(format, r#"{"calib_store":1}"#).unwrap();
    }
    let file = File::options()
        .create(true)
        .append(true)
        .open(folder.join(format!("{name}.lock")))
        .unwrap();
    file.try_lock().unwrap();
    Held { _file: file }
}

/// The actions of a run that is done, in the order of its stages.
pub fn actions_of(store: &Path, run: &str) -> Vec<String> {
    let manifest = fs::read(store.join("runs").join(run).join("manifest.json")).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let stages = manifest["stages"].as_array().unwrap().iter();
    stages
        .map(|stage| stage["action"].as_str().unwrap().to_string())
        .collect()
}

/// Waits until something holds while a child lives. Ten minutes are no measure of speed: a child that hangs ends the test.
pub fn until(child: &mut Child, mut holds: impl FnMut() -> bool) {
    const PAUSE: Duration = Duration::from_millis(2);
    for _ in 0..300_000 {
        if holds() {
            return;
        }
        if let Some(status) = child.try_wait().unwrap() {
            // It may have become true with the child's last breath.
            assert!(holds(), "the child ended with {status}");
            return;
        }
        std::thread::sleep(PAUSE);
    }
    let _ = child.kill();
    panic!("the child still runs and nothing comes of it");
}
