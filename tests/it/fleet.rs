//! Fleets: many robots through one pipeline, whatever their names, whoever is killed.

mod browser;
mod causes;
mod killed;
mod names;
mod recalibrated;
mod rosters;

use crate::answer::{has, put, read, root, starts_with};
use crate::held_locks;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn pipeline() -> PathBuf {
    root("pipelines/fleet/pipeline.yaml")
}

fn calib(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calib"));
    command.args(words);
    command
}

fn fleet(verb: &str, file: &Path, store: &Path) -> Command {
    let mut command = calib(&["fleet", verb]);
    command.arg(file).arg("--store").arg(store);
    command
}

fn output(command: &mut Command) -> (Output, String) {
    let output = command.output().unwrap();
    let printed = String::from_utf8_lossy(&output.stderr).into_owned();
    (output, printed)
}

/// The document of a run that ends with a code.
fn run(file: &Path, store: &Path, code: i32) -> Value {
    let (output, printed) = output(fleet("run", file, store).args(["--json", "--quiet"]));
    assert_eq!(output.status.code(), Some(code), "{printed}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Recordings of different robots: `DIR/recordings/c0001`.
fn recordings(folder: &Path, cases: usize) {
    let (output, printed) = output(
        calib(&[
            "simulate", "conceal", "--points", "40", "--robot", "compact6", "--nulls", "1",
        ])
        .args([
            "--cases",
            &cases.to_string(),
            "--out",
            folder.to_str().unwrap(),
        ]),
    );
    assert!(output.status.success(), "{printed}");
}

fn write(path: PathBuf, text: &str) -> PathBuf {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(&path, text).unwrap();
    path
}

/// A fleet file beside its recordings.
fn file(folder: &Path, name: &str, tail: &str) -> PathBuf {
    let text = format!(
        "calib: 1\nname: {name}\npipeline: {}\n{tail}",
        pipeline().display()
    );
    write(folder.join(format!("{name}.yaml")), &text)
}

/// Robots of a fleet `line`, each a folder of recordings of its own.
struct Line {
    folder: tempfile::TempDir,
    cases: PathBuf,
    store: PathBuf,
    file: PathBuf,
}

impl Line {
    fn new(robots: usize) -> Self {
        Self::of(robots, "robots:\n  - folders: cases/recordings/*\n")
    }
    /// With these lines of its file.
    fn of(robots: usize, lines: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (cases, store) = (folder.path().join("cases"), folder.path().join("store"));
        recordings(&cases, robots);
        let file = file(folder.path(), "line", lines);
        Self {
            folder,
            cases,
            store,
            file,
        }
    }
    fn run(&self, code: i32) -> Value {
        run(&self.file, &self.store, code)
    }
    fn recording(&self, case: &str) -> PathBuf {
        self.cases.join("recordings").join(case)
    }
    /// Robots that stand, and those that were computed for it, of a run that ends with a code.
    fn stand(&self, code: i32) -> [Option<u64>; 2] {
        let answer = self.run(code);
        ["done", "computed"].map(|count| answer[count].as_u64())
    }
}

/// Hash of the fleet's tables by port.
fn tables(store: &Path, name: &str) -> BTreeMap<String, String> {
    let folder = store.join("tables").join(name);
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let bytes = std::fs::read(entry.path()).unwrap();
        found.insert(
            entry.file_name().into_string().unwrap(),
            blake3::hash(&bytes).to_hex().to_string(),
        );
    }
    assert!(found.len() > 1, "{found:?}");
    found
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().flatten() {
        std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

#[test]
fn broken_robots_are_listed_with_their_reasons_and_the_others_finish() {
    let line = Line::new(5);
    put(
        line.recording("c0002"),
        "tracker.csv",
        "point_id,x_mm\n1,wrong\n",
    );
    std::fs::remove_file(line.recording("c0003").join("robot.json")).unwrap();
    let (result, printed) = output(&mut fleet("run", &line.file, &line.store));
    assert_eq!(result.status.code(), Some(10), "{printed}");
    let faults = [
        "error: 2 faults",
        "c0002: rejected: ",
        "c0003: rejected: ",
        "robot.json",
    ];
    has(&printed, faults);
    let answer = line.run(10);
    assert_eq!(
        (
            answer["done"].as_u64(),
            answer["rejected"].as_u64(),
            answer["computed"].as_u64()
        ),
        (Some(3), Some(2), Some(0))
    );
    assert!(
        answer["robots"][0]["after_rms_mm"].as_f64().unwrap()
            < answer["robots"][0]["before_rms_mm"].as_f64().unwrap()
    );

    // Mended data are other data: the same command takes them up.
    copy(&line.recording("c0001"), &line.recording("c0003"));
    assert_eq!(line.stand(10), [Some(4), Some(1)]);
    // Asked for, what was rejected is tried again.
    let (result, printed) =
        output(fleet("retry", &line.file, &line.store).args(["--failed", "--json", "--quiet"]));
    assert_eq!(result.status.code(), Some(10), "{printed}");
    let answer: Value = serde_json::from_slice(&result.stdout).unwrap();
    assert_eq!(answer["computed"].as_u64(), Some(1));
    let (result, _) = output(fleet("status", &line.file, &line.store).args(["--robot", "c0002"]));
    let text = String::from_utf8(result.stdout).unwrap();
    starts_with(&text, "c0002: rejected\n");
    has(&text, "manifest.json");
}

#[test]
fn a_sweep_leaves_what_the_records_of_a_fleet_need() {
    let line = Line::new(3);
    line.run(0);
    // The same robot with other data: of two runs of its pipeline the earlier is a record's as well.
    let tracker = line.recording("c0001").join("tracker.csv");
    let before = read(&tracker);
    let shorter = before.trim_end().rsplit_once('\n').unwrap().0;
    std::fs::write(&tracker, format!("{shorter}\n")).unwrap();
    assert_eq!(line.run(0)["computed"].as_u64(), Some(1));
    let (result, printed) = output(
        calib(&["gc", "--keep-runs", "1", "--grace-hours", "0", "--store"]).arg(&line.store),
    );
    assert!(result.status.success(), "{printed}");
    std::fs::write(&tracker, before).unwrap();
    assert_eq!(
        line.run(0)["computed"].as_u64(),
        Some(0),
        "nothing that is recorded was taken"
    );
    let (result, _) = output(calib(&["verify", "--store"]).arg(&line.store));
    assert!(
        result.status.success(),
        "{}",
        String::from_utf8_lossy(&result.stdout)
    );
    // With its records a fleet gives its tables up.
    std::fs::remove_dir_all(line.store.join("fleets")).unwrap();
    let (result, _) = output(
        calib(&["gc", "--keep-runs", "1", "--grace-hours", "0", "--store"]).arg(&line.store),
    );
    let text = String::from_utf8_lossy(&result.stdout).into_owned();
    assert!(
        text.starts_with("removed ") && !text.starts_with("removed 0 tables"),
        "{text}"
    );
}

#[test]
fn a_cancelled_run_stops_and_the_next_goes_on() {
    let line = Line::new(12);
    // One robot that nobody can take, so that the run cannot be over before it is cancelled.
    let alone = line.folder.path().join("alone");
    let (result, printed) = output(fleet("run", &line.file, &alone).args(["--robot", "c0012"]));
    assert!(result.status.success(), "{printed}");
    let held = killed::hold(&alone, &line.store, "line", 1);
    let mut command = fleet("run", &line.file, &line.store);
    command
        .args(["--quiet", "-j", "1"])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped());
    let mut child = command.spawn().unwrap();
    held_locks::until(&mut child, || {
        !killed::records(&line.store, "line").is_empty()
    });
    let (result, printed) = output(&mut fleet("cancel", &line.file, &line.store));
    assert!(result.status.success(), "{printed}");
    assert_eq!(child.wait().unwrap().code(), Some(75));
    drop(held);
    let stood = killed::records(&line.store, "line").len();
    assert!((1..12).contains(&stood), "{stood}");
    assert_eq!(line.stand(0), [Some(12), Some(12 - stood as u64)]);
}

#[test]
fn every_fault_of_a_fleet_file_comes_at_once_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store");
    let text = "calib: 2\nname: a b\npipeline: none.yaml\nrobots:\n  - folder: x\n  - {folders: 'y*', list: z.csv}\npriors: 1\n";
    let path = write(folder.path().join("FLEET.yaml"), text);
    let (result, printed) = output(&mut fleet("run", &path, &store));
    assert_eq!(result.status.code(), Some(2));
    has(
        &printed,
        [
            "5:5: robots[0].folder: unknown key; did you mean `folders`?",
            "7:1: priors: unknown key; did you mean `prior`?",
        ],
    );
    let text = text
        .replace("folder: x", "list: none.csv")
        .replace("priors: 1\n", "");
    let path = write(folder.path().join("FLEET.yaml"), &text);
    let (_, printed) = output(&mut fleet("run", &path, &store));
    has(
        &printed,
        [
            "calib: format 2",
            "expected letters, digits, `-` and `_`",
            "robots[1]: expected exactly one",
        ],
    );
    let file = file(
        folder.path(),
        "sound",
        "robots:\n  - folders: nothing/*\noverrides:\n  - {robots: [r7]}\n",
    );
    let (_, printed) = output(&mut fleet("run", &file, &store));
    has(
        &printed,
        [
            "robots[0].folders: no folder matches",
            "overrides[0].robots[0]: no robot",
        ],
    );
}

#[test]
fn folders_of_robots_may_be_named_from_the_root() {
    let folder = tempfile::tempdir().unwrap();
    let cells = folder.path().join("cells");
    for name in ["north", "south"] {
        std::fs::create_dir_all(cells.join(name)).unwrap();
    }
    let file = file(
        &folder.path().join("elsewhere"),
        "far",
        &format!("robots:\n  - folders: {}/*\n", cells.display()),
    );
    let (result, _) = output(&mut fleet("status", &file, &folder.path().join("store")));
    let text = String::from_utf8(result.stdout).unwrap();
    has(&text, "fleet far: 0 of 2 robots done");
}
